// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/ground_truth.h"

#include <base/errors.h>
#include <mrpt/math/wrap2pi.h>
#include <shell/errors.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <sstream>

#include "cli/command_line.h"

namespace d2s1r::app
{
namespace
{
using mrpt::math::TPose2D;

std::vector<std::string> split(const std::string& line, char separator)
{
	std::vector<std::string> parts;
	std::istringstream in(separator == ' ' ? line : line + separator);
	const auto next = [&](std::string& part)
	{ return separator == ' ' ? bool(in >> part) : bool(std::getline(in, part, separator)); };
	for (std::string part; next(part);) parts.push_back(part);
	return parts;
}

std::string lower_word(const std::string& text)
{
	std::string word;
	for (const char c : text)
		if (const auto code = static_cast<unsigned char>(c); std::isspace(code) == 0)
			word += static_cast<char>(std::tolower(code));
	return word;
}

/// Returns no value if a text is not a finite number, and nothing else.
std::optional<double> parse_number(const std::string& text)
{
	std::istringstream in(text);
	double value = 0;
	std::string rest;
	if (!(in >> value) || (in >> rest) || !std::isfinite(value)) return std::nullopt;
	return value;
}

/// Returns whether a program wrote this where it had no number.
bool is_no_number(const std::string& text)
{
	const std::string word = lower_word(text);
	return word.empty() || word == "nan" || word == "-nan" || word == "none" || word == "null";
}

/// Returns the yaw of a rotation [rad], or NaN if the quaternion is none.
double yaw_of_quaternion(double x, double y, double z, double w)
{
	const double length = std::hypot(std::hypot(x, y), std::hypot(z, w));
	constexpr double kRounded = 0.1;  // [-] that the length of a rotation may be off 1
	if (!(std::abs(length - 1) < kRounded)) return std::numeric_limits<double>::quiet_NaN();
	x /= length, y /= length, z /= length, w /= length;
	return std::atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z);
}

/// Says by what the numbers of a unit are multiplied to be s, m or rad.
const std::map<std::string, double> kUnits = {
    {"", 1},
    {"s", 1},
    {"ms", 1e-3},
    {"us", 1e-6},
    {"ns", 1e-9},
    {"m", 1},
    {"cm", 0.01},
    {"mm", 1e-3},
    {"rad", 1},
    {"deg", M_PI / 180},
    {"degrees", M_PI / 180},
    {"\xC2\xB0", M_PI / 180}};

/// Returns what a column holds of a pose, by its name in lower case such as "pose.orientation.x": time, nanoseconds (of
/// a time in two parts), x, y, phi, or qx to qw; an empty text if nothing.
std::string meaning_of(const std::string& name)
{
	const std::string last = name.substr(name.find_last_of("._/") + 1);
	const std::string before = name.substr(0, name.size() - last.size());
	const auto is_one_of = [&](std::initializer_list<const char*> words)
	{ return std::find(words.begin(), words.end(), last) != words.end(); };
	const auto is_in = [&](const char* word) { return before.find(word) != std::string::npos; };
	if (is_one_of({"t", "time", "timestamp", "stamp"})) return "time";
	if (is_in("stamp") && is_one_of({"sec", "secs"})) return "time";
	if (is_in("stamp") && is_one_of({"nanosec", "nsec", "nsecs"})) return "nanoseconds";
	if (is_one_of({"phi", "yaw", "theta", "heading"})) return "phi";
	if (is_one_of({"qx", "qy", "qz", "qw"})) return last;
	if (is_one_of({"tx", "ty"})) return last.substr(1);
	if (!is_one_of({"x", "y", "z", "w"})) return "";
	if (before[0] == 'q' || is_in("orientation") || is_in("rotation")) return "q" + last;
	const bool is_position = before.empty() || before[0] == 'p' || is_in("position") || is_in("translation");
	return is_position && is_one_of({"x", "y"}) ? last : "";
}

/// Knows where the columns of a table are that make a pose, and their units.
struct Columns
{
	struct Place
	{
		std::size_t column;
		double factor;  //!< see kUnits
	};
	std::map<std::string, Place> places{};  //!< by meaning
	char separator = ' ';
	std::size_t count = 0;
	std::string wrong_unit{};  //!< empty: none has one

