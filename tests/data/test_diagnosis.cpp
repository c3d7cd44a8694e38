// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Mistakes, planted into a log or a map that fit to each other, are named; and none is where there is none.
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>

#include <functional>

#include "diagnosis/diagnosis.h"
#include "mrpt_types.h"
#include "sites.h"
#include "test_floor.h"

namespace d2s1r::test
{
namespace
{
using app::CommandLine;
using app::Diagnosis;
using app::GroundTruth;
using logs::Log;
using logs::LogReader;
using logs::RawlogObject;

/// What a mistake does to each scan of a log.
using Alter = std::function<void(logs::RecordedScan&)>;

/// A log that fits to a map.
struct Set
{
	std::string name;
	std::shared_ptr<const OccupancyMap> map;
	Log log;
	logs::Sensor laser;
	GroundTruth truth;
};

/// Alters the scans of another reader, and may put scans of another laser before each.
class AlteringReader : public LogReader
{
   public:
	AlteringReader(std::unique_ptr<LogReader> reader, Alter alter, std::string other_laser)
	    : reader_(std::move(reader)), alter_(std::move(alter)), other_laser_(std::move(other_laser))
	{
	}

	std::optional<RawlogObject> next() override
	{
		if (waiting_) return std::exchange(waiting_, std::nullopt);
		auto object = reader_->next();
		if (!object || object->scans.empty()) return object;
		logs::RecordedScan scan = *object->scans.front(), altered = scan;
		alter_(altered);
		if (!other_laser_.empty())
		{
			scan.label = other_laser_;
			waiting_ = logs::object_of(scan);
		}
		return logs::object_of(altered);
	}

   private:
	std::unique_ptr<LogReader> reader_;
	Alter alter_;
	std::string other_laser_;
	std::optional<RawlogObject> waiting_;
};

Set with(Set set, const Alter& alter, const std::string& other_laser = "")
{
	set.log.read_for = [read = set.log.read_for, alter, other_laser](const std::string& label)
	{ return std::make_unique<AlteringReader>(read(label), alter, other_laser); };
	if (!other_laser.empty()) set.log.survey.sensors.push_back({other_laser, set.laser.scans});
	return set;
}

/// Reads a log from memory.
class MemoryReader : public LogReader
{
   public:
	explicit MemoryReader(std::vector<RawlogObject> observations) : observations_(std::move(observations)) {}
	std::optional<RawlogObject> next() override
	{
		if (next_ == observations_.size()) return std::nullopt;
		return observations_[next_++];
	}

