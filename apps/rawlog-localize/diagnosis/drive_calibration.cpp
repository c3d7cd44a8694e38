// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "diagnosis/drive_calibration.h"

#include <base/threads.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>
#include <mrpt/math/wrap2pi.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <functional>
#include <optional>
#include <utility>

#include "cli/console.h"
#include "cli/values.h"
#include "evaluation/accuracy.h"
#include "frames/logged_scan.h"

namespace d2s1r::app
{
using mrpt::obs::CObservation2DRangeScan;
using mrpt::poses::CPose2D;
using mrpt::poses::CPose3D;

namespace
{
/// The scans of a drive that are tried, and the odometry around them.
struct DriveSamples
{
	std::vector<LoggedScan> scans;
	std::vector<d2s1r::TimedPose> odometry;  //!< by increasing time [s] by its clock
	std::vector<double> lags;  //!< [s] of the odometry's clock when a scan came, minus the time of the scan
	double middle_angle = 0;   //!< [rad] see RawlogObject
	/// Whether odometry comes with the scans and has their times, whenever it was measured.
	bool has_times_of_scans = false;
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
				if (object->scans[i]->sensorLabel != label_) continue;
				const double stamp = logs::to_seconds(object->scans[i]->timestamp);
				const bool is_same = object->increment || std::abs(stamp - last_reading_) < kSameTime;
				with_scans_ += stamp != last_scan_ && is_same;
				readings_ += object->increment.has_value();
				last_scan_ = stamp;
				if (object->increment) add_odometry(logs::to_seconds(object->scans[i]->timestamp));
				samples_.middle_angle = object->middle_angle;
				add(logged_scan(object->scans[i], object->details[i]));
			}
		}
		samples_.has_times_of_scans = 2 * with_scans_ > readings_;
		std::stable_sort(
		    samples_.odometry.begin(), samples_.odometry.end(),
		    [](const d2s1r::TimedPose& a, const d2s1r::TimedPose& b) { return a.time < b.time; });
		return std::move(samples_);
	}

   private:
	static constexpr std::size_t kParts = 10, kInPart = 6;  // [-] of the log; scans of each
	static constexpr double kSameTime = 1e-3;               // [s]
	static constexpr double kAround = 6;                    // [s] of odometry that is kept before and after a scan

	/// Takes a reading of the odometry that comes first, if there are two.
	void add_reading(const logs::RawlogObject& object)
	{
		if (!source_) source_ = object.odometry_source;
		if (object.odometry_source != *source_) return;
		robot_ = *object.odometry;
		last_reading_ = 1e-9 * static_cast<double>(object.odometry_time);
		add_odometry(last_reading_);
		readings_++;
		with_scans_ += std::abs(last_reading_ - last_scan_) < kSameTime;
	}

	void add_odometry(double time)
	{
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
		if (!recent_.empty())
			samples_.lags.push_back(recent_.back().time - now_);
		else if (!samples_.odometry.empty())
			samples_.lags.push_back(samples_.odometry.back().time - now_);
		samples_.odometry.insert(samples_.odometry.end(), recent_.begin(), recent_.end());
		recent_.clear();
		keep_until_ = now_ + kAround;
		samples_.scans.push_back(scan);
		robot_then_ = robot_;
		then_ = now_;
		in_part_++;
	}

	std::string label_;
	std::size_t scans_, count_ = 0, part_ = 0, in_part_ = 0;  //!< [-]
	CPose2D robot_, robot_then_;                              //!< in the frame of the odometry
	double now_ = 0, then_ = -1, keep_until_ = 0;             //!< [s] by the clock of the scans
	std::optional<ros::OdometrySource> source_;
	std::size_t readings_ = 0, with_scans_ = 0;  //!< [-] of the odometry; those with the time of a scan
	double last_scan_ = -1, last_reading_ = -2;  //!< [s]
	std::deque<d2s1r::TimedPose> recent_;        //!< odometry that is not needed so far
	DriveSamples samples_;
};

