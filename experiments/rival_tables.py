# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""The tables of other methods, as markdown; "" where there is nothing to tell."""
import math

import measures
import published
import rivals
import tables

CONVERGED = (0.2, 10)  # [m, deg] as in the paper's Section IV-B.1


def pooled(results, condition, method):
    """Frames of all sites."""
    return sum((r.frames for job, r in results.items() if isinstance(job, rivals.RivalJob) and
                (job.condition, job.method) == (condition, method)), [])


def ours(results, site, condition, method):
    """Frames of one site."""
    return sum((r.frames for job, r in results.items() if isinstance(job, rivals.RivalJob) and
                (job.site.name, job.condition, job.method) == (site, condition, method)), [])


def counted_cell(frames):
    value, text = tables.success_cell(frames)
    return value, f"{text} of {len(frames)}" if frames else text


def comparison(results):
    """Success in each condition, all sites together; time and memory."""
    if not any(isinstance(job, rivals.RivalJob) for job in results):
        return ""
    columns = {of.title: [counted_cell(pooled(results, condition, method)) for method in rivals.METHODS]
               for condition, of in rivals.CONDITIONS.items()}
    for name, of, digits in (("ms per scan", typical_time, 1), ("MB", memory, 0), ("s to prepare", preparation, 1)):
        values = [of(results, method) for method in rivals.METHODS]
        columns[name] = [(value, "-" if value is None else f"{value:,.{digits}f}") for value in values]
    less = ("ms per scan", "MB", "s to prepare")
    marked = [tables.best_marked(cells, min if name in less else max) for name, cells in columns.items()]
    rows = [[kind.title, kind.paper, *cells] for kind, *cells in zip(rivals.METHODS.values(), *marked)]
    return tables.table(
        "Rivals",
        "[%] success, in brackets the 95 % interval of Wilson, and of how many scans, evenly spread over the sets of "
        f"{', '.join(present(results))} (simulated sets: those without fr_campus); the best of each column is bold. Within 0.2 m and "
        "5 deg (real scans 0.3 m). Every rival is our implementation of the paper named, not tuned: "
        "`experiments/programs/rivals`. Those with keypoints compare with the scans that built the map (real: the first "
        "half of the run, fr_campus its even keyframes; simulated: `sim360_on`) and never look at the map, so that "
        "it does not matter to them how it is smeared. Smeared: cells of 10 cm, walls grown by 15 cm to all sides, uneven by 40 % "
        f"(`learning/degraded_maps.py`, `{' '.join(rivals.SMEARED)}`). Processor time: median of a scan; preparation and peak of "
        "memory of the whole program (VmHWM): the greatest of the sites. They are those of the real scans, those of the plain "
        "loops of clean full circles.",
        ["method", "after", *columns], rows)


def measured(results, method):
    """Its results on the real scans, or else on full circles."""
    of = {condition: [r for job, r in results.items() if isinstance(job, rivals.RivalJob) and
                      (job.condition, job.method) == (condition, method)] for condition in ("real", "clean")}
    return of["real"] or of["clean"]


def typical_time(results, method):
    """[ms]"""
    times = [f.times["total"] for r in measured(results, method) for f in r.frames]
    return measures.median(times) if times else None


def memory(results, method):
    """[MB]"""
    return max((r.memory for r in measured(results, method)), default=None)


def preparation(results, method):
    """[s]"""
    return max((r.preparation for r in measured(results, method)), default=None)


def settings(results):
    """What every rival is set to."""
    rows = [[kind.title, kind.settings] for kind in rivals.METHODS.values()]
    return tables.table(
        "Settings of the rivals", "Read in the papers and, where they are public, in the authors' programs: FLIRTlib, GFLIP, "
        "Cartographer, ROS's AMCL. None was tuned.", ["method", "settings"], rows) if results else ""


def peers(results):
    rows = []
    cells = zip(*(tables.best_marked([(peer[2 + i] and peer[2 + i][0] / peer[2 + i][1],
                                       peer[2 + i] and tables.with_interval(*peer[2 + i]) or "-") for peer in published.PEERS], max)
                  for i in range(len(published.PEER_COLUMNS))))
    for peer, row in zip(published.PEERS, cells):
        rows.append([peer[0], peer[1], *row, peer[-1]])
    return tables.table(
        "Programs of others, quoted",
        "[%] success, in brackets the 95 % interval of Wilson. They cannot be part of this project because of their licences "
        "or what they depend on; we ran them outside of it, unaltered and not tuned, one thread, when d2s1r was at commit "
        "7285166 or older. Full circles of several sites: 0.2 m and 5 deg; 60 real scans a site, `test` in map_test: 0.3 m and "
        "5 deg, on sets of the same drives as above, whose truth was computed in another way. relocalization_toolbox on 380 real "
        "scans of seven sites: 74 %, d2s1r on the same: 98 %. Time [ms] a scan of intel.",
        ["program", "settings", *published.PEER_COLUMNS, "time"], rows) if results else ""


