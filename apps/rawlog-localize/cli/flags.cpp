// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "cli/flags.h"

#include "cli/errors.h"

#include <d2s1r/version.h>
#include <mrpt/core/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include <vector>

namespace d2s1r::app
{
namespace
{
constexpr std::size_t kMeaningColumn = 26;  //!< of --help
constexpr std::size_t kLastColumn = 100;    //!< of --help

[[noreturn]] void wrong(const std::string& flag, const std::string& what)
{
	throw UserError(kWrongUse, flag, what + "; see rawlog-localize --help");
}

/// Returns whether the whole text is a number, which is then in `number`.
template <class Number>
bool read_number(const std::string& text, Number& number)
{
	const char* const end = text.data() + text.size();
	const auto [parsed_to, error] = std::from_chars(text.data(), end, number);
	return error == std::errc() && parsed_to == end && !text.empty();
}

std::uint64_t parse_whole_number(
    const std::string& flag, const std::string& text, std::uint64_t least,
    std::uint64_t greatest = std::numeric_limits<std::uint64_t>::max())
{
	std::uint64_t number = 0;
	if (read_number(text, number) && number >= least && number <= greatest) return number;
	const bool bounded = greatest < std::numeric_limits<std::uint64_t>::max();
	wrong(
	    flag, "'" + text + "' is not a whole number " +
	              (bounded ? "from " + std::to_string(least) + " to " + std::to_string(greatest)
	                       : "of at least " + std::to_string(least)));
}

double parse_finite_number(const std::string& flag, const std::string& text)
{
	double number = 0;
	if (!read_number(text, number) || !std::isfinite(number)) wrong(flag, "'" + text + "' is not a finite number");
	return number;
}

/// Parses finite numbers with commas between them.
std::vector<double> parse_numbers(const std::string& flag, const std::string& text)
{
	std::vector<double> numbers;
	for (std::size_t start = 0; start <= text.size();)
	{
		const auto end = std::min(text.find(',', start), text.size());
		numbers.push_back(parse_finite_number(flag, text.substr(start, end - start)));
		start = end + 1;
	}
	return numbers;
}

void parse_frames(const std::string& text, Flags& flags)
{
	std::vector<std::string> parts;
	std::istringstream in(text + ":");
	for (std::string part; std::getline(in, part, ':');) parts.push_back(part);
	if (parts.size() < 2 || parts.size() > 3)
		wrong("--frames", "'" + text + "' is not a range; write A:B, A:, :B or A:B:STEP");
	if (!parts[0].empty()) flags.first_frame = parse_whole_number("--frames", parts[0], 0);
	if (!parts[1].empty()) flags.past_frame = parse_whole_number("--frames", parts[1], 0);
	if (parts.size() > 2) flags.frame_step = parse_whole_number("--frames", parts[2], 1);
	if (flags.first_frame >= flags.past_frame) wrong("--frames", "'" + text + "' holds no frame; A must be below B");
}

std::optional<int> parse_window(const std::string& text)
{
	const auto scans = parse_whole_number("--window", text, 1, 1000);
	return scans > 1 ? std::optional(static_cast<int>(scans)) : std::nullopt;  // one scan has no others to be used with
}

Prior parse_region(const std::string& text)
{
	const auto corners = parse_numbers("--region", text);
	if (corners.size() != 4) wrong("--region", "'" + text + "' is not a box; write X0,Y0,X1,Y1 in m");
	if (corners[0] == corners[2] || corners[1] == corners[3])
		wrong("--region", "'" + text + "' is an empty box; give two opposite corners");
	return make_prior(corners[0], corners[1], corners[2], corners[3]);
}

double parse_time_budget(const std::string& text)
{
	double budget = 0;
	if (!read_number(text, budget) || !(budget > 0) || !std::isfinite(budget))
		wrong("--time-budget", "'" + text + "' is not a finite time above 0 ms; leave it out for no limit");
	return budget;
}

MotionSource parse_motion(const std::string& text, bool fuse)
{
	if (!fuse) wrong("--motion", "only goes with --fuse");
	if (text == "pseudo") return MotionSource::kPseudo;
	if (text == "odometry") return MotionSource::kOdometry;
	if (text != "both") wrong("--motion", "'" + text + "' is not one of pseudo, odometry, both");
	return MotionSource::kBoth;
}

std::optional<ImageGeometry> parse_image(const std::string& resolution, const std::string& origin)
{
	if (resolution.empty() && !origin.empty()) wrong("--origin", "only goes with --resolution");
	if (resolution.empty()) return std::nullopt;
	ImageGeometry image;
	constexpr double kLeast = ImageGeometry::kLeastResolution, kGreatest = ImageGeometry::kGreatestResolution;
	if (!read_number(resolution, image.resolution) || !(image.resolution >= kLeast && image.resolution <= kGreatest))
		wrong("--resolution", mrpt::format("'%s' is not %g to %g m a pixel", resolution.c_str(), kLeast, kGreatest));
	if (origin.empty()) return image;
	const auto point = parse_numbers("--origin", origin);
	if (point.size() != 2) wrong("--origin", "'" + origin + "' is not a point; write X,Y in m");
	image.origin_x = point[0];
	image.origin_y = point[1];
	return image;
}

mrpt::poses::CPose3D parse_sensor_pose(const std::string& text)
{
	const auto values = parse_numbers("--sensor-pose", text);
	if (values.size() != 6)
		wrong("--sensor-pose", "'" + text + "' is not a pose; write X,Y,Z,YAW,PITCH,ROLL in m and deg");
	const auto angle = [&](std::size_t i) { return mrpt::DEG2RAD(values[i]); };
	return {values[0], values[1], values[2], angle(3), angle(4), angle(5)};
}

float parse_max_range(const std::string& text)
{
	constexpr double kLeast = std::numeric_limits<float>::min(), kGreatest = std::numeric_limits<float>::max();
	const double range = parse_finite_number("--max-range", text);
	if (!(range >= kLeast && range <= kGreatest))
		wrong("--max-range", mrpt::format("'%s' is not a range from %.1e to %.1e m", text.c_str(), kLeast, kGreatest));
	return static_cast<float>(range);
}

double parse_range_factor(const std::string& text)
{
	const double factor = parse_finite_number("--range-factor", text);
	if (!(factor > 0)) wrong("--range-factor", "'" + text + "' is not a factor above 0");
	return factor;
}

constexpr const char* kUsage =
    "Usage: rawlog-localize -m MAP -i LOG -o OUT_DIR [OPTION]...\n"
    "       rawlog-localize -m MAP -i LOG --stream [OPTION]...\n"
    "       rawlog-localize -m MAP -i LOG --diagnose [OPTION]...\n"
    "       rawlog-localize --write-config FILE [-c CONFIG.ini]\n"
    "Localize every 2D laser scan of a log in a known map, each scan on its own, without an initial pose.\n\n";

constexpr const char* kOutputs =
    "\nLOG is a ROS 2 bag (a folder, or a file of sqlite3 or MCAP), a ROS 1 bag, an MRPT rawlog or a CARMEN\n"
    "log; its content tells which.\n\n"
    "MAP is a .simplemap(.gz), a .gridmap(.gz), a ROS map_server .yaml, an image (with --resolution), or\n"
    "a file with a serialized CMultiMetricMap or CSignatureMap2D. An atlas is a folder of such maps or a\n"
    "yaml file: maps: {NAME: {file: MAP, floor: TEXT, region: [X0, Y0, X1, Y1], config: CONFIG.ini}, ...};\n"
    "of a map all but the file may be left out. The column 'map' of the results names the map.\n\n"
    "OUT_DIR receives frames.csv, hypotheses.csv, trajectory.tum, trajectory.txt, localized.rawlog,\n"
    "run.json, summary.json, map.png, scene.3Dscene and report.html; with --fuse also fused.csv and\nfused.tum.\n\n"
    "Exit status: 0 done, 1 wrong use or configuration, 2 an input that cannot be read or used, 3 an\n"
    "output that cannot be written, 130 interrupted (finished frames are on disk).\n";

void check_complete(const Flags& flags)
{
	if (flags.only_writes_config() && !flags.write_config.empty()) return;
	if (flags.map.empty()) wrong("--map", "missing; name the map file");
	if (flags.rawlog.empty()) wrong("--input", "missing; name the log");
	if (flags.output_dir.empty() && !flags.stream && !flags.diagnose)
		wrong("--output", "missing; name the folder to write to");
}

/// Checks that the options go with a log that is still being written, and with lines instead of files.
void check_live(const Flags& flags)
{
	if (flags.follow && flags.rawlog == logs::kStandardInput)
		wrong("--follow", "is for a file that grows; standard input is read to its end without it");
	if (flags.diagnose && flags.is_live())
		wrong("--diagnose", "reads the log several times, which it cannot while the log is written; record it first");
	if (flags.ground_truth.rfind(kTopicPrefix, 0) == 0 && flags.is_live())
		wrong(
		    "--ground-truth",
		    "'" + flags.ground_truth + "' is of a recording of ROS, but a live log is a rawlog; name a file of poses");
	if (!flags.output_dir.empty()) return;
	for (const auto& [flag, value] :
	     {std::pair("--ground-truth", flags.ground_truth),
	      {"--save-map", flags.save_map},
	      {"--write-pf-ini", flags.write_pf_ini},
	      {"--write-config", flags.write_config}})
		if (!value.empty()) wrong(flag, "goes with files; name a folder for them with --output");
}

/// Refuses names that load_map() would take for another kind of map.
void check_saved_map(const std::string& file)
{
	if (is_image_name(file) || is_yaml_name(file))
		wrong("--save-map", "'" + file + "' would be read back as an image or yaml; name it FILE.signaturemap");
}

/// Checks that an image has a resolution, and that no other map has one.
void check_image(const Flags& flags)
{
	if (is_image_name(flags.map) == flags.image.has_value()) return;
	if (!flags.image)
		throw UserError(
		    kBadInput, flags.map, "an image does not say its resolution; give it with --resolution [m/pixel]");
	std::string known;
	for (const char* extension : kImageExtensions) known += std::string(known.empty() ? "" : ", ") + extension;
	wrong("--resolution", "only goes with an image (" + known + "); leave it out or rename the image");
}

/// What the command line says before it is all known.
struct Unchecked
{
	std::string resolution;
	std::string origin;
	std::string motion;
	std::string topic;
	bool no_rawlog = false;
};

/// Adds options to a parser. What a user gives to an option may not be empty.
class OptionAdder
{
   public:
	explicit OptionAdder(CLI::App& app) : app_(app)
	{
		const auto refuse_empty = [](const std::string& text)
		{ return text.empty() ? "needs a value" : std::string(); };
		not_empty_ = CLI::Validator(refuse_empty, "");
	}

