"""What the report of a run takes: to make, to send, to open and to play in a browser.

    python benchmarks/report_page.py RUN [RUN ...]

Needs Chromium and its driver (`apt-get install chromium chromium-driver`) and selenium. The first paint is the browser's
own figure. Frames a second are those of the player, by the animation's own clock, which another load on the machine slows;
what the page itself takes is processor time a frame: of the player's script, and of the whole browser, all its processes,
painting without a graphics processor included. 1000 over the latter is how many frames a second one core can show.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

from selenium import webdriver

from hvisph.visualization.html.report import report

PLAY = """
const done = arguments[arguments.length - 1], play = document.getElementById('play'), slider = document.getElementById('time');
slider.value = 0; slider.dispatchEvent(new Event('input'));
const before = +document.body.dataset.frames, began = performance.now();
play.click();
setTimeout(() => { const frames = +document.body.dataset.frames - before, seconds = (performance.now() - began) / 1000;
                   done([frames / seconds, frames]); }, 5000);
"""
PAINT = "return performance.getEntriesByType('paint').filter(e => e.name === 'first-contentful-paint').map(e => e.startTime)"


def browser():
    """Return Chromium without a window."""
    options = webdriver.ChromeOptions()
    for flag in ("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
                 "--disable-component-update", "--disable-sync", "--window-size=1250,2400"):  # fmt: skip
        options.add_argument(flag)
    options.binary_location = shutil.which("chromium")
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    driver.set_script_timeout(30)
    return driver


def processor_seconds(root: int) -> float:
    """Return user and system time of a process and of all that it started [s], from /proc."""
    total, parents = {}, {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:  # it has ended
                continue
            parents[int(entry.name)] = int(fields[1])
            total[int(entry.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    family, growing = {root}, True
    while growing:
        growing = {child for child, parent in parents.items() if parent in family} - family
        family |= growing
    return sum(total.get(one, 0.0) for one in family)


def script_seconds(driver) -> float:
    """Return the processor time of the page's script so far [s]."""
    metrics = driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
    return next(metric["value"] for metric in metrics if metric["name"] == "ScriptDuration")


def played(driver) -> tuple[float, float, float]:
    """Return frames a second, and processor time a frame of the script and of the whole browser [ms]."""
    driver.execute_cdp_cmd("Performance.enable", {"timeDomain": "threadTicks"})
    root = driver.service.process.pid
    whole, script = processor_seconds(root), script_seconds(driver)
    rate, frames = driver.execute_async_script(PLAY)
    whole, script = processor_seconds(root) - whole, script_seconds(driver) - script
    return rate, 1e3 * script / frames, 1e3 * whole / frames


def main() -> None:
    """Print a line a run."""
    driver, place = browser(), Path(tempfile.mkdtemp(prefix="report_page"))
    print("run, particles shown x frames: MB, s to make (of processor time), ms to first paint,")
    print("frames/s on this machine now, ms of processor time a frame: of the script, of the whole browser")
    for name in sys.argv[1:]:
        began = time.process_time()
        page = report([name], place / f"{Path(name).name}.html")
        seconds = time.process_time() - began
        driver.get("about:blank")
        driver.get(f"file://{page}")
        while driver.execute_script("return document.body.dataset.ready") != "yes":
            time.sleep(0.05)
        shown = driver.execute_script("return document.body.dataset.shown")
        paint = driver.execute_script(PAINT)
        rate, script, total = played(driver)
        size = page.stat().st_size / 1e6
        print(
            f"{Path(name).name}, {shown}: {size:.2f} MB, {seconds:.1f} s, {paint[0]:.0f} ms, {rate:.0f}/s, {script:.1f} ms, "
            f"{total:.1f} ms"
        )
    driver.quit()


if __name__ == "__main__":
    main()
