// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/poses/CPose2D.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace d2s1r::app
{
/// Sensor label of the pseudo-odometry in localized.rawlog.
inline constexpr const char* kPseudoOdometryLabel = "D2S1R_ODO";

using Scans = std::vector<mrpt::obs::CObservation2DRangeScan::Ptr>;

/// One object of a rawlog: an action collection, a sensory frame or an observation.
struct RawlogObject
{
	std::vector<std::uint8_t> bytes;                //!< as they stand in the (uncompressed) file
	Scans scans;                                    //!< 2D laser scans in it, in order
	std::optional<mrpt::poses::CPose2D> odometry;   //!< reading of a CObservationOdometry, D2S1R_ODO aside
	std::optional<mrpt::poses::CPose2D> increment;  //!< odometry of an action collection
};

/// Reads a rawlog of either kind object by object.
class RawlogReader
{
   public:
	/// \throws UserError (kBadInput)
	explicit RawlogReader(const std::string& file);

	/// No value at the end, which is a clean one if damage() is empty.
	std::optional<RawlogObject> next();

	/// What stopped the reading before the end of the file, and what to do; else empty.
	const std::string& damage() const { return damage_; }

   private:
	std::string end_within_object() const;
	std::string unreadable(const std::exception& error) const;

	mrpt::io::CFileGZInputStream stream_;
	std::size_t objects_ = 0;              //!< [-] read so far
	std::optional<std::string> odometer_;  //!< label
	std::string damage_;
};

/// A laser of a rawlog.
struct Sensor
{
	std::string label;
	std::size_t scans = 0;
};

/// What a rawlog holds, known after reading it once.
struct RawlogSurvey
{
	std::vector<Sensor> sensors;  //!< in order of appearance
	bool has_odometry = false;
	std::string damage;  //!< see RawlogReader::damage()
};

RawlogSurvey survey_rawlog(const std::string& file);

/// The laser of that label, else the one with most scans (the first of equals).
/// \throws UserError if there is none: kBadInput without any scan, kWrongUse if only the label is wrong
Sensor choose_sensor(const RawlogSurvey& survey, const std::optional<std::string>& label, const std::string& file);
}  // namespace d2s1r::app
