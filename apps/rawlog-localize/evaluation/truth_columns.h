// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/ground_truth.h"

namespace d2s1r::app
{
/// Returns the parts of a line.
std::vector<std::string> split(const std::string& line, char separator);

/// Returns the words of a line with blanks between them.
std::vector<std::string> words_of(const std::string& line);

/// Returns no value if a text is not a finite number, and nothing else.
std::optional<double> parse_number(const std::string& text);

/// Returns whether a program wrote this where it had no number: nothing, nan, none or null.
bool is_no_number(const std::string& text);

/// Returns the yaw of a rotation [rad], or NaN if the quaternion is none.
double yaw_of_quaternion(double x, double y, double z, double w);

/// Knows where the columns of a table are that make a pose, and their units.
class Columns
{
   public:
	/// Returns no value if the line names no columns. Commas, semicolons or tabs are between them, in a comment also
	/// blanks.
	static std::optional<Columns> parse(const std::string& line);

	/// Returns whether the columns are named in a comment with blanks between them, which may as well be a remark.
	bool may_be_remark() const { return separator_ == ' '; }

	/// Returns the number of columns.
	std::size_t count() const { return count_; }

	/// Returns the parts of a line below the names.
	std::vector<std::string> values_of(const std::string& line) const;

	/// Returns what is missing for a pose, or an empty text if nothing is.
	std::string missing() const;

	/// Returns which column of a pose has a unit that nobody knows; an empty text if none has.
	const std::string& wrong_unit() const { return wrong_unit_; }

	/// Returns whether the row lacks a pose because a number is empty or NaN.
	bool is_empty(const std::vector<std::string>& row) const;

	/// Returns no value if a number of the pose is missing.
	std::optional<TimedPose> parse_row(const std::vector<std::string>& row) const;

	/// Says what is wrong with a row that parse_row() returns no value for.
	std::string wrong_value(const std::vector<std::string>& row) const;

   private:
	/// Makes one time of a time in two parts.
	void join_seconds();

	struct Place
	{
		std::size_t column;
		double factor;  //!< by which its numbers are multiplied to be s, m or rad
	};
	std::map<std::string, Place> places_;  //!< by meaning
	std::string wrong_unit_;
	char separator_ = ',';
	std::size_t count_ = 0;
};
}  // namespace d2s1r::app
