"""Each lesson served offline, opened in a real browser, one slider moved: its figure changes."""

import os
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator

import pytest

from simrail.lessons import LESSONS
from simrail.lessons.serve import free_port

LONG_S = 120.0
"""On a machine that compiles kernels first, and has other things to do."""


@pytest.fixture
def served(request: pytest.FixtureRequest) -> Iterator[str]:
    """Address of a lesson, served by the command without a way out: a proxy that is not there."""
    port = free_port()
    program = "from simrail.cli.main import main; main()"
    command = [sys.executable, "-c", program, "lesson", request.param, "--headless", "--port", str(port)]
    nowhere = dict.fromkeys(("HTTP_PROXY", "HTTPS_PROXY", "http_proxy", "https_proxy"), "http://127.0.0.1:9")
    server = subprocess.Popen(
        command,
        env={**os.environ, **nowhere},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    address = f"http://127.0.0.1:{port}/"
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        until = time.monotonic() + LONG_S
        while True:
            try:
                opener.open(address, timeout=5.0).close()
                break
            except OSError:
                assert time.monotonic() < until, "the lesson is not served"
                assert server.poll() is None, "the server has ended"
                time.sleep(0.2)
        yield address
    finally:
        os.killpg(server.pid, 15)
        server.wait(timeout=30.0)


FIGURES = "[...document.querySelectorAll('svg')].map(svg => svg.outerHTML).filter(text => text.length > 4000)"

SHOWN = """[...document.querySelectorAll('svg[role=img]')].map(svg => ({
    right: svg.getBoundingClientRect().right,
    wide: svg.getBoundingClientRect().width,
    scale: svg.getBoundingClientRect().width / svg.viewBox.baseVal.width * 72 / 96,
})).filter(one => one.wide > 0)"""


@pytest.mark.long
@pytest.mark.parametrize("served", LESSONS, indirect=True)
def test_a_slider_moves_a_figure(chromium, served):
    page = chromium.new_page(viewport={"width": 1200, "height": 1000})
    errors: list[str] = []
    asked: list[str] = []
    page.on("console", lambda one: errors.append(one.text) if one.type == "error" else None)
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("request", lambda one: asked.append(one.url))
    page.goto(served)
    page.wait_for_function(
        "document.body.innerText.includes('What this lesson claims')", timeout=1e3 * LONG_S
    )
    before = page.evaluate(FIGURES)
    assert before, "no figure is shown"
    assert "\N{BALLOT X}" not in page.inner_text("body")
    # Its ground is that of the notebook: what has no colour is painted black.
    ground = "getComputedStyle(document.querySelector('svg[role=img] path')).fill"
    assert page.evaluate(ground) == "rgb(255, 255, 255)"
    slider = page.locator("[role=slider]").first
    slider.focus()
    for _ in range(4):
        slider.press("ArrowRight")
    changed = f"before => JSON.stringify({FIGURES}) !== JSON.stringify(before)"
    page.wait_for_function(changed, arg=before, timeout=1e3 * LONG_S)
    # On a phone others stand there, made for its width: words keep their size, nothing is pushed aside.
    shown = page.evaluate(SHOWN)
    page.set_viewport_size({"width": 390, "height": 800})
    page.wait_for_function(f"{SHOWN}.every(one => one.right <= innerWidth)")
    on_phone = page.evaluate(SHOWN)
    assert len(on_phone) == len(shown) > 0
    assert min(one["scale"] for one in on_phone) > 0.9
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.close()
    assert errors == []
    away = [url for url in asked if not url.startswith((served, "data:", "blob:"))]
    assert away == [], away
