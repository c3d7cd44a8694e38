// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What is known of a rawlog before it is read in earnest, even if MRPT's reader crashes on it.
#include <logs/errors.h>
#include "app/temporary_folder.h"
#include "rawlog_reader.h"

#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <zlib.h>

#include <fstream>
#include <iterator>

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
	LogSurvey survey(const std::string& bytes) const
	{
		write("log.rawlog", bytes);
		return survey_rawlog(path("log.rawlog"), [] { return false; });
	}
};

TEST_F(SurveyOfRawlog, CountsTheScansOfEachLaserAndAllObjects)
{
	const LogSurvey found = survey(scan_of("front") + scan_of("a\nb") + action() + scan_of("front"));
	EXPECT_EQ(found.damage, "");
	EXPECT_EQ(found.objects, 4U);
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
		const LogSurvey found = survey(parts + behind);
		EXPECT_EQ(found.damage, "") << behind;
		EXPECT_EQ(found.objects, 3U) << behind;
	}
	EXPECT_NE(survey(parts.substr(0, 60)).damage.find("cut short"), std::string::npos);
	EXPECT_NE(survey(packed(scan_of("front")) + "\x1f\x8b\x08?damaged").damage, "");
}

TEST_F(SurveyOfRawlog, KeepsWhatCameBeforeAnObjectThatCrashesMrptsReader)
{
	const LogSurvey found = survey(scan_of("front") + action() + action_without_a_pose_change() + scan_of("front"));
	EXPECT_EQ(found.objects, 2U);
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
	const LogSurvey found = survey(scan_of("front") + action_collection_of_two_billion());
	EXPECT_EQ(found.objects, 1U);
	EXPECT_NE(found.damage.find("too much memory to be read after object 1"), std::string::npos) << found.damage;
}

TEST_F(SurveyOfRawlog, SaysWhatIsWrongWithAFileThatCrashesMrptsReaderAtOnce)
{
	const LogSurvey found = survey(action_without_a_pose_change());
	EXPECT_EQ(found.objects, 0U);
	EXPECT_NE(found.damage.find("damaged from its start"), std::string::npos) << found.damage;
}
}  // namespace
}  // namespace d2s1r::logs
