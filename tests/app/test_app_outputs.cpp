// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What a run leaves in its folder.
#include <d2s1r/mrpt_version.h>
#include <d2s1r/version.h>
#include <mrpt/maps/registerAllClasses.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include D2S1R_DRAWING(CEllipsoid2D.h)
#include D2S1R_DRAWING_SCENE
#include D2S1R_DRAWING(CPlanarLaserScan.h)
#include D2S1R_DRAWING(CSetOfLines.h)
#include D2S1R_DRAWING(CSetOfObjects.h)
#include D2S1R_DRAWING(CTexturedPlane.h)
#include <mrpt/poses/CPose2DInterpolator.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "app_process.h"
#include "app_world.h"

using namespace d2s1r::test;
namespace fs = std::filesystem;
using mrpt::obs::CObservationOdometry;
using mrpt::obs::CObservationRobotPose;

namespace
{
/// Returns what an element of report.html holds in base64, packed by zlib.
std::string packed_in_report(const std::string& html, const std::string& id)
{
	const std::string begin = "id=\"" + id + "\">";
	const auto from = html.find(begin) + begin.size();
	std::string bytes;
	std::uint32_t bits = 0;
	int count = 0;
	for (auto at = from; html[at] != '<' && html[at] != '='; at++)
	{
		static const std::string kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
		bits = bits << 6 | static_cast<std::uint32_t>(kDigits.find(html[at]));
		count += 6;
		if (count >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 0xff);
	}
	std::string text(1'000'000, '\0');
	uLongf size = text.size();
	const auto* const packed = reinterpret_cast<const Bytef*>(bytes.data());
	EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(text.data()), &size, packed, bytes.size()), Z_OK);
	text.resize(size);
	return text;
}
}  // namespace

class AppOutputs : public AppTest
{
   protected:
	/// Runs on a log of the flat.
	ProcessResult localize(const Objects& log, const Words& more = {})
	{
		save_map(flat(), path("flat.yaml"));
		save(log, path("in.rawlog"));
		Words words = {"-m", path("flat.yaml"), "-i", path("in.rawlog"), "-o", path("out")};
		words.insert(words.end(), more.begin(), more.end());
		auto result = run(words);
		EXPECT_EQ(result.status, 0) << result.err;
		return result;
	}

	CsvTable frames() const { return CsvTable(path("out/frames.csv"), kFramesHeader); }
	CsvTable hypotheses() const { return CsvTable(path("out/hypotheses.csv"), kHypothesesHeader); }

	static void expect_near(double x, double y, double phi, const mrpt::math::TPose2D& truth)
	{
		EXPECT_NEAR(x, truth.x, 0.1);
		EXPECT_NEAR(y, truth.y, 0.1);
		EXPECT_NEAR(std::remainder(phi - truth.phi, 2 * M_PI), 0, 0.04);
	}
};

TEST_F(AppOutputs, FolderHoldsTheFilesOfTheContractAndNothingElse)
{
	const auto result = localize(observation_log());
	std::set<std::string> names;
	for (const auto& entry : fs::directory_iterator(path("out"))) names.insert(entry.path().filename().string());
	const std::set<std::string> expected = {"frames.csv",     "hypotheses.csv", "localized.rawlog", "map.png",
	                                        "report.html",    "run.json",       "scene.3Dscene",    "summary.json",
	                                        "trajectory.tum", "trajectory.txt"};
	EXPECT_EQ(names, expected);
	const std::size_t line = result.out.find("written     " + path("out") + ":");
	ASSERT_NE(line, std::string::npos) << result.out;
	for (const auto& name : expected) EXPECT_NE(result.out.find(" " + name, line), std::string::npos) << result.out;
	EXPECT_EQ(result.err, "");
}

TEST_F(AppOutputs, NoRawlogLeavesTheCopyOfTheRawlogOut)
{
	const auto result = localize(observation_log(), {"--no-rawlog"});
	EXPECT_FALSE(fs::exists(path("out/localized.rawlog")));
	EXPECT_EQ(result.out.find("localized.rawlog"), std::string::npos) << result.out;
	EXPECT_EQ(frames().size(), walk().size());
	EXPECT_TRUE(fs::exists(path("out/scene.3Dscene")));
}

TEST_F(AppOutputs, QuietPrintsNothing)
{
	const auto result = localize(observation_log(), {"-q"});
	EXPECT_EQ(result.out, "");
	EXPECT_EQ(result.err, "");
}

