// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Any text as an ini file: refused with one line, or read as parameters that are in range and write themselves back.
#include <d2s1r/parameters.h>

#include <stdexcept>

#include "fuzz_input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
	using namespace d2s1r;
	Parameters parameters;
	try
	{
		parameters = parse_parameters({reinterpret_cast<const char*>(data), size}, "case.ini");
	}
	catch (const std::invalid_argument& error)
	{
		fuzz::require_one_line(error.what());
		fuzz::require(std::string(error.what()).rfind("case.ini:", 0) == 0, "a message that names the file");
		return 0;
	}
	check(parameters);
	const std::string ini = to_ini(parameters);
	fuzz::require(to_ini(parse_parameters(ini)) == ini, "parameters that are written and read come back");
	return 0;
}