	/// \param line names the columns, with commas, semicolons, tabs or blanks between them
	explicit Columns(std::string line)
	{
		for (const char other : {'\t', ';', ','})
			if (line.find(other) != std::string::npos) separator = other;
		for (std::size_t at;
		     (at = line.find(" [")) != std::string::npos || (at = line.find(" (")) != std::string::npos;)
			line.erase(at, 1);  // so that a unit belongs to the name before it
		for (const std::string& text : split(line, separator)) add(lower_word(text));
	}

	void add(std::string name)
	{
		const auto bracket = std::min(name.find_first_of("[("), name.size());
		std::string unit = name.substr(bracket).substr(0, name.find_first_of("])", bracket) - bracket);
		unit.erase(0, 1);
		name = name.substr(0, bracket);
		// "yaw_deg" tells the unit, too.
		if (const auto last = name.rfind('_'); last != std::string::npos && kUnits.count(name.substr(last + 1)) > 0)
			unit = name.substr(last + 1), name.resize(last);
		const std::string meaning = meaning_of(name);
		const Place place{count++, kUnits.count(unit) > 0 ? kUnits.at(unit) : 1};
		if (meaning.empty()) return;
		if (kUnits.count(unit) == 0)
			wrong_unit = "has a column '" + name + "' with the unit '" + unit +
			             "'; give times in s, ms, us or ns, lengths in m, cm or mm, and angles in rad or deg";
		// The stamp of a message goes before the time of its recording.
		if (meaning == "time" && name.find("stamp") != std::string::npos) places.erase(meaning);
		places.emplace(meaning, place);
	}

	/// Returns what is missing for a pose, or an empty text if nothing is.
	std::string missing() const
	{
		for (const char* meaning : {"time", "x", "y"})
			if (places.count(meaning) == 0) return meaning;
		const bool has_quaternion =
		    places.count("qx") + places.count("qy") + places.count("qz") + places.count("qw") == 4;
		return places.count("phi") == 0 && !has_quaternion ? "phi, yaw, theta or a quaternion" : "";
	}
};

class TruthReader
{
   public:
	explicit TruthReader(const std::string& file) : file_(file) {}

	void read(std::string line)
	{
		if (++number_ == 1 && line.rfind("\xEF\xBB\xBF", 0) == 0) line.erase(0, 3);  // a byte order mark
		if (number_ == 1 && (line.rfind("\xFF\xFE", 0) == 0 || line.rfind("\xFE\xFF", 0) == 0))
			throw UserError(kBadInput, file_, "is a text in UTF-16; save it as UTF-8");
		const auto first = line.find_first_not_of(" \t\r");
		if (first == std::string::npos) return;
		const bool is_comment = line[first] == '%' || line[first] == '#';
		if (truth_.empty() && (is_comment || !columns_))
		{
			line.erase(0, line.find_first_not_of("%# \t"));
			const Columns columns(line);
			if (columns.missing().empty()) return void(columns_ = columns);
			if (!is_comment && columns.separator != ' ' && !parse_number(split(line, columns.separator).front()))
				refuse("names no column for " + columns.missing());
		}
		if (!is_comment) read_row(split(line, columns_ ? columns_->separator : ' '));
	}

	const GroundTruth& truth() const { return truth_; }

   private:
	[[noreturn]] void refuse(const std::string& what) const
	{
		throw UserError(kBadInput, file_, "line " + std::to_string(number_) + " " + what + "; correct it");
	}

	/// Returns the columns of a line without names, by their number.
	Columns columns_of(std::size_t count) const
	{
		for (const char* names : {"time x y phi", "time x y z yaw pitch roll", "time x y z qx qy qz qw"})
			if (const Columns columns(names); columns.count == count) return columns;
		refuse(
		    "is neither 'time x y phi' nor 'time x y z yaw pitch roll' nor 'time x y z qx qy qz qw', and no line above "
		    "names columns with commas between them");
	}

