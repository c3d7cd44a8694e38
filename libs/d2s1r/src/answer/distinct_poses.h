// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <mrpt/math/TPose2D.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace d2s1r
{
/// Returns whether two poses, their yaws in [-pi, pi], are closer than `distance` [m] and `yaw` [rad].
inline bool are_near(const mrpt::math::TPose2D& a, const mrpt::math::TPose2D& b, double distance, double yaw)
{
	const double dx = a.x - b.x, dy = a.y - b.y, turn = std::abs(a.phi - b.phi);
	return dx * dx + dy * dy < distance * distance && std::min(turn, 2 * M_PI - turn) < yaw;
}

/// Chooses poses, their yaws in [-pi, pi], that lie apart: greedily, in the order in which they come. Poses in two maps
/// always lie apart.
class DistinctPoses
{
   public:
	/// Takes poses that are closer than `distance` [m] and `yaw` [rad] for one.
	DistinctPoses(double distance, double yaw)
	    : distance_(distance), yaw_(yaw), turns_(std::max(1.0, std::floor(M_PI / yaw))), newest_(kBuckets, -1)
	{
	}

	/// Adds `pose`, which is in the map of that number, if it lies apart from all that were added before.
	/// \return whether it does
	bool add(const mrpt::math::TPose2D& pose, std::size_t map = 0)
	{
		const Tiles x = tiles_of(pose.x), y = tiles_of(pose.y), turn = tiles_of_yaw(pose.phi);
		for (const std::int64_t row : {y.own, y.beside})
			for (const std::int64_t column : {x.own, x.beside})
				for (const std::int64_t sector : {turn.own, turn.beside})
					if (is_near_one_in(bucket(column, row, sector, map), pose, map)) return false;
		int& newest = newest_[bucket(x.own, y.own, turn.own, map)];
		chosen_.push_back({pose, map, newest});
		newest = static_cast<int>(chosen_.size()) - 1;
		return true;
	}

   private:
	static constexpr std::size_t kBuckets = 2048;

	struct Chosen
	{
		mrpt::math::TPose2D pose;
		std::size_t map;
		int before;  //!< the one chosen before it in its bucket, or -1
	};

	/// Numbers of tiles along one axis: that of a coordinate, and the one beside it of which any part is nearer than
	/// `distance_`.
	struct Tiles
	{
		std::int64_t own, beside;
	};

	Tiles tiles_of(double coordinate) const
	{
		const auto halves = static_cast<std::int64_t>(std::floor(coordinate / distance_));
		const std::int64_t own = halves >> 1;
		return {own, own + (halves & 1) * 2 - 1};
	}

	/// The same for a yaw, in sectors that are twice `yaw_` wide or wider.
	Tiles tiles_of_yaw(double yaw) const
	{
		const auto count = static_cast<std::int64_t>(turns_);
		const auto halves = static_cast<std::int64_t>(std::floor((yaw + M_PI) / M_PI * turns_));
		const std::int64_t own = halves >> 1;
		return {(own + count) % count, (own + (halves & 1) * 2 - 1 + count) % count};
	}

	/// Returns whether `pose` is near one that was added to a bucket.
	bool is_near_one_in(std::size_t bucket, const mrpt::math::TPose2D& pose, std::size_t map) const
	{
		for (int k = newest_[bucket]; k >= 0; k = chosen_[static_cast<std::size_t>(k)].before)
		{
			const Chosen& chosen = chosen_[static_cast<std::size_t>(k)];
			if (chosen.map == map && are_near(pose, chosen.pose, distance_, yaw_)) return true;
		}
		return false;
	}

	/// Returns the bucket of a tile of a map, whose side is twice `distance_`, and a sector of yaws. Tiles may share a
	/// bucket, which costs comparisons but does no harm.
	static std::size_t bucket(std::int64_t column, std::int64_t row, std::int64_t sector, std::size_t map)
	{
		const auto mixed = static_cast<std::uint64_t>(column) * 0x9E3779B97F4A7C15U +
		                   static_cast<std::uint64_t>(row) * 0xC2B2AE3D27D4EB4FU +
		                   static_cast<std::uint64_t>(sector) * 0xD6E8FEB86659FD93U +
		                   static_cast<std::uint64_t>(map) * 0x165667B19E3779F9U;
		return static_cast<std::size_t>(mixed >> 53U);
	}

	double distance_;          //!< [m]
	double yaw_;               //!< [rad]
	double turns_;             //!< [-] sectors of yaws in a full turn
	std::vector<int> newest_;  //!< by bucket, index into chosen_ or -1
	std::vector<Chosen> chosen_;
};
}  // namespace d2s1r
