// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace d2s1r::app
{
/// What the process returns.
enum ExitStatus : int
{
	kDone = 0,
	kWrongUse = 1,
	kBadInput = 2,
	kBadOutput = 3,
	kInterrupted = 130
};

/// An error the user can mend; the message is one line "WHERE: what is wrong, and what to do".
class UserError : public std::runtime_error
{
   public:
	UserError(ExitStatus exit_status, const std::string& where, const std::string& what)
	    : std::runtime_error(where + ": " + what), status(exit_status)
	{
	}
	const ExitStatus status;
};

/// The first meaningful line of an exception's text, without MRPT's call stacks.
std::string one_line(const std::exception& exception);

/// An exception of a library about `file` as a UserError; names the file if the library did not.
UserError about(const std::string& file, ExitStatus status, const std::exception& exception);
}  // namespace d2s1r::app
