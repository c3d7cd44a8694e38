// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/ground_truth.h"

#include <base/errors.h>
#include <logs/log.h>
#include <mrpt/math/wrap2pi.h>
#include <shell/errors.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>

#include "cli/command_line.h"
#include "evaluation/truth_columns.h"

namespace d2s1r::app
{
namespace
{
/// Returns the numbers of a line with blanks between them, NaN for what stands for none; nothing if anything else is
/// there.
std::vector<double> parse_numbers(const std::string& line)
{
	std::istringstream text(line);
	std::vector<double> values;
	for (std::string word; text >> word;)
	{
		const auto value = is_no_number(word) ? std::numeric_limits<double>::quiet_NaN() : parse_number(word);
		if (!value) return {};
		values.push_back(*value);
	}
	return values;
}

/// Returns the pose that numbers are, whose count tells the layout of the line; no value if there is none like that.
std::optional<TimedPose> pose_of(const std::vector<double>& values)
{
	TimedPose pose;
	if (values.size() == 4) pose.pose.phi = values[3];
	if (values.size() == 7) pose.pose.phi = values[4];
	if (values.size() == 8) pose.pose.phi = yaw_of_quaternion(values[4], values[5], values[6], values[7]);
	if ((values.size() != 4 && values.size() != 7 && values.size() != 8) || std::isnan(pose.pose.phi))
		return std::nullopt;
	pose.timestamp = values[0];
	pose.pose.x = values[1];
	pose.pose.y = values[2];
	return pose;
}

[[noreturn]] void throw_wrong_line(const std::string& file, int number, const std::string& what)
{
	throw UserError(kBadInput, file, "line " + std::to_string(number) + " " + what + "; correct it");
}

constexpr const char* kByteOrderMark = "\xEF\xBB\xBF";  //!< of a text in UTF-8

/// Reads the poses of a file line by line.
class TruthReader
{
   public:
	explicit TruthReader(const std::string& file) : file_(file) {}

	void read(const std::string& line)
	{
		if (++number_ == 1 && line.rfind(kByteOrderMark, 0) == 0) return read_after_mark(line);
		if (number_ == 1 && (line.rfind("\xFF\xFE", 0) == 0 || line.rfind("\xFE\xFF", 0) == 0))
			throw UserError(kBadInput, file_, "is a text in UTF-16; save it as UTF-8");
		const auto first = line.find_first_not_of(" \t\r");
		if (first == std::string::npos) return;
		const bool is_comment = line[first] == '%' || line[first] == '#';
		const bool may_name_columns = truth_.empty() && (!columns_ || columns_->may_be_remark());
		const auto columns = may_name_columns ? Columns::parse(line) : std::nullopt;
		if (columns)
		{
			const std::string missing = columns->missing();
			if (missing.empty() && !columns->wrong_unit().empty() && !columns->may_be_remark())
				throw_wrong_line(file_, number_, columns->wrong_unit());
			if (missing.empty()) columns_ = columns;
			if (missing.empty() || is_comment) return;
			throw_wrong_line(file_, number_, "names no column for " + missing);
		}
		if (is_comment) return;
		if (is_only_remark(line)) columns_.reset();
		if (columns_)
			read_row(columns_->values_of(line));
		else
			read_numbers(parse_numbers(line));
	}

	const GroundTruth& truth() const { return truth_; }

   private:
	/// Returns whether what was taken for names of columns are not those of the first line below.
	bool is_only_remark(const std::string& line) const
	{
		return columns_ && columns_->may_be_remark() && truth_.empty() && columns_->count() != words_of(line).size();
	}

	void read_after_mark(const std::string& line)
	{
		number_ = 0;
		read(line.substr(std::strlen(kByteOrderMark)));
	}

