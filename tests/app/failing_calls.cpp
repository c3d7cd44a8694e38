// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Is preloaded into rawlog-localize and lets calls fail that seldom fail by themselves. The environment says which:
// D2S1R_FAIL_READ=NAME:N    reads of files whose path ends like NAME fail from byte N on
// D2S1R_FAIL_NEW=N          the N-th call of operator new throws, counted from when main() starts to catch signals
// D2S1R_FAIL_MALLOC=LEAST:MOST:N
//                           of the calls of malloc() and its kin for LEAST to MOST bytes, counted from then on, the
//                           N-th returns no memory; if N is 0, all do
// D2S1R_HANG_RENAME=FILE    the first rename() makes FILE and never returns
// D2S1R_COUNT=FILE          how many calls of operator new and of malloc() there were is written to FILE at the end
#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

namespace
{
std::atomic<long> calls{-1};  // [-] of operator new so far; negative before they are counted
const long kFailingCall = std::getenv("D2S1R_FAIL_NEW") ? std::atol(std::getenv("D2S1R_FAIL_NEW")) : 0;

std::atomic<long> malloc_calls{0};  // [-] of the sizes that may fail
// [byte], [byte], [-] as D2S1R_FAIL_MALLOC says. Calls of malloc() come before these are set, too.
std::size_t least_failing = 1, most_failing = 0;
long failing_malloc = 0;

const bool kIsSet = []
{
	const char* const text = std::getenv("D2S1R_FAIL_MALLOC");
	return text && std::sscanf(text, "%zu:%zu:%ld", &least_failing, &most_failing, &failing_malloc) == 3;
}();

bool malloc_fails(std::size_t size)
{
	if (calls < 0 || size < least_failing || size > most_failing) return false;
	const long call = ++malloc_calls;
	if (failing_malloc != 0 && call != failing_malloc) return false;
	errno = ENOMEM;
	return true;
}

template <class Function>
Function next(const char* name)
{
	return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

/// Returns the byte from which on reads of this file fail, or -1.
long failing_byte(int descriptor)
{
	const char* const chosen = std::getenv("D2S1R_FAIL_READ");
	const char* const colon = chosen ? std::strrchr(chosen, ':') : nullptr;
	if (!colon) return -1;
	char link[64], path[4096];
	std::snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
	const ssize_t length = readlink(link, path, sizeof path);
	const auto name = static_cast<std::size_t>(colon - chosen);
	if (length < static_cast<ssize_t>(name)) return -1;
	return std::strncmp(path + length - static_cast<ssize_t>(name), chosen, name) == 0 ? std::atol(colon + 1) : -1;
}

void* allocate(std::size_t size)
{
	if (calls >= 0 && ++calls == kFailingCall) return nullptr;
	return std::malloc(size > 0 ? size : 1);
}

struct AtEnd
{
	~AtEnd()
	{
		const char* const name = std::getenv("D2S1R_COUNT");
		std::FILE* const file = name ? std::fopen(name, "w") : nullptr;
		if (!file) return;
		std::fprintf(file, "%ld %ld\n", calls.load(), malloc_calls.load());
		std::fclose(file);
	}
} at_end;
}  // namespace

extern "C"
{
	void* __libc_malloc(std::size_t size);
	void* __libc_calloc(std::size_t count, std::size_t size);
	void* __libc_realloc(void* memory, std::size_t size);
	void* __libc_memalign(std::size_t alignment, std::size_t size);

	void* malloc(std::size_t size) noexcept
	{
		return malloc_fails(size) ? nullptr : __libc_malloc(size);
	}
	void* calloc(std::size_t count, std::size_t size) noexcept
	{
		return malloc_fails(count * size) ? nullptr : __libc_calloc(count, size);
	}
	void* realloc(void* memory, std::size_t size) noexcept
	{
		return malloc_fails(size) ? nullptr : __libc_realloc(memory, size);
	}
	int posix_memalign(void** memory, std::size_t alignment, std::size_t size) noexcept
	{
		*memory = malloc_fails(size) ? nullptr : __libc_memalign(alignment, size);
		return *memory ? 0 : ENOMEM;
	}
}

namespace
{
/// Calls `real` with how many of `count` bytes, from the byte `at` of the file on, can be read before `end`; fails if
/// none can. If `end` is negative, all can.
template <class Read>
ssize_t read_before(long end, long at, std::size_t count, const Read& real)
{
	if (end < 0) return real(count);
	if (at < end) return real(std::min(count, static_cast<std::size_t>(end - at)));
	errno = EIO;
	return -1;
}
}  // namespace

extern "C" ssize_t read(int descriptor, void* buffer, std::size_t count)
{
	static const auto real = next<ssize_t (*)(int, void*, std::size_t)>("read");
	const long end = failing_byte(descriptor), at = end < 0 ? 0 : lseek(descriptor, 0, SEEK_CUR);
	return read_before(end, at, count, [&](std::size_t size) { return real(descriptor, buffer, size); });
}

extern "C" ssize_t pread(int descriptor, void* buffer, std::size_t count, off_t at)
{
	static const auto real = next<ssize_t (*)(int, void*, std::size_t, off_t)>("pread");
	return read_before(
	    failing_byte(descriptor), at, count, [&](std::size_t size) { return real(descriptor, buffer, size, at); });
}

extern "C" ssize_t pread64(int descriptor, void* buffer, std::size_t count, off64_t at)
{
	static const auto real = next<ssize_t (*)(int, void*, std::size_t, off64_t)>("pread64");
	return read_before(
	    failing_byte(descriptor), at, count, [&](std::size_t size) { return real(descriptor, buffer, size, at); });
}

extern "C" int rename(const char* from, const char* to) noexcept
{
	static const auto real = next<int (*)(const char*, const char*)>("rename");
	const char* const name = std::getenv("D2S1R_HANG_RENAME");
	if (!name) return real(from, to);
	std::fclose(std::fopen(name, "w"));
	for (;;) pause();
}

extern "C" int sigaction(int number, const struct sigaction* action, struct sigaction* old)
{
	static const auto real = next<int (*)(int, const struct sigaction*, struct sigaction*)>("sigaction");
	long not_yet = -1;
	calls.compare_exchange_strong(not_yet, 0);
	return real(number, action, old);
}

void* operator new(std::size_t size)
{
	void* const memory = allocate(size);
	if (!memory) throw std::bad_alloc();
	return memory;
}
void* operator new[](std::size_t size)
{
	return operator new(size);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept
{
	return allocate(size);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept
{
	return allocate(size);
}
void operator delete(void* memory) noexcept
{
	std::free(memory);
}
void operator delete[](void* memory) noexcept
{
	std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept
{
	std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept
{
	std::free(memory);
}
