// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// A recording through the reading path of rawlog-localize, and the same messages through a LiveLocalizer: both programs
// answer the same, to the last digit.
#include <d2s1r/map_io.h>

#include <deque>
#include <iostream>
#include <map>
#include <variant>

#include "app/temporary_folder.h"
#include "bags/contents.h"
#include "bags/message_source.h"
#include "frames/frame_loop.h"
#include "live/simulated_robot.h"
#include "logs/made_logs.h"
#include "sites.h"

using namespace d2s1r;
using namespace d2s1r::test;

namespace
{
namespace fs = std::filesystem;
using ros::kSecond;
using ros::Time;

/// What is said of a scan.
struct Said
{
	Status status = Status::kInvalid;
	std::optional<mrpt::math::TPose2D> pose{};

	explicit Said(const Localization& answer) : status(answer.status)
	{
		if (!answer.hypotheses.empty()) pose = answer.best().pose.asTPose();
	}
	bool operator==(const Said& other) const
	{
		if (status != other.status || pose.has_value() != other.pose.has_value()) return false;
		return !pose || (pose->x == other.pose->x && pose->y == other.pose->y && pose->phi == other.pose->phi);
	}
};

std::ostream& operator<<(std::ostream& out, const Said& said)
{
	out << to_string(said.status);
	if (said.pose) out << mrpt::format(" %.17g %.17g %.17g", said.pose->x, said.pose->y, said.pose->phi);
	return out;
}

using Answers = std::map<Time, Said>;  //!< by the time of the scan, to 100 ns

/// A recording in a map.
struct Case
{
	std::string log;
	std::shared_ptr<const Localizer> localizer;
	std::string laser{};  //!< empty: that with the most scans of those whose pose on the robot is known
	std::optional<ros::HeightBand> cloud_height{};
	bool laser_is_robot = false;  //!< whether a live robot has to be told that the laser is at its origin
};

logs::Log open(const Case& given)
{
	return logs::open_log(
	    given.log, [] { return false; }, {}, given.cloud_height);
}

const logs::Sensor& sensor_of(const logs::Log& log, const Case& given)
{
	const auto& sensors = log.survey.sensors;
	const auto named = std::find_if(
	    sensors.begin(), sensors.end(), [&](const logs::Sensor& sensor) { return sensor.label == given.laser; });
	if (named != sensors.end()) return *named;
	return *std::max_element(
	    sensors.begin(), sensors.end(),
	    [](const logs::Sensor& a, const logs::Sensor& b)
	    { return std::pair(a.has_pose, a.scans) < std::pair(b.has_pose, b.scans); });
}

Answers recorded(const Case& given, int window)
{
	const logs::Log log = open(given);
	const logs::Sensor& sensor = sensor_of(log, given);
	app::Console console;
	app::ProgressBar progress(console, false, sensor.scans);
	const Atlas atlas(std::vector<AtlasMap>{{"", given.localizer}});
	app::Approach approach{atlas, {}, {}, false, nullptr};
	if (window > 1) approach.window = window;
	Answers answers;
	app::FrameSink sink;
	sink.take_object = [](const logs::RawlogObject&) {};
	sink.take_frame = [&](const app::Frame& frame, const Scan&, const app::ScanPtr& observation)
	{
		answers.emplace(ros::from_time(observation->timestamp), Said(frame.result));
		return true;
	};
	const auto reader = logs::read_log(log, sensor.label, {});
	app::localize_log(*reader, {sensor.label, 0, sensor.scans, 1}, approach, sink, progress);
	return answers;
}

/// Hands the messages of a recording to a live robot, as a node does that listens to one robot. Scans come so late that
/// there is odometry of their time: a robot that runs does not wait for a reading which will hardly tell anything new.
class Player
{
   public:
	Player(const Case& given, int window) : given_(given), log_(open(given)), live_(settings_of(given, window))
	{
		live_.use_maps(std::make_shared<Atlas>(std::vector<AtlasMap>{{"map", given.localizer}}));
		laser_ = sensor_of(log_, given).label;
		odometry_ = sensor_of(log_, given).odometry;
		odometry_ = odometry_.substr(0, odometry_.find(' '));
	}

	Answers play()
	{
		const auto source = logs::open_messages(
		    given_.log, logs::recognize_ros(given_.log).value(), [] { return false; }, given_.cloud_height.has_value());
		Time newest = 0;
		while (const auto message = source->next())
		{
			logs::hand_to(*this, *message);
			newest = std::max(newest, message->time);
			hand_scans(newest);
			update(newest);
		}
		hand_scans(newest + kLate);
		update(newest + 5 * kSecond);
		return std::move(answers_);
	}

