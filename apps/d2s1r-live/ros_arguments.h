// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What follows --ros-args on a command line, with the meaning that it has for every node of ROS 2.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace d2s1r::live
{
/// Says what the names of a node's topics become.
class Names
{
   public:
	std::string node = "d2s1r_live";
	std::string space = "/";  //!< namespace; it begins with a slash and ends without one, unless it is the root

	/// Returns the full name of a topic: a relative one is in the namespace, "~" is the node, and the first rule that
	/// fits decides. \throws UserError (kWrongUse) if ROS has no topics of such names
	std::string resolve(const std::string& topic) const;

	/// Adds a rule. Both of its sides may be relative.
	void add_rule(std::string from, std::string to) { rules_.emplace_back(std::move(from), std::move(to)); }

	std::string full() const { return (space == "/" ? "" : space) + "/" + node; }

   private:
	std::string expand(const std::string& topic) const;

	std::vector<std::pair<std::string, std::string>> rules_;
};

/// A parameter of the node, and the texts of its values: one, or those of a list.
struct Parameter
{
	std::string name;
	std::vector<std::string> values;
};

struct RosArguments
{
	std::vector<std::string> words;  //!< that are the program's own
	Names names;
	std::vector<Parameter> parameters;  //!< in their order: a later one replaces an earlier one
	bool errors_only = false;           //!< --log-level error or fatal
	std::vector<std::string> notes;     //!< for people: what is understood, and has no effect here
};

/// Takes a command line apart. \throws UserError (kWrongUse)
RosArguments parse_ros_arguments(int argc, char** argv);
}  // namespace d2s1r::live
