// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// When a tracker is told where the robot is, and whether it took it.
#pragma once

#include <functional>

#include "news.h"

namespace d2s1r::live
{
class Seeder
{
   public:
	/// Makes a seed of an answer, or says in `problem` why it must not.
	using Make = std::function<std::optional<Seed>(const ScanAnswer& answer, std::string& problem)>;

	Seeder(const LiveSettings& settings, const TrackerMonitor& monitor, News& news)
	    : settings_(settings), monitor_(monitor), news_(news)
	{
	}

	/// Says how many readers of seeds there are, and have been.
	/// \return whether one has come or gone, so that what the tracker said before may be that of a dead one
	bool set_readers(int present, int ever);

	/// Asks for a seed by the next localized scan.
	void request() { requested_ = true; }

	/// Decides after each scan. \param tracker the pose of the tracker at the time of the scan, and when it was told
	std::optional<Seed> consider(
	    const ScanAnswer& answer, const std::optional<std::pair<Time, mrpt::poses::CPose2D>>& tracker,
	    const Make& make);

	/// Forgets seeds that were not checked yet, for the clock ran back; they count as not sent.
	void clear();

	/// Begins anew with trackers that are there, for the map is another one.
	void start_again();

	/// Begins anew, for seeds were wrong: the laser was read wrongly.
	void take_back();

	const std::string& problem() const { return problem_; }  //!< an error, after all attempts; else empty
	const std::string& waiting() const { return waiting_; }  //!< why there is no seed yet; else empty
	int sent() const { return sent_; }                       //!< [-] seeds so far
	bool is_satisfied() const { return satisfied_ >= ever_ && !outstanding_; }

   private:
	bool check_outstanding(
	    const ScanAnswer& answer, const std::optional<std::pair<Time, mrpt::poses::CPose2D>>& tracker);
	bool is_wanted(const ScanAnswer& answer);

	const LiveSettings& settings_;
	const TrackerMonitor& monitor_;
	News& news_;
	int present_ = 0;
	int ever_ = 0;
	int satisfied_ = 0;              //!< [-] of the readers that ever were: these need no first seed
	bool is_new_ = false;            //!< whether one of these came after the last scan
	std::optional<Time> new_since_;  //!< time of the first scan after the last of them came
	bool requested_ = false;
	bool is_misled_ = false;  //!< whether a tracker that agrees with the scans may do so by a wrong seed
	bool gave_up_ = false;
	std::optional<Seed> outstanding_;  //!< sent, and not yet checked
	Time since_ = 0;                   //!< of the scan that made it
	int attempts_ = 0;                 //!< [-] of this seed
	int sent_ = 0;
	std::string problem_;
	std::string waiting_;
};
}  // namespace d2s1r::live
