# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""The Python module: the program's poses, arrays in and out, errors, and threads that run in parallel.

RAWLOG_LOCALIZE names the program."""
import ast
import csv
import inspect
import math
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time
import tracemalloc

import d2s1r
import numpy as np
import pytest
from drawn_world import BEAMS, CELL, FIRST_ANGLE, MAX_RANGE, ORIGIN, SENSOR, STEP, World, ranges_at


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    return World(tmp_path_factory.mktemp("world"))


@pytest.fixture(scope="module")
def localizer(world):
    return d2s1r.Localizer(d2s1r.Map.load(world.folder / "map.yaml"))


def test_poses_are_those_of_the_program_to_the_last_digit(world, localizer):
    frames, hypotheses = world.rows_of_program()
    assert len(frames) == 100
    for frame in frames:
        result = localizer.localize(*world.arguments(int(frame["frame"])))
        assert result.status == frame["status"]
        assert f"{result.confidence:.6f}" == frame["confidence"]
        mine = [h for h in hypotheses if h["frame"] == frame["frame"]]
        assert [[f"{v:.6f}" for v in pose] for pose in result.poses] == [[h["x"], h["y"], h["phi"]] for h in mine]
        assert [f"{p:.6g}" for p in result.probabilities] == [h["probability"] for h in mine]
        assert [f"{math.sqrt(c[2, 2]):.6f}" for c in result.covariances] == [h["std_phi"] for h in mine]
        assert f"{result.relative_entropy:.6f}" == frame["relative_entropy"]
    assert sum(frame["status"] == "localized" for frame in frames) > 90


def motion_to(world, i):
    """Of the robot to scan i from the one before, in its frame then."""
    dx, dy, dphi = world.robots[i] - world.robots[i - 1]
    phi = world.robots[i - 1][2]
    return dx * math.cos(phi) + dy * math.sin(phi), dy * math.cos(phi) - dx * math.sin(phi), dphi


def test_window_answers_as_the_program_does(world, localizer):
    frames, _ = world.rows_of_program("--window", "5")
    window = d2s1r.WindowLocalizer(localizer, frames=5)
    for i in range(20):
        motion = motion_to(world, i) if i > 0 else None
        result = window.add(*world.arguments(i), motion=motion)
        assert result.status == frames[i]["status"]
        assert np.allclose(result.pose, [float(frames[i][key]) for key in ("x", "y", "phi")], atol=2e-6)
        assert result.confidence == pytest.approx(float(frames[i]["confidence"]), abs=1e-5)


def test_tracker_answers_as_the_program_does(world, localizer):
    world.rows_of_program("--track")
    with open(world.folder / "out" / "track.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    tracker = d2s1r.Tracker(localizer)
    assert tracker.after() is None
    for i in range(20):
        motion = motion_to(world, i) if i > 0 else None
        result = tracker.add(float(rows[i]["timestamp"]), *world.arguments(i), motion=motion)
        assert result.status == rows[i]["status"]
        assert np.allclose(result.pose, [float(rows[i][key]) for key in ("x", "y", "phi")], atol=2e-6)
    pose, probability = tracker.after((0.5, 0, 0))
    assert probability == result.confidence
    assert np.hypot(*(pose - result.pose)[:2]) == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("off, said", [(0.2, "taken"), (4.0, "refused")])
def test_tracker_takes_a_suggestion_if_the_scans_allow_it(world, localizer, off, said):
    tracker = d2s1r.Tracker(localizer)
    assert tracker.suggestion == "none"
    x, y, phi = world.robots[0]
    tracker.suggest((x + off, y, phi))
    assert tracker.suggestion == "open"
    for i in range(20):
        result = tracker.add(float(i), *world.arguments(i), motion=motion_to(world, i) if i > 0 else None)
        if tracker.suggestion != "open":
            break
    assert tracker.suggestion == said
    assert np.hypot(*(result.pose - world.robots[i])[:2]) < 0.1
    with pytest.raises(ValueError):
        tracker.suggest((0, 0, 0), map="cellar")


def test_poses_are_right(world, localizer):
    for i in range(0, 100, 10):
        result = localizer.localize(*world.arguments(i))
        assert result.status == "localized"
        assert result.pose == pytest.approx(result.poses[0])
        assert np.hypot(*(result.pose - world.robots[i])[:2]) < 0.1
        assert result.poses.shape == (len(result.probabilities), 3)
        assert result.covariances.shape == (len(result.probabilities), 3, 3)
        assert result.explained[0] > 0.8 and result.total_ms > 0 and result.note == ""
        assert repr(result).startswith("<d2s1r.Localization localized at (")


@pytest.mark.parametrize("cells", [
    lambda occupied: occupied, lambda occupied: occupied.astype(np.float64), lambda occupied: 100 * occupied.astype(np.int8)])
def test_map_of_an_array_is_the_same_map(world, localizer, cells):
    made = d2s1r.Map(cells(world.occupied), CELL, ORIGIN)
    assert made.extent == pytest.approx((-1, 11, 2, 11))
    assert made.resolution == pytest.approx(CELL)
    assert np.array_equal(made.array > 0.5, world.occupied)
    other = d2s1r.Localizer(made)
    for i in (0, 37, 74):
        assert np.array_equal(other.localize(*world.arguments(i)).poses, localizer.localize(*world.arguments(i)).poses)


def test_image_needs_a_resolution(world):
    made = d2s1r.Map.load(str(world.folder / "map.pgm"), resolution=CELL, origin=ORIGIN)
    assert np.array_equal(made.array > 0.5, world.occupied)
    with pytest.raises(RuntimeError, match="map.pgm.*resolution"):
        d2s1r.Map.load(world.folder / "map.pgm")
    with pytest.raises(ValueError, match="origin goes with resolution"):
        d2s1r.Map.load(world.folder / "map.pgm", origin=ORIGIN)


def test_unknown_cells_are_kept():
    made = d2s1r.Map(np.array([[0.0, np.nan], [1.0, 0.5]]), 1.0)
    assert made.array == pytest.approx(np.array([[0, 0.5], [1, 0.5]]), abs=0.01)
    assert d2s1r.Map(np.array([[0, -1], [100, 50]]), 1.0).array == pytest.approx(made.array, abs=0.01)


def test_region_and_arguments(world, localizer):
    arguments = world.arguments(50)
    pose = localizer.localize(*arguments).pose
    inside = localizer.localize(*arguments, region=(pose[0] - 1, pose[1] - 1, pose[0] + 1, pose[1] + 1))
    assert inside.pose == pytest.approx(pose, abs=0.02)
    outside = localizer.localize(*arguments, region=(8.5, 3, 10.5, 5))
    assert outside.status != "localized" or not np.allclose(outside.pose, pose, atol=0.5)
    backwards = localizer.localize(arguments[0][::-1], FIRST_ANGLE + STEP * (BEAMS - 1), -STEP, MAX_RANGE, SENSOR)
    assert backwards.pose == pytest.approx(pose, abs=0.002)
    in_3d = localizer.localize(*arguments[:4], (SENSOR[0], SENSOR[1], 0.4, SENSOR[2], 0, 0))
    assert np.array_equal(in_3d.pose, pose)
    listed = localizer.localize(list(map(float, arguments[0])), *arguments[1:])
    assert np.array_equal(listed.pose, pose)
    blind = localizer.localize(*arguments, min_range=30.0)
    assert blind.status == "invalid" and blind.pose is None and blind.poses.shape == (0, 3) and blind.note


def test_sweep_moves_the_beams_to_one_time(world, localizer):
    robot, rate, step = np.array([5.2, 4.8, 0.3]), 1.5, 0.2 / BEAMS
    turned = [robot + (0, 0, rate * step * i) for i in range(BEAMS)]
    ranges = np.array([ranges_at(world.occupied, at)[i] for i, at in enumerate(turned)], np.float32)
    arguments = (ranges, FIRST_ANGLE, STEP, MAX_RANGE, SENSOR)
    times = np.linspace(-0.1, 0.3, 9)
    by_poses = d2s1r.Sweep(step, times=times, poses=np.outer(times, (0, 0, rate)))
    for sweep in (by_poses, d2s1r.Sweep.of_twist(step, (0, 0, rate))):
        assert abs(localizer.localize(*arguments, sweep=sweep).pose[2] - robot[2]) < 0.02
        assert abs(d2s1r.WindowLocalizer(localizer).add(*arguments, sweep=sweep).pose[2] - robot[2]) < 0.02
        assert abs(d2s1r.Atlas({"a": localizer}).localize(*arguments, sweep=sweep).pose[2] - robot[2]) < 0.02
    assert abs(localizer.localize(*arguments).pose[2] - robot[2]) > 0.08
    unknown = localizer.localize(*arguments, sweep=d2s1r.Sweep(step))
    assert abs(unknown.pose[2] - robot[2]) < 2 * math.sqrt(unknown.covariances[0][2, 2])
    assert localizer.localize(*arguments, sweep=d2s1r.Sweep(math.nan)).status == "invalid"
    for wrong in ({"times": [0], "poses": [[0, 0]]}, {"times": [0, 1], "poses": [[0, 0, 0]]},
                  {"times": [1, 0], "poses": np.zeros((2, 3))}):
        with pytest.raises(ValueError, match="Sweep: "):
            d2s1r.Sweep(step, **wrong)
    endless = np.broadcast_to(0.0, (10**8, 3))  # takes no memory until it is copied
    with pytest.raises(ValueError, match="300000000 numbers"):
        d2s1r.Sweep(step, times=[0], poses=endless)
    with pytest.raises(ValueError, match="100000000 numbers"):
        d2s1r.Sweep(step, times=endless[:, 0], poses=[[0, 0, 0]])


def test_floats_are_read_in_place(localizer):
    """numpy tells tracemalloc of the memory that it takes."""
    def taken_by(ranges):
        tracemalloc.start()
        assert localizer.localize(ranges, 0, 1e-6, MAX_RANGE, min_range=MAX_RANGE).status == "invalid"
        taken = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return taken

    beams = 1_000_000
    assert taken_by(np.ones(beams, np.float32)) < beams
    assert taken_by(np.ones(beams, np.float64)) >= 4 * beams, "of other numbers there is one copy"


@pytest.mark.parametrize("call", [
    lambda localizer, many: d2s1r.Map(np.broadcast_to(np.float32(0), (many, many)), 0.05),
    lambda localizer, many: d2s1r.Map(np.broadcast_to(np.int8(0), (many, many)), 0.05),
    lambda localizer, many: localizer.localize(np.broadcast_to(np.float64(1), many * many), 0, 1e-6, 10.0),
])
def test_sizes_are_looked_at_before_anything_is_copied(localizer, call):
    """A view of one number pretends to be a million times a million; copies of it would be terabytes."""
    tracemalloc.start()
    with pytest.raises(ValueError, match="1000000"):
        call(localizer, 1_000_000)
    taken = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert taken < 1_000_000


def test_objects_need_their_init(localizer):
    """pybind11 hands methods memory that nobody wrote to if an object is made without __init__()."""
    classes = {name: getattr(d2s1r, name) for name in d2s1r.__all__ if isinstance(getattr(d2s1r, name), type)}
    made = {name: made_of.__new__(made_of) for name, made_of in classes.items()}
    for name, thing in made.items():
        for key in [key for key in dir(type(thing)) if not key.startswith("_")]:
            if isinstance(getattr(type(thing), key), property):
                with pytest.raises(TypeError, match=r"__init__\(\) was not called"):
                    getattr(thing, key)
    with pytest.raises(TypeError, match="__init__"):
        made["Localizer"].localize([1.0], 0, 1, 10)
    with pytest.raises(TypeError, match="__init__"):
        made["Localizer"].to_ini()
    with pytest.raises(TypeError, match="__init__"):
        made["Atlas"].localize([1.0], 0, 1, 10)
    with pytest.raises(TypeError, match="__init__"):
        made["WindowLocalizer"].add([1.0], 0, 1, 10)
    with pytest.raises(TypeError, match="__init__"):
        repr(made["Localization"])
    for make in (d2s1r.Localizer, d2s1r.WindowLocalizer):
        for thing in made.values():
            with pytest.raises(TypeError):
                make(thing)
    with pytest.raises(Exception):
        d2s1r.Atlas({"a": made["Localizer"]})


def test_names_of_maps_may_be_those_of_any_file(localizer, world, tmp_path):
    folder = os.fsencode(tmp_path) + b"/maps"
    os.mkdir(folder)
    for name in ("map.yaml", "map.pgm"):
        pathlib.Path(os.fsdecode(folder + b"/" + name.replace("map.yaml", "\udcff.yaml").encode(errors="surrogateescape"))) \
            .write_bytes((world.folder / name).read_bytes())
    atlas = d2s1r.Atlas.load(folder)
    assert atlas.names == ["\udcff"]
    assert atlas.localize(*world.arguments(0)).map == "\udcff"
    assert d2s1r.Atlas({"\udcff": localizer}).names == ["\udcff"]


def test_parameters_by_dict_and_by_file(world, tmp_path):
    made = d2s1r.Map.load(world.folder / "map.yaml")
    strict = d2s1r.Localizer(made, {"scan.min_beams": 500, "free_cells.largest_region_only": True}, threads=2)
    assert strict.localize(*world.arguments(0)).status == "invalid"
    (tmp_path / "all.ini").write_text(strict.to_ini())
    assert d2s1r.Localizer(made, tmp_path / "all.ini").to_ini() == strict.to_ini()


@pytest.mark.parametrize("error, text, call", [
    (FileNotFoundError, "no.yaml", lambda localizer, made: d2s1r.Map.load("no.yaml")),
    (ValueError, "1 dimensions", lambda localizer, made: d2s1r.Map([0, 1], 0.05)),
    (ValueError, "column 1 and row 0 is 7", lambda localizer, made: d2s1r.Map([[0.0, 7.0]], 0.05)),
    (ValueError, "cell of the array is 101", lambda localizer, made: d2s1r.Map([[0, 101]], 0.05)),
    (ValueError, "array is 1099511627776", lambda localizer, made: d2s1r.Map([[0, 2**40]], 0.05)),
    (ValueError, "array is 4294967346", lambda localizer, made: d2s1r.Map([[0, 2**32 + 50]], 0.05)),
    (ValueError, "array is 18446744073709551615", lambda localizer, made:
        d2s1r.Map(np.array([[2**64 - 1]], np.uint64), 0.05)),
    (ValueError, "null byte", lambda localizer, made: d2s1r.Map.load("a\0b.yaml")),
    (ValueError, "not numbers", lambda localizer, made: d2s1r.Map([["a"]], 0.05)),
    (ValueError, "resolution", lambda localizer, made: d2s1r.Map([[0.0]], 0)),
    (ValueError, "0 x 1 cells|1 x 0 cells|0 x 0 cells", lambda localizer, made: d2s1r.Map(np.zeros((1, 0)), 0.05)),
    (ValueError, "origin", lambda localizer, made: d2s1r.Map([[0.0]], 0.05, (1e9, 0))),
    (ValueError, "scan.min_beams", lambda localizer, made: d2s1r.Localizer(made, {"scan.min_beams": 0})),
    (ValueError, "section.key", lambda localizer, made: d2s1r.Localizer(made, {"min_beams": 30})),
    (FileNotFoundError, "no.ini", lambda localizer, made: d2s1r.Localizer(made, "no.ini")),
    (ValueError, "ranges has 2 dimensions", lambda localizer, made: localizer.localize([[1.0]], 0, 1, 10)),
    (ValueError, "sensor_pose has 2", lambda localizer, made: localizer.localize([1.0], 0, 1, 10, (1, 2))),
    (ValueError, "box", lambda localizer, made: localizer.localize([1.0], 0, 1, 10, region=(1, 1, 1, 1))),
    (ValueError, "time budget", lambda localizer, made: localizer.localize([1.0], 0, 1, 10, time_budget=-1)),
    (TypeError, r"localize\(\) has no argument 'max_rang'; did you mean 'max_range'", lambda localizer, made:
        localizer.localize([1.0], 0, 1, max_rang=10)),
    (TypeError, r"Map.load\(\) has no argument 'scale'", lambda localizer, made: d2s1r.Map.load("no.yaml", scale=1)),
    (TypeError, r"localize\(\) does not take these arguments; it takes ranges, angle_min", lambda localizer, made:
        localizer.localize([1.0], "left", 1, 10)),
    (ValueError, "frames", lambda localizer, made: d2s1r.WindowLocalizer(localizer, 0)),
    (ValueError, "ranges does not hold numbers", lambda localizer, made: localizer.localize(["a"], 0, 1, 10)),
    (ValueError, "rename it", lambda localizer, made: d2s1r.Atlas({"a/b": localizer})),
    (ValueError, "rename it", lambda localizer, made: d2s1r.Atlas({"": localizer, "b": localizer})),
    (TypeError, "must be a str", lambda localizer, made: d2s1r.Atlas({1: localizer})),
    (FileNotFoundError, "xff", lambda localizer, made: d2s1r.Map.load(b"\xff")),
    (FileNotFoundError, "xff.yaml", lambda localizer, made: d2s1r.Atlas.load(b"\xff.yaml")),
    (FileNotFoundError, "xff.ini", lambda localizer, made: d2s1r.Localizer(made, b"\xff.ini")),
])
def test_errors_say_what_is_wrong_in_one_line(world, localizer, error, text, call):
    with pytest.raises(error, match=text) as caught:
        call(localizer, d2s1r.Map(world.occupied, CELL))
    assert "\n" not in str(caught.value)


def test_the_example_of_a_bag_says_what_is_wrong_in_one_line(world, tmp_path):
    share = pathlib.Path(__file__).parents[2] / "share/d2s1r"
    plan, text = world.folder / "map.yaml", tmp_path / "text.db3"
    text.write_text("no bag")
    whole, half = share / "data/office_bag/office_bag_0.db3", tmp_path / "half.db3"
    half.write_bytes(whole.read_bytes()[:whole.stat().st_size // 2])
    for words, said in [([], "usage: "), ([plan, "none.db3"], "none.db3: is not the .db3 file of a bag"),
                        ([plan, text], f"{text}: is not the .db3 file of a bag"),
                        ([plan, half], f"{half}: is not the .db3 file of a bag, or damaged"), ([text, plan], f"{text}: is not a map"),
                        ([plan, share / "data/office_bag", "0.15"], "sensor_pose has 1 numbers")]:
        done = subprocess.run([sys.executable, share / "examples/bag_in_python.py", *words], capture_output=True, text=True, check=False)
        assert done.returncode == 1 and done.stderr.startswith(said) and done.stderr.count("\n") == 1, done.stderr


def test_a_window_keeps_its_localizer(world):
    window = d2s1r.WindowLocalizer(d2s1r.Localizer(d2s1r.Map(world.occupied, CELL, ORIGIN)), 3)
    assert window.add(*world.arguments(0)).status == "localized"


@pytest.mark.parametrize("name", ["Localizer", "Localizer.localize", "WindowLocalizer.add", "Atlas.localize"])
def test_a_call_begins_and_ends_while_another_one_lasts(world, localizer, name):
    """Threads change only where one of them gives the interpreter's lock away, because it is never asked for."""
    building, arguments = d2s1r.Map(np.tile(world.occupied, (4, 4)), CELL, ORIGIN), world.arguments(0)
    large = d2s1r.Localizer(building)
    long_call = {  # takes many times as long as that on the small map
        "Localizer": lambda: d2s1r.Localizer(building),
        "Localizer.localize": lambda: large.localize(*arguments),
        "WindowLocalizer.add": lambda window=d2s1r.WindowLocalizer(large, 3): window.add(*arguments),
        "Atlas.localize": lambda atlas=d2s1r.Atlas({"large": large}): atlas.localize(*arguments)}[name]
    lasting, within, done = None, 0, False  # lasting: which long call

    def call_often():
        nonlocal within
        for _ in range(20000):
            if done:
                return
            before = lasting
            localizer.localize(*arguments)
            within += before is not None and before == lasting

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1000)  # [s]
    try:
        other = threading.Thread(target=call_often)
        other.start()
        for i in range(200):
            lasting = i
            long_call()
            lasting = None
            if within > 0:
                break
        done = True
        other.join()
    finally:
        sys.setswitchinterval(interval)
    assert within > 0


