// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "output/report_html.h"

#include <base/output_file.h>
#include <d2s1r/version.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <new>
#include <string>
#include <string_view>

#include "frames/spill_file.h"
#include "report_template.h"

namespace d2s1r::app
{
namespace
{
using Json = nlohmann::ordered_json;  //!< numbers that are not finite become null

std::string base64(const std::uint8_t* bytes, std::size_t size)
{
	constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
	std::string text;
	for (std::size_t i = 0; i < size; i += 3)
	{
		const auto byte = [&](std::size_t k) { return k < size ? bytes[k] : 0U; };
		const unsigned three = byte(i) << 16U | byte(i + 1) << 8U | byte(i + 2);
		for (const unsigned shift : {18U, 12U, 6U, 0U}) text += kDigits[three >> shift & 63U];
	}
	for (std::size_t k = size; k % 3 != 0; k++) text[text.size() - 1 - (k - size)] = '=';
	return text;
}
}  // namespace

/// Packs bytes by zlib as they come, into a file: those of a long log are many.
class Packer
{
   public:
	/// \param folder where there is room for the file
	/// \throws UserError (kBadOutput), as add() and print() do
	explicit Packer(const std::filesystem::path& folder, int level = Z_DEFAULT_COMPRESSION) : packed_(folder)
	{
		if (deflateInit(&stream_, level) != Z_OK) throw std::bad_alloc();
	}
	~Packer() { deflateEnd(&stream_); }
	Packer(const Packer&) = delete;
	Packer& operator=(const Packer&) = delete;

	void add(const void* bytes, std::size_t size) { pack(bytes, size, Z_NO_FLUSH); }
	void add(const std::string& text) { add(text.data(), text.size()); }

	/// Prints the packed bytes as base64. Nothing may be added any more.
	void print(TextFile& file)
	{
		pack(nullptr, 0, Z_FINISH);
		packed_.rewind();
		std::array<std::uint8_t, 3 * 4096> part;  // a multiple of three bytes makes whole digits
		while (const std::size_t size = packed_.read(part.data(), part.size()))
			file.print("%s", base64(part.data(), size).c_str());
	}

   private:
	void pack(const void* bytes, std::size_t size, int flush)
	{
		static constexpr Bytef kNothing = 0;
		stream_.next_in = const_cast<Bytef*>(size > 0 ? static_cast<const Bytef*>(bytes) : &kNothing);
		stream_.avail_in = static_cast<uInt>(size);
		std::array<Bytef, 1 << 14> part;
		do
		{
			stream_.next_out = part.data();
			stream_.avail_out = static_cast<uInt>(part.size());
			deflate(&stream_, flush);
			packed_.write(part.data(), part.size() - stream_.avail_out);
		} while (stream_.avail_out == 0);
	}

