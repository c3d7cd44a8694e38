// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/CFusionBackend.h>
#include <d2s1r/seeding.h>
#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include "motion_choice.h"
#include "particle_place.h"

namespace d2s1r
{
/// MRPT's particle filter, seeded and watched by one-shot localizations.
///
/// Each scan: predict by odometry or pseudo-odometry, weigh by CSignatureMap2D, resample; then the hypotheses of the
/// scan are admitted as particles of little weight. If the filter is right they die out; if it is lost (kidnapping, a
/// wrong start) they explain the next scans better and take over, which is reported as a re-seed.
class CParticleFilterFusion : public CFusionBackend
{
	DEFINE_MRPT_OBJECT(CParticleFilterFusion, d2s1r)

   public:
	void start(const CSignatureMap2D::ConstPtr& map, const FusionParameters& parameters) override;
	FusedPose step(const FusionInput& input) override;

	/// Parameters of the filter that no application sets.
	struct Tuning
	{
		double admitted_share = 0.10;        //!< [0, 1] of the particles given to the hypotheses of each scan
		double admitted_probability = 0.01;  //!< [0, 1] that the filter is lost, before each scan
		double tracking_probability = 0.80;  //!< [0, 1] of a place to be kTracking
		double reseed_distance = 2.0;        //!< [m] from where motion leads: a place beyond was re-seeded
		double reseed_angle = 0.8;           //!< [rad]
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
	bool seeded_ = false;
	Localization previous_;               ///< of the last scan
	mrpt::poses::CPose2D last_motion_;    ///< increment to the last scan
	std::optional<FusedPose> last_pose_;  ///< of the last scan

	bool seed(const Localization& localization);
	mrpt::poses::CPosePDFGaussian motion_to(const FusionInput& input) const;
	double predict_weigh_resample(
	    const mrpt::poses::CPosePDFGaussian& motion, const mrpt::obs::CObservation2DRangeScan& scan);
	void admit(const Localization& localization);
	FusedPose estimate() const;
};
}  // namespace d2s1r
