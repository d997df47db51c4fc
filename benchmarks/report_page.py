"""What the report of a run takes: to make, to send, to open and to play in a browser.

    python benchmarks/report_page.py RUN [RUN ...]

Needs Chromium and its driver (`apt-get install chromium chromium-driver`) and selenium. The first paint is the browser's
own figure; frames a second are those of the player, drawn as fast as it can by the animation's own clock.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

from selenium import webdriver

from hvisph.report.build import report

PLAY = """
const done = arguments[arguments.length - 1], play = document.getElementById('play'), slider = document.getElementById('time');
slider.value = 0; slider.dispatchEvent(new Event('input'));
const before = +document.body.dataset.frames, began = performance.now();
play.click();
setTimeout(() => { const frames = +document.body.dataset.frames - before, seconds = (performance.now() - began) / 1000;
                   done([frames / seconds, +document.body.dataset.milliseconds]); }, 3000);
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


def main() -> None:
    """Print a line a run."""
    driver, place = browser(), Path(tempfile.mkdtemp(prefix="report_page"))
    print("run, particles shown x frames: MB, s to make (of processor time), ms to first paint, frames/s, ms a frame")
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
        rate, each = driver.execute_async_script(PLAY)
        size = page.stat().st_size / 1e6
        print(
            f"{Path(name).name}, {shown}: {size:.2f} MB, {seconds:.1f} s, {paint[0]:.0f} ms, {rate:.0f}/s, {each:.1f} ms"
        )
    driver.quit()


if __name__ == "__main__":
    main()
