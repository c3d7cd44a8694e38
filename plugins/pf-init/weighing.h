// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include "map_row.h"
#include "tuning.h"

namespace d2s1r::pf
{
/// A scan whose hypotheses are right with less neither shows that the filter is lost nor counts if the filter's place
/// does not explain it; a tracked place has as much by each localized scan.
inline constexpr double kProbable = 0.5;  //!< [0, 1] more probable than not

/// Returns the probability that the robot is at one of the hypotheses.
double probability_found(const Localization& localization);

/// Returns every n-th beam of `scan`, at most `beams` of them and the first one: MRPT's filter has the map look at the
/// whole scan for every particle.
mrpt::obs::CObservation2DRangeScan thinned(const mrpt::obs::CObservation2DRangeScan& scan, std::size_t beams);

/// Makes particles light where the priors of the maps say that the robot cannot be.
/// \return whether there is a particle where it can be
bool weigh_by_prior(mrpt::poses::CPosePDFParticles& particles, const MapRow& maps);

/// Makes particles heavier the nearer they are to probable hypotheses of a scan.
void weigh_by_hypotheses(
    mrpt::poses::CPosePDFParticles& particles, const Localization& localization, const Tuning& tuning);

/// Weighs particles by how well their map explains `scan` from where they are, and resamples them if few of them count.
/// Changes nothing if neither the hypotheses of the scan nor the filter's place explain it.
/// \param localization of `scan`
/// \return the effective sample size [0, 1] before resampling
double weigh_by_scan_and_resample(
    mrpt::slam::CMonteCarloLocalization2D& particles, const MapRow& maps,
    const mrpt::obs::CObservation2DRangeScan& scan, const Localization& localization, const Tuning& tuning);
}  // namespace d2s1r::pf
