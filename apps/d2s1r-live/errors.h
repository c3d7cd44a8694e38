// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/errors.h>

#include <stdexcept>
#include <string>

namespace d2s1r::live
{
/// The exit status of the process, as rawlog-localize has it.
enum ExitStatus : int
{
	kDone = 0,
	kWrongUse = 1,
	kBadInput = 2,
	kBadOutput = 3,
	kInterrupted = 130
};

/// An error that the user can mend. The message is one line "WHERE: what is wrong, and what to do".
class UserError : public std::runtime_error
{
   public:
	UserError(ExitStatus exit_status, const std::string& where, const std::string& what)
	    : std::runtime_error(printable(where + ": " + what)), status(exit_status)
	{
	}
	const ExitStatus status;
};
}  // namespace d2s1r::live
