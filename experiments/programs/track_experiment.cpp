// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// track_experiment recorded MAP RUN.rawlog RUN_gt.txt [NAME=VALUE ...]
// track_experiment simulated [MAP [WORLD]] [NAME=VALUE ...]
// How well Tracker follows a robot, and MRPT's particle filter as `rawlog-localize --fuse` runs it. NAME=VALUE sets
//   filter=0|1         whether the filter follows it, too (1)
//   frames=N           [frames] of a recorded run that are used at most (all)
//   wheels=SEED        recorded: makes odometry of the ground truth, with errors (0: that of the log, -1: none)
//   scale=NUMBER       [-] by which the ways of the odometry are multiplied (1)
//   list=0|1           whether a line is printed for each frame that the tracker has wrong or outside of three standard
//                      deviations (0)
//   right=M            how far off a right pose may be (0.3)
//   truth=M, truth_yaw=DEG  standard deviations of the truth (simulated 0, recorded 0.05 and 1: a third of how far such
//                      truths lie from where their scans fit the map best)
//   and of a simulated drive through a generated floor, MAP, or WORLD, another drawing of the building of MAP
//   area=M2 (400), twins=0|1: the floor and itself turned by half a turn beside it (0), seed=N (1), seconds=S (300),
//   rate=HZ (10) of scans, speed=M/S (0.5), view=DEG (360), beams=N (360), reach=M (30), clutter=SHARE of the beams
//   that people hide (0.3), altered=0|1 whether some walls are others than in the map (1), kidnap=S seconds between two
//   kidnappings (0: none), stand=S seconds that the robot stands after each (0)
// Prints, for each of the two: errors of the poses where they are right, share of time right (and 10 deg), seconds
// until right after the start and after each kidnapping, processor time and instructions a scan, and the longest time
// outside of three standard deviations, of all poses and of those that it is sure of, and how often that was for more
// than 3 s.
#include <d2s1r/map_io.h>
#include <d2s1r/tracker.h>
#include <linux/perf_event.h>
#include <mrpt/core/bits_math.h>
#include <mrpt/core/format.h>
#include <mrpt/math/wrap2pi.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>
#include <random>

#include "CParticleFilterFusion.h"
#include "benchmark/office_floor.h"
#include "made_floors.h"
#include "recorded_run.h"
#include "settings.h"

namespace d2s1r::experiments
{
namespace
{
using mrpt::math::TPose2D;
using mrpt::poses::CPose2D;

constexpr double kLong = 3;                        //!< [s]
constexpr double kRightYaw = mrpt::DEG2RAD(10.0);  //!< [rad]

/// A scan of a drive.
struct Step
{
	mrpt::obs::CObservation2DRangeScan::Ptr scan;
	double time = 0;                //!< [s]
	std::optional<CPose2D> motion;  //!< by the odometry, since the last scan
	TPose2D truth;                  //!< robot in map
	bool has_truth = true;
	double truth_std = 0, truth_std_yaw = 0;  //!< [m], [rad] of the truth
	bool is_carried = false;                  //!< whether the robot was carried away before it
};

/// Sets how well the truth is known. \param unless_set [m], [deg]
void set_truth_std(Step& step, double unless_set, double unless_set_yaw, const Settings& settings)
{
	const auto choose = [&](const char* name, double other)
	{ return settings.at(name) >= 0 ? settings.at(name) : other; };
	step.truth_std = choose("truth", unless_set);
	step.truth_std_yaw = mrpt::DEG2RAD(choose("truth_yaw", unless_set_yaw));
}

/// A pose that somebody tells after a scan.
struct ToldPose
{
	TPose2D pose;
	mrpt::math::CMatrixDouble33 covariance;
	bool is_sure = false;
};

std::string describe(const ToldPose& told)
{
	const auto std_of = [&](int i) { return std::sqrt(told.covariance(i, i)); };
	return mrpt::format(
	    "%.2f %.2f %.1f (+- %.2f %.2f %.1f)%s", told.pose.x, told.pose.y, mrpt::RAD2DEG(told.pose.phi), std_of(0),
	    std_of(1), mrpt::RAD2DEG(std_of(2)), told.is_sure ? ", sure" : "");
}

/// Counts the processor time and the instructions of this thread.
class Effort
{
   public:
	Effort()
	{
		perf_event_attr event{};
		event.type = PERF_TYPE_HARDWARE;
		event.size = sizeof event;
		event.config = PERF_COUNT_HW_INSTRUCTIONS;
		event.exclude_kernel = 1;
		event.exclude_hv = 1;
		counter_ = static_cast<int>(syscall(SYS_perf_event_open, &event, 0, -1, -1, 0));
	}
	~Effort()
	{
		if (counter_ >= 0) close(counter_);
	}
	Effort(const Effort&) = delete;
	Effort& operator=(const Effort&) = delete;

