// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/map_io.h>
#include <gtest/gtest.h>

#include <optional>
#include <stdexcept>
#include <string>

#include "test_files.h"

namespace d2s1r::test
{
/// Expects that a map file is refused in one line, and returns the line.
inline std::string refusal(const std::string& file, const std::optional<ImageGeometry>& image = std::nullopt)
{
	auto message = message_of<std::runtime_error>([&] { load_map(file, {}, image); });
	EXPECT_EQ(message.find('\n'), std::string::npos) << message;
	return message;
}
}  // namespace d2s1r::test
