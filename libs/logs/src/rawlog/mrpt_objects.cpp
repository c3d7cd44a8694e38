// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "logs/mrpt_objects.h"

#include <d2s1r/mrpt.h>
#include <mrpt/obs/CObservationOdometry.h>

#include <cstring>
#include <memory>

namespace d2s1r::logs
{
namespace
{
using mrpt::obs::CObservation2DRangeScan;

/// Makes a bool of the byte that MRPT has read into it as it stood in the file.
void make_sound(bool& flag)
{
	unsigned char byte = 0;
	std::memcpy(&byte, &flag, sizeof byte);
	flag = byte != 0;
}

/// Returns the odometry of another format as an observation.
mrpt::obs::CObservationOdometry observation_of(const OdometryReading& reading)
{
	mrpt::obs::CObservationOdometry observation;
	observation.timestamp = reading.timestamp;
	observation.sensorLabel = reading.label;
	observation.odometry = reading.pose;
	observation.hasVelocities = reading.velocity.has_value();
	if (reading.velocity) observation.velocityLocal = *reading.velocity;
	return observation;
}

std::vector<std::uint8_t> bytes_of(const mrpt::serialization::CSerializable& object)
{
	std::vector<std::uint8_t> bytes;
	mrpt::serialization::ObjectToOctetVector(&object, bytes);
	return bytes;
}
}  // namespace

RecordedScan recorded_scan(const CObservation2DRangeScan::Ptr& observation)
{
	make_sound(observation->rightToLeft);
	return {scan_of(*observation), observation->sensorLabel, observation->timestamp, observation};
}

CObservation2DRangeScan observation_of(const RecordedScan& scan)
{
	const auto origin = std::dynamic_pointer_cast<const CObservation2DRangeScan>(scan.origin);
	CObservation2DRangeScan like = origin ? *origin : CObservation2DRangeScan();
	like.timestamp = scan.timestamp;
	like.sensorLabel = scan.label;
	return d2s1r::observation_of(scan, std::move(like));
}

std::vector<std::uint8_t> to_bytes(const RawlogObject& object)
{
	if (!object.bytes.empty()) return object.bytes;
	if (object.reading) return bytes_of(observation_of(*object.reading));
	if (!object.object) return bytes_of(observation_of(*object.scans.front()));
	for (const auto& scan : object.scans)  // which may have been altered
		if (const auto origin = std::dynamic_pointer_cast<CObservation2DRangeScan>(scan->origin))
			*origin = observation_of(*scan);
	return bytes_of(*object.object);
}
}  // namespace d2s1r::logs
