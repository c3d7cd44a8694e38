// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Damaged copies of the files that MRPT's own readers read. These readers trust the file: they crash, or take all the
// memory there is. The program must not. D2S1R_DAMAGED_COPIES=1000 makes as many copies of each file, not twelve; the
// rows that this program prints are the table of tests/fuzz/RESULTS.md.
#include <d2s1r/CSignatureMap2D.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <random>

#include "app_process.h"
#include "app_world.h"
#include "mrpt_types.h"

using namespace d2s1r::test;

namespace
{
std::string serialized(const mrpt::serialization::CSerializable& object)
{
	const auto bytes = bytes_of(object);
	return {bytes.begin(), bytes.end()};
}

std::string some_actions_and_scans()
{
	std::string bytes;
	const Objects log = action_log();
	for (std::size_t i = 0; i < 8; i++) bytes += serialized(*log.at(i));
	return bytes;
}

std::string simplemap_of_the_walk()
{
	mrpt::maps::CSimpleMap keyframes;
	for (std::size_t i = 0; i < 3; i++)
	{
		const auto frame = mrpt::obs::CSensoryFrame::Create();
		frame->insert(walk_scan(i));
		keyframes.insert(mrpt::poses::CPose3DPDFGaussian::Create(mrpt::poses::CPose3D(walk()[i])), frame);
	}
	return serialized(keyframes);
}

/// Changes a byte, or writes a great number over four of them, in one to three places; some copies are cut short.
std::string damaged(std::string bytes, unsigned seed)
{
	std::mt19937 random(seed);
	const auto below = [&](std::size_t end) { return random() % end; };
	for (std::size_t i = 1 + below(3); i > 0; i--)
	{
		// half of the damage hits what stands before the first numbers of scans and cells
		const std::size_t at = below(random() % 2 == 0 ? std::min<std::size_t>(bytes.size(), 400) : bytes.size());
		if (random() % 2 == 0)
			bytes[at] = static_cast<char>(random());
		else
			bytes.replace(at, 4, random() % 2 == 0 ? "\xff\xff\xff\x7f" : "\xff\xff\xff\xff");
	}
	if (below(5) == 0) bytes.resize(below(bytes.size()));
	return bytes;
}
}  // namespace

class AppDamagedCopies : public AppTest
{
   protected:
	AppDamagedCopies()
	{
		save_gridmap(flat(), path("flat.gridmap.gz"));
		save(observation_log(), path("walk.rawlog"));
	}

	/// Runs the program without any talk, and expects that it ends by itself, with one line if it cannot use a file.
	ProcessResult expect_survived(const Words& inputs, const std::string& what) const
	{
		Words words = {"-o", path("out"), "-q"};
		words.insert(words.end(), inputs.begin(), inputs.end());
		ProcessResult result = run(words);
		EXPECT_TRUE(result.status == 0 || result.status == 2) << what << ": " << result.status;
		EXPECT_EQ(lines_of(result.err).size(), result.status == 0 ? 0U : 1U) << what << ": " << result.err;
		EXPECT_EQ(result.err.find("defect"), std::string::npos) << what << ": " << result.err;
		return result;
	}

	/// Damages a file in many ways and expects that each copy is survived, in at most 1 GB more than the sound file
	/// takes.
	void expect_copies_survived(const std::string& sound, const std::string& name, const Words& inputs) const
	{
		constexpr long kMemory = 1'000'000;  // [kB]
		const char* const wish = std::getenv("D2S1R_DAMAGED_COPIES");
		const unsigned copies = wish ? static_cast<unsigned>(std::stoul(wish)) : 12;
		write_file(path(name), sound);
		const ProcessResult undamaged = expect_survived(inputs, "undamaged");
		EXPECT_EQ(undamaged.status, 0);
		unsigned used = 0;
		long most = 0;  // [kB] more than the sound file takes
		for (unsigned seed = 1; seed <= copies; seed++)
		{
			const std::string what = name + ", seed " + std::to_string(seed);
			write_file(path(name), damaged(sound, seed));
			const ProcessResult result = expect_survived(inputs, what);
			used += result.status == 0 ? 1 : 0;
			most = std::max(most, result.memory - undamaged.memory);
			EXPECT_LT(result.memory - undamaged.memory, kMemory) << what;
		}
		std::cout << "| " << name << " | " << copies << " | " << used << " | " << copies - used << " | " << most / 1000
		          << " |" << std::endl;
	}

	void expect_maps_survived(const std::string& sound, const std::string& name) const
	{
		expect_copies_survived(sound, name, {"-m", path(name), "-i", path("walk.rawlog")});
	}
};

TEST_F(AppDamagedCopies, OfARawlog)
{
	expect_copies_survived(
	    some_actions_and_scans(), "walk_part.rawlog", {"-m", path("flat.gridmap.gz"), "-i", path("walk_part.rawlog")});
}

TEST_F(AppDamagedCopies, OfASimplemap)
{
	expect_maps_survived(simplemap_of_the_walk(), "walk.simplemap");
}

TEST_F(AppDamagedCopies, OfAGridmap)
{
	expect_maps_survived(serialized(*make_mrpt_map(flat())), "flat.gridmap");
}

TEST_F(AppDamagedCopies, OfASignatureMap)
{
	expect_maps_survived(serialized(d2s1r::CSignatureMap2D(*make_mrpt_map(flat()))), "flat.signaturemap");
}

/// MRPT reads the pose change of such an action from nowhere.
TEST_F(AppDamagedCopies, RawlogThatCrashesMrptsReaderIsLocalizedUpToThere)
{
	mrpt::obs::CActionRobotMovement2D movement;
	movement.computeFromOdometry(mrpt::poses::CPose2D(0.1, 0, 0.1), {});
	mrpt::obs::CActionCollection actions;
	actions.insert(movement);
	std::string action = serialized(actions);
	const std::string name = "CActionRobotMovement2D";
	action[action.find(name) + name.size() + 1] = 1;  // how the movement was estimated
	write_file(path("log.rawlog"), serialized(*walk_scan(0)) + serialized(*walk_scan(1)) + action);
	expect_refusal(
	    {"-m", path("flat.gridmap.gz"), "-i", path("log.rawlog"), "-o", path("out"), "-q"}, 2,
	    {path("log.rawlog") + ": is damaged after object 2 (MRPT's reader crashes there); copy",
	     "the 2 frames before"});
	EXPECT_EQ(CsvTable(path("out/frames.csv"), kFramesHeader).size(), 2U);
	write_file(path("log.rawlog"), serialized(*walk_scan(0)) + action);
	expect_refusal(
	    {"-m", path("flat.gridmap.gz"), "-i", path("log.rawlog"), "-o", path("out"), "-q"}, 2,
	    {"; the frame before that is in " + path("out") + "\n"});
}

TEST_F(AppDamagedCopies, SimplemapOfTwoBillionKeyframesInFewBytes)
{
	std::string bytes = serialized(mrpt::maps::CSimpleMap());
	bytes.replace(bytes.find("CSimpleMap") + 11, 4, "\xff\xff\xff\x7f");
	write_file(path("count.simplemap"), bytes);
	expect_survived({"-m", path("count.simplemap"), "-i", path("walk.rawlog")}, "count");
}
