# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Which runs the report is made of."""
import dataclasses
import json
import math

import methods
import runs
import sites

CONFIGS = ("paper", "default")
FIELDS_OF_VIEW = (360, 270, 180, 120, 90)  # [deg]
BLOCKED = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)  # [-] share of the view
REACHES = (3.5, 5, 8, 12, 30)  # [m] of the sensor
USUAL = {"field_of_view": 360, "blocked": 0.0, "reach": 30}  # unaltered scans; 30 m stands for all that were recorded
WINDOW = 10  # [-] frames
CANDIDATES = 10  # [-] k of paper.ini, Table II
WHOLE = 5  # [deg] that a full or a half circle may lack: one beam


TITLES = {"paper": "published method, our implementation", "default": "d2s1r"}


def position_limit(scans):
    """[m] greatest error of a success: as in the paper, but real truth is not that exact."""
    return 0.2 if scans in sites.SIMULATED else 0.3


@dataclasses.dataclass(frozen=True)
class Job:
    """One run of rawlog-localize."""
    site: sites.Site
    scans: str
    config: str
    frames: int
    field_of_view: int = USUAL["field_of_view"]  # [deg] to which scans are cropped
    blocked: float = USUAL["blocked"]  # [-]
    reach: float = USUAL["reach"]  # [m] beyond which nothing is seen
    window: int = 0  # [-] frames that are judged together; 0: each alone
    map_site: sites.Site = None  # whose map; None: of the scans' own site
    widest: float = USUAL["field_of_view"]  # [deg] field of view of the scans as they are recorded
    in_map: bool = False  # only scans whose place is in the map and whose truth no log contradicts, as far as the site says so

    uses = ("alter", "localize")  # programs

    @property
    def map(self):
        return (self.map_site or self.site).map(self.scans)

    @property
    def position(self):
        return position_limit(self.scans)

    @property
    def name(self):
        words = [self.site.name, self.scans, self.config]
        words += [f"fov{self.field_of_view}"] if self.field_of_view != USUAL["field_of_view"] else []
        words += [f"reach{self.reach}"] if self.reach != USUAL["reach"] else []
        words += [f"blocked{round(100 * self.blocked)}"] if self.blocked else []
        words += [f"window{self.window}"] if self.window else []
        words += ["in-map"] if self.in_map else []
        words += [f"n{self.frames}"]
        words += ["in", self.map_site.name] if self.map_site else []
        return "-".join(words)

    def run(self, runner, folder):
        """[Frame]; of the published method on recorded scans: with the range and the reading of lost beams that are best for it"""
        rawlog = self.site.folder / f"{self.scans}.rawlog"
        ini = runner.configs / f"{self.config}.ini"
        if self.window:
            return self.localized(runner, folder, rawlog, ini, "--frames", f":{self.frames}", "--window", str(self.window))
        altered = folder / "in.rawlog"
        reach = self.reach if self.reach < USUAL["reach"] else math.inf
        facts = json.loads(runner.call("alter", rawlog, altered, f"frames={self.frames}", f"field_of_view={self.field_of_view}",
                                       f"blocked={self.blocked}", f"reach={reach}", *self.wanted(folder)))
        if self.config != "paper" or self.scans in sites.SIMULATED:
            return self.localized(runner, folder, altered, ini)
        answers = []
        for reading in methods.readings(facts):
            tried = folder / "tried.ini"
            tried.write_text(methods.published_config(ini.read_text(), CANDIDATES, reading))
            answers.append(self.localized(runner, folder, altered, tried))
        return max(answers, key=lambda frames: sum(frame.right for frame in frames))

    def wanted(self, folder):
        """Words that leave out scans whose place is not in the map."""
        here = [stamp for stamp, (in_map, doubtful) in self.site.knowledge(self.scans).items() if in_map and not doubtful]
        if not (self.in_map and here):
            return []
        file = folder / "in_map.txt"
        file.write_text("".join(f"{stamp / 1000:.3f} 0 0 0\n" for stamp in here))
        return [f"truth={file}"]

    def localized(self, runner, folder, rawlog, ini, *more):
        runner.call("localize", "-q", "-m", self.map, "-i", rawlog, "-o", folder, "-c", ini, "--index", runner.index_of(self.map, ini), *more)
        return runs.read_frames(folder / "frames.csv", self)


def swept(site, frames, field_of_view_of):
    """Jobs of the curves: narrower and narrower, more and more blocked, of shorter and shorter reach."""
    for scans in ("sim360_off", "test"):
        if not site.has(scans):
            continue
        usual = {"widest": field_of_view_of(site, scans), "in_map": scans == "test"}
        for config in CONFIGS:
            for field_of_view in FIELDS_OF_VIEW:
                if field_of_view <= usual["widest"] + WHOLE:
                    yield Job(site, scans, config, frames, field_of_view=field_of_view, **usual)
            for blocked in BLOCKED if scans == "sim360_off" else ():
                yield Job(site, scans, config, frames, blocked=blocked, **usual)
        for reach in REACHES:
            yield Job(site, scans, "default", frames, reach=reach, **usual)


def all_jobs(found, frames, sweep_frames, field_of_view_of):
    """The argument field_of_view_of: function of a site and a set [deg]"""
    jobs = []
    real = [site for site in found if site.has("test") and site.name not in sites.AGAIN]
    for site in found:
        for scans in ("test",) if site.name in sites.MORE else sites.SIMULATED + ("test",):
            if site.has(scans):
                jobs += [Job(site, scans, config, frames) for config in CONFIGS]
        if site.name not in sites.AGAIN + sites.MORE:
            jobs += swept(site, sweep_frames, field_of_view_of)
        if site.has("run"):
            jobs.append(Job(site, "run", "default", frames, window=WINDOW))
    for site in real:
        jobs += [Job(site, "test", "default", sweep_frames, map_site=other) for other in real if other != site]
    return list(dict.fromkeys(jobs))
