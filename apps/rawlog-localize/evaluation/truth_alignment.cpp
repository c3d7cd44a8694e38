// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/truth_alignment.h"

#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace d2s1r::app
{
namespace
{
constexpr double kSameTime = 1.0005e-3;  // [s] 1 ms and what six decimals round off

/// Ground truth by time, and the pose at any time.
class Path
{
   public:
	explicit Path(GroundTruth truth) : lines_(std::move(truth))
	{
		std::stable_sort(
		    lines_.begin(), lines_.end(),
		    [](const TimedPose& a, const TimedPose& b) { return a.timestamp < b.timestamp; });
	}

	/// Returns whether a line is within 1 ms.
	bool has_line_at(double time) const
	{
		const auto next = first_from(time - kSameTime);
		return next != lines_.end() && next->timestamp <= time + kSameTime;
	}

	/// Returns the pose between the lines before and after that time; no value if there are none, or if they are
	/// further apart than `greatest_gap` [s].
	std::optional<mrpt::math::TPose2D> pose_at(double time, double greatest_gap) const
	{
		const auto after = first_from(time);
		if (after == lines_.end() || (after == lines_.begin() && after->timestamp > time)) return std::nullopt;
		if (after->timestamp == time) return after->pose;
		const auto before = after - 1;
		const double gap = after->timestamp - before->timestamp;
		if (gap > greatest_gap) return std::nullopt;
		const double share = (time - before->timestamp) / gap;
		const double turn = mrpt::math::wrapToPi(after->pose.phi - before->pose.phi);
		return mrpt::math::TPose2D(
		    before->pose.x + share * (after->pose.x - before->pose.x),
		    before->pose.y + share * (after->pose.y - before->pose.y),
		    mrpt::math::wrapToPi(before->pose.phi + share * turn));
	}

   private:
	GroundTruth::const_iterator first_from(double time) const
	{
		return std::lower_bound(
		    lines_.begin(), lines_.end(), time,
		    [](const TimedPose& line, double limit) { return line.timestamp < limit; });
	}

	GroundTruth lines_;
};

/// Compares the poses of localized frames with the ground truth at other offsets of time.
class OffsetSearch
{
   public:
	OffsetSearch(Path path, const std::vector<Frame>& frames) : path_(std::move(path))
	{
		for (const Frame& frame : frames)
			if (frame.localized()) frames_.push_back(&frame);
		constexpr std::size_t kMost = 500;  // frames, evenly spread: enough, however long the log is
		const std::size_t step = 1 + frames_.size() / kMost;
		for (std::size_t i = 0; i * step < frames_.size(); i++) frames_[i] = frames_[i * step];
		frames_.resize((frames_.size() + step - 1) / step);
	}

	/// Returns the offset [s], 0 if none makes the fit much better.
	double find() const
	{
		constexpr std::size_t kLeastFrames = 5;
		constexpr double kMuchBetter = 0.5;  // of the mean error
		if (frames_.size() < kLeastFrames) return 0;
		double best = 0, least = error(0);
		for (const double step :
		     {0.05, 0.005, 0.0005})  // [s] the first for up to 5 s, each next around the best so far
		{
			const double middle = best;
			const double reach = step == 0.05 ? 5.0 : 10 * step;  // [s]
			const auto steps = std::lround(reach / step);
			for (long i = -steps; i <= steps; i++)
			{
				const double offset = middle + static_cast<double>(i) * step;
				const double here = error(offset);
				if (here >= least) continue;
				best = offset;
				least = here;
			}
		}
		return least < kMuchBetter * error(0) ? best : 0;
	}

   private:
	/// Returns the mean error of position and yaw, each of which counts for at most 1 m or 1 rad.
	double error(double offset) const
	{
		constexpr double kAnyGap = std::numeric_limits<double>::infinity();
		double sum = 0;
		for (const Frame* frame : frames_)
		{
			const auto truth = path_.pose_at(frame->timestamp + offset, kAnyGap);
			const auto& pose = frame->result.best().pose;
			sum += truth ? std::min(1.0, std::hypot(pose.x() - truth->x, pose.y() - truth->y)) +
			                   std::min(1.0, std::abs(mrpt::math::wrapToPi(pose.phi() - truth->phi)))
			             : 2.0;
		}
		return sum / static_cast<double>(frames_.size());
	}

	Path path_;
	std::vector<const Frame*> frames_;
};
}  // namespace

AlignedTruth align_truth(const GroundTruth& truth, const std::vector<Frame>& frames)
{
	AlignedTruth aligned{truth};
	aligned.offset = OffsetSearch(Path(truth), frames).find();
	for (TimedPose& line : aligned.lines) line.timestamp -= aligned.offset;

	const Path path(aligned.lines);
	GroundTruth interpolated;
	for (const Frame& frame : frames)
	{
		if (path.has_line_at(frame.timestamp)) continue;
		if (const auto pose = path.pose_at(frame.timestamp, kGreatestGap))
			interpolated.push_back({frame.timestamp, *pose});
	}
	aligned.interpolated = interpolated.size();
	if (interpolated.empty()) return aligned;
	std::vector<double> times;
	for (const Frame& frame : frames) times.push_back(frame.timestamp);
	std::sort(times.begin(), times.end());
	const auto has_no_frame = [&](const TimedPose& line)
	{
		const auto next = std::lower_bound(times.begin(), times.end(), line.timestamp - kSameTime);
		return next == times.end() || *next > line.timestamp + kSameTime;
	};
	auto& lines = aligned.lines;
	lines.erase(std::remove_if(lines.begin(), lines.end(), has_no_frame), lines.end());
	lines.insert(lines.end(), interpolated.begin(), interpolated.end());
	return aligned;
}
}  // namespace d2s1r::app
