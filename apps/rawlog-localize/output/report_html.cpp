// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "output/report_html.h"

#include "report_template.h"

#include <d2s1r/version.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <nlohmann/json.hpp>
#include <string_view>

namespace d2s1r::app
{
namespace
{
using Json = nlohmann::ordered_json;     // numbers that are not finite become null
constexpr std::size_t kMostBeams = 360;  //!< [-] of a scan that are kept

/// Rounds to a thousandth, which makes the text short.
double rounded(double value)
{
	return std::round(value * 1e3) / 1e3;
}

/// Rounds a pose (x, y, phi) to 1 mm and 1e-4 rad.
void append_pose(Json& list, const mrpt::math::TPose2D& pose)
{
	list.push_back(rounded(pose.x));
	list.push_back(rounded(pose.y));
	list.push_back(std::round(pose.phi * 1e4) / 1e4);
}

std::string base64(const std::vector<std::uint8_t>& bytes)
{
	constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
	std::string text;
	text.reserve(bytes.size() / 3 * 4 + 4);
	for (std::size_t i = 0; i < bytes.size(); i += 3)
	{
		const auto byte = [&](std::size_t k) { return k < bytes.size() ? bytes[k] : 0U; };
		const unsigned three = byte(i) << 16U | byte(i + 1) << 8U | byte(i + 2);
		for (const unsigned shift : {18U, 12U, 6U, 0U}) text += kDigits[three >> shift & 63U];
	}
	for (std::size_t k = bytes.size(); k % 3 != 0; k++) text[text.size() - 1 - (k - bytes.size())] = '=';
	return text;
}
}  // namespace

/// Packs bytes by zlib as they come, which takes little memory for long logs.
class ReportHtml::Packer
{
   public:
	Packer()
	{
		if (deflateInit(&stream_, kLevel) != Z_OK) throw std::bad_alloc();
	}
	~Packer() { deflateEnd(&stream_); }
	Packer(const Packer&) = delete;
	Packer& operator=(const Packer&) = delete;

	void add(const void* bytes, std::size_t size) { pack(bytes, size, Z_NO_FLUSH); }

	/// Returns the packed bytes as base64.
	std::string finish()
	{
		pack(nullptr, 0, Z_FINISH);
		return base64(packed_);
	}

   private:
	void pack(const void* bytes, std::size_t size, int flush)
	{
		static const Bytef kNothing = 0;
		stream_.next_in = const_cast<Bytef*>(size > 0 ? static_cast<const Bytef*>(bytes) : &kNothing);
		stream_.avail_in = static_cast<uInt>(size);
		std::array<Bytef, 1 << 14> part;
		do
		{
			stream_.next_out = part.data();
			stream_.avail_out = static_cast<uInt>(part.size());
			deflate(&stream_, flush);
			packed_.insert(packed_.end(), part.data(), stream_.next_out);
		} while (stream_.avail_out == 0);
	}

