// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>
#include <mrpt/poses/CPose2D.h>

#include <deque>

namespace d2s1r
{
/// Whether odometry can mean this increment: finite, and no more than a kilometre between two scans.
bool is_plausible(const mrpt::poses::CPose2D& increment);

/// A full circle put together from the scans of a laser with a narrow field of view on a robot that turns in place: the
/// paper's remedy for sensors that see less than 360 deg (end of Section III-C).
///
/// Every scan is moved, by odometry, to where the newest one was taken. Where several saw the same direction the newest
/// is believed, because the errors of odometry grow with the turn. Scans from places further away than `reach` are
/// forgotten, so that a robot that drives is not shown walls as they look from elsewhere.
///
/// \code
/// ScanAccumulator circle;
/// while (turning && !circle.complete()) circle.add(next_scan, next_motion);
/// const Localization result = localizer.localize(circle.scan());
/// \endcode
/// One object per robot; not thread-safe.
class ScanAccumulator
{
   public:
	/// \param directions [-] of a full turn that are told apart, at least 8
	/// \param reach [m] between the places of two scans that are put together, above 0
	/// \throws std::invalid_argument if one of them is out of range
	explicit ScanAccumulator(int directions = 360, double reach = 0.25);

	/// \param scan an invalid one counts for its motion only
	/// \param motion of the robot since the last call, in its frame then; not looked at in the first call
	void add(const Scan& scan, const mrpt::poses::CPose2D& motion);

	/// Share of the directions in which a beam looked [0, 1].
	double coverage() const;

	/// Whether the turn is closed but for a hole or two.
	bool complete() const { return coverage() >= kComplete; }

	/// One scan of all directions seen, as if taken where the robot is now by the sensor of the newest scan. Its field
	/// of view is 2 pi if complete(), else the sum of the directions. Invalid if there was no usable scan yet.
	Scan scan() const;

	void clear() { views_.clear(); }

   private:
	static constexpr double kComplete = 0.97;  //!< [0, 1] coverage

	/// A scan and where it was taken.
	struct View
	{
		Scan scan;
		mrpt::poses::CPose2D robot;  //!< then, in the frame of the robot now, m and rad
	};
	struct Circle
	{
		std::vector<Beam> beams;   //!< sensor frame now, in no order
		std::vector<bool> looked;  //!< by direction

		double coverage() const;  //!< [0, 1]
	};

	/// \return whether it sees a direction that is not in `circle` yet
	bool add_to(Circle& circle, const View& view) const;
	Circle circle() const;
	std::size_t direction_of(double angle) const;

	int directions_;
	double reach_;
	std::deque<View> views_;  //!< newest first
};
}  // namespace d2s1r
