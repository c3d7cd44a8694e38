// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// experiments/windows.py, which measures how far the confidence of windows can be trusted.
#include "experiment_scripts.h"
#include "recorded_run.h"

using namespace d2s1r::test;

class Windows : public ExperimentScripts
{
   protected:
	Windows() : ExperimentScripts("numpy, scipy") {}

	/// What a script prints that may use the module windows and make frames.
	std::string printed(const std::string& script) const
	{
		return ExperimentScripts::printed(R"(
from windows import *
def frame(number, confidence, right=True, x=0.0, presence=1.0, frames=10, alone=0.5):
    return Frame(number, (0, 0, 0), Answer(alone > 0.9, alone, (0, 0, 0), True, True),
                 Answer(confidence > 0.9, confidence, (x, 0, 0), right, right or number % 40 != 0), presence, frames, 1.5, 1.0,
                 0.9, 0.3, 2.5, 5.04)
)" + script);
	}
};

TEST_F(Windows, ErrorsToldAreComparedWithThoseSeen)
{
	const std::string told = printed(
	    "honest = [frame(i, 0.95, i % 20 != 0) for i in range(400)]\n"
	    "bold = [frame(i, 0.9999, i % 10 != 0) for i in range(400)]\n"
	    "drives = {'intel': honest + bold, 'elsewhere': bold}\n"
	    "print(bins_table(drives, lambda answer: answer.right, '0.5 m'))\n"
	    "print(bins_table(drives, lambda answer: answer.at_place, '1.2 m'))");
	EXPECT_NE(told.find("| 0.9 to 0.99 | 400 | 20 | 5.000 | 5.000 |"), std::string::npos) << told;
	EXPECT_NE(told.find("| 0.999 to 1 | 400 | 40 | 0.010 | 10.000 |"), std::string::npos) << told;
	EXPECT_EQ(told.find("0.99 to 0.999"), std::string::npos) << "no frame is there";
	EXPECT_NE(told.find("| 0.9 to 0.99 | 400 | 10 | 5.000 | 2.500 |"), std::string::npos)
	    << "half are beside it " << told;
}

TEST_F(Windows, FramesThatAreWrongTogetherSayLittle)
{
	const std::string told = printed(
	    "together = [frame(i, 0.9995, not 100 <= i < 108) for i in range(800)]\n"
	    "drives = {'intel': together, 'fr079': [frame(i, 0.9995) for i in range(1500)]}\n"
	    "print(bins_table(drives, lambda answer: answer.right, '0.5 m'))");
	EXPECT_NE(told.find("| 0.999 to 1 | 2300 | 8 | 0.050 | 0.348 |"), std::string::npos) << told;
	EXPECT_NE(told.find(" | yes |"), std::string::npos) << "eight errors that are alone would contradict it\n" << told;
}

TEST_F(Windows, AnAnswerBesideTheTruthIsStillAtItsPlace)
{
	EXPECT_EQ(
	    printed("for x, phi in ((0.4, 0.0), (0.8, 0.0), (0.0, 0.3), (1.3, 0.0), (0.0, 0.4)):\n"
	            "    row = {'x': x, 'y': 0, 'phi': phi, 'status': 'localized', 'confidence': 1}\n"
	            "    answer = answer_of({name: str(value) for name, value in row.items()}, '', (0, 0, 0))\n"
	            "    print(answer.right, answer.at_place)"),
	    "True True\nFalse True\nFalse True\nFalse False\nFalse False\n");
}

TEST_F(Windows, WrongFramesAreListedWithHowTheScanFits)
{
	const std::string told =
	    printed("print(wrong_table({'intel': [frame(1, 0.95), frame(2, 0.95, False, x=3.0), frame(3, 0.5, False)]}))");
	EXPECT_NE(told.find("| intel | 2 | 3.00 | 0.0 | 0.9500 | 0.90 | 0.30 | 2.50 | +5.0 |"), std::string::npos) << told;
	EXPECT_EQ(told.find("| intel | 1 |"), std::string::npos) << "it is right";
	EXPECT_EQ(told.find("| intel | 3 |"), std::string::npos) << "it is not localized";
}

TEST_F(Windows, AJumpHasACause)
{
	EXPECT_EQ(
	    printed("for before, after in (\n"
	            "    (frame(0, 0.9), frame(1, 0.5, frames=1)),\n"
	            "    (frame(0, 0.9), frame(1, 0.5, x=2)), (frame(0, 0.9), frame(1, 0.5, presence=0.6)),\n"
	            "    (frame(0, 0.5, presence=0.6), frame(1, 0.9)), (frame(0, 0.9), frame(1, 0.5))):\n"
	            "    print(cause_of(before, after))"),
	    "no motion links the frame: its scan answers alone\n"
	    "another place is the best, 2.0 m away\n"
	    "the scan speaks against all places (absence +1.5 nat)\n"
	    "the scan speaks for all places (absence +1.5 nat)\n"
	    "the scan shows the best and others more alike than scans before\n");
}

TEST(DisturbedOdometry, HasAnotherScaleAndTurns)
{
	using d2s1r::experiments::RunFrame;
	std::vector<RunFrame> run(4);
	for (std::size_t i = 0; i < run.size(); i++) run[i].odometry = {1.0 + static_cast<double>(i), 2, 0};
	std::vector<RunFrame> longer = run, turned = run;
	d2s1r::experiments::disturb_odometry(longer, 1.7, 0);
	d2s1r::experiments::disturb_odometry(turned, 1, 10);
	for (std::size_t i = 1; i < run.size(); i++)
	{
		const auto way = *longer[i].odometry - *longer[i - 1].odometry;
		EXPECT_NEAR(way.x(), 1.7, 1e-9);
		EXPECT_EQ(way.phi(), 0);
		const auto motion = *turned[i].odometry - *turned[i - 1].odometry;
		EXPECT_NEAR(motion.x(), 1, 1e-9);
		EXPECT_NE(motion.phi(), 0);
		EXPECT_LT(std::abs(motion.phi()), 0.7);
	}
	EXPECT_EQ(longer[0].odometry->x(), 1);
}
