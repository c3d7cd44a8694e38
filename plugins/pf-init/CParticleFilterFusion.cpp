// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "CParticleFilterFusion.h"

#include <d2s1r/free_cells.h>
#include <d2s1r/pseudo_odometry.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/random/RandomGenerators.h>
#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "thinned_scan.h"

namespace d2s1r
{
IMPLEMENTS_MRPT_OBJECT(CParticleFilterFusion, mrpt::rtti::CObject, d2s1r)

namespace
{
// Below IMPLEMENTS_MRPT_OBJECT; MRPT_INITIALIZER may run before the class has its name (Clang).
[[maybe_unused]] const bool kIsRegistered = (mrpt::rtti::registerClass(CLASS_ID(CParticleFilterFusion)), true);

using mrpt::poses::CPosePDFGaussian;

/// Probability that the robot is at one of the hypotheses.
double probability_found(const Localization& localization)
{
	double sum = 0;
	for (const Hypothesis& hypothesis : localization.hypotheses) sum += hypothesis.probability;
	return std::min(1.0, sum);
}

/// Probability that the hypotheses give to a place.
double probability_at(const Localization& localization, const mrpt::math::TPose2D& place)
{
	double sum = 0;
	for (const Hypothesis& hypothesis : localization.hypotheses)
		if (pf::are_one_place(hypothesis.pose.asTPose(), place)) sum += hypothesis.probability;
	return sum;
}

/// Adds what the spread of a few particles does not show: they were drawn with the errors of `motion`, and their mean
/// has these errors divided by how many count.
/// \param heading [rad] of the frame of `motion`
void add_error_of_mean(
    mrpt::math::CMatrixDouble33& covariance, CPosePDFGaussian motion, double heading, double effective_particles)
{
	motion.rotateCov(heading);
	for (int r = 0; r < 3; r++)  // MRPT's += needs an alignment that a caller's stack may not have
		for (int c = 0; c < 3; c++) covariance(r, c) += motion.cov(r, c) / (1 + effective_particles);
}
}  // namespace

void CParticleFilterFusion::start(const CSignatureMap2D::ConstPtr& map, const FusionParameters& parameters)
{
	if (!map || map->isEmpty()) throw std::invalid_argument("particle filter: the map is empty");
	if (parameters.particles < 1) throw std::invalid_argument("particle filter: give at least one particle");
	map_ = map;
	parameters_ = parameters;
	seeding_ = {};
	seeding_.particles = parameters.particles;
	seeding_.seed = parameters.seed;
	grid_ = make_grid(*map->grid(), map->parameters().grid);
	free_cells_ = find_free_cells(grid_, map->parameters().free_cells);
	const auto is_ruled_out = [&](CellIndex cell)
	{ return !parameters.prior.allows_position(grid_.center_x(cell), grid_.center_y(cell)); };
	free_cells_.erase(std::remove_if(free_cells_.begin(), free_cells_.end(), is_ruled_out), free_cells_.end());
	filter_.m_options.adaptiveSampleSize = false;  // KLD would grow a seed of several places to tens of thousands
	filter_.m_options.resamplingMethod = mrpt::bayes::CParticleFilter::prSystematic;
	particles_.options.metricMap = map;
	map->likelihood_field(), map->localizer();  // builds them now
	odometry_check_ = {};
	last_pose_.reset();
	last_motion_ = {};
	previous_ = {};
	random_.randomize(~parameters.seed);  // other numbers than those of the seeded poses
}

std::optional<FusedPose> CParticleFilterFusion::step(const FusionInput& input)
{
	if (!map_) throw std::logic_error("CParticleFilterFusion::step() before start()");
	const mrpt::system::CTicTac watch;
	// MRPT's filters draw from the generator of their thread. It is replaced, not re-seeded: randomize() keeps a normal
	// number that an earlier draw left over
	mrpt::random::getRandomGenerator() = mrpt::random::CRandomGenerator(random_.drawUniform32bit());
	look_whether_in_map(input.localization);
	const bool was_seeded = last_pose_.has_value();
	if (was_seeded) last_pose_ = follow(input);
	if (!last_pose_ && seed(input.localization))
	{
		last_pose_ = estimate(input.localization);
		last_pose_->event = was_seeded ? FusionEvent::kReseeded : FusionEvent::kSeeded;
	}
	previous_ = input.localization;
	if (last_pose_) last_pose_->step_ms = 1e3 * watch.Tac();
	return last_pose_;
}

std::optional<FusedPose> CParticleFilterFusion::follow(const FusionInput& input)
{
	const auto scan = pf::thinned(input.scan, static_cast<std::size_t>(map_->likelihood_options().beams));
	const CPosePDFGaussian motion = motion_to(input);
	resize(particles_for(motion));
	predict(motion);
	if (!weigh_by_prior()) return std::nullopt;
	unaccounted_ += (1 - unaccounted_) * tuning.admitted_probability;
	const double lost = probability_of_being_lost(scan, input.localization);
	weigh_by_hypotheses(input.localization);
	const double effective = weigh_by_scan_and_resample(scan, input.localization);
	admit(input.localization, lost);
	last_motion_ = motion.mean;

	FusedPose pose = estimate(input.localization);
	pose.effective_sample_size = effective;
	const double effective_particles = effective * static_cast<double>(pose.particles);
	add_error_of_mean(pose.covariance, motion, last_pose_->pose.phi, effective_particles);
	const auto expected = mrpt::poses::CPose2D(last_pose_->pose) + motion.mean;
	const bool moved_on = std::hypot(pose.pose.x - expected.x(), pose.pose.y - expected.y()) < tuning.reseed_distance &&
	                      std::abs(mrpt::math::wrapToPi(pose.pose.phi - expected.phi())) < tuning.reseed_angle;
	if (!moved_on && is_place_known(*last_pose_)) pose.event = FusionEvent::kReseeded;
	return pose;
}

void CParticleFilterFusion::look_whether_in_map(const Localization& localization)
{
	if (localization.status == Status::kInvalid) return;
	const double found = probability_found(localization);
	found_ += (last_pose_ ? tuning.newest_found : 1.0) * (found - found_);
}

bool CParticleFilterFusion::seed(const Localization& localization)
{
	if (localization.hypotheses.empty()) return false;
	unaccounted_ = 1 - probability_found(localization);
	assign_particles(particles_, seed_particles(localization, grid_, free_cells_, seeding_));
	return true;
}

CPosePDFGaussian CParticleFilterFusion::motion_to(const FusionInput& input)
{
	std::optional<mrpt::poses::CPose2D> odometry;
	if (parameters_.motion == MotionSource::kBoth)
		odometry = odometry_check_.checked(input.odometry, input.localization);
	else if (parameters_.motion == MotionSource::kOdometry && input.odometry && is_plausible(*input.odometry))
		odometry = input.odometry;
	auto predicted = pf::predict_motion(odometry, last_motion_, tuning.motion);
	if (parameters_.motion == MotionSource::kOdometry) return predicted;
	const auto weights = pf::normalized_weights(particles_);
	const auto support = [&](const Hypothesis& hypothesis)
	{ return pf::weight_near(particles_, weights, hypothesis.pose.asTPose()); };
	return pf::choose_motion({previous_, input.localization, predicted, odometry.has_value()}, support, tuning.motion)
	    .value_or(predicted);
}

std::size_t CParticleFilterFusion::particles_for(const CPosePDFGaussian& motion) const
{
	const bool is_sure = last_pose_->probability >= tuning.sure_probability &&
	                     std::max(motion.cov(0, 0), motion.cov(1, 1)) < tuning.sure_std_xy * tuning.sure_std_xy;
	const double share = is_sure ? tuning.sure_share : 1.0;
	return static_cast<std::size_t>(std::max(1L, std::lround(share * parameters_.particles)));
}

void CParticleFilterFusion::resize(std::size_t count)
{
	if (count == particles_.m_particles.size()) return;
	// MRPT's computeResampling() never returns if it is to draw more than there are
	const double offset = random_.drawUniform(0.0, 1.0);
	const auto drawn = pf::systematic_draw(pf::normalized_weights(particles_), count, offset);
	particles_.performSubstitution(drawn);
	for (auto& particle : particles_.m_particles) particle.log_w = 0;
}

void CParticleFilterFusion::predict(const CPosePDFGaussian& motion)
{
	mrpt::obs::CActionRobotMovement2D action;
	action.estimationMethod = mrpt::obs::CActionRobotMovement2D::emScan2DMatching;
	action.rawOdometryIncrementReading = motion.mean;
	action.poseChange = CPosePDFGaussian::Create(motion);
	mrpt::obs::CActionCollection actions;
	actions.insert(action);
	filter_.executeOn(particles_, &actions, nullptr);
}

/// \return whether a particle is left where the robot may be
bool CParticleFilterFusion::weigh_by_prior()
{
	constexpr double kRuledOut = -50;  // [nat]
	bool is_any_left = false;
	for (auto& particle : particles_.m_particles)
		if (parameters_.prior.allows(particle.d))
			is_any_left = true;
		else
			particle.log_w += kRuledOut;
	return is_any_left;
}

void CParticleFilterFusion::weigh_by_hypotheses(const Localization& localization)
{
	if (localization.hypotheses.empty()) return;
	const double per_xy = 0.5 / (tuning.hypothesis_std_xy * tuning.hypothesis_std_xy);
	const double per_phi = 0.5 / (tuning.hypothesis_std_phi * tuning.hypothesis_std_phi);
	for (auto& particle : particles_.m_particles)
	{
		double support = tuning.unlisted;
		for (const Hypothesis& hypothesis : localization.hypotheses)
		{
			const double dx = particle.d.x - hypothesis.pose.x(), dy = particle.d.y - hypothesis.pose.y();
			const double dphi = mrpt::math::wrapToPi(particle.d.phi - hypothesis.pose.phi());
			const double exponent = per_xy * (dx * dx + dy * dy) + per_phi * dphi * dphi;
			if (exponent < 10) support += hypothesis.probability * std::exp(-exponent);
		}
		particle.log_w += std::log(support);
	}
}

double CParticleFilterFusion::probability_of_being_lost(
    const mrpt::obs::CObservation2DRangeScan& scan, const Localization& localization) const
{
	if (localization.hypotheses.empty()) return 0;
	if (probability_found(localization) < tuning.least_found) return tuning.admitted_probability;
	const Scan beams = make_scan(scan, map_->parameters().scan);
	const auto points = end_points(beams, map_->likelihood_options().beams);
	const auto log_likelihood = [&](const mrpt::math::TPose2D& pose)
	{ return map_->likelihood_field().log_likelihood(points, pose); };
	double best = -std::numeric_limits<double>::infinity();
	for (const Hypothesis& hypothesis : localization.hypotheses)
		best = std::max(best, std::log(hypothesis.probability + 1e-12) + log_likelihood(hypothesis.pose.asTPose()));
	// likelihoods relative to the best hypothesis
	const auto weights = pf::normalized_weights(particles_);
	double likelihood = 0;
	for (std::size_t i = 0; i < weights.size(); i++)
		likelihood += weights[i] * std::exp(log_likelihood(particles_.m_particles[i].d) - best);
	likelihood = std::min(likelihood, likelihood_of_places(beams, localization));
	const double of_lost = unaccounted_ * std::exp(-tuning.takeover_margin),
	             of_filter = (1 - unaccounted_) * likelihood;
	return std::max(tuning.admitted_probability, of_lost / (of_lost + of_filter));
}

/// How likely a scan is at the filter's places, relative to the best hypothesis, by the beam model of the localizer: it
/// sees the walls that beams would have to pass, the likelihood field of the particles only their ends.
double CParticleFilterFusion::likelihood_of_places(const Scan& scan, const Localization& localization) const
{
	constexpr double kEnough = 0.01;  // [-] the filter may well be right
	constexpr double kAny = std::numeric_limits<double>::infinity();
	const Localizer& localizer = map_->localizer();
	if (localizer.parameters().method == Method::kPaper) return kAny;  // has no beam model
	const auto weights = pf::normalized_weights(particles_);
	const Hypothesis& best = localization.best();
	double likelihood = 0;
	for (const Hypothesis& hypothesis : localization.hypotheses)
		likelihood +=
		    hypothesis.probability / best.probability * pf::weight_near(particles_, weights, hypothesis.pose.asTPose());
	if (likelihood > kEnough) return kAny;
	const auto place = pf::dominant_place(particles_, weights);
	const auto of_place = localizer.hypothesis_near(scan, mrpt::poses::CPose2D(place.pose));
	const auto of_best = localizer.hypothesis_near(scan, best.pose);
	if (!of_place || !of_best) return kAny;
	return likelihood + place.probability * std::exp(of_place->log_likelihood - of_best->log_likelihood);
}

/// Whether the filter's place explains enough of a scan that no place explains well: others would draw the particles to
/// the next wall.
bool CParticleFilterFusion::explains(const mrpt::obs::CObservation2DRangeScan& scan) const
{
	const auto& options = map_->likelihood_options();
	const Scan beams = make_scan(scan, map_->parameters().scan);
	const auto points = end_points(beams, options.beams);
	if (points.empty() || is_covered(beams, map_->parameters().scan)) return false;
	const auto place = pf::dominant_place(particles_, pf::normalized_weights(particles_));
	const double of_nothing =
	    std::min(options.independent_beams, static_cast<double>(points.size())) * std::log(options.random_share);
	const double log_likelihood = map_->likelihood_field().log_likelihood(points, place.pose);
	return log_likelihood >= (1 - tuning.least_explained) * of_nothing;
}

double CParticleFilterFusion::weigh_by_scan_and_resample(
    const mrpt::obs::CObservation2DRangeScan& scan, const Localization& localization)
{
	if (probability_found(localization) < tuning.least_found && !explains(scan)) return particles_.ESS();
	filter_.m_options.powFactor =
	    tuning.unexplained_power + (1 - tuning.unexplained_power) * probability_found(localization);
	mrpt::obs::CSensoryFrame observations;
	observations.insert(mrpt::obs::CObservation2DRangeScan::Create(scan));
	mrpt::bayes::CParticleFilter::TParticleFilterStats statistics;
	filter_.executeOn(particles_, nullptr, &observations, &statistics);
	return statistics.ESS_beforeResample;
}

void CParticleFilterFusion::admit(const Localization& localization, double probability)
{
	if (localization.hypotheses.empty()) return;
	unaccounted_ = probability * (1 - probability_found(localization));
	SeedingParameters few = seeding_;
	const double share = std::max(tuning.admitted_share, probability);
	few.particles = static_cast<int>(std::lround(share * static_cast<double>(particles_.m_particles.size())));
	if (few.particles < 1) return;
	few.seed = random_.drawUniform32bit();
	const auto admitted = seed_particles(localization, grid_, free_cells_, few);
	const auto replaced = pf::lightest(particles_, admitted.size());

	const auto weights = pf::normalized_weights(particles_);
	for (std::size_t i = 0; i < weights.size(); i++)
		particles_.m_particles[i].log_w = std::log(std::max(weights[i], 1e-300)) + std::log1p(-probability);
	for (std::size_t i = 0; i < replaced.size(); i++)
	{
		particles_.m_particles[replaced[i]].d = admitted[i].pose;
		particles_.m_particles[replaced[i]].log_w = admitted[i].log_weight + std::log(probability);
	}
}

bool CParticleFilterFusion::is_place_known(const FusedPose& pose) const
{
	return pose.probability >= tuning.tracking_probability && found_ >= tuning.least_found;
}

FusedPose CParticleFilterFusion::estimate(const Localization& localization) const
{
	const auto place = pf::dominant_place(particles_, pf::normalized_weights(particles_));
	FusedPose pose;
	pose.pose = place.pose;
	pose.covariance = place.covariance;
	pose.probability = place.probability * (1 - unaccounted_);
	pose.particles = particles_.m_particles.size();
	pose.effective_sample_size = particles_.ESS();
	const bool is_agreed =
	    localization.status != Status::kLocalized || probability_at(localization, pose.pose) >= tuning.least_agreement;
	pose.status = is_place_known(pose) && is_agreed ? FusionStatus::kTracking : FusionStatus::kAmbiguous;
	return pose;
}
}  // namespace d2s1r
