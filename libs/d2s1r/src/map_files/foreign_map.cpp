// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_files/foreign_map.h"

#include <d2s1r/map_stream.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <new>
#include <stdexcept>

#include "base/checked_value.h"

namespace d2s1r
{
namespace
{
/// Returns the path of the program: D2S1R_MAP_READER, from the folder of this library on.
std::string path_of_reader()
{
	Dl_info library = {};
	if (dladdr(reinterpret_cast<const void*>(&read_foreign_map), &library) == 0) return {};
	return (std::filesystem::path(library.dli_fname).parent_path() / D2S1R_MAP_READER).string();
}

/// The program that reads a map file, while it runs.
class Reader
{
   public:
	Reader(const std::string& program, const std::string& file, const std::string& cell_size)
	{
		std::array<int, 2> ends = {-1, -1};
		if (pipe2(ends.data(), O_CLOEXEC) != 0) fail(errno);
		posix_spawn_file_actions_t actions;
		posix_spawn_file_actions_init(&actions);
		posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
		posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
		posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
		std::array<std::string, 3> words = {program, file, cell_size};
		std::array<char*, 4> arguments = {words[0].data(), words[1].data(), words[2].data(), nullptr};
		const int error = posix_spawn(&id_, program.c_str(), &actions, nullptr, arguments.data(), environ);
		posix_spawn_file_actions_destroy(&actions);
		close(ends[1]);
		pipe_ = ends[0];
		if (error == 0) return;
		close(pipe_);
		fail(error);
	}
	~Reader()
	{
		close(pipe_);  // which ends the program if it is still writing
		while (waitpid(id_, nullptr, 0) < 0 && errno == EINTR)
		{
		}
	}
	Reader(const Reader&) = delete;
	Reader& operator=(const Reader&) = delete;

	/// Reads up to `count` bytes. \return fewer only at the end
	std::size_t read(char* bytes, std::size_t count)
	{
		std::size_t filled = 0;
		while (filled < count)
		{
			const ssize_t got = ::read(pipe_, bytes + filled, count - filled);
			if (got < 0 && errno == EINTR) continue;
			if (got <= 0) break;
			filled += static_cast<std::size_t>(got);
		}
		return filled;
	}

   private:
	[[noreturn]] static void fail(int error)
	{
		throw std::runtime_error(
		    std::string("cannot be read by a program of its own (") + std::strerror(error) +
		    "); allow the program more open files and processes (ulimit -n, ulimit -u)");
	}

	int pipe_ = -1;
	pid_t id_ = 0;
};

[[noreturn]] void refuse_as_crashed()
{
	throw std::runtime_error("its reader crashes on it; it is damaged or far too large: copy or save it again");
}
}  // namespace

OccupancyMap read_foreign_map(const std::string& file, const GridParameters& parameters)
{
	const std::string program = path_of_reader();
	if (access(program.c_str(), X_OK) != 0)
		throw std::runtime_error("is no .yaml and no image, and maps of MRPT need the package " D2S1R_MRPT_PACKAGE
		                         "; install it, or name the .yaml of a map");
	Reader reader(program, file, to_text(parameters.simplemap_cell_size));
	char first = 0;
	reader.read(&first, 1);
	switch (static_cast<MapReaderSays>(first))
	{
		case MapReaderSays::kMap:
			return read_map(
			    [&](char* bytes, std::size_t count)
			    {
				    if (reader.read(bytes, count) != count) refuse_as_crashed();
			    });
		case MapReaderSays::kOutOfMemory:
			throw std::bad_alloc();
		case MapReaderSays::kError:
		{
			std::string error(1 << 12, '\0');
			error.resize(reader.read(error.data(), error.size()));
			throw std::runtime_error(error);
		}
	}
	refuse_as_crashed();
}
}  // namespace d2s1r
