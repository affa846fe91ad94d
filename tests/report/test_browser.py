"""Pages as a browser shows them: no error, a series switched off, a zoom that is linked, another ride.

One browser is started for all of them. SIMRAIL_NO_BROWSER=1 leaves these tests out by name; without it a
browser that is missing is a failure, or nobody would notice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from simrail.campaign.cell import CellResult
from simrail.report.pages.estimate_page import RideEstimates, write_estimate_page
from simrail.report.pages.page import write_report
from simrail.report.tables.recorded import MethodResult
from simrail.scenario.scenario import Scenario, read_scenario
from simrail.track.rail_limits import EXAMPLE_LIMITS

pytestmark = pytest.mark.long

Rides = Callable[..., CellResult]
Tables = Callable[..., tuple[pd.DataFrame, pd.DataFrame]]

MANIFEST = {"command": "simrail run test", "seed": 1}


@pytest.fixture
def opened(chromium: Any) -> Iterator[Callable[..., Any]]:
    """Open a page; at the end nothing may have been written to its console as an error."""
    errors: list[str] = []
    contexts = []

    def open_page(path: Path, *, width: int = 1200, dark: bool = False) -> Any:
        scheme = "dark" if dark else "light"
        context = chromium.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on(
            "request", lambda request: None if request.url.startswith("file:") else errors.append(request.url)
        )
        page.goto(path.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert errors == []


CUT_OFF = """[...document.querySelectorAll('svg')].flatMap(svg => {
    const all = svg.getBoundingClientRect();
    return [...svg.querySelectorAll('text')].filter(text => {
        const own = text.getBoundingClientRect();
        return own.width && (own.left < all.left - 1 || own.right > all.right + 1);
    }).map(text => text.textContent.trim());
})"""
"""Words of figures that reach beyond their figure."""


def picture(page: Any, panel: int = 0) -> str:
    """What a panel shows, as a data URL."""
    return str(page.locator(".panel canvas").nth(panel).evaluate("canvas => canvas.toDataURL()"))


def zooms(page: Any) -> list[tuple[float, float]]:
    """From where to where each panel shows the ride, m."""
    ends = page.locator(".panel").evaluate_all("all => all.map(one => [+one.dataset.from, +one.dataset.to])")
    return [(low, high) for low, high in ends]


def drag(page: Any, first: float, last: float) -> None:
    """Drag over a part of the second panel's width."""
    box = page.locator(".panel canvas").nth(1).bounding_box()
    for act, share in ((page.mouse.down, first), (page.mouse.up, last)):
        page.mouse.move(box["x"] + share * box["width"], box["y"] + 30.0)
        act()


@pytest.fixture(scope="module")
def ride_page(
    tmp_path_factory: pytest.TempPathFactory, scenario: Scenario, example: Rides, tables: Tables
) -> Path:
    """Like that of go20a, with the ride back beside it."""
    examples = [example(), example(backward=True, name="back")]
    scores, cells = tables(*examples, draws=1)
    path = tmp_path_factory.mktemp("ride") / "report.html"
    write_report(path, scenario=scenario, scores=scores, cells=cells, examples=examples, manifest=MANIFEST)
    return path


def test_a_ride_is_explored(ride_page: Path, opened: Callable[..., Any]) -> None:
    page = opened(ride_page)
    assert page.locator(".panel").count() == 5, "errors and attitude"
    whole = zooms(page)
    assert len(set(whole)) == 1 and whole[0] == pytest.approx((10.0, 560.0), abs=1.0)

    before = picture(page)
    button = page.locator('button[data-series="ekf_compensated"]')
    button.click()
    assert button.get_attribute("aria-pressed") == "false" and picture(page) != before
    button.click()
    assert picture(page) == before, "switched on again it is as it was"

    drag(page, 0.3, 0.5)
    (low, high), *others = zooms(page)
    assert others == [(low, high)] * 4 and high - low == pytest.approx(0.2 * 550.0, rel=0.1)
    assert picture(page) != before and picture(page, 3) != picture(page, 4)
    page.get_by_role("button", name="whole ride").click()
    assert zooms(page) == whole and picture(page) == before

    box = page.locator(".panel canvas").first.bounding_box()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 20.0)
    values = page.locator(".panel output").first.inner_text()
    assert "EKF compensated 0.1" in values and "m" in values, "every error of it is 0.1 degrees"

    page.get_by_role("button", name="IMU", exact=True).click()
    assert page.locator(".panel").count() == 11
    page.locator('select[data-pick="ride"]').select_option("back")
    assert "towards decreasing" in page.locator("#rides-explorer .facts").text_content()


