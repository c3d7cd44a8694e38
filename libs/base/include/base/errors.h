// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>
#include <stdexcept>
#include <string>

namespace d2s1r
{
/// Returns a text without what would control a terminal, or end the text of an exception (NUL): each such character
/// becomes `?`. Names of files, maps and lasers may hold anything.
std::string printable(std::string text);

/// Returns the start of a text that may be anything, such as a line of a file, as it can stand in a message: at most 60
/// characters, with `?` for all that is not printable ASCII.
std::string excerpt(const std::string& text);

/// Says that something is not damaged, but cannot be read. The text is a predicate of it, and says what to do.
class Unreadable : public std::runtime_error
{
   public:
	explicit Unreadable(const std::string& what) : std::runtime_error(printable(what)) {}
};

/// Returns whether memory ran out, which libraries tell in ways of their own.
bool is_out_of_memory(const std::exception& exception);

/// Returns the first meaningful line of an exception's text, printable and without MRPT's call stacks.
std::string one_line(const std::exception& exception);

/// Returns what to do about an error number of the system: what mends that error if it is a known one, else `usual`.
const char* advice_on(int error, const char* usual);
}  // namespace d2s1r
