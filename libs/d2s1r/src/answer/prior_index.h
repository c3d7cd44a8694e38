// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/prior.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace d2s1r
{
/// Answers as a Prior does, in a time that hardly depends on the number of its boxes: each square of the map knows the
/// boxes that reach into it, and the headings that some box allows in all of it. It refers to the prior.
class PriorIndex
{
   public:
	/// \param area [m, map frame] where the positions lie that will be asked for; its yaw has no meaning. Positions
	///        elsewhere take longer.
	/// \param margin [m] by which the boxes are widened
	/// \param yaw_margin [rad]
	PriorIndex(const Prior& prior, const PoseBox& area, double margin, double yaw_margin);

	/// Returns what Prior::allows() returns.
	bool allows(const mrpt::math::TPose2D& robot) const;

	/// Returns what Prior::allows_position() returns.
	bool allows_position(double x, double y) const;

   private:
	struct Square
	{
		std::uint64_t allowed = 0;  //!< a bit for each sector of headings that some box allows in all of the square
		std::uint64_t touched = 0;  //!< a bit for each sector of headings of which some box allows a part in a part
		std::size_t past_box =
		    0;  //!< end of its boxes in boxes_of_squares_; they begin at the end of the square before
	};

	/// The squares that a widened box reaches into.
	struct Squares
	{
		int first_x = 0, first_y = 0, past_x = 0, past_y = 0;

		std::size_t count() const;
	};

	std::size_t choose_squares(int per_side);
	void fill_squares();
	Squares squares_of(const PoseBox& box) const;
	bool covers(const PoseBox& box, int x, int y) const;
	const Square* square_at(double x, double y) const;

	const Prior& prior_;
	double margin_;
	double yaw_margin_;
	PoseBox reached_;              //!< what all boxes together reach
	PoseBox area_;                 //!< of all squares: the part of what the boxes reach that will be asked for
	int per_side_ = 0;             //!< [squares] along x and along y; 0 if there are none
	double size_x_ = 0;            //!< [m] of a square
	double size_y_ = 0;            //!< [m] of a square
	std::vector<Square> squares_;  //!< row by row
	std::vector<std::uint32_t> boxes_of_squares_;  //!< indices of boxes of the prior, square by square
};
}  // namespace d2s1r
