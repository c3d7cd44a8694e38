# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""What compare.py writes: a page with tables and pictures, CSV, LaTeX and BibTeX."""
import csv
import math
import pathlib
import re

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402, the back-end comes first
import numpy as np  # noqa: E402, matplotlib needs it, too
from matplotlib.transforms import Affine2D  # noqa: E402

import fingerprint  # noqa: E402
import intervals  # noqa: E402
import measures  # noqa: E402
import methods  # noqa: E402
import plan  # noqa: E402
import sites  # noqa: E402
import tables  # noqa: E402

BOUNDS = [0.02 * 1.1 ** i for i in range(50)]  # [m] of the picture of success
MARKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2)  # [m] beside its axis
YAW = 5  # [deg] greatest error of a success
UNKNOWN = 205  # grey of cells that a map does not know
COLUMNS = ("site", "subset", "method", "scans", "success", "success_low", "success_high", "better_by", "better_by_low",
           "better_by_high", "recall", "precision", "precision_low", "precision_high", "position_error_mean_m",
           "position_error_median_m", "yaw_error_mean_deg", "ms_median", "ms_mean", "memory_mb", "preparation_s")
OF_TIME = ("ms_median", "ms_mean", "preparation_s")
HOW = """In brackets: 95 % intervals. Scans of a drive succeed and fail together, so that whole groups of failures are drawn, not
scans; `intervals.py` says how, and shows how often such intervals hold the truth. Better by: how much more [percentage points]
of the method's own scans d2s1r gets right, with the interval of the paired differences. Precision: right answers among those
that the method is sure of (status `localized`); recall: these among all scans. Errors are of the successes. MB:
memory, the peak of the program (VmHWM).
"""
TIMES = """Times are processor times of one thread; the preparation is what comes before the first scan.
"""
LEARNED = ("The weights of d2s1r were learned on other sets of the drives " + ", ".join(sites.LEARNED[:-1]) + f" and {sites.LEARNED[-1]}. "
           "Its other parameters were chosen while mines and olin were looked at.")
NARROW = ("The published method needs full circles. On {}, where a scan shows less, the paper would have the robot turn in place first "
          "(Section III-C).")
REFINED = "The truth of {} was refined by d2s1r itself, which flatters the mean errors of d2s1r."
REGISTERED = "The truth of {} is a registration, good to 0.1 m and 1 to 2°."
TURNED = "Some true headings of {} are 5 to 7° off."


def grey(picture, yaml):
    """Cells of a map_server map, rows from the top: 0 occupied, 205 unknown, 254 free."""
    text, pixels = yaml.read_text(), plt.imread(picture)
    if pixels.ndim == 3:
        pixels = pixels[:, :, :3].mean(axis=2)
    dark = 1 - pixels / (255 if pixels.dtype == np.uint8 else 1)

    def value(name, otherwise):
        found = re.search(rf"^{name}:\s*(\S+)", text, re.M)
        return float(found.group(1)) if found else otherwise
    if value("negate", 0):
        dark = 1 - dark
    return np.where(dark > value("occupied_thresh", 0.65), 0, np.where(dark < value("free_thresh", 0.196), 254, UNKNOWN)).astype(np.uint8)


def kind_of(name):
    return methods.METHODS.get(name) or methods.PEERS[name]


def title_of(name):
    return kind_of(name).title


