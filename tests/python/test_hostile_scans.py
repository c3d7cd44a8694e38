# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""experiments/hostile_scans.py, equal_places.py and the simulated laser that they use."""
import pathlib
import sys

import numpy as np
import pytest
from drawn_world import World

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "experiments"))
import equal_places  # noqa: E402
import hostile_scans  # noqa: E402
import sites  # noqa: E402
from simulated_scans import SimulatedLaser, to_segment  # noqa: E402


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sites") / "drawn"
    folder.mkdir()
    World(folder)
    return sites.Site("drawn", folder)


@pytest.fixture(scope="module")
def laser(site):
    return SimulatedLaser(site.folder / "map.yaml")


def test_places_are_in_free_space_with_clearance(laser):
    for x, y, _ in laser.places(50, np.random.default_rng(1)):
        row, column = int((y - laser.bottom) / laser.cell), int((x - laser.left) / laser.cell)
        assert laser.free[row - 5:row + 6, column].all()
        assert laser.free[row, column - 5:column + 6].all()


def test_ranges_end_at_the_wall_and_at_panes(laser):
    random = np.random.default_rng(2)
    place, angles = laser.places(1, random)[0], np.radians(np.arange(360) - 180.0)
    poses = np.tile(place, (360, 1))
    seen = laser.ranges(poses, angles, random)
    for angle, way in zip(angles[::20], seen[::20]):
        x, y = place[0] + way * np.cos(place[2] + angle), place[1] + way * np.sin(place[2] + angle)
        row, column = int((y - laser.bottom) / laser.cell), int((x - laser.left) / laser.cell)
        assert laser.occupied[row - 1:row + 2, column - 1:column + 2].any()
    ahead = np.array([np.cos(place[2]), np.sin(place[2])])
    across = 0.1 * np.array([-ahead[1], ahead[0]])
    middle = place[:2] + 0.2 * ahead
    pane = (*(middle - across), *(middle + across))
    behind = laser.ranges(poses, angles, random, [pane])
    assert abs(behind[180] - 0.2) < 0.05
    assert abs(behind[0] - seen[0]) < 0.1


def test_a_beam_that_misses_a_segment_goes_on():
    sensor = np.array([[0.0, 0.0, 0.0]])
    one, none = np.array([1.0]), np.array([0.0])
    assert to_segment(sensor, one, none, (2, -1, 2, 1))[0] == 2
    assert np.isinf(to_segment(sensor, one, none, (2, 1, 2, 3))[0])
    assert np.isinf(to_segment(sensor, one, none, (-2, -1, -2, 1))[0])


def test_clean_scans_are_right_and_every_kind_is_counted(site):
    rows = list(hostile_scans.run(site, list(hostile_scans.KINDS), 6, 1))
    assert [row[1] for row in rows] == [kind for kind in hostile_scans.KINDS for _ in range(6)]
    clean = [row for row in rows if row[1] == "clean"]
    assert sum(row[2] == "localized" for row in clean) >= 4
    assert not any(row[3] for row in clean)
    lines = hostile_scans.table_of(rows).splitlines()
    assert sum(line.startswith("| ") for line in lines) == len(hostile_scans.KINDS) + 2


def test_a_seed_gives_the_same_scans(site):
    first, again = (list(hostile_scans.run(site, ["constant"], 3, 7)) for _ in range(2))
    assert str(first) == str(again)  # nan differs from itself


def test_a_map_and_its_turned_copy_hold_each_place_twice(site, laser):
    cells = laser.map.array
    both = equal_places.with_turned_copy(cells)
    rows, columns = cells.shape
    assert (both[:rows, :columns] == cells).all()
    assert (both[::-1, ::-1][:rows, :columns] == cells).all()
    localized, ambiguous, rejected = equal_places.count_of(site, 6, 1)
    assert localized + ambiguous + rejected == 6
    assert localized == 0
    assert ambiguous >= 4
