// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <mrpt/math/wrap2pi.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "map/free_cells.h"
#include "paper/paper_localizer.h"
#include "test_maps.h"

namespace
{
std::atomic<int> allocations{0};
}  // namespace

// Out of line: inlined on one side only, GCC takes new and free for a mismatched pair.
[[gnu::noinline]] void* operator new(std::size_t size)
{
	allocations++;
	if (void* memory = std::malloc(size)) return memory;
	throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment)
{
	allocations++;
	const auto step = static_cast<std::size_t>(alignment);
	if (void* memory = std::aligned_alloc(step, (size + step - 1) / step * step)) return memory;
	throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept
{
	std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept
{
	std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept
{
	std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
	std::free(memory);
}

namespace d2s1r::test
{
namespace
{
class PaperLocalizer : public testing::Test
{
   protected:
	const Grid grid_ = make_picture_grid(
	    enlarge(
	        {"############",  //
	         "#....#.....#",  //
	         "#..........#",  //
	         "#....#..#..#",  //
	         "##.#########",  //
	         "#..........#",  //
	         "############"},
	        10),
	    0.05, 2, -4);
	const Parameters parameters_{};
	const RayCaster caster_{grid_, parameters_.paper.max_range};
	const SignatureIndex index_{grid_, find_free_cells(grid_, {}), parameters_};

	Localization localize(const mrpt::math::TPose2D& robot, const Laser& laser = {}) const
	{
		const Scan scan = make_scan(make_observation(grid_, robot, laser), parameters_.scan);
		return localize_paper(scan, grid_, index_, caster_, parameters_.paper);
	}
};

void expect_near(const mrpt::poses::CPose2D& pose, const mrpt::math::TPose2D& truth)
{
	EXPECT_LT(std::hypot(pose.x() - truth.x, pose.y() - truth.y), 0.2) << pose << " for " << truth;
	EXPECT_LT(std::abs(mrpt::math::wrapToPi(pose.phi() - truth.phi)), 5 * M_PI / 180) << pose << " for " << truth;
}

TEST_F(PaperLocalizer, FindsRobotsAllOverTheMap)
{
	for (const mrpt::math::TPose2D robot :
	     {mrpt::math::TPose2D{3.0, -1.6, 0.3}, {6.2, -1.7, -2.5}, {4.1, -3.2, 1.7}, {2.8, -2.3, 3.1}})
	{
		const Localization result = localize(robot);
		ASSERT_EQ(result.status, Status::kLocalized);
		expect_near(result.best().pose, robot);
	}
}

TEST_F(PaperLocalizer, ReportsTheRobotNotTheSensor)
{
	Laser laser;
	laser.on_robot = mrpt::poses::CPose3D(0.25, -0.1, 0.4, 2.0, 0, 0);
	const mrpt::math::TPose2D robot{6.2, -2.0, 0.9};
	expect_near(localize(robot, laser).best().pose, robot);
	laser.on_robot = mrpt::poses::CPose3D(0.25, -0.1, 0.4, 2.0, 0, M_PI);  // upside down
	laser.clockwise = true;
	expect_near(localize(robot, laser).best().pose, robot);
}

TEST_F(PaperLocalizer, ReturnsAllCandidatesByRelativeEntropy)
{
	const Localization result = localize({3.0, -1.6, 0.3});
	ASSERT_EQ(result.hypotheses.size(), 10U);
	double total = 0;
	for (std::size_t i = 0; i < result.hypotheses.size(); i++)
	{
		total += result.hypotheses[i].probability;
		if (i == 0) continue;
		EXPECT_LE(result.hypotheses[i].log_likelihood, result.hypotheses[i - 1].log_likelihood);
		EXPECT_LE(result.hypotheses[i].probability, result.hypotheses[i - 1].probability);
	}
	EXPECT_NEAR(total, 1, 1e-9);
	EXPECT_GE(result.confidence, result.best().probability);
	EXPECT_LE(result.confidence, 1);
	EXPECT_GE(result.times.total_ms, result.times.retrieval_ms + result.times.registration_ms);
}

TEST_F(PaperLocalizer, ConfidenceIsThatOfThePlaceNotOfOneCell)
{
	const Localization result = localize({3.0, -1.6, 0.3});
	const mrpt::math::TPose2D best = result.best().pose.asTPose();
	double at_place = 0;
	for (const Hypothesis& hypothesis : result.hypotheses)
		if (std::hypot(hypothesis.pose.x() - best.x, hypothesis.pose.y() - best.y) < 0.3 &&
		    std::abs(mrpt::math::wrapToPi(hypothesis.pose.phi() - best.phi)) < M_PI / 18)
			at_place += hypothesis.probability;
	EXPECT_GT(at_place, result.best().probability + 0.05);
	EXPECT_NEAR(result.confidence, at_place, 1e-9);
}

TEST_F(PaperLocalizer, CovarianceIsThatOfACellAndAStepMovedToTheRobot)
{
	const double yaw = std::pow(M_PI / 180, 2) / 12, position = 0.05 * 0.05 / 12;
	const auto centered = localize({3.0, -1.6, 0.3}).best().covariance;
	EXPECT_NEAR(centered(0, 0), position, 1e-9);
	EXPECT_NEAR(centered(2, 2), yaw, 1e-9);
	EXPECT_NEAR(centered(0, 2), 0, 1e-12);

	Laser laser;
	laser.on_robot = mrpt::poses::CPose3D(1.0, 0, 0, 0, 0, 0);
	const Hypothesis ahead = localize({3.0, -1.6, 0.0}, laser).best();
	// A turn of the sensor moves the robot, 1 m behind it, sideways.
	EXPECT_NEAR(ahead.covariance(1, 1), position + yaw * std::pow(std::cos(ahead.pose.phi()), 2), 1e-9);
	EXPECT_NEAR(ahead.covariance(1, 2), -yaw * std::cos(ahead.pose.phi()), 1e-9);
}

TEST_F(PaperLocalizer, AllocatesNothingButTheHypotheses)
{
	const Scan scan = make_scan(make_observation(grid_, {3.0, -1.6, 0.3}), parameters_.scan);
	localize_paper(scan, grid_, index_, caster_, parameters_.paper);
	const int before = allocations;
	const Localization result = localize_paper(scan, grid_, index_, caster_, parameters_.paper);
	EXPECT_EQ(allocations - before, 1);
	EXPECT_EQ(result.hypotheses.size(), 10U);
}
}  // namespace
}  // namespace d2s1r::test
