// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "flirt.h"

#include <mrpt/math/wrap2pi.h>
#include <mrpt/poses/CPose2D.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace d2s1r::rivals
{
namespace
{
// The parameters of FLIRTlib, the authors' implementation, unless marked.
constexpr int kScales = 5;                 // [-]
constexpr double kFirstScale = 0.2;        // [m]
constexpr double kScaleStep = 1.4;         // [-]
constexpr float kLeastPeak = 0.34F;        // [-] the maximum of the curvature measure is 1 / e
constexpr double kLeastSupport = 0.02;     // [m] inner radius of a descriptor
constexpr double kSupport = 0.5;           // [m] its outer radius
constexpr double kSpread = 0.2;            // [m] of two keypoints so near only the stronger one is kept
constexpr double kGreatestDistance = 0.4;  // [-] of the descriptors of keypoints that are matched
constexpr double kInlier = 0.245;          // [m] its standard deviation of 0.1 m times the root of 5.99
constexpr double kGap = 0.5;               // [m] our choice: a wider one separates two curves

/// A piece of the scan without gaps.
struct Curve
{
	std::vector<mrpt::math::TPoint2D> points;  //!< [m] sensor frame
	std::vector<double> along;                 //!< [m] length of the curve up to each point
};

std::vector<Curve> curves_of(const std::vector<mrpt::math::TPoint2D>& points)
{
	std::vector<Curve> curves;
	for (std::size_t i = 0; i < points.size(); i++)
	{
		const double step = i > 0 ? (points[i] - points[i - 1]).norm() : 2 * kGap;
		if (step > kGap) curves.emplace_back();
		Curve& curve = curves.back();
		curve.along.push_back(curve.points.empty() ? 0 : curve.along.back() + step);
		curve.points.push_back(points[i]);
	}
	return curves;
}

/// The curve smoothed over `scale` [m], and how far that moves each of its points: z exp(-z), z = 2 |shift| / scale.
struct Smoothed
{
	std::vector<mrpt::math::TPoint2D> points;  //!< [m]
	std::vector<float> curvature;              //!< [-] up to 1 / e
};

Smoothed smooth(const Curve& curve, double scale)
{
	const std::size_t n = curve.points.size();
	const auto kernel = [&](std::size_t i, std::size_t j)
	{ return std::exp(-0.5 * std::pow((curve.along[i] - curve.along[j]) / scale, 2)); };
	std::vector<std::size_t> first(n), last(n);  // within three scales of each point
	for (std::size_t i = 0, low = 0, high = 0; i < n; i++)
	{
		while (curve.along[i] - curve.along[low] > 3 * scale) low++;
		while (high < n && curve.along[high] - curve.along[i] <= 3 * scale) high++;
		first[i] = low, last[i] = high;
	}
	std::vector<double> density(n, 0.0);  // of the points, which the normalization takes out
	for (std::size_t i = 0; i < n; i++)
		for (std::size_t j = first[i]; j < last[i]; j++) density[i] += kernel(i, j);
	Smoothed result;
	for (std::size_t i = 0; i < n; i++)
	{
		mrpt::math::TPoint2D mean(0, 0);
		double weights = 0;
		for (std::size_t j = first[i]; j < last[i]; j++)
		{
			const double weight = kernel(i, j) / density[j];
			mean += curve.points[j] * weight;
			weights += weight;
		}
		mean *= 1 / weights;
		const double z = 2 * (mean - curve.points[i]).norm() / scale;
		result.points.push_back(mean);
		result.curvature.push_back(static_cast<float>(z * std::exp(-z)));
	}
	return result;
}

/// A keypoint without descriptor, and how strong it is.
using Peak = std::pair<float, Keypoint>;

void add_peaks(const Curve& curve, double scale, std::vector<Peak>& peaks)
{
	const Smoothed smoothed = smooth(curve, scale);
	const std::size_t n = curve.points.size();
	for (std::size_t i = 1; i + 1 < n; i++)
	{
		const float value = smoothed.curvature[i];
		if (value < kLeastPeak) continue;
		bool is_maximum = true;
		for (std::size_t j = i; j-- > 0 && curve.along[i] - curve.along[j] < scale;)
			is_maximum &= smoothed.curvature[j] < value;
		for (std::size_t j = i + 1; j < n && curve.along[j] - curve.along[i] < scale; j++)
			is_maximum &= smoothed.curvature[j] <= value;
		if (!is_maximum) continue;
		const auto inwards = smoothed.points[i] - curve.points[i];
		peaks.push_back({value, {curve.points[i], scale, std::atan2(inwards.y, inwards.x), {}}});
	}
}

/// Counts the beams that end in, and that pass, each part of the surroundings. The shares sum to 1.
Descriptor describe(const Keypoint& keypoint, const std::vector<mrpt::math::TPoint2D>& points)
{
	std::array<float, kRings * kSectors> hits{}, misses{};
	const auto count = [&](const mrpt::math::TPoint2D& point, std::array<float, kRings * kSectors>& into)
	{
		const auto d = point - keypoint.position;
		const double distance = d.norm();
		if (distance < kLeastSupport || distance >= kSupport) return;
		const double angle = mrpt::math::wrapTo2Pi(std::atan2(d.y, d.x) - keypoint.direction);
		const auto ring = static_cast<std::size_t>(
		    (distance - kLeastSupport) / (kSupport - kLeastSupport) * static_cast<double>(kRings));
		const auto sector = std::min(kSectors - 1, static_cast<std::size_t>(angle / (2 * M_PI) * kSectors));
		into[std::min(kRings - 1, ring) * kSectors + sector] += 1;
	};
	const double step = kSupport / (2 * kRings);
	for (const auto& end : points)
	{
		const double range = end.norm();
		const double nearest = keypoint.position.norm() - kSupport;
		for (double r = std::max(step, nearest); r < range - step; r += step) count(end * (r / range), misses);
		count(end, hits);
	}
	Descriptor descriptor;
	for (std::size_t i = 0; i < descriptor.size(); i++)
		descriptor[i] = hits[i] + misses[i] > 0 ? hits[i] / (hits[i] + misses[i]) : 0.5F;
	const float sum = std::accumulate(descriptor.begin(), descriptor.end(), 0.0F);
	for (float& share : descriptor) share /= sum > 0 ? sum : 1;
	return descriptor;
}
}  // namespace

std::vector<Keypoint> find_keypoints(const Scan& scan)
{
	const auto points = returns_of(scan);
	std::vector<Peak> peaks;
	for (const Curve& curve : curves_of(points))
	{
		double scale = kFirstScale;
		for (int i = 0; i < kScales; i++, scale *= kScaleStep) add_peaks(curve, scale, peaks);
	}
	std::stable_sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.first > b.first; });
	std::vector<Keypoint> keypoints;
	for (const auto& [value, keypoint] : peaks)
	{
		const auto is_near = [&, position = keypoint.position](const Keypoint& other)
		{ return (other.position - position).norm() < kSpread; };
		if (std::none_of(keypoints.begin(), keypoints.end(), is_near)) keypoints.push_back(keypoint);
	}
	const auto bearing = [](const Keypoint& k) { return std::atan2(k.position.y, k.position.x); };
	std::sort(
	    keypoints.begin(), keypoints.end(), [&](const auto& a, const auto& b) { return bearing(a) < bearing(b); });
	for (Keypoint& keypoint : keypoints) keypoint.descriptor = describe(keypoint, points);
	return keypoints;
}

