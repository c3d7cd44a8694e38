// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The map that a robot is localized in, and how another one takes its place.
#pragma once

#include <future>

#include "news.h"

namespace d2s1r::live
{
class MapSlot
{
   public:
	MapSlot(const LiveSettings& settings, News& news) : settings_(settings), news_(news), frame_(settings.map_frame) {}

	void use(std::shared_ptr<const Atlas> maps);
	void add(const ros::OccupancyGrid& map, PublisherId publisher);
	void set_publishers(const std::vector<PublisherId>& publishers);

	/// Takes the index over that has been built meanwhile. \return whether another map is in use now
	bool poll();

	/// Waits until the index is built, which poll() takes over then.
	void wait();
	bool is_indexing() const { return building_.valid() || (settings_.has_maps_of_its_own && !maps_); }

	/// Returns the maps in use, also while another one is indexed; null while there is none.
	const std::shared_ptr<const Atlas>& maps() const { return maps_; }

	/// Returns the frame of the poses in a map of these.
	std::string frame_of(const std::string& map) const;

	/// Returns whether poses in this frame are in one of the maps.
	bool has_frame(const std::string& frame) const;

	const std::string& description() const { return description_; }  //!< for people; empty without a map
	const std::string& problem() const { return problem_; }          //!< why the newest map is not used; else empty
	int built() const { return built_; }

   private:
	/// What became of a map.
	struct Built
	{
		std::shared_ptr<const Atlas> maps;  //!< null: `note` says why
		std::string frame;
		std::string description;
		std::string note;  //!< for people; may be empty
	};
	bool is_present(PublisherId publisher) const;
	void start();
	static Built build(const ros::OccupancyGrid& map, const LiveSettings& settings);

	const LiveSettings& settings_;
	News& news_;
	std::shared_ptr<const Atlas> maps_;
	std::shared_ptr<const ros::OccupancyGrid> newest_;   //!< that came and was not refused; null: none
	std::shared_ptr<const ros::OccupancyGrid> indexed_;  //!< in `building_`, or there last
	PublisherId publisher_ = 0;                          //!< of the newest one
	std::future<Built> building_;
	std::vector<PublisherId> publishers_;
	std::string description_;
	std::string problem_;
	std::string frame_;
	bool told_other_ = false;  //!< that another publisher has a map
	bool told_change_ = false;
	int built_ = 0;
};
}  // namespace d2s1r::live
