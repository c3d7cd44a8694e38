// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/seeding.h>
#include <mrpt/poses/CPosePDFParticles.h>
#include <mrpt/random/RandomGenerators.h>

#include <vector>

#include "map_row.h"
#include "tuning.h"

namespace d2s1r::pf
{
/// Returns the `count` particles of least weight. Those of equal weight are chosen evenly, not by their order, which is
/// that of their ancestors.
std::vector<std::size_t> lightest(const mrpt::poses::CPosePDFParticles& particles, std::size_t count);

/// Seeds a particle filter with the hypotheses of a scan, finds out whether it is lost, and seeds it again. It
/// remembers how probable it is that no particle is where the robot is. All poses are in the row of maps.
class Recovery
{
   public:
	Recovery() = default;
	Recovery(const MapRow& maps, const FusionParameters& parameters);

	/// Replaces all particles by ones drawn from the hypotheses.
	/// \return false if there is no hypothesis
	bool seed(mrpt::poses::CPosePDFParticles& particles, const Localization& localization);

	/// Call it once a scan: the robot may have been carried away since the last one.
	void allow_for_kidnapping(const Tuning& tuning) { nowhere_ += (1 - nowhere_) * tuning.admitted_probability; }

	/// Returns the probability [0, 1] that the filter is lost, judged by a scan and its hypotheses. The particles have
	/// moved to where they are at the scan, and it has not weighed them yet.
	double probability_of_being_lost(
	    const mrpt::poses::CPosePDFParticles& particles, const mrpt::obs::CObservation2DRangeScan& scan,
	    const Localization& localization, const Tuning& tuning) const;

	/// Replaces the lightest particles by ones drawn from the hypotheses, which weigh `probability` together.
	void admit(
	    mrpt::poses::CPosePDFParticles& particles, const Localization& localization, double probability,
	    mrpt::random::CRandomGenerator& random);

	/// Returns the probability [0, 1] that no particle is where the robot is.
	double probability_nowhere() const { return nowhere_; }

   private:
	double likelihood_of_places(
	    const mrpt::poses::CPosePDFParticles& particles, const Scan& scan, const Localization& localization) const;

	MapRow maps_;
	SeedingParameters seeding_;
	double nowhere_ = 0;  ///< [0, 1] probability_nowhere()
};
}  // namespace d2s1r::pf
