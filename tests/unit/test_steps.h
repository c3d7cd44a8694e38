// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The steps of the default method as the tests call them.
#pragma once

#include "fine/decision.h"
#include "fine/refinement.h"
#include "test_floor.h"

namespace d2s1r::test
{
/// A map that is read as it is drawn, for settle() and all that follows. It cannot be copied.
struct DrawnMap
{
	explicit DrawnMap(const Grid& grid, const Parameters& the_parameters = {}, const Prior& the_prior = {})
	    : readings{{DistanceField(grid), BeamTracer(grid)}}, parameters(the_parameters), prior(the_prior)
	{
	}
	/// One whose beams are not followed.
	DrawnMap(const DistanceField& field, const RefinementParameters& refinement) : readings{{field, BeamTracer()}}
	{
		parameters.refinement = refinement;
	}
	DrawnMap(const DrawnMap&) = delete;
	DrawnMap& operator=(const DrawnMap&) = delete;

	const SearchedMap& searched() const { return maps.front(); }
	RefinedPose at(const mrpt::math::TPose2D& sensor) const { return {{sensor, &searched()}, 1}; }

	RangeProfiles profiles;
	std::vector<MapReading> readings;
	WallPatterns walls;
	Parameters parameters;
	Prior prior;
	std::vector<SearchedMap> maps = {{profiles, readings, walls, prior, parameters}};
};

/// What refine() makes of what settle() makes of `candidates`.
inline std::vector<RefinedPose> refine_all(
    const DistanceField& field, const Scan& scan, std::vector<Candidate> candidates,
    const RefinementParameters& parameters)
{
	const DrawnMap map(field, parameters);
	for (Candidate& candidate : candidates) candidate.map = &map.searched();
	return refine(many_beams(scan), settle(few_beams(scan), candidates, parameters), parameters);
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
	const DrawnMap map(grid, parameters, prior);
	std::vector<RefinedPose> refined;
	for (const auto& pose : poses) refined.push_back(map.at(pose));
	const BeamSubset all = all_beams(scan);
	std::vector<Place> places = find_places(scan, all, refined, parameters);
	add_covariances(all, parameters.scoring, places);
	return decide(scan, places, map.maps).answer;
}
}  // namespace d2s1r::test