	void add_scan(const logs::Message& message)
	{
		if (message.topic->name != laser_) return;
		if (given_.laser_is_robot)
			live_.add_transforms({{{0, "base_link"}, logs::header_of(message).frame, mrpt::poses::CPose3D()}}, true);
		if (message.topic->kind == logs::MessageKind::kPointCloud)
			late_.emplace_back(message.time, logs::point_cloud_of(message));
		else
			late_.emplace_back(message.time, logs::laser_scan_of(message));
	}

	void add_odometry(const logs::Message& message)
	{
		if (message.topic->name == odometry_) live_.add_odometry(logs::odometry_of(message));
	}

	void add_transforms(const logs::Message& message)
	{
		const std::string name = ros::namespace_of(message.topic->name);
		if (!name.empty() && laser_.rfind(name + "/", 0) != 0) return;
		live_.add_transforms(logs::transforms_of(message), logs::is_static(message));
	}

   private:
	static live::LiveSettings settings_of(const Case& given, int window)
	{
		live::LiveSettings settings;
		settings.window = window;
		settings.has_maps_of_its_own = true;
		settings.cloud_height = given.cloud_height;
		settings.as_told = true;  // as the other side is, which asks no drive
		return settings;
	}

	void hand_scans(Time now)
	{
		for (; !late_.empty() && late_.front().first + kLate <= now; late_.pop_front())
			if (const auto* const cloud = std::get_if<ros::PointCloud>(&late_.front().second))
				live_.add_cloud(laser_, *cloud);
			else
				live_.add_scan(laser_, std::get<ros::LaserScan>(late_.front().second));
	}

	void update(Time now)
	{
		for (const live::ScanAnswer& answer : live_.update(now))
			answers_.emplace(answer.time / 100 * 100, Said(answer.localization));
	}

	const Case& given_;
	logs::Log log_;
	live::LiveLocalizer live_;
	std::string laser_, odometry_;
	Answers answers_;
	static constexpr Time kLate = 3 * kSecond / 10;
	std::deque<std::pair<Time, std::variant<ros::LaserScan, ros::PointCloud>>> late_;
};

void expect_the_same(const Case& given)
{
	for (const int window : {1, 5})
	{
		SCOPED_TRACE(given.log + ", window of " + std::to_string(window));
		const Answers offline = recorded(given, window), live = Player(given, window).play();
		EXPECT_FALSE(offline.empty());
		std::size_t differ = 0;
		for (const auto& [time, said] : offline)
		{
			const auto other = live.find(time);
			const bool is_same = other != live.end() && other->second == said;
			if (is_same || differ++ > 2) continue;
			ADD_FAILURE() << "at " << time << " recorded: " << said
			              << "\nlive: " << (other == live.end() ? "no answer" : testing::PrintToString(other->second));
		}
		EXPECT_EQ(differ, 0U) << "of " << offline.size();
		EXPECT_EQ(live.size(), offline.size());
	}
}
}  // namespace

/// Made drives through a drawn building.
class OneRobot : public FolderTest
{
   protected:
	OneRobot()
	{
		robot_.world = world_of(make_floor());
		robot_.pose = mrpt::poses::CPose2D(poses_on_floor().at(4));
		robot_.beams = 120;
	}

	/// Adds the odometry now. \param by_tf, by_messages where it is told, each frozen or not
	void tell_odometry(bool frozen_tf, bool frozen_messages)
	{
		const mrpt::poses::CPose2D &now = robot_.odometry, none;
		const mrpt::poses::CPose2D& tf = frozen_tf ? none : now;
		const mrpt::poses::CPose2D& told = frozen_messages ? none : now;
		messages_.push_back(made_transforms(
		    Wire::kCdr, robot_.time, {{prefix_ + "odom", prefix_ + "base_link", tf.x(), tf.y(), 0, 'z', tf.phi()}},
		    "/tf"));
		if (has_messages_) messages_.push_back(made_odometry(Wire::kCdr, robot_.time, told.x(), told.y(), told.phi()));
	}

	void tell_laser()
	{
		messages_.push_back(made_transforms(
		    Wire::kCdr, robot_.time, {{prefix_ + "base_link", prefix_ + "laser", 0.2, 0.05, 0.3, 'z', 0.1}}));
	}

	void tell_scan(const ros::LaserScan& scan)
	{
		MadeScan made;
		made.time = scan.header.time;
		made.frame = prefix_ + "laser";
		made.first_angle = scan.first_angle;
		made.angle_step = scan.angle_step;
		made.time_step = scan.time_step;
		made.max_range = scan.max_range;
		made.ranges = scan.ranges;
		messages_.push_back(made_scan(Wire::kCdr, made));
		messages_.back().time = robot_.time;
	}

