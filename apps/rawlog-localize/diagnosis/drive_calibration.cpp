// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/drive_calibration.h"

#include <base/threads.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>
#include <ros/drive_calibration.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>

#include "cli/console.h"
#include "cli/values.h"
#include "evaluation/accuracy.h"
#include "frames/logged_scan.h"

namespace d2s1r::app
{
using mrpt::poses::CPose2D;
using mrpt::poses::CPose3D;

namespace
{
/// The scans of a drive that are tried, what the localizer says of them, and the odometry around them.
struct DriveSamples
{
	std::vector<LoggedScan> scans;
	std::vector<std::size_t> numbers;                  //!< [-] of these, in the log
	std::vector<std::optional<Localization>> answers;  //!< to these; no value: not searched
	std::vector<d2s1r::TimedPose> odometry;            //!< by increasing time [s] by its clock
	std::vector<double> lags;    //!< [s] of the odometry's clock when a scan came, minus the time of the scan
	std::vector<double> stamps;  //!< [s] of all scans of the log

	/// Returns where a sample was found; null if it was not.
	const Hypothesis* found(std::size_t i) const
	{
		return answers[i] && answers[i]->status == Status::kLocalized ? &answers[i]->best() : nullptr;
	}
};

/// Chooses scans between which the robot moves, some in a row in each of some parts of the log.
class SampleChooser
{
   public:
	SampleChooser(std::string label, std::size_t scans) : label_(std::move(label)), scans_(scans) {}

	DriveSamples choose(logs::LogReader& reader)
	{
		while (!interrupted())
		{
			const auto object = reader.next();
			if (!object) break;
			if (object->increment) robot_ = robot_ + *object->increment;
			if (object->odometry && object->odometry_time > 0) add_reading(*object);
			for (std::size_t i = 0; i < object->scans.size(); i++)
			{
				if (object->scans[i]->label != label_) continue;
				samples_.stamps.push_back(logs::to_seconds(object->scans[i]->timestamp));
				if (object->increment) add_odometry(samples_.stamps.back());
				add(logged_scan(object->scans[i], object->details[i]));
			}
		}
		std::stable_sort(
		    samples_.odometry.begin(), samples_.odometry.end(),
		    [](const d2s1r::TimedPose& a, const d2s1r::TimedPose& b) { return a.time < b.time; });
		samples_.answers.resize(samples_.scans.size());
		return std::move(samples_);
	}

   private:
	static constexpr std::size_t kParts = 10, kInPart = 6;  // [-] of the log; scans of each
	static constexpr double kAround = 6;                    // [s] of odometry that is kept before and after a scan

	/// Takes a reading of the odometry that comes first, if there are two.
	void add_reading(const logs::RawlogObject& object)
	{
		if (!source_) source_ = object.odometry_source;
		if (object.odometry_source != *source_) return;
		robot_ = *object.odometry;
		add_odometry(1e-9 * static_cast<double>(object.odometry_time));
	}

	void add_odometry(double time)
	{
		newest_ = time;
		if (now_ < then_ + kAround)
		{
			samples_.odometry.push_back({time, robot_.asTPose()});
			return;
		}
		recent_.push_back({time, robot_.asTPose()});
		while (recent_.back().time - recent_.front().time > kAround) recent_.pop_front();
	}

	void add(const LoggedScan& scan)
	{
		const std::size_t part = kParts * count_++ / std::max<std::size_t>(1, scans_);
		if (part != part_) part_ = part, in_part_ = 0;
		now_ = logs::to_seconds(scan.observation->timestamp);
		const CPose2D motion = robot_ - robot_then_;
		const bool tells_more =
		    now_ > then_ + ros::kBetweenScans && ros::tells_more(motion.norm(), std::abs(motion.phi()));
		const bool is_few = scans_ <= kParts * kInPart;  // of which all are tried
		if (in_part_ >= kInPart || now_ <= 0 || !(is_few || tells_more)) return;
		if (newest_) samples_.lags.push_back(*newest_ - now_);
		samples_.odometry.insert(samples_.odometry.end(), recent_.begin(), recent_.end());
		recent_.clear();
		samples_.scans.push_back(scan);
		samples_.numbers.push_back(count_ - 1);
		robot_then_ = robot_;
		then_ = now_;
		in_part_++;
	}

