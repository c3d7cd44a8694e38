// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>

#include <algorithm>
#include <functional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace d2s1r::app
{
/// Refuses what was given for an option. \throws UserError (kWrongUse) that names the option and `program --help`
[[noreturn]] void refuse_option(const std::string& program, const std::string& option, const std::string& what);

inline constexpr const char* kNeedsValue = "needs a value";

struct Usage
{
	const char* program;
	const char* usage;   //!< the start of --help
	const char* footer;  //!< its end; may be empty
	const char* words;   //!< what a word that stands without an option should be; may be empty
	/// Names that other programs have for an option of this one, and its own name.
	std::vector<std::pair<const char*, const char*>> other_names = {};
};

/// Prepares a parser, whose --help looks like that of GNU programs: "  -m, --map MAP", and the meaning beside it in
/// lines of equal length.
void set_up(CLI::App& app, const Usage& usage);

/// Adds options under a heading of --help.
class OptionGroup
{
   public:
	OptionGroup(CLI::App& app, const char* heading) : app_(app), heading_(heading) {}

	/// An option with a value, which may not be empty.
	/// \param names "-l,--long" or "--long"
	/// \param take takes the text of the value. What it throws becomes an error that names the option
	template <class Take>
	void value(const char* names, const char* value_name, const char* meaning, const Take& take)
	{
		text(names, value_name, meaning, [take](const std::string& text) { take(filled(text)); });
	}
	void value(const char* names, const char* value_name, const char* meaning, std::string& text)
	{
		value(names, value_name, meaning, [&text](const std::string& given) { text = given; });
	}

	/// The same, but the value may be empty.
	template <class Take>
	void text(const char* names, const char* value_name, const char* meaning, const Take& take)
	{
		const auto take_or_refuse = [take, name = name_of(names), program = app_.get_name()](const std::string& text)
		{
			try
			{
				take(text);
			}
			catch (const std::invalid_argument& error)
			{
				refuse_option(program, name, error.what());
			}
		};
		add(app_.add_option_function<std::string>(names, take_or_refuse, meaning), value_name);
	}

	/// An option that may be given several times.
	void values(const char* names, const char* value_name, const char* meaning, std::vector<std::string>& texts)
	{
		const auto take =
		    [&texts, name = name_of(names), program = app_.get_name()](const std::vector<std::string>& given)
		{
			if (std::count(given.begin(), given.end(), "") > 0) refuse_option(program, name, kNeedsValue);
			texts = given;
		};
		add(app_.add_option_function<std::vector<std::string>>(names, take, meaning), value_name)
		    ->expected(1)
		    ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
	}

	void flag(const char* names, const char* meaning, bool& given)
	{
		app_.add_flag(names, given, meaning)->group(heading_);
	}

	/// Adds --version and --help, which are followed as soon as they are read, whatever else is given, and end the
	/// parsing. \param version what the first one prints on `out`
	void help(const std::string& version, std::ostream& out)
	{
		request("--version", "print the version and exit", [&out, version] { out << version; });
		request("-h,--help", "print this help and exit", [&out, &app = app_] { out << app.help(); });
	}

   private:
	/// A flag that is followed as soon as it is read, whatever else is given, and that ends the parsing.
	void request(const char* names, const char* meaning, const std::function<void()>& follow)
	{
		const auto follow_and_end = [follow]
		{
			follow();
			throw CLI::Success();
		};
		app_.add_flag_callback(names, follow_and_end, meaning)->trigger_on_parse()->group(heading_);
	}

	static std::string name_of(const std::string& names) { return names.substr(names.find("--")); }

	static const std::string& filled(const std::string& text)
	{
		if (text.empty()) throw std::invalid_argument(kNeedsValue);
		return text;
	}

	CLI::Option* add(CLI::Option* option, const char* value_name) const
	{
		return option->option_text(value_name)->group(heading_);
	}

	CLI::App& app_;
	const char* heading_;
};

/// Parses the words of a command line, without the program's name.
/// \return false after --help and --version. \throws UserError (kWrongUse)
bool parse_words(CLI::App& app, const Usage& usage, const std::vector<std::string>& words);
}  // namespace d2s1r::app
