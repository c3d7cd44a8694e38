// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "window_terms.h"

#include <cstdint>
#include <istream>
#include <ostream>
#include <stdexcept>

namespace d2s1r::experiments
{
namespace
{
/// Writes a number as a float: terms of a drive are large.
void put(std::ostream& stream, double number)
{
	const auto small = static_cast<float>(number);
	stream.write(reinterpret_cast<const char*>(&small), sizeof(small));
}

double get(std::istream& stream)
{
	float number = 0;
	if (!stream.read(reinterpret_cast<char*>(&number), sizeof(number)))
		throw std::runtime_error("the terms of a window end too early; write them again");
	return static_cast<double>(number);
}
}  // namespace

void write_terms(std::ostream& stream, const WindowTerms& terms)
{
	put(stream, static_cast<double>(terms.frames.size()));
	put(stream, static_cast<double>(terms.tracks.size()));
	for (const double number : {terms.is_localized ? 1.0 : 0.0, terms.is_scan_right ? 1.0 : 0.0, terms.confidence})
		put(stream, number);
	for (const FrameEvidence& frame : terms.frames)
	{
		for (const double share : frame.seen_before) put(stream, share);
		for (const double number : {frame.absence, frame.linked}) put(stream, number);
	}
	for (std::size_t i = 0; i < terms.tracks.size(); i++)
	{
		put(stream, terms.are_right[i] ? 1 : 0);
		for (const double evidence : terms.tracks[i]) put(stream, evidence);
	}
}

std::vector<WindowTerms> read_terms(std::istream& stream)
{
	std::vector<WindowTerms> all;
	while (stream.peek() != std::istream::traits_type::eof())
	{
		WindowTerms& terms = all.emplace_back();
		terms.frames.resize(static_cast<std::size_t>(get(stream)));
		terms.tracks.resize(static_cast<std::size_t>(get(stream)));
		terms.is_localized = get(stream) != 0;
		terms.is_scan_right = get(stream) != 0;
		terms.confidence = get(stream);
		for (std::size_t i = 0; i < terms.frames.size(); i++)
		{
			FrameEvidence& frame = terms.frames[i];
			frame.seen_before.resize(i);
			for (double& share : frame.seen_before) share = get(stream);
			for (double* number : {&frame.absence, &frame.linked}) *number = get(stream);
		}
		for (Evidence& track : terms.tracks)
		{
			terms.are_right.push_back(get(stream) != 0);
			for (std::size_t i = 0; i < terms.frames.size(); i++) track.push_back(get(stream));
		}
	}
	return all;
}
}  // namespace d2s1r::experiments
