// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/likelihood_field.h>
#include <d2s1r/localizer.h>
#include <d2s1r/mrpt.h>
#include <d2s1r/mrpt_version.h>
#include <mrpt/maps/CMetricMap.h>

#include <cstdint>

namespace d2s1r
{
/// Makes the localizer an MRPT metric map: it holds an occupancy grid, the parameters, and what is built from them at
/// first use (the index of the localizer, the likelihood field).
///
/// It is filled by set_map(), by an ini section, or by inserting scans as any grid map is (CSimpleMap). It is
/// registered as `signatureMap`, so that a CMultiMetricMap takes it from an ini file: \code [MetricMap]
/// signatureMap_count = 1
/// [MetricMap_signatureMap_00_creationOpts]
/// map_file    = building.yaml   // optional: whatever d2s1r::load_map() reads
/// config_file = d2s1r.ini       // optional: d2s1r::Parameters
/// [MetricMap_signatureMap_00_insertOpts]
/// // keys of mrpt::maps::COccupancyGridMap2D::TInsertionOptions
/// [MetricMap_signatureMap_00_likelihoodOpts]
/// // keys of TLikelihoodOptions
/// \endcode
/// Likelihoods of a map in which no cell is known throw std::invalid_argument. Copies share grid and index until one of
/// them is changed. Const member functions are thread-safe.
class CSignatureMap2D : public mrpt::maps::CMetricMap
{
	DEFINE_SERIALIZABLE(CSignatureMap2D, d2s1r)

   public:
	/// Reads and writes LikelihoodParameters by their names in an ini section. Loading throws std::invalid_argument
	/// that names section and key if one is unknown or its value is not usable; nothing is changed then.
	struct TLikelihoodOptions : public mrpt::config::CLoadableOptions, public LikelihoodParameters
	{
		/// Reads the keys of `section`.
		void loadFromConfigFile(const mrpt::config::CConfigFileBase& source, const std::string& section) override;
		/// Writes all keys into `section`.
		void saveToConfigFile(mrpt::config::CConfigFileBase& target, const std::string& section) const override;
	};

	/// Makes an empty map with default parameters.
	CSignatureMap2D();

	/// Makes an empty map.
	/// \throws std::invalid_argument if a parameter is out of range
	explicit CSignatureMap2D(const Parameters& parameters, const TLikelihoodOptions& likelihood = {});

	/// Takes a copy of `map`.
	/// \throws std::invalid_argument if a parameter is out of range
	explicit CSignatureMap2D(
	    const mrpt::maps::COccupancyGridMap2D& map, const Parameters& parameters = {},
	    const TLikelihoodOptions& likelihood = {});

	/// Takes a map that load_map() returned.
	/// \throws std::invalid_argument if a parameter is out of range
	explicit CSignatureMap2D(
	    const OccupancyMap& map, const Parameters& parameters = {}, const TLikelihoodOptions& likelihood = {});

	/// Takes map, parameters and index of a localizer, such as Localizer::load() returns.
	/// \throws std::invalid_argument if it is null
	explicit CSignatureMap2D(std::shared_ptr<const Localizer> localizer);

	/// Copies share what was built, which makes them cheap. Maps cannot be moved: a moved-from map would have no
	/// content.
	CSignatureMap2D(const CSignatureMap2D&) = default;
	CSignatureMap2D& operator=(const CSignatureMap2D&) = default;  //!< shares what was built, too
	~CSignatureMap2D() override = default;

	/// Takes a copy of `map`; forgets what was built.
	void set_map(const mrpt::maps::COccupancyGridMap2D& map);

	/// Returns the occupancy grid; null if the map is empty. The first call makes it of the map of a localizer.
	mrpt::maps::COccupancyGridMap2D::ConstPtr grid() const;

	/// Returns the parameters of the localizer.
	const Parameters& parameters() const;

	/// Returns the parameters of the likelihood field.
	const TLikelihoodOptions& likelihood_options() const;

	/// Returns the localizer of the map. It is built at the first call; the reference holds until the map is changed.
	/// \param threads [-] number of threads that build the index of method = paper, if this is the first call
	/// \throws std::invalid_argument if there is no free cell
	const Localizer& localizer(int threads = 1) const;

	/// Returns the likelihood field that computeObservationLikelihood() looks beams up in. It is built at the first
	/// call; the reference holds until the map is changed.
	/// \throws std::invalid_argument if the map is empty
	const LikelihoodField& likelihood_field() const;

	/// Returns a number that is equal for equal grids (cells, size, origin) and equal parameters as text (to_ini()). An
	/// archive holds it.
	std::uint64_t fingerprint() const;

	/// Returns whether there is no grid.
	bool isEmpty() const override;

	/// Returns the class and the size of the grid as a text.
	std::string asString() const override;

	/// Writes `prefix`_signatureMap.ini and the files of COccupancyGridMap2D.
	void saveMetricMapRepresentationToFile(const std::string& prefix) const override;

	/// Draws the grid into `scene` unless genericMapParams forbid it.
	void getVisualizationInto(drawing::CSetOfObjects& scene) const override;

	/// Says how COccupancyGridMap2D inserts scans.
	mrpt::maps::COccupancyGridMap2D::TInsertionOptions insertionOptions;

   private:
	struct Content;
	std::shared_ptr<const Content> content_;

	/// Returns the grid, or a copy of it if anybody else holds it, or a new one about the robot.
	mrpt::maps::COccupancyGridMap2D::Ptr writable_grid(const mrpt::poses::CPose3D& robot) const;

	/// Returns the parameters as an archive holds them.
	std::string archived_parameters() const;

	/// Returns the fingerprint of the grid and of parameters that were archived like that.
	std::uint64_t fingerprint_with(const std::string& archived_parameters) const;

	void internal_clear() override;
	bool internal_insertObservation(
	    const mrpt::obs::CObservation& observation,
	    const std::optional<const mrpt::poses::CPose3D>& robot_pose) override;
	double internal_computeObservationLikelihood(
	    const mrpt::obs::CObservation& observation, const mrpt::poses::CPose3D& taken_from) const override;
	bool internal_canComputeObservationLikelihood(const mrpt::obs::CObservation& observation) const override;

	MAP_DEFINITION_START(CSignatureMap2D)
	std::string map_file;     //!< as for load_map(); may be empty
	std::string config_file;  //!< ini of Parameters; may be empty
	mrpt::maps::COccupancyGridMap2D::TInsertionOptions insertion;
	CSignatureMap2D::TLikelihoodOptions likelihood;
	MAP_DEFINITION_END(CSignatureMap2D)
};
}  // namespace d2s1r
