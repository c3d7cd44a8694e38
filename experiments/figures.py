# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""The figures of the report, PNG files."""
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402, the back-end comes first

import measures  # noqa: E402
import plan  # noqa: E402
import published  # noqa: E402
import report  # noqa: E402
import sites  # noqa: E402
import tables  # noqa: E402

ERRORS = (1e-4, 0.3)  # [m] of the axis; yaw: 25 deg a metre, as the limits of a success are
FREE_MAPS = ("willow_garage_005", "nav2_warehouse_005", "mit_stata_basement")  # licences BSD, Apache-2.0, MIT
COLOURS, MARKERS = 10, "os^Dv<>"  # a site has one colour and one marker
SHOWN_MAPS = 3  # [-] in the figure of successes: the paper's buildings, then the largest


def draw_all(results, folder, with_maps):
    """{figure: file name, "" if there is nothing to draw}"""
    plain = {(job.site, job.scans, job.config): frames for job, frames in report.frames_of(results)}
    names = sorted({job.site.name for job, _ in report.frames_of(results)})
    drawn = {
        "errors": draw_errors(plain, folder / "errors.png"),
        "maps": draw_maps({key: frames for key, frames in plain.items() if with_maps or key[0].name in FREE_MAPS},
                          folder / "success_maps.png"),
        "reliability": draw_reliability(plain, folder / "reliability.png"),
        "field_of_view": draw_curves(tables.points(results, "field_of_view"), "field of view [deg] of a single scan",
                                     names, folder / "field_of_view.png"),
        "blocked": draw_curves(tables.points(results, "blocked"), "share of the view of a single scan that is blocked",
                               names, folder / "clutter.png"),
    }
    plt.close("all")
    return drawn


def save(figure, file):
    figure.savefig(file, dpi=110)
    return file.name


def draw_errors(plain, file):
    """Fig. 2: box plots, position on the left axis, yaw on the right one."""
    sets = sorted({key[:2] for key in plain if key[1] in ("sim360_on", "sim360_off")}, key=lambda key: (key[0].name, key[1]))
    if not sets:
        return ""
    figure, panels = plt.subplots(len(plan.CONFIGS), 1, figsize=(13, 8), constrained_layout=True, sharex=True)
    for axis, config in zip(panels, plan.CONFIGS):
        right = [measures.successes(plain[site, scans, config]) for site, scans in sets]
        looks = {"patch_artist": True, "widths": 0.3, "flierprops": {"marker": ".", "markersize": 3},
                 "medianprops": {"color": "black"}}
        places = range(len(sets))
        axis.boxplot([[f.position_error for f in frames] for frames in right], positions=[p - 0.2 for p in places],
                     boxprops={"facecolor": "white"}, **looks)
        yaw_axis = axis.twinx()
        yaw_axis.boxplot([[f.yaw_error for f in frames] for frames in right], positions=[p + 0.2 for p in places],
                         boxprops={"facecolor": "lightgrey"}, **looks)
        axis.set(title=plan.TITLES[config], ylabel="position error [m], white", yscale="log", ylim=ERRORS)
        yaw_axis.set(ylabel="yaw error [deg], grey", yscale="log", ylim=[25 * error for error in ERRORS])
        axis.set_xticks(list(places), [f"{site.name}\n{scans}" for site, scans in sets], rotation=40, ha="right")
    return save(figure, file)


def draw_maps(plain, file):
    """Fig. 3: true places of the scans on the map."""
    shown = [key[0] for key in plain if key[1:] == ("sim360_off", "default")]
    shown = sorted(shown, key=lambda site: ((site.name, "sim360_off") not in published.NAMES,
                                            -spread(plain[site, "sim360_off", "default"])))[:SHOWN_MAPS]
    if not shown:
        return ""
    figure, panels = plt.subplots(len(plan.CONFIGS), len(shown), figsize=(6 * len(shown), 11), constrained_layout=True,
                                  squeeze=False)
    for row, config in zip(panels, plan.CONFIGS):
        for axis, site in zip(row, shown):
            draw_map(axis, site, plain[site, "sim360_off", config])
            axis.set_title(f"{site.name} sim360_off, {plan.TITLES[config]}", fontsize="medium")
    panels[0][0].legend(loc="upper right")
    return save(figure, file)


