// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The map that a robot is localized in, and how another one takes its place.
#pragma once

#include <future>

#include "live/live_localizer.h"

namespace d2s1r::live
{
class MapSlot
{
   public:
	explicit MapSlot(const LiveSettings& settings) : settings_(settings), frame_(settings.map_frame) {}

	void use(std::shared_ptr<const Atlas> maps);
	void add(const ros::OccupancyGrid& map, PublisherId publisher);
	void set_publishers(const std::vector<PublisherId>& publishers);

	/// Takes the index over that has been built meanwhile. \return whether another map is in use now
	bool poll();

	/// Waits until all indices are built, which poll() takes over then.
	void wait();
	bool is_indexing() const { return building_.valid() || next_ || (settings_.has_maps_of_its_own && !maps_); }

	/// Returns the maps in use; null while there is none and while another one is indexed.
	const std::shared_ptr<const Atlas>& maps() const { return maps_; }

	/// Returns the frame of the poses in a map of these.
	std::string frame_of(const std::string& map) const;

	/// Returns whether poses in this frame are in one of the maps.
	bool has_frame(const std::string& frame) const;

	const std::string& description() const { return description_; }  //!< for people; empty without a map
	const std::string& problem() const { return problem_; }          //!< why there is no map; else empty
	int built() const { return built_; }
	std::vector<std::string> news;  //!< for the owner to take

   private:
	struct Task
	{
		mrpt::maps::COccupancyGridMap2D::Ptr grid;
		std::string frame;
		std::uint64_t fingerprint = 0;
		PublisherId publisher = 0;
	};
	struct Built
	{
		std::shared_ptr<const Atlas> maps;  //!< null: `problem` says why
		std::string problem;
	};
	bool is_present(PublisherId publisher) const;
	void start(Task task);
	static Built build(const Task& task, const LiveSettings& settings);

	const LiveSettings& settings_;
	std::shared_ptr<const Atlas> maps_;
	Task task_;                 //!< of the map in use, or of the one that is being indexed
	std::optional<Task> next_;  //!< to be indexed after that
	std::future<Built> building_;
	std::vector<PublisherId> publishers_;
	std::string description_;
	std::string problem_;
	std::string frame_;
	std::uint64_t told_ = 0;  //!< fingerprint of the last map that was not used
	int built_ = 0;
};
}  // namespace d2s1r::live
