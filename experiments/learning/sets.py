# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""The sets of scans, with the map that each is localized in, that constants are learned and judged on."""
import dataclasses
import hashlib
import itertools
import pathlib
import shutil
import subprocess
import zlib

import numpy as np

import runs
import sites
from learning import degraded_maps, drawn_sites

# name -> words of degraded_maps
MAPS = {
    "coarse": ("coarse=0.1",),
    "smeared": ("coarse=0.1", "smeared=0.1"),
    "smeared_much": ("coarse=0.1", "smeared=0.2"),
    "smeared_behind": ("coarse=0.1", "smeared=0.17,0.47"),
    "smeared_fine": ("smeared=0.1,0.25",),
    "blurred": ("blurred=0.08",),
    "warped": ("warped=0.3",),
    "moved": ("moved=0.8",),
    "grey": ("grey=0.2",),
    "false_free": ("false_free=1",),
    "sketch": ("warped=0.2", "coarse=0.1", "smeared=0.12,0.35", "false_free=1", "moved=0.4"),
}
# name -> words of alter_scans
SENSORS = {
    "reach3.5": ("reach=3.5",),
    "reach8": ("reach=8",),
    "view60": ("field_of_view=60",),
    "view120": ("field_of_view=120",),
    "invalid40": ("invalid=0.4",),
    "noise1": ("relative_noise=0.01",),
    "noise3": ("relative_noise=0.03",),
    "beams90": ("beams=90",),
    "blocked20": ("blocked=0.2",),
    "short50": ("short=0.5",),
    "cheap": ("reach=5.6", "field_of_view=240", "invalid=0.4", "relative_noise=0.02"),
}
# lasers that scan the drawn floors; simulated scans have no noise of their own
LASERS = {
    "full": ("beams=1440", "noise=0.01", "reach=30"),
    "long": ("beams=360", "noise=0.02", "reach=80"),
    "turning": ("beams=720", "noise=0.015", "reach=12"),
    "front": ("beams=720", "field_of_view=180", "noise=0.015", "reach=30"),
    "wide": ("beams=1080", "field_of_view=270", "noise=0.02", "reach=20"),
    "small": ("beams=360", "relative_noise=0.01", "noise=0.01", "reach=3.5"),
    "cheap": ("beams=1024", "field_of_view=240", "invalid=0.4", "relative_noise=0.02", "reach=5.6"),
    "sparse": ("beams=90", "relative_noise=0.02", "reach=10"),
    "narrow": ("beams=720", "field_of_view=90", "noise=0.02", "reach=40"),
}
# (kind, m2) of the drawn floors; the seed is the place in the list
FLOORS = (("office", 300), ("office", 700), ("office", 1800), ("corridor", 500), ("corridor", 1500), ("corridor", 3500),
          ("hall", 800), ("hall", 2500), ("apartment", 200), ("apartment", 400), ("apartment", 900), ("warehouse", 800),
          ("warehouse", 2500), ("office", 4000))
FLOOR_SCANS = 80  # [-] on each drawn floor


@dataclasses.dataclass(frozen=True)
class Set:
    """Scans and the map in which they are localized; files are made when they are needed."""
    name: str
    kind: str  # "real", "simulated", "map", "sensor", "drawn", "stranger", "mirrored"
    groups: tuple  # the sites that it is of: those of the scans and of the map
    map: pathlib.Path
    scans: pathlib.Path
    truth: pathlib.Path  # None: the scans are of another place than the map
    map_words: tuple = ()  # of degraded_maps
    scan_words: tuple = ()  # of alter_scans
    floors: tuple = ()  # (kind, m2, seed) of floors that have to be drawn first

    @property
    def seed(self):
        """Of what is drawn at random for it."""
        return zlib.crc32(self.name.encode()) % 10000


@dataclasses.dataclass(frozen=True)
class Files:
    map: pathlib.Path
    scans: pathlib.Path
    truth: pathlib.Path  # or None


class Maker:
    """Makes the files of sets, and finds them the next time: each version of what makes them has a folder of its own."""

    def __init__(self, build, folder):
        self.alter = build / "experiments/alter_scans"
        self.simulate_floor = build / "experiments/simulate_floor"
        made_by = [runs.digest_of_program(program, build) for program in (self.alter, self.simulate_floor)]
        made_by += [runs.digest(pathlib.Path(file)) for file in (__file__, degraded_maps.__file__, drawn_sites.__file__)]
        self.folder = folder / hashlib.sha256(b"".join(made_by)).hexdigest()[:16]

    def draw(self, floor):
        kind, area, seed = floor
        whole(floor_folder(self.folder, floor),
              lambda part: drawn_sites.draw_site(part, kind, area, FLOOR_SCANS, seed, self.simulate_floor))

    def make(self, set_):
        """Needs the floors of the set to be drawn; sets may be made at the same time, a floor twice may not."""
        folder = self.folder / "sets" / f"{set_.name}-{zlib.crc32(repr(set_).encode()):08x}"
        whole(folder, lambda part: self.write(set_, part))
        truth = folder / "gt.txt"
        return Files(folder / "map.yaml" if set_.map_words else set_.map, folder / "scans.rawlog",
                     truth if truth.exists() else None)

    def write(self, set_, folder):
        run([self.alter, set_.scans, folder / "scans.rawlog", *set_.scan_words, f"seed={set_.seed}"])
        truth = folder / "gt.txt" if set_.truth else None
        if truth:
            np.savetxt(truth, without_doubtful(set_.truth), fmt="%.6f")
        if set_.map_words:
            good = degraded_maps.load_map(set_.map, truth)
            degraded = degraded_maps.degrade(good, set_.map_words, set_.seed)
            degraded_maps.save_map(degraded, folder)
            if truth:
                np.savetxt(truth, degraded.truth, fmt="%.6f")


