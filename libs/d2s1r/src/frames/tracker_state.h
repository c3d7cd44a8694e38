// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What a Tracker knows, and the steps by which a scan changes it.
#pragma once

#include <d2s1r/motion.h>
#include <d2s1r/tracker.h>

#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "frames/shared_surface.h"
#include "frames/window_tracker.h"

namespace d2s1r
{
/// A motion since a pose: what the odometry measured, and for how long nobody measured anything.
struct Travel
{
	mrpt::poses::CPose2D measured;
	double unmeasured = 0;  //!< [s]
};

/// A place where the robot may be.
struct Followed
{
	Hypothesis fix;                        //!< robot in map, when a scan confirmed the place last
	Travel since;                          //!< then
	bool is_seen = true;                   //!< whether the newest scan confirmed it
	double believed = 0;                   //!< [0, 1] probability by all scans but for what only the newest one says
	double probability = 0;                //!< [0, 1] with that
	double lately = 0;                     //!< [nat] evidence of the last scans, on average
	mrpt::math::CMatrixDouble33 moves{};   //!< (x, y, phi), mean square by which the last scans moved the pose
	mrpt::math::CMatrixDouble33 of_map{};  //!< of the pose, (x, y, phi), beyond that of `fix`: see shown()
	bool was_seen = false;                 //!< whether the scan before the newest one confirmed it, too
	bool is_checked = false;               //!< whether the odometry was compared with its pose last

	const std::string& map() const { return fix.map; }
};

/// What a scan says of the places that were looked at.
struct Look
{
	Localization answer;                                         //!< about all of them
	std::vector<std::optional<std::vector<Hypothesis>>> near{};  //!< by place that is followed, if it was looked at
	bool is_whole = false;                                       //!< whether all places of the maps were looked at
};

/// What a scan says of the places that are followed.
struct Told
{
	std::vector<double> evidence;   //!< [nat] see Evidence
	std::vector<double> explained;  //!< [0, 1]
	double absence = 0;             //!< [nat] see FrameEvidence
};

struct Tracker::State
{
	// Motion and answers: tracker.cpp.
	void travel(Travel& since, const std::optional<mrpt::poses::CPose2D>& motion, double seconds) const;
	PoseDensity predicted(const Followed& track) const;
	Hypothesis shown(const Followed& track) const;
	void move(const std::optional<mrpt::poses::CPose2D>& motion, double seconds);
	void take(const Scan& scan);
	void check_odometry(bool is_confirmed);
	bool is_sure() const;
	void settle_suggestion();
	Localization conclude(const std::string& held_because) const;
	const Localizer& localizer_of(const std::string& map) const { return *maps.at(map).localizer; }
	const ScoringParameters& scoring() const;

	// Where a scan is looked at: tracker_look.cpp.
	Look look_near(const Scan& scan, const std::vector<PlaceDensity>& expected) const;
	bool is_as_promised(const Look& look, const PlaceDensity& expected) const;
	bool is_since_search(double span) const;
	Look look(const Scan& scan, const std::vector<PlaceDensity>& expected);
	void add_suggested(const Scan& scan);

	// What is believed: tracker_belief.cpp.
	void believe(const Look& look, const std::vector<PlaceDensity>& expected, const Scan& scan);
	double absence_of(const Localization& answer, const Hypothesis& fittest) const;
	Told follow(const Look& look, const std::vector<PlaceDensity>& expected);
	void start_tracks(const Look& look, Told& told);
	std::size_t most_believed() const;
	double take_shown(const Scan& scan);
	void weigh_tracks(const Told& told, double shown);
	void drop_tracks();

	TrackedMaps maps;
	std::function<Localization(const Scan&)> search;  //!< in all of them
	WindowTuning tuning{};
	OdometryCheck odometry{};
	std::vector<Followed> tracks{};  //!< most probable first
	double believed_none = 1;        //!< [0, 1] see Followed::believed: that the robot is at none of the places
	double none = 1;                 //!< [0, 1] with what the newest scan says

	std::optional<double> last_time{};  //!< [s] of the last call of add()
	double since_told = HUGE_VAL;       //!< [s] since the last scan that told something
	double temperature = 1;             //!< [-] of that scan
	double last_explained = 0;          //!< [0, 1] share of its returns, at the most believed place
	Travel searched{};                  //!< since the last search of the whole map
	double since_search = HUGE_VAL;     //!< [s] the same
	double promised = 0;                //!< [0, 1] explained returns by the scans before at the best place
	std::map<std::string, ShownSurface> shown_surfaces{};  //!< by map, at the most believed place

	Travel checked{};        //!< since the odometry was checked
	double since_check = 0;  //!< [s]

	std::optional<PlaceDensity> suggested{};  //!< no scan has come since
	Prior suggested_region{};                 //!< of a suggestion that is open
	std::string suggested_map{};
	Suggestion suggestion = Suggestion::kNone;
};
}  // namespace d2s1r
