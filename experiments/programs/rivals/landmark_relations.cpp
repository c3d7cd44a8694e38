// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// GLARE: histograms of geometrical landmark relations.
#include <algorithm>
#include <cmath>
#include <memory>

#include "flirt.h"

namespace d2s1r::rivals
{
namespace
{
constexpr int kDirections = 8;         // [-] over half a turn
constexpr int kDistances = 50;         // [-]
constexpr double kDistanceStep = 0.2;  // [m]

using Histogram = std::array<float, kDirections * kDistances>;

std::size_t bin_of(int direction, int distance)
{
	return static_cast<std::size_t>((direction + kDirections) % kDirections * kDistances + distance);
}

/// Counts all pairs of keypoints, each blurred over the next bins, so that the greatest count is 1.
Histogram relations_of(const std::vector<Keypoint>& keypoints)
{
	Histogram histogram{};
	for (std::size_t i = 0; i < keypoints.size(); i++)
		for (std::size_t j = i + 1; j < keypoints.size(); j++)
		{
			const auto d = keypoints[j].position - keypoints[i].position;
			const double angle = std::atan2(d.y, d.x);
			const int direction = static_cast<int>(std::floor((angle < 0 ? angle + M_PI : angle) / M_PI * kDirections));
			const int distance = static_cast<int>(std::lround(d.norm() / kDistanceStep));
			for (int u = -1; u <= 1; u++)
				for (int v = -1; v <= 1; v++)
					if (distance + v >= 0 && distance + v < kDistances)
						histogram[bin_of(direction + u, distance + v)] +=
						    static_cast<float>(std::exp(-0.5 * (u * u + v * v)));
		}
	const float greatest = *std::max_element(histogram.begin(), histogram.end());
	if (greatest > 0)
		for (float& value : histogram) value /= greatest;
	return histogram;
}

/// The L1 distance at the rotation at which it is least.
float histogram_distance(const Histogram& a, const Histogram& b)
{
	float least = static_cast<float>(a.size());
	for (int shift = 0; shift < kDirections; shift++)
	{
		float sum = 0;
		for (int direction = 0; direction < kDirections; direction++)
			for (int distance = 0; distance < kDistances; distance++)
				sum += std::abs(a[bin_of(direction, distance)] - b[bin_of(direction + shift, distance)]);
		least = std::min(least, sum);
	}
	return least;
}

struct Relations
{
	std::vector<std::vector<Keypoint>> keypoints;  //!< of each keyframe
	std::vector<Histogram> histograms;             //!< of each keyframe
	std::vector<mrpt::math::TPose2D> sensors;      //!< of each keyframe, sensor in map
};
}  // namespace

Rival landmark_relations(const std::vector<Keyframe>& keyframes)
{
	auto made = std::make_shared<Relations>();
	for (const Keyframe& keyframe : keyframes)
	{
		made->keypoints.push_back(find_keypoints(keyframe.scan));
		made->histograms.push_back(relations_of(made->keypoints.back()));
		made->sensors.push_back(keyframe.sensor);
	}
	const std::shared_ptr<const Relations> library = made;
	return [library](const Scan& scan)
	{
		const auto keypoints = find_keypoints(scan);
		const Histogram histogram = relations_of(keypoints);
		std::vector<std::pair<float, std::size_t>> ranked;
		for (std::size_t i = 0; i < library->histograms.size(); i++)
			ranked.emplace_back(histogram_distance(histogram, library->histograms[i]), i);
		const std::size_t count = std::min(kRetrieved, ranked.size());
		std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(count), ranked.end());
		std::vector<std::size_t> best;
		for (std::size_t i = 0; i < count; i++) best.push_back(ranked[i].second);
		return align_with_best(keypoints, best, library->keypoints, library->sensors);
	};
}
}  // namespace d2s1r::rivals
