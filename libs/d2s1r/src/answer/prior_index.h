// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/prior.h>

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
	bool may_allow(const mrpt::math::TPose2D& robot) const;

	/// Returns true if Prior::allows_position() does, and for a position less than a square beside as a rule, too.
	bool may_allow_position(double x, double y) const;

   private:
	/// The squares that a widened box reaches into.
	struct Squares
	{
		int first_x = 0, first_y = 0, past_x = 0, past_y = 0;

		std::size_t count() const;
	};

	std::size_t choose_squares(const Prior& prior, int per_side);
	Squares squares_of(const PoseBox& box) const;
	std::uint64_t headings_at(double x, double y) const;

	bool anywhere_;
	double margin_;
	PoseBox reached_;                      //!< what all boxes together reach
	PoseBox area_;                         //!< of all squares: the part of what the boxes reach that will be asked for
	int per_side_ = 0;                     //!< [squares] along x and along y; 0 if there are none
	double size_x_ = 0;                    //!< [m] of a square
	double size_y_ = 0;                    //!< [m] of a square
	std::vector<std::uint64_t> headings_;  //!< by square, row by row: a bit for each sector that may be allowed
};
}  // namespace d2s1r
