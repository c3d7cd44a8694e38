# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
"""report.html in a headless Chromium, as a person uses it: opening, clicking, zooming, filtering.

Usage: test_report.py [REPORT.html [PICTURE_FOLDER]]. Without a report it makes one of a drawn building with the program
that RAWLOG_LOCALIZE names. It exits with 77 if there is no Chromium to drive."""
import csv
import json
import math
import os
import pathlib
import re
import shutil
import statistics
import sys
import tempfile
import time

SKIPPED = 77


def skip(why):
    print(f"SKIPPED: {why}; install chromium, chromium-driver and python3-selenium")
    sys.exit(SKIPPED)


try:
    from selenium import webdriver
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.chrome.service import Service
except ImportError:
    skip("python3-selenium is missing")


def open_browser(folder):
    program, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not program or not driver:
        skip("chromium or chromedriver is missing")
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--window-size=1400,900",
                     f"--user-data-dir={folder}"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(service=Service(driver), options=options)


class Page:
    def __init__(self, browser, report, pictures):
        self.browser, self.report, self.pictures = browser, report, pictures
        start = time.monotonic()
        browser.get(report.resolve().as_uri())
        self.wait(lambda: self.script("return document.body.dataset.ready") == "yes", "the report opens", 60)
        self.opened_s = time.monotonic() - start

    def script(self, text, *arguments):
        return self.browser.execute_script(text, *arguments)

    def find(self, selector):
        return self.browser.find_element(By.CSS_SELECTOR, selector)

    def all(self, selector):
        return self.browser.find_elements(By.CSS_SELECTOR, selector)

    def wait(self, condition, what, seconds=10):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if condition():
                return
            time.sleep(0.02)
        raise AssertionError(f"not so: {what}; console: {self.errors()}")

    def errors(self):
        return [entry["message"] for entry in self.browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]

    def click_map(self, x, y):
        """Clicks at a pixel of the map from its upper left corner."""
        canvas = self.find("#map")
        ActionChains(self.browser).move_to_element_with_offset(
            canvas, round(x - canvas.size["width"] / 2), round(y - canvas.size["height"] / 2)).click().perform()

    def picture(self, name):
        time.sleep(0.2)
        if self.pictures:
            self.browser.save_screenshot(str(self.pictures / name))

    def settle(self):
        """Waits for what requestAnimationFrame() draws."""
        self.browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")


def shown(page):
    return page.script("return shown.length")


def test_opens(page):
    frames = page.script("return run.index.length")
    assert frames > 10
    assert page.find("#summary").text.startswith(f"{frames} frames")
    assert shown(page) == frames
    rows = len(page.all("#rows .row"))
    assert 5 < rows <= min(frames, 60), f"the list has rows only where it is seen, however long the log is: {rows}"
    dark = page.script(
        "const c = $('map'), p = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let dark = 0;"
        "for (let i = 0; i < p.length; i += 4) dark += p[i] < 80 && p[i + 1] < 80; return dark")
    assert dark > 500, "the walls are drawn"
    assert page.script("return selected") == 0, "the first frame is selected"
    heads = [head.text for head in page.all("#details th")]
    assert ("error" in heads) == bool(page.script("return run.truth ? 1 : 0")), heads
    cut = page.script("return [...document.querySelectorAll('.row span')].filter(s => s.scrollWidth > s.clientWidth).map(s => s.textContent)")
    assert cut == [], f"the columns show what they hold: {cut}"
    page.picture("opened.png")


def test_first_line_sums_up_the_run(page):
    table, summary = page.report.parent / "frames.csv", page.report.parent / "summary.json"
    if not table.exists():
        return  # the report of somebody else
    with open(table, newline="") as stream:
        statuses = [row["status"] for row in csv.DictReader(stream)]
    run = json.loads(summary.read_text())
    counts = ", ".join(f"{status} {statuses.count(status)} ({100 * statuses.count(status) / len(statuses):.1f} %)"
                       for status in ("localized", "ambiguous", "rejected", "invalid"))
    window = f", window of {run['window']}" if run["window"] > 1 else ""
    expected = f"{len(statuses)} frames{window}: {counts} · {run['rawlog']} · {run['map']} · d2s1r {run['version']}"
    for said in (page.find("#summary").text, " ".join(page.find("#summary").get_attribute("title").split())):
        assert said == expected, (said, expected)


