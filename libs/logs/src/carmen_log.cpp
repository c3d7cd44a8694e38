// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// CARMEN logs, as https://carmen.sourceforge.net/doc/binary__loggerplayback.html has them: a message a line.
#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <new>
#include <string_view>

#include "formats.h"
#include "logs/errors.h"
#include "unpacking_stream.h"

namespace d2s1r::logs
{
namespace
{
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // of UTF-8, which editors put in front
constexpr std::size_t kMostShownLine = 1 << 20;              // [byte] a scan has 10,000
constexpr double kMaxRange = 80;                             // [m] of a SICK laser, unless the log says otherwise

class Words
{
   public:
	explicit Words(std::string_view line) : rest_(line) {}

	/// Empty at the end.
	std::string_view word()
	{
		const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
		const auto* const end = rest_.data() + rest_.size();
		const auto* const start = std::find_if_not(rest_.data(), end, is_blank);
		const auto* const past = std::find_if(start, end, is_blank);
		rest_ = std::string_view(past, static_cast<std::size_t>(end - past));
		return std::string_view(start, static_cast<std::size_t>(past - start));
	}

	double number()
	{
		const double value = number_or_none();
		if (!std::isfinite(value)) throw std::runtime_error("has a number that is infinite or none");
		return value;
	}

	/// Returns a number, which may be infinite or NaN.
	double number_or_none()
	{
		constexpr std::size_t kMostShown = 30;  // [-] letters that are told
		const auto text = word();
		if (text.empty()) throw std::runtime_error("ends where a number belongs");
		const auto digits = text[0] == '+' ? text.substr(1) : text;
		double value = 0;
		const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
		if (error != std::errc() || end != digits.data() + digits.size())
			throw std::runtime_error("has '" + std::string(text.substr(0, kMostShown)) + "' where a number belongs");
		return value;
	}

	/// A count of numbers that follow, each of which takes two characters or more.
	std::size_t count()
	{
		const double value = number();
		if (!(value >= 0) || value > static_cast<double>(rest_.size()) / 2 || value != std::floor(value))
			throw std::runtime_error("is shorter than it says");
		return static_cast<std::size_t>(value);
	}

	mrpt::poses::CPose2D pose()
	{
		const double x = number(), y = number(), phi = number();
		return {x, y, phi};
	}

   private:
	std::string_view rest_;
};

struct Line
{
	double time = 0;                     //!< [s] of CARMEN's clock
	mrpt::poses::CPose2D robot;          //!< in the frame of the odometry
	std::optional<RecordedScan> scan{};  //!< no value: only odometry
	mrpt::poses::CPose2D mounting{};     //!< laser on the robot
	bool is_settled = true;              //!< its time will not change any more
};

struct LaserParameters
{
	double offset = 0;             //!< [m] before the middle of the robot
	double max_range = kMaxRange;  //!< [m]
	double field_of_view = 180;    //!< [deg]

	void set_field_of_view(double degrees)
	{
		constexpr double kLeastDegrees = 10, kMostDegrees = 360;  // [deg] beyond, it is in another unit
		if (degrees >= kLeastDegrees && degrees <= kMostDegrees) field_of_view = degrees;
	}
};

struct Lasers
{
	LaserParameters front, rear;

	void read(Words& words)
	{
		const auto name = words.word();
		if (name == "robot_frontlaser_offset") front.offset = words.number();
		if (name == "robot_rearlaser_offset") rear.offset = words.number();
		if (name == "robot_front_laser_max") front.max_range = words.number();
		if (name == "robot_rear_laser_max") rear.max_range = words.number();
		if (name == "laser_front_laser_fov") front.set_field_of_view(words.number());
		if (name == "laser_rear_laser_fov") rear.set_field_of_view(words.number());
	}

