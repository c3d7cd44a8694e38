// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>

#include <cstdint>
#include <optional>

namespace d2s1r
{
/// Says whether scans agree with where a tracker thinks that the robot is.
enum class Verdict : std::uint8_t
{
	kFits,       //!< the scan is localized where the tracker is
	kLost,       //!< several localized scans in a row, consistent with the odometry, are away from the tracker
	kCannotTell  //!< neither
};

/// Returns `fits`, `lost` or `cannot tell`.
const char* to_string(Verdict verdict);

/// Says when a tracker counts as lost.
struct WatchSettings
{
	int scans = 4;          //!< [-] localized scans in a row, at least 1
	double distance = 0.4;  //!< [m] between the pose of the tracker and that of the scan, above 0
};

/// Says what one scan tells about a tracker.
struct WatchedScan
{
	Verdict verdict = Verdict::kCannotTell;
	int consistent = 0;              //!< [-] localized scans up to this one whose poses the odometry links
	int away = 0;                    //!< [-] those of them, up to this one, that are away from the tracker
	std::optional<double> distance;  //!< [m] from the tracker to the best place; no value without both
	std::optional<double> turn;      //!< [rad] between their yaws, at least 0
	/// [nat] Log-likelihood of the scan near the tracker's pose minus that at the best place; 0 is the best that a
	/// tracker can have, lower is worse. No value without both.
	std::optional<double> agreement;
};

/// Watches a tracker by the scans of the robot that it tracks. The same code serves running robots and logs. Use one
/// object per robot; it is not thread-safe.
class TrackerMonitor
{
   public:
	/// \throws std::invalid_argument if a setting is out of range
	explicit TrackerMonitor(const WatchSettings& settings = {});

	/// Takes in the next scan; call it for every one.
	/// \param localizer of the map that the tracker is in
	/// \param localization of this scan
	/// \param motion of the robot since the last call, in its frame then; no value: nobody measured it
	/// \param tracker robot in map by the tracker when the scan was taken; no value: it has no pose
	WatchedScan add(
	    const Localizer& localizer, const Scan& scan, const Localization& localization,
	    const std::optional<mrpt::poses::CPose2D>& motion, const std::optional<mrpt::poses::CPose2D>& tracker);

	/// Returns whether two poses are so near to each other that a tracker at one of them fits the other.
	bool are_near(const mrpt::poses::CPose2D& a, const mrpt::poses::CPose2D& b) const;

	/// Returns the settings that were given to the constructor.
	const WatchSettings& settings() const { return settings_; }

	/// Forgets all scans.
	void clear();

   private:
	int add_to_chain(const Localization& localization);

	WatchSettings settings_;
	std::optional<Hypothesis> last_;                                      //!< of the newest localized scan
	std::optional<mrpt::poses::CPose2D> since_ = mrpt::poses::CPose2D();  //!< motion since that scan
	int unmeasured_ = 0;  //!< [-] motions since then that nobody measured
	int consistent_ = 0;  //!< [-] localized scans in a row
	int away_ = 0;        //!< [-] the same, away from the tracker
};
}  // namespace d2s1r
