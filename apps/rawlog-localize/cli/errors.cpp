// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cli/errors.h"

#include <mrpt/core/exceptions.h>

#include <algorithm>
#include <cctype>
#include <sstream>

namespace d2s1r::app
{
namespace
{
const std::string kMrptReport = "====";
}

std::string one_line(const std::exception& exception)
{
	if (dynamic_cast<const std::bad_alloc*>(&exception)) return "not enough memory";
	const auto* with_stack = dynamic_cast<const mrpt::ExceptionWithCallBackBase*>(&exception);
	std::string report = with_stack ? with_stack->originalWhat : exception.what();
	if (!with_stack && report.find(kMrptReport) == std::string::npos)
	{
		const auto is_control = [](unsigned char c) { return std::iscntrl(c) != 0; };
		std::replace_if(report.begin(), report.end(), is_control, '?');  // names of files may hold any
		return report;
	}
	std::istringstream text(report);
	const char* const blank = " \t\r";
	for (std::string line; std::getline(text, line);)
	{
		const auto first = line.find_first_not_of(blank);
		if (first == std::string::npos || line.compare(first, kMrptReport.size(), kMrptReport) == 0) continue;
		return line.substr(first, line.find_last_not_of(blank) - first + 1);
	}
	return "unknown error";
}

UserError about(const std::string& file, ExitStatus status, const std::exception& exception)
{
	const std::string line = one_line(exception);
	if (line.rfind(file + ":", 0) != 0) return UserError(status, file, line);
	const auto end = line.find(": ", file.size());  // of "FILE: " or "FILE:LINE: "
	return UserError(status, line.substr(0, end), line.substr(end + 2));
}
}  // namespace d2s1r::app