	const LaserParameters& of(const std::string& label) const { return label == "RLASER" ? rear : front; }
};

/// What is known of a log after it was read once: PARAM lines may come after the scans that they are about.
struct KnownLasers
{
	Lasers lasers;
	Labels loose;  //!< labels of lasers that move on the robot, so that their pose is not known
};

struct Laser
{
	std::string label;
	double first_angle = 0;       //!< [rad]
	double angle_step = 0;        //!< [rad]
	double max_range = 0;         //!< [m]
	mrpt::poses::CPose3D pose{};  //!< on the robot
};

Line make_line(double time, const mrpt::poses::CPose2D& robot, const Laser& laser, const std::vector<float>& ranges)
{
	RecordedScan scan;
	scan.label = laser.label;
	scan.max_range = static_cast<float>(laser.max_range);
	const double aperture = laser.angle_step * (static_cast<double>(ranges.size()) - 1);
	scan.middle_angle = laser.first_angle + aperture / 2;
	scan.aperture = static_cast<float>(aperture);
	scan.sensor_on_robot = laser.pose + mrpt::poses::CPose3D(0, 0, 0, scan.middle_angle, 0, 0);
	scan.ranges = ranges;
	for (const float range : ranges) scan.valid.push_back(range > 0 && range < scan.max_range ? 1 : 0);  // NaN is not
	return {time, robot, std::move(scan), mrpt::poses::CPose2D(laser.pose), false};
}

std::vector<float> read_ranges(Words& words)
{
	std::vector<float> ranges(words.count());
	for (float& range : ranges) range = static_cast<float>(words.number_or_none());
	return ranges;
}

Line read_old_laser(const std::string& label, Words& words, const Lasers& lasers)
{
	const bool is_front = label == "FLASER";
	const std::vector<float> ranges = read_ranges(words);
	words.pose();  // of the laser, which programs that correct maps overwrite
	const mrpt::poses::CPose2D robot = words.pose();
	const LaserParameters& parameters = lasers.of(label);
	// 180 deg in equal steps, unless a PARAM says otherwise; an even number of beams lacks the last one.
	const double view = mrpt::DEG2RAD(parameters.field_of_view);
	const double step = view / std::max(1.0, 2 * std::floor(static_cast<double>(ranges.size()) / 2));
	Laser laser{label, -view / 2, step, parameters.max_range};
	laser.pose = mrpt::poses::CPose3D(parameters.offset, 0, 0, is_front ? 0 : M_PI, 0, 0);
	return make_line(words.number(), robot, laser, ranges);
}

Line read_robot_laser(const std::string& label, Words& words)
{
	Laser laser{label};
	words.number();  // the type of laser
	laser.first_angle = words.number();
	words.number();  // the field of view, which follows from the number of beams
	laser.angle_step = words.number();
	laser.max_range = words.number();
	words.number();  // its accuracy
	words.number();  // whether it has remissions
	const std::vector<float> ranges = read_ranges(words);
	for (std::size_t i = words.count(); i > 0; i--) words.number();
	const mrpt::poses::CPose2D laser_pose = words.pose(), robot = words.pose();
	laser.pose = mrpt::poses::CPose3D(laser_pose - robot);
	for (int i = 0; i < 5; i++) words.number();  // velocities and distances of safety
	return make_line(words.number(), robot, laser, ranges);
}

Line read_odometry(Words& words)
{
	Line line;
	line.robot = words.pose();
	for (int i = 0; i < 3; i++) words.number();  // velocities and acceleration
	line.time = words.number();
	return line;
}

/// Makes the times of a laser's scans increase. A time that is out of line with those before and after it is put in
/// their middle; if the clock was set back by seconds, it is set forward again.
class TimeRepair
{
   public:
	/// \param time [s] by the log, of one scan and of the next, if there is one
	double repair(double time, std::optional<double> next)
	{
		if (!last_) return *(last_ = time);
		const double last = *last_;
		if (time + shift_ < last - kClockSet && !(next && *next + shift_ > last)) shift_ = last + kLeast - time;
		const bool next_is_later = next && *next + shift_ > last;
		double repaired = time + shift_;
		if (repaired <= last || (next_is_later && repaired >= *next + shift_))
			repaired = next_is_later ? (last + *next + shift_) / 2 : last + kLeast;
		return *(last_ = repaired);
	}

   private:
	static constexpr double kLeast = 1e-6;  //!< [s] that times differ by
	static constexpr double kClockSet = 5;  //!< [s] back: the clock was set; delays stay below that
	std::optional<double> last_;            //!< [s] repaired
	double shift_ = 0;                      //!< [s]
};

constexpr const char* kLoose =
    "of unknown pose on the robot (the poses of laser and robot in its lines differ now by one motion and now by "
    "another)";

class CarmenReader : public LogReader
{
   public:
	CarmenReader(const std::string& path, Stop stop, const std::optional<KnownLasers>& known = {})
	    : file_(open_unpacked(path)),
	      stop_(std::move(stop)),
	      is_known_(known.has_value()),
	      known_(known.value_or(KnownLasers()))
	{
	}

