// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/errors.h>

#include <stdexcept>
#include <string>

namespace d2s1r::app
{
enum ExitStatus : int
{
	kDone = 0,
	kWrongUse = 1,   //!< of the program or its configuration
	kBadInput = 2,   //!< that cannot be read or used
	kBadOutput = 3,  //!< that cannot be written
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

/// Makes a UserError of what a library says about `file`, unless it is one. The file is named once, whether or not the
/// library named it.
inline UserError about(const std::string& file, ExitStatus status, const std::exception& exception)
{
	if (const auto* const known = dynamic_cast<const UserError*>(&exception)) return *known;
	const std::string line = one_line(exception), name = printable(file);
	if (line.rfind(name + ":", 0) != 0) return UserError(status, name, line);
	const auto end = line.find(": ", name.size());  // of "FILE: " or "FILE:LINE: "
	return UserError(status, line.substr(0, end), line.substr(end + 2));
}
}  // namespace d2s1r::app