	static constexpr int kLevel = 6;  //!< zlib's default
	z_stream stream_{};
	std::vector<std::uint8_t> packed_;
};

namespace
{
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

/// The numbers that are kept of what a scan said alone: status, confidence, x, y, phi.
constexpr std::size_t kAloneNumbers = 5;

std::array<double, kAloneNumbers> numbers_of(const Localization& result)
{
	const double status = static_cast<double>(result.status);
	if (result.hypotheses.empty()) return {status, NAN, NAN, NAN, NAN};
	const auto& pose = result.best().pose;
	return {status, result.confidence, pose.x(), pose.y(), pose.phi()};
}

/// Adds what each frame says: a list for each kind of number.
void add_frames(Json& json, const std::vector<Frame>& frames)
{
	Json index = Json::array(), time = Json::array(), status = Json::array(), confidence = Json::array(),
	     milliseconds = Json::array(), past_hypothesis = Json::array(), hypotheses = Json::array(),
	     notes = Json::object();
	std::size_t count = 0;
	for (const Frame& frame : frames)
	{
		const Localization& result = frame.result;
		if (!result.note.empty()) notes[std::to_string(index.size())] = result.note;
		index.push_back(frame.index);
		time.push_back(rounded(frame.timestamp - frames.front().timestamp));
		status.push_back(static_cast<int>(result.status));
		confidence.push_back(rounded(result.confidence));
		milliseconds.push_back(std::round(result.times.total_ms * 100) / 100);
		for (const Hypothesis& hypothesis : result.hypotheses)
		{
			append_pose(hypotheses, hypothesis.pose.asTPose());
			hypotheses.push_back(std::round(hypothesis.probability * 1e4) / 1e4);
			hypotheses.push_back(rounded(hypothesis.explained.value_or(NAN)));
		}
		past_hypothesis.push_back(count += result.hypotheses.size());
	}
	json["index"] = std::move(index);
	json["time"] = std::move(time);
	json["status"] = std::move(status);
	json["confidence"] = std::move(confidence);
	json["milliseconds"] = std::move(milliseconds);
	json["past_hypothesis"] = std::move(past_hypothesis);
	json["hypotheses"] = std::move(hypotheses);
	json["notes"] = std::move(notes);
}

/// Returns (x, y, phi) for each frame, nulls where there is no truth.
Json truth_of(const RunReport& report)
{
	Json truth(3 * report.frames.size(), nullptr);
	for (const Match& match : report.matches)
	{
		Json pose = Json::array();
		append_pose(pose, match.truth.pose);
		const auto frame = static_cast<std::size_t>(match.frame - report.frames.data());
		std::copy(pose.begin(), pose.end(), truth.begin() + static_cast<std::ptrdiff_t>(3 * frame));
	}
	return truth;
}

/// Returns (status, probability, x, y, phi) of the particle filter for each frame, nulls before it has started.
Json fused_of(const std::vector<Frame>& frames)
{
	Json fused = Json::array();
	for (const Frame& frame : frames)
		if (frame.fused)
		{
			fused.push_back(to_string(frame.fused->status));
			fused.push_back(rounded(frame.fused->probability));
			append_pose(fused, frame.fused->pose);
		}
		else
			for (int i = 0; i < 5; i++) fused.push_back(nullptr);
	return fused;
}

Json alone_of(const std::vector<double>& numbers)
{
	Json alone = Json::array();
	for (const double number : numbers) alone.push_back(std::round(number * 1e4) / 1e4);
	return alone;
}

/// Writes the template with each {{name}} replaced by what `content` returns.
template <typename Content>
void fill_template(TextFile& file, const Content& content)
{
	std::string_view rest = kReportTemplate;
	while (true)
	{
		const auto start = rest.find("{{"), end = rest.find("}}");
		file.print("%.*s", static_cast<int>(std::min(start, rest.size())), rest.data());
		if (start == std::string_view::npos) return;
		file.print("%s", content(rest.substr(start + 2, end - start - 2)).c_str());
		rest.remove_prefix(end + 2);
	}
}
}  // namespace

ReportHtml::ReportHtml(const std::string& path) : file_(path), scans_(std::make_unique<Packer>()) {}

ReportHtml::~ReportHtml() = default;

void ReportHtml::add(const Frame& frame, const Scan& scan)
{
	const auto words = words_of(scan);
	scans_->add(words.data(), words.size() * sizeof(words[0]));
	if (!frame.alone) return;
	const auto numbers = numbers_of(*frame.alone);
	alone_.insert(alone_.end(), numbers.begin(), numbers.end());
}

void ReportHtml::finish(const RunReport& report, const Grid& grid)
{
	Json json = {
	    {"version", D2S1R_VERSION},
	    {"map", report.command.map.name()},
	    {"log", report.command.log.file},
	    {"width", grid.width},
	    {"height", grid.height},
	    {"cell_size", grid.cell_size},
	    {"origin", {grid.origin_x, grid.origin_y}},
	    {"tolerance", {kTolerances.front().position, kTolerances.front().yaw}},
	    {"window", report.command.search.window ? Json(*report.command.search.window) : Json()}};
	add_frames(json, report.frames);
	if (!report.matches.empty()) json["truth"] = truth_of(report);
	if (report.command.search.fuse) json["fused"] = fused_of(report.frames);
	if (!alone_.empty() && report.maps.size() == 1) json["alone"] = alone_of(alone_);

	fill_template(
	    file_,
	    [&](std::string_view name)
	    {
		    if (name == "scans") return scans_->finish();
		    Packer packer;
		    if (name == "map")
			    packer.add(grid.cells.data(), grid.cells.size());
		    else
		    {
			    const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
			    packer.add(text.data(), text.size());
		    }
		    return packer.finish();
	    });
	file_.finish();
}
}  // namespace d2s1r::app
