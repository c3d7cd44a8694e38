// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "answer/prior_index.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace d2s1r
{
namespace
{
constexpr int kSectors = 64;                     //!< [-] of headings in [-pi, pi): the bits of a number
constexpr double kSector = 2 * M_PI / kSectors;  //!< [rad]
constexpr double kTiny = 1e-6;                   //!< [m] or [rad]: more than numbers are rounded by
constexpr int kMostPerSide = 64;                 //!< [squares]
constexpr std::size_t kMostEntries = 50'000;     //!< [-] boxes of all squares, which bounds the time to fill them

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

/// The sectors of headings that a box allows.
struct SectorsOfBox
{
	std::uint64_t whole;    //!< as a whole
	std::uint64_t in_part;  //!< at least in part
};

SectorsOfBox sectors_of(const PoseBox& box, double yaw_margin)
{
	const double reach = box.yaw_tolerance + yaw_margin;
	constexpr double kFarthestYaw = 1e3;  // [rad] where kTiny is still more than numbers are rounded by
	if (reach >= M_PI) return {~std::uint64_t{0}, ~std::uint64_t{0}};
	if (!(std::abs(box.yaw) < kFarthestYaw && std::abs(reach) < kFarthestYaw)) return {0, ~std::uint64_t{0}};
	const double yaw = mrpt::math::wrapToPi(box.yaw) + M_PI, inner = reach - kTiny, outer = reach + kTiny;
	const auto place = [](double angle) { return angle / kSector; };
	return {
	    sectors_between(std::ceil(place(yaw - inner)), std::floor(place(yaw + inner)) - 1),
	    sectors_between(std::floor(place(yaw - outer)), std::floor(place(yaw + outer)))};
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
    : prior_(prior), margin_(margin), yaw_margin_(yaw_margin), reached_{INFINITY, -INFINITY, INFINITY, -INFINITY}
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
	if (prior.anywhere() || !(side_x > 0 && side_y > 0 && std::isfinite(side_x + side_y))) return;
	int per_side = kMostPerSide;
	while (choose_squares(per_side) > kMostEntries && per_side > 1) per_side /= 2;
	fill_squares();
}

/// \return how many boxes the squares have together
std::size_t PriorIndex::choose_squares(int per_side)
{
	per_side_ = per_side;
	size_x_ = (area_.greatest_x - area_.least_x) / per_side;
	size_y_ = (area_.greatest_y - area_.least_y) / per_side;
	std::size_t entries = 0;
	for (const PoseBox& box : prior_.boxes) entries += squares_of(box).count();
	return entries;
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

bool PriorIndex::covers(const PoseBox& box, int x, int y) const
{
	const double reach = margin_ - kTiny;
	return box.contains_position(area_.least_x + x * size_x_, area_.least_y + y * size_y_, reach) &&
	       box.contains_position(area_.least_x + (x + 1) * size_x_, area_.least_y + (y + 1) * size_y_, reach);
}

void PriorIndex::fill_squares()
{
	squares_.assign(static_cast<std::size_t>(per_side_) * static_cast<std::size_t>(per_side_), {});
	const auto for_squares = [this](const PoseBox& box, const auto& take)
	{
		const Squares its = squares_of(box);
		for (int y = its.first_y; y < its.past_y; y++)
			for (int x = its.first_x; x < its.past_x; x++)
				take(
				    squares_
				        [static_cast<std::size_t>(y) * static_cast<std::size_t>(per_side_) +
				         static_cast<std::size_t>(x)],
				    x, y);
	};
	for (const PoseBox& box : prior_.boxes)
	{
		const SectorsOfBox sectors = sectors_of(box, yaw_margin_);
		for_squares(
		    box,
		    [&](Square& square, int x, int y)
		    {
			    square.touched |= sectors.in_part;
			    if (covers(box, x, y)) square.allowed |= sectors.whole;
			    square.past_box++;
		    });
	}
	std::size_t entries = 0;
	for (Square& square : squares_) square.past_box = std::exchange(entries, entries + square.past_box);
	boxes_of_squares_.resize(entries);
	for (std::uint32_t i = 0; i < prior_.boxes.size(); i++)
		for_squares(prior_.boxes[i], [&](Square& square, int, int) { boxes_of_squares_[square.past_box++] = i; });
}

/// Returns null if the position lies outside all squares: then the boxes are asked one by one.
const PriorIndex::Square* PriorIndex::square_at(double x, double y) const
{
	if (per_side_ == 0 || !area_.contains_position(x, y)) return nullptr;
	const auto place = [this](double offset, double size)
	{ return std::clamp(static_cast<int>(offset / size), 0, per_side_ - 1); };
	return &squares_[static_cast<std::size_t>(
	    place(y - area_.least_y, size_y_) * per_side_ + place(x - area_.least_x, size_x_))];
}

bool PriorIndex::allows(const mrpt::math::TPose2D& robot) const
{
	if (prior_.anywhere()) return true;
	if (!reached_.contains_position(robot.x, robot.y)) return false;
	const Square* const square = std::isfinite(robot.phi) ? square_at(robot.x, robot.y) : nullptr;
	if (!square) return prior_.allows(robot, margin_, yaw_margin_);
	const std::uint64_t sector = sector_of(robot.phi);
	if ((square->allowed & sector) != 0) return true;
	if ((square->touched & sector) == 0) return false;
	const std::size_t first = square == squares_.data() ? 0 : square[-1].past_box;
	return std::any_of(
	    boxes_of_squares_.data() + first, boxes_of_squares_.data() + square->past_box,
	    [&](std::uint32_t box) { return prior_.boxes[box].contains(robot, margin_, yaw_margin_); });
}

bool PriorIndex::allows_position(double x, double y) const
{
	if (prior_.anywhere()) return true;
	if (!reached_.contains_position(x, y)) return false;
	const Square* const square = square_at(x, y);
	if (!square) return prior_.allows_position(x, y, margin_);
	if (square->allowed != 0) return true;
	const std::size_t first = square == squares_.data() ? 0 : square[-1].past_box;
	return std::any_of(
	    boxes_of_squares_.data() + first, boxes_of_squares_.data() + square->past_box,
	    [&](std::uint32_t box) { return prior_.boxes[box].contains_position(x, y, margin_); });
}
}  // namespace d2s1r
