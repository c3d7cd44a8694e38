// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "fine/refinement.h"

#include <Eigen/Cholesky>
#include <Eigen/Jacobi>
#include <Eigen/LU>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "answer/distinct_poses.h"
#include "fine/end_point_sums.h"

namespace d2s1r
{
namespace
{
using mrpt::math::TPose2D;

constexpr int kSteps = 4;                 //!< [-] of each stage
constexpr int kStepsBeside = kSteps / 2;  //!< [-] back from beside
// Widths of the robust kernel as multiples of parameters.kernel. From a coarse candidate it is wide, and each step
// halves it, but candidates are compared by how much of a scan is near walls, of which a map may be wrong by a cell.
// Refined poses are judged and polished with a narrower one: what is near a wall is not on it.
constexpr double kOfCandidate = 5;
constexpr double kSettled = 2;
constexpr double kNarrow = 0.75;
constexpr double kCostWeight = 0.067;  //!< [1 / step] of the coarse cost of a candidate beside its fit
constexpr double kBeside[] = {-0.3, -0.2, -0.1, 0.1, 0.2, 0.3};  //!< [m] along what a scan leaves open

// Poses nearer than this, half of a sample's spacing and a yaw shift of the coarse search, are one.
constexpr double kApart = 0.1;                                       //!< [m]
constexpr double kYawApart = 2 * M_PI / RangeProfiles::kDirections;  //!< [rad]

// A look at how far a scan fits nearly as well: [-] steps to each side, up to where another place begins, and standard
// deviations within which a pose surely is.
constexpr int kParts = 10;
constexpr double kSure = 3;

// Damping [-] a beam, on the way, and where few beams or the last steps would slide along a corridor.
constexpr double kDamping = 1e-3, kFirmDamping = 1e-2;

/// Returns J^T W J.
template <std::size_t kUnknowns>
auto information_of(const EndPointSums<kUnknowns>& sums)
{
	constexpr int kSize = kUnknowns;
	Eigen::Matrix<double, kSize, kSize> information;
	std::size_t next = 0;
	for (int i = 0; i < kSize; i++)
		for (int j = i; j < kSize; j++)
			information(i, j) = information(j, i) = static_cast<double>(sums.information[next++]);
	return information;
}

template <std::size_t kUnknowns>
Eigen::Matrix<double, kUnknowns, 1> gradient_of(const EndPointSums<kUnknowns>& sums)
{
	return Eigen::Map<const Eigen::Matrix<float, kUnknowns, 1>>(sums.gradient.data()).template cast<double>();
}

double fit_of(float fit, std::size_t beams)
{
	return static_cast<double>(fit) / static_cast<double>(std::max<std::size_t>(1, beams));
}

double fit_of(const DistanceField& field, const BeamSubset& beams, const TPose2D& pose, double kernel)
{
	return fit_of(fit_of_end_points(field, beams.returns, pose, kernel), beams.count);
}

/// Returns `pose` moved by `step` (x, y, phi).
TPose2D moved(const TPose2D& pose, const Eigen::Vector3d& step)
{
	return {pose.x + step.x(), pose.y + step.y(), mrpt::math::wrapToPi(pose.phi + step.z())};
}

/// Returns by what the information of the end points of so many beams [-] is damped.
double damping_of(std::size_t beams, double damping)
{
	return damping * static_cast<double>(beams) + 1e-6;
}

/// Returns `pose` after one damped step, where the end points of `count` beams sum up to `sums`.
TPose2D gauss_newton_step(const EndPointSums<3>& sums, std::size_t count, const TPose2D& pose, double damping)
{
	Eigen::Matrix3d information = information_of(sums);
	information.diagonal().array() += damping_of(count, damping);
	return moved(pose, -information.inverse() * gradient_of(sums));
}

/// Makes some steps with a robust kernel of a width [m].
TPose2D descend(const DistanceField& field, const BeamSubset& beams, TPose2D pose, int steps, double kernel)
{
	for (int i = 0; i < steps; i++)
		pose = gauss_newton_step(sum_end_points(field, beams.returns, pose, kernel), beams.count, pose, kDamping);
	return pose;
}

/// A candidate on its way to the walls. Its fit is less the cost.
struct Settling : RefinedPose
{
	double cost;  //!< [-] that is subtracted from the fit
	EndPointSums<3> sums{};
};

/// Sums up the end points at all poses, and drops those that fit worse than the best one by more than the margin.
/// \param width [-] of the robust kernel, as a multiple of parameters.kernel
void drop_poor(const BeamSubset& few, double width, double margin, std::vector<Settling>& poses)
{
	double best = -std::numeric_limits<double>::infinity();
	for (Settling& at : poses)
	{
		const double kernel = width * at.parameters().refinement.kernel;
		at.sums = sum_end_points(at.field(), few.returns, at.pose, kernel);
		at.fit = fit_of(at.sums.fit, few.count) - at.cost;
		best = std::max(best, at.fit);
	}
	const auto is_poor = [=](const Settling& at) { return at.fit < best - margin; };
	poses.erase(std::remove_if(poses.begin(), poses.end(), is_poor), poses.end());
}

/// Returns at most `most` poses, best fit first, and of those that are not apart only the best.
std::vector<RefinedPose> best_distinct(std::vector<RefinedPose> poses, std::size_t most)
{
	std::stable_sort(poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.fit > b.fit; });
	std::vector<RefinedPose> kept;
	DistinctPoses distinct(kApart, kYawApart);
	for (const auto& pose : poses)
	{
		if (kept.size() >= most) break;
		if (distinct.add(pose.pose, 2 * pose.map->number + pose.reading)) kept.push_back(pose);
	}
	return kept;
}

/// The axes of a symmetric matrix.
struct Axes
{
	Eigen::Vector2d values;      //!< increasing
	Eigen::Matrix2d directions;  //!< a unit vector in each column
};

/// Returns them by one rotation. Eigen's solver for matrices of any size takes seconds to compile.
Axes axes_of(const Eigen::Matrix2d& matrix)
{
	Eigen::JacobiRotation<double> rotation;
	rotation.makeJacobi(matrix, 0, 1);
	Axes axes;
	axes.directions << rotation.c(), rotation.s(), -rotation.s(), rotation.c();
	axes.values = (axes.directions.transpose() * matrix * axes.directions).diagonal();
	if (axes.values(0) > axes.values(1)) axes = {axes.values.reverse(), axes.directions.rowwise().reverse()};
	return axes;
}

/// Returns the unit vector in the map along which the end points hold the position least.
Eigen::Vector2d open_direction(const DistanceField& field, const BeamSubset& beams, const TPose2D& pose, double kernel)
{
	const Eigen::Matrix3d information = information_of(sum_end_points(field, beams.returns, pose, kernel));
	return axes_of(information.topLeftCorner<2, 2>()).directions.col(0);
}

/// Returns the variance [m^2] of the distance of one end point, of which more tell no more of the same walls.
double variance_of(const BeamSubset& beams, const RefinementParameters& parameters)
{
	return parameters.range_noise * parameters.range_noise * mrpt::DEG2RAD(1.0) / beams.spacing;
}

/// A way that the pose of the sensor may be off by.
struct Way
{
	Eigen::Vector3d direction;  //!< of the pose (x, y, phi) [m, m, rad] by unit of the way, which is 1 m or 1 rad
	Eigen::Vector3d held;       //!< [-] unit vector that a pose beside is kept from sliding back along
	double variance;            //!< [m^2 or rad^2] along the way
	double step;                //!< [m or rad]
};

/// Returns how far [m or rad] from `sensor` along `way` the scan fits nearly as well, up to kParts steps to both sides:
/// within it, the logarithm of its robust likelihood falls by less than 1/2, as within one standard deviation of a
/// Gaussian. Where it has fallen as far as at kSure deviations, the look ends. The derivatives at the pose alone tell
/// too little: along a corridor that runs aslant to the cells each step of its walls seems to hold the pose, and where
/// ranges are long the fit has several maxima in yaw.
double deviation_along(
    const Way& way, const DistanceField& field, const BeamSubset& beams, const TPose2D& sensor,
    const RefinementParameters& parameters)
{
	constexpr double kHeld = 1e9;  // [-] information, far above what any end points add up to
	const double kernel = parameters.kernel;
	const auto fit_at = [&](double offset)
	{
		const TPose2D beside = moved(sensor, offset * way.direction);
		const EndPointSums sums = sum_end_points(field, beams.returns, beside, kernel);
		Eigen::Matrix3d held = information_of(sums);
		held.diagonal().array() += damping_of(beams.count, kDamping);
		held += kHeld * way.held * way.held.transpose();
		const TPose2D at = moved(beside, -held.inverse() * gradient_of(sums));
		return static_cast<double>(fit_of_end_points(field, beams.returns, at, kernel));
	};
	const double here = fit_at(0), fall = variance_of(beams, parameters) / (kernel * kernel), least = here - fall;
	double farthest = 0;
	for (const double step : {-way.step, way.step})
	{
		double before = here;
		for (int i = 1; i <= kParts && before > here - kSure * kSure * fall; i++)
		{
			const double fit = fit_at(i * step);
			const double beyond = fit < least && before > least ? (least - fit) / (before - fit) : 0;
			if (before > least) farthest = std::max(farthest, (i - beyond) * way.step);
			before = fit;
		}
	}
	return farthest;
}

/// Returns the step [m or rad] along a direction of which kParts leave a pose within the bounds of a place.
double step_in_place(const Eigen::Vector3d& direction)
{
	return 1 / (kParts * std::max(direction.head<2>().norm() / kPlaceDistance, std::abs(direction.z()) / kPlaceYaw));
}

/// Returns the way along which `covariance` (x, y, phi) leaves the position most open.
Way along_open_direction(const Eigen::Matrix3d& covariance)
{
	const Axes axes = axes_of(covariance.topLeftCorner<2, 2>());
	const double variance = axes.values(1);
	const Eigen::Vector3d direction = covariance.leftCols<2>() * axes.directions.col(1) / variance;
	Eigen::Vector3d held = Eigen::Vector3d::Zero();
	held.head<2>() = axes.directions.col(1);
	return {direction, held, variance, step_in_place(direction)};
}

/// Returns the way along the yaw. Its steps are so long that a single maximum of the fit ends within the first one.
Way along_yaw(const Eigen::Matrix3d& covariance)
{
	const double variance = covariance(2, 2);
	const Eigen::Vector3d direction = covariance.col(2) / variance;
	return {
	    direction, Eigen::Vector3d::UnitZ(), variance, std::min(kSure * std::sqrt(variance), step_in_place(direction))};
}
}  // namespace

