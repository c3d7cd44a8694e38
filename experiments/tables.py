# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""The tables of the report, as markdown; "" where there is nothing to tell."""
import math
import re

import intervals
import measures
import plan
import published
import sites

WINDOW = plan.WINDOW
TITLES = [plan.TITLES[config] for config in plan.CONFIGS]


def table(title, text, columns, rows):
    if not rows:
        return ""
    lines = [f"## {title}", "", *([text, ""] if text else [])]
    lines += ["| " + " | ".join(columns) + " |", "|" + " --- |" * len(columns)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def number(value, digits=1):
    return "-" if value is None or not math.isfinite(value) else f"{value:.{digits}f}"


def interval(frames):
    """Success [%] with its interval."""
    return share_of(f.right for f in frames)


def share_of(*drives, digits=0):
    """The share of flags that are true [%], and in brackets its 95 % interval: flags of each drive, in the order of the scans."""
    drives = [list(flags) for flags in drives]
    count = sum(map(len, drives))
    if count == 0:
        return "-"
    low, high = intervals.share_interval(drives)
    return f"{100 * sum(map(sum, drives)) / count:.1f} ({end(low, digits)}-{end(high, digits)})"


def end(percentage, digits):
    """Of an interval; with a decimal below 1 and above 99 %, for 99.6 is not 100."""
    whole = round(percentage, 6)
    return f"{percentage:.{max(digits, 1) if 0 < whole < 1 or 99 < whole < 100 else digits}f}"


def success_cell(frames):
    """For best_marked()."""
    return (measures.success(frames), interval(frames)) if frames else (None, "-")


def best_marked(cells, better):
    """Texts of [(value, text)]: the best value of them in bold; cells without a value as they are."""
    values = [value for value, _ in cells if value is not None]
    best = better(values) if len(values) > 1 else None
    return [f"**{text}**" if value is not None and value == best else text for value, text in cells]


def anchor(title):
    """Of a heading, as GitHub makes it."""
    return "#" + re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def picture(meaning, file):
    return f"![{meaning}]({file})\n\n{meaning}.\n" if file else ""


def simulated(plain):
    """(site, set) of the sets that the paper has, too: on and off the mapping path."""
    return sorted(key[:2] for key in plain if key[1] in ("sim360_on", "sim360_off") and key[2] == "paper")


def labelled(site, scans):
    name = published.NAMES.get((site, scans))
    return f"{site} {scans}" + (f" ({name})" if name else "")


def times(plain):
    rows = []
    for site, scans in (key for key in simulated(plain) if key[1] == "sim360_on"):
        paper, default = plain[site, scans, "paper"], plain[site, scans, "default"]
        known = published.TIMES.get(published.NAMES.get((site, scans)), (None,) * 3)
        ours = (measures.mean_time(paper, "retrieval"), measures.mean_time(paper, "registration") / plan.CANDIDATES,
                measures.mean_time(paper, "total"))
        all_of_it = measures.mean_time(default, "total")
        totals = best_marked([(known[2], number(known[2], 2)), (ours[2], number(ours[2], 3)),
                              (all_of_it, number(all_of_it, 2))], min)
        rows.append([labelled(site, scans), *(number(v, 2) for v in known[:2]), totals[0],
                     *(number(v, 3) for v in ours[:2]), totals[1],
                     number(measures.mean_time(default, "retrieval"), 2), totals[2]])
    return table(
        "Time per scan (Table III)",
        "[ms] on average: t1 retrieval, t2 one candidate (ours includes its virtual scan), t3 all, the best of which is bold. "
        "The paper's machine is an i7-8750H; our times are wall clock on a machine that other programs may use, too.",
        ["set", "published t1", "t2", "t3", "published method, our implementation t1", "t2", "t3", "d2s1r retrieval",
         "all"], rows + quoted(published.TIMES, 5, 2) if rows else [])


def quoted(known, empty, digits):
    """Rows of the paper's sets of which we have no counterpart: [name, values, "-" ...]."""
    return [[f"({name}, {published.AREAS[name]:,} m²)"] + [number(v, digits) for v in known[name]] + ["-"] * empty
            for name in published.OTHERS if name in known]


def average(plain):
    """Row of all sets together."""
    known = [measures.mean(column) for column in zip(*published.SUCCESS.values())]
    ours = [sum((plain[site, scans, config] for site, scans in simulated(plain)), []) for config in plan.CONFIGS]
    cells = [(value, number(value)) for value in known] + [success_cell(frames) for frames in ours]
    return ["all sets (published: mean of its six)", *best_marked(cells, max)]


def success(plain):
    rows = []
    for site, scans in simulated(plain):
        known = published.SUCCESS.get(published.NAMES.get((site, scans)), (None,) * 3)
        cells = [(v, number(v, 0)) for v in known] + [success_cell(plain[site, scans, config]) for config in plan.CONFIGS]
        rows.append([labelled(site, scans), *best_marked(cells, max)])
    return table(
        "Success (Table IV)",
        "[%] within 0.2 m and 5 deg; in brackets the 95 % interval; the best of each row is bold. The paper's "
        "95 % is the average that its abstract gives; the six figures of its Table IV have a mean of 94.3 %.",
        ["set", "published Sivic and Zisserman", "published Tipaldi et al.", "published D2S1R", *TITLES],
        rows + quoted(published.SUCCESS, 2, 0) + [average(plain)] if rows else [])


def precision(plain):
    def of(values):
        return "-" if values is None else "{:.3g} ± {:.3g} m, {:.3g} ± {:.3g} deg".format(
            values[0], values[2], values[1], values[3])

    def measured(frames):
        right = measures.successes(frames)
        if not right:
            return None
        position, yaw = [f.position_error for f in right], [f.yaw_error for f in right]
        return [round(v, 4) for v in (measures.mean(position), measures.mean(yaw), measures.deviation(position),
                                      measures.deviation(yaw))]

    def row(name, known, of_configs):
        values = [known] + [measured(frames) for frames in of_configs]
        return [name, *best_marked([(value and value[0], of(value)) for value in values], min)]

    rows = [row(labelled(site, scans), published.PRECISION.get(published.NAMES.get((site, scans))),
                [plain[site, scans, config] for config in plan.CONFIGS]) for site, scans in simulated(plain)]
    everything = [sum((plain[site, scans, config] for site, scans in simulated(plain)), []) for config in plan.CONFIGS]
    if rows:
        rows += [[f"({name}, {published.AREAS[name]:,} m²)", of(published.PRECISION[name]), "-", "-"]
                 for name in published.OTHERS]
        rows.append(row("all", published.PRECISION["All"], everything))
    return table("Precision (Table V)", "Mean and standard deviation of the errors, over the successes; the least mean error of "
                 "the position is bold.",
                 ["set", "published D2S1R", *TITLES], rows)


def precision_of(frames):
    """The share of the frames of status localized that are right, with its interval."""
    return share_of(frame.right for frame in frames if frame.status == "localized")


def circles(plain):
    """D_T: recorded full circles."""
    rows = []
    for site, scans in sorted({key[:2] for key in plain}):
        if scans != "test" or site not in sites.FULL_CIRCLES:
            continue
        cells = [success_cell(plain[site, scans, config]) for config in plan.CONFIGS]
        strict = [share_of(f.is_within(0.2, 5) for f in plain[site, scans, config]) for config in plan.CONFIGS]
        rows.append([site, str(len(plain[site, scans, "default"])), "-", *best_marked(cells, max), *strict])
    if rows:
        rows.append(["(D_T, 1,140 m²)", "1429", "89", "-", "-", "-", "-"])
    return table(
        "Real full circles (D_T, Section IV-B.5)",
        "[%] success of recorded scans of 360 deg, in brackets the 95 % interval. The paper's own scans (30 m) are in "
        "a map that was made of them; ours (`test`, an RPLIDAR of 12 m on a TurtleBot 4) are in maps of the same floor that "
        "others drew at other times, and the published method has the range of that laser and takes lost beams as it is best for it. "
        "Our truth is a registration, good to 0.1 m and 1 to 2 deg, so that 0.2 m is strict.",
        ["site", "scans", "published D2S1R, 0.2 m", *(f"{title}, 0.3 m" for title in TITLES),
         *(f"{title}, 0.2 m" for title in TITLES)], rows)


def statuses(plain):
    rows = []
    for site, scans in sorted({key[:2] for key in plain}):
        default = plain[site, scans, "default"]
        cells = best_marked([success_cell(plain[site, scans, config]) for config in plan.CONFIGS], max)
        here = [frame for frame in default if frame.in_map]
        there = [str(len(here)), interval(here), precision_of(here)] if len(here) < len(default) else ["-"] * 3
        rows.append([site, scans, str(len(default)), *cells, precision_of(default), recall(default), *there])
    return table(
        "Success and status, all sets",
        "[%] in brackets the 95 % interval; the better success is bold. Precision: right frames among those of "
        "status `localized`; recall: right frames of that status among all. The published method has no such status, and "
        "needs full circles: with 180 or 270 deg the paper has the robot turn in place first (Section III-C). In the map: the scans "
        "half of whose returns lie on walls of the map at the truth, where they are fewer.",
        ["site", "set", "scans", f"success, {TITLES[0]}", f"success, {TITLES[1]}", "precision, d2s1r", "recall, d2s1r",
         "in the map", "success there", "precision there"], rows)


def recall(frames):
    return share_of(f.right and f.status == "localized" for f in frames)


def windows(runs):
    rows = []
    for job, frames in runs:
        settled = frames[WINDOW - 1:]
        rows.append([job.site.name, str(len(settled)), interval(settled), precision_of(settled), recall(settled)])
    return table(
        f"{WINDOW} scans together",
        f"[%] `--window {WINDOW}` on consecutive frames of run.rawlog in map.yaml, from the {WINDOW}th frame on: within 0.3 m "
        "and 5 deg. These maps were built from the same runs, which makes it easier than for `test`. In brackets the 95 % "
        "interval.",
        ["site", "frames", "success", "precision", "recall"], rows)


def reliability(plain):
    """Of each site's recorded scans, and of all simulated ones together."""
    of_default = [(site, scans, frames) for (site, scans, config), frames in sorted(plain.items()) if config == "default"]
    sets = [(f"{site} {scans}", frames) for site, scans, frames in of_default if scans == "test"]
    sets.append(("all simulated", sum((frames for _, scans, frames in of_default if scans in sites.SIMULATED), [])))
    rows = [[name, str(sum(map(len, measures.confidence_bins(frames)))), number(measures.calibration_error(frames), 3)]
            for name, frames in sets if frames]
    return table("Reliability", "Expected calibration error of the confidence, ten bins, over the frames with a pose.",
                 ["set", "frames with a pose", "error"], rows)


def confidences(plain):
    """Right poses of all poses by confidence."""
    kinds = {"simulated": sites.SIMULATED, "recorded": ("test",)}
    rows = []
    for name, scans in kinds.items():
        frames = sum((f for key, f in plain.items() if key[1] in scans and key[2] == "default"), [])
        bins = measures.confidence_bins(frames)
        if frames:
            rows.append([name] + [f"{sum(f.right for f in part)} of {len(part)}" if part else "-" for part in bins])
    tenths = [f"{i / measures.BINS:.1f}-{(i + 1) / measures.BINS:.1f}" for i in range(measures.BINS)]
    return table("Right poses by confidence", "How many of the poses told with a confidence in each tenth are right.",
                 ["scans", *tenths], rows)


def strangers(results):
    pairs = {(job.map_site.name, job.site.name): frames for job, frames in results.items() if job.map_site}
    told = {pair: [frame.status == "localized" for frame in frames] for pair, frames in pairs.items()}
    in_map = [[frame.status == "localized" for frame in frames if frame.in_map] for frames in pairs.values()]

    def counted(drives):
        return f"{sum(map(sum, drives))} of {sum(map(len, drives)):,}, {share_of(*drives, digits=1)}"
    rows = []
    for name in sorted({name for name, _ in told}):
        others = {other: flags for (map_name, other), flags in told.items() if map_name == name}
        most = max(others, key=lambda other: measures.mean(map(float, others[other])))
        rows.append([name, f"{sum(map(len, others.values())):,}", share_of(*others.values(), digits=1), f"{share_of(others[most])} of {most}"])
    return table("Scans of another site", "[%] Share of `test` scans of all other sites in this table that get the status `localized`, all of "
                 "them wrongly, in the map of the site in the row, in brackets the 95 % interval; and that of the site of which it is most. Over all "
                 f"pairs: {counted(told.values())}; of the scans whose place is in the map of their own site: {counted(in_map)}.",
                 ["map", "scans", "localized", "most"], rows)


def curves(title, results, field, meaning):
    """A row per site, set and method; a column per value of `field`. The method is not told if there is but one."""
    lines = points(results, field)
    values = sorted({value for line in lines.values() for value in line})
    rows = []
    for site, scans in sorted({key[:2] for key in lines}):
        configs = [config for config in plan.CONFIGS if (site, scans, config) in lines]
        columns = [best_marked([success_cell(lines[site, scans, config].get(value)) for config in configs], max)
                   for value in values]
        rows += [[f"{site} {scans}", plan.TITLES[config], *cells] for config, *cells in zip(configs, *columns)]
    heads = ["set", "method"]
    if len({row[1] for row in rows}) == 1:
        heads, rows = heads[:1], [[row[0], *row[2:]] for row in rows]
    scale, unit = {"field_of_view": (1, "deg"), "blocked": (100, "%"), "reach": (1, "m")}[field]
    columns = [f"{scale * value:g} {unit}" for value in values]
    return table(title, f"[%] success{' of d2s1r' if len(heads) == 1 else ''}, in brackets the 95 % interval; columns: {meaning}. "
                 "Recorded scans: those whose place is in the map.",
                 [*heads, *columns], rows)


def points(results, field):
    """{(site, set, method): {value of `field`: frames}} of the runs in which only `field` varies."""
    fewest = min((job.frames for job in results if not job.map_site and not job.window), default=0)
    lines = {}
    for job, frames in results.items():
        others = all(getattr(job, name) == value for name, value in plan.USUAL.items() if name != field)
        if job.window or job.map_site or not others or job.frames != fewest or job.in_map != (job.scans == "test"):
            continue
        if field == "field_of_view" and job.field_of_view > job.widest + plan.WHOLE:
            continue
        line = lines.setdefault((job.site.name, job.scans, job.config), {})
        line[getattr(job, field)] = frames
    return {key: line for key, line in lines.items() if len(line) > 1}
