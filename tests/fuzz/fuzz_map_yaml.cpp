// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Any text as a map_server yaml beside a small image: refused with one line, or a map of the image's size.
#include <d2s1r/map_io.h>

#include "fuzz_input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
	using namespace d2s1r;
	static const fuzz::CaseFile yaml("map.yaml"), image("map.pgm");
	const std::string pixels("P5\n3 2\n255\n\0\xCD\xFE\xFE\xFE\x80", 17);
	image.write(reinterpret_cast<const std::uint8_t*>(pixels.data()), pixels.size());
	// The name of the image differs from process to process; cases call it map.pgm.
	std::string text(reinterpret_cast<const char*>(data), size);
	const std::string name = image.path().substr(image.path().rfind('/') + 1);
	if (const auto at = text.find("map.pgm"); at != std::string::npos) text.replace(at, 7, name);
	yaml.write(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
	try
	{
		const auto map = load_map(yaml.path());
		if (map->width != 3 || map->height != 2) return 0;  // another image: the case named a file that exists
		fuzz::require(
		    std::isfinite(static_cast<double>(map->origin_x) + map->end_y() + static_cast<double>(map->cell_size)),
		    "a finite map");
	}
	catch (const std::runtime_error& error)
	{
		fuzz::require_one_line(error.what());
	}
	fuzz::require(!files_of_map(yaml.path()).empty(), "the files of a map");
	return 0;
}
