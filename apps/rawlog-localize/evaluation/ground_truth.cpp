// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/ground_truth.h"

#include "cli/errors.h"

#include <logs/log.h>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>

namespace d2s1r::app
{
namespace
{
/// Returns the yaw of a rotation [rad].
double yaw_of_quaternion(double x, double y, double z, double w)
{
	return std::atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z);
}

std::vector<std::string> split(const std::string& line, char separator)
{
	std::vector<std::string> parts;
	std::istringstream in(line + separator);
	for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
	return parts;
}

std::optional<double> parse_number(const std::string& text)
{
	std::istringstream in(text);
	double value = 0;
	std::string rest;
	if (!(in >> value) || (in >> rest) || !std::isfinite(value)) return std::nullopt;
	return value;
}

/// Parses a line of numbers with blanks between them, whose count tells what they are.
std::optional<TimedPose> parse_line(const std::string& line)
{
	std::istringstream text(line);
	std::vector<double> values;
	for (double value = 0; text >> value;) values.push_back(value);
	if (!text.eof()) return std::nullopt;
	for (const double value : values)
		if (!std::isfinite(value)) return std::nullopt;
	TimedPose pose;
	if (values.size() == 4) pose.pose.phi = values[3];
	if (values.size() == 7) pose.pose.phi = values[4];
	if (values.size() == 8) pose.pose.phi = yaw_of_quaternion(values[4], values[5], values[6], values[7]);
	if (values.size() != 4 && values.size() != 7 && values.size() != 8) return std::nullopt;
	pose.timestamp = values[0];
	pose.pose.x = values[1];
	pose.pose.y = values[2];
	return pose;
}

/// Knows where the columns of a table are that make a pose.
class Columns
{
   public:
	/// Returns no value if the line names no columns.
	static std::optional<Columns> parse(const std::string& line)
	{
		const auto is_letter = [](unsigned char c) { return std::isalpha(c) != 0; };
		if (line.find(',') == std::string::npos || std::none_of(line.begin(), line.end(), is_letter))
			return std::nullopt;
		Columns columns;
		const auto names = split(line, ',');
		for (std::size_t i = 0; i < names.size(); i++) columns.places_.emplace(meaning_of(names[i]), i);
		return columns;
	}

	/// Returns what is missing for a pose, or an empty text if nothing is.
	std::string missing() const
	{
		for (const char* meaning : {"time", "x", "y"})
			if (places_.count(meaning) == 0) return meaning;
		const bool has_quaternion =
		    places_.count("qx") + places_.count("qy") + places_.count("qz") + places_.count("qw") == 4;
		return places_.count("phi") == 0 && !has_quaternion ? "phi, yaw, theta or a quaternion" : "";
	}

	/// Returns whether the row lacks a pose because a field is empty.
	bool is_empty(const std::vector<std::string>& row) const
	{
		const auto is_blank = [](const std::string& text)
		{ return text.find_first_not_of(" \t\r") == std::string::npos; };
		return places_.at("x") < row.size() && is_blank(row[places_.at("x")]);
	}

	std::optional<TimedPose> parse_row(const std::vector<std::string>& row) const
	{
		std::map<std::string, double> values;
		for (const auto& [meaning, place] : places_)
		{
			if (meaning.empty()) continue;
			const auto value = place < row.size() ? parse_number(row[place]) : std::nullopt;
			if (!value) return std::nullopt;
			values[meaning] = *value;
		}
		constexpr double kLeastNanoseconds = 1e16;  // which would be 300 million years in s
		if (values["time"] > kLeastNanoseconds) values["time"] *= 1e-9;
		const bool has_phi = values.count("phi") > 0;
		const double phi =
		    has_phi ? values["phi"] : yaw_of_quaternion(values["qx"], values["qy"], values["qz"], values["qw"]);
		return TimedPose{values["time"], {values["x"], values["y"], phi}};
	}