def test_two_threads_get_the_same_answers(world, localizer):
    """Prints, with pytest -s, how long 1,000 calls take in one thread and in two."""
    arguments = [world.arguments(i) for i in range(100)]
    answers = [None] * 1000

    def work(begin, end):
        for i in range(begin, end):
            answers[i] = localizer.localize(*arguments[i % 100]).poses

    def seconds(*parts):
        start = time.perf_counter()
        threads = [threading.Thread(target=work, args=part) for part in parts]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return time.perf_counter() - start

    one = seconds((0, 1000))
    expected, answers = answers, [None] * 1000
    two = seconds((0, 500), (500, 1000))
    print(f"1000 calls: one thread {one:.2f} s, two threads {two:.2f} s, {one / two:.2f} times as fast")
    assert all(np.array_equal(a, b) for a, b in zip(answers, expected))


def test_an_atlas_names_the_map(world, localizer, tmp_path):
    other = d2s1r.Localizer(d2s1r.Map(world.occupied[:, ::-1], CELL, ORIGIN))
    atlas = d2s1r.Atlas({"here": localizer, "mirrored": other})
    assert atlas.names == ["here", "mirrored"]
    for i in range(0, 100, 10):
        result, alone = atlas.localize(*world.arguments(i)), localizer.localize(*world.arguments(i))
        assert result.map == "here" and alone.map == ""
        assert len(result.maps) == len(result.probabilities)
        assert np.array_equal(result.pose, alone.pose)
    window = d2s1r.WindowLocalizer(atlas, frames=5)
    for i in range(5):
        result = window.add(*world.arguments(i))
    assert result.status == "localized" and result.map == "here"
    with pytest.raises(ValueError, match="'cellar', which is no map"):
        d2s1r.Atlas({"here": localizer}, regions={"cellar": (0, 0, 1, 1)})
    (tmp_path / "atlas.yaml").write_text(f"maps: {{a: {{file: {world.folder / 'map.yaml'}, region: [-1, 2, 11, 11]}}}}\n")
    assert d2s1r.Atlas.load(tmp_path / "atlas.yaml").localize(*world.arguments(0)).map == "a"
    with pytest.raises(RuntimeError, match="holds no map"):
        (tmp_path / "empty").mkdir()
        d2s1r.Atlas.load(tmp_path / "empty")