def spread(frames):
    """[m^2] of the box round all scans."""
    x, y = [f.truth[0] for f in frames], [f.truth[1] for f in frames]
    return (max(x) - min(x)) * (max(y) - min(y))


def draw_map(axis, site, frames):
    picture, extent_of, _ = sites.map_image(site.map("sim360_off"))
    image = plt.imread(picture)
    axis.imshow(image, cmap="gray", extent=extent_of(*image.shape[:2]), interpolation="bilinear")
    for flag, colour, size, label in ((True, "tab:green", 4, "success"), (False, "tab:red", 18, "failure")):
        places = [f.truth for f in frames if f.right == flag]
        axis.scatter([p[0] for p in places], [p[1] for p in places], s=size, c=colour, label=label)
    for f in frames:
        if f.pose and not f.right:
            axis.plot([f.truth[0], f.pose[0]], [f.truth[1], f.pose[1]], color="tab:red", linewidth=0.7)
    x, y = [f.truth[0] for f in frames], [f.truth[1] for f in frames]
    axis.set(xlim=(min(x) - 5, max(x) + 5), ylim=(min(y) - 5, max(y) + 5), xlabel="x [m]", ylabel="y [m]")


def draw_reliability(plain, file):
    kinds = {"simulated sets": sites.SIMULATED, "recorded sets": ("test",)}
    return draw_reliability_of({
        name: sum((frames for key, frames in plain.items() if key[1] in scans and key[2] == "default"), [])
        for name, scans in kinds.items()}, file)


def draw_reliability_of(kinds, file):
    """\\p kinds: {name: frames}, a panel each."""
    drawn = {name: frames for name, frames in kinds.items() if frames}
    if not drawn:
        return ""
    figure, panels = plt.subplots(2, len(drawn), figsize=(6 * len(drawn), 7), constrained_layout=True, squeeze=False,
                                  sharex=True, gridspec_kw={"height_ratios": (3, 1)})
    for (top, bottom), (name, frames) in zip(zip(*panels), drawn.items()):
        bins = measures.confidence_bins(frames)
        middles = [(i + 0.5) / measures.BINS for i in range(measures.BINS)]
        shares = [measures.success(part) / 100 if part else 0 for part in bins]
        top.bar(middles, shares, width=0.9 / measures.BINS, color="tab:blue")
        top.plot([0, 1], [0, 1], color="black", linestyle="--", linewidth=1)
        top.set(title=f"{name}: calibration error {measures.calibration_error(frames):.3f}", ylabel="share right",
                ylim=(0, 1))
        bottom.bar(middles, [len(part) for part in bins], width=0.9 / measures.BINS, color="grey")
        bottom.set(xlabel="confidence", ylabel="frames", yscale="log", xlim=(0, 1))
    return save(figure, file)


def draw_curves(lines, meaning, names, file):
    """A panel per method, a line per set; each site of `names` has its own look."""
    if not lines:
        return ""
    figure, panels = plt.subplots(1, len(plan.CONFIGS), figsize=(13, 5.5), constrained_layout=True, sharey=True)
    sets = sorted({key[:2] for key in lines})
    for axis, config in zip(panels, plan.CONFIGS):
        for site, scans in sets:
            line = sorted(lines.get((site, scans, config), {}).items())
            look = names.index(site)
            axis.plot([x for x, _ in line], [measures.success(frames) for _, frames in line],
                      marker=MARKERS[look % len(MARKERS)], color=f"C{look % COLOURS}", linestyle="-" if scans in sites.SIMULATED else "--", label=f"{site} {scans}")
        axis.set(title=plan.TITLES[config], xlabel=meaning, ylim=(0, 102))
        axis.grid(alpha=0.3)
    panels[0].set_ylabel("success [%]")
    panels[-1].legend(fontsize="small", loc="center left", bbox_to_anchor=(1.01, 0.5))
    return save(figure, file)
