"""How fast films and lessons are: measured, not asserted, since a machine has other things to do.

    python tests/benchmarks/page_rates.py [--film FILE.html ...] [--lessons] [--pictures DIR]

Needs the extra ``test`` and a Chromium (``SIMRAIL_BROWSER`` names another than the one on the path).
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

from simrail.lessons import LESSONS
from simrail.lessons.serve import free_port

SIZES = ((1200, 700), (1400, 950), (390, 844))
FIGURES = "[...document.querySelectorAll('svg')].map(svg => svg.outerHTML).filter(text => text.length > 4000)"
READY = "document.body.innerText.includes('What this lesson claims')"


def film(browser: Browser, path: Path) -> None:
    """Frames per second, and whether the film's clock keeps step with the wall's."""
    print(f"{path.name}: {path.stat().st_size / 1e6:.2f} MB")
    for wide, tall in SIZES:
        page = browser.new_page(viewport={"width": wide, "height": tall})
        begun = time.perf_counter()
        page.goto(f"{path.resolve().as_uri()}#t=1&play=1")
        page.wait_for_function("window.film && window.film.state.drawn > 0")
        first = time.perf_counter() - begun
        page.wait_for_timeout(2500)
        told = "[film.state.drawn, film.state.t, performance.now() / 1e3]"
        before = page.evaluate(told)
        page.wait_for_timeout(6000)
        after = page.evaluate(told)
        frames, run, wall = (b - a for a, b in zip(before, after, strict=True))
        scene = page.evaluate(
            "[document.getElementById('scene').width, document.getElementById('scene').height]"
        )
        print(
            f"  window {wide} x {tall}, picture {scene[0]} x {scene[1]} dots: "
            f"first frame after {first:.1f} s, {frames / wall:.1f} frames/s, "
            f"{run / wall:.3f} s of film in a second"
        )
        page.close()


def served(name: str) -> tuple[subprocess.Popen[bytes], str, float]:
    """A lesson's server, its address, and how long it took to answer."""
    port = free_port()
    program = "from simrail.cli.main import main; main()"
    command = [sys.executable, "-c", program, "lesson", name, "--headless", "--port", str(port)]
    begun = time.perf_counter()
    server = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    address = f"http://127.0.0.1:{port}/"
    while True:
        try:
            urllib.request.urlopen(address, timeout=5.0).close()
            return server, address, time.perf_counter() - begun
        except OSError:
            time.sleep(0.05)


def lesson(browser: Browser, name: str, pictures: Path | None) -> None:
    """Seconds from the command to the first figure and to the claims, and from a slider to its figure."""
    begun = time.perf_counter()
    server, address, up = served(name)
    try:
        page = browser.new_page(viewport={"width": 1200, "height": 1000})
        page.goto(address)
        page.wait_for_function(f"{FIGURES}.length > 0", timeout=3e5)
        first = time.perf_counter() - begun
        page.wait_for_function(READY, timeout=3e5)
        whole = time.perf_counter() - begun
        page.wait_for_timeout(1000)
        slider = page.locator("[role=slider]").first
        slider.focus()
        trips = []
        for key in ["ArrowRight"] * 4 + ["ArrowLeft"] * 2:
            # The first figure is the slider's own: others may follow later.
            before = page.evaluate(f"{FIGURES}[0]")
            pressed = time.perf_counter()
            slider.press(key)
            page.wait_for_function(f"before => {FIGURES}[0] !== before", arg=before, timeout=6e4, polling=20)
            trips.append(time.perf_counter() - pressed)
            page.wait_for_timeout(1500)
        told = ", ".join(f"{trip:.2f}" for trip in trips)
        print(
            f"{name}: served {up:.1f} s, first figure {first:.1f} s, all {whole:.1f} s; "
            f"slider to figure {told} s"
        )
        if pictures is not None:
            tall = page.evaluate(
                "Math.max(...[...document.querySelectorAll('*')].map(one => one.scrollHeight))"
            )
            page.set_viewport_size({"width": 1200, "height": int(tall) + 40})
            page.wait_for_timeout(800)
            page.screenshot(path=pictures / f"{name}.png")
        page.close()
    finally:
        os.killpg(server.pid, 15)
        server.wait(timeout=30.0)


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--film", nargs="*", type=Path, default=[])
    parser.add_argument("--lessons", nargs="*", metavar="NAME")
    parser.add_argument("--pictures", type=Path)
    told = parser.parse_args()
    if told.pictures is not None:
        told.pictures.mkdir(parents=True, exist_ok=True)
    browser_path = os.environ.get("SIMRAIL_BROWSER") or shutil.which("chromium")
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=browser_path, args=["--no-sandbox"])
        print(f"Chromium {browser.version}, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        for path in told.film:
            film(browser, path)
        for name in [] if told.lessons is None else told.lessons or LESSONS:
            lesson(browser, name, told.pictures)
        browser.close()


if __name__ == "__main__":
    main()