def without_doubtful(file):
    """The rows of a ground truth but those that the log itself contradicts, if make_sites has said so."""
    rows = np.loadtxt(file, comments=("%", "#"), ndmin=2)[:, :4]
    knowledge = sites.read_knowledge(file.with_name(file.name.replace("_gt.txt", "_scans.csv")))
    doubtful = [stamp for stamp, (_, is_doubtful) in knowledge.items() if is_doubtful]
    return rows[~np.isin(np.rint(1000 * rows[:, 0]), doubtful)]


def whole(folder, write):
    """Nothing half-written gets the name of the folder."""
    if folder.exists():
        return
    part = folder.with_name(folder.name + ".part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    write(part)
    part.rename(folder)


def run(words):
    result = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise RuntimeError(result.stderr.strip() or f"{words[0]}: failed")
    return result.stdout


def floor_folder(folder, floor):
    kind, area, seed = floor
    return folder / "floors" / f"{kind}{area}_{seed}"


def of_sites(found, frames, frames_of_each):
    """The recorded and simulated scans of the sites: as they are, and with worse maps and lesser sensors.
    \\p frames of a set as it is, \\p frames_of_each of the others."""
    for site in found:
        for scans in ("test", "sim360_off", "sim360_clutter", "sim270_off"):
            if not site.has(scans):
                continue
            kind = "real" if scans == "test" else "simulated"
            files = (site.map(scans), site.folder / f"{scans}.rawlog", site.truth_file(scans))
            few = (f"frames={frames_of_each}",)
            yield Set(f"{site.name}-{scans}", kind, (site.name,), *files, (),
                      (f"frames={frames}",) if kind == "real" else few)
            if kind == "simulated" and scans != "sim360_off":
                continue
            names = MAPS if kind == "real" else ("smeared_behind", "sketch")
            for name in names:
                yield Set(f"{site.name}-{scans}-{name}", "map", (site.name,), *files, MAPS[name], few)
            names = SENSORS if kind == "real" else ("reach3.5", "cheap", "view60")
            for name in names:
                yield Set(f"{site.name}-{scans}-{name}", "sensor", (site.name,), *files, (), few + SENSORS[name])


def on_floors(folder, frames=FLOOR_SCANS, floors=len(FLOORS)):
    """Every drawn floor as it is and degraded, seen by lasers that take turns; \\p frames of each set."""
    few = (f"frames={frames}",)
    lasers, maps = itertools.cycle(LASERS.items()), itertools.cycle(MAPS.items())
    for seed, (kind, area) in enumerate(FLOORS[:floors]):
        floor = (kind, area, seed)
        at = floor_folder(folder, floor)
        files = (at / "map.yaml", at / "scans.rawlog", at / "scans_gt.txt")
        for _, (laser, words) in zip(range(4), lasers):
            yield Set(f"{at.name}-{laser}", "drawn", (at.name,), *files, (), few + words, (floor,))
        for _, (name, map_words), (laser, words) in zip(range(3), maps, lasers):
            yield Set(f"{at.name}-{laser}-{name}", "drawn", (at.name,), *files, map_words, few + words, (floor,))


def strangers(sets, frames):
    """Scans in the map of another place: each set's with the maps of some others."""
    with_truth = [s for s in sets if s.kind in ("real", "map", "drawn", "sensor")]
    for i, scans in enumerate(with_truth):
        other = with_truth[(i * 37 + len(with_truth) // 3) % len(with_truth)]
        if i % 3 or other.groups == scans.groups or are_one_building(scans.groups[0], other.groups[0]):
            continue
        yield in_map_of(scans, other, frames)


def mirrored(sets, frames):
    """Scans whose beams are in the wrong order, so that they fit no place but by chance; \\p frames of each set."""
    for scans in sets:
        if scans.kind in ("real", "simulated", "drawn") and not scans.map_words:
            words = tuple(word for word in scans.scan_words if not word.startswith("frames="))
            yield dataclasses.replace(scans, name=f"{scans.name}-mirrored", kind="mirrored", truth=None,
                                      scan_words=words + (f"frames={frames}", "mirrored=1"))


def in_map_of(scans, other, frames):
    """The scans of a set in the map of another place."""
    words = tuple(word for word in scans.scan_words if not word.startswith("frames=")) + (f"frames={frames}",)
    return Set(f"{scans.name}-in-{other.name}", "stranger", scans.groups + other.groups, other.map, scans.scans, None,
               other.map_words, words, scans.floors + other.floors)


def are_one_building(a, b):
    """mines_runs and mines_other_day, olin_mac_923 and olin_mac_final, are."""
    return a.split("_")[0] == b.split("_")[0] and a.split("_")[0] in ("mines", "olin")


def in_floors(own, folder, frames, floors):
    """A user's scans in the maps of drawn floors, which are none of his."""
    for seed, (kind, area) in enumerate(FLOORS[:floors]):
        at = floor_folder(folder, (kind, area, seed))
        yield dataclasses.replace(own, name=f"{own.name}-in-{at.name}", kind="stranger", groups=own.groups + (at.name,),
                                  map=at / "map.yaml", truth=None, scan_words=(f"frames={frames}",),
                                  floors=((kind, area, seed),))