	/// Drives 20 scans, each of which takes 0.1 s.
	Case drive(bool frozen_tf = false, bool frozen_messages = false)
	{
		tell_laser();
		for (int i = 0; i < 20; i++)
			tell_scan(robot_.sweep(0.1, 0.3, 0.8, [&] { tell_odometry(frozen_tf, frozen_messages); }));
		write("log", mcap_file(messages_));
		return {path("log"), std::make_shared<const Localizer>(make_map(make_floor()))};
	}

	SimulatedRobot robot_;
	std::string prefix_;
	bool has_messages_ = true;
	std::vector<MadeMessage> messages_;
};

TEST_F(OneRobot, WithOdometryOfBothKindsIsTheSame)
{
	expect_the_same(drive());
}

TEST_F(OneRobot, InANamespaceWithoutMessagesOfOdometryIsTheSame)
{
	prefix_ = "robot1/";
	has_messages_ = false;
	expect_the_same(drive());
}

TEST_F(OneRobot, WithFrozenOdometryOnTfIsTheSame)
{
	expect_the_same(drive(true, false));
}

TEST_F(OneRobot, WithFrozenMessagesOfOdometryIsTheSame)
{
	const Case given = drive(false, true);
	expect_the_same(given);
	const logs::Log log = open(given);
	const auto reader = logs::read_log(log, "/scan", {});
	while (reader->next()) continue;
	EXPECT_NE(reader->track()->description().find("transforms of odometry agree"), std::string::npos);
}

TEST_F(OneRobot, WithPointCloudsIsTheSame)
{
	tell_laser();
	for (int i = 0; i < 20; i++)
	{
		tell_odometry(false, false);
		const ros::LaserScan scan = robot_.scan();
		MadeCloud cloud;
		cloud.time = robot_.time;
		cloud.points.clear();
		for (std::size_t beam = 0; beam < scan.ranges.size(); beam++)
		{
			const double angle = static_cast<double>(scan.first_angle + static_cast<float>(beam) * scan.angle_step);
			const auto range = static_cast<double>(scan.ranges[beam]);
			if (range < 20) cloud.points.push_back({range * std::cos(angle), range * std::sin(angle), 0});
		}
		messages_.push_back(made_cloud(Wire::kCdr, cloud));
		messages_.back().time = robot_.time;
		robot_.time += kSecond / 10;
		robot_.move(0.05, 0.1);
	}
	tell_odometry(false, false);
	write("log", mcap_file(messages_));
	Case given{path("log"), std::make_shared<const Localizer>(make_map(make_floor()))};
	given.cloud_height = ros::HeightBand{0, 1};
	expect_the_same(given);
}

TEST(OneRobotRecorded, OfTheOfficeIsTheSame)
{
	const fs::path data = fs::path(D2S1R_SOURCE_DIR) / "share/d2s1r/data";
	expect_the_same(
	    {data / "office_bag", std::make_shared<const Localizer>(load_map((data / "office.yaml").string()))});
}

TEST(OneRobotRecorded, OfOtherPeopleIsTheSame)
{
	const fs::path foreign = sites_folder() / "foreign";
	if (!fs::exists(foreign)) GTEST_SKIP() << why_skipped(foreign);
	int bags = 0;
	for (const auto& set : fs::directory_iterator(foreign))
	{
		if (!fs::exists(set.path() / "test.bag")) continue;
		bags++;
		Case given{
		    set.path() / "test.bag", std::make_shared<const Localizer>(load_map((set.path() / "map.yaml").string()))};
		given.laser_is_robot = true;
		expect_the_same(given);
	}
	EXPECT_EQ(bags, 7);
}

/// Inputs after public bug reports, small ones.
TEST(OneRobotRecorded, OfBugReportsIsTheSame)
{
	const fs::path faults = sites_folder() / "../tools/faults/field";
	if (!fs::exists(faults)) GTEST_SKIP() << why_skipped(faults);
	const std::string office = std::string(D2S1R_SOURCE_DIR) + "/share/d2s1r/data/office.yaml";
	int logs = 0;
	for (const auto& fault : fs::directory_iterator(faults))
		for (const char* name : {"log.mcap", "log.db3"})
		{
			if (!fs::exists(fault.path() / name)) continue;
			logs++;
			const fs::path map = fault.path() / "map.yaml";
			const std::string file = fs::exists(map) ? map.string() : office;
			expect_the_same({fault.path() / name, std::make_shared<const Localizer>(load_map(file))});
		}
	EXPECT_GT(logs, 20);
}