/// Another way in which a laser may be mounted, if its scans fit nowhere as the messages say.
struct Mounting
{
	double own_body = 0;                       //!< [m] readings below that are of the robot itself
	bool is_mirrored = false;                  //!< whether it is upside down though the messages say the opposite
	bool is_level = false;                     //!< whether it is level though the messages say it is tilted
	std::optional<logs::BeamAngles> angles{};  //!< of the beams, by other fields than usual

	/// Returns the pose of the laser on the robot.
	CPose3D of(const CPose3D& told) const
	{
		CPose3D copy = told;  // MRPT computes its angles in place
		if (is_level) copy = CPose3D(told.x(), told.y(), told.z(), copy.yaw(), 0, 0);
		return is_mirrored ? copy + CPose3D(0, 0, 0, 0, 0, M_PI) : copy;
	}
};

LoggedScan mounted(const LoggedScan& scan, const Mounting& mounting, double middle_angle)
{
	auto observation = std::make_shared<CObservation2DRangeScan>(*scan.observation);
	const CPose3D middle(0, 0, 0, middle_angle, 0, 0);
	observation->sensorPose = mounting.of(observation->sensorPose + CPose3D(0, 0, 0, -middle_angle, 0, 0)) + middle;
	if (mounting.angles) logs::set_beam_angles(*observation, *mounting.angles, middle_angle);
	for (std::size_t i = 0; i < observation->getScanSize(); i++)
		if (static_cast<double>(observation->getScanRange(i)) < mounting.own_body)
			observation->setScanRangeValidity(i, false);
	const bool is_mended = mounting.is_level && scan.unusable.field == logs::ScanDoubt::Field::kLaserPose;
	return {observation, scan.sweep, is_mended ? logs::ScanDoubt() : scan.unusable};
}

/// Returns up to where [m] the robot sees itself: beams that measure the same in all scans of a drive, and least; 0 if
/// there are few of them.
double own_body_in(const DriveSamples& samples)
{
	constexpr std::size_t kFewestScans = 6, kShare = 20;  // [-], of the beams at least one in so many
	constexpr double kSame = 0.04;                        // [m] by which such a beam may differ
	const std::size_t beams = samples.scans.front().observation->getScanSize();
	if (samples.scans.size() < kFewestScans) return 0;
	std::size_t own = 0;
	double farthest = 0;
	for (std::size_t i = 0; i < beams; i++)
	{
		double least = HUGE_VAL, most = 0;
		for (const LoggedScan& scan : samples.scans)
		{
			const bool is_there = i < scan.observation->getScanSize() && scan.observation->getScanRangeValidity(i);
			const double range = is_there ? static_cast<double>(scan.observation->getScanRange(i)) : HUGE_VAL;
			least = std::min(least, range), most = std::max(most, range);
		}
		if (most - least < kSame) own++, farthest = std::max(farthest, most);
	}
	return own * kShare > beams ? std::ceil(100 * farthest + 2) / 100 : 0;
}

/// Returns the samples by another mounting.
DriveSamples mounted(DriveSamples samples, const Mounting& mounting)
{
	for (LoggedScan& scan : samples.scans) scan = mounted(scan, mounting, samples.middle_angle);
	if (mounting.angles) samples.middle_angle = 0.5 * (mounting.angles->first + mounting.angles->last);
	return samples;
}

/// Where scans were found; no value of those that were not.
using Places = std::vector<std::optional<mrpt::math::TPose2D>>;

Places places_of(
    const DriveSamples& samples, const Mounting& mounting, std::size_t step, const SearchRequest& search,
    const Localizer& localizer)
{
	Places places((samples.scans.size() + step - 1) / step);
	parallel_for(
	    places.size(), search.threads,
	    [&](std::size_t i)
	    {
		    if (interrupted()) return;
		    const LoggedScan scan = mounted(samples.scans[step * i], mounting, samples.middle_angle);
		    const Localization answer = localizer.localize(scan_of(scan, localizer.parameters().scan), search.query);
		    if (answer.status == Status::kLocalized) places[i] = answer.best().pose.asTPose();
	    });
	return places;
}

