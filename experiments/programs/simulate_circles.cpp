// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// simulate_circles MAP POSES.txt OUT.rawlog [NAME=VALUE ...]
// Full circles of 360 beams, 30 m, as a robot sees them in a map at the poses of a ground truth (`time x y phi`: s, m,
// rad, robot in map). Rays are followed exactly from grid line to grid line.
//   frames=N             [-] at most, evenly spread
//   noise=LENGTH         [m] standard deviation of the ranges, 0.01 unless given
//   field_of_view=ANGLE  [deg] of the laser. Below 360 the robot turns in place at each pose, a scan every 10 deg, and
//                        its scans are put together by ScanAccumulator
//   slip=SHARE           [-] of each turn that the odometry does not see or makes up: standard deviation, 0.01 unless
//                        given, drawn for each pose
#include <d2s1r/map_io.h>
#include <d2s1r/mrpt.h>
#include <d2s1r/scan_accumulator.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/serialization/CArchive.h>

#include <cstdio>
#include <random>

#include "data/poses.h"
#include "settings.h"
#include "unit/mrpt_types.h"

namespace
{
using namespace d2s1r;
using experiments::Settings;
using mrpt::obs::CObservation2DRangeScan;

const Settings kUnlessGiven{{"frames", 1e9}, {"noise", 0.01}, {"field_of_view", 360}, {"slip", 0.01}};
constexpr std::size_t kBeams = 360;
constexpr double kDegree = M_PI / 180;
constexpr int kStep = 10;  // [deg] that the robot turns between two scans

/// A laser of the given field of view [deg], 0.1 m ahead of the robot's middle, about which it turns.
test::Laser laser_of(double field_of_view, double noise)
{
	test::Laser laser;
	laser.beams = static_cast<std::size_t>(field_of_view);
	laser.aperture = static_cast<double>(laser.beams - 1) * kDegree;
	laser.noise = noise;
	laser.on_robot = mrpt::poses::CPose3D(mrpt::math::TPose2D(0.1, 0, 0));
	return laser;
}

/// A scan as an observation of kBeams beams; directions without a beam have no data.
CObservation2DRangeScan to_observation(const Scan& scan, const test::Laser& laser)
{
	CObservation2DRangeScan observation;
	observation.aperture = static_cast<float>((kBeams - 1) * kDegree);
	observation.maxRange = static_cast<float>(laser.max_range);
	observation.sensorPose = laser.on_robot;
	observation.sensorLabel = "LASER";
	observation.resizeScan(kBeams);
	for (std::size_t i = 0; i < kBeams; i++)
	{
		observation.setScanRange(i, 1);  // in range but flagged invalid: no data
		observation.setScanRangeValidity(i, false);
	}
	for (const Beam& beam : scan.beams)
	{
		const auto turned = static_cast<double>(beam.angle) / kDegree + 0.5 * (kBeams - 1);
		const auto direction = static_cast<std::size_t>(std::lround(turned) + static_cast<long>(kBeams)) % kBeams;
		observation.setScanRange(direction, beam.range);
		observation.setScanRangeValidity(direction, beam.is_return);
	}
	return observation;
}

/// What a laser of a narrow field of view sees while the robot turns once about itself, until it looks as at first.
CObservation2DRangeScan turn_around(
    const Grid& grid, const mrpt::math::TPose2D& robot, test::Laser laser, double slip, std::mt19937& random)
{
	ScanAccumulator circle;
	const double measured = kStep * kDegree * (1 + slip * std::normal_distribution<double>()(random));
	for (int turned = kStep; turned <= 360; turned += kStep)
	{
		laser.seed = static_cast<unsigned>(random());
		const mrpt::math::TPose2D here{robot.x, robot.y, robot.phi + turned * kDegree};
		circle.add(make_scan(test::make_observation(grid, here, laser), {}), mrpt::poses::CPose2D(0, 0, measured));
	}
	return to_observation(circle.scan(), laser);
}

void simulate(const std::string& map, const std::string& truth, const std::string& out, const Settings& settings)
{
	const Grid grid = make_grid(*load_map(map), {});
	const auto poses = test::load_poses(truth);
	const auto frames = static_cast<std::size_t>(std::min(settings.at("frames"), static_cast<double>(poses.size())));
	const double field_of_view = settings.at("field_of_view");
	test::Laser laser = laser_of(field_of_view, settings.at("noise"));
	mrpt::io::CFileGZOutputStream stream;
	if (!stream.open(out)) throw std::runtime_error(out + ": cannot be written; check the folder");
	auto archive = mrpt::serialization::archiveFrom(stream);
	for (std::size_t i = 0; i < frames; i++)
	{
		const test::StampedPose& pose = poses[i * poses.size() / frames];
		std::mt19937 random(static_cast<unsigned>(i));
		laser.seed = static_cast<unsigned>(random());
		auto scan = field_of_view < 360 ? turn_around(grid, pose.robot, laser, settings.at("slip"), random)
		                                : test::make_mrpt_observation(grid, pose.robot, laser);
		scan.timestamp = mrpt::Clock::fromDouble(pose.time);
		archive << scan;
	}
}
}  // namespace

int main(int count, char** words)
{
	try
	{
		if (count < 4) throw std::invalid_argument("usage: simulate_circles MAP POSES.txt OUT.rawlog [NAME=VALUE ...]");
		simulate(
		    words[1], words[2], words[3],
		    experiments::read_settings("simulate_circles", kUnlessGiven, {words + 4, words + count}));
		return 0;
	}
	catch (const std::exception& e)
	{
		std::fprintf(stderr, "simulate_circles: %s\n", e.what());
		return 1;
	}
}
