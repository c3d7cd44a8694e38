// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>
#include <stdexcept>
#include <string>

namespace d2s1r::logs
{
/// Returns a text without what would control a terminal, or end the text of an exception (NUL); names of files and
/// lasers may hold anything.
std::string printable(std::string text);

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

/// Returns whether memory ran out, which libraries tell in ways of their own.
bool is_out_of_memory(const std::exception& exception);

/// Returns the first meaningful line of an exception's text, printable and without MRPT's call stacks.
std::string one_line(const std::exception& exception);

/// Returns what to do about an error number of the system: `usual`, or to allow more open files if that is it.
const char* advice_on(int error, const char* usual);

/// Returns what is said of a log that the system failed to read, and what to do.
/// \param where how far it was read, such as "after line 3"; empty: not at all
/// \param reason of the system
std::string unread(const std::string& where, const std::string& reason);

/// Returns the error that a file cannot be opened, with the reason in errno. \throws std::bad_alloc if that is memory
LogError cannot_open(const std::string& file);
}  // namespace d2s1r::logs
