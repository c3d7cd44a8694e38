// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "rawlog_survey.h"

#include "errors.h"
#include "rawlog_reader.h"

#include <algorithm>

namespace d2s1r::app
{
RawlogSurvey survey_rawlog(const std::string& file)
{
	RawlogSurvey survey;
	RawlogReader reader(file);
	while (const auto object = reader.next())
	{
		survey.has_odometry |= object->odometry || object->increment;
		for (const auto& scan : object->scans)
		{
			auto& sensors = survey.sensors;
			auto sensor = std::find_if(
			    sensors.begin(), sensors.end(), [&](const Sensor& s) { return s.label == scan->sensorLabel; });
			if (sensor == sensors.end()) sensor = sensors.insert(sensor, {scan->sensorLabel, 0});
			sensor->scans++;
		}
	}
	survey.damage = reader.damage();
	return survey;
}

Sensor choose_sensor(const RawlogSurvey& survey, const std::optional<std::string>& label, const std::string& file)
{
	const auto& sensors = survey.sensors;
	if (sensors.empty() && !survey.damage.empty()) throw UserError(kBadInput, file, survey.damage);
	if (sensors.empty())
		throw UserError(kBadInput, file, "holds no 2D laser scan (CObservation2DRangeScan); name another rawlog");
	if (!label)
		return *std::max_element(
		    sensors.begin(), sensors.end(), [](const Sensor& a, const Sensor& b) { return a.scans < b.scans; });
	std::string known;
	for (const auto& sensor : sensors)
	{
		if (sensor.label == *label) return sensor;
		known += (known.empty() ? "'" : ", '") + sensor.label + "'";
	}
	throw UserError(kWrongUse, file, "holds no 2D scan labelled '" + *label + "'; --sensor-label can be " + known);
}
}  // namespace d2s1r::app