class Comparison:
    """Answers by site and method."""

    def __init__(self, results):
        """The argument: {compare.Job: runs.Result}"""
        self.answers = {(job.site.name, job.method): result.value for job, result in results.items()}
        self.readings = {(job.site.name, job.method): job.reading for job in results if job.reading}
        self.cases = {job.site.name: job.site for job in results}
        self.methods = list(dict.fromkeys(job.method for job in results))

    def subsets(self, site):
        """{name: whether a frame belongs to it}"""
        knows = any(not frame.in_map for frame in self.answers[site, methods.DEFAULT].frames)
        return {"all": lambda frame: True, **({"in the map": lambda frame: frame.in_map} if knows else {})}

    def frames(self, site, method, wanted):
        return sorted((frame for frame in self.answers[site, method].frames if wanted(frame)), key=lambda frame: frame.stamp)

    def row(self, of_sites, subset, method):
        """Of sites together: the values of COLUMNS."""
        drives = [self.frames(site, method, self.subsets(site).get(subset, lambda frame: True)) for site in of_sites
                  if (site, method) in self.answers]
        ours = [{frame.stamp: frame.right for frame in self.answers[site, methods.DEFAULT].frames} for site in of_sites
                if (site, method) in self.answers]
        frames = [frame for drive in drives for frame in drive]
        if not frames:
            return None
        right = measures.successes(frames)
        sure = [[frame.right for frame in drive if frame.status == "localized"] for drive in drives]
        better = intervals.difference_interval([[mine[frame.stamp] - frame.right for frame in drive if frame.stamp in mine]
                                                for drive, mine in zip(drives, ours)]) if method != methods.DEFAULT else (math.nan,) * 3
        answers = [self.answers[site, method] for site in of_sites if (site, method) in self.answers]
        times = [frame.times["total"] for frame in frames]
        values = [" + ".join(of_sites), subset, method, len(frames), measures.success(frames),
                  *intervals.share_interval([[frame.right for frame in drive] for drive in drives]), *better,
                  measures.recall(frames) if kind_of(method).doubts else math.nan,
                  *((measures.precision(frames), *intervals.share_interval(sure)) if kind_of(method).doubts else (math.nan,) * 3),
                  measures.mean(frame.position_error for frame in right), measures.median(frame.position_error for frame in right),
                  measures.mean(frame.yaw_error for frame in right), measures.median(times), measures.mean(times),
                  max(answer.memory for answer in answers), max(answer.preparation for answer in answers)]
        return dict(zip(COLUMNS, values))

    def rows(self):
        groups = [(site,) for site in self.cases] + ([tuple(self.cases)] if len(self.cases) > 1 else [])
        for group in groups:
            subsets = set.union(*(set(self.subsets(site)) for site in group))
            for subset in ("all", "in the map"):
                for method in self.methods if subset in subsets else ():
                    row = self.row(group, subset, method)
                    if row:
                        yield row


def percent(row, name):
    if not math.isfinite(row[name]):
        return "-"
    return f"{row[name]:.1f} ({row[name + '_low']:.1f} to {row[name + '_high']:.1f})"


HEADINGS = ("method", "scans", "success [%]", "d2s1r is better by", "recall [%]", "precision [%]", "mean error", "MB", "ms: median, mean",
            "s to prepare")


def cells(row):
    return [title_of(row["method"]), str(row["scans"]), percent(row, "success"), percent(row, "better_by"),
            tables.number(row["recall"]), percent(row, "precision"),
            f"{row['position_error_mean_m']:.3f} m, {row['yaw_error_mean_deg']:.2f}°" if math.isfinite(row["position_error_mean_m"]) else "-",
            f"{row['memory_mb']:.0f}", f"{row['ms_median']:.1f}, {row['ms_mean']:.1f}", f"{row['preparation_s']:.2f}"]


def best_published(rows):
    """Of the rows of a table, that of the published method which gets most right; None if it was not run."""
    return max((row for row in rows if row["method"] in methods.PUBLISHED), key=lambda row: row["success"], default=None)


def result_tables(rows, columns):
    """Tables with the first `columns` of HEADINGS."""
    texts = []
    for key in dict.fromkeys((row["site"], row["subset"]) for row in rows):
        of = [row for row in rows if (row["site"], row["subset"]) == key]
        published = best_published(of)
        text = (f"d2s1r against the best of the published method ({title_of(published['method'])}): "
                f"{percent(published, 'better_by')} points." if published else "")
        texts.append(tables.table(f"{key[0]}, {'all scans' if key[1] == 'all' else 'scans whose place is in the map'}", text, HEADINGS[:columns],
                                  [cells(row)[:columns] for row in of]))
    return texts


