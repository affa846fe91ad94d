"""At what curvature and cant the elements of a plan meet, and whether they can.

A straight and a curve have their own; a transition has that of what it joins, unless it says its own. Where
two elements meet with different ones there is a step, which no vehicle can follow: it is refused, unless the
track says over what length it is smoothed (`simrail.track.alignment`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from simrail.core.errors import InputError
from simrail.track.elements import (
    LEAST_LENGTH_M,
    LEAST_RADIUS_M,
    MAX_CANT_PER_BASE,
    MOST_LENGTH_M,
    RAIL_BASE_M,
    CantStation,
    Curve,
    Element,
    Transition,
    cross_slope,
    require_number,
)

LONGEST_SMOOTHING_M = 30.0
"""Longest smoothing of a step: the base of the longest vehicles; what is longer is a transition."""

EVEN_1PM, EVEN_M = 1e-9, 1e-9
"""Curvature and cross slope that differ by less do not step: a radius of 1000 m to the millimetre."""


class EndValue(NamedTuple):
    """Curvature, positive to the left, and height of the left above the right rail, at an element's end."""

    curvature_1pm: float
    cross_slope_m: float


class Step(NamedTuple):
    """Two elements that meet with different values: the number of the second, and what is added there."""

    element: int
    curvature_1pm: float
    cross_slope_m: float


LEVEL = EndValue(0.0, 0.0)


def end_values(elements: Sequence[Element]) -> list[tuple[EndValue, EndValue]]:
    """Curvature and cross slope at both ends of every element."""
    around = (None, *elements, None)
    return [
        (_end(element, before, start=True), _end(element, after, start=False))
        for before, element, after in zip(around, elements, around[2:], strict=False)
    ]


def _end(element: Element, neighbour: Element | None, *, start: bool) -> EndValue:
    """Value at the start or the end of an element that has a neighbour there."""
    if not isinstance(element, Transition):
        return EndValue(element.curvature_1pm, element.cross_slope_m)
    radius, cant = _own(element, start=start)
    other = LEVEL
    if isinstance(neighbour, Transition):
        its_radius, its_cant = _own(neighbour, start=not start)
        radius = its_radius if radius is None else radius
        cant = its_cant if cant is None else cant
    elif neighbour is not None:
        other = EndValue(neighbour.curvature_1pm, neighbour.cross_slope_m)
    bend = other.curvature_1pm if radius is None else 1.0 / radius
    return EndValue(bend, other.cross_slope_m if cant is None else cross_slope(cant, bend))


def _own(element: Transition, *, start: bool) -> tuple[float | None, float | None]:
    """Radius and cant that a transition says itself of an end."""
    if start:
        return element.start_radius_m, element.start_cant_m
    return element.end_radius_m, element.end_cant_m


def steps(elements: Sequence[Element]) -> list[Step]:
    """Joints at which curvature or cross slope step."""
    ends = end_values(elements)
    found = []
    for i in range(1, len(elements)):
        before, after = ends[i - 1][1], ends[i][0]
        bend, level = (b - a for a, b in zip(before, after, strict=True))
        if abs(bend) > EVEN_1PM or abs(level) > EVEN_M:
            found.append(Step(i, bend, level))
    return found


def check_elements(
    elements: Sequence[Element],
    *,
    rail_base_m: float = RAIL_BASE_M,
    step_smoothing_m: float = 0.0,
    has_stations: bool = False,
) -> None:
    """Refuse elements that cannot be joined to a line of continuous curvature and cant.

    Parameters
    ----------
    elements : sequence of Straight, Curve, Transition
        The plan, in the order of s.
    rail_base_m : float
        What cant is a height over.
    step_smoothing_m : float
        Length over which steps are smoothed; 0 refuses them.
    has_stations : bool
        Whether the cant stands beside the plan; then no element may have one.

    Raises
    ------
    InputError
        Naming the element (counted from 0, as in ``segment[3]``) and its field.
    """
    if not elements:
        raise InputError("has no elements", field="segment", limit=">= 1 element", remedy="add a straight")
    for i, element in enumerate(elements):
        _check_numbers(element, f"segment[{i}]", rail_base_m=rail_base_m, has_stations=has_stations)
    ends = end_values(elements)
    for i, element in enumerate(elements):
        if isinstance(element, Transition):
            _check_said(elements, ends, i)
    require_number(step_smoothing_m, "step_smoothing_m", least=0.0, within=LONGEST_SMOOTHING_M)
    stepped = steps(elements)
    if stepped and not step_smoothing_m:
        index = stepped[0].element
        raise InputError(
            "curvature or cant steps between two elements",
            field=f"segment[{index}]",
            value=elements[index],
            limit="no step, or step_smoothing_m > 0 m",
            remedy="put a transition between them, or set step_smoothing_m of the track, the length over "
            "which a vehicle's base smooths a step, e.g. 5.0",
        )
    length = sum(element.length_m for element in elements)
    for step in stepped:
        place = sum(element.length_m for element in elements[: step.element])
        if min(place, length - place) < 0.5 * step_smoothing_m:
            raise InputError(
                "curvature or cant steps too close to an end of the track to be smoothed",
                field=f"segment[{step.element}]",
                value=f"{min(place, length - place):g} m from the end",
                limit=f">= {0.5 * step_smoothing_m:g} m, half of step_smoothing_m",
                remedy="lengthen the first or the last segment, or shorten step_smoothing_m",
            )


