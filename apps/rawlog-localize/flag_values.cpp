// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "flag_values.h"

#include "errors.h"

#include <mrpt/core/format.h>

#include <charconv>
#include <cmath>
#include <limits>

namespace d2s1r::app
{
void wrong(const std::string& flag, const std::string& what)
{
	throw UserError(kWrongUse, flag, what + "; see rawlog-localize --help");
}

namespace
{
template <class Number>
Number parse_number(const std::string& flag, const std::string& text)
{
	Number number{};
	const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
	if (error != std::errc() || end != text.data() + text.size() || text.empty())
	{
		using Limits = std::numeric_limits<Number>;
		std::string expected = "a number";
		if constexpr (std::is_integral_v<Number>)
			expected = "a whole number from " + std::to_string(Limits::min()) + " to " + std::to_string(Limits::max());
		wrong(flag, "'" + text + "' is not " + expected);
	}
	return number;
}

/// Finite numbers with commas between them.
std::vector<double> parse_numbers(const std::string& flag, const std::string& text)
{
	std::vector<double> numbers;
	for (std::size_t start = 0; start <= text.size();)
	{
		const auto end = std::min(text.find(',', start), text.size());
		numbers.push_back(parse_number<double>(flag, text.substr(start, end - start)));
		if (!std::isfinite(numbers.back())) wrong(flag, "'" + text + "' is not finite");
		start = end + 1;
	}
	return numbers;
}
}  // namespace

void parse_frames(const std::string& text, Flags& flags)
{
	const auto colon = text.find(':');
	if (colon == std::string::npos) wrong("--frames", "'" + text + "' is not a range; write A:B, A: or :B");
	const std::string first = text.substr(0, colon), past = text.substr(colon + 1);
	if (!first.empty()) flags.first_frame = parse_number<std::size_t>("--frames", first);
	if (!past.empty()) flags.past_frame = parse_number<std::size_t>("--frames", past);
	if (flags.first_frame >= flags.past_frame) wrong("--frames", "'" + text + "' holds no frame; A must be below B");
}

int parse_threads(const std::string& text)
{
	const int threads = parse_number<int>("--threads", text);
	if (threads < 1 || threads > 256) wrong("--threads", "must be 1 to 256");
	return threads;
}

std::uint32_t parse_seed(const std::string& text)
{
	return parse_number<std::uint32_t>("--seed", text);
}

std::optional<int> parse_window(const std::string& text)
{
	const int frames = parse_number<int>("--window", text);
	if (frames < 1 || frames > 1000) wrong("--window", "must be 1 to 1000 frames");
	return frames > 1 ? std::optional(frames) : std::nullopt;  // a scan on its own
}

Prior parse_region(const std::string& text)
{
	const auto corners = parse_numbers("--region", text);
	if (corners.size() != 4) wrong("--region", "'" + text + "' is not a box; write X0,Y0,X1,Y1 in m");
	if (corners[0] == corners[2] || corners[1] == corners[3])
		wrong("--region", "'" + text + "' is an empty box; give two opposite corners");
	return make_prior(corners[0], corners[1], corners[2], corners[3]);
}

double parse_time_budget(const std::string& text)
{
	const auto budget = parse_number<double>("--time-budget", text);
	if (!(budget > 0) || !std::isfinite(budget)) wrong("--time-budget", "must be above 0 ms");
	return budget;
}

MotionSource parse_motion(const std::string& text, bool fuse)
{
	if (!fuse) wrong("--motion", "only goes with --fuse");
	if (text == "pseudo") return MotionSource::kPseudo;
	if (text == "odometry") return MotionSource::kOdometry;
	if (text != "both") wrong("--motion", "'" + text + "' is not one of pseudo, odometry, both");
	return MotionSource::kBoth;
}

std::optional<ImageGeometry> parse_image(const std::string& resolution, const std::string& origin)
{
	if (resolution.empty() && !origin.empty()) wrong("--origin", "only goes with --resolution");
	if (resolution.empty()) return std::nullopt;
	ImageGeometry image;
	image.resolution = parse_number<double>("--resolution", resolution);
	constexpr double kLeast = ImageGeometry::kLeastResolution, kGreatest = ImageGeometry::kGreatestResolution;
	if (!(image.resolution >= kLeast && image.resolution <= kGreatest))
		wrong("--resolution", mrpt::format("must be %g to %g m a pixel", kLeast, kGreatest));
	if (origin.empty()) return image;
	const auto point = parse_numbers("--origin", origin);
	if (point.size() != 2) wrong("--origin", "'" + origin + "' is not a point; write X,Y in m");
	image.origin_x = point[0];
	image.origin_y = point[1];
	return image;
}
}  // namespace d2s1r::app
