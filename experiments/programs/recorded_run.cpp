// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "recorded_run.h"

#include <d2s1r/mrpt.h>
#include <logs/log.h>
#include <logs/mrpt_objects.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/math/wrap2pi.h>
#include <mrpt/poses/CPosePDFGaussian.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <random>
#include <stdexcept>
#include <thread>

#include "data/poses.h"

namespace d2s1r::experiments
{
namespace
{
using PoseDensity = mrpt::poses::CPosePDFGaussian;

bool is_same_place(const mrpt::math::TPose2D& a, const mrpt::math::TPose2D& b)
{
	return std::hypot(a.x - b.x, a.y - b.y) < 0.5 && std::abs(mrpt::math::wrapToPi(a.phi - b.phi)) < 10 * M_PI / 180;
}

/// The name of the file is there only when the file is whole.
void write_cache(const std::vector<RunFrame>& run, const std::string& file)
{
	const std::string part = file + ".part";
	{
		mrpt::io::CFileGZOutputStream stream(part);
		auto archive = mrpt::serialization::archiveFrom(stream);
		for (const RunFrame& frame : run)
		{
			const Localization& found = frame.localization;
			archive << static_cast<std::int32_t>(found.status) << found.confidence << found.presence
			        << found.temperature << static_cast<std::uint32_t>(found.hypotheses.size());
			for (const Hypothesis& hypothesis : found.hypotheses)
				archive << PoseDensity(hypothesis.pose, hypothesis.covariance) << hypothesis.probability
				        << hypothesis.log_likelihood.value_or(0) << hypothesis.by_pieces.value_or(0)
				        << hypothesis.explained.value_or(0) << hypothesis.log_odds.value_or(0);
		}
	}
	std::filesystem::rename(part, file);
}

void read_cache(std::vector<RunFrame>& run, const std::string& file)
{
	mrpt::io::CFileGZInputStream stream(file);
	auto archive = mrpt::serialization::archiveFrom(stream);
	for (RunFrame& frame : run)
	{
		std::int32_t status = 0;
		std::uint32_t count = 0;
		Localization& found = frame.localization;
		archive >> status >> found.confidence >> found.presence >> found.temperature >> count;
		found.status = static_cast<Status>(status);
		for (; count > 0; count--)
		{
			Hypothesis& hypothesis = found.hypotheses.emplace_back();
			PoseDensity density;
			double log_likelihood = 0, by_pieces = 0, explained = 0, log_odds = 0;
			archive >> density >> hypothesis.probability >> log_likelihood >> by_pieces >> explained >> log_odds;
			hypothesis.pose = density.mean;
			hypothesis.covariance = density.cov;
			hypothesis.log_likelihood = log_likelihood;
			hypothesis.by_pieces = by_pieces;
			hypothesis.explained = explained;
			hypothesis.log_odds = log_odds;
		}
	}
}
}  // namespace

bool RunFrame::is_near(const mrpt::math::TPose2D& pose) const
{
	return is_same_place(pose, truth);
}

bool RunFrame::is_near_on_map(const mrpt::math::TPose2D& pose, const CSignatureMap2D& map) const
{
	const Localizer& localizer = map.localizer();
	const auto fitted =
	    localizer.hypothesis_near(make_scan(scan_of(*scan), localizer.parameters().scan), mrpt::poses::CPose2D(truth));
	return fitted && is_same_place(pose, fitted->pose.asTPose());
}

std::vector<RunFrame> load_run(const std::string& log, const std::string& ground_truth)
{
	std::map<std::int64_t, mrpt::math::TPose2D> truth;  // by time [ms]
	for (const auto& pose : test::load_poses(ground_truth)) truth[std::llround(1e3 * pose.time)] = pose.robot;
	const auto reader = logs::open_log(log).read();
	std::vector<RunFrame> run;
	std::optional<mrpt::poses::CPose2D> odometry;
	while (const auto object = reader->next())
	{
		if (object->odometry) odometry = object->odometry;
		for (const auto& scan : object->scans)
		{
			if (!run.empty() && scan->label != run.front().scan->sensorLabel) continue;
			const auto time = std::llround(1e3 * logs::to_seconds(scan->timestamp));
			const auto after = truth.lower_bound(time - 1);
			const bool has_truth = after != truth.end() && after->first <= time + 1;
			run.push_back(
			    {std::make_shared<mrpt::obs::CObservation2DRangeScan>(logs::observation_of(*scan)),
			     odometry,
			     has_truth ? after->second : mrpt::math::TPose2D(),
			     has_truth,
			     {}});
		}
	}
	if (std::none_of(run.begin(), run.end(), [](const RunFrame& frame) { return frame.has_truth; }))
		throw std::runtime_error(ground_truth + ": no line has the time of a scan of " + log);
	return run;
}

void make_odometry(std::vector<RunFrame>& run, unsigned seed)
{
	std::mt19937 random(seed);
	std::normal_distribution<double> error(0, 1);
	mrpt::poses::CPose2D reading;
	for (std::size_t i = 0; i < run.size(); i++)
	{
		if (i > 0)
		{
			const auto step = mrpt::poses::CPose2D(run[i].truth) - mrpt::poses::CPose2D(run[i - 1].truth);
			const double way = 1 + 0.05 * error(random), turn = 1 + 0.05 * error(random);
			const double drift = M_PI / 180 * step.norm() * error(random);  // [rad]
			reading = reading + mrpt::poses::CPose2D(way * step.x(), way * step.y(), turn * step.phi() + drift);
		}
		run[i].odometry = reading;
	}
}

void disturb_odometry(std::vector<RunFrame>& run, double scale, double yaw_noise)
{
	std::mt19937 random(1);
	std::normal_distribution<double> error(0, yaw_noise * M_PI / 180);
	std::optional<mrpt::poses::CPose2D> before, reading;  // of the odometry as it was, and disturbed
	for (RunFrame& frame : run)
	{
		if (!frame.odometry) continue;
		const auto motion = before ? *frame.odometry - *before : mrpt::poses::CPose2D();
		before = frame.odometry;
		const double turn = yaw_noise > 0 && reading ? error(random) : 0;
		const mrpt::poses::CPose2D disturbed(scale * motion.x(), scale * motion.y(), motion.phi() + turn);
		reading = reading ? *reading + disturbed : *frame.odometry;
		frame.odometry = reading;
	}
}

void localize_all(std::vector<RunFrame>& run, const Localizer& localizer, const std::string& cache_file)
{
	if (std::filesystem::exists(cache_file)) return read_cache(run, cache_file);
	const auto localize = [&](std::size_t first)
	{
		for (std::size_t i = first; i < run.size(); i += 2)
			run[i].localization = localizer.localize(scan_of(*run[i].scan));
	};
	std::thread other(localize, 1);
	localize(0);
	other.join();
	if (!cache_file.empty()) write_cache(run, cache_file);
}
}  // namespace d2s1r::experiments
