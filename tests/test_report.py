"""The report of a run: what it says, how large it is, and that a real browser plays it.

The browser's part needs Chromium and its driver: `apt-get install chromium chromium-driver`.
"""

import base64
import json
import re
import shutil
import time
import zlib

import numpy as np
import pytest

from hvisph.casefile.loader import load_case
from hvisph.core.errors import CaseError
from hvisph.output.reader import list_snapshots, read_snapshot
from hvisph.simulation.run import run
from hvisph.visualization.html.frames import NOWHERE, STEPS, frames
from hvisph.visualization.html.report import report
from hvisph.visualization.html.setup_section import _describe_shape

BROWSER = shutil.which("chromium") and shutil.which("chromedriver")


@pytest.fixture(scope="module")
def plane(tmp_path_factory):
    """A coarse impact in plane strain."""
    case = load_case("al_al_coarse", ["time.end=2us", "output.every=0.5us"], "0.5 mm")
    return run(case, tmp_path_factory.mktemp("plane") / "impact").folder


@pytest.fixture(scope="module")
def solid(tmp_path_factory):
    """A quarter of a coarse impact in 3D, named by something that would run if it were not text."""
    case = load_case("sphere_on_plate", ["time.end=1us", "output.every=0.5us", "title=A <script>alert(1)</script> & b",
                                         "symmetry=[{axis: y}, {axis: z}]", "formulation={type: eulerian}"], "0.7 mm")  # fmt: skip
    return run(case, tmp_path_factory.mktemp("solid") / "quarter").folder


@pytest.mark.parametrize(("shape", "words"), [
    ({"type": "polygon", "points": [[0, 0], [0, 0.01], [0.01, 0]]}, "polygon 3 points"),
    ({"type": "repeat", "shape": {"type": "box", "size": [0.001, 0.002]}, "vectors": [[0, 0.004]], "counts": [9]},
     "repeat of box vectors 0 mm x 4 mm, counts 9"),
    ({"type": "union", "parts": [{"shape": {"type": "disc", "diameter": 0.01}}, {"shape": {"type": "disc", "diameter": 0.02}},
                                 {"shape": {"type": "box", "size": [0.001, 0.002]}}]}, "union of 2 disc, box"),
])  # fmt: skip
def test_shapes_are_told_in_words(shape, words):
    case = load_case("al_al_coarse", [f"bodies.target.shape={json.dumps(shape)}"])
    assert _describe_shape(case.bodies["target"].shape, False) == words


def packed(page):
    """What the page holds for the player."""
    text = page.read_text(encoding="utf-8")
    return json.loads(re.search(r'id="runs">(.*?)</script>', text, re.DOTALL)[1])


def test_positions_and_fields_survive_packing(plane):
    found = frames(list_snapshots(plane)).content
    data = np.frombuffer(zlib.decompress(base64.b64decode(found["data"])), np.uint8)
    count, moments = found["count"], len(found["times"])
    last = read_snapshot(list_snapshots(plane)[-1])
    assert count == last.count
    high, low = data[: count * moments], data[count * moments : 2 * count * moments]
    x = (high.astype(int) * 256 + low).reshape(moments, count)
    assert (x != NOWHERE).all()
    back = found["low"][0] + x[-1] / STEPS * (found["high"][0] - found["low"][0])
    order = np.argsort(last.id)
    half = 0.51 * (found["high"][0] - found["low"][0]) / STEPS  # what 16 bits resolve
    assert np.abs(back - last.fields["position"][order, 0]).max() <= half
    fields = [field["name"] for field in found["fields"]]
    assert fields[:2] == ["velocity", "pressure"]
    ends = found["fields"][0]["ends"]
    speed = data[(2 * 2) * count * moments :][: count * moments].reshape(moments, count)[-1]
    exact = np.clip(np.hypot(*last.fields["velocity"][order].T), *ends)
    assert np.abs(ends[0] + speed / 255 * (ends[1] - ends[0]) - exact).max() <= 0.51 * (ends[1] - ends[0]) / 255


def test_many_particles_are_thinned_with_a_remark(plane, monkeypatch):
    monkeypatch.setattr("hvisph.visualization.html.frames.MOST_PARTICLES", 200)
    found = frames(list_snapshots(plane))
    assert found.content["count"] == 200
    assert any("200 of" in remark for remark in found.remarks)


def test_the_page_is_whole_small_and_calls_nobody(plane, solid):
    assert report(str(plane)) == report([plane])
    page = report([plane])
    text = page.read_text(encoding="utf-8")
    assert page.parent == plane
    assert len(text) < 1e6  # of a run as small as the al_al_coarse
    assert not re.search(r"""src=["'](?!data:image/png)""", text)
    links = re.findall(r"""href=["']([^#"'][^"']*)""", text)  # to the data beside it, and nowhere else
    assert {"case.yaml", "summary.json", "history.csv", "series.vtkhdf", "snapshots"} <= set(links)
    assert all((page.parent / link).exists() for link in links)
    assert "Lengths" in text
    assert "contact: " in text
    assert "connect-src 'none'" in text
    assert "ended as planned" in text
    two = report([plane, solid], plane.parent / "two.html").read_text(encoding="utf-8")
    assert "<script>alert" not in two
    assert "Side by side" in two


