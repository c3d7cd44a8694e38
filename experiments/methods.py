# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""What compare.py compares: each method with the settings that are best for it, and where they come from."""
import dataclasses
import math
import re

KEYFRAMES = "needs the scans that built the map (run.rawlog, run_gt.txt)"


READINGS = ("range (Table II's, the laser's, or the median over scans of the longest return, rounded up) and reading of lost beams: the best on "
            "at most 100 of these scans")  # compare.TRIED


@dataclasses.dataclass(frozen=True)
class Method:
    title: str
    cited: tuple  # keys of references.bib
    settings: str
    source: str  # of the settings
    word: str  # METHOD of programs/rivals
    config: str = ""  # ini file of share/d2s1r/config that it reads
    candidates: int = 0  # [-] k of the published method, whose range and reading of lost beams are tried out
    keyframes: bool = False  # compares with the scans that built the map, and does not look at the map itself
    doubts: bool = False  # says which answers it is sure of


FLIRT = ("5 scales from 0.2 m by 1.4, least peak 0.34, beta grids of 4 x 12 cells and 0.5 m, symmetric chi-squared distance below "
         "0.4, inliers within 0.245 m; all pairs of matches are tried")
DEFAULT = "d2s1r"
METHODS = {
    DEFAULT: Method("d2s1r", ("d2s1r-software",), "share/d2s1r/config/default.ini", "as shipped", "d2s1r", config="default", doubts=True),
    "published-10": Method(
        "published method, k = 10", ("d2s1r",), "Table II", "the paper; " + READINGS,
        "d2s1r", config="paper", candidates=10),
    "published-200": Method(
        "published method, k = 200", ("d2s1r",), "Table II but for k", "tuned here: more candidates, at 20 times the price; " + READINGS,
        "d2s1r", config="paper", candidates=200),
    "exhaustive": Method(
        "exhaustive likelihood field", ("probabilistic-robotics", "amcl"), "grid of 0.15 m and 5 deg; 0.95 and 0.05, 0.2 m, up to 2 m, 30 beams",
        "Section 8.2 of the book; the mixture of ROS's AMCL", "exhaustive"),
    "branch-and-bound": Method(
        "branch and bound", ("cartographer",), "depth 7, voxels of at most 0.9 m, 100 points, 50 m, the whole map as window, no least score",
        "Cartographer's defaults", "branch-and-bound"),
    "filter": Method(
        "particle filter after one scan", ("kld-sampling", "probabilistic-robotics", "amcl"), "100 to 5,000 particles, error 0.01, quantile 0.99, 30 beams; uniform start",
        "defaults of ROS's AMCL", "filter"),
    "bag-of-words": Method(
        "FLIRT, bag of words", ("flirt", "video-google", "flirt-phrases"), FLIRT + "; 100 words of 1,000 descriptors, 50 keyframes are aligned",
        "FLIRTlib and GFLIP; 100 words: our choice", "bag-of-words", keyframes=True),
    "phrases": Method(
        "geometrical FLIRT phrases", ("flirt", "flirt-phrases"), FLIRT + "; phrases of 2 words, 50 keyframes", "FLIRTlib and GFLIP", "phrases",
        keyframes=True),
    "glare": Method(
        "GLARE", ("flirt", "glare", "glarot"), FLIRT + "; 8 directions and 50 distances of 0.2 m, the best of 8 rotations, 50 keyframes",
        "the public code of GLAROT's authors", "glare", keyframes=True),
}
PUBLISHED = ("published-10", "published-200")


@dataclasses.dataclass(frozen=True)
class Peer:
    """A program of others, run by a driver in the folder of --peers."""
    title: str
    cited: tuple
    settings: str
    source: str
    doubts: bool = False  # says which answers it is sure of


PEERS = {
    "iris_lama": Peer("iris_lama, Loc2D", ("iris-lama",), "3,000 poses a round, at most 10 rounds, residual 0.15", "defaults of Loc2D::Options"),
    "relocalization_toolbox": Peer("relocalization_toolbox", ("relocalization-toolbox",), "config_2d.yaml; sure from a score of 0.85", "as shipped",
                                   doubts=True),
    "cbgl": Peer("CBGL with PL-ICP", ("cbgl", "pl-icp"), "params_cbgl.yaml and params_csm.yaml; scans as of a laser that hangs upside down",
                 "as shipped; the laser: where the sign of the yaw is right"),
    "cartographer": Peer("Cartographer's matcher", ("cartographer",), "pose_graph.lua and trajectory_builder_2d.lua; sure from a score of 0.6",
                         "as shipped", doubts=True),
}


@dataclasses.dataclass(frozen=True)
class Reading:
    """How the published method reads scans."""
    max_range: float  # [m]
    no_return: int  # 1: a lost beam is a range that is out of range; 0: it is no data

    def __str__(self):
        return f"{self.max_range:g} m, lost beams are {'out of range' if self.no_return else 'no data'}"


def readings(facts):
    """Those to try: Table II's range, that of the laser, and the median over scans of the longest return, rounded up.
    The argument: what alter_scans prints"""
    ranges = {30.0, float(facts["max_range"]), float(math.ceil(facts["longest"]))}
    return [Reading(reach, lost) for reach in sorted(ranges) if 0.5 <= reach <= 300 for lost in (1, 0)]


def published_config(text, candidates, reading):
    """The ini file of the published method with its k and a reading. The argument text: paper.ini"""
    values = {"candidates": (candidates, r"\[paper\].*?"), "max_range": (f"{reading.max_range:g}", r"\[paper\].*?"),
              "no_return": (reading.no_return, r"\[scan\].*?")}
    for key, (value, section) in values.items():
        text, found = re.subn(rf"(?s)({section}\n{key} = )[^ ;\n]+", rf"\g<1>{value}", text, count=1)
        if not found:
            raise ValueError(f"paper.ini has no {key}")
    return text
