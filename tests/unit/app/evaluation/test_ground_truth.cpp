// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <shell/errors.h>

#include "../temporary_folder.h"
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
	const auto plane = load("% time x y phi\n1.5 2 3 0.5\r\n\n");
	ASSERT_EQ(plane.size(), 1U);
	EXPECT_EQ(plane[0].time, 1.5);
	EXPECT_EQ(plane[0].robot, mrpt::math::TPose2D(2, 3, 0.5));
	const auto space = load("# and with z\n 2.5 4 5 9 -0.5 8 7\n");
	ASSERT_EQ(space.size(), 1U);
	EXPECT_EQ(space[0].time, 2.5);
	EXPECT_EQ(space[0].robot, mrpt::math::TPose2D(4, 5, -0.5));
}

TEST_F(GroundTruthFile, ACommentWithCommasIsNoTable)
{
	const auto truth = load("% time x y phi  (sensor pose in the map frame, s, m, rad)\n1.5 2 3 0.5\n");
	ASSERT_EQ(truth.size(), 1U);
	EXPECT_EQ(truth[0].robot, mrpt::math::TPose2D(2, 3, 0.5));
}

TEST_F(GroundTruthFile, HoldsPosesOfTum)
{
	const auto truth = load("1.5 2 3 0 0 0 0.479425538604203 0.877582561890373\n");
	ASSERT_EQ(truth.size(), 1U);
	EXPECT_NEAR(truth[0].robot.phi, 1.0, 1e-9);
}

TEST_F(GroundTruthFile, HoldsATableWhoseColumnsHaveNames)
{
	const auto expect = [&](const std::string& names, const std::string& row, double phi)
	{
		const auto truth = load(names + "\n" + row + "\n");
		ASSERT_EQ(truth.size(), 1U) << names;
		EXPECT_NEAR(truth[0].time, 1.5e9, 1e-6) << names;
		EXPECT_NEAR(truth[0].robot.x, 2, 1e-9) << names;
		EXPECT_NEAR(truth[0].robot.y, 3, 1e-9) << names;
		EXPECT_NEAR(truth[0].robot.phi, phi, 1e-9) << names;
	};
	expect("time,x,y,yaw", "1.5e9, 2, 3, 0.5", 0.5);
	expect("frame,timestamp,status,x,y,phi,std_x", "7,1500000000,localized,2,3,0.25,0.1", 0.25);
	expect(
	    "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []",
	    "1500000000000000000,2,3,0,0.877582561890373,0,0,0.479425538604203", 1.0);
	expect(
	    "%time,field.pose.pose.position.x,field.pose.pose.position.y,field.pose.pose.orientation.x,"
	    "field.pose.pose.orientation.y,field.pose.pose.orientation.z,field.pose.pose.orientation.w",
	    "1500000000000000000,2,3,0,0,0.479425538604203,0.877582561890373", 1.0);
}

TEST_F(GroundTruthFile, RowsWithoutAPoseArePassedOver)
{
	EXPECT_EQ(load("timestamp,x,y,phi\n1,2,3,4\n2,,,\n3,2,3,4\n").size(), 2U);
	EXPECT_NE(refusal("timestamp,x,phi\n").find("line 1 names no column for y"), std::string::npos);
	EXPECT_NE(refusal("timestamp,x,y\n").find("names no column for phi, yaw, theta or"), std::string::npos);
	EXPECT_NE(refusal("time,x,y,phi\n1,2,b,4\n").find("line 2 has 'b' as y, which is no number"), std::string::npos);
}

