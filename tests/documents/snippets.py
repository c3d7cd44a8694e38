#!/usr/bin/env python3
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""Tries what the documents show.

    snippets.py cpp OUT.cpp DOCUMENT...   writes the snippets of C++ as functions of one source, which is compiled
    snippets.py run SOURCES DOCUMENT...   runs blocks of `sh` and `python` as they stand, in a folder that holds `share`
    snippets.py links SOURCES DOCUMENT... finds links to files and headings that do not exist
    snippets.py installed FOLDER          the same of all documents that are installed, which may lead to sources that are not

Blocks of `console` are for another system, or take long: they are not run. A whole program (one with main()) is built by
the tests of the installation, not here.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

SKIPPED = 77
INCLUDES = ["d2s1r/CSignatureMap2D.h", "d2s1r/atlas.h", "d2s1r/localizer.h", "d2s1r/map_io.h", "d2s1r/mrpt.h",
            "d2s1r/scan_accumulator.h", "d2s1r/seeding.h", "d2s1r/window_localizer.h", "mrpt/slam/CMonteCarloLocalization2D.h"]
# What the text around a snippet says that it has.
GIVEN = ["std::shared_ptr<const d2s1r::OccupancyMap> map", "const d2s1r::Localizer& localizer", "const d2s1r::Localization& result",
         "const mrpt::obs::CObservation2DRangeScan& observation", "std::optional<mrpt::poses::CPose2D> odometry",
         "mrpt::slam::CMonteCarloLocalization2D& filter"]


def blocks(document, kind):
    """[(line of the first line, text)] of the fenced blocks of a kind."""
    text = pathlib.Path(document).read_text()
    return [(text[:found.start(1)].count("\n") + 1, found.group(1))
            for found in re.finditer(rf"^```{kind}\n(.*?)^```$", text, re.M | re.S)]


def write_cpp(out, documents):
    lines = ["// Made of the snippets of the documents; it is compiled, not run.", *(f"#include <{file}>" for file in INCLUDES)]
    number = 0
    for document in documents:
        for line, text in blocks(document, "cpp"):
            if "int main(" in text:
                continue
            body = re.sub(r"^#include .*\n", "", text, flags=re.M)
            given = [name for name in GIVEN if not re.search(rf"[\w>&] {name.split()[-1].lstrip('&')}(\(| =)", body)]
            lines += [f"void snippet_{number}([[maybe_unused]] {', [[maybe_unused]] '.join(given)});",
                      f"void snippet_{number}([[maybe_unused]] {', [[maybe_unused]] '.join(given)})", "{",
                      f'#line {line} "{document}"', body, "}"]
            number += 1
    if number == 0:
        sys.exit("no snippet of C++ was found")
    pathlib.Path(out).write_text("\n".join(lines) + "\n")


def run_block(command, text, folder, name):
    done = subprocess.run(command, input=text, cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          timeout=120, check=False)
    if done.returncode != 0:
        print(f"{name}: status {done.returncode}\n{text}\n{done.stdout}", file=sys.stderr)
    return done.returncode == 0


def has_modules(*names):
    return subprocess.run([sys.executable, "-c", "import " + ", ".join(names)], stderr=subprocess.DEVNULL, check=False).returncode == 0


def run_all(sources, documents):
    tried = failed = left_out = 0
    with tempfile.TemporaryDirectory() as folder:
        os.symlink(pathlib.Path(sources) / "share", pathlib.Path(folder) / "share")
        for document in documents:
            for kind, command in ("sh", ["bash", "-euo", "pipefail"]), ("python", [sys.executable, "-"]):
                for line, text in blocks(document, kind):
                    if kind == "python" and not has_modules("d2s1r", "matplotlib"):
                        left_out += 1
                        continue
                    tried += 1
                    failed += not run_block(command, text, folder, f"{document}:{line}")
    print(f"{tried} blocks were run, {failed} of them failed, {left_out} need a module that is missing")
    if tried == 0:
        sys.exit(SKIPPED)
    sys.exit(failed > 0)


def anchors(document):
    """The names that GitHub gives to the headings of a document."""
    text = re.sub(r"^```.*?^```$", "", document.read_text(), flags=re.M | re.S)
    plain = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading) for heading in re.findall(r"^#+ (.*)$", text, re.M)]
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in plain}


def check_links(_sources, documents, elsewhere="(?!)"):
    """Links to what the expression `elsewhere` finds in them are not checked."""
    wrong, checked = [], 0
    for document in map(pathlib.Path, documents):
        for target in re.findall(r"\]\(([^)\s]+)\)", document.read_text()):
            if re.match(r"[a-z]+:", target) or re.search(elsewhere, target):
                continue
            checked += 1
            file, _, anchor = target.partition("#")
            linked = document.parent / file if file else document
            if not linked.exists() or anchor and anchor not in anchors(linked):
                wrong.append(f"{document}: {target}")
    print(f"{checked} links were checked")
    sys.exit("these links lead nowhere:\n" + "\n".join(wrong) if wrong else checked == 0)


def check_installed(folder, _):
    documents = sorted(pathlib.Path(folder).rglob("*.md"))
    check_links(folder, documents, r"(^|/)(libs|apps|plugins|share)/|(experiments|programs|rivals|src)/?$|\.(h|cpp|py)$")


if __name__ == "__main__":
    CALLS = {"cpp": write_cpp, "run": run_all, "links": check_links, "installed": check_installed}
    if len(sys.argv) < 3 or sys.argv[1] not in CALLS:
        sys.exit(__doc__)
    CALLS[sys.argv[1]](sys.argv[2], sys.argv[3:])
