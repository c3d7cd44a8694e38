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
#include "evaluation/accuracy.h"
#include "frames/logged_scan.h"

namespace d2s1r::app
{
using mrpt::poses::CPose2D;
using mrpt::poses::CPose3D;

namespace
{
/// The scans of a drive that are tried, and the odometry around them.
struct DriveSamples
{
	std::vector<LoggedScan> scans;
	std::vector<std::size_t> numbers;        //!< [-] of these, in the log
	std::vector<d2s1r::TimedPose> odometry;  //!< by increasing time [s] by its clock
	std::vector<double> lags;    //!< [s] of the odometry's clock when a scan came, minus the time of the scan
	std::vector<double> stamps;  //!< [s] of all scans of the log
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
		if (now_ < keep_until_)
		{
			samples_.odometry.push_back({time, robot_.asTPose()});
			return;
		}
		recent_.push_back({time, robot_.asTPose()});
		while (recent_.back().time - recent_.front().time > kAround) recent_.pop_front();
	}

	void add(const LoggedScan& scan)
	{
		constexpr double kLeastTime = 0.35, kDistance = 0.25, kTurn = 0.35;  // [s], [m], [rad]
		const std::size_t part = kParts * count_++ / std::max<std::size_t>(1, scans_);
		if (part != part_) part_ = part, in_part_ = 0;
		now_ = logs::to_seconds(scan.observation->timestamp);
		const CPose2D motion = robot_ - robot_then_;
		const bool has_moved = motion.norm() > kDistance || std::abs(motion.phi()) > kTurn;
		const bool is_few = scans_ <= kParts * kInPart;  // of which all are tried
		if (in_part_ >= kInPart || now_ <= 0 || !(is_few || (has_moved && now_ > then_ + kLeastTime))) return;
		if (newest_) samples_.lags.push_back(*newest_ - now_);
		samples_.odometry.insert(samples_.odometry.end(), recent_.begin(), recent_.end());
		recent_.clear();
		keep_until_ = now_ + kAround;
		samples_.scans.push_back(scan);
		samples_.numbers.push_back(count_ - 1);
		robot_then_ = robot_;
		then_ = now_;
		in_part_++;
	}

	std::string label_;
	std::size_t scans_, count_ = 0, part_ = 0, in_part_ = 0;  //!< [-]
	CPose2D robot_, robot_then_;                              //!< in the frame of the odometry
	double now_ = 0, then_ = -1, keep_until_ = 0;             //!< [s] by the clock of the scans
	std::optional<ros::OdometrySource> source_;
	std::optional<double> newest_;         //!< [s] of the odometry
	std::deque<d2s1r::TimedPose> recent_;  //!< odometry that is not needed so far
	DriveSamples samples_;
};

/// Returns the samples by another mounting.
DriveSamples mounted(DriveSamples samples, const ros::Mounting& mounting)
{
	for (LoggedScan& scan : samples.scans) scan = read_by(mounting.overrides, std::move(scan));
	return samples;
}

constexpr std::size_t kReturns = 120;  // [-] of a scan; half of them confirm what messages say

/// What the localizer says of the samples; no value of those that were not asked about.
using Answers = std::vector<std::optional<Localization>>;

/// Localizes those of the samples that were not yet.
/// \param numbers [-] of them
void localize(
    const DriveSamples& samples, const std::vector<std::size_t>& numbers, const SearchRequest& search,
    const Atlas& atlas, Answers& answers)
{
	const ScanParameters& parameters = atlas.maps().front().localizer->parameters().scan;
	const Query query = {{}, search.query.time_budget, search.query.stop};  // maps have their regions
	parallel_for(
	    numbers.size(), search.threads,
	    [&](std::size_t i)
	    {
		    auto& answer = answers[numbers[i]];
		    if (answer || interrupted()) return;
		    Localization found = atlas.localize(scan_of(samples.scans[numbers[i]], parameters), query);
		    if (!interrupted()) answer = std::move(found);  // else the search may have been stopped
	    });
}

/// Returns each `step`-th of the samples.
std::vector<std::size_t> each(const DriveSamples& samples, std::size_t step)
{
	std::vector<std::size_t> numbers;
	for (std::size_t i = 0; i < samples.scans.size(); i += step) numbers.push_back(i);
	return numbers;
}

bool is_localized(const std::optional<Localization>& answer)
{
	return answer && answer->status == Status::kLocalized;
}

std::size_t found_of(const Answers& answers)
{
	return static_cast<std::size_t>(std::count_if(answers.begin(), answers.end(), is_localized));
}

/// Returns the mounting by which most scans are found, if these are far more than by that of the messages.
/// \param as_told answers by that of the messages
ros::Mounting other_mounting(
    const DriveSamples& samples, const logs::Sensor& sensor, const logs::Overrides& overrides,
    const SearchRequest& search, const Atlas& atlas, const Answers& as_told)
{
	constexpr std::size_t kEnough = 20;  // [-] scans of those that there are
	const std::vector<std::size_t> tried = each(samples, std::max<std::size_t>(1, samples.scans.size() / kEnough));
	const auto found_by = [&](const ros::Mounting& mounting)
	{
		Answers answers(samples.scans.size());
		localize(mounted(samples, mounting), tried, search, atlas, answers);
		return found_of(answers);
	};
	const auto is_found = [&](std::size_t i) { return is_localized(as_told[i]); };
	return ros::best_of(
	    other_mountings(samples.scans, sensor.other_angles, overrides), tried.size(),
	    static_cast<std::size_t>(std::count_if(tried.begin(), tried.end(), is_found)), found_by);
}

/// Returns whether the laser stays where it is on the robot.
bool stays(const DriveSamples& samples)
{
	const CPose3D first = samples.scans.front().observation->laser();
	return std::all_of(
	    samples.scans.begin(), samples.scans.end(),
	    [&](const LoggedScan& scan)
	    {
		    const CPose3D motion = scan.observation->laser() - first;
		    return motion.norm() < 1e-3 && std::abs(calibration::from_above(motion).phi) < 1e-3;
	    });
}

/// Says what was found and how sure it is, and writes it down as options and as a file.
void tell(const std::string& label, DriveCalibration& result)
{
	result.line = mrpt::format(
	    "laser '%s': %zu scans and %zu motions of the drive contradict the messages: ", label.c_str(),
	    result.found.scans, result.found.motions);
	for (const std::string& part : result.contradictions)
		result.line += (&part == &result.contradictions.front() ? "" : "; ") + part;
	result.line += ".";
	for (const auto& [name, value] : ros::entries_of(result.overrides))
	{
		result.line += " --" + name + (value.empty() ? "" : " ") + value;
		result.file += name + ": " + (value.empty() ? "true" : value) + "\n";
	}
	result.line += " says the same and is used; --as-told believes the messages";
}
}  // namespace