def test_a_narrow_window_shows_all(page):
    size = page.browser.get_window_size()
    page.browser.set_window_size(500, 900)
    page.settle()
    page.settle()
    summary, corners = page.find("#summary"), page.script(
        "return [pixelX(run.origin[0]), pixelX(run.origin[0] + run.width * run.cell_size), canvasSize.width]")
    assert page.script("return arguments[0].scrollWidth <= arguments[0].clientWidth", summary), "the first line is not cut off"
    assert 0 <= corners[0] < corners[1] <= corners[2], f"the map still fits: {corners}"
    page.picture("narrow.png")
    page.script("select(Math.floor(run.index.length / 2))")
    page.settle()
    row, head, box = page.script(
        "return ['.row.selected', '.row.head', '#list'].map(name => document.querySelector(name).getBoundingClientRect())")
    assert head["bottom"] <= row["top"] and row["bottom"] <= box["bottom"], f"the list shows the selected frame: {row}, {box}"
    page.script("zoom(2)")
    scale = page.script("return view.scale")
    page.browser.set_window_size(size["width"], size["height"])
    page.settle()
    assert page.script("return view.scale") == scale, "a view that somebody has chosen stays"
    page.script("select(0)")
    page.find("#fit").click()
    page.settle()


def test_arrow_keys_keep_the_frame_in_sight(page):
    page.script("zoom(8)")
    for key in (Keys.END, Keys.HOME, Keys.ARROW_RIGHT):
        page.find("body").send_keys(key)
        page.settle()
        x, y, width, height = page.script(
            "return [pixelX(drawnX[selected]), pixelY(drawnY[selected]), canvasSize.width, canvasSize.height]")
        assert 0 < x < width and 0 < y < height, (x, y)
    page.script("fit()")
    page.settle()


def test_is_one_small_file(page):
    assert page.script("return performance.getEntriesByType('resource').map(r => r.name).filter(n => !n.startsWith('data:'))") == []
    text = page.report.read_text()
    data = re.findall(r'<script type="text/plain" id="data-[a-z]+">([A-Za-z0-9+/=]+)</script>', text)
    assert len(data) == 3
    assert len(text) - sum(map(len, data)) < 300_000, "characters without the data"


def test_list_selects(page):
    page.all("#rows .row")[3].click()
    page.settle()
    assert page.script("return selected") == 3
    assert page.find("#details b").text.startswith(f"frame {page.script('return run.index[3]')}: ")
    page.find("body").send_keys(Keys.ARROW_RIGHT)
    page.settle()
    assert page.script("return selected") == 4


def test_map_click_selects_and_lays_the_scan(page):
    f = page.script("return run.status.findIndex(s => s === 0)")
    page.script("view.scale = 3 * view.fitted; const p = poseOf(arguments[0]); view.x = p.x; view.y = p.y; select(-1); redraw()", f)
    page.settle()
    x, y = page.script("const p = poseOf(arguments[0]); return [pixelX(p.x), pixelY(p.y)]", f)
    page.click_map(x, y)
    page.settle()
    chosen = page.script("return selected")
    assert chosen >= 0
    apart = page.script("const a = poseOf(arguments[0]), b = poseOf(arguments[1]); return Math.hypot(a.x - b.x, a.y - b.y) * view.scale",
                        f, chosen)
    assert apart < 4, "the frame that was clicked is selected, or one at the same place"
    assert len(page.all("#details tr.place")) >= 1
    counts = page.script("return lay(scanOf(selected), placesOf(selected)[0]).ends.reduce((n, e) => (n[e.kind]++, n), [0, 0, 0, 0, 0, 0])")
    assert counts[0] > sum(counts[:5]) / 2, f"most beams of a localized scan end on walls: {counts}"
    assert f"({counts[0]})" in page.find("#legend").text
    page.picture("localized.png")


