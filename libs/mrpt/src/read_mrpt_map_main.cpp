// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Reads a map of MRPT's own formats for load_map(), which runs this program: d2s1r-read-mrpt-map FILE CELL_SIZE. It
// writes the map, or why it cannot be read, to its standard output as map_stream.h says. MRPT's readers may crash on a
// damaged file, or ask for all memory: they run in a process of their own, with limits.
#include <base/checked_value.h>
#include <base/own_process.h>
#include <d2s1r/map_stream.h>
#include <d2s1r/read_mrpt_map.h>
#include <sys/prctl.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>

namespace d2s1r
{
namespace
{
/// Returns what reading a map file may take, which is far more than reading a sound one does.
ProcessLimits limits_of_map(const std::string& file)
{
	constexpr std::uint64_t kMemory = 900'000'000, kMemoryPerByte = 40;  // [byte], [-]
	constexpr std::uint64_t kSeconds = 120, kMicrosecondsPerByte = 10;   // [s], [us]
	std::error_code error;
	const std::uintmax_t size = std::filesystem::file_size(file, error);
	if (error) return {kMemory, kSeconds};
	return {kMemory + kMemoryPerByte * size, static_cast<unsigned>(kSeconds + kMicrosecondsPerByte * size / 1'000'000)};
}

std::string record_of(MapReaderSays what, const std::string& text = "")
{
	return static_cast<char>(what) + text;
}

void send_map(const std::string& file, const GridParameters& parameters, const Send& send)
{
	try
	{
		const auto map = read_mrpt_map(file, parameters);
		send(record_of(MapReaderSays::kMap));
		write_map(*map, [&](const char* bytes, std::size_t count) { send({bytes, count}); });
	}
	catch (const std::bad_alloc&)
	{
		throw;
	}
	catch (const std::exception& error)
	{
		send(record_of(MapReaderSays::kError, error.what()));
	}
}

/// Returns what there is to say about how the process ended, if it did not say it itself.
std::string about_end(ProcessEnd end, const ProcessLimits& limits)
{
	const std::string advice = "; it is damaged or far too large: copy or save it again";
	if (end == ProcessEnd::kOutOfTime) return record_of(MapReaderSays::kError, "loading it takes too long" + advice);
	if (end == ProcessEnd::kOutOfMemory)
		return available_memory() < limits.memory
		           ? record_of(MapReaderSays::kOutOfMemory)
		           : record_of(MapReaderSays::kError, "loading it takes too much memory" + advice);
	return "";
}

void put(const std::string& bytes)
{
	std::fwrite(bytes.data(), 1, bytes.size(), stdout);
}
}  // namespace
}  // namespace d2s1r

int main(int argc, char** argv)
{
	using namespace d2s1r;
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	if (argc != 3)
	{
		std::fputs("d2s1r-read-mrpt-map: the library d2s1r runs this program; call d2s1r::load_map()\n", stderr);
		return 1;
	}
	try
	{
		const std::string file = argv[1];
		GridParameters parameters;
		parameters.simplemap_cell_size = from_text<double>("CELL_SIZE", argv[2]);
		const ProcessLimits limits = limits_of_map(file);
		const ProcessEnd end = run_in_own_process(
		    limits, [&](const Send& send) { send_map(file, parameters, send); }, put, [] { return false; });
		put(about_end(end, limits));
		return 0;
	}
	catch (const std::exception& error)
	{
		put(record_of(MapReaderSays::kError, error.what()));
		return 0;
	}
}
