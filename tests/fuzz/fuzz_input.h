// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What the fuzz targets share: the bytes of a case as numbers and as a file, and what a failure does.
#pragma once

#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <string>

#if defined(__SANITIZE_ADDRESS__)  // GCC has the functions of <sanitizer/allocator_interface.h>, but not the header
extern "C" std::size_t __sanitizer_get_current_allocated_bytes();
extern "C" int __sanitizer_install_malloc_and_free_hooks(
    void (*on_malloc)(const volatile void*, std::size_t), void (*on_free)(const volatile void*));
#endif

/// The entry point of libFuzzer, and of replay.cpp.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace d2s1r::fuzz
{
/// Ends the program as a finding of the fuzzer if `holds` is false.
inline void require(bool holds, const std::string& what)
{
	if (holds) return;
	std::fprintf(stderr, "broken promise: %s\n", what.c_str());
	std::abort();
}

/// Requires that a message to the user is one line and says something.
inline void require_one_line(const std::string& message)
{
	require(!message.empty() && message.find('\n') == std::string::npos, "a message of one line: " + message);
}

/// Kills the processes of their own of this program, in which MRPT's readers work, when they take more than 1 GB.
/// Their limit is one of address space, of which AddressSanitizer takes so much beforehand that none is ever refused.
inline void limit_memory_of_own_processes()
{
#if defined(__SANITIZE_ADDRESS__)
	static const pid_t program = getpid();
	const auto look = [](const volatile void*, std::size_t)
	{
		constexpr std::size_t kMost = 1'000'000'000;  // [byte]
		if (getpid() != program && __sanitizer_get_current_allocated_bytes() > kMost) std::raise(SIGKILL);
	};
	static const int installed = __sanitizer_install_malloc_and_free_hooks(look, [](const volatile void*) {});
	require(installed != 0, "a hook of the allocator");
#endif
}

/// Hands out the bytes of a case as numbers; zeros when they are used up.
class Numbers
{
   public:
	Numbers(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

	bool empty() const { return left_ == 0; }

	std::uint8_t byte()
	{
		if (left_ == 0) return 0;
		left_--;
		return *data_++;
	}

	/// A whole number in [least, greatest].
	int whole(int least, int greatest)
	{
		const unsigned number = byte() * 256U + byte();
		return least + static_cast<int>(number % static_cast<unsigned>(greatest - least + 1));
	}

	/// A number in [least, greatest].
	double between(double least, double greatest) { return least + (greatest - least) * whole(0, 65535) / 65535; }

	/// A number in [least, greatest], or rarely one that nobody expects: NaN, infinite, huge, tiny.
	double odd(double least, double greatest)
	{
		constexpr double kOdd[] = {NAN, INFINITY, -INFINITY, 1e308, -1e308, 1e-308, 0.0, -0.0, 1e9, -1e9, 3e38};
		const unsigned choice = byte();
		if (choice >= 4 * std::size(kOdd)) return between(least, greatest);
		return choice % 4 == 0 ? kOdd[choice / 4] : between(least, greatest);
	}

	bool flip() { return byte() % 2 != 0; }

   private:
	const std::uint8_t* data_;
	std::size_t left_;
};

/// A file in memory that holds the bytes of a case. It is removed when the program ends, unless that crashes.
class CaseFile
{
   public:
	explicit CaseFile(const std::string& name) : path_("/dev/shm/d2s1r-fuzz-" + std::to_string(getpid()) + "-" + name)
	{
	}
	~CaseFile() { std::remove(path_.c_str()); }
	CaseFile(const CaseFile&) = delete;
	CaseFile& operator=(const CaseFile&) = delete;

	const std::string& write(const std::uint8_t* data, std::size_t size) const
	{
		std::ofstream(path_, std::ios::binary)
		    .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
		return path_;
	}
	const std::string& path() const { return path_; }

   private:
	std::string path_;
};
}  // namespace d2s1r::fuzz
