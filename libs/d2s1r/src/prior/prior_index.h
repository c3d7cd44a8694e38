// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/prior.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace d2s1r
{
/// Rules out most poses that a Prior does not allow, in a time that does not depend on the number of its boxes: each
/// square of an area knows the sectors of headings that some box allows somewhere in it. The more boxes there are, the
/// larger the squares. What it does not rule out is for Prior::allows() to decide.
class PriorIndex
{
   public:
	/// \param area [m, map frame] where the positions lie that will be asked for; its yaw has no meaning
	/// \param margin [m] by which the boxes are widened
	/// \param yaw_margin [rad]
	PriorIndex(const Prior& prior, const PoseBox& area, double margin, double yaw_margin);

	/// Returns true if Prior::allows() does, and for a pose less than a square or a sector beside as a rule, too.
	bool may_allow(const mrpt::math::TPose2D& robot) const { return may_allow(robot.x, robot.y, sector_of(robot.phi)); }
	/// Does so for a position (x, y) [m, map frame] and a sector, for callers that ask for many positions with few
	/// headings.
	bool may_allow(double x, double y, std::uint64_t sector) const { return (headings_at(x, y) & sector) != 0; }

	/// Returns true if Prior::allows_position() does, and for a position less than a square beside as a rule, too.
	bool may_allow_position(double x, double y) const { return headings_at(x, y) != 0; }

	/// Returns the sector of a heading [rad]: a number with one bit; all bits for a heading that is no number.
	static std::uint64_t sector_of(double yaw);

   private:
	/// The squares that a widened box reaches into.
	struct Squares
	{
		int first_x = 0, first_y = 0, past_x = 0, past_y = 0;
	};

	int choose_per_side(const Prior& prior) const;
	Squares squares_of(const PoseBox& box) const;
	/// Returns the sectors of headings that may be allowed at a position; all of them where nothing is known.
	std::uint64_t headings_at(double x, double y) const;

	bool anywhere_;
	double margin_;
	PoseBox reached_;                      //!< what all boxes together reach
	PoseBox area_;                         //!< of all squares: the part of what the boxes reach that will be asked for
	int per_side_ = 0;                     //!< [squares] along x and along y; 0 if there are none
	double per_meter_x_ = 0;               //!< [squares/m]
	double per_meter_y_ = 0;               //!< [squares/m]
	std::vector<std::uint64_t> headings_;  //!< by square, row by row: a bit for each sector that may be allowed
};

inline std::uint64_t PriorIndex::headings_at(double x, double y) const
{
	if (anywhere_) return ~std::uint64_t{0};
	if (per_side_ > 0 && area_.contains_position(x, y))
	{
		const auto place = [this](double offset, double per_meter)
		{ return std::min(static_cast<int>(offset * per_meter), per_side_ - 1); };
		return headings_[static_cast<std::size_t>(
		    place(y - area_.least_y, per_meter_y_) * per_side_ + place(x - area_.least_x, per_meter_x_))];
	}
	return reached_.contains_position(x, y) ? ~std::uint64_t{0} : 0;
}
}  // namespace d2s1r