TEST_F(AppOutputs, FramesCsvHasARowAFrameWithTheRobotsPose)
{
	localize(observation_log());
	const CsvTable table = frames();
	ASSERT_EQ(table.size(), walk().size());
	for (std::size_t i = 0; i < walk().size(); i++)
	{
		EXPECT_EQ(table.text(i, "frame"), std::to_string(i));
		EXPECT_NEAR(table.number(i, "timestamp"), walk_time(i), 1e-6);
		EXPECT_EQ(table.text(i, "status"), "localized");
		expect_near(table.number(i, "x"), table.number(i, "y"), table.number(i, "phi"), walk()[i]);
		EXPECT_GT(table.number(i, "std_x"), 0);
		EXPECT_GE(table.number(i, "confidence"), 0.5);
		EXPECT_LE(table.number(i, "confidence"), 1);
		EXPECT_GE(table.number(i, "hypotheses"), 1);
		EXPECT_GE(table.number(i, "total_ms"), 0);
	}
}

TEST_F(AppOutputs, FramesWithoutAPoseHaveEmptyFields)
{
	localize(covered_laser_log());
	const CsvTable table = frames();
	for (const std::size_t i : {3U, 4U})
	{
		EXPECT_EQ(table.text(i, "status"), "invalid");
		for (const char* column : {"x", "y", "phi", "std_x", "std_y", "std_phi", "confidence", "relative_entropy"})
			EXPECT_EQ(table.text(i, column), "") << column;
		EXPECT_EQ(table.text(i, "hypotheses"), "0");
		EXPECT_EQ(table.text(i, "cov_xphi"), "");
	}
	EXPECT_NE(table.text(4, "note").find("tilt"), std::string::npos) << table.text(4, "note");
	EXPECT_EQ(table.text(5, "note"), "");
	EXPECT_EQ(table.text(5, "status"), "localized");
	EXPECT_EQ(lines_of(read_file(path("out/trajectory.tum"))).size(), walk().size() - 2);
}

TEST_F(AppOutputs, HypothesesCsvRanksThoseOfEachFrame)
{
	localize(observation_log());
	const CsvTable table = hypotheses(), all_frames = frames();
	std::size_t row = 0;
	for (std::size_t frame = 0; frame < all_frames.size(); frame++)
	{
		double last = 1, sum = 0;
		for (int rank = 1; rank <= static_cast<int>(all_frames.number(frame, "hypotheses")); rank++, row++)
		{
			EXPECT_EQ(table.text(row, "frame"), std::to_string(frame));
			EXPECT_EQ(table.text(row, "rank"), std::to_string(rank));
			EXPECT_LE(table.number(row, "probability"), last);
			last = table.number(row, "probability");
			sum += last;
			if (rank == 1)
			{
				EXPECT_EQ(table.text(row, "x"), all_frames.text(frame, "x"));
			}
		}
		EXPECT_LE(sum, 1 + 1e-5);
	}
	EXPECT_EQ(row, table.size());
}

TEST_F(AppOutputs, TrajectoriesAreReadByTheirTools)
{
	localize(observation_log());
	mrpt::poses::CPose2DInterpolator path_of_mrpt;
	ASSERT_TRUE(path_of_mrpt.loadFromTextFile(path("out/trajectory.txt")));
	EXPECT_EQ(path_of_mrpt.size(), walk().size());
	const CsvTable table = frames();
	const auto rows = lines_of(read_file(path("out/trajectory.txt")));
	ASSERT_EQ(rows.size(), table.size());
	for (std::size_t i = 0; i < rows.size(); i++)
		EXPECT_EQ(
		    rows[i], table.text(i, "timestamp") + " " + table.text(i, "x") + " " + table.text(i, "y") + " " +
		                 table.text(i, "phi"));
	const auto lines = lines_of(read_file(path("out/trajectory.tum")));
	ASSERT_EQ(lines.size(), walk().size());
	for (std::size_t i = 0; i < lines.size(); i++)
	{
		double t, x, y, z, qx, qy, qz, qw;
		ASSERT_EQ(
		    std::sscanf(lines[i].c_str(), "%lf %lf %lf %lf %lf %lf %lf %lf", &t, &x, &y, &z, &qx, &qy, &qz, &qw), 8);
		EXPECT_NEAR(t, walk_time(i), 1e-6);
		expect_near(x, y, 2 * std::atan2(qz, qw), walk()[i]);
		EXPECT_EQ(z, 0);
		EXPECT_NEAR(qx * qx + qy * qy + qz * qz + qw * qw, 1, 1e-6);
	}
}