	const KnownLasers& known() const { return known_; }

	/// A line of a laser gives its odometry, then its scan. Odometry that is no newer than what came before is left
	/// out.
	std::optional<RawlogObject> next() override
	{
		if (scan_)
		{
			RawlogObject object = object_of(std::move(*std::exchange(scan_, std::nullopt)));
			const bool is_loose = known_.loose.count(object.scans.front()->label) > 0;
			if (is_loose)
				object.details.front().unusable = {
				    "its pose on the robot is not the same in all lines", ScanDoubt::Field::kLaserPose};
			return object;
		}
		while (auto line = next_line())
		{
			if (!line->scan && line->time <= newest_) continue;
			newest_ = line->time;
			const auto time = from_seconds(line->time);
			scan_ = std::move(line->scan);
			if (scan_) scan_->timestamp = time;
			return object_of({"ODOMETRY", time, line->robot});
		}
		return std::nullopt;
	}

	LogSurvey survey()
	{
		LogSurvey survey;
		survey.format = "CARMEN log";
		survey.kind_of_scan = "FLASER, RLASER, ROBOTLASER1 or ROBOTLASER2";
		auto& sensors = survey.sensors;
		while (const auto line = next_line())
		{
			survey.odometry = "the log";
			if (!line->scan) continue;
			const auto sensor = std::find_if(
			    sensors.begin(), sensors.end(), [&](const Sensor& s) { return s.label == line->scan->label; });
			if (sensor == sensors.end())
				sensors.push_back({line->scan->label, 1});
			else
				sensor->scans++;
		}
		for (Sensor& sensor : sensors)
		{
			if (known_.loose.count(sensor.label) == 0) continue;
			sensor.has_pose = false;
			sensor.mounting = kLoose;
			sensor.odometry = survey.odometry;
		}
		if (sensors.empty() && has_raw_scans_) survey.unread_scans = "RAWLASER1, without poses";
		if (repaired_ > 0)
			survey.notes.push_back(
			    std::to_string(repaired_) + " of " + std::to_string(scans_) +
			    " scans have a time that is out of line with those before and after; it was repaired");
		if (is_stopped_) throw Interrupted();
		survey.damage = damage_;
		return survey;
	}

   private:
	std::optional<Line> next_line()
	{
		constexpr std::size_t kMostWaiting = 10000;      // [-] lines, for logs whose laser falls silent
		constexpr std::size_t kMostRanges = 20'000'000;  // [-] of 5 bytes, in these lines
		while (lines_.empty() || !lines_.front().is_settled)
			if (lines_.size() > kMostWaiting || waiting_ranges_ > kMostRanges || !read_line()) break;
		if (lines_.empty() || is_stopped_) return std::nullopt;
		settle(lines_.front(), std::nullopt);
		Line line = std::move(lines_.front());
		if (line.scan && last_scans_.at(line.scan->label) == &lines_.front()) last_scans_.erase(line.scan->label);
		lines_.pop_front();
		if (line.scan) waiting_ranges_ -= line.scan->size();
		return line;
	}

	/// \returns false at the end, or where the log is damaged or cannot be read
	bool read_line()
	{
		if (!damage_.empty() || is_stopped_) return false;
		const std::size_t before = number_;
		try
		{
			const auto text = next_text();
			if (text) add(*text);
			return text.has_value();
		}
		catch (const ReadError& e)
		{
			damage_ = unread(before > 0 ? "after line " + std::to_string(before) : "", e.what());
			return false;
		}
		catch (const std::exception& e)
		{
			if (is_out_of_memory(e)) throw std::bad_alloc();
			damage_ = "line " + std::to_string(before + 1) + " is damaged or cut short (" + one_line(e) +
			          "); copy or record the log again";
			return false;
		}
	}

	/// Valid until the next call.
	std::optional<std::string_view> next_text()
	{
		std::size_t end = text_.find('\n', past_line_);
		while (end == std::string::npos)
		{
			text_.erase(0, std::exchange(past_line_, 0));
			const std::size_t before = text_.size();
			if (before > kMostShownLine) throw std::runtime_error("it is too long");
			is_stopped_ = stop_();
			if (is_stopped_) return std::nullopt;
			constexpr std::size_t kBlock = 1 << 16;
			text_.resize(before + kBlock);
			text_.resize(before + file_->read(&text_[before], kBlock));
			if (text_.empty()) return std::nullopt;
			end = text_.size() == before ? before : text_.find('\n', before);
		}
		number_++;
		auto line = std::string_view(text_).substr(past_line_, end - past_line_);
		if (number_ == 1 && line.rfind(kByteOrderMark, 0) == 0) line.remove_prefix(kByteOrderMark.size());
		past_line_ = std::min(end + 1, text_.size());
		return line;
	}