def test_explained_share_is_that_of_the_beam_model(page):
    """The page judges beams by itself; the program told which share of the returns is explained, of at most 180."""
    pairs = page.script(
        "const pairs = []; for (let f = 0; f < run.index.length && pairs.length < 300; f += 3) { if (run.status[f] !== 0) continue;"
        "const h = hypothesesOf(f)[0], ends = lay(scanOf(f), h).ends.filter(e => e.kind !== kNoReturn);"
        "if (h.explained !== null) pairs.push([h.explained, ends.filter(e => e.kind === kOnWall).length / ends.length]); } return pairs")
    apart = [abs(a - b) for a, b in pairs]
    assert pairs and sum(apart) / len(apart) < 0.05 and max(apart) < 0.3, (sum(apart) / len(apart), max(apart))


def test_wheel_zooms_about_the_pointer(page):
    before = page.script("return [view.scale, view.x + (300 - canvasSize.width / 2) / view.scale]")
    page.script("$('map').dispatchEvent(new WheelEvent('wheel', {deltaY: -300, clientX: 300 + $('map').getBoundingClientRect().x,"
                "clientY: 200 + $('map').getBoundingClientRect().y, cancelable: true}))")
    page.settle()
    after = page.script("return [view.scale, view.x + (300 - canvasSize.width / 2) / view.scale]")
    assert after[0] > 1.3 * before[0] and math.isclose(after[1], before[1], abs_tol=1e-6)
    canvas = page.find("#map")
    ActionChains(page.browser).move_to_element(canvas).click_and_hold().move_by_offset(80, 30).release().perform()
    moved = page.script("return view.x + (300 - canvasSize.width / 2) / view.scale")
    assert math.isclose(moved, after[1] - 80 / after[0], abs_tol=3 / after[0]), "dragging moves the map"
    page.find("#fit").click()
    page.settle()
    assert page.script("return view.scale === view.fitted")


def test_ambiguous_frame_shows_its_rivals(page):
    f = page.script("let best = -1, most = 0; run.status.forEach((s, f) => { const n = hypothesesOf(f).filter(h => h.probability > 0.05).length;"
                    "if (s === 1 && n > most) [best, most] = [f, n]; }); return best")
    if f < 0:
        return
    page.script("select(arguments[0])", f)
    page.settle()
    rows = page.all("#details tr.place")
    assert len(rows) >= page.script("return hypothesesOf(selected).length")
    if len(rows) > 1:
        rows[1].click()
        page.settle()
        assert page.script("return place") == 1
        assert "shown" in page.all("#details tr.place")[1].get_attribute("class")
    page.picture("ambiguous.png")


def test_window_and_filter_stand_beside_what_a_scan_says_alone(page):
    for kind, of_frame in (("alone", "run.alone ? aloneOf(f) && aloneOf(f).pose : null"), ("fused", "run.fused ? fusedOf(f) : null")):
        f, pose = page.script(f"for (let f = 0; f < run.index.length; f++) {{ const p = {of_frame}; if (p) return [f, p]; }} return [-1, null]")
        if f < 0:
            assert not page.script(f"return run.{kind}")
            continue
        page.script("select(arguments[0])", f)
        page.settle()
        row = next(row for row in page.all("#details tr.place") if row.text.startswith(kind + ": "))
        row.click()
        page.settle()
        shown_place = page.script("return placesOf(selected)[place]")
        assert [shown_place[key] for key in ("x", "y", "phi")] == [pose[key] for key in ("x", "y", "phi")]