namespace
{
/// What the messages say of the samples, and what is known beside that.
struct Beforehand
{
	CPose3D laser;  //!< frame on the robot
	calibration::Reading told;
	calibration::Given given;
};

Beforehand beforehand_of(const DriveSamples& samples, const logs::Sensor& sensor, const logs::Overrides& overrides)
{
	std::vector<double> firsts, durations, lags = samples.lags;
	for (const LoggedScan& scan : samples.scans)
	{
		firsts.push_back(scan.sweep.first_beam);
		durations.push_back(scan.sweep.beam_step * (static_cast<double>(scan.observation->size()) - 1));
	}
	Beforehand known;
	known.laser = samples.scans.front().observation->laser();
	const ros::SweepTime sweep{percentile(durations, 0.5), percentile(firsts, 0.5)};
	known.told = ros::told_reading(known.laser, sweep, {});  // what is given is in the scans
	known.given = ros::known_by(overrides);
	auto& is_known = known.given.known;
	if (sensor.is_the_robot || !stays(samples))
		is_known[calibration::kYaw] = is_known[calibration::kX] = is_known[calibration::kY] = true;
	known.given.stamps = samples.stamps;
	known.given.are_angles_doubtful = sensor.other_angles.has_value();
	const double lag = lags.empty() ? 0 : percentile(lags, 0.5);
	if (std::abs(lag) > 1) known.given.clocks.push_back(lag);
	return known;
}

/// Returns the map in which most of the samples are found.
const AtlasMap& map_of(const Atlas& atlas, const Answers& answers)
{
	std::map<std::string, int> found;
	for (const auto& answer : answers)
		if (is_localized(answer)) found[answer->best().map]++;
	const auto is_less = [](const auto& a, const auto& b) { return a.second < b.second; };
	const auto most = std::max_element(found.begin(), found.end(), is_less);
	return found.empty() ? atlas.maps().front() : atlas.at(most->first);
}

/// Returns the samples as the calibration takes them: those in another map are not found.
/// \param returns [-] of each that are kept
std::vector<calibration::FoundScan> scans_of(
    const DriveSamples& samples, const Answers& answers, const std::string& map, std::size_t returns)
{
	std::vector<calibration::FoundScan> scans;
	for (std::size_t i = 0; i < samples.scans.size(); i++)
	{
		const logs::RecordedScan& scan = *samples.scans[i].observation;
		const bool is_found = is_localized(answers[i]) && answers[i]->best().map == map;
		scans.push_back(calibration::found_scan(
		    scan, scan.laser(), logs::to_seconds(scan.timestamp),
		    is_found ? answers[i]->best().pose.asTPose() : mrpt::math::TPose2D(), returns));
		scans.back().is_found = is_found;
	}
	return scans;
}

/// Returns what a drive shows that agrees with the messages wherever these lead from scan to scan; no value if it may
/// not agree. Only few scans are searched: the first one after each gap, and the last one.
std::optional<calibration::Calibration> confirmation_of(
    const DriveSamples& samples, const Beforehand& known, const SearchRequest& search, const Atlas& atlas,
    Answers& answers)
{
	constexpr double kGap = 5;  // [s]
	std::vector<std::size_t> searched = {0, samples.scans.size() - 1};
	const auto time = [&](std::size_t i) { return logs::to_seconds(samples.scans[i].observation->timestamp); };
	for (std::size_t i = 1; i + 1 < samples.scans.size(); i++)
		if (time(i) - time(i - 1) > kGap) searched.push_back(i);
	localize(samples, searched, search, atlas, answers);
	const AtlasMap& map = map_of(atlas, answers);
	const Grid& grid = map.localizer->grid();
	const auto samples_read = scans_of(samples, answers, map.name, kReturns / 2);
	const auto scans = calibration::follow(grid, known.told, samples_read, samples.odometry);
	const auto shown = calibration::calibrate(grid, known.told, scans, samples.odometry, known.given);
	const bool agrees = !agreement_of(known.told, scans, samples.odometry).is_contradicted;
	return shown.is_confirmed && agrees ? std::optional(shown) : std::nullopt;
}

std::map<std::size_t, Localization> by_number(const DriveSamples& samples, const Answers& answers)
{
	std::map<std::size_t, Localization> found;
	for (std::size_t i = 0; i < answers.size(); i++)
		if (answers[i]) found.emplace(samples.numbers[i], *answers[i]);
	return found;
}

/// Does what calibrate_by_drive() does, by scans that are read as messages and overrides say.
DriveCalibration look_at_drive(
    const logs::Log& log, const logs::Sensor& sensor, const logs::Overrides& overrides, const SearchRequest& search,
    const Atlas& atlas, bool is_brief)
{
	DriveCalibration result;
	result.overrides = overrides;
	const auto reader = logs::read_log(log, sensor.label, overrides);
	DriveSamples samples = SampleChooser(sensor.label, sensor.scans).choose(*reader);
	if (samples.scans.empty() || interrupted()) return result;
	Answers answers(samples.scans.size());
	Beforehand known = beforehand_of(samples, sensor, overrides);
	if (const auto confirmed = is_brief ? confirmation_of(samples, known, search, atlas, answers) : std::nullopt)
	{
		result.found = *confirmed;
		result.answers = by_number(samples, answers);
		return result;
	}
	localize(samples, each(samples, 1), search, atlas, answers);
	const auto as_told = by_number(samples, answers);
	ros::Mounting mounting;
	if (2 * found_of(answers) < answers.size() || sensor.other_angles)
	{
		mounting = other_mounting(samples, sensor, overrides, search, atlas, answers);
		if (!mounting.text.empty())
		{
			samples = mounted(std::move(samples), mounting);
			answers = Answers(samples.scans.size());
			localize(samples, each(samples, 1), search, atlas, answers);
			known = beforehand_of(samples, sensor, overrides);
		}
	}
	const AtlasMap& map = map_of(atlas, answers);
	std::vector<calibration::FoundScan> found = scans_of(samples, answers, map.name, kReturns);
	found.erase(
	    std::remove_if(found.begin(), found.end(), [](const auto& scan) { return !scan.is_found; }), found.end());
	if (found.empty() || interrupted()) return result;
	result.found = calibration::calibrate(map.localizer->grid(), known.told, found, samples.odometry, known.given);
	static_cast<ros::Overrides&>(result.overrides) =
	    ros::with_shown(mounting.over(overrides), result.found, *samples.scans.front().observation, known.laser);
	result.contradictions = ros::contradictions(result.found);
	if (!mounting.text.empty()) result.contradictions.push_back(mounting.text);
	if (result.contradictions.empty()) result.answers = as_told;
	calibration::Agreement agreement = agreement_of(result.found.shown, found, samples.odometry);
	if (sensor.is_the_robot) agreement.is_contradicted = false;
	result.doubt = ros::doubt_of(agreement, result.found, mounting.overrides.sensor_pose.has_value());
	result.is_contradicted = agreement.is_contradicted;
	return result;
}
}  // namespace

DriveCalibration calibrate_by_drive(
    const logs::Log& log, const logs::Sensor& sensor, const logs::Overrides& overrides, const SearchRequest& search,
    const Atlas& atlas, bool is_brief)
{
	DriveCalibration result = look_at_drive(log, sensor, overrides, search, atlas, is_brief);
	if (result.contradictions.empty() || interrupted()) return result;
	// Scans are found by what the drive has shown that were not found, or elsewhere, by what the messages say.
	DriveCalibration again = look_at_drive(log, sensor, result.overrides, search, atlas, true);
	result.overrides = again.overrides;
	result.answers = std::move(again.answers);
	if (result.is_contradicted) result.doubt = ros::doubt_of({}, result.found, false);
	if (!again.doubt.why.empty()) result.doubt = again.doubt;
	result.contradictions.insert(result.contradictions.end(), again.contradictions.begin(), again.contradictions.end());
	tell(sensor.label, result);
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
