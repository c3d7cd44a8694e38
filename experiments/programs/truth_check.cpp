// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "truth_check.h"

#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_set>

namespace d2s1r::experiments
{
namespace
{
using mrpt::math::TPoint2D;
using mrpt::poses::CPose2D;

constexpr double kWay = 2;                         //!< [m] how far along the drive a scan is compared
constexpr double kWheels = 0.5, kWheelsTurn = 25;  //!< [m], [deg] by which wheels may be off on that way
constexpr double kCell = 0.05, kNear = 0.1,
                 kSearchStep = 0.1;                    //!< [m] in which returns count as the same; step of the search
constexpr double kLeastMoved = 0.15, kMost = 0.4;      //!< [m]
constexpr double kLeastTurned = 4, kMostTurned = 20;   //!< [deg]
constexpr double kLeastGain = 0.1, kLeastShown = 0.5;  //!< [0, 1] of the returns
constexpr std::size_t kReturns = 90;                   //!< [-] of a scan that are compared, at most

std::vector<TPoint2D> returns_of(const mrpt::obs::CObservation2DRangeScan& scan)
{
	mrpt::maps::CSimplePointsMap points;
	points.insertionOptions.minDistBetweenLaserPoints = 0;
	points.insertionOptions.also_interpolate = false;
	points.insertObservation(scan);
	std::vector<TPoint2D> returns(points.size());
	for (std::size_t i = 0; i < returns.size(); i++)
	{
		float x = 0, y = 0;
		points.getPoint(i, x, y);
		returns[i] = {static_cast<double>(x), static_cast<double>(y)};
	}
	return returns;
}

/// Holds the cells in which, or beside which, scans have returns.
class Seen
{
   public:
	void add(const TPoint2D& point)
	{
		const int reach = static_cast<int>(std::lround(kNear / kCell));
		for (int dy = -reach; dy <= reach; dy++)
			for (int dx = -reach; dx <= reach; dx++)
				if (std::hypot(dx, dy) * kCell <= kNear + 1e-9)
					cells_.insert(key(cell(point.x) + dx, cell(point.y) + dy));
	}

	/// [0, 1]
	double share_of(const std::vector<TPoint2D>& points, const CPose2D& robot) const
	{
		const double c = std::cos(robot.phi()), s = std::sin(robot.phi());
		std::size_t count = 0;
		for (const TPoint2D& p : points)
			count += cells_.count(key(cell(robot.x() + c * p.x - s * p.y), cell(robot.y() + s * p.x + c * p.y)));
		return points.empty() ? 0 : static_cast<double>(count) / static_cast<double>(points.size());
	}

   private:
	static int cell(double length) { return static_cast<int>(std::floor(length / kCell)); }
	static std::int64_t key(int x, int y) { return (static_cast<std::int64_t>(x) << 32) ^ (y & 0xffffffffLL); }

	std::unordered_set<std::int64_t> cells_;
};

std::vector<TPoint2D> thinned(const std::vector<TPoint2D>& points)
{
	std::vector<TPoint2D> some;
	const std::size_t stride = (points.size() + kReturns - 1) / kReturns;
	for (std::size_t i = 0; i < points.size(); i += stride) some.push_back(points[i]);
	return some;
}
}  // namespace

TruthCheck::TruthCheck(const std::vector<DrivenScan>& scans) : scans_(scans)
{
	for (const DrivenScan& scan : scans_) returns_.push_back(returns_of(*scan.scan));
}

bool TruthCheck::wheels_contradict(std::size_t scan, std::size_t other) const
{
	const DrivenScan &a = scans_[scan], &b = scans_[other];
	if (!a.odometry || !b.odometry) return false;
	const CPose2D off = (b.robot - a.robot) - (*b.odometry - *a.odometry);
	const double way = (b.robot - a.robot).norm() - (*b.odometry - *a.odometry).norm();
	return std::abs(way) > kWheels || std::abs(mrpt::math::wrapToPi(off.phi())) > mrpt::DEG2RAD(kWheelsTurn);
}

bool TruthCheck::fits_elsewhere(std::size_t scan, const std::vector<std::size_t>& others) const
{
	Seen seen;
	for (const std::size_t other : others)
		for (const TPoint2D& point : returns_[other]) seen.add(scans_[other].robot + point);
	const auto returns = thinned(returns_[scan]);
	const CPose2D& truth = scans_[scan].robot;
	const double here = seen.share_of(returns, truth);
	for (double turn = -kMostTurned; turn <= kMostTurned; turn += 2)
		for (double dx = -kMost; dx <= kMost + 1e-9; dx += kSearchStep)
			for (double dy = -kMost; dy <= kMost + 1e-9; dy += kSearchStep)
			{
				if (std::hypot(dx, dy) < kLeastMoved && std::abs(turn) < kLeastTurned) continue;
				const CPose2D moved(truth.x() + dx, truth.y() + dy, truth.phi() + mrpt::DEG2RAD(turn));
				const double there = seen.share_of(returns, moved);
				if (there >= kLeastShown && there >= here + kLeastGain) return true;
			}
	return false;
}

bool TruthCheck::is_doubtful(std::size_t scan) const
{
	for (const int step : {-1, 1})
	{
		std::vector<std::size_t> others;
		double way = 0;
		for (auto i = static_cast<std::ptrdiff_t>(scan) + step;
		     i >= 0 && i < static_cast<std::ptrdiff_t>(scans_.size()); i += step)
		{
			const auto other = static_cast<std::size_t>(i);
			way += (scans_[other].robot - scans_[static_cast<std::size_t>(i - step)].robot).norm();
			if (way > kWay) break;
			others.push_back(other);
		}
		if (!others.empty() && (wheels_contradict(scan, others.back()) || fits_elsewhere(scan, others))) return true;
	}
	return false;
}
}  // namespace d2s1r::experiments
