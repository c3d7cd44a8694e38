// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "logs/errors.h"

#include <cerrno>
#include <cstring>
#include <new>

namespace d2s1r::logs
{
std::string unread(const std::string& where, const std::string& reason)
{
	return "cannot be read" + (where.empty() ? "" : " " + where) + " (" + reason +
	       "); check the disk or the connection, or copy the log again";
}

LogError cannot_open(const std::string& file)
{
	if (errno == 0 || errno == ENOMEM) throw std::bad_alloc();  // zlib leaves errno alone when memory runs out
	const char* const advice = advice_on(errno, "check the file and the disk");
	return LogError(file, std::string("cannot be opened (") + std::strerror(errno) + "); " + advice);
}
}  // namespace d2s1r::logs
