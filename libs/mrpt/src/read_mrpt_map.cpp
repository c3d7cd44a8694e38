// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/map_limits.h>
#include <d2s1r/mrpt.h>
#include <d2s1r/mrpt_version.h>
#include <d2s1r/read_mrpt_map.h>
#include <mrpt/maps/registerAllClasses.h>
#include <mrpt/serialization/CArchive.h>

#include D2S1R_UNPACKING
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "base/file_text.h"

namespace d2s1r
{
namespace
{
namespace fs = std::filesystem;

[[noreturn]] void refuse_truncated_object()
{
	throw std::runtime_error("is truncated; copy or save it again");
}

bool is_packed_by_zstd(const std::string& file)
{
	const std::string magic = "\x28\xb5\x2f\xfd";
	return read_text(file, magic.size()) == magic;
}

/// Returns how many bytes a packed file may hold, at most.
double most_bytes_in(const std::string& file)
{
	constexpr double kGzipRatio = 1032, kZstdRatio = 32768;  // [-] unpacked bytes for a byte of a file, at most
	return (is_packed_by_zstd(file) ? kZstdRatio : kGzipRatio) * static_cast<double>(fs::file_size(file));
}

/// Reads the start of a serialized map, which MRPT believes: it makes room for as many cells or keyframes as that says.
class MapHeader
{
   public:
	explicit MapHeader(const std::string& file) : most_bytes_(most_bytes_in(file))
	{
		if (!stream_.open(file)) return;
		const auto name_length = read<unsigned char>();
		name_.resize(name_length & 0x7FU);
		if (stream_.Read(name_.data(), name_.size()) != name_.size()) return;
		version_ = read<unsigned char>();
	}

	/// \throws std::runtime_error if the map is too large for memory, or for the file that it is to be in
	void check()
	{
		if (name_ == "mrpt::maps::COccupancyGridMap2D") check_grid();
		if (name_ == "mrpt::maps::CSimpleMap") check_keyframes();
	}

   private:
	template <class Number>
	Number read()
	{
		Number number{};
		return stream_.Read(&number, sizeof number) == sizeof number ? number : Number{};
	}

	void check_grid()
	{
		struct Start
		{
			std::uint32_t cells_x, cells_y;
			float x_min, x_max, y_min, y_max, cell_size;  //!< [m]
		};
		if (version_ >= 2) read<unsigned char>();  // bits of a cell
		const auto start = read<Start>();
		const auto cells = [&](float from, float to) {
			return std::round(
			    (static_cast<double>(to) - static_cast<double>(from)) / static_cast<double>(start.cell_size));
		};
		const double cells_x = cells(start.x_min, start.x_max), cells_y = cells(start.y_min, start.y_max);
		check_map_size(cells_x, cells_y);
		if (cells_x * cells_y > most_bytes_) refuse_truncated_object();
	}

	void check_keyframes()
	{
		constexpr double kLeast = 16;  // [byte] of a keyframe: even a missing pose or frame takes 8
		const auto keyframes = static_cast<double>(read<std::uint32_t>());
		if (kLeast * keyframes > most_bytes_) refuse_truncated_object();
	}

	double most_bytes_;
	PackedInput stream_;
	std::string name_;
	unsigned version_ = 0;
};

/// Throws at the end of the file, where MRPT's archive goes on with numbers that were never read.
class WholeReads : public mrpt::io::CStream
{
   public:
	explicit WholeReads(const std::string& file) : file_(file) {}
	std::size_t Read(void* buffer, std::size_t count) override
	{
		if (file_.Read(buffer, count) != count) refuse_truncated_object();
		return count;
	}
	std::size_t Write(const void*, std::size_t) override { throw std::logic_error("read-only stream"); }
	std::uint64_t Seek(std::int64_t, TSeekOrigin) override { throw std::logic_error("stream without positions"); }
	std::uint64_t getTotalBytesCount() const override { return file_.getTotalBytesCount(); }
	std::uint64_t getPosition() const override { return file_.getPosition(); }

   private:
	PackedInput file_;
};

/// Why a CSignatureMap2D refused to be read, out of MRPT's report of several lines; empty if it did not.
std::string refusal_in(const std::string& report)
{
	const std::string before = "Original exception:\n";
	const auto object = report.find("'d2s1r::CSignatureMap2D'"), line = report.find(before, object);
	if (object == std::string::npos || line == std::string::npos) return "";
	const auto start = line + before.size();
	const std::string reason = report.substr(start, report.find('\n', start) - start);
	const bool is_of_mrpt = reason.rfind("==== MRPT", 0) == 0;
	return is_of_mrpt ? "" : reason;
}

mrpt::serialization::CSerializable::Ptr read_object(const std::string& file)
{
	mrpt::maps::registerAllClasses_mrpt_maps();
	try
	{
		WholeReads stream(file);
		return mrpt::serialization::archiveFrom<mrpt::io::CStream>(stream).ReadObject();
	}
	catch (const std::bad_alloc&)
	{
		throw;
	}
	catch (const std::exception& error)
	{
		const std::string refusal = refusal_in(error.what());
		if (!refusal.empty()) throw std::runtime_error(refusal);
		throw std::runtime_error(
		    "is not a map that can be read: truncated, or none of .simplemap, .gridmap, .yaml, image, MRPT metric map; "
		    "save it again as one of these");
	}
}

}  // namespace

std::shared_ptr<const OccupancyMap> read_mrpt_map(const std::string& file, const GridParameters& parameters)
{
	if (!kUnpacksZstd && is_packed_by_zstd(file))
		throw std::runtime_error("is packed by zstd, which this version of MRPT cannot read; unpack it by 'zstd -d'");
	mrpt::serialization::CSerializable::Ptr object;
	try
	{
		MapHeader(file).check();
		object = read_object(file);
	}
	catch (const std::runtime_error&)
	{
		// Says so if a read error was taken for the end of the file.
		read_blocks(file, [](const char*, std::size_t) { return true; });
		throw;
	}
	if (!object) throw std::runtime_error("holds an empty object, not a map; save the map again");
	return grid_of(*object, parameters);
}
}  // namespace d2s1r