	void read_row(const std::vector<std::string>& row)
	{
		if (!columns_->wrong_unit().empty()) throw_wrong_line(file_, number_, columns_->wrong_unit());
		if (columns_->may_be_remark() && row.size() != columns_->count())
			throw_wrong_line(
			    file_, number_,
			    "has " + std::to_string(row.size()) + " numbers, and the lines above have " +
			        std::to_string(columns_->count()));
		if (columns_->is_empty(row)) return;
		const auto pose = columns_->parse_row(row);
		if (!pose) throw_wrong_line(file_, number_, columns_->wrong_value(row));
		add(*pose);
	}

	void read_numbers(const std::vector<double>& numbers)
	{
		const bool has_time = !numbers.empty() && !std::isnan(numbers.front());
		if (has_time && std::any_of(numbers.begin(), numbers.end(), [](double n) { return std::isnan(n); }))
			return;  // no pose is known then
		const auto pose = has_time ? pose_of(numbers) : std::nullopt;
		if (!pose)
			throw_wrong_line(
			    file_, number_,
			    "is neither 'time x y phi' nor 'time x y z yaw pitch roll' nor 'time x y z qx qy qz qw', and no line "
			    "above names columns with commas between them");
		if (truth_.empty()) numbers_of_line_ = numbers.size();
		if (numbers.size() != numbers_of_line_)
			throw_wrong_line(
			    file_, number_,
			    "has " + std::to_string(numbers.size()) + " numbers, and the lines above have " +
			        std::to_string(numbers_of_line_));
		add(*pose);
	}

	void add(TimedPose pose)
	{
		// A time tells its unit: the least in ms that counts here is in 1973, and would be in the year 5138 in s.
		constexpr double kLeastNanoseconds = 1e16, kLeastMicroseconds = 1e14, kLeastMilliseconds = 1e11;
		pose.timestamp *= pose.timestamp > kLeastNanoseconds    ? 1e-9
		                  : pose.timestamp > kLeastMicroseconds ? 1e-6
		                  : pose.timestamp > kLeastMilliseconds ? 1e-3
		                                                        : 1;
		constexpr double kFarthest = 1e7;  // [m] a quarter of the way around the earth
		if (!(std::abs(pose.pose.x) <= kFarthest && std::abs(pose.pose.y) <= kFarthest))
			throw_wrong_line(file_, number_, "has a position that is more than 10,000 km from the origin of the map");
		truth_.push_back(pose);
	}

