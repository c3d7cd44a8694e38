// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/for_programs.h>
#include <d2s1r/map_io.h>
#include <d2s1r/version.h>
#include <mrpt/maps/registerAllClasses.h>
#include <mrpt/serialization/CArchive.h>

#include D2S1R_UNPACKING
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "base/file_text.h"
#include "map/map_image.h"
#include "map/occupancy_map.h"

namespace d2s1r
{
namespace
{
using mrpt::maps::COccupancyGridMap2D;
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

COccupancyGridMap2D::Ptr load_serialized(const std::string& file, const GridParameters& parameters)
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

COccupancyGridMap2D::Ptr load_any(
    const std::string& file, const GridParameters& parameters, const std::optional<ImageGeometry>& image,
    MapChange change)
{
	check_readable(file);
	if (is_yaml_name(file)) return load_yaml_map(file, change);
	if (is_image_name(file))
	{
		if (!image)
			throw std::runtime_error(
			    "an image needs its resolution in m / pixel; give it, or write a map_server yaml for the image");
		PixelRule rule = plain_image_rule();
		if (change == MapChange::kNegated)
			rule.p_occupied = [as_it_is = rule.p_occupied](double brightness) { return as_it_is(1 - brightness); };
		return load_image_map(file, *image, rule);
	}
	return load_serialized(file, parameters);
}

/// Says what to do about a map without free cells.
std::string how_to_free_cells(const std::string& file, MapChange change, const GridParameters& parameters)
{
	const LostCells lost = change == MapChange::kNone ? lost_cells(file, parameters) : LostCells();
	if (lost.free_made_unknown > 0)
		return "its light greys lie above free_thresh and are unknown: set mode to scale, or raise free_thresh";
	if (lost.beyond_raw > 0)
		return "its mode: raw reads pixels from 101 to 254 as unknown cells: set mode to trinary or scale";
	return "check the map, grid.free_threshold and negate";
}
}  // namespace

COccupancyGridMap2D::Ptr load_changed_map(
    const std::string& file, MapChange change, const GridParameters& parameters,
    const std::optional<ImageGeometry>& image)
{
	COccupancyGridMap2D::Ptr map;
	try
	{
		map = load_any(file, parameters, image, change);
		check_map_origin(static_cast<double>(map->getXMin()), static_cast<double>(map->getYMin()));
	}
	catch (const std::bad_alloc&)
	{
		const bool is_checked = is_yaml_name(file) || is_image_name(file);  // that it holds what its header says
		throw std::runtime_error(
		    file + ": takes more memory than there is" +
		    (is_checked ? "; use a coarser or smaller map, or end other programs"
		                : ", or is damaged; use a coarser map, or save it again"));
	}
	catch (const std::exception& error)
	{
		throw std::runtime_error(file + ": " + error.what());
	}
	if (!has_free_cell(*map, CellClasses(parameters)))
		throw std::runtime_error(file + ": has no free cell; " + how_to_free_cells(file, change, parameters));
	return map;
}

COccupancyGridMap2D::Ptr load_map(
    const std::string& file, const GridParameters& parameters, const std::optional<ImageGeometry>& image)
{
	return load_changed_map(file, MapChange::kNone, parameters, image);
}
}  // namespace d2s1r
