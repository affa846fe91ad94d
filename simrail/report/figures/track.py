"""Figures of the track: its plan, profile, curvature and cant."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from simrail.core.jit import FloatArray
from simrail.report.figures.canvas import (
    INK,
    MUTED,
    add_panel,
    look,
    panels,
    places_of,
    shade_places,
    to_svg,
    width_in,
)
from simrail.report.words.sentences import listed
from simrail.track.design import CURVE, STRAIGHT, TRANSITION, Curve, TrackDesign

_KIND_COLOUR = {STRAIGHT: "#98a1af", TRANSITION: "#56B4E9", CURVE: "#D55E00"}
_ROOM_IN = (0.66, 0.34)
"""Width and height that the words of a curve need for themselves."""
_AWAY = 26.0
"""Points from a curve to the middle of its words."""
_SIDE_IN = 0.45
"""Left and right of the plan."""
_HALF_NAME_IN = 0.36
"""Half the width of a curve's words, as "cant 150 mm" has it."""
_KIND_WORD = {STRAIGHT: "straight", TRANSITION: "transition", CURVE: "curve"}


def plan_figure(track: TrackDesign, *, stops: dict[str, float]) -> str:
    """Plan of the track, with its curves named and the stops of the rides marked.

    Parameters
    ----------
    track : TrackDesign
        The design.
    stops : dict of str to float
        Label and position s of the places to mark.
    """
    with look():
        s = np.linspace(track.start_m, track.end_m, 1500)
        xy = track.frame(s).position[:, :2]
        turned = _along_the_page(xy)
        span = np.ptp(turned, axis=0)
        wide = width_in() - 2.0 * _SIDE_IN
        tall = float(np.clip(wide * (span[1] / span[0]) + 1.1, 1.8, 4.2))
        figure = Figure(figsize=(width_in(), tall + 0.4))
        axis = add_panel(figure, _SIDE_IN, 0.12, wide, tall)
        kind = track.kind(s)
        steps = np.flatnonzero(np.diff(kind)) + 1
        named: set[int] = set()
        for part in np.split(np.arange(len(s)), steps):
            k = int(kind[part[0]])
            reach = np.append(part, min(part[-1] + 1, len(s) - 1))
            word = _KIND_WORD[k] if k not in named else None
            axis.plot(*turned[reach].T, color=_KIND_COLOUR[k], lw=3.0, solid_capstyle="butt", label=word)
            named.add(k)
        room = _ROOM_IN[0] / wide * span[0], _ROOM_IN[1] / wide * span[0]
        marked = {label: _place(at, s, turned) for label, at in stops.items()}
        _name_curves(axis, track, s, turned, room=room, marked=list(marked.values()))
        _mark_stops(axis, marked, room[0])
        axis.set_aspect("equal", adjustable="datalim")
        axis.margins(x=0.03, y=0.22)
        axis.grid(False)
        axis.set(xticks=[], yticks=[])
        axis.spines[:].set_visible(False)
        axis.legend(loc="upper left", bbox_to_anchor=(0.0, 1.0 + 0.26 / tall), ncols=3)
        _scale_bar(axis, span[0])
        return to_svg(figure, description=f"Plan of the track {track.name}")


FLAT_M = 1e-6
"""Height, or cant, that changes by less is none."""


def profile_figure(track: TrackDesign) -> str:
    """Curvature over distance, with height above and cant below it where the line has any."""
    with look():
        s, height, cant = _profile(track)
        is_level, has_cant = np.ptp(height) < FLAT_M, np.abs(cant).max() > FLAT_M
        figure, axes = panels([*([] if is_level else [1.35]), 1.2, *([1.2] if has_cant else [])], top_in=0.12)
        rest = list(axes)
        if not is_level:
            axis = rest.pop(0)
            span = max(float(np.ptp(height)), 1.0)
            floor = float(height.min()) - 0.1 * span
            axis.fill_between(s, height, floor, color="#e8ebf0", lw=0)
            axis.plot(s, height, color=INK, lw=1.4)
            axis.set(ylim=(floor, float(height.min()) + 1.35 * span), ylabel="height, m")
        rest[0].plot(s, 1e3 * track.curvature(s), color="#D55E00", lw=1.4)
        rest[0].set_ylabel("curvature, 1/km")
        if has_cant:
            rest[1].plot(s, 1e3 * cant, color="#0072B2", lw=1.4)
            rest[1].set_ylabel("cant, mm")
        for axis in rest:
            axis.axhline(0.0, color="#b8bec8", lw=0.7, zorder=-1)
        shade_places(axes, places_of(track), limits=(track.start_m, track.end_m))
        axes[-1].set_xlabel("distance along the track, m")
        return to_svg(figure, description=profile_words(track))


