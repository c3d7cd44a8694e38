// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Any bytes as a recording of ROS (bag, MCAP, sqlite3) or a CARMEN log: refused with one line, or surveyed and read.
#include <d2s1r/mrpt.h>
#include <d2s1r/scan.h>
#include <logs/errors.h>
#include <logs/log.h>

#include "bags/message_source.h"
#include "formats.h"
#include "fuzz_input.h"
#include "unpacking_stream.h"

namespace
{
using namespace d2s1r;

/// Returns whether a file is not taken for a rawlog, for which there is a target.
bool is_recognized(const std::string& path)
{
	constexpr std::size_t kStart = 4096;  // [byte]
	try
	{
		return logs::recognize_ros(path) || logs::is_carmen_text(logs::read_unpacked_start(path, kStart));
	}
	catch (const std::exception&)
	{
		return false;
	}
}
}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
	static const fuzz::CaseFile file("log");
	if (size == 0 || !is_recognized(file.write(data, size))) return 0;
	try
	{
		const logs::Log log = logs::open_log(file.path());
		if (!log.survey.damage.empty()) fuzz::require_one_line(log.survey.damage);
		const auto reader = log.read();
		std::size_t scans = 0, counted = 0;
		while (const auto object = reader->next())
		{
			scans += object->scans.size();
			for (const auto& scan : object->scans) make_scan(*scan, {});
		}
		for (const logs::Sensor& sensor : log.survey.sensors) counted += sensor.scans;
		if (!reader->damage().empty()) fuzz::require_one_line(reader->damage());
		fuzz::require(scans <= counted, "no more scans than the survey counted");
		fuzz::require(scans == counted || !reader->damage().empty(), "why there are fewer scans than counted");
	}
	catch (const logs::LogError& error)
	{
		fuzz::require_one_line(error.what());
	}
	return 0;
}
