// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// alter_scans IN.rawlog OUT.rawlog FRAMES FIELD_OF_VIEW BLOCKED REACH
// Part of the scans of a rawlog of observations, evenly spread, as a lesser laser or one among people would see them.
//   FRAMES         [-] at most
//   FIELD_OF_VIEW  [deg] about the middle of the scan that is left
//   BLOCKED        [0, 1] share of the view in which something stands 0.4 to 2 m from the laser, 10 deg wide each
//   REACH          [m] of the laser: from there on it reports nothing; `inf`: as recorded
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using mrpt::obs::CObservation2DRangeScan;

std::vector<CObservation2DRangeScan::Ptr> load_scans(const std::string& rawlog)
{
	mrpt::io::CFileGZInputStream stream;
	if (!stream.open(rawlog)) throw std::runtime_error(rawlog + ": cannot be opened; check the path");
	auto archive = mrpt::serialization::archiveFrom(stream);
	std::vector<CObservation2DRangeScan::Ptr> scans;
	while (!stream.checkEOF()) try
		{
			if (auto scan = std::dynamic_pointer_cast<CObservation2DRangeScan>(archive.ReadObject()))
				scans.push_back(std::move(scan));
		}
		catch (const mrpt::serialization::CExceptionEOF&)
		{
			break;
		}
	return scans;
}

/// [rad] from the middle of the scan.
double angle_of(const CObservation2DRangeScan& scan, std::size_t beam)
{
	const auto beams = static_cast<double>(std::max<std::size_t>(scan.getScanSize(), 2));
	return static_cast<double>(scan.aperture) * (static_cast<double>(beam) / (beams - 1) - 0.5);
}

/// Leaves the beams in the middle, as many on either side.
void crop(CObservation2DRangeScan& scan, double field_of_view)
{
	const std::size_t beams = scan.getScanSize();
	std::size_t first = 0;
	while (2 * (first + 1) < beams && angle_of(scan, first) < -field_of_view / 2 - 1e-6) first++;
	if (first == 0) return;
	const std::size_t left = beams - 2 * first;
	std::vector<float> ranges(left);
	std::vector<char> valid(left);
	for (std::size_t i = 0; i < left; i++)
	{
		ranges[i] = scan.getScanRange(first + i);
		valid[i] = scan.getScanRangeValidity(first + i) ? 1 : 0;
	}
	scan.aperture *= static_cast<float>(left - 1) / static_cast<float>(beams - 1);
	scan.loadFromVectors(left, ranges.data(), valid.data());
}

/// Things of 10 deg at places drawn at random, until they cover `share` of the view.
void block(CObservation2DRangeScan& scan, double share, std::mt19937& random)
{
	const auto width = 10 * M_PI / 180;
	const std::size_t beams = scan.getScanSize();
	const auto things = static_cast<std::size_t>(std::round(static_cast<double>(scan.aperture) / width));
	std::vector<std::size_t> places(things);
	for (std::size_t i = 0; i < things; i++) places[i] = i;
	std::shuffle(places.begin(), places.end(), random);
	places.resize(static_cast<std::size_t>(std::round(share * static_cast<double>(things))));
	std::uniform_real_distribution<float> distance(0.4F, 2.0F);
	for (const std::size_t place : places)
	{
		const float range = distance(random);
		for (std::size_t beam = place * beams / things; beam < (place + 1) * beams / things; beam++)
		{
			if (scan.getScanRangeValidity(beam) && scan.getScanRange(beam) < range) continue;
			scan.setScanRange(beam, range);
			scan.setScanRangeValidity(beam, true);
		}
	}
}

/// As a laser that sees nothing from `reach` [m] on would say.
void shorten(CObservation2DRangeScan& scan, float reach)
{
	if (reach >= scan.maxRange) return;
	for (std::size_t beam = 0; beam < scan.getScanSize(); beam++)
	{
		const float range = scan.getScanRange(beam);
		const bool is_data = scan.getScanRangeValidity(beam) || range >= scan.maxRange;
		if (!is_data || range < reach) continue;
		scan.setScanRange(beam, reach);
		scan.setScanRangeValidity(beam, false);
	}
	scan.maxRange = reach;
}

void alter(char** words)
{
	const auto scans = load_scans(words[1]);
	const std::size_t frames = std::min<std::size_t>(std::stoul(words[3]), scans.size());
	const double field_of_view = std::stod(words[4]) * M_PI / 180, blocked = std::stod(words[5]);
	const float reach = std::stof(words[6]);
	mrpt::io::CFileGZOutputStream stream;
	if (!stream.open(words[2])) throw std::runtime_error(std::string(words[2]) + ": cannot be written");
	auto archive = mrpt::serialization::archiveFrom(stream);
	for (std::size_t i = 0; i < frames; i++)
	{
		const std::size_t frame = i * scans.size() / frames;
		std::mt19937 random(static_cast<unsigned>(frame));
		auto& scan = *scans[frame];
		block(scan, blocked, random);
		crop(scan, field_of_view);
		shorten(scan, reach);
		archive << scan;
	}
}
}  // namespace

int main(int count, char** words)
{
	try
	{
		if (count != 7) throw std::invalid_argument("usage: alter_scans IN OUT FRAMES FIELD_OF_VIEW BLOCKED REACH");
		alter(words);
		return 0;
	}
	catch (const std::exception& e)
	{
		std::fprintf(stderr, "alter_scans: %s\n", e.what());
		return 1;
	}
}
