// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "answer/prior_index.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>

namespace d2s1r
{
namespace
{
constexpr int kSectors = 64;                     //!< [-] of headings in [-pi, pi): the bits of a number
constexpr double kSector = 2 * M_PI / kSectors;  //!< [rad]
constexpr double kTiny = 1e-6;                   //!< [m] or [rad]: more than numbers are rounded by
constexpr int kMostPerSide = 256;                //!< [squares]
constexpr std::size_t kMostSquares = 50'000;     //!< [-] of all boxes together, or four a box: it bounds the time

/// Returns bits `first` to `last`; those beyond the last sector go on at the first.
std::uint64_t sectors_between(double first, double last)
{
	if (last < first) return 0;
	if (last - first + 1 >= kSectors) return ~std::uint64_t{0};
	const auto count = static_cast<unsigned>(last - first + 1);
	const auto start = static_cast<unsigned>(first - kSectors * std::floor(first / kSectors));
	const std::uint64_t bits = (std::uint64_t{1} << count) - 1;
	return start == 0 ? bits : bits << start | bits >> (kSectors - start);
}

/// Returns the sectors of headings that a box allows at least in part.
std::uint64_t sectors_of(const PoseBox& box, double yaw_margin)
{
	const double reach = box.yaw_tolerance + yaw_margin + kTiny;
	constexpr double kFarthestYaw = 1e3;  // [rad] where kTiny is still more than numbers are rounded by
	if (reach >= M_PI || !(std::abs(box.yaw) < kFarthestYaw && std::abs(reach) < kFarthestYaw))
		return ~std::uint64_t{0};
	const double yaw = mrpt::math::wrapToPi(box.yaw) + M_PI;
	return sectors_between(std::floor((yaw - reach) / kSector), std::floor((yaw + reach) / kSector));
}

std::uint64_t sector_of(double yaw)
{
	const auto sector = static_cast<int>(std::floor((mrpt::math::wrapToPi(yaw) + M_PI) / kSector));
	return std::uint64_t{1} << std::clamp(sector, 0, kSectors - 1);
}
}  // namespace

std::size_t PriorIndex::Squares::count() const
{
	return static_cast<std::size_t>(past_x - first_x) * static_cast<std::size_t>(past_y - first_y);
}

PriorIndex::PriorIndex(const Prior& prior, const PoseBox& area, double margin, double yaw_margin)
    : anywhere_(prior.anywhere()), margin_(margin), reached_{INFINITY, -INFINITY, INFINITY, -INFINITY}
{
	for (const PoseBox& box : prior.boxes)
	{
		reached_.least_x = std::min(reached_.least_x, box.least_x - margin);
		reached_.greatest_x = std::max(reached_.greatest_x, box.greatest_x + margin);
		reached_.least_y = std::min(reached_.least_y, box.least_y - margin);
		reached_.greatest_y = std::max(reached_.greatest_y, box.greatest_y + margin);
	}
	area_ = {
	    std::max(area.least_x, reached_.least_x), std::min(area.greatest_x, reached_.greatest_x),
	    std::max(area.least_y, reached_.least_y), std::min(area.greatest_y, reached_.greatest_y)};
	const double side_x = area_.greatest_x - area_.least_x, side_y = area_.greatest_y - area_.least_y;
	if (anywhere_ || !(side_x > 0 && side_y > 0 && std::isfinite(side_x + side_y))) return;
	const std::size_t most = std::max(kMostSquares, 4 * prior.boxes.size());
	int per_side = kMostPerSide;
	while (choose_squares(prior, per_side) > most && per_side > 1) per_side /= 2;
	headings_.assign(static_cast<std::size_t>(per_side_) * static_cast<std::size_t>(per_side_), 0);
	for (const PoseBox& box : prior.boxes)
	{
		const std::uint64_t sectors = sectors_of(box, yaw_margin);
		const Squares its = squares_of(box);
		for (int y = its.first_y; y < its.past_y; y++)
			for (int x = its.first_x; x < its.past_x; x++)
				headings_[static_cast<std::size_t>(y * per_side_ + x)] |= sectors;
	}
}

/// \return how many squares the boxes reach into, each counted on its own
std::size_t PriorIndex::choose_squares(const Prior& prior, int per_side)
{
	per_side_ = per_side;
	size_x_ = (area_.greatest_x - area_.least_x) / per_side;
	size_y_ = (area_.greatest_y - area_.least_y) / per_side;
	std::size_t count = 0;
	for (const PoseBox& box : prior.boxes) count += squares_of(box).count();
	return count;
}

PriorIndex::Squares PriorIndex::squares_of(const PoseBox& box) const
{
	const auto index = [this](double offset, double size)
	{ return std::fmax(-1, std::fmin(std::floor(offset / size), per_side_)); };
	const auto column = [&](double x) { return index(x - area_.least_x, size_x_); };
	const auto row = [&](double y) { return index(y - area_.least_y, size_y_); };
	const auto first = [](double number) { return std::max(0, static_cast<int>(number)); };
	const auto past = [this](double number) { return std::min(per_side_, static_cast<int>(number) + 1); };
	const double reach = margin_ + kTiny;
	Squares squares{
	    first(column(box.least_x - reach)), first(row(box.least_y - reach)), past(column(box.greatest_x + reach)),
	    past(row(box.greatest_y + reach))};
	squares.past_x = std::max(squares.first_x, squares.past_x);
	squares.past_y = std::max(squares.first_y, squares.past_y);
	return squares;
}

/// Returns the sectors of headings that may be allowed at a position; all of them where nothing is known.
std::uint64_t PriorIndex::headings_at(double x, double y) const
{
	if (anywhere_) return ~std::uint64_t{0};
	if (!reached_.contains_position(x, y)) return 0;
	if (per_side_ == 0 || !area_.contains_position(x, y)) return ~std::uint64_t{0};
	const auto place = [this](double offset, double size)
	{ return std::clamp(static_cast<int>(offset / size), 0, per_side_ - 1); };
	return headings_[static_cast<std::size_t>(
	    place(y - area_.least_y, size_y_) * per_side_ + place(x - area_.least_x, size_x_))];
}

bool PriorIndex::may_allow(const mrpt::math::TPose2D& robot) const
{
	const std::uint64_t headings = headings_at(robot.x, robot.y);
	return headings != 0 && (!std::isfinite(robot.phi) || (headings & sector_of(robot.phi)) != 0);
}

bool PriorIndex::may_allow_position(double x, double y) const
{
	return headings_at(x, y) != 0;
}
}  // namespace d2s1r