std::size_t most_poses(Stage stage, const RefinementParameters& parameters)
{
	auto most = static_cast<std::size_t>(parameters.max_scored);
	for (auto before = static_cast<std::size_t>(stage); before > 0; before--) most = (most + 2) / 3;
	return most;
}

std::vector<RefinedPose> settle(
    const BeamSubset& few, const std::vector<Candidate>& candidates, const RefinementParameters& parameters)
{
	std::vector<Settling> settling;
	for (const Candidate& candidate : candidates)
		for (std::size_t reading = 0; reading < candidate.map->readings.size(); reading++)
			settling.push_back({{{candidate.pose, candidate.map, reading}}, kCostWeight * candidate.cost});
	double width = kOfCandidate;
	for (int i = 0; i < kSteps; i++)
	{
		drop_poor(few, width, parameters.fit_margin, settling);
		for (Settling& at : settling) at.pose = gauss_newton_step(at.sums, few.count, at.pose, kFirmDamping);
		width = std::max(kSettled, width / 2);
	}
	drop_poor(few, width, parameters.fit_margin, settling);
	return best_distinct({settling.begin(), settling.end()}, most_poses(Stage::kScored, parameters));
}

std::vector<RefinedPose> make_shortlist(
    const BeamSubset& few, const std::vector<RefinedPose>& poses, const RefinementParameters& parameters, double least)
{
	// (- log-likelihood, pose): best first, ties by fit
	using Ranking = std::vector<std::pair<double, std::size_t>>;
	const std::size_t most = most_poses(Stage::kRefined, parameters);
	const auto model_at = [](const RefinedPose& at) -> const BeamModel& { return at.parameters().scoring.beam_model; };
	const auto score_at = [&](const RefinedPose& at)
	{ return score(at.tracer(), at.field(), few, at.pose, model_at(at)).log_likelihood; };
	Ranking by_most, by_pieces;
	for (std::size_t i = 0; i < poses.size(); i++)
	{
		if (!poses[i].tracer().may_stand(poses[i].pose)) continue;
		const RefinedPose& at = poses[i];
		const Bound bound = bound_of(at.tracer(), at.field(), few, at.pose, model_at(at));
		if (bound.log_likelihood < least) continue;
		by_most.emplace_back(-bound.log_likelihood, i);
		by_pieces.emplace_back(-bound.by_pieces, i);
	}
	std::sort(by_most.begin(), by_most.end());
	std::sort(by_pieces.begin(), by_pieces.end());
	Ranking ranking;
	for (const auto& [least_cost, i] : by_most)
	{
		if (!ranking.empty() && least_cost > ranking.front().first + kImplausible) break;
		if (ranking.size() == most && least_cost > ranking.back().first) break;
		const std::pair entry(-score_at(poses[i]), i);
		ranking.insert(std::upper_bound(ranking.begin(), ranking.end(), entry), entry);
		if (ranking.size() > most) ranking.pop_back();
	}
	std::vector<std::size_t> chosen;
	for (const auto& [cost, i] : ranking)
		if (cost <= std::min(-least, ranking.front().first + kImplausible)) chosen.push_back(i);
	for (const auto& [cost, i] : by_pieces)
	{
		if (chosen.size() == most || cost > by_pieces.front().first + kImplausiblePieces) break;
		if (std::find(chosen.begin(), chosen.end(), i) != chosen.end()) continue;
		if (score_at(poses[i]) >= least) chosen.push_back(i);
	}
	std::vector<RefinedPose> shortlist;
	for (const std::size_t i : chosen) shortlist.push_back(poses[i]);
	return shortlist;
}

