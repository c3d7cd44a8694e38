// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/CFusionBackend.h>
#include <d2s1r/likelihood_field.h>
#include <d2s1r/seeding.h>

#include <map>
#include <string>
#include <vector>

namespace d2s1r::pf
{
/// The maps that the robot may be in, in a row: they lie in one frame, far apart along x, so that one filter has
/// particles in all of them and no motion leads from one into another. The frame of the row is the map frame of its
/// first map. Poses are in the frame of the row here unless a name says otherwise.
class MapRow
{
   public:
	/// Is a row without a map, of which nothing may be asked but empty().
	MapRow() = default;

	/// \throws std::invalid_argument if there is no map, one is empty, or two have one name
	explicit MapRow(std::vector<FusionMap> maps);

	/// Returns whether there is no map.
	bool empty() const { return maps_.empty(); }

	/// Moves the hypotheses from the frames of their maps to the row.
	/// \throws std::invalid_argument if one is in none of the maps
	Localization in_row(Localization localization) const;

	/// Returns a pose in the frame of its map.
	mrpt::math::TPose2D in_map(const mrpt::math::TPose2D& pose) const;

	/// Returns the map that a pose is in.
	const FusionMap& at(const mrpt::math::TPose2D& pose) const { return maps_[number_at(pose)]; }

	/// Returns whether the prior of its map allows a pose.
	bool allows(const mrpt::math::TPose2D& pose) const { return at(pose).prior.allows(in_map(pose)); }

	/// Returns the log-likelihood [nat] of beams that end at `points` [m, robot frame], by the field of the map.
	double log_likelihood(const std::vector<mrpt::math::TPoint2Df>& points, const mrpt::math::TPose2D& pose) const;

	/// Returns the hypothesis that fits a scan near a pose, its pose in the frame of its map, as
	/// Localizer::hypothesis_near() does.
	std::optional<Hypothesis> hypothesis_near(const Scan& scan, const mrpt::math::TPose2D& pose) const;

	/// Returns parameters that all maps share: those of section scan, and the method.
	const Parameters& parameters() const { return maps_.front().map->parameters(); }

	/// Returns how MRPT's filter asks for likelihoods.
	const CSignatureMap2D::TLikelihoodOptions& likelihood_options() const
	{
		return maps_.front().map->likelihood_options();
	}

	/// Draws particles as seed_particles() does, for hypotheses in all maps. What the hypotheses leave of the
	/// probability is spread over the free cells of the maps that they are in.
	/// \param localization in the row, with one hypothesis or more
	std::vector<SeededParticle> seed(const Localization& localization, const SeedingParameters& parameters) const;

   private:
	std::size_t number_at(const mrpt::math::TPose2D& pose) const;

	std::vector<FusionMap> maps_;
	std::map<std::string, std::size_t> numbers_;  //!< [-] position in the row, by name
};
}  // namespace d2s1r::pf
