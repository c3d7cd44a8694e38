// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "output/frame_outputs.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <filesystem>

namespace d2s1r::app
{
namespace
{
constexpr const char* kFrameHeading =
    "frame,timestamp,status,x,y,phi,std_x,std_y,std_phi,confidence,hypotheses,relative_entropy,retrieval_ms,"
    "registration_ms,refinement_ms,total_ms,cov_xx,cov_xy,cov_xphi,cov_yy,cov_yphi,cov_phiphi,note,map\n";
constexpr const char* kFusedHeading =
    "frame,timestamp,x,y,phi,std_x,std_y,std_phi,particles,effective_sample_size,status,event,probability,step_ms,"
    "map\n";
constexpr const char* kCheckHeading =
    "frame,timestamp,verdict,tracker_x,tracker_y,tracker_phi,distance,turn,agreement,consistent,away\n";
constexpr const char* kHypothesisHeading = "frame,rank,x,y,phi,probability,std_x,std_y,std_phi,map\n";

/// Returns a text as a field of a CSV file, in quotes if it holds a separator. Names are of anybody: one that a
/// spreadsheet would take for a formula gets an apostrophe in front.
std::string csv_field(const std::string& given)
{
	const bool is_formula = !given.empty() && std::string("=+-@\t\r").find(given.front()) != std::string::npos;
	const std::string text = is_formula ? "'" + given : given;
	if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
	std::string field = "\"";
	for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
	return field + "\"";
}

/// Writes a row of frames.csv about one of the answers of a frame.
void write_answer(TextFile& file, const Frame& frame, const Localization& result)
{
	const bool has_pose = !result.hypotheses.empty();
	file.print("%zu,%.6f,%s,", frame.index, frame.timestamp, to_string(result.status));
	if (has_pose)
	{
		const auto& pose = result.best().pose;
		const auto& covariance = result.best().covariance;
		file.print(
		    "%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,", pose.x(), pose.y(), pose.phi(), std::sqrt(covariance(0, 0)),
		    std::sqrt(covariance(1, 1)), std::sqrt(covariance(2, 2)), result.confidence);
	}
	else
		file.print(",,,,,,,");
	file.print("%zu,", result.hypotheses.size());
	if (has_pose && result.relative_entropy) file.print("%.6f", *result.relative_entropy);
	file.print(
	    ",%.3f,%.3f,%.3f,%.3f,", result.times.retrieval_ms, result.times.registration_ms, result.times.refinement_ms,
	    result.times.total_ms);
	for (int row = 0; row < 3; row++)
		for (int column = row; column < 3; column++)
			if (has_pose)
				file.print("%.6g,", result.best().covariance(row, column));
			else
				file.print(",");
	file.print("%s,%s\n", csv_field(result.note).c_str(), has_pose ? csv_field(result.best().map).c_str() : "");
}

void write_frame(TextFile& file, const Frame& frame)
{
	write_answer(file, frame, frame.result);
}

void write_track(TextFile& file, const Frame& frame)
{
	if (frame.tracked) write_answer(file, frame, *frame.tracked);
}

void write_hypotheses(TextFile& file, const Frame& frame)
{
	int rank = 0;
	for (const auto& h : frame.result.hypotheses)
		file.print(
		    "%zu,%d,%.6f,%.6f,%.6f,%.6g,%.6f,%.6f,%.6f,%s\n", frame.index, ++rank, h.pose.x(), h.pose.y(), h.pose.phi(),
		    h.probability, std::sqrt(h.covariance(0, 0)), std::sqrt(h.covariance(1, 1)), std::sqrt(h.covariance(2, 2)),
		    csv_field(h.map).c_str());
}

/// Prints a line "time x y z qx qy qz qw".
void print_tum(TextFile& file, double timestamp, const mrpt::math::TPose2D& pose)
{
	file.print(
	    "%.6f %.6f %.6f 0 0 0 %.9f %.9f\n", timestamp, pose.x, pose.y, std::sin(pose.phi / 2), std::cos(pose.phi / 2));
}

void write_tum(TextFile& file, const Frame& frame)
{
	if (frame.localized()) print_tum(file, frame.timestamp, frame.result.best().pose.asTPose());
}

void write_txt(TextFile& file, const Frame& frame)
{
	if (!frame.localized()) return;
	const auto& pose = frame.result.best().pose;
	file.print("%.6f %.6f %.6f %.6f\n", frame.timestamp, pose.x(), pose.y(), pose.phi());
}

void write_track_tum(TextFile& file, const Frame& frame)
{
	if (frame.tracked && !frame.tracked->hypotheses.empty())
		print_tum(file, frame.timestamp, frame.tracked->best().pose.asTPose());
}

void write_fused(TextFile& file, const Frame& frame)
{
	file.print("%zu,%.6f,", frame.index, frame.timestamp);
	if (!frame.fused)
	{
		file.print(",,,,,,,,waiting,%s,,,\n", to_string(FusionEvent::kNone));
		return;
	}
	const FusedPose& fused = *frame.fused;
	const auto& covariance = fused.covariance;
	file.print(
	    "%.6f,%.6f,%.6f,%.6f,%.6f,%.6f,%zu,%.6f,%s,%s,%.6f,%.3f,%s\n", fused.pose.x, fused.pose.y, fused.pose.phi,
	    std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1)), std::sqrt(covariance(2, 2)), fused.particles,
	    fused.effective_sample_size, to_string(fused.status), to_string(fused.event), fused.probability, fused.step_ms,
	    csv_field(fused.map).c_str());
}

