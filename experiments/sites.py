# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""The sites, their maps, sets of scans and true poses."""
import bisect
import csv
import dataclasses
import math
import os
import pathlib
import re
import sys

FULL_CIRCLES = ("olin_mac_923", "olin_mac_final")  # whose recorded scans are full circles
LEARNED = ("intel", "fr079", "mit_csail", "mit_killian", "fr_campus")  # weights were learned on other sets of these drives
MORE = ("acapulco", "aces", "belgioioso", "edmonton", "fhw", "fr101", "orebro", "seattle")  # nothing was learned on them
# No weights were learned on these, so that they stay a test, but other parameters were chosen while they were looked at. Their
# truth is a registration of the drive to the map, good to 0.1 m and 1 to 2 deg; some headings of mines are 5 to 7 deg off.
LOOKED_AT = ("mines_runs", "mines_other_day", "olin_mac_923", "olin_mac_final")
AGAIN = ("mines_other_day", "olin_mac_final")  # another day or map of a building that is there already
IN_MAP = 0.5  # [0, 1] of the returns on walls at the truth, from which the place of a scan is in the map
SAME_TIME = 1  # [ms]
GAP = 500  # [ms] between two lines of truth, at most, that are interpolated
LOGS = (".rawlog", ".bag", ".mcap", ".db3", ".log", ".clf", ".gz", ".bz2", ".zst")
MAPS = (".yaml", ".simplemap", ".gridmap", ".gz")
BY_TURNS = ("fr_campus", "orebro", "seattle")  # whose map_test is drawn from every second scan of run.rawlog
SIMULATED = ("sim360_on", "sim360_off", "sim360_clutter", "sim270_off")


@dataclasses.dataclass(frozen=True)
class Site:
    name: str
    folder: pathlib.Path

    def map(self, scans):
        """Real scans are localized in a map that has never seen them."""
        tested = self.folder / "map_test.yaml"
        return tested if scans == "test" and tested.exists() else self.folder / "map.yaml"

    @property
    def files(self):
        return sorted(self.folder.iterdir())

    def has(self, scans):
        return (self.folder / f"{scans}.rawlog").exists() and self.truth_file(scans).exists()

    def truth_file(self, scans):
        return self.folder / f"{scans}_gt.txt"

    def truth(self, scans):
        return Truth.read(self.truth_file(scans))

    def knowledge(self, scans):
        return read_knowledge(self.folder / f"{scans}_scans.csv")


class Truth:
    """Poses of the robot in the map by time."""

    def __init__(self, poses):
        """\p poses: {time in ms: (x, y, phi)}, m and rad"""
        self.poses = poses
        self.times = sorted(poses)

    def __len__(self):
        return len(self.poses)

    def at(self, stamp):
        """The pose at a time [s]: that of a line within 1 ms, else between two lines half a second apart at most; or None."""
        key = round(stamp * 1000)
        after = bisect.bisect_left(self.times, key - SAME_TIME)
        if after < len(self.times) and self.times[after] <= key + SAME_TIME:
            return self.poses[self.times[after]]
        if 0 < after < len(self.times) and self.times[after] - self.times[after - 1] <= GAP:
            return between(self.poses[self.times[after - 1]], self.poses[self.times[after]],
                           (key - self.times[after - 1]) / (self.times[after] - self.times[after - 1]))
        return None

    @staticmethod
    def read(file):
        """Of lines `time x y phi`, `time x y z yaw pitch roll` or TUM's `time x y z qx qy qz qw`, [s, m, rad]."""
        poses = {}
        for line in file.read_text().splitlines():
            if line.strip() and line[0] not in "%#":
                try:
                    stamp, *pose = (float(word) for word in line.replace(",", " ").split())
                except ValueError:
                    continue  # names of columns
                if len(pose) not in (3, 6, 7):
                    raise ValueError(f"{file}: `{line}` is neither `time x y phi`, nor a pose of MRPT, nor one of TUM")
                if not all(map(math.isfinite, [stamp, *pose])):
                    raise ValueError(f"{file}: `{line}` holds a number that is not finite")
                yaw = yaw_of(pose[3:]) if len(pose) == 7 else pose[2 if len(pose) == 3 else 3]
                poses[round(stamp * 1000)] = (pose[0], pose[1], yaw)
        return Truth(poses)


def yaw_of(quaternion):
    """[rad]"""
    x, y, z, w = quaternion
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def between(pose, other, part):
    turn = math.remainder(other[2] - pose[2], 2 * math.pi)
    return pose[0] + part * (other[0] - pose[0]), pose[1] + part * (other[1] - pose[1]), pose[2] + part * turn


