// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/CFusionBackend.h>
#include <d2s1r/motion.h>
#include <mrpt/random/RandomGenerators.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include "map_row.h"
#include "recovery.h"
#include "tuning.h"

namespace d2s1r
{
/// MRPT's particle filter, seeded and watched by one-shot localizations. In Section IV-B.6 of the paper one pose starts
/// AMCL, and the poses after it drive it as pseudo-odometry. Here all hypotheses seed the filter and weigh its
/// particles, wheel odometry is used where it is known (MotionSource::kPseudo does without it), and a filter that is
/// lost is seeded again.
///
/// At each scan the particles move by odometry or pseudo-odometry (prediction.h). They are weighed by the hypotheses of
/// the scan and by CSignatureMap2D, and resampled (weighing.h). Then particles drawn from the hypotheses replace the
/// lightest ones; their weight is the probability that the filter is lost (recovery.h). While the filter explains the
/// scans that is little, and they die out. If it is wrong, because the robot was carried away or the start was wrong,
/// they take over within a few scans, or at once if they explain a scan far better; the walls that its beams would have
/// to pass where the filter is count there, too. That is reported as a re-seed. With several maps the particles may be
/// in any of them (map_row.h), and a robot that takes the elevator is found on the other floor in the same way as one
/// that is carried away.
///
/// A pose is tracked while more than localized_above of the weight is within 0.5 m and 10 deg of it, the bounds of a
/// place (kPlaceDistance, kPlaceYaw). The spread of the particles grows from scan to scan unless one shows where they
/// are. The filter remembers the probability that no hypothesis is right, and how much doubt scans leave of the place
/// that it jumped to: each multiplies it by the probability that it is elsewhere.
class CParticleFilterFusion : public CFusionBackend
{
	DEFINE_MRPT_OBJECT(CParticleFilterFusion, d2s1r)

   public:
	void start(const std::vector<FusionMap>& maps, const FusionParameters& parameters) override;
	std::optional<FusedPose> step(const FusionInput& input) override;

	pf::Tuning tuning;  //!< set it before start()

   private:
	pf::MapRow maps_;
	FusionParameters parameters_;
	mrpt::slam::CMonteCarloLocalization2D particles_;
	pf::Recovery recovery_;
	mrpt::random::CRandomGenerator random_;
	OdometryCheck odometry_check_;
	Localization previous_;               //!< of the last scan, in the row of maps
	mrpt::poses::CPose2D last_motion_;    //!< increment to the last scan, robot frame of the one before
	std::optional<FusedPose> last_pose_;  //!< of the last scan, in the row of maps; none before the filter is seeded
	double doubt_ = 1;  //!< [0, 1] that none of the scans was right that showed the place since the filter jumped there
	double found_ = 0;  //!< [0, 1] pf::probability_found(), average over the last scans

	std::optional<FusedPose> follow(const FusionInput& input);
	mrpt::poses::CPosePDFGaussian motion_to(const FusionInput& input);
	void adapt_number_of_particles(const mrpt::poses::CPosePDFGaussian& motion);
	void note_whether_in_map(const Localization& localization);
	bool has_moved_on(const FusedPose& pose, const mrpt::poses::CPose2D& motion) const;
	bool is_place_shown() const;
	FusedPose estimate() const;
	FusionStatus judge(const FusedPose& pose, const Localization& localization, bool has_jumped);
};
}  // namespace d2s1r
