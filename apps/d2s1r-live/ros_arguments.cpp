// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros_arguments.h"

#include <base/yaml_file.h>
#include <shell/errors.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <stdexcept>

namespace d2s1r::live
{
namespace
{
constexpr const char* kAssigned = ":=";
constexpr const char* kNotAName = "is no name in ROS; write letters, digits and _, which begin with no digit";

[[noreturn]] void refuse_word(const std::string& word, const std::string& what)
{
	throw app::UserError(app::kWrongUse, word, what);
}

std::pair<std::string, std::string> parse_assignment(const std::string& flag, const std::string& text)
{
	const auto at = text.find(kAssigned);
	if (at == std::string::npos || at == 0 || at + 2 == text.size())
		refuse_word(flag, "'" + text + "' has another form; write NAME:=VALUE");
	return {text.substr(0, at), text.substr(at + 2)};
}

std::vector<std::string> tokens_of(const std::string& path)
{
	std::vector<std::string> tokens;
	for (std::size_t start = 0; start <= path.size();)
	{
		const auto end = std::min(path.find('/', start), path.size());
		if (end > start) tokens.push_back(path.substr(start, end - start));
		start = end + 1;
	}
	return tokens;
}

bool is_token(const std::string& text)
{
	const auto fits_in = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
	return !text.empty() && std::isdigit(static_cast<unsigned char>(text.front())) == 0 &&
	       std::all_of(text.begin(), text.end(), fits_in);
}

bool is_topic(const std::string& text)
{
	const auto tokens = tokens_of(text);
	std::string whole;
	for (const std::string& token : tokens) whole += "/" + token;
	return text == whole && std::all_of(tokens.begin(), tokens.end(), is_token);
}

/// Returns whether a node's full name fits a pattern, in which * stands for one part and ** for any number of them.
template <class Iterator>
bool fits(Iterator pattern, Iterator pattern_end, Iterator name, Iterator name_end)
{
	if (pattern == pattern_end) return name == name_end;
	if (*pattern == "**")
		return fits(pattern + 1, pattern_end, name, name_end) ||
		       (name != name_end && fits(pattern, pattern_end, name + 1, name_end));
	return name != name_end && (*pattern == "*" || *pattern == *name) &&
	       fits(pattern + 1, pattern_end, name + 1, name_end);
}

bool is_about(const std::string& pattern, const Names& names)
{
	const auto asked = tokens_of(pattern), own = tokens_of(names.full());
	constexpr std::size_t kDeepest = 20;  // [-] parts of a name
	if (asked.size() > kDeepest || own.size() > kDeepest) return false;
	return fits(asked.begin(), asked.end(), own.begin(), own.end());
}

std::vector<std::string> texts_of(const YAML::Node& value)
{
	std::vector<std::string> texts;
	if (value.IsSequence())
		for (const auto& item : value) texts.push_back(item.IsScalar() ? item.Scalar() : "");
	else
		texts.push_back(value.IsScalar() ? value.Scalar() : "");
	return texts;
}

/// Takes parameters from yaml. A node of yaml may hold itself, or another one many times, so that their number is
/// bounded.
class ParameterTaker
{
   public:
	ParameterTaker(const Names& names, std::vector<Parameter>& parameters) : names_(names), parameters_(parameters) {}

	/// Takes a parameter, or those of a map, whose names are joined by dots.
	/// \throws std::runtime_error if there are too many
	void take(const YAML::Node& value, const std::string& name)
	{
		count(name);
		if (!value.IsMap()) return parameters_.push_back({name, texts_of(value)});
		for (const auto& item : value) take(item.second, (name.empty() ? "" : name + ".") + item.first.Scalar());
	}

	/// Takes what a file of parameters holds about the node. \param path of the keys above \throws as take()
	void take_file(const YAML::Node& root, const std::string& path)
	{
		constexpr const char* kParameters = "ros__parameters";
		count(path);
		if (!root.IsMap()) return;
		for (const auto& item : root)
			if (item.first.Scalar() != kParameters)
				take_file(item.second, path + "/" + item.first.Scalar());
			else if (item.second.IsMap() && is_about(path, names_))
				take(item.second, "");
	}

   private:
	void count(const std::string& name)
	{
		constexpr std::size_t kMost = 10'000, kLongest = 1000;  // [-] of nodes, [byte]
		if (++taken_ > kMost || name.size() > kLongest)
			throw std::runtime_error("holds more than 10,000 parameters; name the right yaml file");
	}

	const Names& names_;
	std::vector<Parameter>& parameters_;
	std::size_t taken_ = 0;
};

class ArgumentReader
{
   public:
	ArgumentReader(int argc, char** argv) : words_(argv + 1, argv + argc) {}

	RosArguments read()
	{
		bool is_ros = false;
		for (; at_ < words_.size(); at_++)
		{
			const std::string& word = words_[at_];
			if (word == "--ros-args")
				is_ros = true;
			else if (is_ros && word == "--")
				is_ros = false;
			else if (is_ros)
				take(word);
			else
				take_own(word);
		}
		read_files();
		return std::move(all_);
	}

