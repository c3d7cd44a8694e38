# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""README.md: tables and figures."""
import datetime
import pathlib

import plan
import tables

INTRODUCTION = """# Results

{version}, {date}: `share/d2s1r/experiments/reproduce.py --frames {frames} --sweep-frames {sweep}{no_maps}`, {minutes:.0f} minutes, {jobs}
single-threaded programs at a time on {machine}. At most {frames} scans per set, and {sweep} per point of a curve,
evenly spread over the set.

`paper` is `config/paper.ini`, the published method; `default` is `config/default.ini`. Sets of a site: `sim360_on`
simulated on the mapping path, full circle; `sim360_off` anywhere reachable; `sim360_clutter` with people in the view;
`sim270_off` with a field of view of 270 deg; `test` real scans of 180 deg, in a map that was built without them. A
success is a best pose within 0.2 m and 5 deg of the truth (real scans: 0.3 m), whatever its status; success rates are
over all scans.

The paper's numbers are for other scans: 3,697 to 16,465 per set, simulated in its own maps; those off the mapping path
are on another path, while ours are anywhere reachable (noise 0.01 m). Its D_I is the Intel laboratory, like our intel;
its D_M, of 3,853 m2, stands beside our mit_killian, of 3,750 m2: both are at MIT, but the paper cites the Stata Center.
Its D_G is not among our sites. Not reproduced: the other methods of Table IV (quoted as published), Fig. 4, the
convergence of AMCL (Section IV-B.1) and D_T, real scans of a full circle. The counterpart of Fig. 8 is in
`tests/experiments/RESULTS.md`.
"""

NO_MAPS = """The counterpart of the paper's Fig. 3 (where scans were localized) is left out because it shows the maps;
without `--no-maps` it is written, too.
"""


def machine():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return "an unknown machine"


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


def write(results, figures, arguments, version, seconds):
    plain = {(job.site.name, job.scans, job.config): frames for job, frames in frames_of(results)}
    parts = [
        INTRODUCTION.format(
            version=version, date=datetime.date.today().isoformat(), minutes=seconds / 60, jobs=arguments.jobs,
            machine=machine(), frames=arguments.frames, sweep=arguments.sweep_frames,
            no_maps=" --no-maps" if arguments.no_maps else ""),
        tables.times(plain), tables.success(plain), tables.precision(plain),
        tables.picture("Errors of the successes, as in the paper's Fig. 2: position in white, yaw in grey; the scales "
                       "of the two panels differ", figures["errors"]),
        tables.picture("Where scans were localized, as in the paper's Fig. 3", figures["maps"]),
        NO_MAPS if arguments.no_maps else "",
        tables.statuses(plain), tables.windows(frames_of(results, window=tables.WINDOW)),
        tables.reliability(plain),
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