TEST_F(GroundTruthFile, UnitsInTheNamesOfColumnsCount)
{
	const auto expect_pose = [&](const std::string& text)
	{
		const auto truth = load(text);
		ASSERT_EQ(truth.size(), 1U) << text;
		EXPECT_NEAR(truth[0].time, 1700000000.5, 1e-5) << text;
		EXPECT_NEAR(truth[0].robot.x, 2, 1e-9) << text;
		EXPECT_NEAR(truth[0].robot.y, -3, 1e-9) << text;
		EXPECT_NEAR(truth[0].robot.phi, M_PI / 2, 1e-9) << text;
	};
	expect_pose("time [s],x [m],y [m],yaw [deg]\n1700000000.5,2,-3,90\n");
	expect_pose("Time (s), X (mm), Y (cm), Heading (\xC2\xB0)\n1700000000.5,2000,-300,90\n");
	expect_pose("timestamp_ms,x,y,yaw_deg\n1700000000500,2,-3,90\n");
	expect_pose("#timestamp [ns],x [m],y [m],theta_degrees\n1700000000500000000,2,-3,90\n");
	expect_pose("t [us],x,y,phi [rad]\n1700000000500000,2,-3,1.5707963267948966\n");
	for (const char* names : {"time,x,y,yaw [turns]", "time [h],x,y,yaw", "time,x [ft],y,yaw"})
		EXPECT_NE(refusal(std::string(names) + "\n1,2,3,4\n").find("with the unit '"), std::string::npos) << names;
}

TEST_F(GroundTruthFile, TimesOfRosAndPlotJuggler)
{
	const auto expect_time = [&](const std::string& text)
	{
		const auto truth = load(text);
		ASSERT_EQ(truth.size(), 1U) << text;
		EXPECT_NEAR(truth[0].time, 1700000000.5, 1e-5) << text;
		EXPECT_NEAR(truth[0].robot.x, 2, 1e-9) << text;
	};
	expect_time("__time,/gt/pose/position/x,/gt/pose/position/y,/gt/pose/orientation/yaw\n1700000000.5,2,3,0.2\n");
	expect_time(
	    "header.stamp.sec,header.stamp.nanosec,pose.position.x,pose.position.y,pose.yaw\n1700000000,500000000,2,3,0\n");
	expect_time("stamp_secs,stamp_nsecs,x,y,yaw\n1700000000,500000000,2,3,0\n");
	expect_time(
	    "%time,field.header.seq,field.header.stamp,field.pose.position.x,field.pose.position.y,field.yaw\n"
	    "1600000000000000000,7,1700000000500000000,2,3,0\n");
	expect_time("1700000000500000000 2 3 0 0 0 0 1\n");
	expect_time("1700000000500000000 2 3 0\n");
}

TEST_F(GroundTruthFile, AByteOrderMarkIsPassedOver)
{
	EXPECT_EQ(
	    load("\xEF\xBB\xBF"
	         "1.5 2 3 0.5\n")
	        .size(),
	    1U);
	EXPECT_EQ(
	    load("\xEF\xBB\xBF"
	         "# time x y phi\n1.5 2 3 0.5\n")
	        .size(),
	    1U);
	EXPECT_EQ(
	    load("\xEF\xBB\xBF"
	         "time,x,y,yaw\n1.5,2,3,0.5\n")
	        .size(),
	    1U);
}

TEST_F(GroundTruthFile, LinesWithoutNumbersHaveNoPose)
{
	EXPECT_EQ(load("1 nan nan nan\n2 2 3 0.5\n").size(), 1U);
	EXPECT_EQ(load("1 2 3 0 0 0 0 1\n2 NaN NaN NaN NaN NaN NaN NaN\n3 2 3 0 0 0 0 1\n").size(), 2U);
	EXPECT_EQ(load("time,x,y,yaw\n1,nan,nan,nan\n2,2,3,NaN\n3,2,3,None\n4,2,3,0\n").size(), 1U);
	EXPECT_NE(refusal("nan 2 3 0.5\n").find("line 1 has 'nan' as time"), std::string::npos);
}

