// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "console.h"

#include "errors.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

namespace d2s1r::app
{
namespace
{
/// If 0, 1 or 2 is closed, the next file that is opened would get the number, and what is printed with it. Read-only:
/// printing fails.
void fill_closed_descriptors()
{
	int unused = 0;
	while (unused >= 0 && unused <= STDERR_FILENO) unused = open("/dev/null", O_RDONLY | O_CLOEXEC);
	close(unused);
}
}  // namespace

Console::Console() : out(std::cout.rdbuf(nullptr)), err(std::cerr.rdbuf(nullptr)), old_log_(std::clog.rdbuf(nullptr))
{
	fill_closed_descriptors();
}

Console::~Console()
{
	std::cout.rdbuf(out.rdbuf());
	std::cerr.rdbuf(err.rdbuf());
	std::clog.rdbuf(old_log_);
}

void Console::check_written()
{
	if (!out.flush()) throw UserError(kBadOutput, "standard output", "cannot be written; check where it leads to");
}

SilentDescriptors::SilentDescriptors() : old_out_(dup(STDOUT_FILENO)), old_err_(dup(STDERR_FILENO))
{
	const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
	dup2(nowhere, STDOUT_FILENO);
	dup2(nowhere, STDERR_FILENO);
	close(nowhere);
}

SilentDescriptors::~SilentDescriptors()
{
	std::fflush(stdout);
	dup2(old_out_, STDOUT_FILENO);
	dup2(old_err_, STDERR_FILENO);
	close(old_out_);
	close(old_err_);
}
}  // namespace d2s1r::app
