// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Records of MCAP files, as https://mcap.dev/spec has them.
#pragma once

#include "bags/byte_file.h"

namespace d2s1r::logs
{
/// Kinds of records; those that no reader here looks into have no name.
enum class McapOpcode : std::uint8_t
{
	kHeader = 0x01,
	kFooter = 0x02,
	kSchema = 0x03,
	kChannel = 0x04,
	kMessage = 0x05,
	kChunk = 0x06,
	kDataEnd = 0x0f
};

struct McapPlace
{
	McapOpcode opcode{};
	std::uint64_t content = 0;  //!< [byte] offset
	std::uint64_t size = 0;     //!< [byte] of the content

	std::uint64_t end() const { return content + size; }
};

struct McapRecord
{
	McapOpcode opcode{};
	Bytes content;
};

inline constexpr std::uint64_t kMcapMagicSize = 8;  //!< [byte] at the start and at the end of a file

/// \throws std::runtime_error if the record reaches beyond the end of the file
McapPlace find_mcap_record(ByteFile& file, std::uint64_t offset);

/// Takes the next record of an unpacked chunk. \throws std::runtime_error if it reaches beyond the end
McapRecord take_mcap_record(ByteCursor& cursor);

struct McapChunk
{
	std::uint64_t first_time = 0;  //!< [ns] as it says itself
	std::vector<std::uint8_t> records;
};

/// \param ask_to_stop as that of unpack()
/// \throws std::runtime_error if it is damaged; Unreadable if it is packed in a way that is not known
McapChunk unpack_mcap_chunk(
    Bytes content, const std::function<void()>& ask_to_stop = [] {});
}  // namespace d2s1r::logs
