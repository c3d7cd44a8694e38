// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Reads CSignatureMap2D from ini sections and archives, and writes it there.
#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/map_io.h>
#include <d2s1r/parameter_list.h>
#include <mrpt/config/CConfigFileMemory.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/serialization/CArchive.h>

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <set>
#include <stdexcept>

#include "base/checked_value.h"
#include "base/errors.h"
#include "base/ini_text.h"
#include "mrpt_grid.h"

namespace d2s1r
{
IMPLEMENTS_SERIALIZABLE(CSignatureMap2D, CMetricMap, d2s1r)
MAP_DEFINITION_REGISTER("d2s1r::CSignatureMap2D,signatureMap", d2s1r::CSignatureMap2D)

namespace
{
// This stands below IMPLEMENTS_SERIALIZABLE because MRPT_INITIALIZER may run before the class has its name (Clang).
[[maybe_unused]] const bool kIsRegistered = (mrpt::rtti::registerClass(CLASS_ID(CSignatureMap2D)), true);

constexpr const char* kLikelihoodSection = "likelihood";

/// Makes bools of bytes that MRPT has read into them as they stood in a file.
void make_sound(std::initializer_list<bool*> flags)
{
	for (bool* const flag : flags)
	{
		unsigned char byte = 0;
		std::memcpy(&byte, flag, sizeof byte);
		*flag = byte != 0;
	}
}

void make_sound(mrpt::maps::TMapGenericParams& of_any_map)
{
	make_sound(
	    {&of_any_map.enableSaveAs3DObject, &of_any_map.enableObservationLikelihood,
	     &of_any_map.enableObservationInsertion});
}

void make_options_sound(mrpt::maps::COccupancyGridMap2D& map)
{
	auto& insertion = map.insertionOptions;
	auto& likelihood = map.likelihoodOptions;
	make_sound(map.genericMapParams);
	make_sound(
	    {&insertion.useMapAltitude, &insertion.considerInvalidRangesAsFreeSpace, &insertion.wideningBeamsWithDistance,
	     &likelihood.LF_useSquareDist, &likelihood.LF_alternateAverageMethod, &likelihood.rayTracing_useDistanceFilter,
	     &likelihood.enableLikelihoodCache});
	std::int32_t method = 0;
	static_assert(sizeof method == sizeof likelihood.likelihoodMethod);
	std::memcpy(&method, &likelihood.likelihoodMethod, sizeof method);
	if (method < 0 || method > mrpt::maps::COccupancyGridMap2D::lmConsensusOWA)
		throw std::runtime_error("CSignatureMap2D: the options of its grid are damaged; save it anew from the map");
}

/// The creation options that MRPT reads into TMapGenericParams.
const std::set<std::string> kOfAnyMap = {
    "enableSaveAs3DObject", "enableObservationLikelihood", "enableObservationInsertion"};

std::vector<std::string> keys_of(const mrpt::config::CConfigFileBase& source, const std::string& section)
{
	std::vector<std::string> keys;
	source.getAllKeys(section, keys);
	return keys;
}

std::string in_message(const std::string& section, const std::string& key)
{
	return section + ": " + key;
}
}  // namespace

void CSignatureMap2D::TLikelihoodOptions::loadFromConfigFile(
    const mrpt::config::CConfigFileBase& source, const std::string& section)
{
	TLikelihoodOptions read = *this;
	for (const std::string& key : keys_of(source, section))
	{
		const std::string what = in_message(section, key);
		bool found = false;
		const auto load = [&](const char* its_key, auto& value, auto least, auto greatest, const char*)
		{
			if (key != its_key) return;
			found = true;
			set_checked(what, ini_value(source.read_string(section, key, "")), value, least, greatest);
		};
		visit_likelihood(read, load);
		if (!found) refuse_unknown(what);
	}
	*this = read;
}

void CSignatureMap2D::TLikelihoodOptions::saveToConfigFile(
    mrpt::config::CConfigFileBase& target, const std::string& section) const
{
	const auto save = [&](const char* key, auto value, auto, auto, const char* meaning)
	{ target.write(section, key, to_text(value), 30, 20, meaning); };
	visit_likelihood(*this, save);
}

CSignatureMap2D::TMapDefinition::TMapDefinition() = default;

void CSignatureMap2D::TMapDefinition::loadFromConfigFile_map_specific(
    const mrpt::config::CConfigFileBase& source, const std::string& prefix)
{
	const std::string creation = prefix + "_creationOpts", insert = prefix + "_insertOpts",
	                  likely = prefix + "_likelihoodOpts";
	if (!source.sectionExists(creation) && !source.sectionExists(insert) && !source.sectionExists(likely))
		throw std::invalid_argument(
		    "section " + excerpt(creation) + " is missing; add it, or correct the number of signature maps");
	for (const std::string& key : keys_of(source, creation))
		if (key == "map_file")
			map_file = source.read_string(creation, key, "");
		else if (key == "config_file")
			config_file = source.read_string(creation, key, "");
		else if (kOfAnyMap.count(key) == 0)
			refuse_unknown(in_message(creation, key));
	insertion.loadFromConfigFile(source, insert);
	likelihood.loadFromConfigFile(source, likely);
}

void CSignatureMap2D::TMapDefinition::dumpToTextStream_map_specific(std::ostream& out) const
{
	out << "map_file    = " << map_file << "\nconfig_file = " << config_file << "\n";
	insertion.dumpToTextStream(out);
	likelihood.dumpToTextStream(out);
}

// MRPT 2.5 returns a plain pointer, later versions a shared one.
mrpt::maps::internal::MapCtorFromDefFunctor::result_type CSignatureMap2D::internal_CreateFromMapDefinition(
    const mrpt::maps::TMetricMapInitializer& definition)
{
	const auto& given = dynamic_cast<const TMapDefinition&>(definition);
	const Parameters parameters = given.config_file.empty() ? Parameters{} : load_parameters(given.config_file);
	auto map = std::make_unique<CSignatureMap2D>(parameters, given.likelihood);
	if (!given.map_file.empty()) map->set_map(*mrpt_grid_of(*load_map(given.map_file, parameters.grid)));
	map->insertionOptions = given.insertion;
	return mrpt::maps::internal::MapCtorFromDefFunctor::result_type(map.release());
}

std::uint8_t CSignatureMap2D::serializeGetVersion() const
{
	return 1;
}

void CSignatureMap2D::serializeTo(mrpt::serialization::CArchive& out) const
{
	mrpt::config::CConfigFileMemory likelihood;
	likelihood_options().saveToConfigFile(likelihood, kLikelihoodSection);
	out << genericMapParams << archived_parameters() << likelihood.getContent() << fingerprint();
	out.WriteAs<bool>(!isEmpty());
	auto map = isEmpty() ? mrpt::maps::COccupancyGridMap2D() : *grid();
	// MRPT reads the corners as floats and finds the number of cells from them: only near the origin that is right.
	if (!isEmpty()) set_origin(map, 0, 0);
	map.insertionOptions = insertionOptions;
	out << map;
	if (!isEmpty()) out << grid()->getXMin() << grid()->getYMin();
}

void CSignatureMap2D::serializeFrom(mrpt::serialization::CArchive& in, std::uint8_t version)
{
	if (version != serializeGetVersion())
		throw std::runtime_error("CSignatureMap2D: saved by another version of d2s1r; save it anew from the map");
	std::string ini, likelihood_ini;
	std::uint64_t saved_fingerprint = 0;
	in >> genericMapParams;
	make_sound(genericMapParams);
	in >> ini >> likelihood_ini >> saved_fingerprint;
	TLikelihoodOptions likelihood;
	likelihood.loadFromConfigFile(mrpt::config::CConfigFileMemory(likelihood_ini), kLikelihoodSection);
	CSignatureMap2D read(parse_parameters(ini, "parameters saved with a CSignatureMap2D"), likelihood);
	const bool has_map = in.ReadAs<std::uint8_t>() != 0;  // a damaged byte is no bool
	mrpt::maps::COccupancyGridMap2D map;
	in >> map;
	make_options_sound(map);
	if (has_map)
	{
		float origin_x = 0, origin_y = 0;
		in >> origin_x >> origin_y;
		set_origin(map, static_cast<double>(origin_x), static_cast<double>(origin_y));
		read.set_map(map);
	}
	if (read.fingerprint_with(ini) != saved_fingerprint)
		throw std::runtime_error(
		    "CSignatureMap2D: grid and parameters do not have the saved fingerprint: the file is damaged; save it "
		    "anew from the map");
	content_ = read.content_;
	insertionOptions = map.insertionOptions;
}
}  // namespace d2s1r
