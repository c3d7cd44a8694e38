// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/scan.h>
#include <mrpt/poses/CPose2D.h>

#include <deque>
#include <memory>
#include <vector>

namespace d2s1r
{
/// Returns whether odometry can mean this increment: it is finite, and no more than a kilometre between two scans.
bool is_plausible(const mrpt::poses::CPose2D& increment);

/// Puts a full circle together from the scans of a laser with a narrow field of view on a robot that turns in place. It
/// is the paper's remedy for sensors that see less than 360 deg (end of Section III-C).
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
/// Use one object per robot; it is not thread-safe.
class ScanAccumulator
{
   public:
	/// Starts without a scan.
	/// \param directions [-] into which a full turn is divided, from 8 to 36,000
	/// \param reach [m] greatest distance between the places of two scans that are put together, above 0
	/// \throws std::invalid_argument if one of them is out of range
	explicit ScanAccumulator(int directions = 360, double reach = 0.25);

	/// Adds the next scan.
	/// \param scan counts for its motion only if it is invalid
	/// \param motion of the robot since the last call, in its frame then; the first call does not look at it
	void add(const Scan& scan, const mrpt::poses::CPose2D& motion);

	/// Returns the share of the directions in which a beam looked [0, 1].
	double coverage() const;

	/// Returns whether the turn is closed but for a hole or two.
	bool complete() const { return coverage() >= kComplete; }

	/// Returns one scan of all directions seen, as if the sensor of the newest scan had taken it where the robot is
	/// now. Its field of view is 2 pi if complete(), else the sum of the directions. It is invalid if there was no
	/// usable scan yet.
	Scan scan() const;

	/// Forgets all scans.
	void clear() { views_.clear(); }

   private:
	static constexpr double kComplete = 0.97;  //!< [0, 1] coverage

	/// Holds a scan and where it was taken.
	struct View
	{
		Scan scan;
		mrpt::poses::CPose2D robot;  //!< robot at that time, in the frame of the robot now, m and rad
	};
	struct Circle
	{
		std::vector<Beam> beams;   //!< sensor frame now, in no order
		std::vector<bool> looked;  //!< by direction

		double coverage() const;  //!< [0, 1]
	};

	/// Adds what `view` sees to `circle`. \return whether that includes a direction that was not in it yet
	bool add_to(Circle& circle, const View& view) const;
	Circle circle() const;
	std::size_t direction_of(double angle) const;

	int directions_;
	double reach_;
	std::deque<View> views_;  //!< newest first
};

/// Holds what a laser of a robot saw, and where the robot was then.
struct PlacedObservation
{
	std::shared_ptr<const RangeScan> observation;  //!< not null
	mrpt::poses::CPose2D robot;  //!< in a frame that is the same for all observations, such as that of the odometry
	Sweep sweep = {};            //!< when its beams were taken; `robot` is that of its time 0
};

/// Makes one scan of what several lasers of a robot saw shortly after each other: as if the laser of the last
/// observation had seen it all from where it was then. Where several saw the same direction, the last of them is
/// believed. Observations that are not usable are left out, and so are those from places more than 2 m from the last.
/// \param observations in the order of their times; none of the pointers is null
/// \return an invalid scan if there is no usable observation
Scan merge_scans(const std::vector<PlacedObservation>& observations, const ScanParameters& parameters);
}  // namespace d2s1r