void write_fused_tum(TextFile& file, const Frame& frame)
{
	if (frame.fused) print_tum(file, frame.timestamp, frame.fused->pose);
}

void write_check(TextFile& file, const Frame& frame)
{
	if (!frame.tracker) return;
	const auto& [scan, pose] = *frame.tracker;
	file.print("%zu,%.6f,%s,", frame.index, frame.timestamp, to_string(scan.verdict));
	if (pose)
		file.print("%.6f,%.6f,%.6f,", pose->x, pose->y, pose->phi);
	else
		file.print(",,,");
	for (const auto& number : {scan.distance, scan.turn, scan.agreement})
		if (number)
			file.print("%.6f,", *number);
		else
			file.print(",");
	file.print("%d,%d\n", scan.consistent, scan.away);
}

std::deque<FrameFile> open_frame_files(const CommandLine& command)
{
	const std::filesystem::path folder = command.output.folder;
	std::deque<FrameFile> files;
	files.emplace_back(folder / "frames.csv", kFrameHeading, write_frame);
	files.emplace_back(folder / "hypotheses.csv", kHypothesisHeading, write_hypotheses);
	files.emplace_back(folder / "trajectory.tum", "", write_tum);
	files.emplace_back(folder / "trajectory.txt", "", write_txt);
	if (!command.log.check.empty()) files.emplace_back(folder / "check.csv", kCheckHeading, write_check);
	if (command.search.track)
	{
		files.emplace_back(folder / "track.csv", kFrameHeading, write_track);
		files.emplace_back(folder / "track.tum", "", write_track_tum);
	}
	if (!command.search.fuse) return files;
	files.emplace_back(folder / "fused.csv", kFusedHeading, write_fused);
	files.emplace_back(folder / "fused.tum", "", write_fused_tum);
	return files;
}
}  // namespace

std::string json_line(const Frame& frame)
{
	using Json = nlohmann::ordered_json;  // numbers that are not finite become null
	const auto with_pose = [](Json json, const mrpt::math::TPose2D& pose)
	{
		json["x"] = pose.x;
		json["y"] = pose.y;
		json["phi"] = pose.phi;
		return json;
	};
	const Localization& result = frame.result;
	Json json = {{"frame", frame.index}, {"timestamp", frame.timestamp}, {"status", to_string(result.status)}};
	if (frame.has_pose())
	{
		json = with_pose(json, result.best().pose.asTPose());
		for (int row = 0; row < 3; row++)
			for (int column = row; column < 3; column++)
				json["covariance"].push_back(result.best().covariance(row, column));
		json["confidence"] = result.confidence;
		if (!result.best().map.empty()) json["map"] = result.best().map;
	}
	json["hypotheses"] = Json::array();
	for (const auto& hypothesis : result.hypotheses)
	{
		Json one = with_pose(Json::object({{"probability", hypothesis.probability}}), hypothesis.pose.asTPose());
		if (!hypothesis.map.empty()) one["map"] = hypothesis.map;
		json["hypotheses"].push_back(std::move(one));
	}
	if (frame.tracked)
	{
		json["tracked"] = {{"status", to_string(frame.tracked->status)}, {"confidence", frame.tracked->confidence}};
		if (!frame.tracked->hypotheses.empty())
		{
			const Hypothesis& best = frame.tracked->best();
			json["tracked"] = with_pose(json["tracked"], best.pose.asTPose());
			if (!best.map.empty()) json["tracked"]["map"] = best.map;
		}
	}
	if (frame.fused)
	{
		json["fused"] = with_pose(
		    {{"status", to_string(frame.fused->status)}, {"event", to_string(frame.fused->event)}}, frame.fused->pose);
		if (!frame.fused->map.empty()) json["fused"]["map"] = frame.fused->map;
	}
	if (frame.tracker)
	{
		const WatchedScan& scan = frame.tracker->scan;
		json["tracker"] = {{"verdict", to_string(scan.verdict)}};
		if (scan.distance) json["tracker"]["distance"] = *scan.distance;
		if (scan.turn) json["tracker"]["turn"] = *scan.turn;
		if (scan.agreement) json["tracker"]["agreement"] = *scan.agreement;
	}
	if (!result.note.empty()) json["note"] = result.note;
	json["total_ms"] = result.times.total_ms;
	const auto latency = std::chrono::steady_clock::now() - frame.read_at;
	json["latency_ms"] = std::chrono::duration<double, std::milli>(latency).count();
	return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

FrameFile::FrameFile(const std::string& path, const char* heading, Writer writer) : file_(path), writer_(writer)
{
	file_.print("%s", heading);
}

FrameOutputs::FrameOutputs(const CommandLine& command)
    : files_(open_frame_files(command)), frames_(command.output.folder)
{
}

void FrameOutputs::add(const Frame& frame)
{
	for (auto& file : files_) file.add(frame);
	frames_.add(frame);
}

void FrameOutputs::finish()
{
	for (auto& file : files_) file.finish();
}

void FrameOutputs::commit()
{
	for (auto& file : files_) file.commit();
}
}  // namespace d2s1r::app
