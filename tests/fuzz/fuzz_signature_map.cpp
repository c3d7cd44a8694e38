// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The archive of a CSignatureMap2D with other parameters, options, cells and numbers, or cut short: refused, or read as
// a map that is written and read again unchanged. Counts and sizes of MRPT's own types are left alone: MRPT makes room
// for whatever they say, which is why the program reads such files in a process of its own.
#include <d2s1r/CSignatureMap2D.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/serialization/CArchive.h>

#include "fuzz_input.h"

namespace
{
using namespace d2s1r;

std::string archived(const CSignatureMap2D& map)
{
	std::vector<std::uint8_t> bytes;
	mrpt::serialization::ObjectToOctetVector(&map, bytes);
	return {bytes.begin(), bytes.end()};
}

CSignatureMap2D read(const std::string& bytes)
{
	mrpt::io::CMemoryStream stream(bytes.data(), bytes.size());
	CSignatureMap2D map;
	mrpt::serialization::archiveFrom(stream) >> map;
	return map;
}

std::string sound_archive()
{
	mrpt::maps::COccupancyGridMap2D grid(0, 1, 0, 1, 0.1F);
	for (int i = 0; i < 10; i++) grid.setCell(i, i, i % 2 == 0 ? 1.0F : 0.0F);
	return archived(CSignatureMap2D(grid));
}

/// A text in an archive: four bytes of length, then the text.
struct ArchivedText
{
	std::size_t at;
	std::size_t length;
};

ArchivedText text_around(const std::string& archive, const std::string& part)
{
	const std::size_t inside = archive.find(part);
	for (std::size_t at = inside; at >= 4; at--)
	{
		std::uint32_t length = 0;
		std::memcpy(&length, archive.data() + at - 4, sizeof length);
		if (length > inside - at && at + length <= archive.size() && length < 1 << 16) return {at, length};
	}
	std::abort();
}

/// Returns where the options of the grid have the number of weights that MRPT makes room for: 100, each of 0.01.
std::size_t count_of_weights(const std::string& archive)
{
	const std::uint32_t number = 100;
	const float weight = 0.01F;
	std::string start(sizeof number + sizeof weight, ' ');
	std::memcpy(start.data(), &number, sizeof number);
	std::memcpy(start.data() + sizeof number, &weight, sizeof weight);
	const std::size_t at = archive.rfind(start);
	fuzz::require(at != std::string::npos, "the weights in a sound archive");
	return at;
}

/// Puts text of the case into an archived text, in place of some characters.
void splice(std::string& archive, const ArchivedText& text, fuzz::Numbers& numbers)
{
	const auto from = static_cast<std::size_t>(numbers.whole(0, static_cast<int>(text.length)));
	const auto dropped = std::min(static_cast<std::size_t>(numbers.byte()), text.length - from);
	std::string added(numbers.byte() % 64, ' ');
	for (char& c : added) c = static_cast<char>(numbers.byte());
	archive.replace(text.at + from, dropped, added);
	const auto length = static_cast<std::uint32_t>(text.length - dropped + added.size());
	std::memcpy(archive.data() + text.at - 4, &length, sizeof length);
}
}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
	static const std::string sound = sound_archive();
	fuzz::Numbers numbers(data, size);
	std::string archive = sound;
	if (numbers.flip()) splice(archive, text_around(archive, "sigma"), numbers);
	if (numbers.flip()) splice(archive, text_around(archive, "[localizer]"), numbers);
	const std::size_t grid = archive.find("COccupancyGridMap2D"), cells = grid + 19 + 1 + 1 + 8 + 20;
	const std::size_t before_grid = grid - 10;  // a byte tells the length of the name of the class
	while (!numbers.empty())
	{
		// the fingerprint and whether there is a map, or the cells, the options and the origin
		const bool is_before = numbers.byte() % 4 == 0;
		const std::size_t first = is_before ? before_grid : cells, past = is_before ? before_grid + 9 : archive.size();
		archive[first + static_cast<std::size_t>(numbers.whole(0, static_cast<int>(past - first) - 1))] =
		    static_cast<char>(numbers.byte());
	}
	const std::size_t count = count_of_weights(sound);
	archive.replace(archive.size() - (sound.size() - count), 4, sound, count, 4);
	try
	{
		const CSignatureMap2D map = read(archive);
		fuzz::require(read(archived(map)).fingerprint() == map.fingerprint(), "the same map, written and read again");
	}
	catch (const std::exception&)
	{
		// refused
	}
	return 0;
}