def test_what_is_seen_is_saved(ride_page: Path, opened: Callable[..., Any]) -> None:
    page = opened(ride_page, dark=True)
    with page.expect_download() as saved:
        page.get_by_role("button", name="save as SVG").nth(1).click()
    text = saved.value.path().read_text()
    assert text.startswith("<svg") and "var(--" not in text and "#1b2430" in text, (
        "colours are those of paper"
    )
    with page.expect_download() as saved:
        page.locator(".picks").get_by_role("button", name="save as SVG").click()
    text = saved.value.path().read_text()
    assert text.startswith("<svg") and "roll error" in text and text.count("<g transform") == 5


def test_a_campaign_fits_a_phone_and_opens_its_folded_parts(
    opened: Callable[..., Any], tmp_path: Path, scenario: Scenario, example: Rides, tables: Tables
) -> None:
    speeds = "speed_kmh = [20.0, 40.0]\nreverse = [false, true]"
    scenario = read_scenario(scenario.text.replace("speed_kmh = 40.0", speeds), name="test")
    rides = [example(backward=back, name="go") for back in (False, True)]
    scores, cells = tables(*rides, draws=2)
    cells = cells.assign(case=[0, 0, 1, 1], speed_kmh=40.0, direction=["forward"] * 2 + ["backward"] * 2)
    path = tmp_path / "report.html"
    write_report(path, scenario=scenario, scores=scores, cells=cells, examples=rides, manifest=MANIFEST)
    page = opened(path, width=390, dark=True)
    # A ride's words may be longer than a phone is wide.
    page.locator('select[data-pick="ride"] option').first.evaluate(
        "one => { one.textContent += ' and on'.repeat(9) }"
    )
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.locator("details").evaluate_all("all => all.forEach(one => { one.open = true })")
    assert page.evaluate(CUT_OFF) == []
    page.locator("details").evaluate_all("all => all.forEach(one => { one.open = false })")
    assert page.locator("figure .narrow svg").first.is_visible()
    assert not page.locator("figure .wide svg").first.is_visible()
    assert not page.locator("#words table").is_visible()
    page.locator('nav a[href="#words"]').click()
    assert page.locator("#words table").is_visible()
    screens = opened(path).evaluate("document.documentElement.scrollHeight / 900")
    assert screens < 8.0


def test_an_estimate_is_explored(opened: Callable[..., Any], tmp_path: Path, example: Rides) -> None:
    ride = example()
    path = tmp_path / "estimate.html"
    estimate = ride.estimates["ekf_compensated"]
    result = MethodResult("EKF", "EKF", "AttitudeEkf()", ride.recording, estimate, (), 0.2, ("briales_2021",))
    write_estimate_page(path, RideEstimates(ride.recording, (result,), EXAMPLE_LIMITS))
    page = opened(path)
    before = picture(page)
    page.locator('button[data-series="design"]').click()
    assert picture(page) != before
    drag(page, 0.2, 0.4)
    assert len(set(zooms(page))) == 1 and zooms(page)[0][1] < 300.0
    page.locator("details.bibtex summary").first.click()
    page.get_by_role("button", name="copy").first.click()
    # The page is told only later whether it may write to the clipboard.
    page.wait_for_function("document.querySelector('details.bibtex button').textContent !== 'copy'")
    selected = page.evaluate("getSelection().toString()")
    copied = page.locator("details.bibtex button").first.inner_text()
    assert copied == "copied" or "@article{briales_2021," in selected
