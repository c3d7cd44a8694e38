// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "json_writer.h"

#include "utf8.h"

#include <cmath>

namespace d2s1r::app
{
namespace
{
std::string quoted(const std::string& text)
{
	std::string result = "\"";
	for (const char c : valid_utf8(text))
	{
		char code[8];
		if (c == '"' || c == '\\')
			result += '\\', result += c;
		else if (static_cast<unsigned char>(c) < 0x20)
		{
			std::snprintf(code, sizeof code, "\\u%04x", static_cast<unsigned>(c));
			result += code;
		}
		else
			result += c;
	}
	return result + "\"";
}
}  // namespace

void JsonWriter::start(const char* key)
{
	if (depth_ == 0) return;
	file_.print("%s\n%*s%s: ", first_ ? "" : ",", 2 * depth_, "", quoted(key).c_str());
	first_ = false;
}

void JsonWriter::open(const char* key)
{
	start(key);
	file_.print("{");
	depth_++;
	first_ = true;
}

void JsonWriter::close()
{
	depth_--;
	file_.print("\n%*s}%s", 2 * depth_, "", depth_ == 0 ? "\n" : "");
	first_ = false;
}

void JsonWriter::member(const char* key, const std::string& value)
{
	start(key);
	file_.print("%s", quoted(value).c_str());
}

void JsonWriter::member(const char* key, double value)
{
	start(key);
	std::isfinite(value) ? file_.print("%.6g", value) : file_.print("null");
}

void JsonWriter::member(const char* key, std::size_t value)
{
	start(key);
	file_.print("%zu", value);
}
}  // namespace d2s1r::app
