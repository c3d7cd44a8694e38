# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""README.md: tables and figures."""
import datetime

import circles
import particle_filter
import plan
import rays
import sites
import tables

INTRODUCTION = """# Results

{version}, measured at commit {commits} on {machines}; this page was written on {date} by
`experiments/reproduce.py --frames {frames} --sweep-frames {sweep} --drives {drives}{no_maps}`.

{stamp}

{jobs} runs took {minutes:.0f} minutes of processor time, the sum over all programs, each on one thread: half of that on two
cores that do nothing else. At most {frames} scans per set, {sweep} per point of a curve and per pair of sites, evenly spread over the
set. Other methods on the same scans, and the published method at its best: [comparison](comparison/README.md).

`make_sites` makes the folders of thirteen sites from public logs, so that you can repeat their rows
([how](../README.md#the-recorded-sites)). Mines and olin are other recordings, and willow, warehouse and stata public maps.

The published method is `config/paper.ini`, our implementation of it; d2s1r is `config/default.ini`. The weights of d2s1r
were learned on other sets of the same drives, and on generated buildings, but not on mines, olin and these eight: {more}.
Mines and olin were looked at when other parameters were chosen; the eight were not. {left_out}

Sets of a site: `sim360_on` simulated on the mapping path, full circle; `sim360_off` anywhere reachable; `sim360_clutter` with people
in the view; `sim270_off` with a field of view of 270 deg; `test` recorded scans of 180 deg (mines: 240 deg; olin: 360 deg), in
a map that was built without them. On recorded scans the published method has the range and the reading of lost beams that
are best for it, chosen on these very scans, and everywhere Table II's k = 10; with k = 200 it finds more
([comparison](comparison/README.md)). A success is a best pose within 0.2 m and 5 deg of the truth (recorded scans:
0.3 m), whatever its status; success rates are over all scans but those whose truth the log itself contradicts. Clean simulated
scans are of the very map in which they are looked for: success near 100 % there says little.

The paper's numbers are for other scans: 3,697 to 16,465 per set, simulated in its own maps; those off the mapping path
are on another path, while ours are anywhere reachable (noise 0.01 m). Its D_I is the Intel laboratory, like our intel.
Its D_M (the MIT Stata Center, 3,853 m²) and D_G are not among our sites and have rows of their own; mit_killian, of
3,750 m², is of their size.
"""

LEFT_OUT = "What it reaches on each of them if it is learned without it: [learned](learned/README.md)."
NOT_LEFT_OUT = "`learn.py` writes the figures of each site left out in turn."

NO_MAPS = """Figures with maps show only those whose licences allow it; without `--no-maps` they show the paper's buildings.
"""

CURVES = """Every point is a single scan. The paper has a robot with a narrow sensor turn in place first; that is the table
of the narrow sensor that turns.
"""

CALIBRATION = "Reliability: the share of right poses in each tenth of the confidence, and the number of frames"


def link(title):
    return f"[{title}]({tables.anchor(title)})"


def paper_index(shown):
    """Where each of the paper's experiments has its counterpart; `shown`: text of the page."""
    where = (
        ("Table III, run time", "Time per scan (Table III)"), ("Table IV, success, and the average of 95 %", "Success (Table IV)"),
        ("Table V, precision", "Precision (Table V)"), ("Fig. 2, errors", "Precision (Table V)"),
        ("Fig. 3, places of success, and Fig. 4, failures", "Where scans were localized (Figs. 3 and 4)"),
        ("Figs. 5 and 6, D_T, real scans, 89 %", "Real full circles (D_T, Section IV-B.5)"),
        ("Section IV-B.1 and Fig. 7, AMCL", "Convergence of the particle filter (Fig. 7, Section IV-B.1)"),
        ("Fig. 8, corridors with AMCL", "Corridors: each scan alone and fused (Fig. 8, Section IV-B.6)"),
        ("Section III-C, a narrow sensor that turns in place", "A narrow sensor that turns in place (Section III-C)"),
    )
    rows = [[what, link(title) if f"## {title}\n" in shown else "not on this page: its data are missing"] for what, title in where]
    rows += [
        ["D_M and D_G, the buildings", "quoted only, in rows of their own: their maps are not among our sites"],
        ["Its rivals, Tables III and IV", "[comparison](comparison/README.md)"],
        ["Fig. 7b, particles on the map as they gather",
         "no counterpart: one picture of a scan and a drive that the paper does not tell; the table counts how many drives converge instead"],
        ["Stage, the simulator", "not used: rays are followed exactly from grid line to grid line, noise 0.01 m"],
        ["Figs. 3 and 4 in the paper's buildings", "left out with `--no-maps`: the licence of the Intel map is unknown"]]
    return tables.table("The paper's experiments", "Wang, Zhang, Zhao and Zhang, IEEE Sensors Journal 21(10), 2021.",
                        ["in the paper", "here"], rows)


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


def of_kind(values, kind):
    return {job: value for job, value in values.items() if isinstance(job, kind)}


def sections(values, figures, no_maps):
    """Texts of the page after its introduction."""
    results = of_kind(values, plan.Job)
    plain = {(job.site.name, job.scans, job.config): frames for job, frames in frames_of(results)}
    maps = "## Where scans were localized (Figs. 3 and 4)\n\n" + tables.picture(
        "True places of the scans, as in the paper's Fig. 3, and, as in its Fig. 4, where failures were taken to be: a line from "
        "the true place to the answer", figures["maps"]) if figures["maps"] else ""
    return [
        tables.times(plain), tables.success(plain), tables.precision(plain),
        tables.picture("Errors of the successes, as in the paper's Fig. 2: position in white, yaw in grey, "
                       "logarithmic scales", figures["errors"]),
        maps, NO_MAPS if no_maps else "", tables.circles(plain), particle_filter.convergence(values), circles.following(values),
        tables.statuses(plain), tables.windows(frames_of(results, window=tables.WINDOW)),
        tables.reliability(plain), tables.confidences(plain), tables.picture(CALIBRATION, figures["reliability"]),
        tables.strangers(results),
        tables.curves("Field of view", results, "field_of_view", "field of view"),
        tables.picture("Success against field of view", figures["field_of_view"]), CURVES if figures["field_of_view"] else "",
        circles.turning(values),
        tables.curves("Clutter", results, "blocked", "share of the view of a single scan blocked by things 0.4 to 2 m away"),
        tables.picture("Success against clutter", figures["blocked"]),
        tables.curves("Reach", results, "reach", "how far the sensor sees; beyond, it reports nothing. 30 m: as recorded"),
        rays.costs(of_kind(values, rays.RayJob)),
    ]


def write(results, figures, arguments, version, stamp):
    """\\p results: {job: runs.Result}"""
    parts = [part for part in sections({job: result.value for job, result in results.items()}, figures, arguments.no_maps) if part]
    introduction = INTRODUCTION.format(
        version=version.splitlines()[0], commits=told({result.commit for result in results.values()}),
        machines=told({result.machine for result in results.values()}), date=datetime.date.today().isoformat(),
        jobs=len(results), minutes=sum(result.seconds for result in results.values()) / 60, frames=arguments.frames,
        sweep=arguments.sweep_frames, drives=arguments.drives, stamp=stamp, more=", ".join(sites.MORE), no_maps=" --no-maps" if arguments.no_maps else "",
        left_out=LEFT_OUT if (arguments.output / "learned/README.md").exists() else NOT_LEFT_OUT)
    (arguments.output / "README.md").write_text("\n".join([introduction, paper_index("\n".join(parts)), *parts]))


def told(words):
    return " and ".join(sorted(words))
