// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "recorded_drive.h"

#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CRawlog.h>
#include <zlib.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <sstream>
#include <stdexcept>

namespace d2s1r::experiments
{
namespace
{
using mrpt::obs::CObservation2DRangeScan;
using mrpt::poses::CPose2D;

constexpr double kStart = 1e9, kStep = 0.2;  //!< [s] times of the scans

/// Returns the lines of a text file that may be packed by gzip.
std::vector<std::string> lines_of(const std::string& file)
{
	const std::unique_ptr<gzFile_s, int (*)(gzFile)> stream(gzopen(file.c_str(), "rb"), gzclose);
	if (!stream) throw std::runtime_error(file + ": cannot be read; give the folder of a clone of acschaefer/ple");
	std::vector<std::string> lines(1);
	for (int c = gzgetc(stream.get()); c >= 0; c = gzgetc(stream.get()))
		if (c == '\n')
			lines.emplace_back();
		else
			lines.back() += static_cast<char>(c);
	return lines;
}

/// Makes a scan of ranges from right to left. Where the beams fill 180 deg with a gap of one beam at the end, the laser
/// looks half a beam to the right.
CObservation2DRangeScan::Ptr scan_of(const std::vector<double>& ranges, const Beams& beams, std::size_t number)
{
	auto scan = CObservation2DRangeScan::Create();
	scan->sensorLabel = "FLASER";
	scan->timestamp = mrpt::Clock::fromDouble(kStart + kStep * static_cast<double>(number));
	scan->maxRange = static_cast<float>(beams.reach);
	const double aperture = mrpt::DEG2RAD(beams.degrees_per_beam * static_cast<double>(ranges.size() - 1));
	scan->aperture = static_cast<float>(aperture);
	scan->sensorPose = mrpt::poses::CPose3D(0, 0, 0, -mrpt::DEG2RAD(90.0) + aperture / 2, 0, 0);
	scan->resizeScan(ranges.size());
	for (std::size_t i = 0; i < ranges.size(); i++)
	{
		const bool is_return = ranges[i] > 0 && ranges[i] < beams.reach;
		scan->setScanRange(i, static_cast<float>(is_return ? ranges[i] : beams.reach));
		scan->setScanRangeValidity(i, is_return);
	}
	return scan;
}

/// Reads the numbers of a line FLASER.
/// \throws std::runtime_error if the line is not of that form
DrivenScan read_scan(std::istringstream& words, const Beams& beams, std::size_t number)
{
	std::size_t count = 0;
	words >> count;
	if (!words || count < 90 || count > 1081) throw std::runtime_error("has no plausible number of beams");
	std::vector<double> ranges(count);
	for (double& range : ranges) words >> range;
	double x = 0, y = 0, phi = 0;
	words >> x >> y >> phi;
	if (!words) throw std::runtime_error("is too short");
	DrivenScan driven;
	driven.scan = scan_of(ranges, beams, number);
	driven.robot = CPose2D(x, y, phi);
	return driven;
}

/// Returns whether both scans have the same returns, to a millimetre.
bool are_equal(const CObservation2DRangeScan& a, const CObservation2DRangeScan& b)
{
	if (a.getScanSize() != b.getScanSize()) return false;
	for (std::size_t i = 0; i < a.getScanSize(); i++)
		if (std::abs(a.getScanRange(i) - b.getScanRange(i)) > 0.001F) return false;
	return true;
}

/// Reads the scans of a rawlog with the odometry before each. Their poses are not known yet.
std::vector<DrivenScan> read_rawlog(const std::string& file, const Beams& beams)
{
	mrpt::obs::CRawlog log;
	if (!std::filesystem::exists(file) || !log.loadFromRawLogFile(file))
		throw std::runtime_error(file + ": cannot be read; give the folder of a clone of MOLAorg/mola_test_datasets");
	std::vector<DrivenScan> scans;
	std::optional<CPose2D> odometry;
	for (std::size_t entry = 0; entry < log.size(); entry++)
	{
		const auto object = log.getAsGeneric(entry);
		if (const auto wheels = std::dynamic_pointer_cast<mrpt::obs::CObservationOdometry>(object))
			odometry = wheels->odometry;
		const auto scan = std::dynamic_pointer_cast<CObservation2DRangeScan>(object);
		if (!scan || !odometry) continue;
		std::vector<double> ranges(scan->getScanSize());
		for (std::size_t i = 0; i < ranges.size(); i++) ranges[i] = static_cast<double>(scan->getScanRange(i));
		scans.push_back({{scan_of(ranges, beams, scans.size()), {}}, odometry});
	}
	return scans;
}

/// Places the scans between `first` and `last`, whose poses are known, by their odometry. What is missing at the last
/// one is dealt out evenly.
void place_between(std::vector<DrivenScan>& scans, std::size_t first, std::size_t last)
{
	const DrivenScan& from = scans[first];
	const CPose2D missing = scans[last].robot - (from.robot + (*scans[last].odometry - *from.odometry));
	for (std::size_t i = first + 1; i < last; i++)
	{
		const double part = static_cast<double>(i - first) / static_cast<double>(last - first);
		scans[i].robot = from.robot + (*scans[i].odometry - *from.odometry) +
		                 CPose2D(part * missing.x(), part * missing.y(), part * mrpt::math::wrapToPi(missing.phi()));
	}
}
}  // namespace

std::vector<DrivenScan> read_corrected_log(const std::string& file, const Beams& beams)
{
	std::vector<DrivenScan> scans;
	std::optional<CPose2D> odometry;
	std::size_t number = 0;
	for (const std::string& line : lines_of(file)) try
		{
			number++;
			std::istringstream words(line);
			std::string kind;
			words >> kind;
			double x = 0, y = 0, phi = 0;
			if (kind == "ODOM" && words >> x >> y >> phi) odometry = CPose2D(x, y, phi);
			if (kind != "FLASER") continue;
			scans.push_back(read_scan(words, beams, scans.size()));
			scans.back().odometry = odometry;
		}
		catch (const std::exception& error)
		{
			throw std::runtime_error(file + ":" + std::to_string(number) + ": " + error.what());
		}
	if (scans.empty()) throw std::runtime_error(file + ": holds no line FLASER");
	return scans;
}

std::vector<DrivenScan> read_raw_log(
    const std::string& file, const Beams& beams, const std::vector<DrivenScan>& corrected)
{
	std::vector<DrivenScan> scans = read_rawlog(file, beams);
	std::optional<std::size_t> first, last;
	std::size_t i = 0;
	for (std::size_t k = 0; k < corrected.size(); k++, i++)
	{
		while (i < scans.size() && !are_equal(*scans[i].scan, *corrected[k].scan)) i++;
		if (i == scans.size())
			throw std::runtime_error(file + ": lacks scan " + std::to_string(k) + " of those that follow");
		scans[i].robot = corrected[k].robot;
		if (last) place_between(scans, *last, i);
		if (!first) first = i;
		last = i;
	}
	scans.erase(scans.begin() + static_cast<std::ptrdiff_t>(*last) + 1, scans.end());
	scans.erase(scans.begin(), scans.begin() + static_cast<std::ptrdiff_t>(*first));
	return scans;
}
}  // namespace d2s1r::experiments