double descriptor_distance(const Descriptor& a, const Descriptor& b)
{
	double sum = 0;
	for (std::size_t i = 0; i < a.size(); i++)
		if (a[i] + b[i] > 0) sum += static_cast<double>((a[i] - b[i]) * (a[i] - b[i]) / (a[i] + b[i]));
	return 0.5 * sum;
}

namespace
{
using Match = std::pair<std::size_t, std::size_t>;  // a keypoint of `from` and one of `to`

/// Each keypoint of `from` with the one of `to` that looks most like it, if it looks alike.
std::vector<Match> matches_between(const std::vector<Keypoint>& from, const std::vector<Keypoint>& to)
{
	std::vector<Match> matches;
	for (std::size_t i = 0; i < from.size(); i++)
	{
		double least = kGreatestDistance;
		std::size_t best = to.size();
		for (std::size_t j = 0; j < to.size(); j++)
			if (const double distance = descriptor_distance(from[i].descriptor, to[j].descriptor); distance < least)
				least = distance, best = j;
		if (best < to.size()) matches.emplace_back(i, best);
	}
	return matches;
}

/// The least-squares motion of matched keypoints.
mrpt::math::TPose2D motion_of(
    const std::vector<Keypoint>& from, const std::vector<Keypoint>& to, const std::vector<Match>& matches)
{
	mrpt::math::TPoint2D a(0, 0), b(0, 0);
	for (const auto& [i, j] : matches) a += from[i].position, b += to[j].position;
	a *= 1 / static_cast<double>(matches.size()), b *= 1 / static_cast<double>(matches.size());
	double dot = 0, cross = 0;
	for (const auto& [i, j] : matches)
	{
		const auto p = from[i].position - a, q = to[j].position - b;
		dot += p.x * q.x + p.y * q.y, cross += p.x * q.y - p.y * q.x;
	}
	const double turn = std::atan2(cross, dot), c = std::cos(turn), s = std::sin(turn);
	return {b.x - c * a.x + s * a.y, b.y - s * a.x - c * a.y, turn};
}

/// For each keypoint of `from` the nearest one of `to` under a motion, if it is an inlier.
std::pair<std::vector<Match>, double> inliers_of(
    const std::vector<Keypoint>& from, const std::vector<Keypoint>& to, const mrpt::math::TPose2D& motion)
{
	std::vector<Match> inliers;
	double sum = 0;
	for (std::size_t i = 0; i < from.size(); i++)
	{
		const auto moved = motion.composePoint(from[i].position);
		double nearest = kInlier;
		std::size_t best = to.size();
		for (std::size_t j = 0; j < to.size(); j++)
			if (const double distance = (to[j].position - moved).norm(); distance < nearest)
				nearest = distance, best = j;
		if (best == to.size()) continue;
		inliers.emplace_back(i, best);
		sum += nearest;
	}
	return {inliers, inliers.empty() ? 0 : sum / static_cast<double>(inliers.size())};
}

bool is_better(const Alignment& a, const Alignment& b)
{
	return a.inliers != b.inliers ? a.inliers > b.inliers : a.residual < b.residual;
}
}  // namespace