std::vector<RefinedPose> refine(
    const BeamSubset& many, std::vector<RefinedPose> poses, const RefinementParameters& parameters)
{
	const auto descended = [&](RefinedPose from, int steps)
	{
		const double kernel = from.parameters().refinement.kernel;
		from.pose = descend(from.field(), many, from.pose, steps, kernel);
		from.fit = fit_of(from.field(), many, from.pose, kNarrow * kernel);
		return from;
	};
	for (RefinedPose& pose : poses) pose = descended(pose, kSteps);
	std::stable_sort(poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.fit > b.fit; });

	const std::size_t restarted = std::min(poses.size(), most_poses(Stage::kRestarted, parameters));
	for (std::size_t i = 0; i < restarted; i++)
	{
		const RefinedPose start = poses[i];
		const Eigen::Vector2d open =
		    open_direction(start.field(), many, start.pose, start.parameters().refinement.kernel);
		for (const double offset : kBeside)
		{
			RefinedPose beside = start;
			beside.pose.x += offset * open.x();
			beside.pose.y += offset * open.y();
			beside = descended(beside, kStepsBeside);
			if (beside.fit > start.fit) poses.push_back(beside);
		}
	}
	const std::size_t all = poses.size();
	return best_distinct(std::move(poses), all);
}

TPose2D polish(
    const DistanceField& field, const BeamSubset& beams, TPose2D pose, const RefinementParameters& parameters)
{
	const double deviation = field.cell_size() / std::sqrt(12.0);  // of a surface that may be anywhere in its cells
	const double prior = variance_of(beams, parameters) / (deviation * deviation);
	const double damping = damping_of(beams.count, kFirmDamping);
	double offset = 0;
	for (int i = 0; i < kSteps; i++)
	{
		const EndPointSums sums = sum_end_points(field, beams.returns, pose, offset, kNarrow * parameters.kernel);
		Eigen::Matrix4d information = information_of(sums);
		information.diagonal() += Eigen::Vector4d(damping, damping, damping, prior);
		Eigen::Vector4d gradient = gradient_of(sums);
		gradient(3) += prior * offset;
		const Eigen::Vector4d step = -information.llt().solve(gradient);
		pose = moved(pose, step.head<3>());
		offset += step(3);
	}
	return pose;
}

Eigen::Matrix3d pose_covariance(
    const DistanceField& field, const BeamSubset& beams, const TPose2D& sensor, const RefinementParameters& parameters)
{
	const EndPointSums sums = sum_end_points(field, beams.returns, sensor, parameters.kernel);
	Eigen::Matrix3d information = information_of(sums) / variance_of(beams, parameters);
	constexpr double kMostDistance = 1.0, kMostYaw = mrpt::DEG2RAD(10.0);  // [m], [rad] of standard deviation
	information.diagonal() += Eigen::Vector3d(kMostDistance, kMostDistance, kMostYaw).cwiseAbs2().cwiseInverse();
	Eigen::Matrix3d covariance = information.inverse();
	// the yaw last: the open direction would turn with it
	for (const auto& way_along : {along_open_direction, along_yaw})
	{
		const Way way = way_along(covariance);
		const double deviation = deviation_along(way, field, beams, sensor, parameters);
		covariance += std::max(0.0, deviation * deviation - way.variance) * way.direction * way.direction.transpose();
	}
	// The surface may be anywhere within the tolerance.
	covariance.diagonal().head<2>().array() += field.tolerance() * field.tolerance() / 3;
	return covariance;
}
}  // namespace d2s1r
