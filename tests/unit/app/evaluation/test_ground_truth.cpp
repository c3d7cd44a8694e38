// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "../temporary_folder.h"
#include "cli/errors.h"
#include "evaluation/ground_truth.h"

using namespace d2s1r::app;

class GroundTruthFile : public d2s1r::test::FolderTest
{
   protected:
	GroundTruth load(const std::string& content) const
	{
		write("truth.txt", content);
		return load_ground_truth(path("truth.txt"));
	}

	/// Returns the message of the error that a file with this content leads to.
	std::string refusal(const std::string& content) const
	{
		try
		{
			load(content);
		}
		catch (const UserError& error)
		{
			EXPECT_EQ(error.status, kBadInput);
			return error.what();
		}
		return "no error";
	}
};

TEST_F(GroundTruthFile, HoldsPosesOfThreeOrSixNumbers)
{
	const auto truth = load("% time x y phi\n1.5 2 3 0.5\r\n\n# and with z\n 2.5 4 5 9 -0.5 8 7\n");
	ASSERT_EQ(truth.size(), 2U);
	EXPECT_EQ(truth[0].timestamp, 1.5);
	EXPECT_EQ(truth[0].pose, mrpt::math::TPose2D(2, 3, 0.5));
	EXPECT_EQ(truth[1].timestamp, 2.5);
	EXPECT_EQ(truth[1].pose, mrpt::math::TPose2D(4, 5, -0.5));
}

TEST_F(GroundTruthFile, WrongLinesAreNamed)
{
	for (const char* line : {"1 2 3", "1 2 3 4 5", "1 2 three 4", "1 2 3 nan", "1 2 3 4 5 6 7 8", "1,2,3,4"})
		EXPECT_NE(refusal("1 2 3 4\n" + std::string(line) + "\n").find("line 2 is neither"), std::string::npos) << line;
	EXPECT_NE(refusal("# nothing\n").find("holds no pose"), std::string::npos);
	EXPECT_THROW(load_ground_truth(path("missing.txt")), UserError);
}
