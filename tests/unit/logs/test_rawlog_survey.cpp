// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What is known of a rawlog before it is read in earnest, even if MRPT's reader crashes on it.
#include <fcntl.h>
#include <logs/errors.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <unistd.h>
#include <zlib.h>

#include <ctime>
#include <fstream>
#include <iterator>

#include "app/temporary_folder.h"
#include "logs/made_logs.h"
#include "rawlog/rawlog_reader.h"
#include "unpacking_stream.h"

namespace d2s1r::logs
{
namespace
{
std::string serialized(const mrpt::serialization::CSerializable& object)
{
	std::vector<std::uint8_t> bytes;
	mrpt::serialization::ObjectToOctetVector(&object, bytes);
	return {bytes.begin(), bytes.end()};
}

std::string scan_of(const std::string& label)
{
	mrpt::obs::CObservation2DRangeScan scan;
	scan.sensorLabel = label;
	scan.resizeScanAndAssign(20, 1.0F, true);
	return serialized(scan);
}

std::string action()
{
	mrpt::obs::CActionRobotMovement2D movement;
	movement.computeFromOdometry(mrpt::poses::CPose2D(0.1, 0, 0.1), {});
	mrpt::obs::CActionCollection actions;
	actions.insert(movement);
	return serialized(actions);
}

/// MRPT reads a null pointer as the pose change of such an action, and looks where it points to.
std::string action_without_a_pose_change()
{
	const std::string name = "CActionRobotMovement2D", bytes = action();
	std::string damaged = bytes;
	constexpr std::size_t kMethodAt = 1;  // [byte] after the name and the version
	damaged[bytes.find(name) + name.size() + kMethodAt] = 1;
	return damaged;
}

/// MRPT makes room for as many actions as the collection says it has.
std::string action_collection_of_two_billion()
{
	const std::string name = "CActionCollection", bytes = action();
	std::string damaged = bytes;
	constexpr std::size_t kCountAt = 1 + 3;  // [byte] after the name: the last byte of the number
	damaged[bytes.find(name) + name.size() + kCountAt] = '\x7f';
	return damaged;
}

class SurveyOfRawlog : public test::FolderTest
{
   protected:
	Log open(const std::string& bytes) const
	{
		write("log.rawlog", bytes);
		return open_rawlog(path("log.rawlog"), [] { return false; });
	}
	LogSurvey survey(const std::string& bytes) const { return open(bytes).survey; }

	/// Returns the number of objects that can be read again.
	static std::size_t count_objects(const Log& log)
	{
		std::size_t objects = 0;
		const auto reader = log.read();
		while (reader->next()) objects++;
		EXPECT_EQ(reader->damage(), "");
		return objects;
	}
};

TEST_F(SurveyOfRawlog, CountsTheScansOfEachLaserAndAllObjects)
{
	const Log log = open(scan_of("front") + scan_of("a\nb") + action() + scan_of("front"));
	const LogSurvey& found = log.survey;
	EXPECT_EQ(found.damage, "");
	EXPECT_EQ(count_objects(log), 4U);
	EXPECT_EQ(found.odometry, "the log");
	ASSERT_EQ(found.sensors.size(), 2U);
	EXPECT_EQ(found.sensors[0].label, "front");
	EXPECT_EQ(found.sensors[0].scans, 2U);
	EXPECT_EQ(found.sensors[1].label, "a\nb");
	EXPECT_EQ(survey(scan_of("front")).odometry, "");
}

TEST_F(SurveyOfRawlog, ReadsAllPackedPartsAndIgnoresWhatIsBehindThem)
{
	const auto packed = [&](const std::string& bytes)
	{
		const gzFile file = gzopen(path("part.gz").c_str(), "wb");
		EXPECT_EQ(gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size())), static_cast<int>(bytes.size()));
		gzclose(file);
		std::ifstream part(path("part.gz"), std::ios::binary);
		return std::string(std::istreambuf_iterator<char>(part), {});
	};
	const std::string parts = packed(scan_of("front") + scan_of("front")) + packed(action());
	for (const std::string& behind : {std::string(), std::string(512, '\0'), std::string("no part")})
	{
		const Log log = open(parts + behind);
		EXPECT_EQ(log.survey.damage, "") << behind;
		EXPECT_EQ(count_objects(log), 3U) << behind;
	}
	EXPECT_NE(survey(parts.substr(0, 60)).damage.find("cut short"), std::string::npos);
	const std::string one = packed(scan_of("front"));
	EXPECT_NE(survey(one.substr(0, one.size() - 8)).damage.find("damaged after object 1"), std::string::npos)
	    << "only what gzip checks it by is missing";
	EXPECT_NE(survey(packed(scan_of("front")) + "\x1f\x8b\x08?damaged").damage, "");
}

/// As MRPT's own programs pack rawlogs since version 2.15.7.
TEST_F(SurveyOfRawlog, ReadsAllPartsThatZstdHasPacked)
{
	if (!test::can_pack("zstd")) GTEST_SKIP() << "built without libzstd-dev";
	for (const char* method : {"zstd", "zstd-stream"})
	{
		const std::string one = test::packed(method, scan_of("front"));
		const std::string parts = test::packed(method, scan_of("front") + scan_of("front")) + one;
		for (const std::string& behind : {std::string(), std::string(512, '\0'), std::string("no part")})
		{
			const Log log = open(parts + behind);
			EXPECT_EQ(log.survey.damage, "") << method << behind;
			EXPECT_EQ(count_objects(log), 3U) << method << behind;
		}
		EXPECT_NE(survey(one.substr(0, one.size() - 8)).damage.find("cut short"), std::string::npos) << method;
		EXPECT_NE(survey(one + "\x28\xb5\x2f\xfd\xff?damaged").damage.find("damaged after object 1"), std::string::npos)
		    << method;
	}
}