def _check_numbers(element: Element, here: str, *, rail_base_m: float, has_stations: bool) -> None:
    """Refuse numbers of an element that are none, or that belong elsewhere."""
    require_number(element.length_m, f"{here}.length_m", above=LEAST_LENGTH_M, within=MOST_LENGTH_M)
    if isinstance(element, Curve):
        _check_radius(element.radius_m, f"{here}.radius_m")
    if isinstance(element, Transition):
        cants = {"start_cant_m": element.start_cant_m, "end_cant_m": element.end_cant_m}
        for end in ("start", "end"):
            radius = getattr(element, f"{end}_radius_m")
            if radius is None and cants[f"{end}_cant_m"] is not None:
                raise InputError(
                    "belongs to an end with a radius of its own",
                    field=f"{here}.{end}_cant_mm",
                    limit=f"only beside {end}_radius_m",
                    remedy=f"add {end}_radius_m, inf where it is straight, or remove it",
                )
            if radius is not None and not math.isinf(radius):
                _check_radius(radius, f"{here}.{end}_radius_m")
    else:
        cants = {"cant_m": element.cant_m}
    for field, cant in cants.items():
        require_number(cant or 0.0, f"{here}.{field}", within=MAX_CANT_PER_BASE * rail_base_m)
        if has_stations and cant:
            raise InputError(
                "the cant is said twice, by the segments and by [[cant]]",
                field=f"{here}.{field.removesuffix('_m')}_mm",
                value=1000.0 * cant,
                limit="cant in one of the two",
                remedy="remove it, or all of [[cant]]",
            )


def _check_radius(radius: float, field: str) -> None:
    """Refuse a radius that is none, or that no vehicle of any scale goes round."""
    require_number(radius, field, zero=False)
    if abs(radius) < LEAST_RADIUS_M:
        limit = f">= {LEAST_RADIUS_M:g} m to either side"
        raise InputError("is out of range", field=field, value=radius, limit=limit, remedy="say it in m")


def _check_said(elements: Sequence[Element], ends: Sequence[tuple[EndValue, EndValue]], i: int) -> None:
    """Refuse a transition of whose ends nothing says what curvature they have."""
    before = elements[i - 1] if i else None
    after = elements[i + 1] if i + 1 < len(elements) else None
    element, here = elements[i], f"segment[{i}]"
    assert isinstance(element, Transition)
    (first, _), (last, _) = ends[i]
    if before is None and element.start_radius_m is None and last == 0.0:
        raise InputError(
            "the track begins in a transition, and nothing says from what curvature",
            field=f"{here}.start_radius_m",
            limit="a curvature at the start of the track",
            remedy="say start_radius_m, or put a straight or a curve before it",
        )
    if after is None and element.end_radius_m is None and first == 0.0:
        raise InputError(
            "the track ends in a transition, and nothing says at what curvature",
            field=f"{here}.end_radius_m",
            limit="a curvature at the end of the track",
            remedy="say end_radius_m, or put a straight or a curve after it",
        )
    if isinstance(after, Transition):
        unsaid = element.end_radius_m is None and after.start_radius_m is None
        # Straight between two opposite curves is what reverse clothoids are; all else is a guess.
        if unsaid and not first * ends[i + 1][1].curvature_1pm < 0.0:
            raise InputError(
                "two transitions meet, and nothing says at what curvature",
                field=f"{here}.end_radius_m",
                value=element.end_radius_m,
                limit="a curvature where they meet",
                remedy="say end_radius_m of the first, inf where they meet straight; only between opposite "
                "curves that is taken",
            )
    _check_cant_said(elements, i)


def _check_cant_said(elements: Sequence[Element], i: int) -> None:
    """Refuse an end of a transition that has a radius but no cant, and nothing to take that from."""
    element = elements[i]
    assert isinstance(element, Transition)
    if not any(ends.cross_slope_m for pair in end_values(elements) for ends in pair):
        return
    for end, place in (("start", i - 1), ("end", i + 1)):
        radius, cant = _own(element, start=end == "start")
        neighbour = elements[place] if 0 <= place < len(elements) else None
        if isinstance(neighbour, Transition):
            cant = _own(neighbour, start=end == "end")[1] if cant is None else cant
        elif neighbour is not None:
            continue
        if cant is None and radius is not None and 1.0 / radius:
            raise InputError(
                "has a radius of its own in a line with cant, but no cant",
                field=f"segment[{i}].{end}_cant_mm",
                limit="a cant at this end, also 0.0 mm",
                remedy="add it, 0.0 where there is none",
            )


def check_stations(stations: Sequence[CantStation], *, rail_base_m: float) -> None:
    """Refuse stations of cant that do not rise, or whose cant is none.

    Raises
    ------
    InputError
        Naming the station, counted from 0.
    """
    before: CantStation | None = None
    for i, station in enumerate(stations):
        require_number(
            station.at_m, f"cant[{i}].at_m", above=-float("inf") if before is None else before.at_m
        )
        require_number(station.cross_slope_m, f"cant[{i}].mm", within=MAX_CANT_PER_BASE * rail_base_m)
        before = station
