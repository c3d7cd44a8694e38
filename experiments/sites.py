# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""The sites, their maps, sets of scans and true poses."""
import dataclasses
import os
import pathlib
import re
import sys

FULL_CIRCLES = ("olin_mac_923", "olin_mac_final")  # whose real scans are full circles
MORE = ("acapulco", "aces", "belgioioso", "edmonton", "fhw", "fr101", "orebro", "seattle")  # nothing was learned on them
AGAIN = ("mines_other_day", "olin_mac_final")  # another day or map of a building that is there already
SIMULATED = ("sim360_on", "sim360_off", "sim360_clutter", "sim270_off")


@dataclasses.dataclass(frozen=True)
class Site:
    name: str
    folder: pathlib.Path

    def map(self, scans):
        """Real scans are localized in a map that has never seen them."""
        tested = self.folder / "map_test.yaml"
        return tested if scans == "test" and tested.exists() else self.folder / "map.yaml"

    def has(self, scans):
        return (self.folder / f"{scans}.rawlog").exists() and self.truth_file(scans).exists()

    def truth_file(self, scans):
        return self.folder / f"{scans}_gt.txt"

    def truth(self, scans):
        """{time in ms: (x, y, phi)}, m and rad, robot in map."""
        poses = {}
        for line in self.truth_file(scans).read_text().splitlines():
            if line.strip() and line[0] not in "%#":
                stamp, x, y, phi = (float(word) for word in line.split()[:4])
                poses[round(stamp * 1000)] = (x, y, phi)
        return poses


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
    """File of the picture of a map_server map, and its extent (left, right, bottom, top) per pixel count, m."""
    text = yaml.read_text()
    image = re.search(r"^image:\s*(\S+)", text, re.M).group(1)
    resolution = float(re.search(r"^resolution:\s*(\S+)", text, re.M).group(1))
    left, bottom = (float(v) for v in re.search(r"^origin:\s*\[([^\]]*)\]", text, re.M).group(1).split(",")[:2])
    return yaml.parent / image, lambda rows, columns: (
        left, left + columns * resolution, bottom, bottom + rows * resolution)