	static double seconds()
	{
		timespec now{};
		clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
		return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
	}

	/// Returns the instructions so far; 0 where they cannot be counted.
	double instructions() const
	{
		std::uint64_t count = 0;
		return counter_ >= 0 && read(counter_, &count, sizeof count) == sizeof count ? static_cast<double>(count) : 0;
	}

   private:
	int counter_;
};

double quantile(std::vector<double> values, double share)
{
	if (values.empty()) return std::nan("");
	std::sort(values.begin(), values.end());
	return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

/// Judges the poses of a drive.
class Judge
{
   public:
	/// \param right [m] how far off a right pose may be
	explicit Judge(double right) : most_off_(right) {}

	void add(const Step& step, const std::optional<ToldPose>& told, double cpu_ms, double instructions)
	{
		cpu_ms_.push_back(cpu_ms);
		instructions_.push_back(instructions);
		const double passed = last_time_ ? std::min(5.0, step.time - *last_time_) : 0;
		last_time_ = step.time;
		if (step.is_carried || times_.empty())
		{
			lost_since_ = step.time;
			times_.push_back(HUGE_VAL);
			outside_since_ = sure_outside_since_ = HUGE_VAL;
		}
		if (!step.has_truth) return;
		const double off = told ? std::hypot(told->pose.x - step.truth.x, told->pose.y - step.truth.y) : HUGE_VAL;
		const double turn = told ? std::abs(mrpt::math::wrapToPi(told->pose.phi - step.truth.phi)) : HUGE_VAL;
		is_right_ = off < most_off_ && turn < kRightYaw;
		all_ += passed;
		right_ += is_right_ ? passed : 0;
		sure_ += told && told->is_sure ? 1 : 0;
		misled_ += told && told->is_sure && !is_right_ ? 1 : 0;
		frames_++;
		if (is_right_ && std::isinf(times_.back())) times_.back() = step.time - lost_since_;
		if (told) judge_told(step, *told, off, turn);
	}

	bool is_right() const { return is_right_ && std::isinf(outside_since_); }

	void print(const char* name) const
	{
		const std::vector<double> carried(times_.begin() + 1, times_.end());
		std::printf(
		    "%-8s off %.3f m (95 %% %.3f), %.2f deg (%.2f); right %.2f %% of the time; start %.1f s, kidnapped %zu: "
		    "median %.1f, longest %.1f s; sure %d of %d, wrong %d; outside 3 std for %.1f s, sure %.1f s, %d times "
		    "more "
		    "than 3 s; cpu %.2f ms (mean %.2f)",
		    name, quantile(off_, 0.5), quantile(off_, 0.95), mrpt::RAD2DEG(quantile(turn_, 0.5)),
		    mrpt::RAD2DEG(quantile(turn_, 0.95)), 100 * right_ / all_, times_.front(), carried.size(),
		    quantile(carried, 0.5), quantile(carried, 1), sure_, frames_, misled_, longest_outside_, longest_sure_,
		    long_sure_, quantile(cpu_ms_, 0.5), mean(cpu_ms_));
		if (quantile(instructions_, 0.5) > 0)
			std::printf(
			    ", %.2f M instructions (mean %.2f)", 1e-6 * quantile(instructions_, 0.5), 1e-6 * mean(instructions_));
		std::printf("\n");
	}

   private:
	static double mean(const std::vector<double>& values)
	{
		double sum = 0;
		for (const double value : values) sum += value;
		return sum / static_cast<double>(values.size());
	}

	void judge_told(const Step& step, const ToldPose& told, double off, double turn)
	{
		if (is_right_)
		{
			off_.push_back(off);
			turn_.push_back(turn);
		}
		const double std_xy =
		    std::hypot(std::sqrt(std::max(told.covariance(0, 0), told.covariance(1, 1))), step.truth_std);
		const bool is_outside =
		    off > 3 * std_xy || turn > 3 * std::hypot(std::sqrt(told.covariance(2, 2)), step.truth_std_yaw);
		if (!is_outside)
			outside_since_ = HUGE_VAL;
		else if (std::isinf(outside_since_))
			outside_since_ = step.time;
		if (is_outside) longest_outside_ = std::max(longest_outside_, step.time - outside_since_);
		if (!is_outside || !told.is_sure)
			sure_outside_since_ = HUGE_VAL;
		else if (std::isinf(sure_outside_since_))
			sure_outside_since_ = step.time;
		if (!is_outside || !told.is_sure) return;
		const double outside = step.time - sure_outside_since_;
		long_sure_ += outside > kLong && sure_outside_ <= kLong ? 1 : 0;
		sure_outside_ = outside;
		longest_sure_ = std::max(longest_sure_, outside);
	}

	double most_off_;
	std::vector<double> off_, turn_, cpu_ms_, instructions_, times_;
	double all_ = 0, right_ = 0, lost_since_ = 0, outside_since_ = HUGE_VAL, longest_outside_ = 0;
	double sure_outside_since_ = HUGE_VAL, sure_outside_ = 0, longest_sure_ = 0;
	std::optional<double> last_time_;
	int sure_ = 0, misled_ = 0, frames_ = 0, long_sure_ = 0;
	bool is_right_ = false;
};

/// Runs a follower over a drive.
template <typename Follow>
void follow(const std::vector<Step>& drive, const char* name, const Settings& settings, bool lists, Follow follow_one)
{
	const Effort effort;
	Judge judge(settings.at("right"));
	for (std::size_t i = 0; i < drive.size(); i++)
	{
		const double began = Effort::seconds(), before = effort.instructions();
		const std::optional<ToldPose> told = follow_one(drive[i]);
		judge.add(drive[i], told, 1e3 * (Effort::seconds() - began), effort.instructions() - before);
		if (lists && !judge.is_right() && drive[i].has_truth)
			std::printf(
			    "  frame %zu, %.1f s: truth %.2f %.2f %.1f, told %s\n", i, drive[i].time - drive[0].time,
			    drive[i].truth.x, drive[i].truth.y, mrpt::RAD2DEG(drive[i].truth.phi),
			    told ? describe(*told).c_str() : "nothing");
	}
	judge.print(name);
}

/// Lets both follow a drive.
void compare(const std::vector<Step>& drive, const CSignatureMap2D::Ptr& map, const Settings& settings)
{
	const Localizer& localizer = map->localizer();
	Tracker tracker(localizer);
	follow(
	    drive, "tracker", settings, settings.at("list") != 0,
	    [&](const Step& step) -> std::optional<ToldPose>
	    {
		    const Localization answer =
		        tracker.add(step.time, make_scan(d2s1r::scan_of(*step.scan), localizer.parameters().scan), step.motion);
		    if (answer.hypotheses.empty()) return std::nullopt;
		    return ToldPose{
		        answer.best().pose.asTPose(), answer.best().covariance, answer.status == Status::kLocalized};
	    });
	if (settings.at("filter") == 0) return;
	CParticleFilterFusion filter;
	filter.start({{map}}, {});
	follow(
	    drive, "filter", settings, false,
	    [&](const Step& step) -> std::optional<ToldPose>
	    {
		    const auto fused = filter.step({*step.scan, localizer.localize(d2s1r::scan_of(*step.scan)), step.motion});
		    if (!fused) return std::nullopt;
		    return ToldPose{fused->pose, fused->covariance, fused->status == FusionStatus::kTracking};
	    });
}

void run_recorded(const Words& words, const Settings& settings)
{
	const auto map = CSignatureMap2D::Create(*load_map(words[1]));
	auto run = load_run(words[2], words[3]);
	if (static_cast<double>(run.size()) > settings.at("frames"))
		run.resize(static_cast<std::size_t>(settings.at("frames")));
	if (settings.at("wheels") > 0) make_odometry(run, static_cast<unsigned>(settings.at("wheels")));
	disturb_odometry(run, settings.at("scale"), 0);
	std::vector<Step> drive;
	for (std::size_t i = 0; i < run.size(); i++)
	{
		Step& step = drive.emplace_back();
		step.scan = run[i].scan;
		step.time = mrpt::Clock::toDouble(run[i].scan->timestamp);
		step.truth = run[i].truth;
		step.has_truth = run[i].has_truth;
		set_truth_std(step, 0.05, 1, settings);
		if (i > 0 && run[i].odometry && run[i - 1].odometry && settings.at("wheels") >= 0)
			step.motion = *run[i].odometry - *run[i - 1].odometry;
	}
	compare(drive, map, settings);
}

/// Returns a floor and the same turned by half a turn beside it: every place has a twin.
Grid with_twin(const Grid& half)
{
	Grid whole = half;
	whole.width = 2 * half.width;
	whole.cells.assign(static_cast<std::size_t>(whole.width) * static_cast<std::size_t>(whole.height), Cell::kUnknown);
	for (int y = 0; y < half.height; y++)
		for (int x = 0; x < half.width; x++)
		{
			whole.cells[static_cast<std::size_t>(whole.index(x, y))] = half.at(x, y);
			whole.cells[static_cast<std::size_t>(whole.index(whole.width - 1 - x, whole.height - 1 - y))] =
			    half.at(x, y);
		}
	return whole;
}

/// A robot that wanders through a floor among people.
class Wanderer
{
   public:
	Wanderer(const Grid& world, const Settings& settings)
	    : world_(world),
	      settings_(settings),
	      caster_(world, settings.at("reach")),
	      random_(static_cast<unsigned>(settings.at("seed")))
	{
		carry_away();
	}

	void carry_away() { pose_ = CPose2D(open_pose_on(world_, random_)); }

	/// Drives on, or turns where it cannot. Returns the motion that the wheels measure.
	CPose2D move(bool stands)
	{
		const double step = 1 / settings_.at("rate");
		std::normal_distribution<double> error(1, 0.03), turn(0, 0.3);
		CPose2D motion(settings_.at("speed") * step, 0, turn(random_) * step);
		if (stands)
			motion = {};
		else if (!is_free(pose_ + motion))
			motion = CPose2D(0, 0, turning_ * 0.8 * step);
		else if (random_() % 50 == 0)
			turning_ = -turning_;
		pose_ = pose_ + motion;
		const double scale = settings_.at("scale");
		return {scale * motion.x() * error(random_), 0, scale * motion.phi() * error(random_)};
	}

	TPose2D pose() const { return pose_.asTPose(); }

	/// Returns what its laser sees; people hide beams in groups of 5 to 20 deg.
	mrpt::obs::CObservation2DRangeScan::Ptr scan(double time)
	{
		const auto beams = static_cast<std::size_t>(settings_.at("beams"));
		const double view = mrpt::DEG2RAD(settings_.at("view")), reach = settings_.at("reach");
		const bool is_circle = settings_.at("view") >= 360;
		const double between = view / static_cast<double>(is_circle ? beams : beams - 1);
		auto scan = mrpt::obs::CObservation2DRangeScan::Create();
		scan->timestamp = mrpt::Clock::fromDouble(time);
		scan->aperture = static_cast<float>(between * static_cast<double>(beams - 1));
		scan->maxRange = static_cast<float>(reach);
		scan->resizeScan(beams);
		const std::vector<bool> hidden = hidden_beams(beams, between);
		std::normal_distribution<double> noise(0, 0.01);
		std::uniform_real_distribution<double> before(0.3, 0.9);
		double nearness = before(random_);
		for (std::size_t i = 0; i < beams; i++)
		{
			const double angle = -static_cast<double>(scan->aperture) / 2 + between * static_cast<double>(i);
			double range = static_cast<double>(caster_.cast(pose_.x(), pose_.y(), pose_.phi() + angle));
			if (i > 0 && hidden[i] && !hidden[i - 1]) nearness = before(random_);
			if (hidden[i]) range = std::min(range, std::max(0.4, nearness * std::min(range, 4.0)));
			const bool is_return = range > 0 && range < reach;
			scan->setScanRange(i, static_cast<float>(is_return ? std::max(0.05, range + noise(random_)) : reach));
			scan->setScanRangeValidity(i, is_return);
		}
		return scan;
	}

   private:
	bool is_free(const CPose2D& at) const
	{
		return is_open(
		    world_, static_cast<int>((at.x() - world_.origin_x) / world_.cell_size),
		    static_cast<int>((at.y() - world_.origin_y) / world_.cell_size));
	}

	std::vector<bool> hidden_beams(std::size_t beams, double between)
	{
		std::vector<bool> hidden(beams, false);
		std::uniform_int_distribution<std::size_t> first(0, beams - 1);
		std::uniform_real_distribution<double> width(mrpt::DEG2RAD(5.0), mrpt::DEG2RAD(20.0));
		const auto wanted = static_cast<std::size_t>(settings_.at("clutter") * static_cast<double>(beams));
		for (std::size_t count = 0; count < wanted;)
		{
			const std::size_t from = first(random_);
			const auto many = static_cast<std::size_t>(width(random_) / between) + 1;
			for (std::size_t i = from; i < std::min(beams, from + many) && count < wanted; i++)
			{
				count += hidden[i] ? 0 : 1;
				hidden[i] = true;
			}
		}
		return hidden;
	}

	const Grid& world_;
	const Settings& settings_;
	RayCaster caster_;
	std::mt19937 random_;
	double turning_ = 1;
	CPose2D pose_;
};

void run_simulated(const Words& words, const Settings& settings)
{
	const auto seed = static_cast<unsigned>(settings.at("seed"));
	const auto read = [](const std::string& file) { return make_grid(*load_map(file), {}); };
	Grid floor = words.size() > 1 ? read(words[1]) : benchmark::make_office_floor(settings.at("area"), 0.05, seed);
	if (settings.at("twins") != 0) floor = with_twin(floor);
	Grid world = words.size() > 2 ? read(words[2]) : floor;
	if (settings.at("altered") != 0) world = altered(world, seed);
	Wanderer robot(world, settings);
	std::vector<Step> drive;
	const double between = 1 / settings.at("rate"), kidnap = settings.at("kidnap");
	double carried_at = 0;
	for (double passed = 0; passed < settings.at("seconds"); passed += between)
	{
		Step& step = drive.emplace_back();
		step.time = 1e6 + passed;
		step.motion = robot.move(passed - carried_at < settings.at("stand"));
		if (kidnap > 0 && passed - carried_at >= kidnap)
		{
			const TPose2D before = robot.pose();
			do robot.carry_away();
			while (std::hypot(robot.pose().x - before.x, robot.pose().y - before.y) < 1);
			step.is_carried = true;
			carried_at = passed;
		}
		step.truth = robot.pose();
		set_truth_std(step, 0, 0, settings);
		step.scan = robot.scan(step.time);
		if (settings.at("wheels") < 0) step.motion.reset();
	}
	compare(drive, CSignatureMap2D::Create(words.size() > 1 ? *load_map(words[1]) : *map_of(floor)), settings);
}
}  // namespace
}  // namespace d2s1r::experiments

int main(int argc, char** argv)
{
	using namespace d2s1r::experiments;
	try
	{
		Words words(argv + 1, argv + argc);
		const auto first = std::stable_partition(
		    words.begin(), words.end(), [](const std::string& word) { return word.find('=') == std::string::npos; });
		const Words set(first, words.end());
		words.erase(first, words.end());
		const Settings unless_given = {{"filter", 1},  {"frames", std::numeric_limits<double>::infinity()},
		                               {"wheels", 0},  {"scale", 1},
		                               {"list", 0},    {"right", 0.3},
		                               {"truth", -1},  {"truth_yaw", -1},
		                               {"area", 400},  {"twins", 0},
		                               {"seed", 1},    {"seconds", 300},
		                               {"rate", 10},   {"speed", 0.5},
		                               {"view", 360},  {"beams", 360},
		                               {"reach", 30},  {"clutter", 0.3},
		                               {"altered", 1}, {"kidnap", 0},
		                               {"stand", 0}};
		const Settings settings = read_settings("track_experiment", unless_given, set);
		if (words.size() == 4 && words[0] == "recorded")
			run_recorded(words, settings);
		else if (!words.empty() && words.size() < 4 && words[0] == "simulated")
			run_simulated(words, settings);
		else
			throw std::invalid_argument(
			    "usage: track_experiment recorded MAP RUN.rawlog GT [NAME=VALUE ...], or simulated [MAP [WORLD]] "
			    "[NAME=VALUE ...]");
		return 0;
	}
	catch (const std::exception& error)
	{
		std::fprintf(stderr, "track_experiment: %s\n", error.what());
		return 1;
	}
}