	void add(std::string_view text)
	{
		Words words(text);
		const std::string kind(words.word());
		if (kind == "PARAM")
		{
			Lasers again;  // which ends at the same damage as the first reading
			(is_known_ ? again : known_.lasers).read(words);
		}
		else if (kind == "FLASER" || kind == "RLASER")
			add_scan(read_old_laser(kind, words, known_.lasers));
		else if (kind == "ROBOTLASER1" || kind == "ROBOTLASER2")
		{
			const Line line = read_robot_laser(kind, words);
			check_mounting(line);
			add_scan(line);
		}
		else if (kind == "RAWLASER1" || kind == "RAWLASER2")
			has_raw_scans_ = true;
		else if (kind == "ODOM")
			lines_.push_back(read_odometry(words));
	}

	void add_scan(const Line& line)
	{
		scans_++;
		waiting_ranges_ += line.scan->size();
		Line*& last = last_scans_[line.scan->label];
		if (last) settle(*last, line.time);
		last = &lines_.emplace_back(line);
	}

	/// Looks whether a laser, whose lines have its pose, moves on the robot.
	void check_mounting(const Line& line)
	{
		constexpr double kFar = 0.05, kTurned = 0.05;  // [m], [rad] that are no rounding
		const std::string& label = line.scan->label;
		const auto first = mountings_.emplace(label, line.mounting).first;
		const auto moved = line.mounting - first->second;
		if (moved.norm() > kFar || std::abs(moved.phi()) > kTurned) known_.loose.insert(label);
	}

	/// \param next [s] time of the laser's next scan by the log, if there is one
	void settle(Line& line, std::optional<double> next)
	{
		if (line.is_settled) return;
		const double repaired = clocks_[line.scan->label].repair(line.time, next);
		if (repaired != line.time) repaired_++;
		line.time = repaired;
		line.is_settled = true;
	}

	std::unique_ptr<InputStream> file_;
	Stop stop_;
	bool is_stopped_ = false;
	std::string text_;           //!< read, but not yet parsed from past_line_ on
	std::size_t past_line_ = 0;  //!< [byte] of text_
	std::size_t number_ = 0;     //!< [-] lines so far
	bool is_known_;              //!< whether the log has been read before
	KnownLasers known_;
	std::deque<Line> lines_;                               //!< that wait for the times of scans before them
	std::map<std::string, Line*> last_scans_;              //!< of these, the last scan of each laser
	std::size_t waiting_ranges_ = 0;                       //!< [-] of their scans
	std::optional<RecordedScan> scan_;                     //!< comes next
	double newest_ = -std::numeric_limits<double>::max();  //!< [s] of the odometry so far
	std::map<std::string, TimeRepair> clocks_;             //!< by laser
	std::size_t scans_ = 0, repaired_ = 0;
	bool has_raw_scans_ = false;
	std::map<std::string, mrpt::poses::CPose2D> mountings_;  //!< of the first line of each laser
};
}  // namespace

bool is_carmen_text(const std::string& start)
{
	const bool has_mark = start.rfind(kByteOrderMark, 0) == 0;
	const std::string lines = "\n" + start.substr(has_mark ? kByteOrderMark.size() : 0);
	if (start.find('\0') != std::string::npos) return false;
	for (const char* kind :
	     {"PARAM ", "SYNC ", "ODOM ", "FLASER ", "RLASER ", "ROBOTLASER1 ", "ROBOTLASER2 ", "RAWLASER1 ", "# CARMEN"})
		if (lines.find(std::string("\n") + kind) != std::string::npos) return true;
	return false;
}

Log open_carmen_log(const std::string& path, const Stop& stop)
{
	Log log;
	CarmenReader reader(path, stop);
	log.survey = reader.survey();
	log.read_for = [path, stop, known = reader.known()](const std::string&)
	{ return std::make_unique<CarmenReader>(path, stop, known); };
	return log;
}
}  // namespace d2s1r::logs