def test_filters(page):
    all_frames, counts = shown(page), page.script("return [0, 1, 2, 3].map(s => run.status.filter(t => t === s).length)")
    page.find("#show-localized").click()
    page.settle()
    assert shown(page) == all_frames - counts[0]
    assert page.find("#count").text == f"{all_frames - counts[0]} of {all_frames} frames"
    page.find("#show-localized").click()
    box = page.find("#least-confidence")
    box.clear()
    box.send_keys("0.9")
    page.settle()
    sure = page.script("return run.confidence.filter(c => c >= 0.9).length")
    assert shown(page) == sure < all_frames or sure == all_frames
    box.clear()
    box.send_keys("0")
    if page.all("#only-wrong"):
        page.find("#only-wrong").click()
        page.settle()
        wrong = page.script("return run.index.filter((_, f) => isWrong(errorOf(f, poseOf(f)))).length")
        assert shown(page) == wrong < all_frames
        page.find("#only-wrong").click()
    page.settle()
    assert shown(page) == all_frames


def test_timeline_selects(page):
    line = page.find("#timeline")
    ActionChains(page.browser).move_to_element_with_offset(line, round(0.25 * line.size["width"]), 0).click().perform()
    page.settle()
    frames = page.script("return run.index.length")
    assert abs(page.script("return selected") - 0.75 * frames) < 0.03 * frames + 2


def print_how_fluid(page):
    """Prints times, which depend on the machine: they are no test. tests/python/RESULTS.md has some."""
    for what, action in (("the map moves", "view.x += (i % 2 ? 5 : -5) / view.scale; redraw(true)"),
                         ("the filters change", "$('least-confidence').value = i % 2 ? 0 : 0.9; applyFilters()")):
        milliseconds = page.browser.execute_async_script(
            "const done = arguments[0], times = []; let i = 0, last = performance.now(); const step = () => {"
            "const now = performance.now(); times.push(now - last); last = now; if (++i > 40) { done(times.slice(1)); return; }"
            f"{action}; requestAnimationFrame(step); }}; requestAnimationFrame(step)")
        print(f"a picture every {statistics.median(milliseconds):.0f} ms while {what}")


def make_report(folder, repeats, *options):
    """The report of a drive that the robot does so many times."""
    from drawn_world import World
    folder.mkdir()
    world = World(folder, spoiled=True)
    drive, truth = (folder / "drive.log").read_text().splitlines(), (folder / "truth.txt").read_text().splitlines()
    with open(folder / "drive.log", "w") as log, open(folder / "truth.txt", "w") as true_poses:
        for i in range(100 * repeats):
            log.write(f"{drive[i % 100].rsplit(' ', 3)[0]} {100 + i} host {100 + i}\n")
            true_poses.write(f"{100 + i} {truth[i % 100].split(' ', 1)[1]}\n")
    world.rows_of_program("--ground-truth", folder / "truth.txt", *options)
    return folder / "out" / "report.html"


TESTS = (test_opens, test_first_line_sums_up_the_run, test_a_narrow_window_shows_all, test_is_one_small_file, test_list_selects,
         test_arrow_keys_keep_the_frame_in_sight, test_map_click_selects_and_lays_the_scan,
         test_explained_share_is_that_of_the_beam_model, test_wheel_zooms_about_the_pointer,
         test_ambiguous_frame_shows_its_rivals, test_window_and_filter_stand_beside_what_a_scan_says_alone, test_filters,
         test_timeline_selects)


def use(report, folder, pictures=None):
    """Opens a report in a new browser and does everything with it."""
    try:
        browser = open_browser(folder)
    except OSError as error:
        skip(str(error))
    try:
        browser.set_script_timeout(60)
        page = Page(browser, report, pictures)
        print(f"{report.stat().st_size / 1000:.0f} kB, {page.script('return run.index.length')} frames, opened after {page.opened_s:.2f} s")
        for test in TESTS:
            test(page)
            print(f"passed {test.__name__}", flush=True)
        print_how_fluid(page)
        errors = page.errors()
        assert not errors, f"the console is empty: {errors}"
    finally:
        browser.quit()


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        if len(sys.argv) > 1:
            use(pathlib.Path(sys.argv[1]), folder / "browser", pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else None)
            return
        use(make_report(folder / "short", 1, "--window", "3", "--fuse"), folder / "browser")
        use(make_report(folder / "long", 100), folder / "browser")


if __name__ == "__main__":
    main()
