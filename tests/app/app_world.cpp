// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "app_world.h"

#include <d2s1r/mrpt_version.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include "mrpt_types.h"

#include D2S1R_UNPACKING
#include <cstdio>
#include <filesystem>
#include <fstream>

namespace d2s1r::test
{
namespace
{
mrpt::Clock::time_point time_point(std::size_t i)
{
	return mrpt::Clock::fromDouble(walk_time(i));
}
}  // namespace

const Grid& flat()
{
	static const Grid grid = make_picture_grid(
	    enlarge(
	        {"####################", "#........#.........#", "#........#.........#", "#..####..#....##...#",
	         "#..#.....#....##...#", "#..#...............#", "#..#.....#.........#", "#........#######..##",
	         "#........#.........#", "###..#####.........#", "#........#....#....#", "#.............#....#",
	         "#........#....#....#", "#...##...#.........#", "#...##...#.........#", "####################"},
	        5),
	    0.1);
	return grid;
}

const std::vector<mrpt::math::TPose2D>& walk()
{
	static const std::vector<mrpt::math::TPose2D> poses = []
	{
		std::vector<mrpt::math::TPose2D> all;
		for (int i = 0; i < 8; i++) all.emplace_back(3.2 + 0.3 * i, 5.25, 0.1 * i);
		for (int i = 0; i < 4; i++) all.emplace_back(5.9 + 0.35 * i, 5.25 - 0.05 * i, 0.8 - 0.5 * i);
		return all;
	}();
	return poses;
}

double walk_time(std::size_t i)
{
	return kStartTime + 0.4 * static_cast<double>(i);
}

mrpt::obs::CObservation2DRangeScan::Ptr walk_scan(std::size_t i, const std::string& label)
{
	Laser laser;
	laser.noise = 0.01;
	laser.seed = static_cast<unsigned>(i + 1);
	laser.on_robot = mrpt::poses::CPose3D(0.1, 0, 0.2, 0, 0, 0);
	auto scan =
	    std::make_shared<mrpt::obs::CObservation2DRangeScan>(make_mrpt_observation(flat(), walk().at(i), laser));
	scan->sensorLabel = label;
	scan->timestamp = time_point(i);
	return scan;
}

Objects observation_log()
{
	Objects objects;
	for (std::size_t i = 0; i < walk().size(); i++) objects.push_back(walk_scan(i));
	return objects;
}

Objects action_log()
{
	Objects objects;
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		mrpt::obs::CActionRobotMovement2D motion;
		const auto before = mrpt::poses::CPose2D(walk().at(i > 0 ? i - 1 : 0));
		motion.computeFromOdometry(mrpt::poses::CPose2D(walk()[i]) - before, {});
		motion.timestamp = time_point(i);
		auto actions = mrpt::obs::CActionCollection::Create();
		actions->insert(motion);
		auto frame = mrpt::obs::CSensoryFrame::Create();
		frame->insert(walk_scan(i));
		objects.push_back(actions);
		objects.push_back(frame);
	}
	return objects;
}

Objects covered_laser_log()
{
	Objects objects = observation_log();
	const auto covered = walk_scan(3), tilted = walk_scan(4);
	for (std::size_t beam = 0; beam < covered->getScanSize(); beam++) covered->setScanRange(beam, 0);
	tilted->sensorPose = mrpt::poses::CPose3D(0.1, 0, 0.2, 0, 0.5, 0);
	objects[3] = covered;
	objects[4] = tilted;
	return objects;
}

void save(const Objects& objects, const std::string& rawlog)
{
	mrpt::io::CFileGZOutputStream stream(rawlog);
	auto archive = mrpt::serialization::archiveFrom(stream);
	for (const auto& object : objects) archive << *object;
}

Objects load(const std::string& rawlog)
{
	Objects objects;
	PackedInput stream(rawlog);
	auto archive = mrpt::serialization::archiveFrom(stream);
	try
	{
		while (true) objects.push_back(archive.ReadObject());
	}
	catch (const mrpt::serialization::CExceptionEOF&)
	{
		return objects;
	}
}

std::vector<std::uint8_t> bytes_of(const mrpt::serialization::CSerializable& object)
{
	mrpt::io::CMemoryStream stream;
	auto archive = mrpt::serialization::archiveFrom(stream);
	archive << object;
	const auto* first = static_cast<const std::uint8_t*>(stream.getRawBufferData());
	return {first, first + stream.getTotalBytesCount()};
}

void save_gridmap(const Grid& grid, const std::string& file)
{
	mrpt::io::CFileGZOutputStream stream(file);
	auto archive = mrpt::serialization::archiveFrom(stream);
	archive << *make_mrpt_map(grid);
}

void save_map(const Grid& grid, const std::string& file)
{
	const auto picture = std::filesystem::path(file).replace_extension(".pgm");
	std::ofstream image(picture, std::ios::binary);
	image << "P5 " << grid.width << ' ' << grid.height << " 255\n";
	for (int row = grid.height - 1; row >= 0; row--)
		for (int column = 0; column < grid.width; column++)
		{
			const Cell cell = grid.at(column, row);
			image << (cell == Cell::kOccupied ? '\0' : cell == Cell::kFree ? '\xfe' : '\xcd');
		}
	std::ofstream(file) << "image: " << picture.filename().string() << "\nresolution: " << grid.cell_size
	                    << "\norigin: [" << grid.origin_x << ", " << grid.origin_y
	                    << ", 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
}

void save_truth(const std::string& file, bool seven_columns)
{
	std::ofstream out(file);
	out << "% a comment\n";
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		const auto& pose = walk()[i];
		char line[160];
		if (seven_columns)
			std::snprintf(line, sizeof line, "%.6f %.4f %.4f 0 %.6f 0 0\n", walk_time(i), pose.x, pose.y, pose.phi);
		else
			std::snprintf(line, sizeof line, "%.6f %.4f %.4f %.6f\n", walk_time(i), pose.x, pose.y, pose.phi);
		out << line;
	}
}
}  // namespace d2s1r::test
