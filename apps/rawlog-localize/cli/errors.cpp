// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cli/errors.h"

namespace d2s1r::app
{
UserError about(const std::string& file, ExitStatus status, const std::exception& exception)
{
	const std::string line = one_line(exception), name = printable(file);
	if (line.rfind(name + ":", 0) != 0) return UserError(status, name, line);
	const auto end = line.find(": ", name.size());  // of "FILE: " or "FILE:LINE: "
	return UserError(status, line.substr(0, end), line.substr(end + 2));
}
}  // namespace d2s1r::app