def present(results):
    """Names of the sites on which rivals ran."""
    return [name for name in rivals.SITES if any(isinstance(job, rivals.RivalJob) and job.site.name == name for job in results)]


def by_site(results):
    """Success on real scans, site by site."""
    names = present(results)
    columns = [tables.best_marked([counted_cell(ours(results, name, "real", method)) for method in rivals.METHODS], max)
               for name in names]
    rows = [[kind.title, *cells] for kind, *cells in zip(rivals.METHODS.values(), *columns)] if names else []
    return tables.table("Rivals on the real scans of each site", "[%] success of `test` in map_test, in brackets the 95 % interval "
                        "of Wilson.", ["method", *names], rows)


def is_converged(frame):
    return frame.is_within(*CONVERGED)


def driven(drive, until):
    """[m] along the truth."""
    places = [frame.truth for frame in drive[:until + 1]]
    return sum(math.dist(a[:2], b[:2]) for a, b in zip(places, places[1:]))


def convergence(results):
    """Fig. 7."""
    rows = []
    for job, drives in results.items():
        if not isinstance(job, rivals.DriveJob):
            continue
        firsts = [next((i for i, frame in enumerate(drive) if is_converged(frame)), None) for drive in drives]
        reached = [(drive, first) for drive, first in zip(drives, firsts) if first is not None]
        last = [is_converged(drive[-1]) for drive in drives]
        rows.append([job.site.name, {"near": "0.3 m, 0.3 m, 30 deg off", "anywhere": "uniform"}[job.start],
                     f"{tables.share_of(first is not None for first in firsts)} of {len(drives)}", tables.share_of(last),
                     tables.number(measures.mean(first + 1 for _, first in reached), 1),
                     tables.number(measures.mean(driven(drive, first) for drive, first in reached), 1)])
    return tables.table(
        "Convergence of the particle filter (Fig. 7, Section IV-B.1)",
        "MRPT's filter with AMCL's settings and odometry on drives of 40 frames of run.rawlog in map.yaml, their starts "
        "evenly spread; no two drives share a frame. How many [%] came within 0.2 m and 10 deg at all, and were there at the "
        "end, in brackets the 95 % interval of Wilson; after how many scans and how far a drive [m], on average of those. "
        "Published, AMCL from such a guess: 20 of 20, in 2.0 to 11.0 s, 4.4 s on average; without a guess it fails (no "
        "figure). d2s1r needs one scan and no drive: the rows of `test` in the table of all sets.",
        ["site", "start", "reached", "at the end", "scans", "m"], rows)


def checks(results):
    """Every rival beside a figure of its paper or of others who ran it."""
    def cell(site, condition, method):
        return counted_cell(ours(results, site, condition, method))[1]

    wang = "intel off the mapping path (D_I1), Wang et al., Table IV: "
    rows = [
        ["FLIRT, bag of words", wang + "82 %", cell("intel", "clean", "bag-of-words")],
        ["geometrical FLIRT phrases", wang + "87 %; the authors' program, run by us on clean full circles of several sites: "
         f"{tables.with_interval(182, 300)} of 300", cell("intel", "clean", "phrases")],
        ["branch and bound", "Cartographer itself, run by us on 60 real scans a site: "
         f"intel {tables.with_interval(42, 60)}, fr079 {tables.with_interval(39, 60)}, mit_csail {tables.with_interval(34, 60)} "
         "(Hess et al. report loop closures, not one-shot localization)",
         ", ".join(f"{site} {cell(site, 'real', 'branch-and-bound')}" for site in ("intel", "fr079", "mit_csail"))],
        ["GLARE", "none: Himstedt et al. report precision and recall of loop closures, not poses", cell("intel", "clean", "glare")],
        ["exhaustive likelihood field", "none that we know for one scan without motion; its test is that it finds all robots on a "
         "drawn floor", cell("intel", "clean", "exhaustive")],
        ["particle filter", "stock pf-localization on MRPT's demo from a uniform start: 5 of 20 runs right with 1,000 particles, "
         "12 with 10,000, after 7 scans; ours is after one", cell("intel", "real", "filter")],
        ["published method as plain loops", wang + "93 %", cell("intel", "clean", "literal")],
        [rivals.METHODS["paper"].title, wang + "93 %", cell("intel", "clean", "paper")],
    ]
    if not any(isinstance(job, rivals.RivalJob) for job in results):
        rows = []
    return tables.table("Rivals beside published figures", "[%] success; ours with the 95 % interval of Wilson.",
                        ["rival", "published or measured by its own program", "ours"], rows)
