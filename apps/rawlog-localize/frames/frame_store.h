// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/math/TPose2D.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "frames/frame.h"
#include "frames/spill_file.h"

namespace d2s1r::app
{
/// What is kept in memory of a frame.
struct KeptFrame
{
	double timestamp = 0;         //!< [s] see Frame
	mrpt::math::TPose2D pose;     //!< the best one in its map, m and rad, if there is one
	mrpt::math::TPose2D fused;    //!< in its map, m and rad, if is_fused
	StageTimes times;             //!< [ms]
	double step_ms = 0;           //!< [ms] FusedPose::step_ms
	std::uint16_t map = 0;        //!< of the best pose: see FrameStore::map_names()
	std::uint16_t fused_map = 0;  //!< of the fused pose
	Status status = Status::kInvalid;
	FusionStatus fusion_status = FusionStatus::kAmbiguous;
	FusionEvent event = FusionEvent::kNone;
	bool has_pose = false;
	bool is_fused = false;
	std::optional<Verdict> verdict{};  //!< about the tracker, with --check

	bool localized() const { return status == Status::kLocalized; }
};

/// What is kept in memory of what the Tracker of --track says.
struct KeptTrack
{
	Status status = Status::kRejected;
	std::optional<mrpt::math::TPose2D> pose;  //!< the best one in its map, m and rad
	double add_ms = 0;                        //!< [ms] see Tracker::add()
};

/// Returns what is kept of a frame in memory, but for its maps.
KeptFrame keep(const Frame& frame);

/// The frames of a run, in their order. Little of each is in memory, all that the outputs show of it in a file, since
/// a log may be as long as a day.
class FrameStore
{
   public:
	/// \param folder where there is room for the file
	explicit FrameStore(const std::filesystem::path& folder) : file_(folder) {}

	void add(const Frame& frame);

	const std::vector<KeptFrame>& kept() const { return kept_; }

	/// Returns what the Tracker says, frame by frame; empty without --track.
	const std::vector<KeptTrack>& tracked() const { return tracked_; }

	/// Returns the names of the maps that poses are in; that of the only map is empty.
	const std::vector<std::string>& map_names() const { return map_names_; }

	/// Returns the reasons why frames have this status (Localization::note), and how many have each.
	const std::map<std::string, std::size_t>& notes(Status status) const;

	/// Reads all frames again, as they were added but for the members that no output at the end of a run shows:
	/// relative entropy, times but the whole, and of fused poses all but pose, map, status, event and probability.
	void visit(const std::function<void(const Frame&)>& look) const;

   private:
	std::uint16_t number_of(const std::string& map);

	mutable SpillFile file_;
	std::vector<KeptFrame> kept_;
	std::vector<KeptTrack> tracked_;
	std::vector<std::string> map_names_;
	std::map<Status, std::map<std::string, std::size_t>> notes_;
};
}  // namespace d2s1r::app
