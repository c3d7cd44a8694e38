// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frame_files.h"

#include <cmath>

namespace d2s1r::app
{
namespace
{
constexpr const char* kFrameHeading =
    "frame,timestamp,status,x,y,phi,std_x,std_y,std_phi,confidence,hypotheses,relative_entropy,retrieval_ms,"
    "registration_ms,refinement_ms,total_ms\n";
constexpr const char* kHypothesisHeading = "frame,rank,x,y,phi,probability,std_x,std_y,std_phi\n";

void write_frame(TextFile& file, const Frame& frame)
{
	const Localization& result = frame.result;
	file.print("%zu,%.6f,%s,", frame.index, frame.timestamp, to_string(result.status));
	if (frame.has_pose())
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
	if (frame.has_pose() && std::isfinite(result.relative_entropy)) file.print("%.6f", result.relative_entropy);
	file.print(
	    ",%.3f,%.3f,%.3f,%.3f\n", result.times.retrieval_ms, result.times.registration_ms, result.times.refinement_ms,
	    result.times.total_ms);
}

void write_hypotheses(TextFile& file, const Frame& frame)
{
	int rank = 0;
	for (const auto& h : frame.result.hypotheses)
		file.print(
		    "%zu,%d,%.6f,%.6f,%.6f,%.6g,%.6f,%.6f,%.6f\n", frame.index, ++rank, h.pose.x(), h.pose.y(), h.pose.phi(),
		    h.probability, std::sqrt(h.covariance(0, 0)), std::sqrt(h.covariance(1, 1)), std::sqrt(h.covariance(2, 2)));
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
}  // namespace

FrameFile::FrameFile(const std::string& path, const char* heading, Writer writer) : file_(path), writer_(writer)
{
	file_.print("%s", heading);
}

std::deque<FrameFile> open_frame_files(const std::filesystem::path& folder)
{
	std::deque<FrameFile> files;
	files.emplace_back(folder / "frames.csv", kFrameHeading, write_frame);
	files.emplace_back(folder / "hypotheses.csv", kHypothesisHeading, write_hypotheses);
	files.emplace_back(folder / "trajectory.tum", "", write_tum);
	files.emplace_back(folder / "trajectory.txt", "", write_txt);
	return files;
}

void print_tum(TextFile& file, double timestamp, const mrpt::math::TPose2D& pose)
{
	file.print(
	    "%.6f %.6f %.6f 0 0 0 %.9f %.9f\n", timestamp, pose.x, pose.y, std::sin(pose.phi / 2), std::cos(pose.phi / 2));
}
}  // namespace d2s1r::app