TEST_F(AppOutputs, LocalizedRawlogHoldsEveryInputObjectAndThePoseAfterEachLocalizedFrame)
{
	const Objects log = covered_laser_log();
	localize(log);
	const Objects written = load(path("out/localized.rawlog"));
	std::size_t next = 0;
	for (std::size_t i = 0; i < log.size(); i++)
	{
		ASSERT_LT(next, written.size());
		EXPECT_EQ(bytes_of(*written[next++]), bytes_of(*log[i]));
		if (i == 3 || i == 4) continue;
		ASSERT_LT(next + 1, written.size());
		const auto pose = std::dynamic_pointer_cast<CObservationRobotPose>(written[next++]);
		const auto odometry = std::dynamic_pointer_cast<CObservationOdometry>(written[next++]);
		ASSERT_TRUE(pose && odometry);
		EXPECT_EQ(pose->sensorLabel, "D2S1R");
		EXPECT_EQ(pose->timestamp, walk_scan(i)->timestamp);
		expect_near(pose->pose.mean.x(), pose->pose.mean.y(), pose->pose.mean.yaw(), walk()[i]);
		EXPECT_GT(pose->pose.cov(0, 0), 0);
		EXPECT_EQ(odometry->sensorLabel, "D2S1R_ODO");
		const auto moved = mrpt::poses::CPose2D(walk()[i]) - mrpt::poses::CPose2D(walk()[0]);
		EXPECT_NEAR(odometry->odometry.x(), moved.x(), 0.15);
		EXPECT_NEAR(odometry->odometry.y(), moved.y(), 0.15);
	}
	EXPECT_EQ(next, written.size());
}

TEST_F(AppOutputs, SceneHoldsGridTrajectoryHypothesesAndLastScan)
{
	mrpt::maps::registerAllClasses_mrpt_maps();
	localize(observation_log());
	d2s1r::DrawnScene scene;
	ASSERT_TRUE(scene.loadFromFile(path("out/scene.3Dscene")));
	EXPECT_TRUE(std::dynamic_pointer_cast<d2s1r::drawing::CTexturedPlane>(scene.getByName("grid")));
	const auto lines = std::dynamic_pointer_cast<d2s1r::drawing::CSetOfLines>(scene.getByName("trajectory"));
	ASSERT_TRUE(lines);
	EXPECT_EQ(lines->size(), walk().size() - 1);
	const auto ellipses = std::dynamic_pointer_cast<d2s1r::drawing::CSetOfObjects>(scene.getByName("hypotheses"));
	ASSERT_TRUE(ellipses);
	EXPECT_GE(ellipses->size(), walk().size());
	const auto scan = std::dynamic_pointer_cast<d2s1r::drawing::CPlanarLaserScan>(scene.getByName("last_scan"));
	ASSERT_TRUE(scan);
	expect_near(scan->getPose().x, scan->getPose().y, scan->getPose().yaw, walk().back());
}

TEST_F(AppOutputs, SummaryTellsTheSameAsTheTable)
{
	save_truth(path("truth.txt"), false);
	const auto result = localize(covered_laser_log(), {"--ground-truth", path("truth.txt"), "--seed", "7"});
	const std::string summary = read_file(path("out/summary.json"));
	for (const char* member :
	     {"\"frames\": 12", "\"localized\": 10", "\"invalid\": 2", "\"rejected\": 0", "\"sensor_label\": \"LASER\"",
	      "\"successes\": 10", "\"seed\": 7", "\"p99\": "})
		EXPECT_NE(summary.find(member), std::string::npos) << member << summary;
	EXPECT_EQ(summary.find("nan"), std::string::npos);
	for (const char* line : {"localized      10", "invalid         2", "0.3 m, 5 deg: 10 of 12 frames"})
		EXPECT_NE(result.out.find(line), std::string::npos) << line << "\n" << result.out;
}

TEST_F(AppOutputs, ReportHoldsWhatItsFirstLineSumsUp)
{
	localize(covered_laser_log(), {"--window", "3"});
	const auto report = nlohmann::json::parse(packed_in_report(read_file(path("out/report.html")), "data-results"));
	EXPECT_EQ(report["version"], D2S1R_VERSION);
	EXPECT_EQ(report["map"], path("flat.yaml"));
	EXPECT_EQ(report["log"], path("in.rawlog"));
	EXPECT_EQ(report["window"], 3);
	const CsvTable table = frames();
	ASSERT_EQ(report["status"].size(), table.size());
	const std::vector<std::string> statuses = {"localized", "ambiguous", "rejected", "invalid"};  // as in report.js
	for (std::size_t i = 0; i < table.size(); i++)
	{
		EXPECT_EQ(std::to_string(report["index"][i].get<int>()), table.text(i, "frame"));
		EXPECT_EQ(statuses.at(report["status"][i].get<std::size_t>()), table.text(i, "status")) << i;
	}
}

