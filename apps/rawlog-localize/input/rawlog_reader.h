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
/// Sensor labels of the poses and of the pseudo-odometry in localized.rawlog.
inline constexpr const char* kPoseLabel = "D2S1R";
inline constexpr const char* kPseudoOdometryLabel = "D2S1R_ODO";

using Scans = std::vector<mrpt::obs::CObservation2DRangeScan::Ptr>;

/// One object of a rawlog, which is an action collection, a sensory frame or an observation.
struct RawlogObject
{
	std::vector<std::uint8_t> bytes;                //!< as they stand in the (uncompressed) file
	Scans scans;                                    //!< the 2D laser scans in it, in order
	std::optional<mrpt::poses::CPose2D> odometry;   //!< reading of a CObservationOdometry that is not D2S1R_ODO
	std::optional<mrpt::poses::CPose2D> increment;  //!< odometry of an action collection
	bool from_earlier_run = false;                  //!< whether rawlog-localize wrote it: D2S1R or D2S1R_ODO
};

/// Reads a rawlog of either kind object by object.
class RawlogReader
{
   public:
	/// \throws UserError (kBadInput)
	explicit RawlogReader(const std::string& file);

	/// Returns the next object, or nothing at the end of the file and where it is damaged.
	std::optional<RawlogObject> next();

	/// Says what stopped the reading before the end of the file, and what to do; empty if nothing did.
	const std::string& damage() const { return damage_; }

   private:
	std::string end_within_object() const;
	std::string unreadable(const std::exception& error) const;

	mrpt::io::CFileGZInputStream stream_;
	std::size_t objects_ = 0;              //!< [-] number of objects read so far
	std::optional<std::string> odometer_;  //!< label of the first odometer, the only one that is read
	std::string damage_;
};

/// A laser of a rawlog, and how many scans it took.
struct Sensor
{
	std::string label;
	std::size_t scans = 0;
};

/// What a rawlog holds; it has to be read once to know that.
struct RawlogSurvey
{
	std::vector<Sensor> sensors;  //!< in order of appearance
	bool has_odometry = false;
	std::size_t objects = 0;  //!< [-] that can be read; MRPT's reader may crash on the next one
	std::string damage;       //!< what is wrong after these objects, see RawlogReader::damage(); empty if nothing is
};

/// Reads a rawlog to its end, or to where it is damaged, in a process of its own.
/// \throws UserError: kBadInput if it cannot be opened, kInterrupted if this process is interrupted meanwhile
RawlogSurvey survey_rawlog(const std::string& file);

/// Returns the laser of that label or, without a label, the one with the most scans (the first of equals).
/// \throws UserError if there is none: kBadInput without any scan, kWrongUse if only the label is wrong
Sensor choose_sensor(const RawlogSurvey& survey, const std::optional<std::string>& label, const std::string& file);
}  // namespace d2s1r::app
