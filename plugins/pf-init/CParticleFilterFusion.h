// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/CFusionBackend.h>
#include <d2s1r/odometry_check.h>
#include <d2s1r/seeding.h>
#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/random/RandomGenerators.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include "motion_choice.h"
#include "particle_place.h"

namespace d2s1r
{
/// MRPT's particle filter, seeded and watched by one-shot localizations. In Section IV-B.6 of the paper one pose starts
/// AMCL and the following ones drive it as pseudo-odometry; here all hypotheses seed the filter and weigh its
/// particles, wheel odometry is used where it is known (MotionSource::kPseudo does without), and a lost filter is
/// seeded again.
///
/// Each scan: predict by odometry or pseudo-odometry, weigh by the hypotheses of the scan and by CSignatureMap2D,
/// resample. Then particles drawn from the hypotheses replace the lightest ones, and share the probability that the
/// filter is lost as their weight. While the filter explains the scan that is little, and they die out; if it is wrong
/// they take over within a few scans, or at once if they explain the scan far better (kidnapping, a wrong start), be it
/// only because its beams would have to pass walls where the filter is; that is reported as a re-seed. The probability
/// that no hypothesis is right is remembered: until a scan settles it, no place is tracked.
class CParticleFilterFusion : public CFusionBackend
{
	DEFINE_MRPT_OBJECT(CParticleFilterFusion, d2s1r)

   public:
	void start(const CSignatureMap2D::ConstPtr& map, const FusionParameters& parameters) override;
	std::optional<FusedPose> step(const FusionInput& input) override;

	/// Parameters of the filter that no application sets.
	struct Tuning
	{
		double admitted_share = 0.10;          //!< [0, 1] of the particles given to the hypotheses of each scan
		double admitted_probability = 0.0005;  //!< [0, 1] that the robot was carried away since the last scan
		double takeover_margin = 24;     //!< [nat] by how much more than to outweigh admitted_probability a hypothesis
		                                 //!< must explain a scan better than the filter's places, to take over at once
		double unexplained_power = 0.2;  //!< [0, 1] exponent of the likelihood of a scan that hardly fits anywhere in
		                                 //!< the map; 1 of one that certainly does, in between by its probability
		/// [0, 1] share of the log-likelihood range that the filter's place must explain before a scan is weighed whose
		/// hypotheses have less than least_found
		double least_explained = 0.3;
		double unlisted = 0.30;              //!< [0, 1] weight of a particle that no hypothesis of the scan supports
		double hypothesis_std_xy = 0.3;      //!< [m] round a hypothesis that particles are supported
		double hypothesis_std_phi = 0.15;    //!< [rad]
		double tracking_probability = 0.80;  //!< [0, 1] of a place to be kTracking
		double newest_found = 0.1;           //!< [0, 1] share of a scan in the average of probability_found()
		/// [0, 1] that a hypothesis is right: of one scan, to say that the filter is lost, and to be weighed whether or
		/// not the filter's place explains it; in the average of the last scans, to be kTracking
		double least_found = 0.5;
		double least_agreement = 0.5;    //!< [0, 1] that a localized scan must give to a place that is kTracking
		double sure_probability = 0.99;  //!< [0, 1] of a place, above which fewer particles suffice
		double sure_std_xy = 0.30;       //!< [m] of a motion, below which fewer particles suffice
		double sure_share = 0.20;        //!< [0, 1] of all particles: those kept then
		double reseed_distance = 2.0;    //!< [m] from where motion leads: a place beyond was re-seeded
		double reseed_angle = 0.8;       //!< [rad]
		pf::MotionParameters motion;
	};
	Tuning tuning;

   private:
	CSignatureMap2D::ConstPtr map_;
	FusionParameters parameters_;
	SeedingParameters seeding_;
	Grid grid_;
	std::vector<CellIndex> free_cells_;
	mrpt::bayes::CParticleFilter filter_;
	mrpt::slam::CMonteCarloLocalization2D particles_;
	mrpt::random::CRandomGenerator random_;
	double unaccounted_ = 0;  ///< [0, 1] probability that no particle is where the robot is
	double found_ = 0;        ///< [0, 1] probability_found(), average of the last scans
	OdometryCheck odometry_check_;
	Localization previous_;               ///< of the last scan
	mrpt::poses::CPose2D last_motion_;    ///< increment to the last scan
	std::optional<FusedPose> last_pose_;  ///< of the last scan; none before the filter is seeded

	bool seed(const Localization& localization);
	std::optional<FusedPose> follow(const FusionInput& input);
	mrpt::poses::CPosePDFGaussian motion_to(const FusionInput& input);
	std::size_t particles_for(const mrpt::poses::CPosePDFGaussian& motion) const;
	void resize(std::size_t count);
	void predict(const mrpt::poses::CPosePDFGaussian& motion);
	bool weigh_by_prior();
	void weigh_by_hypotheses(const Localization& localization);
	double probability_of_being_lost(
	    const mrpt::obs::CObservation2DRangeScan& scan, const Localization& localization) const;
	double likelihood_of_places(const Scan& scan, const Localization& localization) const;
	double weigh_by_scan_and_resample(const mrpt::obs::CObservation2DRangeScan& scan, const Localization& localization);
	bool explains(const mrpt::obs::CObservation2DRangeScan& scan) const;
	void admit(const Localization& localization, double probability);
	void look_whether_in_map(const Localization& localization);
	bool is_place_known(const FusedPose& pose) const;
	FusedPose estimate(const Localization& localization) const;
};
}  // namespace d2s1r
