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

/// Says why a stock program of MRPT cannot be run with `ours`, a module or program, or with what it wrote; empty if it
/// can.
inline std::string why_not(const std::string& program, const std::string& ours)
{
	if (run_command("command -v " + program).status != 0) return program + " is not installed (mrpt-apps)";
	const auto library = [](const std::string& file)
	{ return run_command("ldd " + file + " | grep -o 'libmrpt.obs\\.so[.0-9]*' | head -n 1").output; };
	const std::string its = library("$(command -v " + program + ")"), wanted = library(ours);
	return its == wanted ? "" : program + " is of another version of MRPT than " + ours + ": " + its + "and " + wanted;
}
}  // namespace d2s1r::test
