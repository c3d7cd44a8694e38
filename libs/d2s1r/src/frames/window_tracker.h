// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/atlas.h>
#include <d2s1r/prior.h>

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "frames/shared_surface.h"
#include "frames/tracks.h"

namespace d2s1r
{
/// A map that the robot may be in.
struct TrackedMap
{
	const Localizer* localizer;
	Prior prior;  //!< of the robot at every frame
};

using TrackedMaps = std::map<std::string, TrackedMap>;  //!< by name

/// \throws std::invalid_argument naming `who` follows a robot if the method of a map is kPaper
TrackedMaps checked(TrackedMaps maps, const std::string& who);

/// Throws as checked() does.
TrackedMaps maps_of(const Atlas& atlas, const std::string& who);

/// What WindowLocalizer does, with parameters that no application sets. It is implemented in window_localizer.cpp.
class WindowTracker
{
   public:
	/// \param maps by name
	/// \param frames [-] that are judged together
	/// \throws std::invalid_argument if `frames` is below 1
	WindowTracker(std::map<std::string, TrackedMap> maps, int frames, const WindowTuning& tuning = {});

	/// Does what WindowLocalizer::add() does.
	Localization add(
	    const Scan& scan, const Localization& one_shot, const std::optional<mrpt::poses::CPose2D>& odometry);

	/// Returns the parameters of section scan, which all maps share.
	const ScanParameters& scan_parameters() const { return maps_.begin()->second.localizer->parameters().scan; }

	/// Returns what each frame of the window tells, oldest first.
	std::vector<FrameEvidence> frames() const;

	/// Returns what localized scans told of the odometry.
	const OdometryEstimate& odometry() const { return odometry_check_.estimate(); }

	/// Returns the places that the robot may be at, most probable first.
	const std::vector<Track>& tracks() const { return tracks_; }

   private:
	/// A frame of the window.
	struct Frame
	{
		Scan scan;
		ShownSurface shown;                //!< by it, in the robot frame
		std::vector<Hypothesis> one_shot;  //!< what the scan says alone
		Reference reference;               //!< of the places of the frame
		double absence = 0;                //!< [nat] see FrameEvidence
		GuessedMotion motion;              //!< since the frame before
		std::vector<double> seen_before;   //!< [0, 1] see FrameEvidence
	};

	/// \throws std::invalid_argument if a hypothesis is in no map of this window, or a number is not sound
	void check_arguments(const Localization& one_shot) const;

	void pass_gap(const std::optional<PoseDensity>& motion);
	GuessedMotion motion_to(const Localization& one_shot, const std::optional<PoseDensity>& motion);
	std::vector<double> seen_again(const Scan& scan, const GuessedMotion& motion) const;
	void append(const Scan& scan, const Localization& one_shot, const GuessedMotion& motion);
	std::vector<Hypothesis> places_near(
	    const PoseDensity& predicted, const Localizer& localizer, const Scan& scan, std::vector<Hypothesis> one_shot,
	    bool searched) const;
	void follow(const Localization& one_shot);
	void start_tracks(const Localization& one_shot);
	void trace_back(Track& track) const;
	void judge();
	void set_probabilities();
	void sort_tracks();
	double listed(const Localization& one_shot) const;
	Localization conclude(const Localization& one_shot) const;

	const Localizer& localizer_of(const std::string& map) const { return *maps_.at(map).localizer; }

	std::map<std::string, TrackedMap> maps_;  //!< by name
	std::size_t most_frames_;
	WindowTuning tuning_;
	OdometryCheck odometry_check_;
	int gap_ = 0;  //!< [frames] the last ones in a row whose scans were not usable, or of a covered sensor
	std::optional<PoseDensity> gap_motion_;  //!< over these frames; no value if that of one is not known
	std::deque<Frame> frames_;               //!< newest last
	std::vector<Track> tracks_;              //!< best first
	double none_ = 1;                        //!< [0, 1] probability that no track is right
};
}  // namespace d2s1r
