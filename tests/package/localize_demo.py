# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""The installed Python module localizes the scans of MRPT's demo as the program does.
Usage: localize_demo.py MAP SCANS FRAMES, where print_scans wrote SCANS and rawlog-localize FRAMES, from the same log."""
import csv
import sys

import d2s1r
import numpy as np

localizer = d2s1r.Localizer(d2s1r.Map.load(sys.argv[1]))
frames = list(csv.DictReader(open(sys.argv[3])))
scans = list(open(sys.argv[2]))
assert len(frames) == len(scans) == 37, (len(frames), len(scans))
for frame, scan in zip(frames, scans):
    first_angle, step, max_range, *numbers = map(float, scan.split())
    result = localizer.localize(np.array(numbers[6:]), first_angle, step, max_range, numbers[:6])
    assert result.status == frame["status"] == "localized", frame
    assert [f"{value:.6f}" for value in result.pose] == [frame["x"], frame["y"], frame["phi"]], (result, frame)
print(f"{len(frames)} scans localized as by the program, the last at {result.pose}")