std::size_t found_of(const Places& places)
{
	return static_cast<std::size_t>(
	    std::count_if(places.begin(), places.end(), [](const auto& place) { return place.has_value(); }));
}

/// Returns the mounting by which most scans are found, if these are far more than by that of the messages.
Mounting other_mounting(
    const DriveSamples& samples, const logs::Sensor& sensor, const logs::Overrides& overrides,
    const SearchRequest& search, const Localizer& localizer)
{
	constexpr std::size_t kStep = 3;  // [-] of the scans, one in so many is tried
	std::vector<Mounting> others;
	const auto is_tilted = [](const LoggedScan& scan)
	{ return scan.unusable.field == logs::ScanDoubt::Field::kLaserPose; };
	if (!overrides.sensor_pose) others.push_back({0, true, false});
	if (!overrides.sensor_pose && is_tilted(samples.scans.front()))
		others.insert(others.end(), {Mounting{0, false, true}, Mounting{0, true, true}});
	if (const double own = own_body_in(samples); own > 0 && !overrides.min_range) others.push_back({own, false, false});
	if (sensor.other_angles && !overrides.beam_angles) others.push_back({0, false, false, sensor.other_angles->angles});
	Mounting best;
	std::size_t most = found_of(places_of(samples, {}, kStep, search, localizer)) + 2;
	for (const Mounting& other : others)
	{
		const Places places = places_of(samples, other, kStep, search, localizer);
		if (2 * found_of(places) < places.size() || found_of(places) <= most) continue;
		most = found_of(places);
		best = other;
	}
	return best;
}

/// Returns the pose of a frame as seen from above.
mrpt::math::TPose2D from_above(const CPose3D& pose)
{
	const auto& axes = pose.getRotationMatrix();
	return {pose.x(), pose.y(), std::atan2(axes(1, 0), axes(0, 0))};
}

/// Returns the pose of the laser on the robot by a scan.
CPose3D laser_of(const LoggedScan& scan, double middle_angle)
{
	return scan.observation->sensorPose + CPose3D(0, 0, 0, -middle_angle, 0, 0);
}

/// Returns a scan as the calibration takes it.
calibration::FoundScan recorded(const LoggedScan& scan, double middle_angle, const mrpt::math::TPose2D& robot)
{
	constexpr std::size_t kMost = 120;  // [-] returns that tell enough
	const CObservation2DRangeScan& observation = *scan.observation;
	const CPose3D laser = laser_of(scan, middle_angle);
	const double side = laser.getRotationMatrix()(2, 2) < 0 ? -1 : 1;  // upside down: clockwise as seen from above
	const std::size_t beams = observation.getScanSize();
	const auto aperture = static_cast<double>(observation.aperture);
	const double last = std::max(1.0, static_cast<double>(beams) - 1);
	const auto angle = [&](std::size_t i)
	{
		const double from_first = aperture * static_cast<double>(i) / last, half = 0.5 * aperture;
		return static_cast<float>(
		    side * (middle_angle + (observation.rightToLeft ? from_first - half : half - from_first)));
	};
	calibration::FoundScan found;
	found.time = logs::to_seconds(observation.timestamp);
	found.first_angle = angle(0);
	found.laser = robot + from_above(laser);
	for (std::size_t i = 0; i < beams; i++)
	{
		const float range = observation.getScanRange(i);
		if (i > 0 && i * kMost / beams == (i - 1) * kMost / beams) continue;
		if (observation.getScanRangeValidity(i) && range > 0 && range < observation.maxRange)
			found.returns.push_back({angle(i), range, static_cast<float>(static_cast<double>(i) / last)});
	}
	return found;
}