def test_debris_of_a_quarter_is_that_of_the_whole(solid):
    from hvisph.visualization.html.report import RunReport

    told = RunReport(solid)
    bodies = {row["name"].partition(":")[0] for row in told.content()["debris"]}
    assert bodies == set(told.last.bodies)
    assert max(row["particles"] for row in told.content()["debris"]) > 0.5 * 4 * told.last.count


def test_what_cannot_be_shown_is_said(tmp_path):
    with pytest.raises(CaseError, match="no run"):
        report([tmp_path / "absent"])
    with pytest.raises(CaseError, match="no snapshot: it holds nothing; give"):
        report([tmp_path])


@pytest.fixture(scope="module")
def browser():
    """Chromium without a window."""
    if not BROWSER:
        pytest.skip("needs Chromium: apt-get install chromium chromium-driver")
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    for flag in ("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
                 "--disable-component-update", "--disable-sync", "--window-size=1250,2400"):  # fmt: skip
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    options.binary_location = shutil.which("chromium")
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    yield driver
    driver.quit()


def opened(browser, page):
    """Load a page and wait until its player has drawn."""
    browser.get(f"file://{page}")
    end = time.monotonic() + 30.0
    while browser.execute_script("return document.body.dataset.ready") != "yes":
        assert time.monotonic() < end, browser.find_element("id", "trouble").text
        time.sleep(0.05)


PIXELS = """
const c = document.getElementById('canvas-0'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
let hash = 0, inked = 0;
for (let k = 0; k < d.length; k += 4) { if (d[k + 3]) inked++; hash = (hash * 31 + d[k] + 7 * d[k + 1] + 13 * d[k + 2]) | 0; }
return [hash, inked];
"""
CHANGE = (
    "const e = document.getElementById(arguments[0]); e.value = arguments[1]; e.dispatchEvent(new Event(arguments[2]))"
)


@pytest.fixture(scope="module")
def rings(tmp_path_factory):
    """The half-plane of a coarse impact about its axis."""
    case = load_case("sphere_on_plate_axisymmetric", ["time.end=1us", "output.every=0.5us"], "0.5 mm")
    return run(case, tmp_path_factory.mktemp("rings") / "rings").folder


@pytest.mark.parametrize("kind", ["plane", "solid", "rings"])
def test_a_browser_plays_the_run(browser, kind, request):
    folder = request.getfixturevalue(kind)
    opened(browser, report([folder], folder.parent / "page.html"))
    last, inked = browser.execute_script(PIXELS)
    assert inked > 1000
    browser.execute_script(CHANGE, "time", "0", "input")
    first, _ = browser.execute_script(PIXELS)
    assert first != last
    assert "0.00" in browser.find_element("id", "clock-0").text
    browser.find_element("id", "play").click()  # between the frames as well
    end = time.monotonic() + 20.0
    while browser.execute_script("return +document.body.dataset.frames") < 9 and time.monotonic() < end:
        time.sleep(0.1)
    assert browser.execute_script(PIXELS)[0] not in (first, last)
    browser.find_element("id", "play").click()
    browser.execute_script(CHANGE, "time", "0", "input")
    assert browser.execute_script(PIXELS)[0] == first
    browser.execute_script(CHANGE, "field-0", "pressure", "change")
    assert browser.execute_script(PIXELS)[0] != first
    assert "pressure" in browser.find_element("id", "ends-0").text
    browser.find_element("id", "body-1-0").click()
    assert browser.execute_script(PIXELS)[1] < inked
    browser.find_element("id", "body-1-0").click()
    before = browser.execute_script(PIXELS)
    browser.find_element("id", "canvas-0").send_keys("\ue014")  # the right arrow turns or moves it
    assert browser.execute_script(PIXELS)[0] != before[0]
    browser.find_element("id", "reset-0").click()
    assert browser.execute_script(PIXELS) == before
    if kind != "plane":  # a quarter or a half is shown as the whole, and can be shown as it is
        browser.find_element("id", "mirror-0").click()
        assert browser.execute_script(PIXELS) != before
    assert browser.execute_script("return performance.getEntriesByType('resource').length") == 0
    said = [line for line in browser.get_log("browser") if line["source"] != "rendering"]  # of reading pixels here
    assert said == []


@pytest.mark.parametrize("command", ["run", "resume"])
def test_a_run_writes_its_report_when_it_is_asked_to(command, plane, tmp_path):
    from typer.testing import CliRunner

    from hvisph.cli.main import app

    folder = tmp_path / "run"
    if command == "run":
        settings = ["--resolution", "0.5mm", "--set", "time.end=0.2us", "--set", "output.every=0.1us"]
        arguments = ["run", "al_al_coarse", *settings, "--out", str(folder), "--report"]
    else:
        shutil.copytree(plane, folder)
        arguments = ["resume", str(folder), "--report"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert f"Report: {folder / 'report.html'}" in result.output
    assert "ended as planned" in (folder / "report.html").read_text(encoding="utf-8")