def read_knowledge(file):
    """{time in ms: (whether the place is in the map, whether the truth is doubtful)}; empty if there is no such file"""
    if not file.exists():
        return {}
    with open(file, newline="") as stream:
        return {round(float(row["timestamp"]) * 1000): (float(row["on_walls"]) >= IN_MAP, row["doubtful"] == "1")
                for row in csv.DictReader(stream)}


@dataclasses.dataclass(frozen=True)
class Case:
    """A map, a log and the true poses, of any names."""
    name: str
    folder: pathlib.Path
    map_file: pathlib.Path
    log: pathlib.Path
    truth_of: pathlib.Path
    between: bool = False  # whether the truth is interpolated even if it has lines at the times of some scans

    @property
    def files(self):
        return sorted({self.map_file, self.log, self.truth_of, *self.folder.iterdir()})

    def truth(self, _):
        return Truth.read(self.truth_of)

    def knowledge(self, _):
        return read_knowledge(self.folder / f"{self.log.stem}_scans.csv")

    @property
    def contradicted(self):
        """[scans] whose truth the log contradicts"""
        return sum(doubtful for _, doubtful in self.knowledge("").values())

    @property
    def keyframes(self):
        """(log, truth) of the drive that built the map; None if they are not here."""
        built_by = Site(self.name, self.folder)
        return (self.folder / "run.rawlog", built_by.truth_file("run")) if built_by.has("run") else None


def name_of(folder):
    """The name of a site, as files and LaTeX's labels can have it."""
    return re.sub(r"[^\w.-]+", "_", folder.resolve().name)


def case(folder, scans="test", **given):
    """What compare.py compares on in a folder: test.* and its truth in map_test.*, else the only log, truth and map there; but
    the fields of Case that are given.

    \throws ValueError that says what is missing or found more than once"""
    files = sorted(folder.iterdir()) if folder.is_dir() else []
    texts = [f for f in files if f.suffix in (".txt", ".csv", ".tum")]

    def only(field, kind, *choices):
        for found in [[given[field]]] if field in given else choices:
            if len(found) == 1:
                return found[0]
            if found:
                raise ValueError(f"{folder}: holds several files that may be the {kind}: " + ", ".join(f.name for f in found))
        raise ValueError(f"{folder}: holds no {kind}")

    def named(name, of):
        return [f for f in of if f.name.split(".")[0] == name]
    maps = [f for f in files if f.suffix in MAPS and f.name.split(".")[-2] not in ("rawlog", "log", "clf")]
    logs = [f for f in files if f.suffix in LOGS and f not in maps or f.is_dir() and (f / "metadata.yaml").exists()]
    truths = [f for f in texts if re.search("gt|truth|groundtruth", f.stem)]
    return Case(name_of(folder), folder,
                only("map_file", "map", named("map_test", maps) if scans == "test" else [], named("map", maps), maps),
                only("log", "log", named(scans, logs), logs),
                only("truth_of", "truth (*gt*, *truth*)", named(f"{scans}_gt_checked", truths), named(f"{scans}_gt", truths), truths),
                given.get("between", False))


def default_folder(project):
    return pathlib.Path(os.environ.get("D2S1R_DATA", project / "../shared/data"))


def find(folder):
    return [Site(path.parent.name, path.parent) for path in sorted(folder.glob("*/map.yaml"))]


def named(names):
    """The sites of these names below D2S1R_DATA; ends the program if one is not there."""
    folder = default_folder(pathlib.Path(__file__).parents[1])
    found = {site.name: site for site in find(folder)}
    for name in names:
        if name not in found:
            program = pathlib.Path(sys.argv[0]).name
            sys.exit(f"{program}: {folder}: no site {name}; set D2S1R_DATA, or name others by --sites")
    return [found[name] for name in names]


def map_image(yaml):
    """File of the picture of a map_server map, its extent (left, right, bottom, top) per pixel count [m], and the yaw by which it
    is turned about its lower left corner [rad]."""
    text = yaml.read_text()
    image = re.search(r"^image:[ \t]*(.+?)[ \t]*(?: #.*)?$", text, re.M).group(1).strip("'\"")
    resolution = float(re.search(r"^resolution:\s*(\S+)", text, re.M).group(1))
    origin = re.search(r"^origin:\s*(\[[^\]]*\]|(?:-[^\n]*\n?\s*)+)", text, re.M).group(1)  # in one line, or one number a line
    left, bottom, yaw = (float(v) for v in re.findall(r"(?<![\w.+])[-+]?[\d.]+(?:[eE][-+]?\d+)?", origin))
    return yaml.parent / image, lambda rows, columns: (
        left, left + columns * resolution, bottom, bottom + rows * resolution), yaw