def profile_words(track: TrackDesign) -> str:
    """Caption of `profile_figure`: what it shows, and what the line has none of."""
    _, height, cant = _profile(track)
    shown, none = ["curvature (positive to the left)"], []
    if np.ptp(height) < FLAT_M:
        none.append("is level")
    else:
        shown.insert(0, "height")
    if np.abs(cant).max() > FLAT_M:
        shown.append("cant (positive with the right rail raised, as a left curve needs)")
    else:
        none.append("has no cant")
    return f"Design {listed(shown)} over distance." + (f" The line {listed(none)}." if none else "")


def _profile(track: TrackDesign) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distance, height and cant (positive with the right rail raised), m."""
    s = np.linspace(track.start_m, track.end_m, 700)
    frame = track.frame(s)
    return s, frame.position[:, 2], -track.rail_base_m * np.sin(frame.roll_rad)


def _along_the_page(xy: FloatArray) -> FloatArray:
    """Turn a plan so that it runs from left to right; left stays up."""
    plan: FloatArray = xy - xy[0]
    chord = plan[-1]
    if np.hypot(*chord) < 0.2 * np.abs(np.diff(plan, axis=0)).sum():
        return plan
    angle = np.arctan2(chord[1], chord[0])
    c, s = np.cos(angle), np.sin(angle)
    turned: FloatArray = plan @ np.array([[c, -s], [s, c]])
    return turned


def _place(at_m: float, s: FloatArray, xy: FloatArray) -> tuple[float, float]:
    return float(np.interp(at_m, s, xy[:, 0])), float(np.interp(at_m, s, xy[:, 1]))


def _mark_stops(axis: Axes, places: dict[str, tuple[float, float]], room_m: float) -> None:
    """Circles with their words below them, or to the sides of circles that are close together."""
    left = min(places.values())
    close = np.ptp([place[0] for place in places.values()]) < room_m
    for label, place in places.items():
        axis.plot(*place, marker="o", ms=6, mfc="white", mec=INK, mew=1.3, zorder=5)
        shift, side = (0, "center") if not close else (-7, "right") if place == left else (7, "left")
        axis.annotate(
            label, place, (shift, -15), textcoords="offset points", ha=side, fontsize=8.4, color=INK
        )


def _name_curves(
    axis: Axes,
    track: TrackDesign,
    s: FloatArray,
    xy: FloatArray,
    *,
    room: tuple[float, float],
    marked: Sequence[tuple[float, float]],
) -> None:
    """Radius and cant of each curve on its outer side, but of one whose words would lie on another's."""
    words_m = _AWAY / 72.0 / _ROOM_IN[0] * room[0]
    # The word of a stop stands below its circle.
    taken = [np.array([x, y - 0.5 * words_m]) for x, y in marked]
    start = track.start_m
    for element in track.elements:
        middle = start + 0.5 * element.length_m
        start += element.length_m
        if not isinstance(element, Curve):
            continue
        i = int(np.clip(np.searchsorted(s, middle), 1, len(s) - 2))
        tangent = xy[i + 1] - xy[i - 1]
        outside = -np.sign(element.radius_m) * np.array([-tangent[1], tangent[0]]) / np.hypot(*tangent)
        place = xy[i] + words_m * outside
        if all((np.abs(place - other) > room).any() for other in taken):
            taken.append(place)
            # At the ends of the line a name would reach over the edge of the figure.
            share = (xy[i, 0] - xy[:, 0].min()) / max(float(np.ptp(xy[:, 0])), 1e-9)
            at_in = _SIDE_IN + share * (width_in() - 2.0 * _SIDE_IN) + _AWAY / 72.0 * outside[0]
            inside_in = np.clip(at_in, _HALF_NAME_IN, width_in() - _HALF_NAME_IN) - at_in
            axis.annotate(
                f"R {abs(element.radius_m):.0f} m"
                + (f"\ncant {1e3 * abs(element.cant_m):.0f} mm" if element.cant_m else ""),
                (float(xy[i, 0]), float(xy[i, 1])),
                (_AWAY * outside[0] + 72.0 * inside_in, _AWAY * outside[1]),
                textcoords="offset points",
                ha="center",
                va="center",
                fontsize=7.8,
                color=MUTED,
                linespacing=1.25,
            )


def _scale_bar(axis: Axes, length_m: float) -> None:
    bar = 10.0 ** np.floor(np.log10(length_m / 4.0))
    bar *= max(k for k in (1, 2, 5) if k * bar <= length_m / 4.0)
    high = axis.get_xlim()[1]
    foot = axis.get_xaxis_transform()  # at the foot of the panel, also below a track without any height
    axis.plot([high - bar, high], [0.03, 0.03], color=INK, lw=1.6, transform=foot, scalex=False, scaley=False)
    middle = (high - bar / 2, 0.03)
    axis.annotate(
        f"{bar:.0f} m", middle, (0, 4), xycoords=foot, textcoords="offset points", ha="center", fontsize=8
    )