	std::string label_;
	std::size_t scans_, count_ = 0, part_ = 0, in_part_ = 0;  //!< [-]
	CPose2D robot_, robot_then_;                              //!< in the frame of the odometry
	double now_ = 0, then_ = -kAround;                        //!< [s] by the clock of the scans
	std::optional<ros::OdometrySource> source_;
	std::optional<double> newest_;         //!< [s] of the odometry
	std::deque<d2s1r::TimedPose> recent_;  //!< odometry that is not needed so far
	DriveSamples samples_;
};

/// Returns the samples by another mounting, by which they are not searched yet.
DriveSamples mounted(DriveSamples samples, const ros::Mounting& mounting)
{
	for (LoggedScan& scan : samples.scans) scan = read_by(mounting.overrides, std::move(scan));
	samples.answers.assign(samples.scans.size(), std::nullopt);
	return samples;
}

/// Localizes those of the samples that were not yet. Returns how many of them are found.
/// \param numbers [-] of them
std::size_t localize(
    DriveSamples& samples, const std::vector<std::size_t>& numbers, const SearchRequest& search, const Atlas& atlas)
{
	const ScanParameters& parameters = atlas.maps().front().localizer->parameters().scan;
	const Query query = {{}, search.query.time_budget, search.query.stop};  // maps have their regions
	parallel_for(
	    numbers.size(), search.threads,
	    [&](std::size_t i)
	    {
		    auto& answer = samples.answers[numbers[i]];
		    if (answer || interrupted()) return;
		    Localization found = atlas.localize(scan_of(samples.scans[numbers[i]], parameters), query);
		    if (!interrupted()) answer = std::move(found);  // else the search may have been stopped
	    });
	const auto is_found = [&](std::size_t i) { return samples.found(i) != nullptr; };
	return static_cast<std::size_t>(std::count_if(numbers.begin(), numbers.end(), is_found));
}

/// Returns each `step`-th of the samples.
std::vector<std::size_t> each(const DriveSamples& samples, std::size_t step)
{
	std::vector<std::size_t> numbers;
	for (std::size_t i = 0; i < samples.scans.size(); i += step) numbers.push_back(i);
	return numbers;
}

/// Returns the mounting by which most scans are found, if these are far more than by that of the messages, by which
/// they have been searched.
ros::Mounting other_mounting(
    DriveSamples& samples, const logs::Sensor& sensor, const logs::Overrides& overrides, const SearchRequest& search,
    const Atlas& atlas)
{
	constexpr std::size_t kEnough = 20;  // [-] scans of those that there are
	const std::vector<std::size_t> tried = each(samples, std::max<std::size_t>(1, samples.scans.size() / kEnough));
	const auto mountings = other_mountings(samples.scans, sensor.other_angles, overrides);
	std::vector<std::size_t> found_by;
	for (const ros::Mounting& mounting : mountings)
	{
		DriveSamples read = mounted(samples, mounting);
		found_by.push_back(localize(read, tried, search, atlas));
	}
	return ros::best_of(mountings, found_by, tried.size(), localize(samples, tried, search, atlas));
}

/// What the messages say of the samples, and what is known beside that.
struct Beforehand
{
	calibration::Reading told;
	calibration::Given given;
};

Beforehand beforehand_of(const DriveSamples& samples, const logs::Sensor& sensor, const logs::Overrides& overrides)
{
	const CPose3D laser = samples.scans.front().observation->laser();
	std::vector<double> firsts, durations;
	bool is_elsewhere = false;
	for (const LoggedScan& scan : samples.scans)
	{
		firsts.push_back(scan.sweep.first_beam);
		durations.push_back(scan.sweep.beam_step * (static_cast<double>(scan.observation->size()) - 1));
		is_elsewhere = is_elsewhere || ros::is_elsewhere(scan.observation->laser(), laser);
	}
	Beforehand known;
	const ros::SweepTime sweep{percentile(durations, 0.5), percentile(firsts, 0.5)};
	known.told = ros::told_reading(laser, sweep, {});  // what is given is in the scans
	known.given = ros::known_by(overrides);
	auto& is_known = known.given.known;
	if (sensor.is_the_robot || is_elsewhere)
		is_known[calibration::kYaw] = is_known[calibration::kX] = is_known[calibration::kY] = true;
	known.given.stamps = samples.stamps;
	known.given.are_angles_doubtful = sensor.other_angles.has_value();
	const double lag = samples.lags.empty() ? 0 : percentile(samples.lags, 0.5);
	if (std::abs(lag) > 1) known.given.clocks.push_back(lag);
	return known;
}

/// Returns the map in which most of the samples are found.
const AtlasMap& map_of(const Atlas& atlas, const DriveSamples& samples)
{
	std::map<std::string, int> found;
	for (std::size_t i = 0; i < samples.scans.size(); i++)
		if (const Hypothesis* const best = samples.found(i)) found[best->map]++;
	const auto is_less = [](const auto& a, const auto& b) { return a.second < b.second; };
	const auto most = std::max_element(found.begin(), found.end(), is_less);
	return found.empty() ? atlas.maps().front() : atlas.at(most->first);
}

/// Returns the samples as the calibration takes them: those that are found in a map, or all to follow them through it.
std::vector<calibration::FoundScan> scans_of(const DriveSamples& samples, const std::string& map, bool are_followed)
{
	constexpr std::size_t kReturns = 120;  // [-] of a scan; half of them confirm what messages say
	std::vector<calibration::FoundScan> scans;
	for (std::size_t i = 0; i < samples.scans.size(); i++)
	{
		const logs::RecordedScan& scan = *samples.scans[i].observation;
		const Hypothesis* const best = samples.found(i);
		const bool is_found = best && best->map == map;
		if (!is_found && !are_followed) continue;
		scans.push_back(calibration::found_scan(
		    scan, scan.laser(), logs::to_seconds(scan.timestamp),
		    is_found ? best->pose.asTPose() : mrpt::math::TPose2D(), are_followed ? kReturns / 2 : kReturns));
		scans.back().is_found = is_found;
	}
	return scans;
}

/// Returns what a drive shows that agrees with the messages wherever these lead from scan to scan; no value if it may
/// not agree. Only few scans are searched: the first one after each gap, and the last one.
std::optional<calibration::Calibration> confirmation_of(
    DriveSamples& samples, const Beforehand& known, const SearchRequest& search, const Atlas& atlas)
{
	constexpr double kGap = 5;  // [s]
	std::vector<std::size_t> searched = {0};
	const auto time = [&](std::size_t i) { return logs::to_seconds(samples.scans[i].observation->timestamp); };
	for (std::size_t i = 1; i < samples.scans.size(); i++)
		if (i + 1 == samples.scans.size() || time(i) - time(i - 1) > kGap) searched.push_back(i);
	localize(samples, searched, search, atlas);
	const AtlasMap& map = map_of(atlas, samples);
	const Grid& grid = map.localizer->grid();
	const auto scans = calibration::follow(grid, known.told, scans_of(samples, map.name, true), samples.odometry);
	const auto shown = calibration::calibrate(grid, known.told, scans, samples.odometry, known.given);
	const bool agrees = !agreement_of(known.told, scans, samples.odometry).is_contradicted;
	return shown.is_confirmed && agrees ? std::optional(shown) : std::nullopt;
}

std::map<std::size_t, Localization> by_number(const DriveSamples& samples)
{
	std::map<std::size_t, Localization> found;
	for (std::size_t i = 0; i < samples.answers.size(); i++)
		if (samples.answers[i]) found.emplace(samples.numbers[i], *samples.answers[i]);
	return found;
}
}  // namespace

DriveCalibration calibrate_by_drive(
    const logs::Log& log, const logs::Sensor& sensor, const logs::Overrides& overrides, const SearchRequest& search,
    const Atlas& atlas, bool is_brief)
{
	DriveCalibration result;
	result.overrides = overrides;
	const auto reader = logs::read_log(log, sensor.label, overrides);
	DriveSamples samples = SampleChooser(sensor.label, sensor.scans).choose(*reader);
	if (samples.scans.empty() || interrupted()) return result;
	Beforehand known = beforehand_of(samples, sensor, overrides);
	if (const auto confirmed = is_brief ? confirmation_of(samples, known, search, atlas) : std::nullopt)
	{
		result.found = *confirmed;
		result.answers = by_number(samples);
		return result;
	}
	const std::size_t found_as_told = localize(samples, each(samples, 1), search, atlas);
	const auto as_told = by_number(samples);
	ros::Mounting mounting;
	if (2 * found_as_told < samples.scans.size() || sensor.other_angles)
		mounting = other_mounting(samples, sensor, overrides, search, atlas);
	if (!mounting.text.empty())
	{
		samples = mounted(std::move(samples), mounting);
		localize(samples, each(samples, 1), search, atlas);
		known = beforehand_of(samples, sensor, overrides);
	}
	const AtlasMap& map = map_of(atlas, samples);
	const std::vector<calibration::FoundScan> found = scans_of(samples, map.name, false);
	if (found.empty() || interrupted()) return result;
	result.found = calibration::calibrate(map.localizer->grid(), known.told, found, samples.odometry, known.given);
	const logs::RecordedScan& first = *samples.scans.front().observation;
	static_cast<ros::Overrides&>(result.overrides) =
	    ros::with_shown(mounting.over(overrides), result.found, first, first.laser());
	calibration::Agreement agreement = agreement_of(result.found.shown, found, samples.odometry);
	if (sensor.is_the_robot) agreement.is_contradicted = false;
	result.doubt = ros::doubt_of(agreement, result.found, mounting.overrides.sensor_pose.has_value());
	const std::string contradictions = ros::both(ros::contradictions(result.found), mounting.text);
	if (contradictions.empty())
	{
		result.answers = as_told;
		return result;
	}
	result.line = mrpt::format(
	    "laser '%s': %zu scans and %zu motions of the drive contradict the messages: %s. %s says the same and is used; "
	    "--as-told believes the messages",
	    sensor.label.c_str(), result.found.scans, result.found.motions, contradictions.c_str(),
	    options_of(result.overrides).c_str());
	for (const std::string& line : ros::lines_of(result.overrides)) result.file += line + "\n";
	return result;
}

namespace
{
/// Returns a panel of a picture: a number for each scan or motion as told (grey) and as shown (blue), and their
/// medians.
std::string panel(
    double top, const std::string& title, const std::vector<double>& before, const std::vector<double>& after,
    double scale)
{
	constexpr double kWidth = 640, kHeight = 90, kLeft = 60;  // [pixel]
	std::vector<double> all = before;
	all.insert(all.end(), after.begin(), after.end());
	const double most = std::max(1e-6, percentile(all, 0.98));
	std::string text = mrpt::format(
	    "<text x='4' y='%.0f'>%s</text><text x='%.0f' y='%.0f' text-anchor='end'>%.3g</text>"
	    "<rect x='%.0f' y='%.0f' width='%.0f' height='%.0f' fill='none' stroke='#ccc'/>",
	    top - 6, title.c_str(), kLeft - 4, top + 10, most * scale, kLeft, top, kWidth, kHeight);
	const auto draw = [&](const std::vector<double>& values, const char* color)
	{
		const auto y = [&](double value) { return top + kHeight * (1 - std::min(value, most) / most); };
		for (std::size_t i = 0; i < values.size(); i++)
			text += mrpt::format(
			    "<circle cx='%.1f' cy='%.1f' r='3' fill='%s'/>",
			    kLeft + kWidth * (static_cast<double>(i) + 0.5) / static_cast<double>(values.size()), y(values[i]),
			    color);
		const double middle = values.empty() ? 0 : percentile(values, 0.5);
		text += mrpt::format("<path d='M%.0f %.1fh%.0f' stroke='%s'/>", kLeft, y(middle), kWidth, color);
	};
	draw(before, "#999");
	draw(after, "#0072b2");
	return text;
}
}  // namespace

std::string picture_of(const calibration::Calibration& found)
{
	const calibration::Residuals &before = found.before, &after = found.after;
	if (before.walls_of_scans.empty()) return "";
	return "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 710 370' width='710' font-family='sans-serif' "
	       "font-size='12'>" +
	       panel(
	           20, "returns from the walls, by scan [m]: grey as told, blue as shown", before.walls_of_scans,
	           after.walls_of_scans, 1) +
	       panel(145, "ways between scans from those of the odometry [m]", before.ways, after.ways, 1) +
	       panel(
	           270, "turns between scans from those of the odometry [deg]", before.turns, after.turns,
	           mrpt::RAD2DEG(1.0)) +
	       "</svg>\n";
}

std::string table_of(const DriveCalibration& calibration)
{
	std::string table = ros::table_of(calibration.found);
	if (const auto& pose = calibration.overrides.sensor_pose)
	{
		CPose3D copy = *pose;  // MRPT computes its angles in place
		table += mrpt::format(
		    "ros2 run tf2_ros static_transform_publisher --x %.3f --y %.3f --z %.3f --yaw %.4f --pitch %.4f --roll "
		    "%.4f --frame-id ROBOT --child-frame-id LASER\n",
		    copy.x(), copy.y(), copy.z(), copy.yaw(), copy.pitch(), copy.roll());
	}
	return table;
}
}  // namespace d2s1r::app
