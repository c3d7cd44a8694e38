// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The steps of the default method as the tests call them.
#pragma once

#include "fine/decision.h"
#include "fine/refinement.h"
#include "test_floor.h"

namespace d2s1r::test
{
/// What refine() makes of what settle() makes of `candidates`.
inline std::vector<RefinedPose> refine_all(
    const DistanceField& field, const Scan& scan, const std::vector<Candidate>& candidates,
    const RefinementParameters& parameters)
{
	Parameters all;
	all.refinement = parameters;
	const BeamTracer none;
	const Prior anywhere;
	const SearchedReadings readings = {{field, none, all, anywhere, 0}};
	const auto settled = settle(readings, few_beams(scan), candidates, parameters);
	return refine(readings, many_beams(scan), settled, parameters);
}

inline Eigen::Matrix3d covariance_at(
    const DistanceField& field, const Scan& scan, const mrpt::math::TPose2D& sensor,
    const RefinementParameters& parameters = {})
{
	return pose_covariance(field, all_beams(scan), sensor, parameters);
}

inline Score score_at(
    const BeamTracer& tracer, const DistanceField& field, const Scan& scan, const mrpt::math::TPose2D& sensor,
    const BeamModel& model = {})
{
	return score(tracer, field, all_beams(scan), sensor, model);
}

/// What decide() says of a scan and the places that find_places() makes of poses, sensor in map.
inline Localization decide_among(
    const Grid& grid, const Scan& scan, const std::vector<mrpt::math::TPose2D>& poses,
    const Parameters& parameters = {}, const Prior& prior = {})
{
	std::vector<RefinedPose> refined;
	for (const auto& pose : poses) refined.push_back({pose, 1});
	const DistanceField field(grid);
	const BeamTracer tracer(grid);
	const SearchedReadings readings = {{field, tracer, parameters, prior, 0}};
	return decide(scan, find_places(readings, scan, all_beams(scan), refined, parameters), parameters);
}
}  // namespace d2s1r::test
