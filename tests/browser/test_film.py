"""A film in a real browser: what is drawn, what moves, what is chosen; and nothing leaves the machine."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrail import load_scenario
from simrail.report.film.film import FRAME_HZ, Film, film_of
from simrail.report.film.page import write_film

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def film(own_cache: None) -> Film:
    """A short ride with forces, of the engine that starts soonest."""
    settings = ["engine=compiled", "ride.end_m=40.0", "ride.speed_kmh=30", "ride.rest_s=1.0"]
    return film_of(load_scenario("quick_kinematic", overrides=settings))


_SUMS = """id => {
  const c = document.getElementById(id), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
  const sum = [0, 0, 0];
  for (let i = 0; i < d.length; i += 4) for (let k = 0; k < 3; k++) sum[k] += d[i + k];
  return sum;
}"""


class Opened:
    """A film in a page, with what it said and asked for."""

    def __init__(self, chromium, path: Path, hash_: str, size: tuple[int, int] = (1280, 900)) -> None:
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.page = chromium.new_page(viewport={"width": size[0], "height": size[1]})
        self.page.on("console", lambda one: self.errors.append(one.text) if one.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda one: self.requests.append(one.url))
        self.page.goto(f"{path.as_uri()}#{hash_}")
        self.page.wait_for_function("window.film && window.film.state.drawn > 0")

    def picture(self, canvas: str) -> list[int]:
        """Sum of each colour over a canvas: another picture has others."""
        return self.page.evaluate(_SUMS, canvas)

    def settle(self) -> None:
        """Until what was changed has been drawn."""
        self.page.wait_for_function("!window.film.state.dirty")


@pytest.fixture(scope="module")
def path(film: Film, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_film(tmp_path_factory.mktemp("film") / "film.html", film)


@pytest.fixture
def opened(chromium, path: Path):
    one = Opened(chromium, path, "t=5&play=0")
    yield one
    one.page.close()
    assert one.errors == []
    assert all(url.startswith("file:") for url in one.requests), one.requests


def test_what_is_drawn_is_what_the_film_holds(opened, film):
    row = round(5.0 * FRAME_HZ)
    assert opened.page.evaluate("film.frame") == row
    assert opened.page.inner_text("#place") == f"s = {film.reference_m[row]:.1f} m"
    roll = np.rad2deg(film.true_rad[row, 0])
    shown = opened.page.evaluate("document.querySelector('#strips span span').textContent")
    assert float(shown) == pytest.approx(roll, abs=0.006)
    for canvas in ("scene", "front", "horizon", "signals"):
        assert min(opened.picture(canvas)) > 0, canvas


def test_scrub_moves_every_picture_and_the_cursor(opened):
    # Without a method only what is true is left to move.
    opened.page.evaluate("film.choose(null)")
    opened.settle()
    before = {name: opened.picture(name) for name in ("scene", "front", "horizon")}
    moved = opened.page.evaluate("document.querySelector('#strips > div').style.transform")
    opened.page.locator("#scrub").fill("8")
    opened.settle()
    assert opened.page.evaluate("film.frame") == 8 * FRAME_HZ
    assert opened.page.evaluate("document.querySelector('#strips > div').style.transform") != moved
    for name, picture in before.items():
        assert opened.picture(name) != picture, name


def test_method_choice_changes_signals_and_horizon(opened, film):
    before = {name: opened.picture(name) for name in ("signals", "horizon", "scene")}
    opened.page.select_option("#method", "design_angles")
    opened.settle()
    for name, picture in before.items():
        assert opened.picture(name) != picture, name
    row = round(5.0 * FRAME_HZ)
    words = opened.page.evaluate("document.querySelector('#strips > span').innerText").split()
    assert float(words[1]) == pytest.approx(
        np.rad2deg(film.estimated_rad["design_angles"][row, 0]), abs=0.006
    )


def test_frames_follow_the_clock(opened):
    opened.page.evaluate("film.seek(0)")
    opened.page.click("#play")
    began = opened.page.evaluate("performance.now() - 1e3 * film.state.t")
    time.sleep(1.5)
    state = opened.page.evaluate("({t: film.state.t, now: performance.now(), drawn: film.state.drawn})")
    # The last frame was drawn at most one frame of the slowest machine ago, however few there were.
    assert state["t"] == pytest.approx((state["now"] - began) / 1e3, abs=0.6)
    assert state["drawn"] > 2
    # A page that hangs draws nothing meanwhile; afterwards the film is where the clock is.
    hung = "const t = film.state.t, now = performance.now(); while (performance.now() < now + 1500); [t, now]"
    before = opened.page.evaluate(hung)
    opened.page.wait_for_function(f"film.state.t > {before[0]} + 0.5")
    after = opened.page.evaluate("[film.state.t, performance.now()]")
    assert after[0] - before[0] == pytest.approx((after[1] - before[1]) / 1e3, abs=0.6)
    opened.page.select_option("#speed", "2")
    a = opened.page.evaluate("[film.state.t, performance.now()]")
    time.sleep(1.5)
    b = opened.page.evaluate("[film.state.t, performance.now()]")
    assert (b[0] - a[0]) / (b[1] - a[1]) * 1e3 == pytest.approx(2.0, rel=0.35)
    opened.page.click("#play")
    stopped = opened.page.evaluate("film.state.t")
    time.sleep(0.3)
    assert opened.page.evaluate("film.state.t") == stopped


def test_sliders_cameras_and_colours_change_the_picture(opened):
    def changed(act) -> bool:
        before = opened.picture("scene")
        act()
        opened.settle()
        return opened.picture("scene") != before

    page = opened.page
    assert changed(lambda: page.locator("#exaggeration").fill("30"))
    for view in ("line", "ahead", "wheel", "top", "follow"):
        assert changed(lambda view=view: page.click(f"[data-view={view}]"))
    assert changed(lambda: page.uncheck("#car"))
    assert changed(lambda: page.uncheck("#arrows"))
    assert changed(lambda: page.click("#theme"))
    page.mouse.move(300, 300)
    page.mouse.down()

    def drag() -> None:
        page.mouse.move(400, 330)
        page.mouse.up()

    assert changed(drag)


def test_fits_a_telephone_and_does_without_methods_and_forces(chromium, film, tmp_path):
    bare = replace(
        film,
        estimated_rad={},
        contacts={},
        signals=tuple(replace(signal, methods={}) for signal in film.signals),
    )
    one = Opened(chromium, write_film(tmp_path / "bare.html", bare), "t=5&play=0", size=(390, 844))
    assert one.page.evaluate("document.documentElement.scrollWidth") <= 390
    assert one.page.locator("#method, #arrows").count() == 0
    assert min(one.picture("front")) > 0
    one.page.close()
    assert one.errors == []
