"""Sections on rides: errors over distance of the best methods, and the explorer of all that is kept of them.

The explorer is some 390 lines of our own on canvases (``page.js``, 20 kB). With 6 panels of 5 series of
4000 points, offline, in headless Chromium on a shared machine (``results/reference/pages.py``), its page has
0.4 MB and 69 elements and is painted in 0.8 to 2.0 s. With plotly, the only such library with a bundle on
PyPI, it has 6.2 MB and 1027 elements and takes 4.6 to 10 s. uPlot is as light as ours, but its home is npm,
so that a wheel would have to carry a copy of it. Ours saves what is seen as SVG, and follows dark mode.
"""

import json
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from markupsafe import Markup

from simrail.report.figures import canvas
from simrail.report.figures.panels import panels_figure
from simrail.report.figures.views import ATTITUDES, ERRORS, RAILS, Look, View, as_data, from_data
from simrail.report.pages.section import PageData, Section
from simrail.report.words.findings import one_of_each

OPEN = (ERRORS, ATTITUDES)
"""Groups of panels that are open at first where the scenario does not ask for rails."""


def explorer_section(data: PageData) -> list[Section]:
    """The explorer; none without rides."""
    views = data.views
    if not views:
        return []
    off = [s.name for s in data.styles if s.baseline and s.uses_imu]
    first = (RAILS,) if data.asks_of_rails else ("ride", "forces") if data.asks_of_ride else OPEN
    shown = explorer_data(views, data.looks, off=off, first=first)
    case = next(iter(data.shown_cases), None)
    unlike = one_of_each(case, data.styles) if case else data.styles
    kept = {style.name for style in data.kept_styles}
    shown["methods_left_out"] = sum(not s.baseline and s.name not in kept for s in unlike)
    shown["left_out"] = max(int(data.cells["cell"].nunique()) - len(views), 0)
    return [Section("explorer", "Explorer of rides", "pages/sections/explorer.html.j2", shown)]


def explorer_data(
    views: Sequence[View],
    looks: Mapping[str, Look],
    *,
    off: Sequence[str] = (),
    first: Sequence[str] = OPEN,
) -> dict[str, Any]:
    """What the template of an explorer shows.

    Parameters
    ----------
    views : sequence of View
        Rides, the one that is shown first before the others.
    looks : dict of str to Look
        Of their series.
    off : sequence of str
        Series that are switched off at first.
    first : sequence of str
        Groups of panels that are open at first, of those that there are.
    """
    groups = list(dict.fromkeys(panel.group for panel in views[0].panels))
    opened = [group for group in first if group in groups] or groups[:1]
    used = {one.key for view in views for panel in view.panels for one in panel.series}
    data = {
        "looks": {
            key: {**vars(look), "dash": list(look.dash) or None, "night": _by_night(look.colour)}
            for key, look in looks.items()
            if key in used
        },
        "off": list(off),
        "open": opened,
        "views": [as_data(view) for view in views],
    }
    text = json.dumps(data, separators=(",", ":"), ensure_ascii=False)
    # Nothing in it may end the element that holds it.
    return {"data": Markup(text.replace("<", "\\u003c"))}


def _by_night(colour: str) -> str:
    """A colour of a series in dark mode; "" of what has one of the page's."""
    return canvas.by_night(colour.lower()) if colour.startswith("#") else ""


def stored_rides(page: str) -> tuple[list[View], dict[str, Look]]:
    """Views of a page, and looks of their series, as `explorer_data` wrote them; none if it has none."""
    begin = '<script type="application/json" id="rides">'
    if begin not in page:
        return [], {}
    text = page[page.index(begin) + len(begin) :]
    data = json.loads(text[: text.index("</script>")])
    looks = {
        key: Look(look["label"], look["kind"], look["colour"], tuple(look["dash"] or ()))
        for key, look in data["looks"].items()
    }
    return [from_data(view) for view in data["views"]], looks


def ride_figures(views: Sequence[View], looks: Mapping[str, Look]) -> None:
    """Offer each group of panels of each view to `simrail.report.figures.canvas.only`."""
    for number, view in enumerate(views, 1):
        for group in dict.fromkeys(panel.group for panel in view.panels):
            name = f"ride-{number}-{group.replace(', ', '-').replace(' ', '-')}"
            canvas.drawn(name, partial(panels_figure, view, group, looks, what=f"{group}, {view.title}"))


def distance_figures(data: PageData) -> list[tuple[str, canvas.Drawing]]:
    """Errors over distance, and rails, of the two best methods and no IMU on the first view."""
    views = data.views
    if not views:
        return []
    view, leading = views[0], data.leading
    names = [style.label for style in leading]
    by_method = ", ".join(names)
    figures = []
    groups = {panel.group for panel in view.panels}
    for group, words in ((RAILS, "Rails"), (ERRORS, "Errors")):
        if group not in groups or (group == RAILS and not data.asks_of_rails):
            continue
        caption = f"{words} over distance, {view.title}: {by_method}."
        keys = [style.name for style in leading]
        make = partial(panels_figure, view, group, data.looks, what=caption, keys=keys)
        drawing = canvas.drawn(f"{group}-over-distance", make)
        figures.append((caption, drawing))
    return [(caption, drawing) for caption, drawing in figures if drawing]
