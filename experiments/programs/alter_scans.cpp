// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// alter_scans LOG OUT.rawlog [NAME=VALUE ...]
// Writes the scans of a log of any format that rawlog-localize reads, those of the laser with the most scans, or some
// of them, as a lesser laser or one among people would see them. Prints what they are like as JSON: their number, and
// the median over them of the field of view [deg], of the range that the laser sees up to and of the longest return
// [m].
//   text=FILE            also writes them as lines of numbers, for programs that read no rawlog: time [s], angle of the
//                        first beam and step [rad], range that the laser sees up to [m], pose of the laser on the robot
//                        [m, m, rad], and the ranges [m], `inf` where nothing returned and `nan` where the laser says
//                        nothing
//   poses=FILE           also writes lines `time x y phi` [s, m, rad]: the robot's poses that the log tells, those of
//   of=topic:TOPIC       a topic, or in
//   of=tf:FRAME          a frame of its transforms
//   truth=FILE           leaves out scans whose time is not, within 1 ms, that of a line `time x y phi`
//   frames=N             [-] at most, evenly spread
//   blocked=SHARE        [0, 1] of the view in which something stands 0.4 to 2 m from the laser, 10 deg wide each
//   beams=N              [-] of a full circle, at most: every n-th beam is left
//   field_of_view=ANGLE  [deg] about the middle of the scan that is left
//   noise=LENGTH         [m] standard deviation added to the ranges
//   relative_noise=PART  [-] the same as a part of the range
//   invalid=SHARE        [0, 1] of the beams that return no data, in runs of 3 deg in the mean
//   reach=LENGTH         [m] of the laser: from there on it reports nothing
//   short=SHARE          [0, 1] of the beams, at random, that end anywhere between 20 cm and the wall
//   mirrored=1           the beams are in the wrong order
//   seed=N               of all that is drawn at random
#include <logs/log.h>
#include <logs/mrpt_objects.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/math/TPose2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iomanip>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "data/poses.h"
#include "settings.h"
#include "shorten.h"

namespace
{
using d2s1r::experiments::Settings;
using mrpt::obs::CObservation2DRangeScan;

using Scans = std::vector<CObservation2DRangeScan::Ptr>;

/// Reads the scans of the laser that has the most.
Scans load_scans(const std::string& log)
{
	std::map<std::string, Scans> lasers;
	const auto reader = d2s1r::logs::open_log(log).read();
	while (const auto object = reader->next())
		for (const auto& scan : object->scans)
			lasers[scan->label].push_back(
			    std::make_shared<CObservation2DRangeScan>(d2s1r::logs::observation_of(*scan)));
	const auto has_fewer = [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); };
	const auto most = std::max_element(lasers.begin(), lasers.end(), has_fewer);
	return most == lasers.end() ? Scans() : most->second;
}

/// Leaves the scans at whose times a pose is known.
void keep_known(Scans& scans, const std::string& truth)
{
	std::set<std::int64_t> times;  // [ms]
	for (const auto& pose : d2s1r::test::load_poses(truth)) times.insert(std::llround(1e3 * pose.time));
	const auto is_unknown = [&](const auto& scan)
	{
		const auto time = std::llround(1e3 * d2s1r::logs::to_seconds(scan->timestamp));
		const auto near = times.lower_bound(time - 1);
		return near == times.end() || *near > time + 1;
	};
	scans.erase(std::remove_if(scans.begin(), scans.end(), is_unknown), scans.end());
}