   private:
	void take_own(const std::string& word)
	{
		if (word.find(kAssigned) != std::string::npos && word.rfind('-', 0) != 0)
			refuse_word(word, "stands outside of ROS's arguments; write --ros-args -r " + word);
		all_.words.push_back(word);
	}

	const std::string& value()
	{
		if (at_ + 1 == words_.size()) refuse_word(words_[at_], "needs a value");
		return words_[++at_];
	}

	void take(const std::string& flag)
	{
		if (flag == "-r" || flag == "--remap")
			take_rule(parse_assignment(flag, value()));
		else if (flag == "-p" || flag == "--param")
			take_parameter(flag, parse_assignment(flag, value()));
		else if (flag == "--params-file")
			later_.push_back({value(), {}});
		else if (flag == "--log-level")
			take_level(value());
		else if (flag == "-e" || flag == "--enclave" || flag == "--log-config-file" || flag == "--log-file-name")
			all_.notes.push_back(flag + " " + value() + " has no effect on d2s1r-live");
		else if (flag.rfind("--enable-", 0) == 0 || flag.rfind("--disable-", 0) == 0)
			all_.notes.push_back(flag + " has no effect on d2s1r-live");
		else
			refuse_word(
			    flag,
			    "is not an argument of ROS; write -r, -p, --params-file or --log-level, or put it before --ros-args");
	}

	/// Returns a name without the node that it is meant for; no value if that is another node.
	std::optional<std::string> for_this_node(const std::string& name) const
	{
		const auto colon = name.find(':');
		if (colon == std::string::npos) return name;
		const std::string prefix = name.substr(0, colon);
		const std::string rest = name.substr(colon + 1);
		if (prefix == "rostopic") return rest.substr(std::min(rest.find_first_not_of('/'), rest.size()));
		if (prefix != all_.names.node) return std::nullopt;
		return rest;
	}

	void take_rule(const std::pair<std::string, std::string>& rule)
	{
		const auto from = for_this_node(rule.first);
		if (!from) return;
		if (*from == "__node" || *from == "__name")
		{
			if (!is_token(rule.second)) refuse_word(rule.second, kNotAName);
			all_.names.node = rule.second;
		}
		else if (*from == "__ns")
			all_.names.space = "/" + joined(tokens_of(rule.second));
		else
			all_.names.add_rule(*from, rule.second);
	}

	static std::string joined(const std::vector<std::string>& tokens)
	{
		std::string text;
		for (const std::string& token : tokens) text += (text.empty() ? "" : "/") + token;
		return text;
	}

	void take_parameter(const std::string& flag, const std::pair<std::string, std::string>& assigned)
	{
		const auto name = for_this_node(assigned.first);
		if (!name) return;
		try
		{
			std::vector<Parameter> parameters;
			ParameterTaker(all_.names, parameters).take(YAML::Load(assigned.second), *name);
			for (Parameter& parameter : parameters) later_.push_back({"", std::move(parameter)});
		}
		catch (const YAML::Exception&)
		{
			refuse_word(flag, "the value of '" + assigned.first + "' is no yaml; write NAME:=VALUE");
		}
	}

	void take_level(const std::string& text)
	{
		const auto at = text.find(kAssigned);
		std::string level = at == std::string::npos ? text : text.substr(at + 2);
		std::transform(level.begin(), level.end(), level.begin(), [](unsigned char c) { return std::tolower(c); });
		constexpr std::array<const char*, 6> kLevels = {"unset", "debug", "info", "warn", "error", "fatal"};
		if (std::find(kLevels.begin(), kLevels.end(), level) == kLevels.end())
			refuse_word(text, "is not a level; write debug, info, warn, error or fatal after --log-level");
		if (level == "error" || level == "fatal") all_.errors_only = true;
	}

	/// Reads the files, whose entries depend on the node's name, and puts all parameters into the order in which they
	/// were given.
	void read_files()
	{
		for (auto& [file, parameter] : later_)
		{
			if (file.empty())
			{
				all_.parameters.push_back(std::move(parameter));
				continue;
			}
			try
			{
				ParameterTaker(all_.names, all_.parameters).take_file(read_yaml(file), "");
			}
			catch (const std::runtime_error& error)
			{
				refuse_word(file, error.what());
			}
		}
	}

	std::vector<std::string> words_;
	std::size_t at_ = 0;
	RosArguments all_;
	std::vector<std::pair<std::string, Parameter>> later_;  //!< a file, or a parameter
};
}  // namespace

std::string Names::expand(const std::string& topic) const
{
	if (topic.rfind('/', 0) == 0) return topic;
	if (topic == "~") return full();
	if (topic.rfind("~/", 0) == 0) return full() + topic.substr(1);
	return (space == "/" ? "" : space) + "/" + topic;
}

std::string Names::resolve(const std::string& topic) const
{
	std::string name = expand(topic);
	const auto rule =
	    std::find_if(rules_.begin(), rules_.end(), [&](const auto& given) { return expand(given.first) == name; });
	if (rule != rules_.end()) name = expand(rule->second);
	if (!is_topic(name)) refuse_word(name, kNotAName);
	return name;
}

RosArguments parse_ros_arguments(int argc, char** argv)
{
	return ArgumentReader(argc, argv).read();
}
}  // namespace d2s1r::live
