#!/usr/bin/python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Draws what d2s1r-live publishes on /d2s1r/markers: draw_markers.py BUILD MAP.yaml OUT.png

A simulated robot drives through the map for 20 s. The picture shows the markers with the most hypotheses, the last of these.
BUILD is the folder of a build.
"""
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True  # the folder is part of the sources
sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "experiments"))
import needs  # noqa: E402
try:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np
    from PIL import Image
except ImportError as error:
    needs.stop(error, "python3-matplotlib, python3-numpy and python3-pil")
import sites  # noqa: E402

DOMAIN, SECONDS = "96", "20"
ARROW, POINTS, TEXT = 0, 8, 9  # types of visualization_msgs/Marker


def markers_of_a_drive(build, site_map):
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "markers.json"
        with subprocess.Popen([build / "apps/d2s1r-live/d2s1r-live", "--seed", "watch", "--domain", DOMAIN, "--quiet"]) as live:
            subprocess.run([build / "apps/d2s1r-live-drive/d2s1r-live-drive", site_map, SECONDS, file], check=True,
                           env=dict(os.environ, ROS_DOMAIN_ID=DOMAIN))
            live.terminate()
        return json.loads(file.read_text())


def draw(markers, site_map, out):
    picture, extent_of, _ = sites.map_image(site_map)
    grey = np.asarray(Image.open(picture).convert("L"))
    figure, axes = plt.subplots(figsize=(8, 8 * grey.shape[0] / grey.shape[1]), dpi=110)
    axes.imshow(grey, cmap="gray", vmin=-150, vmax=255, extent=extent_of(*grey.shape), interpolation="nearest")
    for marker in markers:
        x, y, yaw, color = marker["x"], marker["y"], marker["yaw"], marker["color"]
        if marker["type"] == ARROW and marker["length"] > 0:
            axes.arrow(x, y, marker["length"] * math.cos(yaw), marker["length"] * math.sin(yaw), width=0.1, color=color,
                       length_includes_head=True, zorder=3)
        elif marker["type"] == POINTS:
            axes.scatter(*np.array(marker["points"]).T, s=3, color=color[:3], zorder=2)
        elif marker["type"] == TEXT:
            axes.annotate(marker["text"], (x, y), (4, 4), textcoords="offset points", fontsize=9, zorder=4)
    axes.set_xlabel("x [m], map")
    axes.set_ylabel("y [m], map")
    figure.tight_layout()
    figure.savefig(out)


def main():
    build, site_map = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    draw(markers_of_a_drive(build, site_map), site_map, sys.argv[3])


if __name__ == "__main__":
    main()
