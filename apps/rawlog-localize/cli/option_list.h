// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/3rdparty/tclap/CmdLine.h>

#include <list>
#include <ostream>
#include <string>
#include <vector>

namespace d2s1r::app
{
/// The options of a command line: TCLAP parses them, this prints them as GNU programs do.
class OptionList
{
   public:
	/// An option with a value, "" where the user gives none.
	TCLAP::ValueArg<std::string>& value(
	    const char* letter, const char* name, const char* value_name, const char* meaning);
	TCLAP::SwitchArg& flag(const char* letter, const char* name, const char* meaning);

	/// "--name=value" and "-lvalue" are split in two. \throws UserError (kWrongUse)
	void parse(int argc, char** argv);

	/// \throws UserError (kWrongUse) if an option is given the empty value, `may_be_empty` aside
	void refuse_empty_values(const TCLAP::ValueArg<std::string>& may_be_empty);

	/// One paragraph an option.
	void print(std::ostream& out) const;

   private:
	bool is_letter_with_value(const std::string& word) const;

	struct Line
	{
		std::string option;
		std::string meaning;
	};
	TCLAP::CmdLine parser_{"", ' ', "", false};
	std::list<TCLAP::ValueArg<std::string>> values_;
	std::list<TCLAP::SwitchArg> flags_;
	std::vector<Line> lines_;
};
}  // namespace d2s1r::app
