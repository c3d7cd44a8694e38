// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/prior.h>

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "frames/tracks.h"

namespace d2s1r
{
/// A map that the robot may be in.
struct TrackedMap
{
	const Localizer* localizer;
	Prior prior;  //!< of the robot at every frame
};

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

   private:
	/// A frame of the window.
	struct Frame
	{
		Scan scan;
		std::vector<Hypothesis> one_shot;               //!< what the scan says alone
		double reference = 0;                           //!< [nat] log-likelihood of the best pose
		mrpt::poses::CPose2D motion;                    //!< since the frame before, in the robot frame then, m and rad
		mrpt::math::CMatrixDouble33 motion_covariance;  //!< (x, y, phi), m^2, m rad, rad^2
	};

	/// \throws std::invalid_argument if a hypothesis is in no map of this window, or is not sound
	void check_arguments(const Localization& one_shot) const;

	void pass_gap(const std::optional<mrpt::poses::CPose2D>& motion);
	bool link(Frame& frame, const Localization& one_shot, const std::optional<mrpt::poses::CPose2D>& motion) const;
	void follow(const Localization& one_shot);
	void start_tracks(const Localization& one_shot);
	bool trace_back(Track& track) const;
	bool lost(const Localization& one_shot) const;
	void forget();
	void prune();
	bool contradicts(const Localization& one_shot) const;
	void begin_with(const Localization& one_shot);
	Localization conclude(const Localization& one_shot) const;

	const Localizer& localizer_of(const std::string& map) const { return *maps_.at(map).localizer; }

	/// Returns whether two hypotheses count as one place.
	static bool one_place(const Hypothesis& a, const Hypothesis& b);

	/// Returns the probability [0, 1] that the one-shot hypotheses of a frame give to the place of another one.
	static double probability_at(const Hypothesis& place, const std::vector<Hypothesis>& one_shot);

	std::map<std::string, TrackedMap> maps_;  //!< by name
	std::size_t most_frames_;
	WindowTuning tuning_;
	OdometryCheck odometry_check_;
	int gap_ = 0;  //!< [frames] the last ones in a row whose scans were not usable, or of a covered sensor
	std::optional<mrpt::poses::CPose2D> gap_motion_;  //!< over these frames; no value if that of one is not known
	std::deque<Frame> frames_;                        //!< newest last
	std::vector<Track> tracks_;                       //!< best first
};
}  // namespace d2s1r