TEST_F(GroundTruthFile, WrongLinesAreNamed)
{
	for (const char* line :
	     {"1 2 3", "1 2 3 4 5", "1 2 3 4 5 6 7 8 9", "1,2,3,4", "1 2 3 0 0 0 0 0", "1 2 3 4 -", "1 2 3 4 1e999"})
		EXPECT_NE(refusal("1 2 3 4\n" + std::string(line) + "\n").find("line 2 has "), std::string::npos) << line;
	for (const char* line : {"1 2", "1 2 3 4 5", "1,2,3,4"})
		EXPECT_NE(refusal(line).find("line 1 is neither"), std::string::npos) << line;
	for (const char* line : {"1 2 three 4", "1 2 3 4e+", "1 2 1e999 4"})
		EXPECT_NE(refusal(line).find(", which is no number"), std::string::npos) << line;
	for (const char* line : {"1 2 3 0 0 0 0 0", "1 2 3 0 1e200 1e200 1e200 -1e200"})
		EXPECT_NE(refusal(line).find("is no rotation"), std::string::npos) << line;
	EXPECT_NE(
	    refusal("1 2 3 0 0 0 0 1\n2 2 3 0 0 0 1\n").find("line 2 has 7 numbers, and the lines above have 8"),
	    std::string::npos)
	    << "a line that lost a number is no other layout";
	EXPECT_NE(refusal("1 2 3 4\n2 1e308 3 4\n").find("line 2 has a position"), std::string::npos);
	EXPECT_NE(refusal("# nothing\n").find("holds no pose"), std::string::npos);
	EXPECT_NE(
	    refusal("1 2 3 4\n" + std::string(2'000'000, '0')).find("a line of more than 1048576"), std::string::npos);
	EXPECT_EQ(load("1 2 3 4\n5 6 7 8").size(), 2U) << "the last line need not end";
	EXPECT_THROW(load_ground_truth(path("missing.txt")), UserError);
}

TEST_F(GroundTruthFile, ACommentMayNameItsColumns)
{
	for (const char* text :
	     {"# time x y yaw[deg]\n1.5 2 3 90\n", "% t x y theta [deg]\n1.5 2 3 90\n",
	      "# time x y z qw qx qy qz\n1.5 2 3 9 0.70710678 0 0 0.70710678\n",
	      "#timestamp tx ty tz qw qx qy qz\n1.5 2 3 9 0.70710678 0 0 0.70710678\n"})
	{
		const auto truth = load(text);
		ASSERT_EQ(truth.size(), 1U) << text;
		EXPECT_NEAR(truth[0].robot.x, 2, 1e-12) << text;
		EXPECT_NEAR(truth[0].robot.phi, M_PI / 2, 1e-6) << text;
	}
	EXPECT_EQ(load("# time x y phi of the robot\n1.5 2 3 0.5\n")[0].robot.phi, 0.5) << "seven words, four numbers";
	EXPECT_NE(refusal("# time x y yaw[grad]\n1 2 3 4\n").find("unit 'grad'"), std::string::npos);
	EXPECT_NE(refusal("# time x y phi\n1 2 3 4\n1 2 3\n").find("line 3 has 3 numbers"), std::string::npos);
}

TEST_F(GroundTruthFile, TablesMayHaveSemicolonsOrTabs)
{
	for (const char* text : {"time;x;y;yaw [deg]\n1.5;2;3;90\n", "time\tx\ty\tyaw (deg)\n1.5\t2\t3\t90\n"})
	{
		const auto truth = load(text);
		ASSERT_EQ(truth.size(), 1U) << text;
		EXPECT_NEAR(truth[0].robot.phi, M_PI / 2, 1e-12) << text;
	}
	EXPECT_NE(refusal("time;x;y;yaw\n1,5;2,1;3;0\n").find("'1,5' as time"), std::string::npos) << "decimal commas";
}

TEST_F(GroundTruthFile, ATimeTellsItsUnit)
{
	for (const char* text :
	     {"1700000000.5 1 2 3\n", "1700000000500 1 2 3\n", "1700000000500000 1 2 3\n", "1700000000500000000 1 2 3\n"})
		EXPECT_NEAR(load(text)[0].time, 1700000000.5, 1e-3) << text;
}

TEST_F(GroundTruthFile, TheStampGoesBeforeTheTimeOfRecording)
{
	EXPECT_EQ(load("%time,field.header.stamp,x,y,phi\n7.5,3.25,1,2,0\n")[0].time, 3.25);
	EXPECT_EQ(load("__time,stamp.sec,stamp.nanosec,x,y,phi\n7.5,3,250000000,1,2,0\n")[0].time, 3.25);
	EXPECT_NE(
	    refusal("time,x,y,phi\n2023-11-14T22:13:20Z,1,2,0\n").find("'2023-11-14T22:13:20Z' as time"),
	    std::string::npos);
	EXPECT_NE(
	    refusal("\xFF\xFE"
	            "1")
	        .find("UTF-16"),
	    std::string::npos);
}
