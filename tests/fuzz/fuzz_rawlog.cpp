// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a rawlog: what the survey, in a process of its own, says can be read can be read in this one.
#include <d2s1r/mrpt.h>
#include <d2s1r/scan.h>

#include "fuzz_input.h"
#include "rawlog/rawlog_reader.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
	using namespace d2s1r;
	static const fuzz::CaseFile file("log.rawlog");
	fuzz::limit_memory_of_own_processes();
	if (size == 0) return 0;
	const logs::Log log = logs::open_rawlog(file.write(data, size), [] { return false; });
	const logs::LogSurvey& survey = log.survey;
	if (!survey.damage.empty()) fuzz::require_one_line(survey.damage);
	const auto reader = log.read();
	std::size_t objects = 0, scans = 0, counted = 0;
	while (const auto object = reader->next())
	{
		objects++;
		scans += object->scans.size();
		for (const auto& scan : object->scans) make_scan(*scan, {});
	}
	fuzz::require(objects == 0 || reader->damage().empty(), "all that the survey has read");
	for (const logs::Sensor& sensor : survey.sensors) counted += sensor.scans;
	fuzz::require(scans == counted, "as many scans as the survey counted");
	return 0;
}
