// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "fine/shortlist.h"

#include <algorithm>
#include <utility>

namespace d2s1r
{
std::vector<RefinedPose> make_shortlist(
    const BeamTracer& tracer, const DistanceField& field, const BeamSubset& few, const std::vector<RefinedPose>& poses,
    const Parameters& parameters)
{
	// (- log-likelihood, pose): best first, ties by fit
	using Ranking = std::vector<std::pair<double, std::size_t>>;
	const BeamModel& model = parameters.scoring.beam_model;
	const auto most = static_cast<std::size_t>(parameters.refinement.max_refined);
	Ranking by_most;
	for (std::size_t i = 0; i < poses.size(); i++)
		by_most.emplace_back(-log_likelihood_bound(tracer, field, few, poses[i].pose, model), i);
	std::sort(by_most.begin(), by_most.end());
	Ranking ranking;
	for (const auto& [least_cost, i] : by_most)
	{
		constexpr double kRounding = 1e-6;  // [nat]
		if (!ranking.empty() && least_cost > ranking.front().first + parameters.refinement.score_margin + kRounding)
			break;
		if (ranking.size() == most && least_cost > ranking.back().first + kRounding) break;
		const std::pair entry(-score(tracer, field, few, poses[i].pose, model).log_likelihood, i);
		ranking.insert(std::upper_bound(ranking.begin(), ranking.end(), entry), entry);
		if (ranking.size() > most) ranking.pop_back();
	}
	std::vector<RefinedPose> shortlist;
	for (const auto& [cost, i] : ranking)
		if (cost <= ranking.front().first + parameters.refinement.score_margin) shortlist.push_back(poses[i]);
	return shortlist;
}
}  // namespace d2s1r
