// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/errors.h>

#include <exception>
#include <stdexcept>
#include <string>

namespace d2s1r::logs
{
/// Says that a log cannot be read. The message is one line "FILE: what is wrong, and what to do".
class LogError : public std::runtime_error
{
   public:
	LogError(const std::string& file, const std::string& what) : std::runtime_error(printable(file + ": " + what)) {}
};

/// Says why the system failed to read a file; the message is the reason alone.
class ReadError : public std::runtime_error
{
   public:
	using std::runtime_error::runtime_error;
};

/// Says that the caller asked to stop, see open_log().
class Interrupted : public std::exception
{
};

/// Returns what is said of a log that the system failed to read, and what to do.
/// \param where how far it was read, such as "after line 3"; empty: not at all
/// \param reason of the system
std::string unread(const std::string& where, const std::string& reason);

/// Returns the error that a file cannot be opened, with the reason in errno. \throws std::bad_alloc if that is memory
LogError cannot_open(const std::string& file);
}  // namespace d2s1r::logs
