# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""README.md: tables and figures."""
import datetime
import os
import pathlib
import subprocess

import plan
import published
import rivals
import tables

INTRODUCTION = """# Results

{version}, commit {commit}, {date}: `share/d2s1r/experiments/reproduce.py --frames {frames} --sweep-frames {sweep}
--rival-frames {rivals}{no_maps}`, {minutes:.0f} minutes, {jobs} single-threaded programs at a time on {machine}, {cores} cores. At
most {frames} scans per set, {sweep} per point of a curve and {rivals} per set for the rivals, evenly spread over the set.

The published method is `config/paper.ini`, our implementation of it; d2s1r is `config/default.ini`. Its parameters were
learned on intel, fr079, mit_csail, mit_killian, fr_campus and generated buildings; `learn.py` writes the figures of each
site left out in turn. Sets of a site: `sim360_on` simulated on the mapping path, full circle; `sim360_off` anywhere
reachable; `sim360_clutter` with people in the view; `sim270_off` with a field of view of 270 deg; `test` real scans of
180 deg (mines: 240 deg; olin: 360 deg), in a map that was built without them. A success is a best pose within 0.2 m and
5 deg of the truth (real scans: 0.3 m), whatever its status; success rates are over all scans.

The paper's numbers are for other scans: 3,697 to 16,465 per set, simulated in its own maps; those off the mapping path
are on another path, while ours are anywhere reachable (noise 0.01 m). Its D_I is the Intel laboratory, like our intel.
Its D_M (the MIT Stata Center) and D_G are not among our sites and have rows of their own; mit_killian, of 3,750 m², is
of the size of D_M. Curves of field of view and clutter show single scans; the paper has a robot with a narrow sensor
turn in place first.
"""

NO_MAPS = """Figures with maps show only those whose licences allow it; without `--no-maps` they show the paper's buildings.
"""


def machine():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return "an unknown machine"


def commit():
    """Of the sources, with `-dirty` if they were changed since."""
    words = ["git", "-C", str(pathlib.Path(__file__).parent), "describe", "--always", "--dirty"]
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def peers():
    return tables.table(
        "Programs of others, quoted",
        "Run by us outside of this project, which cannot include them; on the same maps, one thread, not tuned; success [%] within 0.3 m and "
        "5 deg on real scans (`test` on map_test, 60 a site), within 0.2 m and 5 deg on simulated ones of several sites; time a scan [ms]. "
        "d2s1r on the 380 scans: 98 %.",
        ["program", "settings", "scans", "success", "time"], [list(peer) for peer in published.PEERS])


def frames_of(results, **wanted):
    """[(job, frames)] of plain runs, or of those with the given fields."""
    fields = {**plan.USUAL, "window": 0, "map_site": None, **wanted}
    found = {}
    for job, frames in results.items():
        if all(getattr(job, name) == value for name, value in fields.items()):
            known = found.get((job.site, job.scans, job.config))
            if known is None or job.frames > known[0].frames:  # rather the whole set than the part for curves
                found[job.site, job.scans, job.config] = (job, frames)
    return list(found.values())


def write(results, others, figures, arguments, version, seconds):
    """\\p others: results of rivals.py"""
    plain = {(job.site.name, job.scans, job.config): frames for job, frames in frames_of(results)}
    parts = [
        INTRODUCTION.format(
            version=version.splitlines()[0], commit=commit(), cores=os.cpu_count(), rivals=arguments.rival_frames, date=datetime.date.today().isoformat(), minutes=seconds / 60, jobs=arguments.jobs,
            machine=machine(), frames=arguments.frames, sweep=arguments.sweep_frames,
            no_maps=" --no-maps" if arguments.no_maps else ""),
        rivals.comparison(others), rivals.by_site(others), peers() if others else "", rivals.checks(others),
        rivals.convergence(others), tables.times(plain), tables.success(plain), tables.precision(plain),
        tables.picture("Errors of the successes, as in the paper's Fig. 2: position in white, yaw in grey, "
                       "logarithmic scales", figures["errors"]),
        tables.picture("Where scans were localized, as in the paper's Fig. 3, and, as in its Fig. 4, where failures were "
                       "taken to be: a line from the true place to the answer", figures["maps"]),
        NO_MAPS if arguments.no_maps else "",
        tables.statuses(plain), tables.windows(frames_of(results, window=tables.WINDOW)),
        tables.reliability(plain), tables.confidences(plain),
        tables.picture("Reliability: the share of right poses in each tenth of the confidence, and the number of frames",
                       figures["reliability"]),
        tables.strangers(results),
        tables.curves("Field of view", results, "field_of_view", "field of view"),
        tables.picture("Success against field of view", figures["field_of_view"]),
        tables.curves("Clutter", results, "blocked", "share of the view blocked by things 0.4 to 2 m away"),
        tables.picture("Success against clutter", figures["blocked"]),
        tables.curves("Reach", results, "reach", "how far the sensor sees; beyond, it reports nothing. 30 m: as recorded"),
    ]
    (arguments.output / "README.md").write_text("\n".join(part for part in parts if part))
