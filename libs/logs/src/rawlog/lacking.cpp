// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The library without rawlogs.
#include "formats.h"
#include "logs/errors.h"

namespace d2s1r::logs
{
const bool kReadsRawlogs = false;

namespace
{
[[noreturn]] void refuse(const std::string& file, const std::string& what)
{
	throw LogError(
	    file, what + " a rawlog of MRPT, which this program was built without; use the program of the Debian package " +
	              "d2s1r-tools, or build it with MRPT");
}
}  // namespace

Log open_rawlog(const std::string& file, const Stop& /*stop*/, const Labels& /*left_out*/)
{
	refuse(file, "is");
}

Log open_live_log(
    const std::string& file, const std::optional<std::string>& /*label*/, const Stop& /*stop*/,
    const Labels& /*left_out*/, const std::function<void()>& /*prepare*/)
{
	refuse(file == kStandardInput ? "standard input" : file, "is read while it is written, as");
}
}  // namespace d2s1r::logs
