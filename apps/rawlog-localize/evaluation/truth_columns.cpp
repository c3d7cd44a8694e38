// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/truth_columns.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <sstream>

namespace d2s1r::app
{
namespace
{
/// Returns a text in lower case, without blanks around it.
std::string lower_word(const std::string& text)
{
	std::string word;
	for (const char c : text)
		if (const auto byte = static_cast<unsigned char>(c); std::isspace(byte) == 0)
			word += static_cast<char>(std::tolower(byte));
	return word;
}

/// Says what a unit that the name of a column holds is worth, or that nobody knows it.
struct Unit
{
	const char* name;
	const char* of;  //!< "time", "length" or "angle"
	double factor;   //!< to s, m or rad
};

constexpr double kDegree = M_PI / 180;
const std::vector<Unit> kUnits = {
    {"s", "time", 1},
    {"sec", "time", 1},
    {"secs", "time", 1},
    {"seconds", "time", 1},
    {"ms", "time", 1e-3},
    {"us", "time", 1e-6},
    {"ns", "time", 1e-9},
    {"nsec", "time", 1e-9},
    {"nanosec", "time", 1e-9},
    {"m", "length", 1},
    {"metre", "length", 1},
    {"metres", "length", 1},
    {"meter", "length", 1},
    {"meters", "length", 1},
    {"cm", "length", 1e-2},
    {"mm", "length", 1e-3},
    {"rad", "angle", 1},
    {"radian", "angle", 1},
    {"radians", "angle", 1},
    {"deg", "angle", kDegree},
    {"degree", "angle", kDegree},
    {"degrees", "angle", kDegree},
    {"\xC2\xB0", "angle", kDegree}};

/// Returns the last of the parts of a name that dots, slashes and underscores separate.
std::string last_part(const std::string& name)
{
	return name.substr(name.find_last_of("._") + 1);  // all of it if there is none
}

/// The name of a column, taken apart.
struct ColumnName
{
	std::string name;  //!< lower case; what it belongs to is in front, with dots or underscores between
	std::string unit;  //!< in brackets, or after the last underscore; empty: not told

	explicit ColumnName(const std::string& text)
	{
		const auto bracket = text.find_first_of("[(");
		if (bracket != std::string::npos)
			unit = lower_word(text.substr(bracket + 1, text.find_first_of("])", bracket) - bracket - 1));
		for (const char c : text.substr(0, bracket))
			if (const auto byte = static_cast<unsigned char>(c); std::isalnum(byte) || c == '.' || c == '_' || c == '/')
				name += c == '/' ? '.' : static_cast<char>(std::tolower(byte));
		name.erase(0, name.find_first_not_of("._"));
		// "yaw_deg" tells the unit, too; "stamp_sec" does not, for a part of the stamp is called so.
		const std::string last = last_part(name);
		const bool is_angle = last == "deg" || last == "rad" || last == "degrees" || last == "radians";
		if (unit.empty() && last.size() < name.size() && (is_angle || last == "ns" || last == "ms" || last == "us"))
		{
			unit = last;
			name.resize(name.size() - last.size() - 1);
		}
	}

	/// Returns "time", "seconds" and "nanoseconds" of a time in two parts, "x", "y", "phi", "qx" ... "qw", or nothing
	/// if it is none of them.
	std::string meaning() const
	{
		const std::string last = last_part(name);
		const std::string before = last.size() < name.size() ? name.substr(0, name.size() - last.size() - 1) : "";
		const auto holds = [&](const char* word) { return before.find(word) != std::string::npos; };
		const bool is_in_stamp = before.empty() || holds("stamp") || holds("time");
		if (is_in_stamp && (last == "nanosec" || last == "nsec" || last == "nsecs" || last == "nanoseconds"))
			return "nanoseconds";
		if (is_in_stamp && (last == "secs" || last == "sec" || last == "seconds")) return "seconds";
		if (name == "t" || name.rfind("time", 0) == 0 || last == "stamp") return "time";
		if (last == "phi" || last == "yaw" || last == "theta" || last == "heading") return "phi";
		if (last == "tx" || last == "ty") return last.substr(1);
		if (last.size() == 2 && last[0] == 'q' && std::string("xyzw").find(last[1]) != std::string::npos) return last;
		if (last.size() != 1 || std::string("xyzw").find(last[0]) == std::string::npos) return "";
		if (before.rfind("q", 0) == 0 || holds("orientation") || holds("rotation")) return "q" + last;
		const bool is_position =
		    before.empty() || before.rfind("p", 0) == 0 || holds("position") || holds("translation");
		return is_position && last != "z" && last != "w" ? last : "";
	}

	/// Returns by what the numbers of the column are multiplied; no value if nobody knows the unit.
	std::optional<double> factor() const
	{
		const std::string what = meaning();
		const std::string kind = what == "time" || what == "seconds" ? "time" : what == "phi" ? "angle" : "length";
		if (unit.empty() || what.empty() || what[0] == 'q' || what == "nanoseconds") return 1;
		for (const Unit& known : kUnits)
			if (unit == known.name && kind == known.of) return known.factor;
		return std::nullopt;
	}
};
}  // namespace

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

bool is_no_number(const std::string& text)
{
	const std::string word = lower_word(text);
	return word.empty() || word == "nan" || word == "-nan" || word == "none" || word == "null";
}

double yaw_of_quaternion(double x, double y, double z, double w)
{
	const double length = std::hypot(std::hypot(x, y), std::hypot(z, w));
	constexpr double kRounded = 0.1;  // [-] that the length of a rotation may be off 1
	if (!(std::abs(length - 1) < kRounded)) return std::numeric_limits<double>::quiet_NaN();
	x /= length, y /= length, z /= length, w /= length;
	return std::atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z);
}

