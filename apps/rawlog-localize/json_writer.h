// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "output_file.h"

namespace d2s1r::app
{
/// Writes one JSON object, a member a line. Numbers that are not finite become null.
class JsonWriter
{
   public:
	explicit JsonWriter(TextFile& file) : file_(file) {}

	void open(const char* key);  //!< of a nested object; nullptr for the outermost
	void close();
	void member(const char* key, const std::string& value);
	void member(const char* key, double value);
	void member(const char* key, std::size_t value);

   private:
	void start(const char* key);
	TextFile& file_;
	int depth_ = 0;
	bool first_ = true;
};
}  // namespace d2s1r::app
