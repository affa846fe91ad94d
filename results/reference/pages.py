"""How fast the explorer of a page is, beside plotly if that is there: ``python results/reference/pages.py``.

Six panels of five series of 4000 points, offline, in headless Chromium at 1200 x 900: time until they are
painted, for a zoom of all panels, for a series that is switched off, elements of the page, and its size.
Figures of one run compare with each other only.
"""

import shutil
import time
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from playwright.sync_api import sync_playwright

from simrail.report.figures.views import Axes, Look, Panel, View, line
from simrail.report.pages.explorer import explorer_data
from simrail.report.pages.frame import page_text

PANELS, SERIES, POINTS = 6, 5, 4000
PAINTED = "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"


def signals() -> np.ndarray:
    """Random walks (panels, series, points)."""
    return np.cumsum(np.random.default_rng(1).normal(size=(PANELS, SERIES, POINTS)), axis=2)


def our_page() -> str:
    """A page with our explorer; a bin has two points."""
    axes, x = Axes(POINTS // 2), np.linspace(0.0, 2000.0, POINTS)
    bins = axes.of("motion", x)
    panels = tuple(
        Panel("all", f"panel {k}", "1", "motion", tuple(line(f"s{i}", bins, y) for i, y in enumerate(own)))
        for k, own in enumerate(signals())
    )
    view = View({"ride": "made up"}, (), 1, "distance, m", (), axes.arrays, panels)
    looks = {f"s{i}": Look(f"series {i}", "test", f"#{40 * i:02x}6090") for i in range(SERIES)}
    shown = explorer_data([view], looks)
    section = page_text("pages/sections/explorer.html.j2", left_out=0, methods_left_out=0, **shown)
    style, script = (
        files("simrail.report").joinpath(f"pages/{name}").read_text(encoding="utf-8")
        for name in ("style.css.j2", "page.js")
    )
    return f"<!DOCTYPE html><style>{style}</style><main>{section}</main><script>{script}</script>"


def plotly_page() -> str:
    """The same by plotly, its bundle inlined."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    figure = make_subplots(rows=PANELS, cols=1, shared_xaxes=True)
    x = np.linspace(0.0, 2000.0, POINTS).astype("f4")
    for row, own in enumerate(signals(), 1):
        for i, y in enumerate(own):
            figure.add_trace(
                go.Scatter(x=x, y=y.astype("f4"), legendgroup=i, name=f"series {i}"), row=row, col=1
            )
    return str(figure.update_layout(height=900).to_html(include_plotlyjs=True))


ACTS = {
    "ours": (
        "document.querySelectorAll('.panels')[0].dispatchEvent(new KeyboardEvent('keydown', {key: '+'}))",
        "document.querySelector('button[data-series]').click()",
    ),
    "plotly": (
        "Plotly.relayout(document.querySelector('.js-plotly-plot'), {'xaxis.range': [400, 1600]})",
        "Plotly.restyle(document.querySelector('.js-plotly-plot'), {visible: 'legendonly'}, "
        "[0, 5, 10, 15, 20, 25])",
    ),
}
"""What zooms, and what switches a series off."""


def main() -> None:
    """Measure, and print a table."""
    pages = {"ours": our_page()} | ({"plotly": plotly_page()} if find_spec("plotly") else {})
    print(f"{'':8}{'MB':>8}{'painted s':>11}{'zoom s':>8}{'hide s':>8}{'elements':>10}")
    with TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = shutil.which("chromium") or shutil.which("google-chrome")
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        for name, text in pages.items():
            file = Path(folder) / f"{name}.html"
            file.write_text(text, encoding="utf-8")
            page = browser.new_page(viewport={"width": 1200, "height": 900})
            times = [time.perf_counter()]
            page.goto(file.as_uri())
            page.evaluate(PAINTED)
            times.append(time.perf_counter())
            for act in ACTS[name]:
                page.evaluate(f"() => {{ {act}; }}")
                page.evaluate(PAINTED)
                times.append(time.perf_counter())
            count = page.evaluate("document.querySelectorAll('*').length")
            columns = "".join(
                f"{value:{wide}.2f}" for value, wide in zip(np.diff(times), (11, 8, 8), strict=True)
            )
            print(f"{name:8}{file.stat().st_size / 1e6:8.2f}{columns}{count:10}")
        browser.close()


if __name__ == "__main__":
    main()