def settings(comparison):
    rows = []
    for name in comparison.methods:
        kind = kind_of(name)
        read = "; ".join(f"{site}: {reading}" for (site, method), reading in comparison.readings.items() if method == name)
        rows.append([kind.title, kind.settings + (f"; {read}" if read else ""), kind.source, ", ".join(f"`{key}`" for key in kind.cited)])
    return tables.table("Settings", "And where they come from; the keys are those of references.bib. Methods other than d2s1r and "
                        "peers are our implementations of the papers, `experiments/programs/rivals`.",
                        ["method", "settings", "from", "cited"], rows)


def data(comparison, results):
    rows = []
    for job, result in results.items():
        if job.method != methods.DEFAULT:
            continue
        case, facts = job.site, result.value.facts
        rows.append([case.name, case.map_file.name, case.log.name, case.truth_of.name, str(facts["scans"]), str(case.contradicted),
                     f"{facts['field_of_view']:.0f}°", f"{facts['max_range']:g} m; {facts['longest']:g} m"])
    return tables.table("Data", "Scans whose truth the log itself contradicts are left out, as far as the site says so.",
                        ["site", "map", "log", "truth", "scans", "of these left out", "field of view",
                         "range of the laser; median over scans of the longest return"],
                        rows)


def joined(names):
    *first, last = names
    return " and ".join([", ".join(first), last] if first else [last])


def notes(comparison):
    """What flatters or harms a method on the sites of the page; nothing of sites that are not known."""
    known = [name for name in comparison.cases if name in (*sites.LEARNED, *sites.MORE, *sites.LOOKED_AT)]
    narrow = [site for (site, method), answers in comparison.answers.items()
              if method in methods.PUBLISHED and answers.facts["field_of_view"] < 360 - plan.WHOLE]
    recorded = [name for name in known if comparison.cases[name].log.stem not in sites.SIMULATED]
    registered = [name for name in recorded if name in sites.LOOKED_AT]
    texts = [LEARNED] if known else []
    for text, names in ((NARROW, narrow), (REFINED, [name for name in recorded if name not in registered]), (REGISTERED, registered),
                        (TURNED, [name for name in registered if name.startswith("mines")])):
        texts += [text.format(joined(dict.fromkeys(names)))] if names else []
    return "\n".join(["", *texts, ""]) if texts else ""


def commit_text(commit):
    return f"{commit} (with changes that were not committed)" if commit.endswith("-dirty") else commit


def commits_of(results):
    """The commit of d2s1r's answers, and a sentence that names the answers of other commits."""
    ours = [result.commit for job, result in results.items() if job.method == methods.DEFAULT]
    commit = max(ours, key=ours.count)
    others = {}
    for job, result in results.items():
        if result.commit != commit:
            others.setdefault(result.commit, []).append(f"{title_of(job.method)} on {job.site.name}")
    told = "; ".join(f"{commit_text(other)}: {joined(of)}" for other, of in others.items())
    return commit_text(commit), f"Of other commits: {told}. " if told else ""


def missing(left_out):
    rows = [[site, title_of(method), why] for (site, method), why in left_out.items()]
    return tables.table("Left out", "", ["site", "method", "why"], rows)


def draw_success(comparison, within, file):
    """Success against the error that still counts, which is `within` [m] in the tables."""
    figure, panels = plt.subplots(1, len(comparison.cases), figsize=(6 * len(comparison.cases), 5), constrained_layout=True,
                                  squeeze=False, sharey=True)
    for axis, site in zip(panels[0], comparison.cases):
        for method in comparison.methods:
            if (site, method) not in comparison.answers:
                continue
            frames = comparison.answers[site, method].frames
            axis.plot(BOUNDS, [measures.share(frame.is_within(bound, YAW) for frame in frames) for bound in BOUNDS],
                      label=title_of(method), linewidth=2.5 if method == methods.DEFAULT else 1.2)
        axis.axvline(within, color="black", linestyle=":", linewidth=1)
        axis.set(xscale="log", xlabel=f"greatest error [m], yaw {YAW}°", title=site, ylim=(0, 101))
        axis.set_xticks(MARKS, MARKS)
        axis.minorticks_off()
        axis.grid(alpha=0.3)
    panels[0][0].set_ylabel("success [%]")
    panels[0][-1].legend(fontsize="small", loc="center left", bbox_to_anchor=(1.01, 0.5))
    figure.savefig(file, dpi=110)
    return file.name


