// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>

#include <memory>
#include <string>
#include <vector>

namespace d2s1r
{
class DefaultLocalizer;

/// Holds a map of an Atlas.
struct AtlasMap
{
	/// Name of the map in hypotheses. No other map of the atlas has it. It is not empty, unless there is one map, does
	/// not begin with a dot, and holds no slash or control character, so that it can be a part of a file's name.
	std::string name;
	std::shared_ptr<const Localizer> localizer;  //!< index of the map, with parameters of its own
	Prior region = {};                           //!< where in this map the robot may be, map frame
	std::string floor = {};                      //!< what people call this storey; no result depends on it
};

/// Finds in which of several maps, and where there, a scan was taken. An atlas of one map answers as its Localizer
/// does.
///
/// Each map scores places by its own parameters, and one decision is made over the places of all maps, so that the
/// probabilities of an answer share one scale. If they sum to less than 1, the rest is the probability that the scan is
/// of none of these maps. Floors that look alike from where the scan was taken share the probability: the
/// answer is kAmbiguous.
///
/// All maps are searched at once, as if they were one map, and only the best candidates of all of them are
/// refined: this takes little longer than one map of their size. The parameters of the first map say how much is
/// searched: the numbers and margins of coarse_search, refinement and first_look.
///
/// It is const and thread-safe: any number of threads may call localize() at once.
class Atlas
{
   public:
	/// \param maps one or more; the atlas shares their localizers
	/// \throws std::invalid_argument if there is no map, a name occurs twice or is not allowed, a localizer is null, the method of
	///         one of several is kPaper, or the section `scan` of their parameters, which is about the sensor, differs
	explicit Atlas(std::vector<AtlasMap> maps);

	/// Answers where a scan was taken: Hypothesis::map names the map. It never throws because of the scan.
	/// \param query without a prior: the region of each map is the prior there
	/// \param sweep when each beam was taken; the pose is that of its time 0
	/// \throws std::invalid_argument if the query has a prior, or its time budget is below 0
	Localization localize(const RangeScan& observation, const Query& query = {}, const Sweep& sweep = {}) const;

	/// Answers where a scan was taken that make_scan() or the caller prepared.
	Localization localize(const Scan& scan, const Query& query = {}) const;

	/// Returns the maps, in the order in which they were given.
	const std::vector<AtlasMap>& maps() const { return maps_; }

	/// Returns the map of that name. \throws std::invalid_argument if there is none
	const AtlasMap& at(const std::string& name) const;

   private:
	static const DefaultLocalizer* default_method_of(const Localizer& localizer);

	std::vector<AtlasMap> maps_;
};

/// Says what a file or a folder tells of a map of an atlas, before the map is loaded.
struct AtlasEntry
{
	std::string name;        //!< of the map
	std::string file;        //!< as load_map() takes it
	std::string config;      //!< ini file of its parameters; empty: those that all maps have
	Prior region = {};       //!< where in this map the robot may be, map frame
	std::string floor = {};  //!< as people call it
};

/// Returns whether `path` names an atlas: a folder, or a yaml file with the key `maps`.
bool is_atlas(const std::string& path);

/// Reads which maps an atlas has. All files of a folder that load_map() loads without further information are its maps,
/// named like the files without their extension, in the order of their names. A yaml file of the folder without the key
/// `image` is none of them. A yaml file that is an atlas reads
/// \code
/// maps:
///   ground:                   # name
///     file: ground.yaml       # as load_map() takes it, beside this file
///     floor: "0"              # optional: what people call it
///     region: [0, 0, 20, 12]  # optional: X0, Y0, X1, Y1 [m], two corners of the box that the robot is in
///     config: ground.ini      # optional: parameters of its own, beside this file
///   first:
///     file: first.yaml
/// \endcode
/// \throws std::runtime_error naming the file and what is wrong with it
std::vector<AtlasEntry> read_atlas(const std::string& path);

/// Loads all maps of an atlas and builds their indices.
/// \param parameters of the maps without a file of their own
/// \throws std::runtime_error, std::invalid_argument naming the file and what is wrong with it
Atlas load_atlas(const std::string& path, const Parameters& parameters = {});
}  // namespace d2s1r