TEST_F(AppOutputs, AllFilesTellTheSameUncertainty)
{
	localize(observation_log());
	const CsvTable table = frames(), all = hypotheses();
	std::size_t frame = 0, row = 0;
	for (const auto& object : load(path("out/localized.rawlog")))
		if (const auto pose = std::dynamic_pointer_cast<CObservationRobotPose>(object))
		{
			while (all.text(row, "frame") != std::to_string(frame)) row++;
			const std::vector<std::pair<const char*, int>> axes = {{"std_x", 0}, {"std_y", 1}, {"std_phi", 3}};
			for (const auto& [column, axis] : axes)
			{
				EXPECT_NEAR(table.number(frame, column), std::sqrt(pose->pose.cov(axis, axis)), 2e-6) << column;
				EXPECT_EQ(table.text(frame, column), all.text(row, column)) << column;
			}
			const std::vector<std::tuple<const char*, int, int>> entries = {{"cov_xx", 0, 0},   {"cov_xy", 0, 1},
			                                                                {"cov_xphi", 0, 3}, {"cov_yy", 1, 1},
			                                                                {"cov_yphi", 1, 3}, {"cov_phiphi", 3, 3}};
			for (const auto& [column, i, j] : entries)
				EXPECT_NEAR(table.number(frame, column), pose->pose.cov(i, j), 1e-5 * std::abs(pose->pose.cov(i, j)))
				    << column;
			frame++;
		}
	EXPECT_EQ(frame, walk().size());
}

TEST_F(AppOutputs, SummarySumsUpTheTimesOfTheTable)
{
	localize(observation_log(), {"--window", "3"});
	const auto summary = nlohmann::json::parse(read_file(path("out/summary.json")));
	EXPECT_EQ(summary["window"], 3);
	const CsvTable table = frames();
	for (const char* stage : {"retrieval_ms", "registration_ms", "refinement_ms", "total_ms"})
	{
		std::vector<double> times;
		for (std::size_t i = 0; i < table.size(); i++) times.push_back(table.number(i, stage));
		std::sort(times.begin(), times.end());
		ASSERT_EQ(times.size(), 12U);
		for (const auto& [name, rank] :
		     std::map<std::string, std::size_t>{{"p50", 6}, {"p90", 10}, {"p99", 11}, {"max", 11}})
			EXPECT_NEAR(summary[stage][name].get<double>(), times[rank], 1e-3) << stage << " " << name;
		EXPECT_NEAR(summary[stage]["mean"].get<double>(), std::accumulate(times.begin(), times.end(), 0.0) / 12, 1e-3);
	}
	for (std::size_t i = 0; i < table.size(); i++)
		EXPECT_LE(
		    table.number(i, "retrieval_ms") + table.number(i, "registration_ms") + table.number(i, "refinement_ms"),
		    table.number(i, "total_ms") + 0.01);
}

TEST_F(AppOutputs, SummaryIsUtf8WhateverTheNames)
{
	const std::string unknown = "\xEF\xBF\xBD";
	const auto expect_label = [&](const std::string& label, const std::string& written)
	{
		localize({walk_scan(0, label)}, {"-q"});
		const std::string summary = read_file(path("out/summary.json"));
		EXPECT_NE(summary.find("\"sensor_label\": \"" + written + "\""), std::string::npos) << summary;
	};
	const std::string characters = "caf\xC3\xA9 \xE2\x82\xAC \xF0\x9F\xA4\x96 \xF4\x8F\xBF\xBF";
	expect_label(characters, characters);
	expect_label("caf\xE9.", "caf" + unknown + ".");
	expect_label("\xE2\x82", unknown);  // cut short
}

TEST_F(AppOutputs, ParametersMayBeWrittenToTheNewFolder)
{
	localize(observation_log(), {"-q", "--write-config", path("out/all.ini")});
	EXPECT_NE(read_file(path("out/all.ini")).find("[localizer]"), std::string::npos);
}

TEST_F(AppOutputs, SavedMapGivesTheSamePoses)
{
	localize(observation_log(), {"-q", "--save-map", path("flat.signaturemap")});
	const std::string poses = read_file(path("out/trajectory.tum"));
	EXPECT_EQ(run({"-m", path("flat.signaturemap"), "-i", path("in.rawlog"), "-o", path("again"), "-q"}).status, 0);
	EXPECT_EQ(read_file(path("again/trajectory.tum")), poses);
	expect_refusal(
	    {"-m", path("flat.yaml"), "-i", path("in.rawlog"), "-o", path("out"), "--save-map", path("no/folder/map")}, 3,
	    {path("no/folder/map")});
}