   private:
	std::vector<RawlogObject> observations_;
	std::size_t next_ = 0;
};

/// Robots all over make_floor(), each second one turned by 0.1 rad and the others by 1.1 rad since the one before.
std::vector<mrpt::math::TPose2D> drive()
{
	auto poses = random_poses(make_floor(), 24, 0.4, 7);
	for (std::size_t i = 0; i < poses.size(); i++)
		poses[i].phi = mrpt::math::wrapToPi(1.2 * static_cast<double>(i / 2) + 0.1 * static_cast<double>(i % 2));
	return poses;
}

/// The drawn floor, and a drive through it with odometry and ground truth. \param laser that sees, wherever the log
/// says that it is
Set drawn_set(const Laser& laser = {})
{
	Set set;
	set.name = "drawn floor";
	const Grid grid = make_floor();
	set.map = make_map(grid);
	std::vector<RawlogObject> observations;
	double time = 1.6e9;
	for (const auto& pose : drive())
	{
		logs::RecordedScan scan{make_observation(world_of(grid), pose, laser), "LASER", mrpt::Clock::fromDouble(time)};
		scan.sensor_on_robot = {};
		observations.push_back(logs::object_of({"", scan.timestamp, mrpt::poses::CPose2D(pose)}));
		observations.push_back(logs::object_of(scan));
		set.truth.push_back({time, pose});
		time += 1;
	}
	set.laser = {"LASER", drive().size()};
	set.log.survey.sensors = {set.laser};
	set.log.read_for = [observations](const std::string&) { return std::make_unique<MemoryReader>(observations); };
	return set;
}

/// A recorded or simulated set of a site.
Set site_set(const std::string& site, const std::string& log, const std::string& map = "map.yaml")
{
	const auto folder = sites_folder() / site;
	Set set;
	set.name = site + " " + log;
	set.map = load_map((folder / map).string());
	set.log = logs::open_log((folder / (log + ".rawlog")).string());
	set.laser = app::choose_sensor(set.log.survey, {});
	set.truth = app::load_ground_truth((folder / (log + "_gt.txt")).string());
	return set;
}

Diagnosis diagnosis_of(const Set& set, CommandLine command = {})
{
	command.map.files = {"map"};
	const Localizer localizer(set.map);
	app::FrameSelection selection;
	selection.label = set.laser.label;
	selection.past = set.laser.scans;
	return app::diagnose(set.log, selection, command, localizer, set.truth);
}

std::string advice_of(const Diagnosis& diagnosis)
{
	std::string text;
	for (const auto& line : diagnosis.advice) text += line + "\n";
	return text;
}

void expect_named(const Set& set, const std::string& what, const CommandLine& command = {})
{
	const Diagnosis diagnosis = diagnosis_of(set, command);
	ASSERT_EQ(diagnosis.advice.size(), 1U)
	    << set.name << ": " << what << ", " << diagnosis.fit << " of " << diagnosis.tried << " fit\n"
	    << advice_of(diagnosis);
	EXPECT_NE(diagnosis.advice[0].find(what), std::string::npos) << set.name << ": " << diagnosis.advice[0];
}

void expect_sound(const Set& set)
{
	EXPECT_EQ(advice_of(diagnosis_of(set)), "") << set.name;
}

/// The map with cells of another size about the same corner.
Set with_cells(Set set, double cell_size)
{
	Grid grid = make_grid(*set.map, {});
	grid.cell_size = cell_size;
	grid.origin_x = grid.origin_y = 0;
	set.map = make_map(grid);
	return set;
}

Set with_flipped_image(Set set)
{
	Grid grid = make_grid(*set.map, {});
	for (int row = 0; row < grid.height / 2; row++)
		std::swap_ranges(
		    grid.cells.begin() + grid.index(0, row), grid.cells.begin() + grid.index(0, row + 1),
		    grid.cells.begin() + grid.index(0, grid.height - 1 - row));
	grid.origin_x = grid.origin_y = 0;
	set.map = make_map(grid);
	return set;
}

Set with_origin(Set set, double x, double y)
{
	Grid grid = make_grid(*set.map, {});
	grid.origin_x = x;
	grid.origin_y = y;
	set.map = make_map(grid);
	return set;
}

void for_ranges(logs::RecordedScan& scan, const std::function<float(float)>& alter)
{
	for (std::size_t i = 0; i < scan.size(); i++) scan.ranges[i] = alter(scan.ranges[i]);
}

void mirror(logs::RecordedScan& scan)
{
	scan.right_to_left = !scan.right_to_left;
}

void to_millimetres(logs::RecordedScan& scan)
{
	for_ranges(scan, [](float range) { return 1000 * range; });
}

Alter seen_up_to(float reach, float beyond)
{
	return [=](logs::RecordedScan& scan)
	{
		for_ranges(scan, [&](float range) { return range < reach ? range : beyond; });
		for (std::size_t i = 0; i < scan.size(); i++) scan.valid[i] = scan.ranges[i] > 0 ? 1 : 0;
	};
}

/// The range of the laser is said to be shorter than it is.
Alter with_max_range(float range)
{
	return [=](logs::RecordedScan& scan) { scan.max_range = range; };
}

/// As a laser behind a curtain that moves sees it.
void block_most(logs::RecordedScan& scan)
{
	const float first = scan.ranges.front();
	const auto moved = std::isfinite(first) ? static_cast<std::size_t>(1000 * std::abs(first)) : 0;
	for (std::size_t i = 0; i < scan.size(); i++)
		if (i % 3 != 0) scan.ranges[i] = 0.35F + 0.02F * static_cast<float>((i + moved) % 5);
}
}  // namespace

TEST(DiagnosisOfDrawnFloor, NamesNothingWithoutAMistake)
{
	expect_sound(drawn_set());
	expect_sound(drawn_set(laser_of(180)));
}

TEST(DiagnosisOfDrawnFloor, NamesAResolution)
{
	expect_named(with_cells(drawn_set(), 0.06), "the cells of the map are 0.0");
}

TEST(DiagnosisOfDrawnFloor, NamesAMirror)
{
	expect_named(
	    with(drawn_set(), mirror),
	    "scans are mirrored, by how the laser is mounted or by the image of the map: --sensor-pose 0");
	expect_named(with_flipped_image(drawn_set()), "by the image of the map");
}

TEST(DiagnosisOfDrawnFloor, NamesAWrongOrigin)
{
	expect_named(with_origin(drawn_set(), 3, -2), "the origin of the map is (-");
}

TEST(DiagnosisOfDrawnFloor, NamesWhatIsWrongWithRanges)
{
	expect_named(with(drawn_set(), to_millimetres), "the ranges are millimetres: --range-factor 0.001");
}

TEST(DiagnosisOfDrawnFloor, NamesReadingsThatMeanNoReturn)
{
	for (const float reach : {1.6F, 2.0F, 3.0F})
		expect_named(with(drawn_set(), seen_up_to(reach, reach)), "mean that nothing was there: --max-range");
}

TEST(DiagnosisOfDrawnFloor, NamesAnotherLaser)
{
	expect_named(with(drawn_set(), block_most, "GOOD"), "another laser is used: --sensor-label 'GOOD'");
}

TEST(DiagnosisOfDrawnFloor, TellsWhatFitsOutsideARegion)
{
	CommandLine command;
	command.search.query.prior = make_prior(-3, 2, 0, 4);
	expect_named(drawn_set(), "scans fit outside the region", command);
	command.search.query.prior = make_prior(-10, 0, 20, 20);
	EXPECT_EQ(advice_of(diagnosis_of(drawn_set(), command)), "");
}

TEST(DiagnosisOfDrawnFloor, KnowsNoMistakeThatExplainsScansOfAnotherBuilding)
{
	Set set = drawn_set();
	set.map = make_map(make_building({"##########", "#...#....#", "#...#....#", "#........#", "##########"}));
	const Diagnosis diagnosis = diagnosis_of(set);
	EXPECT_EQ(advice_of(diagnosis), "");
	EXPECT_LT(diagnosis.fit, 5U);
}

class DiagnosisOfSite : public testing::TestWithParam<const char*>
{
   protected:
	void SetUp() override
	{
		if (!std::filesystem::exists(sites_folder() / GetParam()))
			GTEST_SKIP() << why_skipped(sites_folder() / GetParam());
	}
};

TEST_P(DiagnosisOfSite, NamesEachOfTheOtherMistakes)
{
	const Set circles = site_set(GetParam(), "sim360_on"), run = site_set(GetParam(), "run");
	const auto cell = static_cast<double>(circles.map->cell_size);
	expect_named(with_cells(circles, 0.5 * cell), "the cells of the map are 0.0");
	expect_named(with_cells(circles, 1.2 * cell), "the cells of the map are 0.0");
	expect_named(with_origin(circles, 5, 7), "the origin of the map is");
	expect_named(with_flipped_image(run), "by the image of the map");
	expect_named(with(run, mirror), "scans are mirrored, by how the laser is mounted");
	expect_named(with(circles, to_millimetres), "the ranges are millimetres");
	expect_named(with(circles, block_most, "GOOD"), "another laser");
}

TEST_P(DiagnosisOfSite, NamesReadingsThatMeanNoReturn)
{
	const Set circles = site_set(GetParam(), "sim360_on");
	expect_named(with(circles, seen_up_to(4, 4)), "mean that nothing was there");
	expect_named(with(circles, seen_up_to(2.5F, 0)), "--max-range 2.5, and zero_is_no_return = 1");
	expect_named(with(circles, with_max_range(4)), "the laser sees further than 4 m: --max-range ");
}
INSTANTIATE_TEST_SUITE_P(Sites, DiagnosisOfSite, testing::Values("intel", "fr079", "mit_csail"));

TEST(DiagnosisOfSites, NamesNothingOnEightSoundSets)
{
	if (!std::filesystem::exists(sites_folder() / "intel")) GTEST_SKIP() << why_skipped(sites_folder() / "intel");
	for (const char* site : {"intel", "fr079", "mit_csail"})
	{
		expect_sound(site_set(site, "test", "map_test.yaml"));
		expect_sound(site_set(site, "sim270_off"));
	}
	expect_sound(site_set("intel", "run"));
	expect_sound(site_set("mit_csail", "sim360_clutter"));
}
}  // namespace d2s1r::test
