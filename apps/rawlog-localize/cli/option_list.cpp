// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cli/option_list.h"

#include "cli/errors.h"

#include <algorithm>
#include <sstream>

namespace d2s1r::app
{
namespace
{
constexpr std::size_t kMeaningColumn = 26;
constexpr std::size_t kLastColumn = 100;

/// TCLAP reports errors through this instead of printing them.
class Reporter : public TCLAP::CmdLineOutput
{
   public:
	void usage(TCLAP::CmdLineInterface&) override {}
	void version(TCLAP::CmdLineInterface&) override {}
	void failure(TCLAP::CmdLineInterface&, TCLAP::ArgException& e) override
	{
		const std::string prefix = "Argument: ";
		std::string id = e.argId();
		if (id.rfind(prefix, 0) == 0) id.erase(0, prefix.size());
		if (const auto open = id.find("(--"); open != std::string::npos)
			id = id.substr(open + 1, id.find(')') - open - 1);
		throw UserError(kWrongUse, id, e.error() + "; see rawlog-localize --help");
	}
};

std::string wrap(const std::string& text)
{
	std::istringstream words(text);
	std::string wrapped;
	std::size_t column = kMeaningColumn;
	for (std::string word; words >> word;)
	{
		if (column > kMeaningColumn && column + 1 + word.size() > kLastColumn)
		{
			wrapped += "\n" + std::string(kMeaningColumn, ' ');
			column = kMeaningColumn;
		}
		else if (column > kMeaningColumn)
		{
			wrapped += ' ';
			column++;
		}
		wrapped += word;
		column += word.size();
	}
	return wrapped;
}

std::string spelled(const std::string& letter, const std::string& name)
{
	return (letter.empty() ? "    --" : "-" + letter + ", --") + name;
}
}  // namespace

TCLAP::ValueArg<std::string>& OptionList::value(
    const char* letter, const char* name, const char* value_name, const char* meaning)
{
	lines_.push_back({spelled(letter, name) + " " + value_name, meaning});
	return values_.emplace_back(letter, name, meaning, false, "", value_name, parser_);
}

TCLAP::SwitchArg& OptionList::flag(const char* letter, const char* name, const char* meaning)
{
	lines_.push_back({spelled(letter, name), meaning});
	return flags_.emplace_back(letter, name, meaning, parser_, false);
}

bool OptionList::is_letter_with_value(const std::string& word) const
{
	const auto is_its = [&](const auto& value) { return !value.getFlag().empty() && value.getFlag()[0] == word[1]; };
	return word.size() > 2 && word[0] == '-' && std::any_of(values_.begin(), values_.end(), is_its);
}

void OptionList::parse(int argc, char** argv)
{
	std::vector<std::string> words;
	for (int i = 0; i < argc; i++)
	{
		const std::string word = argv[i];
		if (word == "--") throw UserError(kWrongUse, word, "there is nothing but options; see rawlog-localize --help");
		if (i > 0 && is_letter_with_value(word))
		{
			words.push_back(word.substr(0, 2));
			words.push_back(word.substr(2));
			continue;
		}
		const auto equals = word.rfind("--", 0) == 0 && i > 0 ? word.find('=') : std::string::npos;
		words.push_back(word.substr(0, equals));
		if (equals != std::string::npos) words.push_back(word.substr(equals + 1));
	}
	std::vector<const char*> pointers;
	for (const auto& word : words) pointers.push_back(word.c_str());
	Reporter reporter;
	parser_.setOutput(&reporter);
	parser_.parse(static_cast<int>(pointers.size()), pointers.data());
}

void OptionList::refuse_empty_values(const TCLAP::ValueArg<std::string>& may_be_empty)
{
	for (auto& value : values_)
		if (&value != &may_be_empty && value.isSet() && value.getValue().empty())
			throw UserError(kWrongUse, "--" + value.getName(), "needs a value; see rawlog-localize --help");
}

void OptionList::print(std::ostream& out) const
{
	for (const auto& line : lines_)
	{
		std::string option = "  " + line.option;
		if (option.size() + 2 > kMeaningColumn) option += "\n" + std::string(kMeaningColumn, ' ');
		option.resize(std::max(option.size(), kMeaningColumn), ' ');
		out << option << wrap(line.meaning) << "\n";
	}
}
}  // namespace d2s1r::app
