// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Maps from files, and from the objects that MRPT serializes.
#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/map_io.h>
#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/maps/registerAllClasses.h>
#include <mrpt/serialization/CArchive.h>

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "map/cell_classes.h"
#include "map/map_files.h"
#include "map/map_image.h"
#include "map/map_yaml.h"
#include "map/occupancy_map.h"

namespace d2s1r
{
namespace
{
using mrpt::maps::COccupancyGridMap2D;

/// A serialized grid starts with its class name, version, bits of a cell, numbers of cells and extent: looked at before
/// MRPT allocates the cells of that extent.
void check_serialized_size(const std::string& file)
{
	const std::string name = "mrpt::maps::COccupancyGridMap2D";
	struct Header
	{
		char name_length, name[31], version, cell_bits, cells[8], extent[20];
	} header;
	static_assert(sizeof(Header) == 62, "as written, without padding");
	struct Extent
	{
		float x_min, x_max, y_min, y_max, cell_size;  // [m]
	} extent;
	static_assert(sizeof(extent) == sizeof(header.extent));
	mrpt::io::CFileGZInputStream stream;
	if (!stream.open(file) || stream.Read(&header, sizeof(header)) != sizeof(header)) return;
	if (std::string(header.name, sizeof(header.name)) != name) return;
	std::memcpy(&extent, header.extent, sizeof(extent));
	const auto cells = [&](float from, float to) {
		return std::round(
		    (static_cast<double>(to) - static_cast<double>(from)) / static_cast<double>(extent.cell_size));
	};
	check_map_size(cells(extent.x_min, extent.x_max), cells(extent.y_min, extent.y_max));
}

/// Throws at the end of the file, where MRPT's archive goes on with numbers that were never read.
class WholeReads : public mrpt::io::CStream
{
   public:
	explicit WholeReads(const std::string& file) : file_(file) {}
	std::size_t Read(void* buffer, std::size_t count) override
	{
		if (file_.Read(buffer, count) != count) throw std::runtime_error("is truncated; copy or save it again");
		return count;
	}
	std::size_t Write(const void*, std::size_t) override { throw std::logic_error("read-only stream"); }
	std::uint64_t Seek(std::int64_t, TSeekOrigin) override { throw std::logic_error("stream without positions"); }
	std::uint64_t getTotalBytesCount() const override { return file_.getTotalBytesCount(); }
	std::uint64_t getPosition() const override { return file_.getPosition(); }

   private:
	mrpt::io::CFileGZInputStream file_;
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
	check_serialized_size(file);
	const auto object = read_object(file);
	if (!object) throw std::runtime_error("holds an empty object, not a map; save the map again");
	return grid_of(*object, parameters);
}

COccupancyGridMap2D::Ptr load_any(
    const std::string& file, const GridParameters& parameters, const std::optional<ImageGeometry>& image)
{
	check_readable(file);
	if (is_yaml_name(file)) return load_yaml_map(file);
	if (is_image_name(file))
	{
		if (!image) throw std::runtime_error("an image needs its resolution in m / pixel; give its geometry");
		return load_image_map(file, *image, plain_image_rule());
	}
	return load_serialized(file, parameters);
}
}  // namespace

COccupancyGridMap2D::Ptr load_map(
    const std::string& file, const GridParameters& parameters, const std::optional<ImageGeometry>& image)
{
	COccupancyGridMap2D::Ptr map;
	try
	{
		map = load_any(file, parameters, image);
		check_map_origin(static_cast<double>(map->getXMin()), static_cast<double>(map->getYMin()));
	}
	catch (const std::bad_alloc&)
	{
		throw std::runtime_error(file + ": does not fit in memory");
	}
	catch (const std::exception& error)
	{
		throw std::runtime_error(file + ": " + error.what());
	}
	if (!has_free_cell(*map, CellClasses(parameters)))
		throw std::runtime_error(file + ": has no free cell; check the map, grid.free_threshold and negate");
	return map;
}

COccupancyGridMap2D::Ptr grid_of(const mrpt::serialization::CSerializable& map, const GridParameters& parameters)
{
	if (const auto* grid = dynamic_cast<const COccupancyGridMap2D*>(&map))
		return std::make_shared<COccupancyGridMap2D>(*grid);
	if (const auto* keyframes = dynamic_cast<const mrpt::maps::CSimpleMap*>(&map))
		return draw_simple_map(*keyframes, parameters.simplemap_cell_size);
	if (const auto* maps = dynamic_cast<const mrpt::maps::CMultiMetricMap*>(&map))
	{
		if (const auto grid = maps->mapByClass<COccupancyGridMap2D>()) return grid_of(*grid, parameters);
		if (const auto signature_map = maps->mapByClass<CSignatureMap2D>()) return grid_of(*signature_map, parameters);
	}
	if (const auto* signature_map = dynamic_cast<const CSignatureMap2D*>(&map))
		if (!signature_map->isEmpty()) return std::make_shared<COccupancyGridMap2D>(*signature_map->grid());
	throw std::invalid_argument(
	    std::string("an object of class ") + map.GetRuntimeClass()->className +
	    " that holds no occupancy grid; give a map with one");
}
}  // namespace d2s1r
