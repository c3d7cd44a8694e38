// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a map file in one of MRPT's formats: refused with one line, or a map that a localizer is built of.
// MRPT's readers work in a process of their own, whose coverage libFuzzer does not see.
#include <shell/errors.h>
#include <shell/indexed_maps.h>

#include "fuzz_input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
	using namespace d2s1r;
	static const fuzz::CaseFile file("map.gridmap");
	fuzz::limit_memory_of_own_processes();
	app::MapSource source;
	source.entry.file = file.write(data, size);
	try
	{
		const auto wait = [](const std::string&, const std::string&, const auto& work) { work(); };
		fuzz::require(!app::build_map(source, wait)->grid().cells.empty(), "cells in a map that is accepted");
	}
	catch (const app::UserError& error)
	{
		fuzz::require_one_line(error.what());
		fuzz::require(error.status == app::kBadInput, "exit status of a bad input");
	}
	return 0;
}
