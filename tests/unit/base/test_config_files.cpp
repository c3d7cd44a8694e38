// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The files in share/d2s1r/config are what the library writes. After a change of a parameter, run this test with
// D2S1R_UPDATE_CONFIG=1 in the environment: it writes them anew.
#include <d2s1r/parameters.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "test_files.h"

namespace d2s1r::test
{
namespace
{
void expect_file(const std::string& name, const Parameters& parameters)
{
	const std::string file = std::string(D2S1R_SOURCE_DIR) + "/share/d2s1r/config/" + name;
	if (std::getenv("D2S1R_UPDATE_CONFIG")) std::ofstream(file) << to_ini(parameters);
	EXPECT_EQ(read_bytes(file), to_ini(parameters)) << file << ": run this test with D2S1R_UPDATE_CONFIG=1";
	EXPECT_EQ(to_ini(load_parameters(file)), to_ini(parameters));
}
}  // namespace

TEST(ConfigFiles, DefaultIsWhatTheLibraryWrites)
{
	expect_file("default.ini", {});
}

TEST(ConfigFiles, PaperIsTheDefaultsWithThePublishedMethod)
{
	Parameters parameters;
	parameters.method = Method::kPaper;
	parameters.scan.zero_is_no_return = true;  // the paper has no beams without data
	parameters.scan.no_return = 1;
	expect_file("paper.ini", parameters);
}

TEST(ConfigFiles, PaperHasTheValuesOfTableTwo)
{
	const auto parameters = load_parameters(std::string(D2S1R_SOURCE_DIR) + "/share/d2s1r/config/paper.ini");
	EXPECT_EQ(parameters.method, Method::kPaper);
	EXPECT_EQ(parameters.paper.max_range, 30.0);
	EXPECT_EQ(parameters.paper.bins, 60);
	EXPECT_EQ(parameters.paper.epsilon, 1e-3);
	EXPECT_EQ(parameters.paper.candidates, 10);
	EXPECT_EQ(parameters.paper.directions, 360);
}
}  // namespace d2s1r::test