	std::string file_;
	int number_ = 0;
	std::size_t numbers_of_line_ = 0;  //!< if the file has no names of columns
	std::optional<Columns> columns_;   //!< if the file has names of columns
	GroundTruth truth_;
};
}  // namespace

GroundTruth load_ground_truth(const std::string& file)
{
	errno = 0;
	std::ifstream in(file);
	if (!in)
		throw UserError(
		    kBadInput, file,
		    std::string("cannot be opened (") + std::strerror(errno) + "); " + advice_on(errno, "check the path"));
	errno = 0;
	TruthReader reader(file);
	constexpr std::size_t kLongestLine = 1 << 20;  // [byte] of a line, for which there has to be memory
	std::string line(kLongestLine, '\0');
	while (in.getline(line.data(), kLongestLine))
		reader.read(line.substr(0, static_cast<std::size_t>(in.gcount()) - (in.eof() ? 0 : 1)));
	if (in.bad())  // else the lines before an error would count as all
		throw UserError(
		    kBadInput, file,
		    std::string("cannot be read to its end (") + (errno ? std::strerror(errno) : "read error") +
		        "); check that it is a file, and copy it again");
	if (!in.eof())
		throw UserError(
		    kBadInput, file,
		    "has a line of more than " + std::to_string(kLongestLine) + " bytes; name a text of poses");
	if (reader.truth().empty())
		throw UserError(kBadInput, file, "holds no pose; name a file with lines 'time x y phi'");
	return reader.truth();
}

PosesInFrame read_ground_truth(
    const std::string& name, const std::string& log, const std::string& label, const std::string& damage)
{
	if (name.rfind(kFramePrefix, 0) == 0)
	{
		PosesInFrame found{{}, name.substr(std::strlen(kFramePrefix))};
		for (const auto& [time, pose] : logs::read_poses_of_frame(log, found.frame, label, damage))
			found.poses.push_back({time, pose});
		return found;
	}
	if (name.rfind(kTopicPrefix, 0) != 0) return {load_ground_truth(name)};
	const logs::PosesOfTopic of_topic = logs::read_poses_of_topic(log, name.substr(std::strlen(kTopicPrefix)), damage);
	PosesInFrame found{{}, of_topic.frame};
	for (const auto& [time, pose] : of_topic.poses) found.poses.push_back({time, pose});
	return found;
}

namespace
{
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
		return pose_between(before->pose, after->pose, (time - before->timestamp) / gap);
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
	OffsetSearch(Path path, const std::vector<KeptFrame>& frames) : path_(std::move(path))
	{
		for (const KeptFrame& frame : frames)
			if (frame.localized()) frames_.push_back(&frame);
		constexpr std::size_t kMostFrames = 500;  // frames, evenly spread: enough, however long the log is
		const std::size_t step = 1 + frames_.size() / kMostFrames;
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
		for (const KeptFrame* frame : frames_)
		{
			const auto truth = path_.pose_at(frame->timestamp + offset, kAnyGap);
			const auto& pose = frame->pose;
			sum += truth ? std::min(1.0, std::hypot(pose.x - truth->x, pose.y - truth->y)) +
			                   std::min(1.0, std::abs(mrpt::math::wrapToPi(pose.phi - truth->phi)))
			             : 2.0;
		}
		return sum / static_cast<double>(frames_.size());
	}

	Path path_;
	std::vector<const KeptFrame*> frames_;
};
}  // namespace

AlignedTruth align_truth(const GroundTruth& truth, const std::vector<KeptFrame>& frames)
{
	AlignedTruth aligned{truth};
	aligned.offset = OffsetSearch(Path(truth), frames).find();
	for (TimedPose& line : aligned.lines) line.timestamp -= aligned.offset;

	const Path path(aligned.lines);
	GroundTruth interpolated;
	for (const KeptFrame& frame : frames)
	{
		if (path.has_line_at(frame.timestamp)) continue;
		if (const auto pose = path.pose_at(frame.timestamp, kGreatestGap))
			interpolated.push_back({frame.timestamp, *pose});
	}
	aligned.interpolated = interpolated.size();
	if (interpolated.empty()) return aligned;
	std::vector<double> times;
	for (const KeptFrame& frame : frames) times.push_back(frame.timestamp);
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

bool are_headings_degrees(const GroundTruth& truth, const std::vector<KeptFrame>& frames)
{
	constexpr double kTurn = 2 * M_PI, kSame = 5 * M_PI / 180;  // [rad]
	constexpr std::size_t kFewest = 5;                          // [-] frames that show something
	const auto is_beyond = [](const TimedPose& line) { return std::abs(line.pose.phi) > kTurn; };
	if (std::none_of(truth.begin(), truth.end(), is_beyond)) return false;
	const auto count_same = [&](double unit)
	{
		GroundTruth lines = truth;
		for (TimedPose& line : lines) line.pose.phi *= unit;
		const Path path(lines);
		std::size_t of = 0, same = 0;
		for (const KeptFrame& frame : frames)
		{
			const auto pose = frame.localized() ? path.pose_at(frame.timestamp, kGreatestGap) : std::nullopt;
			if (!pose) continue;
			of++;
			same += std::abs(mrpt::math::wrapToPi(frame.pose.phi - pose->phi)) < kSame;
		}
		return std::pair(same, of);
	};
	const std::size_t as_they_are = count_same(1).first;
	const auto [same, of] = count_same(M_PI / 180);
	return same >= kFewest && 3 * same > 2 * of && 2 * as_they_are < same;
}
}  // namespace d2s1r::app
