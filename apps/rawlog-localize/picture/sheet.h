// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>
#include <mrpt/math/TPoint2D.h>
#include <shell/indexed_maps.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "frames/frame_store.h"

namespace d2s1r::app
{
/// The name of a map on a sheet, in the free space above the map.
struct MapName
{
	std::string name;
	mrpt::math::TPoint2D start;  //!< [m] frame of the sheet: left end of the text, at half of its height
	double height;               //!< [m] of the free space
};

/// Returns a text with U+FFFD for what is not UTF-8, which cairo takes for an error; names of files may hold any bytes.
std::string with_utf8_only(const std::string& text);

/// The frames of a run as they are drawn: in the frame of their map, or of a sheet of several maps.
class DrawnFrames
{
   public:
	/// \param frames outlives the object
	explicit DrawnFrames(const FrameStore& frames) : store_(frames) {}

	/// \param shifts [m] from the frame of a map to that of the sheet, by its name
	DrawnFrames(const FrameStore& frames, std::map<std::string, mrpt::math::TPoint2D> shifts);

	const std::vector<KeptFrame>& kept() const { return shifts_.empty() ? store_.kept() : moved_; }

	/// Reads all frames again, see FrameStore::visit(). Hypotheses in maps that are not on the sheet are left out.
	void visit(const std::function<void(const Frame&)>& look) const;

   private:
	void move(const std::string& map, mrpt::math::TPose2D& pose) const;

	const FrameStore& store_;
	std::map<std::string, mrpt::math::TPoint2D> shifts_;
	std::vector<KeptFrame> moved_;
};

/// The maps of an atlas that frames are in, side by side as if they were one.
struct Sheet
{
	Grid grid;                                           //!< cells as small as the smallest of the maps
	std::vector<MapName> names;                          //!< of the maps
	std::map<std::string, mrpt::math::TPoint2D> shifts;  //!< see DrawnFrames
};

/// Draws a sheet of the maps in which frames have their best or fused pose; of the first map if none has one.
Sheet make_sheet(const std::vector<IndexedMap>& maps, const FrameStore& frames);
}  // namespace d2s1r::app
