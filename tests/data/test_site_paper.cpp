// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The published method with Table II on full circles simulated in real buildings.
#include <d2s1r/localizer.h>
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/obs/CRawlog.h>

#include "sites.h"

namespace d2s1r::test
{
namespace
{
class SitePaper : public testing::TestWithParam<const char*>
{
};

TEST_P(SitePaper, NinetySevenPercentAreWithinTwentyCentimetresAndFiveDegrees)
{
	const auto folder = sites_folder() / GetParam();
	if (!std::filesystem::exists(folder / "sim360_off.rawlog")) GTEST_SKIP() << why_skipped(folder);
	const auto parameters = load_parameters(std::string(D2S1R_SOURCE_DIR) + "/share/d2s1r/config/paper.ini");
	const Localizer localizer(load_map((folder / "map.yaml").string()), parameters);
	const auto truth = read_poses(folder / "sim360_off_gt.txt");
	mrpt::obs::CRawlog rawlog;
	ASSERT_TRUE(rawlog.loadFromRawLogFile((folder / "sim360_off.rawlog").string()));
	ASSERT_EQ(rawlog.size(), truth.size());
	std::size_t successes = 0;
	for (std::size_t i = 0; i < truth.size(); i++)
	{
		const auto scan = std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(rawlog.getAsObservation(i));
		ASSERT_TRUE(scan);
		const auto& pose = localizer.localize(*scan).best().pose;
		const double yaw = std::abs(mrpt::math::wrapToPi(pose.phi() - truth[i].phi));
		successes += std::hypot(pose.x() - truth[i].x, pose.y() - truth[i].y) < 0.2 && yaw < 5 * M_PI / 180 ? 1 : 0;
	}
	EXPECT_GE(static_cast<double>(successes), 0.97 * static_cast<double>(truth.size()));
}

INSTANTIATE_TEST_SUITE_P(
    Sites, SitePaper, testing::Values("intel", "mit_csail", "mit_killian"),
    [](const auto& site) { return std::string(site.param); });
}  // namespace
}  // namespace d2s1r::test