std::optional<Alignment> align(const std::vector<Keypoint>& from, const std::vector<Keypoint>& to)
{
	const auto matches = matches_between(from, to);
	Alignment best;
	for (std::size_t m = 0; m < matches.size(); m++)
		for (std::size_t n = m + 1; n < matches.size(); n++)
		{
			const Match a = matches[m], b = matches[n];
			const double here = (from[a.first].position - from[b.first].position).norm();
			const double there = (to[a.second].position - to[b.second].position).norm();
			if (a.first == b.first || a.second == b.second || std::abs(here - there) > kInlier) continue;
			const auto inliers = inliers_of(from, to, motion_of(from, to, {a, b})).first;
			if (inliers.size() < 3) continue;
			const mrpt::math::TPose2D motion = motion_of(from, to, inliers);
			const auto [refined, mean] = inliers_of(from, to, motion);
			const Alignment found{motion, static_cast<int>(refined.size()), mean};
			if (found.inliers >= 3 && is_better(found, best)) best = found;
		}
	return best.inliers > 0 ? std::optional(best) : std::nullopt;
}

std::optional<mrpt::math::TPose2D> align_with_best(
    const std::vector<Keypoint>& query, const std::vector<std::size_t>& best,
    const std::vector<std::vector<Keypoint>>& keypoints, const std::vector<mrpt::math::TPose2D>& sensors)
{
	Alignment winner;
	std::optional<mrpt::math::TPose2D> pose;
	for (const std::size_t keyframe : best)
		if (const auto found = align(query, keypoints[keyframe]); found && is_better(*found, winner))
		{
			winner = *found;
			pose = (mrpt::poses::CPose2D(sensors[keyframe]) + mrpt::poses::CPose2D(found->pose)).asTPose();
		}
	return pose;
}
}  // namespace d2s1r::rivals