namespace
{
/// Returns the names of columns in a comment with blanks between them, such as "# time x y yaw [deg]"; what stands in
/// brackets belongs to the name before it, and a remark in brackets ends the names.
std::vector<std::string> names_in_comment(const std::string& line)
{
	std::vector<std::string> names;
	for (const std::string& word : words_of(line.substr(line.find_first_not_of(" \t#%"))))
	{
		const bool is_in_brackets = word.front() == '[' || word.front() == '(';
		if (is_in_brackets && (names.empty() || word.find_first_of("])") == std::string::npos)) break;
		if (is_in_brackets)
			names.back() += word;
		else
			names.push_back(word);
	}
	return names;
}
}  // namespace

std::vector<std::string> words_of(const std::string& line)
{
	std::istringstream in(line);
	std::vector<std::string> words;
	for (std::string word; in >> word;) words.push_back(word);
	return words;
}

std::vector<std::string> Columns::values_of(const std::string& line) const
{
	return separator_ == ' ' ? words_of(line) : split(line, separator_);
}

std::optional<Columns> Columns::parse(const std::string& line)
{
	const auto is_letter = [](unsigned char c) { return std::isalpha(c) != 0; };
	const auto first = line.find_first_not_of(" \t#%");
	if (first == std::string::npos || std::none_of(line.begin(), line.end(), is_letter)) return std::nullopt;
	Columns columns;
	columns.separator_ = ' ';
	for (const char separator : {'\t', ';', ','})
		if (line.find(separator, first) != std::string::npos) columns.separator_ = separator;
	const bool is_comment = line.find_first_of("#%") < first;
	if (columns.separator_ == ' ' && !is_comment) return std::nullopt;
	const auto names = columns.separator_ == ' ' ? names_in_comment(line) : split(line, columns.separator_);
	columns.count_ = names.size();
	bool has_stamp = false;  // which goes before the time of a recording
	for (std::size_t i = 0; i < names.size(); i++)
	{
		const ColumnName name(names[i]);
		if (name.meaning().empty()) continue;
		const auto factor = name.factor();
		if (!factor)
			columns.wrong_unit_ = "has a column '" + name.name + "' with the unit '" + name.unit +
			                      "'; give times in s, ms, us or ns, lengths in m, cm or mm, and angles in rad or deg";
		const Place place{i, factor.value_or(1)};
		const bool is_stamp = name.meaning() == "time" && name.name.find("stamp") != std::string::npos;
		if (is_stamp && !has_stamp)
			columns.places_[name.meaning()] = place;
		else
			columns.places_.emplace(name.meaning(), place);
		has_stamp = has_stamp || is_stamp;
	}
	columns.join_seconds();
	return columns;
}

void Columns::join_seconds()
{
	if (places_.count("seconds") == 0)
		places_.erase("nanoseconds");
	else if (places_.count("nanoseconds") > 0 || places_.count("time") == 0)
		places_["time"] = places_["seconds"];
	places_.erase("seconds");
}

std::string Columns::missing() const
{
	for (const char* meaning : {"time", "x", "y"})
		if (places_.count(meaning) == 0) return meaning;
	const bool has_quaternion =
	    places_.count("qx") + places_.count("qy") + places_.count("qz") + places_.count("qw") == 4;
	return places_.count("phi") == 0 && !has_quaternion ? "phi, yaw, theta or a quaternion" : "";
}

bool Columns::is_empty(const std::vector<std::string>& row) const
{
	return std::any_of(
	    places_.begin(), places_.end(),
	    [&](const auto& item)
	    { return item.first != "time" && item.second.column < row.size() && is_no_number(row[item.second.column]); });
}

std::string Columns::wrong_value(const std::vector<std::string>& row) const
{
	for (const auto& [meaning, place] : places_)
	{
		if (place.column >= row.size()) return "has no column for " + meaning;
		if (!parse_number(row[place.column]))
			return "has '" + row[place.column] + "' as " + meaning + ", which is no number";
	}
	return "has a quaternion that is no rotation";
}

std::optional<TimedPose> Columns::parse_row(const std::vector<std::string>& row) const
{
	std::map<std::string, double> values;
	for (const auto& [meaning, place] : places_)
	{
		const auto value = place.column < row.size() ? parse_number(row[place.column]) : std::nullopt;
		if (!value) return std::nullopt;
		values[meaning] = place.factor * *value;
	}
	if (const auto rest = values.find("nanoseconds"); rest != values.end()) values["time"] += 1e-9 * rest->second;
	const bool has_phi = values.count("phi") > 0;
	const double phi =
	    has_phi ? values["phi"] : yaw_of_quaternion(values["qx"], values["qy"], values["qz"], values["qw"]);
	if (std::isnan(phi)) return std::nullopt;
	return TimedPose{values["time"], {values["x"], values["y"], phi}};
}
}  // namespace d2s1r::app