def draw_reliability(comparison, file):
    frames = [frame for site in comparison.cases for frame in comparison.answers[site, methods.DEFAULT].frames]
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(6, 6), constrained_layout=True, sharex=True, gridspec_kw={"height_ratios": (3, 1)})
    bins = measures.confidence_bins(frames)
    middles = [(i + 0.5) / measures.BINS for i in range(measures.BINS)]
    top.bar(middles, [measures.success(part) / 100 if part else 0 for part in bins], width=0.9 / measures.BINS, color="tab:blue")
    top.plot([0, 1], [0, 1], color="black", linestyle="--", linewidth=1)
    top.set(ylabel="share right", ylim=(0, 1), title=f"d2s1r: calibration error {measures.calibration_error(frames):.3f}")
    bottom.bar(middles, [len(part) for part in bins], width=0.9 / measures.BINS, color="grey")
    bottom.set(xlabel="confidence", ylabel="scans", yscale="symlog", xlim=(0, 1))
    figure.savefig(file, dpi=110)
    return file.name


def draw_map(comparison, site, file):
    """Where d2s1r and the best published column fail."""
    shown = [methods.DEFAULT] + [row["method"] for row in [best_published(
        [row for row in comparison.rows() if row["site"] == site and row["subset"] == "all"])] if row]
    figure, panels = plt.subplots(1, len(shown), figsize=(7 * len(shown), 6), constrained_layout=True, squeeze=False)
    for axis, method in zip(panels[0], shown):
        yaml = comparison.cases[site].map_file
        if yaml.suffix == ".yaml":
            picture, extent_of, yaw = sites.map_image(yaml)
            image = grey(picture, yaml)
            left, right, bottom, top = extent_of(*image.shape)
            axis.imshow(image, cmap="gray", extent=(left, right, bottom, top), vmin=0, vmax=254, interpolation="nearest",
                        transform=Affine2D().rotate_around(left, bottom, yaw) + axis.transData)
            axis.set_facecolor(str(UNKNOWN / 254))
        frames = comparison.answers[site, method].frames
        for flag, colour, size, label in ((True, "tab:green", 4, "right"), (False, "tab:red", 18, "wrong or no answer")):
            places = [frame.truth for frame in frames if frame.right == flag]
            axis.scatter([p[0] for p in places], [p[1] for p in places], s=size, c=colour, label=label)
        for frame in frames:
            if frame.pose and not frame.right:
                axis.plot([frame.truth[0], frame.pose[0]], [frame.truth[1], frame.pose[1]], color="tab:red", linewidth=0.6)
        x, y = ([frame.truth[axis_of] for frame in frames] for axis_of in (0, 1))
        axis.set(xlim=(min(x) - 5, max(x) + 5), ylim=(min(y) - 5, max(y) + 5), xlabel="x [m]", ylabel="y [m]", title=f"{site}, {title_of(method)}",
                 aspect="equal")
    panels[0][0].legend(loc="upper left", bbox_to_anchor=(0, -0.1), ncols=2)
    figure.savefig(file, dpi=110)
    return file.name


