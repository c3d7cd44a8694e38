// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "shell.h"

using d2s1r::test::run_command;
using d2s1r::test::why_not;

namespace
{
const std::string kDatasets = "/usr/share/mrpt/datasets/";

/// A file or folder that no test running at the same time has.
std::string scratch(const std::string& name)
{
	const auto* test = testing::UnitTest::GetInstance()->current_test_info();
	return testing::TempDir() + "d2s1r_" + test->name() + "_" + name;
}

/// localization_demo with a CSignatureMap2D as its only map, from a box round the first pose.
std::string localization_ini(const std::string& map_of_experiment, const std::string& creation_options)
{
	return "[KLD_options]\n"
	       "KLD_maxSampleSize=1000\nKLD_minSampleSize=1000\n"
	       "[PF_options]\n"
	       "PF_algorithm=0\nresamplingMethod=0\nadaptiveSampleSize=0\nBETA=0.5\nsampleSize=1\n"
	       "[LocalizationExperiment]\n"
	       "particles_count=1000\ninit_PDF_mode=1\n"
	       "init_PDF_min_x=2.5\ninit_PDF_max_x=4.5\ninit_PDF_min_y=-11.2\ninit_PDF_max_y=-9.2\n"
	       "init_PDF_min_yaw_deg=-40\ninit_PDF_max_yaw_deg=0\n"
	       "rawlog_file=" +
	       kDatasets + "localization_demo.rawlog\n" + map_of_experiment + "logOutput_dir=" + testing::TempDir() +
	       "d2s1r_stock_log\n"
	       "3DSceneFrequency=-1\nSHOW_PROGRESS_3D_REAL_TIME=false\n"
	       "[MetricMap]\nsignatureMap_count=1\n"
	       "[MetricMap_signatureMap_00_creationOpts]\n" +
	       creation_options;
}

/// The last pose that pf-localization prints: x [m], y [m], phi [deg], map frame.
std::array<double, 3> last_estimate(const std::string& output)
{
	const auto at = output.rfind("PDF estimation: (");
	std::array<double, 3> pose = {NAN, NAN, NAN};
	if (at != std::string::npos)
		std::sscanf(output.c_str() + at, "PDF estimation: (%lf,%lf,%lfdeg)", &pose[0], &pose[1], &pose[2]);
	return pose;
}

class StockPfLocalization : public testing::Test
{
   protected:
	void SetUp() override
	{
		if (const auto why = why_not("pf-localization", D2S1R_MODULE); !why.empty()) GTEST_SKIP() << why;
		if (!std::filesystem::exists(kDatasets + "localization_demo.rawlog"))
			GTEST_SKIP() << kDatasets << "localization_demo.rawlog is missing (mrpt-common)";
	}

	static void expect_to_arrive(const std::string& ini_text, const std::string& environment)
	{
		const std::string ini = scratch("stock.ini");
		std::ofstream(ini) << ini_text;
		const auto result = run_command(environment + " pf-localization " + ini);
		ASSERT_EQ(result.status, 0) << result.output;
		const auto pose = last_estimate(result.output);
		EXPECT_NEAR(pose[0], 15.91, 0.3) << result.output;
		EXPECT_NEAR(pose[1], -10.01, 0.3);
		EXPECT_NEAR(pose[2], 4.95, 5.0);
	}
};

TEST_F(StockPfLocalization, FillsASignatureMapFromItsSimpleMap)
{
	expect_to_arrive(
	    localization_ini("map_file=" + kDatasets + "localization_demo.simplemap.gz\n", ""), "LD_PRELOAD=" D2S1R_MODULE);
}

TEST_F(StockPfLocalization, TakesASignatureMapWithAMapFileOfItsOwn)
{
	expect_to_arrive(
	    localization_ini("", "map_file=" + kDatasets + "localization_demo.simplemap.gz\n"), "LD_PRELOAD=" D2S1R_MODULE);
}

TEST_F(StockPfLocalization, DoesNotRunBlindWithAMapThatStaysEmpty)
{
	const auto output_of = [](const std::string& ini_text)
	{
		const std::string ini = scratch("stock.ini");
		std::ofstream(ini) << ini_text;
		const auto result = run_command("LD_PRELOAD=" D2S1R_MODULE " pf-localization " + ini + " 2>&1");
		EXPECT_NE(result.status, 0) << result.output;
		return result.output;
	};
	EXPECT_NE(output_of(localization_ini("", "")).find("CSignatureMap2D is empty"), std::string::npos);
	auto two = localization_ini("", "map_file=" + kDatasets + "localization_demo.simplemap.gz\n");
	const std::string count = "signatureMap_count=1";
	two.replace(two.find(count), count.size(), "signatureMap_count=2");
	EXPECT_NE(output_of(two).find("MetricMap_signatureMap_01_creationOpts is missing"), std::string::npos);
}

TEST_F(StockPfLocalization, DoesNotKnowTheMapWithoutTheModule)
{
	const std::string ini = scratch("stock.ini");
	std::ofstream(ini) << localization_ini("map_file=" + kDatasets + "localization_demo.simplemap.gz\n", "");
	const auto pose = last_estimate(run_command("pf-localization " + ini).output);
	EXPECT_FALSE(std::abs(pose[0] - 15.91) < 0.3 && std::abs(pose[1] + 10.01) < 0.3);
}

TEST(StockRawlogEdit, LoadsTheModule)
{
	if (const auto why = why_not("rawlog-edit", D2S1R_MODULE); !why.empty()) GTEST_SKIP() << why;
	const std::string log = kDatasets + "localization_demo.rawlog";
	if (!std::filesystem::exists(log)) GTEST_SKIP() << log << " is missing (mrpt-common)";
	// LD_DEBUG tells which modules were initialized, whoever loaded them
	const auto result = run_command("LD_DEBUG=files rawlog-edit -p " D2S1R_MODULE " --info -i " + log);
	EXPECT_EQ(result.status, 0);
	EXPECT_NE(result.output.find("calling init: " D2S1R_MODULE), std::string::npos);
	EXPECT_EQ(result.output.find("Error loading"), std::string::npos);
	EXPECT_NE(result.output.find("Actions/SensoryFrame format       : Yes"), std::string::npos);
}

TEST(Module, NeedsNoWindowSystem)
{
	const auto libraries = run_command("ldd " D2S1R_MODULE);
	ASSERT_EQ(libraries.status, 0) << libraries.output;
	EXPECT_NE(libraries.output.find("libd2s1r.so"), std::string::npos);
	EXPECT_EQ(libraries.output.find("libwx"), std::string::npos) << libraries.output;
}
}  // namespace
