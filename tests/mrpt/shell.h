// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace d2s1r::test
{
struct CommandResult
{
	int status = -1;     //!< exit status, or 128 + signal
	std::string output;  //!< standard output and error
};

/// Runs `command` in a shell, standard input empty (MRPT's applications wait for a key on errors).
inline CommandResult run_command(const std::string& command)
{
	FILE* pipe = popen(("( " + command + " ) < /dev/null 2>&1").c_str(), "r");
	if (!pipe) throw std::runtime_error("cannot run: " + command);
	CommandResult result;
	std::array<char, 4096> buffer{};
	while (const std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe)) result.output.append(buffer.data(), n);
	const int status = pclose(pipe);
	result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
	return result;
}

inline bool has_command(const std::string& name)
{
	return run_command("command -v " + name).status == 0;
}
}  // namespace d2s1r::test
