// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The Python module: maps and scans are numpy arrays, errors of the library become ValueError and RuntimeError.
#include <d2s1r/calibration.h>
#include <d2s1r/map_io.h>
#include <d2s1r/tracker.h>
#include <d2s1r/version.h>
#include <d2s1r/window_localizer.h>
#include <mrpt/core/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace py = pybind11;
using namespace py::literals;

namespace d2s1r
{
namespace
{
using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Doubles = py::array_t<double>;

/// Makes pybind11 refuse an object whose __init__() was never called, such as Map.__new__(Map): it would make room for
/// the object by this operator, and hand methods what happens to stand there. Objects are made by std::make_shared(),
/// which does not use it.
struct NeedsInit
{
	static void* operator new(std::size_t) { throw py::type_error("__init__() was not called"); }
};

/// A map as Python holds it. It is never changed, so that localizers can share it.
struct Map : NeedsInit
{
	explicit Map(std::shared_ptr<const OccupancyMap> the_grid) : grid(std::move(the_grid)) {}
	std::shared_ptr<const OccupancyMap> grid;
};

// What Python holds of the library.
struct PyLocalizer : NeedsInit, Localizer
{
	using Localizer::Localizer;
};
struct PyAtlas : NeedsInit, Atlas
{
	explicit PyAtlas(Atlas atlas) : Atlas(std::move(atlas)) {}
};
struct PySweep : NeedsInit, Sweep
{
	explicit PySweep(Sweep sweep) : Sweep(std::move(sweep)) {}
};
struct PyLocalization : NeedsInit, Localization
{
	explicit PyLocalization(Localization result) : Localization(std::move(result)) {}
};
using Answer = std::shared_ptr<PyLocalization>;
using SharedSweep = std::shared_ptr<PySweep>;  //!< null: None

Sweep sweep_of(const SharedSweep& given)
{
	return given ? *given : Sweep();
}

Answer answer_of(Localization result)
{
	return std::make_shared<PyLocalization>(std::move(result));
}

/// A window, and what keeps threads of Python from using it at once.
struct Window : NeedsInit
{
	Window(
	    std::function<Localization(const Scan&)> the_localize, const ScanParameters& the_scan,
	    WindowLocalizer the_window)
	    : localize(std::move(the_localize)), scan(the_scan), window(std::move(the_window))
	{
	}
	std::function<Localization(const Scan&)> localize;  //!< what a scan says alone
	ScanParameters scan;
	WindowLocalizer window;
	std::mutex mutex{};
};

/// A tracker, and what keeps threads of Python from using it at once.
struct Follower : NeedsInit
{
	Follower(const ScanParameters& the_scan, Tracker the_tracker) : scan(the_scan), tracker(std::move(the_tracker)) {}
	ScanParameters scan;
	Tracker tracker;
	std::mutex mutex{};
};

/// Does what takes long on a thread of its own, so that Ctrl-C is heard. The work goes on then, and must own what it
/// uses.
template <class Work>
auto interruptibly(Work work)
{
	std::packaged_task<decltype(work())()> task(std::move(work));
	auto done = task.get_future();
	std::thread(std::move(task)).detach();
	const py::gil_scoped_release release;
	while (done.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready)
	{
		const py::gil_scoped_acquire acquire;
		if (PyErr_CheckSignals() != 0) throw py::error_already_set();
	}
	return done.get();
}

/// Returns the path of a file or folder as the bytes that the system takes.
/// \throws std::invalid_argument if it holds a null byte, FileNotFoundError if nothing is there
std::string path_of(const py::object& path)
{
	const auto bytes = py::module_::import("os").attr("fsencode")(path).cast<std::string>();
	if (bytes.find('\0') != std::string::npos) throw std::invalid_argument("a path holds a null byte; correct it");
	std::error_code error;
	if (std::filesystem::exists(bytes, error) || error) return bytes;
	errno = ENOENT;
	PyErr_SetFromErrnoWithFilenameObject(PyExc_OSError, path.ptr());
	throw py::error_already_set();
}

/// Returns a text of the library, which may hold the bytes of a file's name, as Python writes such names.
py::str text_of(const std::string& text)
{
	return py::reinterpret_steal<py::str>(
	    PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "surrogateescape"));
}

/// Returns the bytes of the name of a map. It may be that of a file.
std::string name_of(const py::handle& name)
{
	if (!py::isinstance<py::str>(name)) throw py::type_error("the name of a map must be a str");
	const auto bytes =
	    py::reinterpret_steal<py::bytes>(PyUnicode_AsEncodedString(name.ptr(), "utf-8", "surrogateescape"));
	if (!bytes) throw py::error_already_set();
	return bytes;
}

/// Returns the probabilities that the cells of an array of bool, integers or floats are occupied.
/// \throws std::invalid_argument if an integer, however large it is, is none of nav_msgs/OccupancyGrid
std::vector<float> p_occupied_of(const py::array& array)
{
	if (array.dtype().kind() == 'f' || array.dtype().kind() == 'b')
	{
		const Floats cells(array);
		return {cells.data(), cells.data() + cells.size()};
	}
	for (const char* const extreme : {"min", "max"})
		if (const py::object p = array.attr(extreme)("initial"_a = 0); p < py::int_(-1) || p > py::int_(100))
			throw std::invalid_argument(
			    "Map: a cell of the array is " + std::string(py::str(p)) +
			    "; integers are -1 for unknown and 0 to 100 for percent that a cell is occupied");
	const py::array_t<std::int8_t, py::array::c_style | py::array::forcecast> cells(array);
	std::vector<float> p_occupied(static_cast<std::size_t>(cells.size()));
	const auto p_of_percent = [](int percent) { return percent < 0 ? NAN : static_cast<float>(percent) / 100; };
	std::transform(cells.data(), cells.data() + cells.size(), p_occupied.begin(), p_of_percent);
	return p_occupied;
}

std::shared_ptr<Map> map_of_array(const py::object& cells, double resolution, std::array<double, 2> origin)
{
	const py::array array = py::module_::import("numpy").attr("asarray")(cells);
	if (array.ndim() != 2)
		throw std::invalid_argument(
		    "Map: the array has " + std::to_string(array.ndim()) + " dimensions; give 2, the row of least y first");
	if (std::string("fbiu").find(array.dtype().kind()) == std::string::npos)
		throw std::invalid_argument("Map: the cells of the array are not numbers; give bool, integers or floats");
	// A view may pretend to have any number of cells: they are counted before they are copied.
	check_number_of_cells(static_cast<std::size_t>(array.shape(1)), static_cast<std::size_t>(array.shape(0)));
	const auto p_occupied = p_occupied_of(array);
	const auto width = static_cast<std::size_t>(array.shape(1));
	const py::gil_scoped_release release;
	return std::make_shared<Map>(map_of_cells(p_occupied, width, {resolution, origin[0], origin[1]}));
}

std::shared_ptr<Map> load(
    const py::object& file, std::optional<double> resolution, std::optional<std::array<double, 2>> origin)
{
	const auto path = path_of(file);
	std::optional<ImageGeometry> image;
	if (resolution) image = ImageGeometry{*resolution, origin ? (*origin)[0] : 0, origin ? (*origin)[1] : 0};
	if (origin && !resolution)
		throw std::invalid_argument("Map.load: origin goes with resolution; give both, or none if the file tells them");
	const py::gil_scoped_release release;
	return std::make_shared<Map>(load_map(path, {}, image));
}

/// Returns the probabilities that cells are occupied, the row of least y first.
py::array_t<float> cells_of(const Map& map)
{
	const OccupancyMap& grid = *map.grid;
	py::array_t<float> cells({grid.height, grid.width});
	auto cell = cells.mutable_unchecked<2>();
	for (int y = 0; y < grid.height; y++)
		for (int x = 0; x < grid.width; x++) cell(y, x) = 1 - grid.p_free(x, y);
	return cells;
}

std::array<double, 2> origin_of(const Map& map)
{
	return {map.grid->origin_x, map.grid->origin_y};
}

std::string describe_map(const Map& map)
{
	const auto [x, y] = origin_of(map);
	return mrpt::format(
	    "<d2s1r.Map of %d x %d cells of %g m, origin (%g, %g)>", map.grid->width, map.grid->height,
	    static_cast<double>(map.grid->cell_size), x, y);
}

/// Returns parameters from an ini file, or from a dict such as {"scan.min_beams": 30}.
Parameters parameters_of(const py::object& given)
{
	if (given.is_none()) return {};
	if (!py::isinstance<py::dict>(given)) return load_parameters(path_of(given));
	std::string text;
	for (const auto& [key, value] : py::cast<py::dict>(given))
	{
		const std::string name = py::str(key);
		const auto dot = name.find('.');
		if (dot == std::string::npos)
			throw std::invalid_argument("parameters: '" + name + "' is not of the form section.key; see to_ini()");
		const std::string written =
		    py::isinstance<py::bool_>(value) ? (value.cast<bool>() ? "true" : "false") : std::string(py::str(value));
		text += '[' + name.substr(0, dot) + "]\n" + name.substr(dot + 1) + " = " + written + '\n';
	}
	return parse_parameters(text, "parameters");
}

/// Returns the pose of the laser on the robot, of (x, y, yaw) or (x, y, z, yaw, pitch, roll), m and rad.
mrpt::poses::CPose3D sensor_pose_of(const std::vector<double>& pose)
{
	if (pose.empty()) return {};
	if (pose.size() == 3) return {pose[0], pose[1], 0, pose[2], 0, 0};
	if (pose.size() == 6) return {pose[0], pose[1], pose[2], pose[3], pose[4], pose[5]};
	throw std::invalid_argument(
	    "sensor_pose has " + std::to_string(pose.size()) +
	    " numbers; give x, y, yaw or x, y, z, yaw, pitch, roll of the laser on the robot in m and rad");
}

/// The arguments that stand for a scan, as ROS's LaserScan has them.
struct Ranges
{
	py::object ranges;                //!< [m]
	double angle_min = 0;             //!< [rad]
	double angle_increment = 0;       //!< [rad]
	double max_range = 0;             //!< [m]
	std::vector<double> sensor_pose;  //!< see sensor_pose_of()
	double min_range = 0;             //!< [m] nearer readings are no data
};

/// Returns an array of numbers, in place if `given` is one: a view may be far larger than the memory that it takes.
/// \param name of `given`, for messages
/// \throws std::invalid_argument if it has other dimensions, or more numbers than any robot gives
py::array checked_array(const std::string& name, const py::object& given, py::ssize_t dimensions)
{
	constexpr py::ssize_t kMostNumbers = 10'000'000;
	py::array array = py::module_::import("numpy").attr("asarray")(given);
	if (array.ndim() != dimensions)
		throw std::invalid_argument(
		    name + " has " + std::to_string(array.ndim()) + " dimensions; give " + std::to_string(dimensions));
	if (array.size() > kMostNumbers)
		throw std::invalid_argument(
		    name + " has " + std::to_string(array.size()) + " numbers; give " + std::to_string(kMostNumbers) +
		    " at most");
	if (std::string("fbiu").find(array.dtype().kind()) == std::string::npos)
		throw std::invalid_argument(name + " does not hold numbers; give floats");
	return array;
}

RangeScan observation_of(const Ranges& scan)
{
	const Floats floats(checked_array("ranges", scan.ranges, 1));
	const auto ranges = floats.unchecked<1>();
	const auto beams = static_cast<std::size_t>(ranges.size());
	const double turned = beams > 0 ? scan.angle_increment * static_cast<double>(beams - 1) : 0;
	RangeScan observation;
	observation.right_to_left = scan.angle_increment >= 0;
	observation.max_range = static_cast<float>(scan.max_range);
	observation.aperture = static_cast<float>(std::abs(turned));
	observation.sensor_on_robot =
	    sensor_pose_of(scan.sensor_pose) + mrpt::poses::CPose3D(0, 0, 0, scan.angle_min + turned / 2, 0, 0);
	for (std::size_t i = 0; i < beams; i++)
	{
		const float range = ranges(static_cast<py::ssize_t>(i));
		observation.ranges.push_back(range);
		const bool is_valid = range >= static_cast<float>(scan.min_range) && range <= observation.max_range;
		observation.valid.push_back(is_valid ? 1 : 0);
	}
	return observation;
}

/// Returns poses with their times. `poses` has a row (x, y, phi) for each of `times`.
std::vector<TimedPose> timed_poses(const std::string& name, const py::object& times, const py::object& poses)
{
	const py::array given_times = checked_array(name + ": times", times, 1);
	const py::array given_poses = checked_array(name + ": poses", poses, 2);
	if (given_poses.shape(1) != 3 || given_poses.shape(0) != given_times.size())
		throw std::invalid_argument(name + ": give an array n x 3, with a row (x, y, phi) for each of the n times");
	const Doubles all_times(given_times), all_poses(given_poses);
	const auto time = all_times.unchecked<1>();
	const auto row = all_poses.unchecked<2>();
	std::vector<TimedPose> timed;
	for (py::ssize_t i = 0; i < time.size(); i++) timed.push_back({time(i), {row(i, 0), row(i, 1), row(i, 2)}});
	for (std::size_t i = 0; i < timed.size(); i++)
	{
		const auto& [at, pose] = timed[i];
		if (!std::isfinite(at + pose.x + pose.y + pose.phi) || (i > 0 && !(at > timed[i - 1].time)))
			throw std::invalid_argument(name + ": times and poses must be finite, and times increase; correct them");
	}
	return timed;
}

Sweep make_sweep(double beam_step, double first_beam, std::vector<TimedPose> motion)
{
	Sweep sweep;
	sweep.beam_step = beam_step;
	sweep.first_beam = first_beam;
	sweep.motion = std::move(motion);
	return sweep;
}

/// Returns a sweep of a spinning laser. `poses` has a row (x, y, phi) for each of `times`.
Sweep sweep_of(double beam_step, double first_beam, const py::object& times, const py::object& poses)
{
	const bool is_unmoved = poses.is_none() && checked_array("Sweep: times", times, 1).size() == 0;
	return make_sweep(
	    beam_step, first_beam, is_unmoved ? std::vector<TimedPose>() : timed_poses("Sweep", times, poses));
}

/// Returns the sweep of a robot that moves by a constant twist for 2 s around time 0, longer than any turn of a laser.
Sweep sweep_of_twist(double beam_step, std::array<double, 3> twist, double first_beam)
{
	if (!(std::abs(twist[0]) + std::abs(twist[1]) + std::abs(twist[2]) < HUGE_VAL))
		throw std::invalid_argument("Sweep: the twist is not finite; give (vx, vy, omega) in m/s and rad/s");
	return make_sweep(beam_step, first_beam, poses_along({twist[0], twist[1], twist[2]}, -1, 1));
}

Prior prior_of(const std::optional<std::array<double, 4>>& region)
{
	if (!region) return {};
	return make_prior((*region)[0], (*region)[1], (*region)[2], (*region)[3]);
}

Answer localize(
    const Localizer& localizer, const Ranges& scan, const std::optional<std::array<double, 4>>& region,
    double time_budget, const Sweep& sweep)
{
	const Query query{prior_of(region), time_budget};
	const RangeScan observation = observation_of(scan);
	const py::gil_scoped_release release;
	return answer_of(localizer.localize(observation, query, sweep));
}

/// Returns the motion (x, y, phi) of a robot; no value for None.
std::optional<mrpt::poses::CPose2D> motion_of(const std::optional<std::array<double, 3>>& numbers)
{
	if (!numbers) return std::nullopt;
	return mrpt::poses::CPose2D((*numbers)[0], (*numbers)[1], (*numbers)[2]);
}

Answer add_to_window(
    Window& window, const Ranges& ranges, const std::optional<std::array<double, 3>>& motion, const Sweep& sweep)
{
	const RangeScan observation = observation_of(ranges);
	const auto increment = motion_of(motion);
	const py::gil_scoped_release release;
	const Scan scan = make_scan(observation, window.scan, sweep);
	const Localization one_shot = window.localize(scan);
	const std::lock_guard lock(window.mutex);
	return answer_of(window.window.add(scan, one_shot, increment));
}

Doubles array_of(const mrpt::poses::CPose2D& pose)
{
	const std::array<double, 3> numbers = {pose.x(), pose.y(), pose.phi()};
	return Doubles(static_cast<py::ssize_t>(numbers.size()), numbers.data());
}

Doubles poses_of(const PyLocalization& result)
{
	Doubles poses({static_cast<py::ssize_t>(result.hypotheses.size()), py::ssize_t{3}});
	auto pose = poses.mutable_unchecked<2>();
	for (py::ssize_t i = 0; i < pose.shape(0); i++)
		for (int k = 0; k < 3; k++)
			pose(i, k) = result.hypotheses[static_cast<std::size_t>(i)].pose[static_cast<std::size_t>(k)];
	return poses;
}

Doubles covariances_of(const PyLocalization& result)
{
	Doubles covariances({static_cast<py::ssize_t>(result.hypotheses.size()), py::ssize_t{3}, py::ssize_t{3}});
	auto covariance = covariances.mutable_unchecked<3>();
	for (py::ssize_t i = 0; i < covariance.shape(0); i++)
		for (int row = 0; row < 3; row++)
			for (int column = 0; column < 3; column++)
				covariance(i, row, column) = result.hypotheses[static_cast<std::size_t>(i)].covariance(row, column);
	return covariances;
}

/// Returns a number of each hypothesis; NaN stands for none.
template <typename Get>
Doubles numbers_of(const Localization& result, const Get& get)
{
	Doubles numbers(static_cast<py::ssize_t>(result.hypotheses.size()));
	std::transform(result.hypotheses.begin(), result.hypotheses.end(), numbers.mutable_data(), get);
	return numbers;
}

std::string summary_of(const PyLocalization& result)
{
	std::string text = std::string("<d2s1r.Localization ") + to_string(result.status);
	if (!result.hypotheses.empty())
	{
		const auto& pose = result.best().pose;
		text +=
		    mrpt::format(" at (%.3f, %.3f, %.4f), confidence %.4f", pose.x(), pose.y(), pose.phi(), result.confidence);
	}
	return text + (result.note.empty() ? "" : ": " + result.note) + ">";
}

constexpr const char* kRanges =
    "    ranges: 1D array of distances [m]; inf and ranges from max_range on mean that the beam saw nothing; NaN is no "
    "data.\n"
    "    angle_min: direction of the first beam [rad], counter-clockwise from the x axis of the laser.\n"
    "    angle_increment: angle from one beam to the next [rad]; it is negative if the beams run clockwise.\n"
    "    max_range: range up to which the laser sees [m].\n"
    "    sensor_pose: pose of the laser on the robot, (x, y, yaw) or (x, y, z, yaw, pitch, roll) [m, rad].\n"
    "    min_range: nearer readings are no data [m].\n"
    "    sweep: Sweep, when the beams were taken; the pose is that of its time 0. None: all of them at once.\n";

void bind_map(py::module_& module)
{
	py::class_<Map, std::shared_ptr<Map>>(module, "Map", "An occupancy map. It never changes; localizers share it.")
	    .def(
	        py::init(&map_of_array), "array"_a, "resolution"_a, "origin"_a = std::array<double, 2>{0, 0},
	        "Makes a map of an array of cells, the row of least y first.\n\n"
	        "    array: 2D. Floats are probabilities that a cell is occupied, NaN is unknown; integers are those of\n"
	        "        ROS's OccupancyGrid, -1 for unknown and 0 to 100; bool is True where it is occupied.\n"
	        "    resolution: side of a cell [m].\n"
	        "    origin: (x, y) of the outer corner of cell [0, 0] in the map frame [m].\n\n"
	        "Raises ValueError if a cell or the geometry is out of range.")
	    .def_static(
	        "load", &load, "file"_a, "resolution"_a = py::none(), "origin"_a = py::none(),
	        "Loads a map_server yaml, an image (with resolution [m] and origin (x, y) [m]), a .simplemap or "
	        ".gridmap.\n\n"
	        "Raises FileNotFoundError, or RuntimeError that names the file and what is wrong with it.")
	    .def_property_readonly(
	        "array", &cells_of, "A copy of the probabilities that cells are occupied, the row of least y first.")
	    .def_property_readonly(
	        "resolution", [](const Map& map) { return static_cast<double>(map.grid->cell_size); },
	        "Side of a cell [m].")
	    .def_property_readonly("origin", &origin_of, "(x, y) of the outer corner of cell [0, 0] in the map frame [m].")
	    .def("__repr__", &describe_map)
	    .def_property_readonly(
	        "extent",
	        [](const Map& map) {
		        return std::array<double, 4>{
		            map.grid->origin_x, map.grid->end_x(), map.grid->origin_y, map.grid->end_y()};
	        },
	        "Borders (least x, greatest x, least y, greatest y) in the map frame [m], as matplotlib's imshow() takes "
	        "them.");
}

void bind_sweep(py::module_& module)
{
	const auto make = [](double beam_step, double first_beam, const py::object& times, const py::object& poses)
	{ return std::make_shared<PySweep>(sweep_of(beam_step, first_beam, times, poses)); };
	const auto make_of_twist = [](double beam_step, std::array<double, 3> twist, double first_beam)
	{ return std::make_shared<PySweep>(sweep_of_twist(beam_step, twist, first_beam)); };
	py::class_<PySweep, SharedSweep>(
	    module, "Sweep",
	    "Says when a laser took each beam of a scan, and how the robot moved meanwhile, for localize(..., "
	    "sweep=...).\n\n"
	    "All beams are moved to one time, time 0, and the pose is that of this time. Without a motion the beams stay "
	    "as "
	    "they are,\nand the covariances include how far the robot may have moved.")
	    .def(
	        py::init(make), "beam_step"_a, "first_beam"_a = 0.0, "times"_a = py::tuple(), "poses"_a = py::none(),
	        "    beam_step: time from one beam to the next [s], in the order of ranges; ROS calls it time_increment.\n"
	        "    first_beam: time of the first beam [s].\n"
	        "    times: times at which the robot was at each of the poses [s], increasing.\n"
	        "    poses: (x, y, phi) of the robot in a frame that does not move, such as that of the odometry: n x 3 "
	        "[m, rad].\n\n"
	        "Raises ValueError if they do not belong together.")
	    .def_static(
	        "of_twist", make_of_twist, "beam_step"_a, "twist"_a, py::kw_only(), "first_beam"_a = 0.0,
	        "Makes the sweep of a robot that moves by a constant twist (vx, vy, omega) in its own frame [m/s, rad/s].")
	    .def_readonly("beam_step", &Sweep::beam_step, "Time from one beam to the next [s].")
	    .def_readonly("first_beam", &Sweep::first_beam, "Time of the first beam [s].");
}

void bind_localization(py::module_& module)
{
	py::class_<PyLocalization, Answer>(module, "Localization", "The answer to \"where was this scan taken?\".")
	    .def_property_readonly(
	        "status", [](const PyLocalization& result) { return to_string(result.status); },
	        "\"localized\", \"ambiguous\", \"rejected\" or \"invalid\".")
	    .def_readonly("confidence", &Localization::confidence, "Probability that the robot is at the best pose.")
	    .def_readonly("note", &Localization::note, "Says why a scan was rejected or is invalid; else empty.")
	    .def_readonly(
	        "relative_entropy", &Localization::relative_entropy,
	        "Between the scan and what the map shows at the best pose [bit]; lower is better. None without a pose.")
	    .def_property_readonly(
	        "pose",
	        [](const PyLocalization& result) -> py::object
	        { return result.hypotheses.empty() ? py::object(py::none()) : array_of(result.best().pose); },
	        "The most probable pose (x, y, phi) of the robot in the map frame [m, rad]; None without a hypothesis.")
	    .def_property_readonly(
	        "map",
	        [](const PyLocalization& result) { return text_of(result.hypotheses.empty() ? "" : result.best().map); },
	        "Name of the map that pose is in, from an Atlas; else empty.")
	    .def_property_readonly(
	        "maps",
	        [](const PyLocalization& result)
	        {
		        py::list maps;
		        for (const Hypothesis& hypothesis : result.hypotheses) maps.append(text_of(hypothesis.map));
		        return maps;
	        },
	        "Name of the map of each hypothesis, as map.")
	    .def_property_readonly(
	        "poses", &poses_of, "Poses (x, y, phi) of all hypotheses, by decreasing probability: n x 3 [m, rad].")
	    .def_property_readonly(
	        "covariances", &covariances_of, "Covariances of the poses: n x 3 x 3 [m^2, m rad, rad^2].")
	    .def_property_readonly(
	        "probabilities",
	        [](const PyLocalization& result)
	        { return numbers_of(result, [](const Hypothesis& h) { return h.probability; }); },
	        "Probabilities of the hypotheses: n. If they sum to less than 1, the rest is that of \"none of them\".")
	    .def_property_readonly(
	        "explained",
	        [](const PyLocalization& result)
	        { return numbers_of(result, [](const Hypothesis& h) { return h.explained.value_or(NAN); }); },
	        "Share of the returns that the map explains, for each hypothesis: n. NaN with the paper's method.")
	    .def_property_readonly(
	        "total_ms", [](const PyLocalization& result) { return result.times.total_ms; },
	        "Time that the answer took [ms].")
	    .def("__repr__", &summary_of);
}

void bind_localizer(py::module_& module)
{
	const auto make = [](const Map& map, const py::object& given, int threads)
	{
		return interruptibly([grid = map.grid, parameters = parameters_of(given), threads]
		                     { return std::make_shared<PyLocalizer>(grid, parameters, threads); });
	};
	const auto answer = [](const PyLocalizer& self, const py::object& ranges, double angle_min, double angle_increment,
	                       double max_range, const std::vector<double>& sensor_pose,
	                       const std::optional<std::array<double, 4>>& region, double min_range, double time_budget,
	                       const SharedSweep& sweep)
	{
		return localize(
		    self, {ranges, angle_min, angle_increment, max_range, sensor_pose, min_range}, region, time_budget,
		    sweep_of(sweep));
	};
	py::class_<PyLocalizer, std::shared_ptr<PyLocalizer>>(
	    module, "Localizer",
	    "Finds where in a map a scan was taken, without an initial pose.\n\n"
	    "A Localizer never changes: any number of threads may call localize() at once, and they run in parallel.")
	    .def(
	        py::init(make), "map"_a, "parameters"_a = py::none(), "threads"_a = 1,
	        "Builds the index of a map.\n\n"
	        "    parameters: path of an ini file, or a dict such as {\"scan.min_beams\": 30}; see to_ini().\n"
	        "    threads: number of threads that build the index of the published method.\n\n"
	        "Raises ValueError that names a wrong parameter, or RuntimeError if the file cannot be read.")
	    .def(
	        "localize", answer, "ranges"_a, "angle_min"_a, "angle_increment"_a, "max_range"_a,
	        "sensor_pose"_a = std::vector<double>{}, "region"_a = py::none(), py::kw_only(), "min_range"_a = 0.0,
	        "time_budget"_a = 0.0, "sweep"_a = py::none(),
	        ("Answers where a scan was taken. A scan that cannot be localized is a status, not an error.\n\n" +
	         std::string(kRanges) +
	         "    region: search only in the box between the corners (x0, y0, x1, y1) in the map frame [m].\n"
	         "    time_budget: time after which the answer should be there [ms]; 0 is no limit.\n")
	            .c_str())
	    .def(
	        "__repr__",
	        [](const PyLocalizer& self)
	        {
		        return mrpt::format(
		            "<d2s1r.Localizer in %d x %d cells of %g m, method = %s>", self.grid().width, self.grid().height,
		            self.grid().cell_size, to_string(self.parameters().method));
	        })
	    .def(
	        "to_ini", [](const PyLocalizer& self) { return to_ini(self.parameters()); },
	        "Returns all parameters with units and meanings as the text of an ini file.");
}

std::shared_ptr<PyAtlas> atlas_of(const py::dict& localizers, const py::dict& regions)
{
	std::map<std::string, AtlasMap> by_name;
	for (const auto& [key, localizer] : localizers)
	{
		const std::string name = name_of(key);
		by_name[name] = {name, localizer.cast<std::shared_ptr<PyLocalizer>>()};
	}
	for (const auto& [key, region] : regions)
	{
		const auto map = by_name.find(name_of(key));
		if (map == by_name.end())
			throw std::invalid_argument("Atlas: there is a region for '" + name_of(key) + "', which is no map");
		map->second.region = prior_of(region.cast<std::array<double, 4>>());
	}
	std::vector<AtlasMap> maps;
	for (const auto& named : by_name) maps.push_back(named.second);
	return std::make_shared<PyAtlas>(Atlas(std::move(maps)));
}

std::shared_ptr<PyAtlas> load_atlas_of(const py::object& file, const py::object& given)
{
	const auto path = path_of(file);
	return interruptibly([path, parameters = parameters_of(given)]
	                     { return std::make_shared<PyAtlas>(load_atlas(path, parameters)); });
}

void bind_atlas(py::module_& module)
{
	const auto answer = [](const PyAtlas& self, const py::object& ranges, double angle_min, double angle_increment,
	                       double max_range, const std::vector<double>& sensor_pose, double min_range,
	                       double time_budget, const SharedSweep& sweep)
	{
		const RangeScan observation =
		    observation_of({ranges, angle_min, angle_increment, max_range, sensor_pose, min_range});
		const py::gil_scoped_release release;
		return answer_of(self.localize(observation, {{}, time_budget}, sweep_of(sweep)));
	};
	const auto names = [](const PyAtlas& self)
	{
		py::list all;
		for (const AtlasMap& map : self.maps()) all.append(text_of(map.name));
		return all;
	};
	py::class_<PyAtlas, std::shared_ptr<PyAtlas>>(
	    module, "Atlas", "Finds in which of several maps, and where there, a scan was taken. An Atlas never changes.")
	    .def(
	        py::init(&atlas_of), "localizers"_a, "regions"_a = py::dict(),
	        "    localizers: dict of Localizer by the name of its map.\n"
	        "    regions: dict of boxes between corners (x0, y0, x1, y1) [m] that the robot is in, for some of the "
	        "maps.")
	    .def_static(
	        "load", &load_atlas_of, "path"_a, "parameters"_a = py::none(),
	        "Loads the maps of an atlas.yaml or of a folder, and builds their indices.\n\n"
	        "    parameters: as for Localizer, of the maps without a file of their own.\n\n"
	        "Raises RuntimeError or ValueError that names the file and what is wrong with it.")
	    .def(
	        "localize", answer, "ranges"_a, "angle_min"_a, "angle_increment"_a, "max_range"_a,
	        "sensor_pose"_a = std::vector<double>{}, py::kw_only(), "min_range"_a = 0.0, "time_budget"_a = 0.0,
	        "sweep"_a = py::none(),
	        ("Answers in which map, and where there, a scan was taken: see Localization.map.\n\n" +
	         std::string(kRanges) +
	         "    time_budget: time after which the answer should be there [ms]; 0 is no limit.\n")
	            .c_str())
	    .def_property_readonly("names", names, "Names of the maps.");
}

void bind_window(py::module_& module)
{
	const auto make = [](const PyLocalizer& localizer, int frames, const std::optional<std::array<double, 4>>& region)
	{
		const Prior prior = prior_of(region);
		const auto localize = [&localizer, prior](const Scan& scan) { return localizer.localize(scan, {prior, 0}); };
		return std::make_shared<Window>(
		    localize, localizer.parameters().scan, WindowLocalizer(localizer, frames, prior));
	};
	const auto make_in_atlas = [](const PyAtlas& atlas, int frames)
	{
		const auto localize = [&atlas](const Scan& scan) { return atlas.localize(scan); };
		return std::make_shared<Window>(
		    localize, atlas.maps().front().localizer->parameters().scan, WindowLocalizer(atlas, frames));
	};
	const auto add = [](Window& self, const py::object& ranges, double angle_min, double angle_increment,
	                    double max_range, const std::vector<double>& sensor_pose,
	                    const std::optional<std::array<double, 3>>& motion, double min_range, const SharedSweep& sweep)
	{
		return add_to_window(
		    self, {ranges, angle_min, angle_increment, max_range, sensor_pose, min_range}, motion, sweep_of(sweep));
	};
	py::class_<Window, std::shared_ptr<Window>>(
	    module, "WindowLocalizer",
	    "Localizes by the scans of the last frames together. Use one object per robot, with one call per frame.")
	    .def(
	        py::init(make), "localizer"_a, "frames"_a = 10, "region"_a = py::none(), py::keep_alive<1, 2>(),
	        "    frames: number of frames that are judged together.\n"
	        "    region: box between the corners (x0, y0, x1, y1) in the map frame [m] that the robot never leaves.")
	    .def(
	        py::init(make_in_atlas), "atlas"_a, "frames"_a = 10, py::keep_alive<1, 2>(),
	        "The same in an atlas: the robot is followed from map to map.")
	    .def(
	        "add", add, "ranges"_a, "angle_min"_a, "angle_increment"_a, "max_range"_a,
	        "sensor_pose"_a = std::vector<double>{}, "motion"_a = py::none(), py::kw_only(), "min_range"_a = 0.0,
	        "sweep"_a = py::none(),
	        ("Answers where the robot is, now that this scan was taken.\n\n" + std::string(kRanges) +
	         "    motion: (x, y, phi) of the robot since the last call, in its frame then [m, rad]; None if unknown.\n")
	            .c_str());
}

void bind_tracker(py::module_& module)
{
	using Motion = std::optional<std::array<double, 3>>;
	const auto make = [](const PyLocalizer& localizer, const std::optional<std::array<double, 4>>& region)
	{ return std::make_shared<Follower>(localizer.parameters().scan, Tracker(localizer, prior_of(region))); };
	const auto make_in_atlas = [](const PyAtlas& atlas)
	{ return std::make_shared<Follower>(atlas.maps().front().localizer->parameters().scan, Tracker(atlas)); };
	const auto add = [](Follower& self, double time, const py::object& ranges, double angle_min, double angle_increment,
	                    double max_range, const std::vector<double>& sensor_pose, const Motion& motion,
	                    double min_range, const SharedSweep& shared)
	{
		const RangeScan observation =
		    observation_of({ranges, angle_min, angle_increment, max_range, sensor_pose, min_range});
		const Sweep sweep = sweep_of(shared);
		const py::gil_scoped_release release;
		const Scan scan = make_scan(observation, self.scan, sweep);
		const std::lock_guard lock(self.mutex);
		return answer_of(self.tracker.add(time, scan, motion_of(motion)));
	};
	const auto after = [](Follower& self, const Motion& motion,
	                      double seconds) -> std::optional<std::pair<Doubles, double>>
	{
		std::optional<Hypothesis> there;
		{
			const py::gil_scoped_release release;
			const std::lock_guard lock(self.mutex);
			there = self.tracker.after(motion_of(motion), seconds);
		}
		if (!there) return std::nullopt;
		return std::pair(array_of(there->pose), there->probability);
	};
	const auto suggest =
	    [](Follower& self, const std::array<double, 3>& pose, const std::array<double, 2>& std, const std::string& map)
	{
		const py::gil_scoped_release release;
		const std::lock_guard lock(self.mutex);
		self.tracker.suggest({*motion_of(pose), covariance_of(std[0], std[0], std[1])}, map);
	};
	const auto suggestion = [](Follower& self)
	{
		const std::lock_guard lock(self.mutex);
		switch (self.tracker.suggestion())
		{
			case Suggestion::kOpen:
				return "open";
			case Suggestion::kTaken:
				return "taken";
			case Suggestion::kRefused:
				return "refused";
			case Suggestion::kNone:
				break;
		}
		return "none";
	};
	py::class_<Follower, std::shared_ptr<Follower>>(
	    module, "Tracker",
	    "Follows a robot from scan to scan: it finds the robot, keeps its pose, and notices by itself when the robot "
	    "is "
	    "elsewhere. Use one object per robot, with one call per scan.")
	    .def(
	        py::init(make), "localizer"_a, "region"_a = py::none(), py::keep_alive<1, 2>(),
	        "    region: box between the corners (x0, y0, x1, y1) in the map frame [m] that the robot never leaves.")
	    .def(
	        py::init(make_in_atlas), "atlas"_a, py::keep_alive<1, 2>(),
	        "The same in an atlas: the robot is followed from map to map.")
	    .def(
	        "add", add, "time"_a, "ranges"_a, "angle_min"_a, "angle_increment"_a, "max_range"_a,
	        "sensor_pose"_a = std::vector<double>{}, "motion"_a = py::none(), py::kw_only(), "min_range"_a = 0.0,
	        "sweep"_a = py::none(),
	        ("Answers where the robot is, now that this scan was taken.\n\n    time: of the scan, by any clock [s].\n" +
	         std::string(kRanges) +
	         "    motion: (x, y, phi) of the robot since the last call, in its frame then [m, rad]; None if unknown.\n")
	            .c_str())
	    .def(
	        "after", after, "motion"_a = py::none(), "seconds"_a = 0.0,
	        "Returns where the robot is after a motion since the last call of add(), as ((x, y, phi), probability); "
	        "None "
	        "if no place is known.\n\n"
	        "    motion: (x, y, phi) in its frame then [m, rad]; None if unknown.\n"
	        "    seconds: since that call; they matter only without a motion.\n")
	    .def(
	        "suggest", suggest, "pose"_a, "std"_a = std::array<double, 2>{0.5, 0.26}, "map"_a = "",
	        "Takes in where a person believes the robot to be at the next scan: a prior, which the scans may "
	        "refuse.\n\n"
	        "    pose: (x, y, phi) in the map frame [m, rad].\n"
	        "    std: standard deviations of the position [m] and of the yaw [rad].\n"
	        "    map: its name in the atlas.\n")
	    .def_property_readonly(
	        "suggestion", suggestion,
	        "What became of the last suggestion: 'open', and after the scan that tells it 'taken' or 'refused'; else "
	        "'none'.");
}

py::dict calibrate_of(
    const PyLocalizer& localizer, const std::vector<py::object>& ranges, const py::object& times,
    const py::object& poses, double angle_min, double angle_increment, double max_range,
    const py::object& odometry_times, const py::object& odometry, const std::vector<double>& sensor_pose,
    std::array<double, 2> sweep_time)
{
	constexpr std::array<const char*, calibration::kUnknowns> kNames = {
	    "yaw", "x", "y", "start", "duration", "angle_scale", "range_factor", "way_scale", "turn_scale"};
	constexpr std::array<const char*, 3> kVerdicts = {"not shown", "as told", "changed"};
	const auto robots = timed_poses("calibrate", times, poses),
	           wheels = timed_poses("calibrate: odometry", odometry_times, odometry);
	if (ranges.size() != robots.size()) throw std::invalid_argument("give the ranges of a scan for each of the poses");
	const auto laser = sensor_pose_of(sensor_pose);
	calibration::Reading told;
	told.laser = calibration::from_above(laser);
	told.duration = sweep_time[0], told.start = sweep_time[1] + std::min(0.0, told.duration);
	std::vector<calibration::FoundScan> scans;
	for (std::size_t i = 0; i < ranges.size(); i++)
		scans.push_back(calibration::found_scan(
		    observation_of({ranges[i], angle_min, angle_increment, max_range, sensor_pose}), laser, robots[i].time,
		    robots[i].robot));
	calibration::Calibration found;
	{
		const py::gil_scoped_release release;
		found = calibration::calibrate(localizer.grid(), told, scans, wheels);
	}
	py::dict answer;
	for (std::size_t i = 0; i < calibration::kUnknowns; i++)
	{
		const calibration::Finding& finding = found.findings[i];
		answer[kNames[i]] = py::dict(
		    "told"_a = finding.told, "estimate"_a = finding.estimate, "std"_a = finding.deviation,
		    "shown"_a = value_of(found.shown, static_cast<calibration::Unknown>(i)),
		    "verdict"_a = kVerdicts[static_cast<std::size_t>(finding.verdict)], "log_odds"_a = finding.log_odds);
	}
	answer["is_odometry_mirrored"] = found.shown.is_odometry_mirrored;
	answer["odometry_clock"] = found.shown.odometry_clock;
	answer["is_changed"] = found.is_changed();
	return answer;
}

void bind_calibration(py::module_& module)
{
	module.def(
	    "calibrate", &calibrate_of, "localizer"_a, "ranges"_a, "times"_a, "poses"_a, "angle_min"_a, "angle_increment"_a,
	    "max_range"_a, "odometry_times"_a, "odometry"_a, "sensor_pose"_a = std::vector<double>{}, py::kw_only(),
	    "sweep_time"_a = std::array<double, 2>{0, 0},
	    "Returns how a laser must be read, as a drive through the map shows it: a dict of yaw, x, y, start, "
	    "duration, angle_scale, range_factor, way_scale and turn_scale, each with told, estimate, std, verdict ('not "
	    "shown', 'as told' or 'changed'), log_odds, and shown, the value to use; and is_odometry_mirrored, "
	    "odometry_clock [s] and is_changed. The sweep starts `start` after the time of a scan [s], whichever way it "
	    "goes.\n\n"
	    "    ranges: those of each scan [m], some tens of scans of a robot that drives and turns.\n"
	    "    times, poses: of each scan [s], and (x, y, phi) where it was found [m, rad]: Localization.pose.\n"
	    "    angle_min, angle_increment, max_range, sensor_pose: of the laser, as for Localizer.localize().\n"
	    "    odometry_times, odometry: [s], and (x, y, phi) of the robot in a frame that stands still [m, rad].\n"
	    "    sweep_time: from the first beam to the last, and of the first beam after the time of a scan [s].\n");
}
}  // namespace
}  // namespace d2s1r

PYBIND11_MODULE(_d2s1r, module)
{
	// Messages may hold the bytes of a file's name, of which pybind11 would make an empty text.
	py::register_exception_translator(
	    [](std::exception_ptr exception)
	    {
		    const auto raise = [](PyObject* type, const std::exception& error)
		    { PyErr_SetObject(type, d2s1r::text_of(error.what()).ptr()); };
		    try
		    {
			    std::rethrow_exception(exception);
		    }
		    catch (const std::invalid_argument& error)
		    {
			    raise(PyExc_ValueError, error);
		    }
		    catch (const py::builtin_exception&)
		    {
			    throw;  // pybind11 knows these
		    }
		    catch (const std::runtime_error& error)
		    {
			    raise(PyExc_RuntimeError, error);
		    }
	    });
	module.doc() = "One-shot global localization with a 2D LiDAR.";
	module.attr("__version__") = D2S1R_VERSION;
	d2s1r::bind_map(module);
	d2s1r::bind_sweep(module);
	d2s1r::bind_localization(module);
	d2s1r::bind_localizer(module);
	d2s1r::bind_atlas(module);
	d2s1r::bind_tracker(module);
	d2s1r::bind_window(module);
	d2s1r::bind_calibration(module);
}
