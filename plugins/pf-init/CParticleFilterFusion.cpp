// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "CParticleFilterFusion.h"

#include <d2s1r/motion.h>
#include <d2s1r/scan_accumulator.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/system/CTicTac.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "particle_place.h"
#include "prediction.h"
#include "weighing.h"

namespace d2s1r
{
IMPLEMENTS_MRPT_OBJECT(CParticleFilterFusion, mrpt::rtti::CObject, d2s1r)

namespace
{
// Below IMPLEMENTS_MRPT_OBJECT; MRPT_INITIALIZER may run before the class has its name (Clang).
[[maybe_unused]] const bool kIsRegistered = (mrpt::rtti::registerClass(CLASS_ID(CParticleFilterFusion)), true);

using mrpt::poses::CPosePDFGaussian;

/// Returns the probability [0, 1] that the hypotheses give to a place.
double probability_at(const Localization& localization, const mrpt::math::TPose2D& place)
{
	double sum = 0;
	for (const Hypothesis& hypothesis : localization.hypotheses)
		if (pf::are_one_place(hypothesis.pose.asTPose(), place)) sum += hypothesis.probability;
	return sum;
}

/// Adds an error that the spread of a few particles does not show: they were drawn with the errors of `motion`, and
/// their mean has these errors, divided by the number of particles that count.
/// \param heading [rad] of the frame of `motion` in the map
void add_error_of_mean(
    mrpt::math::CMatrixDouble33& covariance, CPosePDFGaussian motion, double heading, double effective_particles)
{
	motion.rotateCov(heading);
	for (int r = 0; r < 3; r++)  // MRPT's += needs an alignment that a caller's stack may not have
		for (int c = 0; c < 3; c++) covariance(r, c) += motion.cov(r, c) / (1 + effective_particles);
}
}  // namespace

void CParticleFilterFusion::start(const std::vector<FusionMap>& maps, const FusionParameters& parameters)
{
	Parameters with_filter;
	with_filter.filter = parameters.filter;
	check(with_filter);
	maps_ = pf::MapRow(maps);
	parameters_ = parameters;
	recovery_ = pf::Recovery(maps_, parameters);
	for (const FusionMap& map : maps) map.map->localizer();  // is built now rather than at the first scan
	// The likelihood field, too; but if there are many maps, a field for each would need much memory.
	if (maps.size() == 1) maps.front().map->likelihood_field();
	odometry_check_ = OdometryCheck(tuning.odometry);
	last_pose_.reset();
	last_motion_ = {};
	previous_ = {};
	random_.randomize(~parameters.seed);  // other numbers than those of the seeded poses
}

std::optional<FusedPose> CParticleFilterFusion::step(const FusionInput& input)
{
	if (maps_.empty()) throw std::logic_error("CParticleFilterFusion::step() before start()");
	const mrpt::system::CTicTac watch;
	const Localization localization = maps_.in_row(input.localization);
	// MRPT's filters draw from the generator of their thread. It is replaced, not re-seeded, because randomize() keeps
	// a normal number that an earlier draw left over.
	mrpt::random::getRandomGenerator() = mrpt::random::CRandomGenerator(random_.drawUniform32bit());
	note_whether_in_map(localization);
	const bool was_seeded = last_pose_.has_value();
	if (was_seeded) last_pose_ = follow({input.scan, localization, input.odometry});
	if (!last_pose_ && recovery_.seed(particles_, localization))
	{
		last_pose_ = estimate();
		last_pose_->status = judge(*last_pose_, localization, true);
		last_pose_->event = was_seeded ? FusionEvent::kReseeded : FusionEvent::kSeeded;
	}
	previous_ = localization;
	if (!last_pose_) return std::nullopt;
	FusedPose pose = *last_pose_;
	pose.map = maps_.at(pose.pose).name;
	pose.pose = maps_.in_map(pose.pose);
	pose.step_ms = 1e3 * watch.Tac();
	return pose;
}

std::optional<FusedPose> CParticleFilterFusion::follow(const FusionInput& input)
{
	const auto scan = pf::thinned(input.scan, static_cast<std::size_t>(maps_.likelihood_options().beams));
	const CPosePDFGaussian motion = motion_to(input);
	adapt_number_of_particles(motion);
	pf::move_particles(particles_, motion);
	if (!pf::weigh_by_prior(particles_, maps_)) return std::nullopt;
	recovery_.allow_for_kidnapping(tuning);
	const double lost = recovery_.probability_of_being_lost(particles_, scan, input.localization, tuning);
	pf::weigh_by_hypotheses(particles_, input.localization, tuning);
	const double effective = pf::weigh_by_scan_and_resample(particles_, maps_, scan, input.localization, tuning);
	recovery_.admit(particles_, input.localization, lost, random_);
	last_motion_ = motion.mean;

	FusedPose pose = estimate();
	pose.effective_sample_size = effective;
	const double effective_particles = effective * static_cast<double>(pose.particles);
	add_error_of_mean(pose.covariance, motion, last_pose_->pose.phi, effective_particles);
	const bool has_jumped = !has_moved_on(pose, motion.mean);
	if (has_jumped && is_place_shown()) pose.event = FusionEvent::kReseeded;
	pose.status = judge(pose, input.localization, has_jumped);
	return pose;
}

CPosePDFGaussian CParticleFilterFusion::motion_to(const FusionInput& input)
{
	std::optional<CPosePDFGaussian> odometry;
	if (parameters_.motion != MotionSource::kPseudo)
		odometry = odometry_check_.checked(input.odometry, input.localization);
	const auto predicted = odometry ? *odometry : pf::predict_motion(last_motion_, parameters_.filter);
	if (parameters_.motion == MotionSource::kOdometry) return predicted;
	const auto weights = pf::normalized_weights(particles_);
	const auto support = [&](const Hypothesis& hypothesis)
	{ return pf::weight_near(particles_, weights, hypothesis.pose.asTPose()); };
	return pf::choose_motion({previous_, input.localization, predicted}, support, tuning).value_or(predicted);
}

void CParticleFilterFusion::adapt_number_of_particles(const CPosePDFGaussian& motion)
{
	const bool is_sure = last_pose_->status == FusionStatus::kTracking &&
	                     std::max(motion.cov(0, 0), motion.cov(1, 1)) < mrpt::square(pf::kSupportedDistance);
	const double share = is_sure ? tuning.sure_share : 1.0;
	const auto count = static_cast<std::size_t>(std::max(1L, std::lround(share * parameters_.filter.particles)));
	if (count != particles_.m_particles.size()) pf::resize(particles_, count, random_.drawUniform(0.0, 1.0));
}

void CParticleFilterFusion::note_whether_in_map(const Localization& localization)
{
	if (localization.status == Status::kInvalid) return;
	const double found = pf::probability_found(localization);
	found_ += (last_pose_ ? tuning.odometry.newest : 1.0) * (found - found_);
}

/// Returns whether the robot got from the last pose to this one by `motion`.
bool CParticleFilterFusion::has_moved_on(const FusedPose& pose, const mrpt::poses::CPose2D& motion) const
{
	const auto expected = mrpt::poses::CPose2D(last_pose_->pose) + motion;
	return std::hypot(pose.pose.x - expected.x(), pose.pose.y - expected.y()) < tuning.farthest &&
	       std::abs(mrpt::math::wrapToPi(pose.pose.phi - expected.phi())) < mrpt::DEG2RAD(tuning.odometry.widest_turn);
}

/// Returns whether scans have left little doubt of the place since the filter came there.
bool CParticleFilterFusion::is_place_shown() const
{
	return 1 - doubt_ > maps_.parameters().scoring.localized_above;
}

FusedPose CParticleFilterFusion::estimate() const
{
	const auto weights = pf::normalized_weights(particles_);
	const auto place = pf::dominant_place(particles_, weights);
	const double within = pf::weight_near(particles_, weights, place.pose, kPlaceDistance, kPlaceYaw);
	FusedPose pose;
	pose.pose = place.pose;
	pose.covariance = place.covariance;
	pose.probability = within * (1 - recovery_.probability_nowhere());
	pose.particles = particles_.m_particles.size();
	pose.effective_sample_size = particles_.ESS();
	return pose;
}

/// Returns the status of a pose, and takes down what the scan says of its place.
FusionStatus CParticleFilterFusion::judge(const FusedPose& pose, const Localization& localization, bool has_jumped)
{
	const double shown = std::min(1.0, probability_at(localization, pose.pose));
	doubt_ = (has_jumped ? 1 : doubt_) * (1 - shown);
	const bool is_agreed = localization.status != Status::kLocalized || shown >= pf::kProbable;
	const bool is_known = pose.probability > maps_.parameters().scoring.localized_above && is_place_shown();
	const bool is_in_map = found_ >= pf::kProbable;
	return is_known && is_in_map && is_agreed ? FusionStatus::kTracking : FusionStatus::kAmbiguous;
}
}  // namespace d2s1r