	/// \param names "-l,--long" or "--long"
	/// \param parse takes the text of the value
	CLI::Option* value(
	    const char* names, const char* value_name, const char* meaning,
	    const std::function<void(const std::string&)>& parse)
	{
		return option(names, value_name, meaning, parse)->check(not_empty_);
	}
	CLI::Option* value(const char* names, const char* value_name, const char* meaning, std::string& text)
	{
		return value(names, value_name, meaning, [&text](const std::string& given) { text = given; });
	}

	/// An option that may be given several times.
	void maps(
	    const char* names, const char* value_name, const char* meaning, std::string& first,
	    std::vector<std::string>& others)
	{
		const auto take = [&first, &others](const std::vector<std::string>& given)
		{
			first = given.front();
			others.assign(given.begin() + 1, given.end());
		};
		app_.add_option_function<std::vector<std::string>>(names, take, meaning)
		    ->type_name(value_name)
		    ->expected(1)
		    ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
		    ->check(not_empty_);
	}

	/// The same, but the value may be empty.
	CLI::Option* option(
	    const char* names, const char* value_name, const char* meaning,
	    const std::function<void(const std::string&)>& parse)
	{
		return app_.add_option_function<std::string>(names, parse, meaning)->type_name(value_name);
	}

	CLI::Option* flag(const char* names, const char* meaning, bool& given)
	{
		return app_.add_flag(names, given, meaning)->disable_flag_override();
	}