/// Returns whether the laser stays where it is on the robot.
bool stays(const DriveSamples& samples)
{
	const CPose3D first = laser_of(samples.scans.front(), samples.middle_angle);
	return std::all_of(
	    samples.scans.begin(), samples.scans.end(),
	    [&](const LoggedScan& scan)
	    {
		    const CPose3D motion = laser_of(scan, samples.middle_angle) - first;
		    return motion.norm() < 1e-3 && std::abs(from_above(motion).phi) < 1e-3;
	    });
}

std::string pose_option(const CPose3D& pose)
{
	CPose3D copy = pose;  // MRPT computes its angles in place
	const auto degrees = [](double angle)
	{ return std::round(100 * mrpt::RAD2DEG(mrpt::math::wrapToPi(angle))) / 100 + 0.0; };
	const auto metres = [](double length) { return std::round(1000 * length) / 1000 + 0.0; };
	return mrpt::format(
	    "--sensor-pose %g,%g,%g,%g,%g,%g", metres(copy.x()), metres(copy.y()), metres(copy.z()), degrees(copy.yaw()),
	    degrees(copy.pitch()), degrees(copy.roll()));
}

/// Enters what the drive contradicts into the overrides, and says it as options.
void apply(
    const calibration::Reading& told, const DriveSamples& samples, const Mounting& mounting, DriveCalibration& result)
{
	using namespace calibration;
	const Reading& shown = result.found.shown;
	const auto is_changed = [&](Unknown unknown)
	{ return result.found.findings[unknown].verdict == calibration::Verdict::kChanged; };
	std::vector<std::string> options;
	logs::Overrides& overrides = result.overrides;
	if (is_changed(kYaw) || is_changed(kX) || is_changed(kY) || mounting.is_mirrored || mounting.is_level)
	{
		CPose3D laser = laser_of(samples.scans.front(), samples.middle_angle);
		const double yaw = laser.yaw() + shown.laser.phi - told.laser.phi;
		overrides.sensor_pose = CPose3D(shown.laser.x, shown.laser.y, laser.z(), yaw, laser.pitch(), laser.roll());
		options.push_back(pose_option(*overrides.sensor_pose));
	}
	if (is_changed(kFirstBeam) || is_changed(kDuration))
	{
		const auto milliseconds = [](double time) { return std::round(1000 * time) / 1000 + 0.0; };
		const bool is_instant = std::abs(shown.duration) < 2 * result.found.findings[kDuration].deviation;
		overrides.sweep =
		    logs::SweepTime{is_instant ? 0 : milliseconds(shown.duration), milliseconds(shown.first_beam)};
		options.push_back(mrpt::format("--sweep-time %g", overrides.sweep->duration));
		if (overrides.sweep->first_beam != 0) options.back() += mrpt::format(",%g", overrides.sweep->first_beam);
	}
	if (is_changed(kRangeFactor))
	{
		overrides.range_factor = overrides.range_factor.value_or(1) * shown.range_factor;
		options.push_back(mrpt::format("--range-factor %.4f", *overrides.range_factor));
	}
	if (is_changed(kAngleScale))
	{
		const CObservation2DRangeScan& scan = *samples.scans.front().observation;
		const double half = 0.5 * static_cast<double>(scan.aperture) * (scan.rightToLeft ? 1 : -1);
		const double first = samples.middle_angle - half;
		overrides.beam_angles = logs::BeamAngles{first, first + 2 * half * shown.angle_scale};
		options.push_back(beam_angles_option(*overrides.beam_angles));
	}
	if (mounting.angles && !is_changed(kAngleScale))
	{
		overrides.beam_angles = mounting.angles;
		options.push_back(beam_angles_option(*mounting.angles));
	}
	if (mounting.own_body > 0)
	{
		overrides.min_range = mounting.own_body;
		options.push_back(mrpt::format("--min-range %g", mounting.own_body));
	}
	if (shown.is_odometry_mirrored)
	{
		overrides.is_odometry_mirrored = true;
		options.emplace_back("--mirrored-odometry");
	}
	if (shown.odometry_clock != 0)
	{
		overrides.odometry_clock = shown.odometry_clock;
		options.push_back(mrpt::format("--odometry-clock %.2f", shown.odometry_clock));
	}
	for (const std::string& option : options)
	{
		result.options += (result.options.empty() ? "" : " ") + option;
		const auto space = option.find(' ');
		result.file +=
		    option.substr(2, space - 2) + ": " + (space < option.size() ? option.substr(space + 1) : "true") + "\n";
	}
}

