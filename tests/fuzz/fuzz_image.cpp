// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Any bytes as an image: refused with one line, or a map. Only PNM files, whose headers cannot ask for more pixels than
// the file holds, are unpacked; of the others the header is read, because their decoders are not ours.
#include <d2s1r/map_io.h>

#include "fuzz_input.h"
#include "map_files/map_image.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
	using namespace d2s1r;
	static const fuzz::CaseFile file("image.pgm");
	const std::string bytes(reinterpret_cast<const char*>(data), size);
	try
	{
		const double memory = memory_to_decode(bytes);
		fuzz::require(memory >= 0 && memory <= 1.024e9, "memory that unpacking may take");
		const bool is_pnm = size > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6';
		if (!is_pnm) return 0;
		const auto map = load_map(file.write(data, size), {}, ImageGeometry{0.05, 1, 2});
		fuzz::require(
		    map->cells.size() == static_cast<std::size_t>(map->width) * static_cast<std::size_t>(map->height),
		    "as many cells as pixels");
		fuzz::require(map->cells.size() <= 8 * size, "no more pixels than the file holds");
	}
	catch (const std::runtime_error& error)
	{
		fuzz::require_one_line(error.what());
	}
	return 0;
}
