// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <ros/drive_calibration.h>

#include <cmath>
#include <stdexcept>

namespace d2s1r::ros
{
namespace
{
TEST(Overrides, AreEnteredAsTheyAreWritten)
{
	Overrides all;
	all.sensor_pose = mrpt::poses::CPose3D(0.1, -0.2, 0.3, M_PI / 2, 0, M_PI);
	all.max_range = 30.0F;
	all.min_range = 0.25;
	all.range_factor = 0.001;
	all.sweep = SweepTime{-0.1, 0.1};
	all.beam_angles = BeamAngles{1.5, -1.5};
	all.ignores_flags = all.is_odometry_mirrored = true;
	all.odometry_clock = -3.25;
	const auto entries = entries_of(all);
	EXPECT_EQ(entries.size(), 9U) << "one for each field";
	Overrides entered;
	for (const auto& [name, value] : entries) EXPECT_TRUE(enter(name, value.empty() ? "true" : value, entered)) << name;
	EXPECT_EQ(entries_of(entered), entries);
	EXPECT_TRUE(entries_of({}).empty());
}

TEST(Overrides, RefuseNamesAndValuesThatTheyDoNotHave)
{
	Overrides overrides;
	EXPECT_FALSE(enter("colour", "red", overrides));
	EXPECT_THROW(enter("min-range", "-1", overrides), std::invalid_argument);
	EXPECT_THROW(enter("mirrored-odometry", "false", overrides), std::invalid_argument);
	EXPECT_TRUE(entries_of(overrides).empty());
}

TEST(Doubt, WidensAPoseAndDoesNotCallItLocalized)
{
	Localization answer;
	answer.status = Status::kLocalized;
	answer.hypotheses.resize(1);
	answer.hypotheses[0].covariance.setZero();
	apply(Doubt(), answer);
	EXPECT_EQ(answer.status, Status::kLocalized);
	Doubt doubt;
	doubt.why = "the drive contradicts the mounting";
	doubt.covariance(2, 2) = 0.5;
	apply(doubt, answer);
	EXPECT_EQ(answer.status, Status::kAmbiguous);
	EXPECT_EQ(answer.note, doubt.why);
	EXPECT_DOUBLE_EQ(answer.best().covariance(2, 2), 0.5);
}

TEST(Doubt, IsByHowWellADriveShowsWhereTheLaserIs)
{
	using calibration::kYaw;
	calibration::Calibration shown;
	shown.shown.laser = {0.3, -0.4, 1};
	shown.findings[kYaw].deviation = 0.05;
	shown.findings[kYaw].verdict = calibration::Verdict::kAsTold;
	EXPECT_EQ(doubt_of({}, shown, false).covariance(2, 2), 0) << "messages are believed";
	shown.findings[kYaw].verdict = calibration::Verdict::kChanged;
	Localization answer;
	answer.status = Status::kLocalized;
	answer.hypotheses.resize(1);
	answer.hypotheses[0].covariance.setZero();
	apply(doubt_of({}, shown, false), answer);
	EXPECT_EQ(answer.status, Status::kLocalized);
	EXPECT_NEAR(std::sqrt(answer.best().covariance(2, 2)), 0.05, 1e-9);
	EXPECT_NEAR(std::sqrt(answer.best().covariance(0, 0)), 0.5 * 0.05, 1e-9) << "of a laser 0.5 m from the middle";
	const Doubt doubt = both(doubt_of({}, shown, false), both({"it is contradicted"}, doubt_of({}, shown, false)));
	EXPECT_EQ(doubt.why, "it is contradicted");
	EXPECT_NEAR(doubt.covariance(2, 2), 2 * 0.05 * 0.05, 1e-9) << "of two lasers";
}
}  // namespace
}  // namespace d2s1r::ros