struct UnknownText
{
	const char* name;
	const char* unit;
	double scale;  //!< of the unit
	int digits;
};
constexpr std::array<UnknownText, calibration::kUnknowns> kTexts = {
    {{"yaw of the laser", "deg", M_PI / 180, 1},
     {"x of the laser", "m", 1, 3},
     {"y of the laser", "m", 1, 3},
     {"first beam after the stamp", "s", 1, 3},
     {"duration of the sweep", "s", 1, 3},
     {"scale of the angles", "", 1, 4},
     {"factor of the ranges", "", 1, 4},
     {"scale of the odometry's ways", "", 1, 3},
     {"scale of the odometry's turns", "", 1, 3}}};

std::string number_text(double value, const UnknownText& text)
{
	return mrpt::format("%.*f", text.digits, value / text.scale);
}

/// Says what was found and how sure it is.
std::string line_of(const DriveCalibration& result, const logs::Sensor& sensor, const Mounting& mounting)
{
	const calibration::Calibration& found = result.found;
	std::string text = "laser '" + sensor.label + "': ";
	text +=
	    mrpt::format("%zu scans and %zu motions of the drive contradict the messages: ", found.scans, found.motions);
	std::vector<std::string> parts;
	for (std::size_t i = 0; i < calibration::kUnknowns; i++)
	{
		const calibration::Finding& finding = found.findings[i];
		if (finding.verdict != calibration::Verdict::kChanged) continue;
		const double shown = value_of(found.shown, static_cast<calibration::Unknown>(i));
		parts.push_back(
		    std::string(kTexts[i].name) + " " + number_text(shown, kTexts[i]) + " +- " +
		    number_text(finding.deviation, kTexts[i]) + (*kTexts[i].unit ? " " : "") + kTexts[i].unit + ", not " +
		    number_text(finding.told, kTexts[i]));
	}
	if (mounting.is_mirrored) parts.emplace_back("scans mirrored");
	if (mounting.is_level) parts.emplace_back("laser level");
	if (mounting.angles) parts.push_back("angles of the beams: " + sensor.other_angles->because);
	if (mounting.own_body > 0)
		parts.push_back(
		    mrpt::format("beams that see the same below %g m in all scans are the robot itself", mounting.own_body));
	if (found.shown.is_odometry_mirrored) parts.emplace_back("odometry mirrored");
	if (found.shown.odometry_clock != 0)
		parts.push_back(mrpt::format("clock of the odometry %+.2f s off", found.shown.odometry_clock));
	for (std::size_t i = 0; i < parts.size(); i++) text += (i == 0 ? "" : "; ") + parts[i];
	return text + ". " + result.options + " says the same and is used; --as-told believes the messages";
}
}  // namespace

