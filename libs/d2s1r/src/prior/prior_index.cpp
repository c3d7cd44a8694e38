// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "prior/prior_index.h"

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
constexpr double kMostSquares = 50'000;          //!< [-] of all boxes together, or four a box: it bounds the time

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
	const double yaw = (std::abs(box.yaw) <= M_PI ? box.yaw : mrpt::math::wrapToPi(box.yaw)) + M_PI;
	return sectors_between(std::floor((yaw - reach) / kSector), std::floor((yaw + reach) / kSector));
}
}  // namespace

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
	if (anywhere_ || !(side_x > kTiny && side_y > kTiny && std::isfinite(side_x + side_y))) return;
	per_side_ = choose_per_side(prior);
	per_meter_x_ = per_side_ / side_x;
	per_meter_y_ = per_side_ / side_y;
	headings_.assign(static_cast<std::size_t>(per_side_) * static_cast<std::size_t>(per_side_), 0);
	for (const PoseBox& box : prior.boxes)
	{
		const Squares its = squares_of(box);
		if (its.first_x == its.past_x || its.first_y == its.past_y) continue;
		const std::uint64_t sectors = sectors_of(box, yaw_margin);
		for (int y = its.first_y; y < its.past_y; y++)
			for (int x = its.first_x; x < its.past_x; x++)
				headings_[static_cast<std::size_t>(y * per_side_ + x)] |= sectors;
	}
}

/// Returns how many squares there are along x and along y: so many that all boxes together reach into about
/// kMostSquares of them, each box counted on its own.
int PriorIndex::choose_per_side(const Prior& prior) const
{
	const double area_x = area_.greatest_x - area_.least_x, area_y = area_.greatest_y - area_.least_y;
	const double per_area_x = 1 / area_x, per_area_y = 1 / area_y;
	double sides_x = 0, sides_y = 0, areas = 0;  // of all boxes, as parts of the sides and of the area
	for (const PoseBox& box : prior.boxes)
	{
		const double x =
		    std::min(box.greatest_x + margin_, area_.greatest_x) - std::max(box.least_x - margin_, area_.least_x);
		const double y =
		    std::min(box.greatest_y + margin_, area_.greatest_y) - std::max(box.least_y - margin_, area_.least_y);
		if (!(x >= 0 && y >= 0)) continue;
		sides_x += x * per_area_x;
		sides_y += y * per_area_y;
		areas += x * per_area_x * (y * per_area_y);
	}
	const auto boxes = static_cast<double>(prior.boxes.size());
	const auto squares = [&](int n) { return areas * n * n + (sides_x + sides_y) * n + boxes; };
	int per_side = kMostPerSide;
	while (squares(per_side) > std::max(kMostSquares, 4 * boxes) && per_side > 1) per_side /= 2;
	return per_side;
}

PriorIndex::Squares PriorIndex::squares_of(const PoseBox& box) const
{
	// From -1 to the number of squares along a side. What is cut off is rounded to zero, so that it must not be
	// negative.
	const auto square = [this](double offset, double per_meter)
	{ return static_cast<int>(1 + std::max(-1.0, std::min<double>(per_side_, offset * per_meter))) - 1; };
	const auto column = [&](double x) { return square(x - area_.least_x, per_meter_x_); };
	const auto row = [&](double y) { return square(y - area_.least_y, per_meter_y_); };
	const double reach = margin_ + kTiny;
	Squares squares{
	    std::max(0, column(box.least_x - reach)), std::max(0, row(box.least_y - reach)),
	    std::min(per_side_, column(box.greatest_x + reach) + 1), std::min(per_side_, row(box.greatest_y + reach) + 1)};
	squares.past_x = std::max(squares.first_x, squares.past_x);
	squares.past_y = std::max(squares.first_y, squares.past_y);
	return squares;
}

std::uint64_t PriorIndex::sector_of(double yaw)
{
	if (!std::isfinite(yaw)) return ~std::uint64_t{0};
	const auto sector = static_cast<int>(std::floor((mrpt::math::wrapToPi(yaw) + M_PI) / kSector));
	return std::uint64_t{1} << std::clamp(sector, 0, kSectors - 1);
}
}  // namespace d2s1r