/// Writes the poses that the log tells of the robot that carries a laser.
void write_poses(const std::string& log, const std::string& of, const std::string& laser, const std::string& file)
{
	const auto colon = of.find(':');
	const std::string kind = of.substr(0, colon), name = of.substr(colon + 1);
	if (kind != "topic" && kind != "tf") throw std::invalid_argument("of=" + of + ": is neither topic: nor tf:");
	std::ofstream out(file);
	out << std::fixed << std::setprecision(6);
	const d2s1r::logs::PosesInFrame found = kind == "tf" ? d2s1r::logs::read_poses_of_frame(log, name, laser, "")
	                                                     : d2s1r::logs::read_poses_of_topic(log, name, "");
	for (const auto& [time, pose] : found.poses)
		out << time << ' ' << pose.x << ' ' << pose.y << ' ' << pose.phi << '\n';
	if (!out.flush()) throw std::runtime_error(file + ": cannot be written");
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

/// Leaves every n-th beam.
void thin(CObservation2DRangeScan& scan, std::size_t most)
{
	const std::size_t beams = scan.getScanSize();
	const double turns = static_cast<double>(scan.aperture) / (2 * M_PI);
	const auto stride = static_cast<std::size_t>(
	    std::ceil(static_cast<double>(beams) / std::max(1.0, turns * static_cast<double>(most)) - 0.01));
	if (stride <= 1 || beams < 2) return;
	std::vector<float> ranges;
	std::vector<char> valid;
	for (std::size_t i = 0; i < beams; i += stride)
	{
		ranges.push_back(scan.getScanRange(i));
		valid.push_back(scan.getScanRangeValidity(i) ? 1 : 0);
	}
	const double step = static_cast<double>(scan.aperture) / static_cast<double>(beams - 1);  // [rad]
	const std::size_t last = (ranges.size() - 1) * stride;
	// the first beams are those that are left: the scan turns by half of what is missing at its end
	const double turn = -0.5 * step * static_cast<double>(beams - 1 - last) * (scan.rightToLeft ? 1 : -1);
	scan.sensorPose = scan.sensorPose + mrpt::poses::CPose3D(mrpt::math::TPose2D(0, 0, turn));
	scan.aperture = static_cast<float>(step * static_cast<double>(last));
	scan.loadFromVectors(ranges.size(), ranges.data(), valid.data());
}

bool is_return(const CObservation2DRangeScan& scan, std::size_t beam)
{
	return scan.getScanRangeValidity(beam) && scan.getScanRange(beam) < scan.maxRange;
}

void add_noise(CObservation2DRangeScan& scan, double deviation, double relative, std::mt19937& random)
{
	if (deviation <= 0 && relative <= 0) return;
	std::normal_distribution<double> error(0, 1);
	for (std::size_t beam = 0; beam < scan.getScanSize(); beam++)
	{
		if (!is_return(scan, beam)) continue;
		const auto range = static_cast<double>(scan.getScanRange(beam));
		const double noisy = range + std::hypot(deviation, relative * range) * error(random);
		scan.setScanRange(beam, std::max(0.01F, static_cast<float>(noisy)));
	}
}

/// Runs of beams without data, so long that `share` of all beams has none.
void invalidate(CObservation2DRangeScan& scan, double share, std::mt19937& random)
{
	if (share <= 0) return;
	const std::size_t beams = scan.getScanSize();
	const double step = static_cast<double>(scan.aperture) / static_cast<double>(std::max<std::size_t>(2, beams) - 1);
	const double run = std::max(1.0, 3 * M_PI / 180 / step);  // [beam] in the mean
	std::uniform_real_distribution<double> uniform(0, 1);
	bool is_valid = uniform(random) >= share;
	for (std::size_t beam = 0; beam < beams; beam++)
	{
		if (is_valid ? uniform(random) < share / (1 - share) / run : uniform(random) < 1 / run) is_valid = !is_valid;
		if (is_valid) continue;
		scan.setScanRange(beam, 0);
		scan.setScanRangeValidity(beam, false);
	}
}

/// Beams drawn at random that end before the wall.
void end_before_wall(CObservation2DRangeScan& scan, double share, std::mt19937& random)
{
	constexpr double kLeast = 0.2, kMost = 10;  // [m]
	if (share <= 0) return;
	std::uniform_real_distribution<double> uniform(0, 1);
	for (std::size_t beam = 0; beam < scan.getScanSize(); beam++)
	{
		const double part = uniform(random);
		const double wall = std::min(static_cast<double>(scan.getScanRange(beam)), kMost);
		if (uniform(random) >= share || !is_return(scan, beam) || wall <= kLeast) continue;
		scan.setScanRange(beam, static_cast<float>(kLeast + part * (wall - kLeast)));
	}
}

void mirror(CObservation2DRangeScan& scan)
{
	const std::size_t beams = scan.getScanSize();
	std::vector<float> ranges(beams);
	std::vector<char> valid(beams);
	for (std::size_t beam = 0; beam < beams; beam++)
	{
		ranges[beams - 1 - beam] = scan.getScanRange(beam);
		valid[beams - 1 - beam] = scan.getScanRangeValidity(beam) ? 1 : 0;
	}
	scan.loadFromVectors(beams, ranges.data(), valid.data());
}

void write_text(std::ostream& out, const CObservation2DRangeScan& scan)
{
	const auto beams = static_cast<double>(std::max<std::size_t>(scan.getScanSize(), 2));
	const double first = static_cast<double>(scan.aperture) / (scan.rightToLeft ? -2 : 2);
	out << std::fixed << std::setprecision(6) << d2s1r::logs::to_seconds(scan.timestamp) << ' ' << first << ' '
	    << -2 * first / (beams - 1) << ' ' << scan.maxRange << ' ' << scan.sensorPose.x() << ' ' << scan.sensorPose.y()
	    << ' ' << scan.sensorPose.yaw() << std::setprecision(3);
	for (std::size_t beam = 0; beam < scan.getScanSize(); beam++)
	{
		out << ' ';
		if (is_return(scan, beam))
			out << scan.getScanRange(beam);
		else
			out << (scan.getScanRange(beam) >= scan.maxRange ? "inf" : "nan");
	}
	out << '\n';
}

double median(std::vector<double> values)
{
	if (values.empty()) return 0;
	std::sort(values.begin(), values.end());
	return values[values.size() / 2];
}

/// Prints what the scans are like.
void describe(const Scans& scans)
{
	std::vector<double> views, reaches, longest;
	for (const auto& scan : scans)
	{
		views.push_back(static_cast<double>(scan->aperture) * 180 / M_PI);
		reaches.push_back(static_cast<double>(scan->maxRange));
		float most = 0;
		for (std::size_t beam = 0; beam < scan->getScanSize(); beam++)
			if (is_return(*scan, beam)) most = std::max(most, scan->getScanRange(beam));
		longest.push_back(static_cast<double>(most));
	}
	std::printf(
	    "{\"scans\": %zu, \"field_of_view\": %.2f, \"max_range\": %.2f, \"longest\": %.2f}\n", scans.size(),
	    median(views), median(reaches), median(longest));
}

constexpr double kAsRecorded = std::numeric_limits<double>::infinity();

Settings read_settings(const d2s1r::experiments::Words& words)
{
	const Settings unless_given{
	    {"frames", kAsRecorded},
	    {"blocked", 0},
	    {"beams", kAsRecorded},
	    {"noise", 0},
	    {"relative_noise", 0},
	    {"field_of_view", kAsRecorded},
	    {"invalid", 0},
	    {"reach", kAsRecorded},
	    {"short", 0},
	    {"mirrored", 0},
	    {"seed", 0}};
	auto settings = d2s1r::experiments::read_settings("alter_scans", unless_given, words);
	if (settings.at("invalid") >= 1) throw std::invalid_argument("invalid must be less than 1");
	return settings;
}

void alter(const std::string& in, const std::string& out, d2s1r::experiments::Words words)
{
	const std::string text = d2s1r::experiments::take_text(words, "text");
	const std::string truth = d2s1r::experiments::take_text(words, "truth");
	const std::string poses = d2s1r::experiments::take_text(words, "poses");
	const std::string of = d2s1r::experiments::take_text(words, "of");
	const Settings settings = read_settings(words);
	Scans scans = load_scans(in);
	if (!poses.empty()) write_poses(in, of, scans.empty() ? "" : scans.front()->sensorLabel, poses);
	if (!truth.empty()) keep_known(scans, truth);
	const auto all = static_cast<double>(scans.size());
	const auto frames = static_cast<std::size_t>(std::min(settings.at("frames"), all));
	mrpt::io::CFileGZOutputStream stream;
	if (!stream.open(out)) throw std::runtime_error(out + ": cannot be written");
	auto archive = mrpt::serialization::archiveFrom(stream);
	std::ofstream lines;
	if (!text.empty()) lines.open(text);
	Scans written;
	for (std::size_t i = 0; i < frames; i++)
	{
		const std::size_t frame = i * scans.size() / frames;
		std::mt19937 random(static_cast<unsigned>(frame) + 1000003U * static_cast<unsigned>(settings.at("seed")));
		auto& scan = *scans[frame];
		block(scan, settings.at("blocked"), random);
		if (settings.at("beams") < kAsRecorded) thin(scan, static_cast<std::size_t>(settings.at("beams")));
		crop(scan, settings.at("field_of_view") * M_PI / 180);
		add_noise(scan, settings.at("noise"), settings.at("relative_noise"), random);
		invalidate(scan, settings.at("invalid"), random);
		end_before_wall(scan, settings.at("short"), random);
		if (settings.at("mirrored") > 0) mirror(scan);
		d2s1r::experiments::shorten(scan, static_cast<float>(settings.at("reach")));
		archive << scan;
		if (!text.empty()) write_text(lines, scan);
		written.push_back(scans[frame]);
	}
	if (!text.empty() && !lines.flush()) throw std::runtime_error(text + ": cannot be written");
	describe(written);
}
}  // namespace

int main(int count, char** words)
{
	try
	{
		if (count < 3) throw std::invalid_argument("usage: alter_scans LOG OUT.rawlog [NAME=VALUE ...]");
		alter(words[1], words[2], {words + 3, words + count});
		return 0;
	}
	catch (const std::exception& e)
	{
		std::fprintf(stderr, "alter_scans: %s\n", e.what());
		return 1;
	}
}