TEST(UnpackingStream, HandsOnAllThatHasArrivedBeforeItWaits)
{
	if (!test::can_pack("zstd")) GTEST_SKIP() << "built without libzstd-dev";
	constexpr std::size_t kBlock = 1 << 17;  // [byte], the largest of zstd
	const std::string packed = test::packed("zstd", std::string(8 * kBlock, 'a'));
	int ends[2] = {};
	ASSERT_EQ(pipe2(ends, O_NONBLOCK), 0);
	ASSERT_EQ(write(ends[1], packed.data(), packed.size() - 1), static_cast<ssize_t>(packed.size() - 1));
	const auto stream = unpack(ends[0], false);
	std::string some(1 << 10, '\0');
	for (std::size_t got = 0; got < 7 * kBlock; got += some.size())
		ASSERT_EQ(stream->read(some.data(), some.size()), some.size()) << got;
	EXPECT_THROW(while (true) stream->read(some.data(), some.size()), ReadError) << "would wait";
	close(ends[1]);
}

TEST_F(SurveyOfRawlog, KeepsWhatCameBeforeAnObjectThatCrashesMrptsReader)
{
	const Log log = open(scan_of("front") + action() + action_without_a_pose_change() + scan_of("front"));
	const LogSurvey& found = log.survey;
	EXPECT_EQ(count_objects(log), 2U);
	ASSERT_EQ(found.sensors.size(), 1U);
	EXPECT_EQ(found.sensors[0].scans, 1U);
	EXPECT_NE(found.damage.find("damaged after object 2 (MRPT's reader crashes there)"), std::string::npos)
	    << found.damage;
}

TEST_F(SurveyOfRawlog, KeepsWhatCameBeforeAnObjectThatTakesTooMuchMemory)
{
#ifdef __SANITIZE_ADDRESS__
	GTEST_SKIP() << "AddressSanitizer takes the memory of the whole machine before it ends the process";
#endif
	const Log log = open(scan_of("front") + action_collection_of_two_billion());
	EXPECT_EQ(count_objects(log), 1U);
	EXPECT_NE(log.survey.damage.find("too much memory to be read after object 1"), std::string::npos)
	    << log.survey.damage;
}

TEST_F(SurveyOfRawlog, SaysWhatIsWrongWithAFileThatCrashesMrptsReaderAtOnce)
{
	const LogSurvey found = survey(action_without_a_pose_change());
	EXPECT_NE(found.damage.find("damaged from its start"), std::string::npos) << found.damage;
}

TEST_F(SurveyOfRawlog, KeepsWhatCameBeforeALabelThatIsFarTooLong)
{
	const Log log = open(scan_of("front") + scan_of(std::string(100'000, 'x')) + scan_of("front"));
	EXPECT_EQ(count_objects(log), 1U);
	EXPECT_EQ(log.survey.damage, "object 2 has a scan whose sensorLabel has 100000 letters; give it a shorter one");
}

TEST_F(SurveyOfRawlog, AsManyLabelsAsScansTakeAboutAsLongAsOneLabel)
{
	constexpr int kScans = 60'000;
	const std::string label = "label100000", scan = scan_of(label);
	const auto place = scan.find(label);
	std::string same, different;
	for (int i = 0; i < kScans; i++)
	{
		same += scan;
		different += scan;
		different.replace(different.size() - scan.size() + place, label.size(), "label" + std::to_string(100'000 + i));
	}
	const auto seconds_of = [&](const std::string& bytes, std::size_t sensors)
	{
		const std::clock_t start = std::clock();  // of this process: other programs do not count, nor does the reading
		const LogSurvey found = survey(bytes);
		EXPECT_EQ(found.sensors.size(), sensors);
		EXPECT_EQ(found.damage, "");
		return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
	};
	const double one = seconds_of(same, 1), many = seconds_of(different, kScans);
	EXPECT_LT(many, 4 * one);
}

/// MRPT's readers get no bytes in this process but those that they have read in the other one.
TEST_F(SurveyOfRawlog, WhatIsWrittenOverAfterTheSurveyIsNotRead)
{
	const std::string first = scan_of("front"), crash = action_without_a_pose_change();
	const std::string same_size = std::string(1, '\x8f').append(scan_of("front").substr(1));
	for (const std::string& then : {first + crash + first, first + first.substr(0, 9), first, first + same_size})
	{
		const Log log = open(first + first + first);
		write("log.rawlog", then);
		const auto reader = log.read();
		EXPECT_TRUE(reader->next().has_value());
		EXPECT_FALSE(reader->next().has_value());
		EXPECT_FALSE(reader->next().has_value());
		EXPECT_NE(reader->damage().find("has changed since the run began, after object 1; run"), std::string::npos)
		    << reader->damage();
	}
	const Log grown = open(first + first);
	write("log.rawlog", first + first + crash);
	EXPECT_EQ(count_objects(grown), 2U);
}
}  // namespace
}  // namespace d2s1r::logs