DriveCalibration calibrate_by_drive(
    const logs::Log& log, const logs::Sensor& sensor, const logs::Overrides& overrides, const SearchRequest& search,
    const Localizer& localizer)
{
	DriveCalibration result;
	result.overrides = overrides;
	const auto reader = logs::read_log(log, sensor.label, overrides);
	DriveSamples samples = SampleChooser(sensor.label, sensor.scans).choose(*reader);
	if (samples.scans.empty() || interrupted()) return result;
	Mounting mounting;
	Places places = places_of(samples, mounting, 1, search, localizer);
	if (2 * found_of(places) < places.size())
	{
		mounting = other_mounting(samples, sensor, overrides, search, localizer);
		samples = mounted(std::move(samples), mounting);
		places = places_of(samples, {}, 1, search, localizer);
	}
	std::vector<calibration::FoundScan> found;
	std::vector<double> firsts, durations;
	for (std::size_t i = 0; i < places.size(); i++)
	{
		if (!places[i]) continue;
		const LoggedScan& scan = samples.scans[i];
		found.push_back(recorded(scan, samples.middle_angle, *places[i]));
		firsts.push_back(scan.sweep.first_beam);
		durations.push_back(scan.sweep.beam_step * (static_cast<double>(scan.observation->getScanSize()) - 1));
	}
	if (found.empty() || interrupted()) return result;
	calibration::Reading told;
	told.laser = from_above(laser_of(samples.scans.front(), samples.middle_angle));
	told.first_beam = percentile(firsts, 0.5);
	told.duration = percentile(durations, 0.5);
	calibration::Known known{};
	if (overrides.sensor_pose || sensor.is_the_robot || !stays(samples))
		known[calibration::kYaw] = known[calibration::kX] = known[calibration::kY] = true;
	if (overrides.sweep || samples.has_times_of_scans)
		known[calibration::kFirstBeam] = known[calibration::kDuration] = true;
	known[calibration::kAngleScale] = overrides.beam_angles.has_value();
	known[calibration::kRangeFactor] = overrides.range_factor.has_value();
	std::vector<double> clocks;
	if (!samples.lags.empty())
		if (const double lag = percentile(samples.lags, 0.5); std::abs(lag) > 1) clocks.push_back(lag);
	result.found = calibrate(localizer.grid(), told, found, samples.odometry, known, clocks);
	apply(told, samples, mounting, result);
	if (!result.options.empty()) result.line = line_of(result, sensor, mounting);
	return result;
}

std::string table_of(const DriveCalibration& calibration)
{
	std::string table =
	    mrpt::format("%-32s %12s %12s %10s  %s\n", "unknown", "messages say", "drive shows", "+-", "verdict");
	for (std::size_t i = 0; i < calibration::kUnknowns; i++)
	{
		const calibration::Finding& finding = calibration.found.findings[i];
		const std::string unit = *kTexts[i].unit ? std::string(" [") + kTexts[i].unit + "]" : "";
		const bool is_shown = finding.verdict != calibration::Verdict::kNotShown;
		table += mrpt::format(
		    "%-32s %12s %12s %10s  %s\n", (kTexts[i].name + unit).c_str(), number_text(finding.told, kTexts[i]).c_str(),
		    is_shown ? number_text(finding.estimate, kTexts[i]).c_str() : "",
		    is_shown ? number_text(finding.deviation, kTexts[i]).c_str() : "",
		    finding.verdict == calibration::Verdict::kChanged
		        ? mrpt::format("changed, log-odds %.0f", finding.log_odds).c_str()
		    : finding.verdict == calibration::Verdict::kAsTold ? "as told"
		                                                       : "not shown yet");
	}
	const calibration::Calibration& found = calibration.found;
	for (const auto& [a, b] : found.pairs)
		table += mrpt::format("the drive cannot tell %s from %s\n", kTexts[a].name, kTexts[b].name);
	table += mrpt::format(
	    "%zu scans, %zu motions; returns end %.3f m off the walls as told and %.3f m as shown, motions differ by %.3f "
	    "m "
	    "and %.2f deg as told and %.3f m and %.2f deg as shown (medians)\n",
	    found.scans, found.motions, found.before.walls, found.after.walls, found.before.way,
	    mrpt::RAD2DEG(found.before.turn), found.after.way, mrpt::RAD2DEG(found.after.turn));
	if (const auto& pose = calibration.overrides.sensor_pose)
	{
		mrpt::poses::CPose3D copy = *pose;  // MRPT computes its angles in place
		table += mrpt::format(
		    "ros2 run tf2_ros static_transform_publisher --x %.3f --y %.3f --z %.3f --yaw %.4f --pitch %.4f --roll "
		    "%.4f "
		    "--frame-id ROBOT --child-frame-id LASER\n",
		    copy.x(), copy.y(), copy.z(), copy.yaw(), copy.pitch(), copy.roll());
	}
	return table;
}
}  // namespace d2s1r::app