	z_stream stream_{};
	SpillFile packed_;
};

namespace
{
/// Returns the text of a value of JSON, with U+FFFD for what is not UTF-8.
std::string text_of(const Json& json)
{
	return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Packs an object of JSON member by member, so that none of its lists is in memory.
class JsonPacker
{
   public:
	using Append = std::function<void(const std::string& text)>;

	explicit JsonPacker(Packer& packer) : packer_(packer) { packer_.add("{"); }
	void finish() { packer_.add("}"); }

	void member(const char* name, const Json& value) { add(name, text_of(value)); }

	/// Adds what `fill` appends with commas between, and around it `brackets`, "[]" or "{}".
	void list(const char* name, const char* brackets, const std::function<void(const Append&)>& fill)
	{
		add(name, {brackets[0]});
		const char* separator = "";
		fill(
		    [&](const std::string& text)
		    {
			    packer_.add(separator + text);
			    separator = ",";
		    });
		packer_.add({brackets[1]});
	}

   private:
	void add(const char* name, const std::string& text)
	{
		packer_.add((is_first_ ? "\"" : ",\"") + std::string(name) + "\":" + text);
		is_first_ = false;
	}

	Packer& packer_;
	bool is_first_ = true;
};

constexpr std::size_t kMostBeams = 360;  //!< [-] of a scan that are kept
constexpr int kLevelOfMap = 4;           //!< [-] of zlib: whoever interrupts a run waits while a large map is packed

/// Rounds to a thousandth, which makes the text short.
double rounded(double value)
{
	return std::round(value * 1e3) / 1e3;
}

/// The words of a scan, 16 bits each, as report.js reads them: the number of beams; the pose of the sensor on the robot
/// in mm and 1e-4 rad; the angles of the beams in 65536ths of a turn; twice the ranges in cm, and 1 for a return.
/// Angles and ranges are differences from beam to beam, which pack well.
std::vector<std::uint16_t> words_of(const Scan& scan)
{
	const auto word = [](double value) { return static_cast<std::uint16_t>(std::lround(value)); };
	const std::size_t step = scan.beams.size() / kMostBeams + (scan.beams.size() % kMostBeams > 0 ? 1 : 0);
	std::vector<const Beam*> beams;
	for (std::size_t i = 0; i < scan.beams.size(); i += step) beams.push_back(&scan.beams[i]);
	const auto& sensor = scan.sensor_on_robot;
	std::vector<std::uint16_t> words = {
	    word(static_cast<double>(beams.size())), word(std::clamp(sensor.x, -32.0, 32.0) * 1e3),
	    word(std::clamp(sensor.y, -32.0, 32.0) * 1e3), word(sensor.phi * 1e4)};
	std::uint16_t last = 0;
	const auto add = [&](std::uint16_t value)
	{
		words.push_back(static_cast<std::uint16_t>(value - last));
		last = value;
	};
	constexpr double kWordsPerRadian = 65536 / (2 * M_PI), kMostRange = 327;  // [1/rad], [m]
	for (const Beam* beam : beams) add(word(static_cast<double>(beam->angle) * kWordsPerRadian));
	last = 0;
	for (const Beam* beam : beams)
		add(word(
		    2 * std::round(100 * std::min(static_cast<double>(beam->range), kMostRange)) + (beam->is_return ? 1 : 0)));
	return words;
}

/// Rounds a pose (x, y, phi) to 1 mm and 1e-4 rad.
std::vector<Json> numbers_of(const mrpt::math::TPose2D& pose)
{
	return {rounded(pose.x), rounded(pose.y), std::round(pose.phi * 1e4) / 1e4};
}

void add_list(
    JsonPacker& json, const char* name, const DrawnFrames& frames,
    const std::function<std::vector<Json>(const Frame&)>& values_of)
{
	const auto fill = [&](const JsonPacker::Append& append)
	{
		frames.visit(
		    [&](const Frame& frame)
		    {
			    for (const Json& value : values_of(frame)) append(text_of(value));
		    });
	};
	json.list(name, "[]", fill);
}

/// Adds what each frame says: a list for each kind of number.
void add_frames(JsonPacker& json, const DrawnFrames& frames)
{
	using Values = std::vector<Json>;
	const double start = frames.kept().empty() ? 0 : frames.kept().front().timestamp;
	std::size_t hypotheses = 0, place = 0;
	add_list(json, "index", frames, [](const Frame& frame) { return Values{frame.index}; });
	add_list(json, "time", frames, [&](const Frame& frame) { return Values{rounded(frame.timestamp - start)}; });
	add_list(json, "status", frames, [](const Frame& frame) { return Values{static_cast<int>(frame.result.status)}; });
	add_list(json, "confidence", frames, [](const Frame& frame) { return Values{rounded(frame.result.confidence)}; });
	add_list(
	    json, "milliseconds", frames,
	    [](const Frame& frame) { return Values{std::round(frame.result.times.total_ms * 100) / 100}; });
	add_list(
	    json, "past_hypothesis", frames,
	    [&](const Frame& frame) { return Values{hypotheses += frame.result.hypotheses.size()}; });
	add_list(
	    json, "hypotheses", frames,
	    [](const Frame& frame)
	    {
		    Values values;
		    for (const Hypothesis& hypothesis : frame.result.hypotheses)
		    {
			    for (const Json& number : numbers_of(hypothesis.pose.asTPose())) values.push_back(number);
			    values.push_back(std::round(hypothesis.probability * 1e4) / 1e4);
			    values.push_back(rounded(hypothesis.explained.value_or(NAN)));
		    }
		    return values;
	    });
	const auto add_notes = [&](const JsonPacker::Append& append)
	{
		frames.visit(
		    [&](const Frame& frame)
		    {
			    const std::string key = text_of(std::to_string(place++));
			    if (!frame.result.note.empty()) append(key + ":" + text_of(frame.result.note));
		    });
	};
	json.list("notes", "{}", add_notes);
}

/// Adds (x, y, phi) for each frame, nulls where there is no truth.
void add_truth(JsonPacker& json, const RunReport& report)
{
	const auto& frames = report.frames.kept();
	std::vector<const Match*> match_of(frames.size());
	for (const Match& match : report.matches) match_of[static_cast<std::size_t>(match.frame - frames.data())] = &match;
	const auto fill = [&](const JsonPacker::Append& append)
	{
		for (const Match* match : match_of)
			for (const Json& value : match ? numbers_of(match->truth.robot) : std::vector<Json>(3))
				append(text_of(value));
	};
	json.list("truth", "[]", fill);
}

/// Adds (status, probability, x, y, phi) of the particle filter for each frame, nulls before it has started.
void add_fused(JsonPacker& json, const DrawnFrames& frames)
{
	add_list(
	    json, "fused", frames,
	    [](const Frame& frame)
	    {
		    if (!frame.fused) return std::vector<Json>(5);
		    std::vector<Json> values = {to_string(frame.fused->status), rounded(frame.fused->probability)};
		    for (const Json& number : numbers_of(frame.fused->pose)) values.push_back(number);
		    return values;
	    });
}

/// Returns (status, confidence, x, y, phi) of an answer, nulls for what it lacks.
std::vector<Json> values_of(const std::optional<Localization>& answer)
{
	std::vector<Json> values(5);
	if (!answer) return values;
	values[0] = static_cast<int>(answer->status);
	if (answer->hypotheses.empty()) return values;
	values[1] = rounded(answer->confidence);
	const auto pose = numbers_of(answer->best().pose.asTPose());
	std::copy(pose.begin(), pose.end(), values.begin() + 2);
	return values;
}

/// Adds all that the page shows but map and scans.
void pack_results(Packer& packer, const RunReport& report, const DrawnFrames& frames, const Grid& grid)
{
	const SearchRequest& search = report.command.search;
	JsonPacker json(packer);
	json.member("version", D2S1R_VERSION);
	json.member("map", report.command.map.name());
	json.member("log", report.command.log.file);
	json.member("width", grid.width);
	json.member("height", grid.height);
	json.member("cell_size", grid.cell_size);
	json.member("origin", {grid.origin_x, grid.origin_y});
	json.member("tolerance", {kTolerances.front().position, kTolerances.front().yaw});
	json.member("window", search.window ? Json(*search.window) : Json());
	add_frames(json, frames);
	if (!report.matches.empty()) add_truth(json, report);
	if (search.fuse) add_fused(json, frames);
	if (search.window && report.maps.size() == 1)
		add_list(json, "alone", frames, [](const Frame& frame) { return values_of(frame.alone); });
	if (search.track) add_list(json, "tracked", frames, [](const Frame& frame) { return values_of(frame.tracked); });
	json.finish();
}

/// Writes what the drive shows of the laser, if it shows something.
void print_calibration(const DriveCalibration& drive, TextFile& file)
{
	const std::string picture = picture_of(drive.found);
	if (picture.empty()) return;
	std::string table = table_of(drive);  // whose texts hold no mark of HTML but this
	for (auto at = table.find('<'); at != std::string::npos; at = table.find('<')) table.replace(at, 1, "&lt;");
	file.print("<pre>%s</pre>%s", table.c_str(), picture.c_str());
}

/// Writes the template, and calls `write` for each {{name}} in it.
void fill_template(TextFile& file, const std::function<void(std::string_view name)>& write)
{
	std::string_view rest = kReportTemplate;
	while (true)
	{
		const auto start = rest.find("{{"), end = rest.find("}}");
		file.print("%.*s", static_cast<int>(std::min(start, rest.size())), rest.data());
		if (start == std::string_view::npos) return;
		write(rest.substr(start + 2, end - start - 2));
		rest.remove_prefix(end + 2);
	}
}
}  // namespace

ReportHtml::ReportHtml(const std::filesystem::path& path)
    : folder_(path.parent_path()), file_(path), scans_(std::make_unique<Packer>(folder_))
{
}

ReportHtml::~ReportHtml() = default;

void ReportHtml::add(const Scan& scan)
{
	const auto words = words_of(scan);
	scans_->add(words.data(), words.size() * sizeof(words[0]));
}

void ReportHtml::finish(const RunReport& report, const DrawnFrames& frames, const Grid& grid)
{
	fill_template(
	    file_,
	    [&](std::string_view name)
	    {
		    if (name == "scans") return scans_->print(file_);
		    if (name == "calibration") return print_calibration(report.drive, file_);
		    const bool is_map = name == "map";
		    Packer packer(folder_, is_map ? kLevelOfMap : Z_DEFAULT_COMPRESSION);
		    if (is_map)
			    packer.add(grid.cells.data(), grid.cells.size());
		    else
			    pack_results(packer, report, frames, grid);
		    packer.print(file_);
	    });
	file_.finish();
}
}  // namespace d2s1r::app