def test_a_drive_shows_how_the_laser_is_mounted(world, localizer):
    told = (*SENSOR[:2], SENSOR[2] + math.pi / 2)
    chosen = range(0, 100, 3)
    scans, times = [world.scans[i] for i in chosen], [100.0 + i for i in chosen]
    poses = [localizer.localize(scan, FIRST_ANGLE, STEP, MAX_RANGE, told).pose for scan in scans]
    laser = FIRST_ANGLE, STEP, MAX_RANGE
    drive = 100.0 + np.arange(100), world.robots
    shown = d2s1r.calibrate(localizer, scans, times, poses, *laser, *drive, told)
    assert shown["is_changed"] and shown["yaw"]["verdict"] == "changed"
    assert abs(shown["yaw"]["shown"] - SENSOR[2]) < math.radians(1)
    with pytest.raises(ValueError, match="a scan for each of the poses"):
        d2s1r.calibrate(localizer, scans[1:], times, poses, *laser, *drive, told)


def test_stubs_and_docstrings_cover_the_module():
    stubs = ast.parse((pathlib.Path(d2s1r.__file__).parent / "__init__.pyi").read_text())
    classes = {node.name: node for node in stubs.body if isinstance(node, ast.ClassDef)}
    functions = [node.name for node in stubs.body if isinstance(node, ast.FunctionDef)]
    assert sorted([*classes, *functions]) == sorted(d2s1r.__all__)
    assert all(inspect.getdoc(getattr(d2s1r, name)) for name in functions)
    for name, stub in classes.items():
        own = {key: getattr(getattr(d2s1r, name), key) for key in vars(getattr(d2s1r, name)) if not key.startswith("_")}
        functions = {node.name: node for node in stub.body if isinstance(node, ast.FunctionDef)}
        assert sorted(own) == sorted(key for key in functions if key != "__init__")
        for key, value in own.items():
            assert inspect.getdoc(value), f"{name}.{key} has no docstring"
            if not isinstance(value, property):
                arguments = functions[key].args
                signature = inspect.getdoc(value).splitlines()[0]
                for argument in arguments.args + arguments.kwonlyargs:
                    assert argument.arg in signature


def test_maps_and_localizers_say_what_they_are(world, localizer):
    made = d2s1r.Map(np.zeros((20, 30)), 0.1, origin=(1, -2))
    assert repr(made) == "<d2s1r.Map of 30 x 20 cells of 0.1 m, origin (1, -2)>"
    assert tuple(made.origin) == pytest.approx((1, -2))
    assert repr(localizer).startswith("<d2s1r.Localizer in ") and repr(localizer).endswith("method = default>")


def test_an_interrupt_is_heard_while_an_index_is_built():
    program = """
import numpy as np, d2s1r
cells = np.zeros((4000, 4000), bool)
cells[::40, ::3] = True
made = d2s1r.Map(cells, 0.05)
print("ready", flush=True)
try:
    d2s1r.Localizer(made)
    print("built")
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "interrupted\n"