   private:
	CLI::App& app_;
	CLI::Validator not_empty_;
};

void add_inputs(OptionAdder add, Flags& flags, Unchecked& unchecked)
{
	add.maps(
	    "-m,--map", "MAP",
	    "map to localize in, or an atlas of maps: a yaml file that lists them, or a folder; may also be given several "
	    "times",
	    flags.map, flags.more_maps);
	add.value(
	    "-i,--input", "LOG",
	    "log with 2D laser scans: a bag, a rawlog or a CARMEN log; - is a rawlog on standard input, read as it comes",
	    flags.rawlog);
	add.flag(
	    "--follow",
	    "LOG is a rawlog that grows: wait for more at its end, until it is removed or cut short or the run interrupted",
	    flags.follow);
	add.value("-o,--output", "OUT_DIR", "folder for the results, made if missing", flags.output_dir);
	add.value("-c,--config", "CONFIG.ini", "parameters; those not in the file keep their defaults", flags.config);
	add.value(
	    "--ground-truth", "GT.txt",
	    "true poses: adds accuracy to the results; lines 'time x y phi', 'time x y z yaw pitch roll' or those of TUM, "
	    "a CSV file with the names of its columns, or topic:/TOPIC, a nav_msgs/Odometry of the log",
	    flags.ground_truth);
	add.option(
	    "--sensor-label", "LABEL", "laser to use; default: the one with the most scans",
	    [&](const std::string& text) { flags.sensor_label = text; });  // a laser's label may be empty
	add.value(
	    "--topic", "TOPIC", "the same as --sensor-label: the topic of the laser to use, if the log is of ROS",
	    unchecked.topic);
	add.flag(
	    "--merge-lasers",
	    "use all lasers together: each scan of that laser with the last one of each other laser, at most 0.5 s older; "
	    "odometry, if there is any, links them",
	    flags.merge_lasers);
	add.value(
	    "--sensor-pose", "X,Y,Z,YAW,PITCH,ROLL",
	    "pose of that laser on the robot [m, deg], in place of what the log says; a roll of 180 is upside down",
	    [&](const std::string& text) { flags.overrides.sensor_pose = parse_sensor_pose(text); });
	add.value(
	    "--max-range", "M", "range up to which that laser sees [m], in place of what the log says",
	    [&](const std::string& text) { flags.overrides.max_range = parse_max_range(text); });
	add.value(
	    "--range-factor", "F", "factor of all ranges of that laser, such as 0.001 if the log has them in mm",
	    [&](const std::string& text) { flags.overrides.range_factor = parse_range_factor(text); });
	add.value(
	    "--frames", "A:B:STEP",
	    "localize only scan frames A, A + STEP, A + 2 STEP, ... below B, counted from 0; A, B and :STEP may be left "
	    "out",
	    [&](const std::string& text) { parse_frames(text, flags); });
}

void add_methods(OptionAdder add, Flags& flags)
{
	add.value(
	    "--threads", "N",
	    "number of threads to localize with, and to build the index of method = paper; the results do not depend on it "
	    "(default 1)",
	    [&](const std::string& text)
	    { flags.threads = static_cast<int>(parse_whole_number("--threads", text, 1, 256)); });
	add.value(
	    "--window", "N",
	    "use the last N scans jointly, linked by the odometry of the rawlog or, without it, by the motion that the "
	    "results agree on; finds the place in buildings that look alike all over (default: every scan on its own)",
	    [&](const std::string& text) { flags.window = parse_window(text); });
	add.value(
	    "--region", "X0,Y0,X1,Y1",
	    "the robot is in the box between these two corners [m], map frame: search there only",
	    [&](const std::string& text) { flags.query.prior = parse_region(text); });
	add.value(
	    "--time-budget", "MS",
	    "time for each scan [ms], not counting --window and --fuse: a search for candidates always runs to its "
	    "end, then as many of them are refined as there is time for, and a pose is ambiguous if another one that "
	    "was left out may be the right one; the results depend on the machine and its load (default: no limit)",
	    [&](const std::string& text) { flags.query.time_budget = parse_time_budget(text); });
}

void add_fusion(OptionAdder add, Flags& flags, Unchecked& unchecked)
{
	add.value(
	    "--seed", "N", "seed of the particle filter, from 0 to 4294967295 (default 1)",
	    [&](const std::string& text)
	    { flags.seed = static_cast<std::uint32_t>(parse_whole_number("--seed", text, 0, 4294967295)); });
	add.value("--plugins", "A.so,B.so", "MRPT modules to load first", flags.plugins);
	add.flag(
	    "--fuse",
	    "also run a particle filter, seeded from the results and checked against them; needs the pf-init plug-in",
	    flags.fuse);
	add.value(
	    "--motion", "SOURCE",
	    "what moves the filter: 'pseudo' (successive results), 'odometry' (of the rawlog) or 'both' (default)",
	    unchecked.motion);
}

void add_outputs(OptionAdder add, Flags& flags, Unchecked& unchecked)
{
	add.value(
	    "--index", "FILE",
	    "keep the index of the map in FILE: it is loaded from there in a fraction of the time, and built and saved "
	    "again if FILE is missing, damaged or of another map, other parameters or another version; with an atlas FILE "
	    "is a folder with a file for each map",
	    flags.index);
	add.value(
	    "--save-map", "FILE",
	    "save the map and its parameters as a CSignatureMap2D, for MRPT programs; if FILE is later given as MAP, its "
	    "grid is used, its parameters are not",
	    flags.save_map);
	add.value(
	    "--write-config", "FILE", "write all parameters, with units and meanings, as an ini file", flags.write_config);
	add.value(
	    "--write-pf-ini", "FILE.ini",
	    "write files for MRPT's pf-localization: this ini (it starts at the first localized pose), FILE.rawlog (the "
	    "localized frames, with pseudo-odometry between them) and FILE.gridmap.gz",
	    flags.write_pf_ini);
	add.flag("--no-rawlog", "leave localized.rawlog out, which is as large as the rawlog", unchecked.no_rawlog);
	add.value("--resolution", "R", "of a map that is an image [m/pixel]", unchecked.resolution);
	add.value(
	    "--origin", "X,Y", "where the lower left corner of such an image is in the map frame [m] (default 0,0)",
	    unchecked.origin);
	add.flag(
	    "--stream",
	    "print a line of JSON for each frame as soon as it is known, in place of the table; OUT_DIR may be left out",
	    flags.stream);
	add.flag(
	    "--diagnose",
	    "write nothing, but try on 20 scans what is usually wrong if scans do not fit to a map (its resolution, "
	    "mirrored scans, the unit of ranges, ...), and say which mistake explains them and which option sets it right; "
	    "a run in which most frames are not localized does the same at its end",
	    flags.diagnose);
	add.flag("-q,--quiet", "print errors only", flags.quiet);
}

/// Breaks a text that starts at the column of meanings.
std::string wrap(const std::string& text)
{
	std::istringstream words(text);
	std::string wrapped;
	std::size_t column = kMeaningColumn;
	for (std::string word; words >> word; column += word.size())
	{
		const bool starts = column == kMeaningColumn, fits = column + 1 + word.size() <= kLastColumn;
		if (!starts) wrapped += fits ? " " : "\n" + std::string(kMeaningColumn, ' ');
		column = starts || !fits ? kMeaningColumn : column + 1;
		wrapped += word;
	}
	return wrapped;
}

/// Prints --help as GNU programs do, a paragraph for each option.
void print_help(const CLI::App& app, std::ostream& out)
{
	out << kUsage;
	for (const CLI::Option* option : app.get_options())
	{
		const auto& letters = option->get_snames();
		std::string line = letters.empty() ? "      --" : "  -" + letters.front() + ", --";
		line += option->get_lnames().front();
		if (option->get_items_expected_max() > 0) line += " " + option->get_type_name();
		if (line.size() + 2 > kMeaningColumn) line += "\n" + std::string(kMeaningColumn, ' ');
		line.resize(std::max(line.size(), kMeaningColumn), ' ');
		out << line << wrap(option->get_description()) << "\n";
	}
	out << kOutputs;
}

/// Returns the words behind the program's name, the last one first, as CLI11 wants them. It would take the next word
/// for the value of "--name=", so that becomes two words.
std::vector<std::string> words_of(int argc, char** argv)
{
	std::vector<std::string> words;
	for (int i = 1; i < argc; i++)
	{
		const std::string word = argv[i];
		if (word.rfind("-q=", 0) == 0) wrong(word, "-q takes no value");  // CLI11 would call it "-="
		const bool is_empty_value = word.rfind("--", 0) == 0 && word.find('=') == word.size() - 1;
		words.push_back(is_empty_value ? word.substr(0, word.size() - 1) : word);
		if (is_empty_value) words.emplace_back();
	}
	std::reverse(words.begin(), words.end());
	return words;
}

/// Parses the words. \throws UserError (kWrongUse), CLI::Success for --help and --version
void parse_words(CLI::App& app, int argc, char** argv)
{
	try
	{
		app.parse(words_of(argc, argv));
	}
	catch (const CLI::ArgumentMismatch& error)  // "--name: 1 required VALUE missing" or "name was given ..."
	{
		const std::string what = error.what();
		const auto colon = what.find(':');
		if (colon == std::string::npos) wrong("--" + what.substr(0, what.find(' ')), "takes no value");
		wrong(what.substr(0, colon), "needs a value");
	}
	catch (const CLI::ValidationError& error)
	{
		const std::string what = error.what();
		wrong(what.substr(0, what.find(':')), what.substr(what.find(": ") + 2));
	}
	const auto unknown = app.remaining();
	if (!unknown.empty()) wrong(unknown.front(), "is no option");
	for (const CLI::Option* option : app.get_options())
		if (option->count() > 1 && option->get_multi_option_policy() != CLI::MultiOptionPolicy::TakeAll)
			wrong(option->get_name(), "is given more than once");
}
}  // namespace

std::optional<Flags> parse_flags(int argc, char** argv, std::ostream& out)
{
	Flags flags;
	Unchecked unchecked;
	CLI::App app;
	app.set_help_flag();
	app.allow_extras();
	app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
	const OptionAdder add(app);
	add_inputs(add, flags, unchecked);
	add_methods(add, flags);
	add_fusion(add, flags, unchecked);
	add_outputs(add, flags, unchecked);
	const auto print_version = [&]
	{
		out << "rawlog-localize (d2s1r) " D2S1R_VERSION "\nreads " << logs::known_formats() << "\n";
		throw CLI::Success();
	};
	const auto print_the_help = [&]
	{
		print_help(app, out);
		throw CLI::Success();
	};
	app.add_flag_callback("--version", print_version, "print the version and exit")->trigger_on_parse();
	app.add_flag_callback("-h,--help", print_the_help, "print this help and exit")->trigger_on_parse();
	try
	{
		parse_words(app, argc, argv);
	}
	catch (const CLI::Success&)
	{
		return std::nullopt;
	}
	if (!unchecked.topic.empty())
	{
		if (flags.sensor_label) wrong("--topic", "is the same as --sensor-label; leave one of them out");
		flags.sensor_label = unchecked.topic;
	}
	if (!unchecked.motion.empty()) flags.motion = parse_motion(unchecked.motion, flags.fuse);
	flags.image = parse_image(unchecked.resolution, unchecked.origin);
	flags.rawlog_copy = !unchecked.no_rawlog;
	flags.words.assign(argv, argv + argc);
	for (const CLI::Option* option : app.get_options())
		if (option->count() > 0) flags.given[option->get_lnames().front()] = option->results().back();
	check_complete(flags);
	if (!flags.only_writes_config()) check_live(flags);
	check_saved_map(flags.save_map);
	if (!flags.only_writes_config()) check_image(flags);
	return flags;
}
}  // namespace d2s1r::app
