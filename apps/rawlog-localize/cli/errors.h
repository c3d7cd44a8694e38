// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace d2s1r::app
{
/// The exit status of the process.
enum ExitStatus : int
{
	kDone = 0,
	kWrongUse = 1,
	kBadInput = 2,
	kBadOutput = 3,
	kInterrupted = 130
};

/// What is told if a run is interrupted when there is nothing to write yet.
inline constexpr const char* kInterruptedEarly = "interrupted before the first frame; no results are written";

/// An error that the user can mend. The message is one line "WHERE: what is wrong, and what to do".
class UserError : public std::runtime_error
{
   public:
	UserError(ExitStatus exit_status, const std::string& where, const std::string& what)
	    : std::runtime_error(where + ": " + what), status(exit_status)
	{
	}
	const ExitStatus status;
};

/// Returns a text without what would control a terminal; names of files and lasers may hold anything.
std::string printable(std::string text);

/// Returns whether memory ran out, which libraries tell in ways of their own.
bool is_out_of_memory(const std::exception& exception);

/// Returns the first meaningful line of an exception's text, printable and without MRPT's call stacks.
std::string one_line(const std::exception& exception);

/// Returns the error that an input cannot be opened, with the reason in errno.
UserError cannot_open(const std::string& file);

/// Makes a UserError of what a library says about `file`. The file is named once, whether or not the library named it.
UserError about(const std::string& file, ExitStatus status, const std::exception& exception);
}  // namespace d2s1r::app
