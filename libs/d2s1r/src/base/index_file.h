// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The file of a saved index: a header, then numbers and arrays one after the other. What is saved lists its fields
// once, in a function template `fields(self, file)` that calls `file(field)` for each: with an IndexWriter that writes
// them, with an IndexReader it reads them.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <type_traits>

#include "base/array.h"
#include "base/output_file.h"

struct XXH3_state_s;

namespace d2s1r
{
/// Tells what an index was made from. An index is of use only for the same.
struct IndexKey
{
	std::uint64_t map = 0;         //!< fingerprint of the map
	std::uint64_t parameters = 0;  //!< fingerprint of the parameters and of the version of the library
};

/// Returns a number that is equal for equal bytes; other bytes have another one, but for one case in 2^64.
std::uint64_t fingerprint_of(const void* bytes, std::size_t count, std::uint64_t seed = 0);

/// Lists what an index file holds of the place and size of a grid or map.
template <class Self, class File>
void geometry_fields(Self& grid, File& file)
{
	file(grid.width);
	file(grid.height);
	file(grid.cell_size);
	file(grid.origin_x);
	file(grid.origin_y);
}

/// The parts of a file that begin at a multiple of this can be read as any type, by aligned instructions, too.
inline constexpr std::size_t kIndexAlignment = kCacheLine;  //!< [byte]

/// Writes the file of an index, which appears when it is whole: see PendingFile.
class IndexWriter
{
   public:
	/// \throws std::runtime_error naming the file if it cannot be written, or exists and is no index
	explicit IndexWriter(const std::string& file);

	template <class Number, std::enable_if_t<std::is_arithmetic_v<Number>, int> = 0>
	void operator()(const Number& number)
	{
		write(&number, sizeof number, 1);
	}

	template <class T>
	void operator()(const Array<T>& array)
	{
		static_assert(std::is_trivially_copyable_v<T>);
		write(array.data(), sizeof(T), array.size());
	}

	/// Gives the file its name. \throws std::runtime_error naming the file
	void commit(const IndexKey& key);

   private:
	void write(const void* values, std::size_t size, std::size_t count);
	void put(const void* bytes, std::size_t count);

	PendingFile pending_;
	std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream_;
	std::unique_ptr<XXH3_state_s, void (*)(XXH3_state_s*)> sum_;  //!< of all that was written behind the header
	std::size_t written_ = 0;                                     //!< [byte] with the header
};

/// Maps the file of an index into memory and reads it. Arrays refer to that memory, which all processes share that map
/// the same file.
class IndexReader
{
   public:
	/// \throws std::runtime_error naming the file if it cannot be read, is no index, was made from something else than
	///         `key`, or is damaged
	IndexReader(const std::string& file, const IndexKey& key);

	/// Says that what was read is not what an index holds. \throws std::runtime_error naming the file
	[[noreturn]] void refuse_content() const;

	template <class Number, std::enable_if_t<std::is_arithmetic_v<Number>, int> = 0>
	void operator()(Number& number)
	{
		number = *static_cast<const Number*>(read(sizeof number, 1).first);
	}

	template <class T>
	void operator()(Array<T>& array)
	{
		const auto [values, count] = read(sizeof(T), 0);
		array = {static_cast<const T*>(values), count, memory_};
	}

   private:
	std::pair<const void*, std::size_t> read(std::size_t size, std::size_t expected_count);

	std::string file_;
	std::shared_ptr<const unsigned char> memory_;
	std::size_t size_ = 0;  //!< [byte] of the file
	std::size_t at_ = 0;    //!< [byte] where the next value begins
};
}  // namespace d2s1r