   private:
	/// "time", "x", "y", "phi", "qx" ... "qw", or empty if it is none of them. Names may have units in brackets, and
	/// what they belong to in front: "#timestamp [ns]", "pose.position.x", "q_RS_w []".
	static std::string meaning_of(std::string name)
	{
		name = name.substr(0, name.find('['));
		std::string lower;
		for (const unsigned char c : name)
			if (std::isalnum(c) || c == '.' || c == '_') lower += static_cast<char>(std::tolower(c));
		const auto last_dot = lower.find_last_of("._");
		const std::string last = lower.substr(last_dot + 1);  // all of it if there is none
		const std::string before = last_dot == std::string::npos ? "" : lower.substr(0, last_dot);
		const auto holds = [&](const char* word) { return before.find(word) != std::string::npos; };
		if (lower == "t" || lower.rfind("time", 0) == 0 || lower == "stamp" || lower == "secs" || lower == "sec")
			return "time";
		if (last == "phi" || last == "yaw" || last == "theta" || last == "heading") return "phi";
		if (last.size() == 2 && last[0] == 'q' && std::string("xyzw").find(last[1]) != std::string::npos) return last;
		if (last.size() != 1 || std::string("xyzw").find(last[0]) == std::string::npos) return "";
		if (before.rfind("q", 0) == 0 || holds("orientation") || holds("rotation")) return "q" + last;
		const bool is_position =
		    before.empty() || before.rfind("p", 0) == 0 || holds("position") || holds("translation");
		return is_position && last != "z" && last != "w" ? last : "";
	}

	std::map<std::string, std::size_t> places_;
};

[[noreturn]] void throw_wrong_line(const std::string& file, int number, const std::string& what)
{
	throw UserError(kBadInput, file, "line " + std::to_string(number) + " " + what + "; correct it");
}

/// Reads the poses of a file line by line.
class TruthReader
{
   public:
	explicit TruthReader(const std::string& file) : file_(file) {}

	void read(const std::string& line)
	{
		number_++;
		const auto first = line.find_first_not_of(" \t\r");
		if (first == std::string::npos) return;
		const bool is_comment = line[first] == '%' || line[first] == '#';
		const auto columns = truth_.empty() && !columns_ ? Columns::parse(line) : std::nullopt;
		if (columns)
		{
			const std::string missing = columns->missing();
			if (missing.empty()) columns_ = columns;
			if (missing.empty() || is_comment) return;
			throw_wrong_line(file_, number_, "names no column for " + missing);
		}
		if (is_comment) return;
		if (columns_)
			read_row(split(line, ','));
		else if (const auto pose = parse_line(line))
			truth_.push_back(*pose);
		else
			throw_wrong_line(
			    file_, number_,
			    "is neither 'time x y phi' nor 'time x y z yaw pitch roll' nor 'time x y z qx qy qz qw', and no line "
			    "above names columns with commas between them");
	}

	const GroundTruth& truth() const { return truth_; }

   private:
	void read_row(const std::vector<std::string>& row)
	{
		if (columns_->is_empty(row)) return;
		const auto pose = columns_->parse_row(row);
		if (!pose) throw_wrong_line(file_, number_, "lacks a number in a column of the pose");
		truth_.push_back(*pose);
	}

	std::string file_;
	int number_ = 0;
	std::optional<Columns> columns_;  //!< if the file has names of columns
	GroundTruth truth_;
};
}  // namespace

GroundTruth load_ground_truth(const std::string& file)
{
	std::ifstream in(file);
	if (!in) throw UserError(kBadInput, file, "cannot be opened; check the path of the ground truth");
	errno = 0;
	TruthReader reader(file);
	for (std::string line; std::getline(in, line);) reader.read(line);
	if (in.bad())  // else the lines before an error would count as all
		throw UserError(
		    kBadInput, file,
		    std::string("cannot be read to its end (") + (errno ? std::strerror(errno) : "read error") +
		        "); check that it is a file, and copy it again");
	if (reader.truth().empty())
		throw UserError(kBadInput, file, "holds no pose; name a file with lines 'time x y phi'");
	return reader.truth();
}

GroundTruth read_ground_truth(const std::string& name, const std::string& log)
{
	const std::string prefix = "topic:";
	if (name.rfind(prefix, 0) != 0) return load_ground_truth(name);
	GroundTruth truth;
	for (const auto& [time, pose] : logs::read_odometry_of_topic(log, name.substr(prefix.size())))
		truth.push_back({time, pose});
	return truth;
}
}  // namespace d2s1r::app