def write_csv(rows, comparison, folder, no_times):
    with open(folder / "table.csv", "w", newline="") as stream:
        columns = [name for name in COLUMNS if not (no_times and name in OF_TIME)]
        writer = csv.DictWriter(stream, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: f"{value:.6g}" if isinstance(value, float) else value for name, value in row.items()} for row in rows)
    with open(folder / "frames.csv", "w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["site", "method", "timestamp", "in_map", "status", "x", "y", "phi", "confidence", "true_x", "true_y", "true_phi",
                         "right", "ms"])
        for (site, method), answers in comparison.answers.items():
            for frame in answers.frames:
                pose = [f"{value:.4f}" for value in frame.pose] if frame.pose else [""] * 3
                writer.writerow([site, method, f"{frame.stamp / 1000:.3f}", int(frame.in_map), frame.status, *pose, f"{frame.confidence:.6g}",
                                 *(f"{value:.4f}" for value in frame.truth), int(frame.right), f"{frame.times['total']:.3f}"])


def write_latex(rows, file, no_times, comment):
    def escaped(text):
        return text.replace("_", r"\_").replace("%", r"\%").replace("°", r"$^\circ$")
    shown = 5 if no_times else 6
    lines = [f"% {comment}", "% In brackets: 95 % intervals, for which whole groups of failures are drawn.",
             r"\begin{tabular}{ll" + "r" * (shown - 2) + "}", r"\hline",
             " & ".join(["site", "method", "scans", r"success [\%]", r"precision [\%]", "ms"][:shown]) + r" \\", r"\hline"]
    for row in rows:
        if row["subset"] == "all":
            lines.append(" & ".join(escaped(cell) for cell in (
                row["site"], title_of(row["method"]), str(row["scans"]), percent(row, "success"), percent(row, "precision"),
                f"{row['ms_median']:.1f}")[:shown]) + r" \\")
    file.write_text("\n".join([*lines, r"\hline", r"\end{tabular}", ""]))


def write_bibliography(comparison, runner, commit, file):
    cited = {key for name in comparison.methods for key in kind_of(name).cited}
    text = (pathlib.Path(__file__).parent / "references.bib").read_text()
    text = text.replace("VERSION", runner.version().splitlines()[0].split()[-1]).replace("COMMIT", commit)
    entries = [entry for entry in re.split(r"\n(?=@)", text) if re.match(r"@\w+\{([^,]+)", entry).group(1) in cited]
    file.write_text("\n".join(entry.rstrip() + "\n" for entry in entries))


def write(results, left_out, folder, runner, command, options):
    """The arguments: {compare.Job: runs.Result}, {(site, method): why it is left out}, the folder, runs.Runner, the command and
    its options"""
    comparison = Comparison(results)
    rows = list(comparison.rows())
    write_csv(rows, comparison, folder, options.no_times)
    (folder / "logs").mkdir(exist_ok=True)
    for job, result in results.items():
        (folder / f"logs/{job.name}.txt").write_text(f"commit {result.commit}, {result.machine}\n{result.value.log}")
    within = next(iter(results)).position
    pictures = [tables.picture("Success against the error that still counts; dotted: that of the tables",
                               draw_success(comparison, within, folder / "success.png")),
                tables.picture("Reliability: the share of right answers by confidence, and the number of scans",
                               draw_reliability(comparison, folder / "reliability.png"))]
    pictures += [tables.picture(f"Where scans of {site} are found, and where answers are that are wrong",
                                draw_map(comparison, site, folder / f"{site}_map.png"))
                 for site in comparison.cases if not options.no_maps]
    plt.close("all")
    machines = " and ".join(sorted({result.machine for result in results.values()}))
    commit, others = commits_of(results)
    write_bibliography(comparison, runner, commit, folder / "references.bib")
    success = f"A success is a best pose within {within:g} m and {YAW}° of the truth, whatever its status."
    write_latex(rows, folder / "table.tex", options.no_times, f"{command}, commit {commit}. {others}{success}".replace("°", " degrees"))
    head = (f"# Comparison\n\n`{command}`, commit {commit}, {machines}. {others}{success}\n\n{fingerprint.stamp(runner.build, 'answers')}\n\n"
            f"{HOW}{'' if options.no_times else TIMES}{notes(comparison)}")
    parts = [*result_tables(rows, -2 if options.no_times else None), *pictures, data(comparison, results), settings(comparison), missing(left_out)]
    (folder / "README.md").write_text("\n".join([head, *(part for part in parts if part)]))