	void read_row(const std::vector<std::string>& row)
	{
		const bool is_blank = !columns_ || columns_->separator == ' ';
		const bool has_other_count = !columns_ || columns_->count != row.size();
		// Words of a comment that are as many as the numbers below it are their names.
		if (is_blank && has_other_count && truth_.empty())
			columns_ = columns_of(row.size());
		else if (is_blank && has_other_count)
			refuse(
			    "has " + std::to_string(row.size()) + " numbers, and the lines above have " +
			    std::to_string(columns_->count));
		if (!columns_->wrong_unit.empty()) refuse(columns_->wrong_unit);
		std::map<std::string, double> values;
		std::string wrong;
		for (const auto& [meaning, place] : columns_->places)
		{
			const std::string text = place.column < row.size() ? row[place.column] : "";
			const auto value = parse_number(text);
			if (!value && meaning != "time" && place.column < row.size() && is_no_number(text)) return;
			if (!value && wrong.empty()) wrong = "has '" + text + "' as " + meaning + ", which is no number";
			values[meaning] = place.factor * value.value_or(0);
		}
		if (!wrong.empty()) refuse(wrong);
		const double phi = values.count("phi") > 0
		                       ? values["phi"]
		                       : yaw_of_quaternion(values["qx"], values["qy"], values["qz"], values["qw"]);
		if (std::isnan(phi)) refuse("has a quaternion that is no rotation");
		add({values["time"] + 1e-9 * values["nanoseconds"], {values["x"], values["y"], phi}});
	}

	void add(TimedPose line)
	{
		// A time tells its unit: the least in ms that counts here is in 1973, and would be in the year 5138 in s.
		constexpr double kLeastNanoseconds = 1e16, kLeastMicroseconds = 1e14, kLeastMilliseconds = 1e11;
		line.time *= line.time > kLeastNanoseconds    ? 1e-9
		             : line.time > kLeastMicroseconds ? 1e-6
		             : line.time > kLeastMilliseconds ? 1e-3
		                                              : 1;
		constexpr double kFarthest = 1e7;  // [m] a quarter of the way around the earth
		if (!(std::abs(line.robot.x) <= kFarthest && std::abs(line.robot.y) <= kFarthest))
			refuse("has a position that is more than 10,000 km from the origin of the map");
		truth_.push_back(line);
	}

