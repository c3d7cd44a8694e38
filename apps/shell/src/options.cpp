// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "shell/options.h"

#include <base/spelling.h>

#include <memory>
#include <sstream>

#include "shell/errors.h"

namespace d2s1r::app
{
namespace
{
class HelpFormatter : public CLI::Formatter
{
   public:
	explicit HelpFormatter(const char* usage) : usage_(usage) { column_width(kMeaningColumn); }

	std::string make_usage(const CLI::App*, std::string) const override { return usage_; }

	std::string make_group(std::string heading, bool, std::vector<const CLI::Option*> options) const override
	{
		std::string text = heading + ":\n";
		for (const CLI::Option* option : options) text += make_option(option, false);
		return text;
	}

	std::string make_option_name(const CLI::Option* option, bool) const override
	{
		const auto& letters = option->get_snames();
		return (letters.empty() ? "    --" : "-" + letters.front() + ", --") + option->get_lnames().front();
	}

	std::string make_option_desc(const CLI::Option* option) const override
	{
		std::istringstream words(option->get_description());
		std::string lines;
		std::size_t column = 0;
		for (std::string word; words >> word;)
		{
			const bool fits = kMeaningColumn + column + 1 + word.size() <= kLastColumn;
			if (column > 0) lines += fits ? ' ' : '\n';
			column = (column > 0 && fits ? column + 1 : 0) + word.size();
			lines += word;
		}
		return lines;
	}

   private:
	static constexpr std::size_t kMeaningColumn = 29, kLastColumn = 100;

	const char* usage_;
};

/// Refuses a word that is not an option, and names the option that it may have been meant to be.
[[noreturn]] void refuse_unknown(const CLI::App& app, const Usage& usage, const std::string& word)
{
	if (word.rfind('-', 0) != 0)
		refuse_option(usage.program, word, std::string("stands without an option") + usage.words);
	const std::string given = word.substr(0, word.find('='));
	std::vector<std::string> names;
	for (const CLI::Option* option : app.get_options()) names.push_back("--" + option->get_lnames().front());
	for (const auto& [other, name] : usage.other_names)
		if (given == other)
			throw UserError(kWrongUse, given, std::string("is not an option; did you mean ") + name + "?");
	throw UserError(kWrongUse, given, not_an_option(given, names, std::string(usage.program) + " --help"));
}

/// Returns the words, the last one first, as CLI11 wants them. It would take the next word for the value of "--name=",
/// so that becomes two words, and a flag's value for a letter, so that is refused here.
std::vector<std::string> reversed(const CLI::App& app, const std::vector<std::string>& given)
{
	std::vector<std::string> words;
	for (const std::string& word : given)
	{
		const std::string name = word.substr(0, word.find('='));
		const CLI::Option* option = name.size() < word.size() ? app.get_option_no_throw(name) : nullptr;
		if (option && option->get_items_expected_max() == 0) refuse_option(app.get_name(), name, "takes no value");
		const bool is_empty_value = option && name.rfind("--", 0) == 0 && word.size() == name.size() + 1;
		words.push_back(is_empty_value ? name : word);
		if (is_empty_value) words.emplace_back();
	}
	std::reverse(words.begin(), words.end());
	return words;
}
}  // namespace

[[noreturn]] void refuse_option(const std::string& program, const std::string& option, const std::string& what)
{
	throw UserError(kWrongUse, option, what + "; see " + program + " --help");
}

void set_up(CLI::App& app, const Usage& usage)
{
	app.name(usage.program);
	app.set_help_flag();
	app.allow_extras();
	app.formatter(std::make_shared<HelpFormatter>(usage.usage));
	app.footer(usage.footer);
	app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
}

bool parse_words(CLI::App& app, const Usage& usage, const std::vector<std::string>& words)
{
	try
	{
		app.parse(reversed(app, words));
	}
	catch (const CLI::Success&)
	{
		return false;
	}
	catch (const CLI::ArgumentMismatch&)
	{
		refuse_option(usage.program, words.back(), kNeedsValue);  // only the last word can lack what comes after it
	}
	const auto unknown = app.remaining();
	if (!unknown.empty()) refuse_unknown(app, usage, unknown.front());
	for (const CLI::Option* option : app.get_options())
		if (option->count() > 1 && option->get_multi_option_policy() != CLI::MultiOptionPolicy::TakeAll)
			refuse_option(usage.program, option->get_name(), "is given more than once");
	return true;
}
}  // namespace d2s1r::app