	std::string file_;
	int number_ = 0;
	std::optional<Columns> columns_;
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

logs::PosesInFrame read_ground_truth(
    const std::string& name, const std::string& log, const std::string& label, const std::string& damage)
{
	const std::string source = name.substr(name.find(':') + 1);
	if (name.rfind(kFramePrefix, 0) == 0) return logs::read_poses_of_frame(log, source, label, damage);
	if (name.rfind(kTopicPrefix, 0) == 0) return logs::read_poses_of_topic(log, source, damage);
	return {load_ground_truth(name), ""};
}

namespace
{
/// Returns the first line that is not before a time. \param lines by increasing time
GroundTruth::const_iterator first_from(const GroundTruth& lines, double time)
{
	return std::lower_bound(
	    lines.begin(), lines.end(), time, [](const TimedPose& line, double limit) { return line.time < limit; });
}

/// Returns the pose between the lines before and after a time; no value if there are none, or if they are further apart
/// than `greatest_gap` [s].
std::optional<TPose2D> pose_at(const GroundTruth& lines, double time, double greatest_gap)
{
	const auto after = first_from(lines, time);
	if (after == lines.end() || (after == lines.begin() && after->time > time)) return std::nullopt;
	if (after->time == time) return after->robot;
	const auto before = after - 1;
	const double gap = after->time - before->time;
	if (gap > greatest_gap) return std::nullopt;
	return pose_between(before->robot, after->robot, (time - before->time) / gap);
}

double angle_between(const TPose2D& a, const TPose2D& b)
{
	return std::abs(mrpt::math::wrapToPi(a.phi - b.phi));
}

/// Returns how far [s] the clock of the ground truth is ahead, 0 if nothing makes the fit much better.
double find_offset(const GroundTruth& lines, const std::vector<KeptFrame>& frames)
{
	constexpr std::size_t kLeastFrames = 5, kMostFrames = 500;  // [-] evenly spread: enough, however long the log is
	constexpr double kMuchBetter = 0.5;                         // of the mean error
	std::vector<const KeptFrame*> localized;
	for (const KeptFrame& frame : frames)
		if (frame.localized()) localized.push_back(&frame);
	if (localized.size() < kLeastFrames) return 0;
	// The sum of the errors of position and yaw, each of which counts for at most 1 m or 1 rad.
	const auto error = [&](double offset)
	{
		double sum = 0;
		for (std::size_t i = 0; i < localized.size(); i += 1 + localized.size() / kMostFrames)
		{
			const TPose2D& pose = localized[i]->pose;
			const auto truth = pose_at(lines, localized[i]->timestamp + offset, HUGE_VAL);
			sum += truth ? std::min(1.0, std::hypot(pose.x - truth->x, pose.y - truth->y)) +
			                   std::min(1.0, angle_between(pose, *truth))
			             : 2.0;
		}
		return sum;
	};
	const double without = error(0);
	double best = 0, least = without;
	for (const double step : {0.05, 0.005, 0.0005})  // [s] the first for up to 5 s, each next around the best so far
	{
		const double middle = best;
		const int steps = step == 0.05 ? 100 : 10;
		for (int i = -steps; i <= steps; i++)
			if (const double here = error(middle + i * step); here < least) least = here, best = middle + i * step;
	}
	return least < kMuchBetter * without ? best : 0;
}

bool are_headings_degrees(GroundTruth lines, const std::vector<KeptFrame>& frames)
{
	constexpr double kTurn = 2 * M_PI, kSame = 5 * M_PI / 180;  // [rad]
	constexpr std::size_t kFewest = 5;                          // [-] frames that show something
	const auto is_beyond = [](const TimedPose& line) { return std::abs(line.robot.phi) > kTurn; };
	if (std::none_of(lines.begin(), lines.end(), is_beyond)) return false;
	std::size_t of = 0, same_as_they_are = 0, same = 0;
	const auto count = [&](std::size_t& counter)
	{
		of = 0;
		for (const KeptFrame& frame : frames)
		{
			const auto pose = frame.localized() ? pose_at(lines, frame.timestamp, kGreatestGap) : std::nullopt;
			of += pose.has_value();
			counter += pose && angle_between(frame.pose, *pose) < kSame;
		}
	};
	count(same_as_they_are);
	for (TimedPose& line : lines) line.robot.phi *= M_PI / 180;
	count(same);
	return same >= kFewest && 3 * same > 2 * of && 2 * same_as_they_are < same;
}
}  // namespace

AlignedTruth align_truth(const GroundTruth& truth, const std::vector<KeptFrame>& frames)
{
	AlignedTruth aligned{truth};
	GroundTruth& lines = aligned.lines;
	std::stable_sort(
	    lines.begin(), lines.end(), [](const TimedPose& a, const TimedPose& b) { return a.time < b.time; });
	aligned.offset = find_offset(lines, frames);
	for (TimedPose& line : lines) line.time -= aligned.offset;
	aligned.is_in_degrees = are_headings_degrees(lines, frames);
	GroundTruth of_frames;
	for (const KeptFrame& frame : frames)
	{
		const auto line = first_from(lines, frame.timestamp - kSameTime);
		const bool has_line = line != lines.end() && line->time <= frame.timestamp + kSameTime;
		const auto pose = has_line ? std::nullopt : pose_at(lines, frame.timestamp, kGreatestGap);
		if (has_line) of_frames.push_back(*line);
		if (pose) of_frames.push_back({frame.timestamp, *pose});
		aligned.interpolated += pose.has_value();
	}
	if (aligned.interpolated > 0) lines = std::move(of_frames);
	return aligned;
}
}  // namespace d2s1r::app
