"""A design made of what other programs write: pieces of linear curvature, cant by places, gradients.

Readers of foreign files (`simrail.track.landxml`, `simrail.track.ifc`, `simrail.track.curvature_csv`) hand
over what a file says, by what they share of reading it; `drawn_design` makes elements of it, states what they
meet with, and tells what was rounded, smoothed or left out.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from simrail.core.errors import InputError, did_you_mean
from simrail.track.design import TrackDesign
from simrail.track.elements import (
    RAIL_BASE_M,
    CantStation,
    ChainageBreak,
    Curve,
    Element,
    Gradient,
    Straight,
    Transition,
)
from simrail.track.joints import steps
from simrail.track.vertical import build_vertical

SNAP_1PM = 1e-7
"""Curvature of a transition's end that differs by less from what it meets is that: files are rounded."""

STRAIGHT_1PM = 1e-8
"""Curvature below which a piece is straight: a radius of 100 000 km."""

KINK_RAD = 1e-3
"""Difference of the directions of two pieces where they meet from which on the line has a kink."""

SMOOTHING_M = 5.0
"""Length over which steps of curvature are smoothed unless another one is asked for: a bogie's base."""

_HEIGHT_M = 5e-4
"""How far the rise of a vertical curve's bend may lead off its parabola: ramp^2/(24 radius)."""

_LONGEST_RAMP_M = TrackDesign.vertical_ramp_m


@dataclass(frozen=True)
class Piece:
    """A piece of linear curvature: length, m, and curvature at both ends, 1/m, positive to the left."""

    length_m: float
    start_1pm: float
    end_1pm: float


@dataclass(frozen=True)
class Turn:
    """A change of gradient: where its vertical curve is centred, the slope behind it, and its length, m."""

    at_m: float
    slope: float
    length_m: float


@dataclass
class Drawn:
    """What a file says of a line.

    Attributes
    ----------
    name, source : str
        What it is called, and where it comes from.
    start_m, start_height_m, start_yaw_rad : float
        At its start.
    pieces : list of Piece
        The plan.
    cant : list of CantStation
        Cant by places; empty for none.
    slope : float
        dz/ds at the start.
    turns : list of Turn
        Changes of gradient, in the order of s.
    rail_base_m : float
        What cant is a height over.
    breaks : list of tuple
        Chainage breaks: s, the chainage that ends there, and that which begins.
    notes : list of str
        What is to be told.
    """

    name: str
    source: str
    start_m: float
    pieces: list[Piece]
    start_height_m: float = 0.0
    start_yaw_rad: float = 0.0
    cant: list[CantStation] = field(default_factory=list)
    slope: float = 0.0
    turns: list[Turn] = field(default_factory=list)
    rail_base_m: float = RAIL_BASE_M
    breaks: list[tuple[float, float, float]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def chosen_alignment(names: Sequence[str], wanted: str | None, *, kind: str) -> int:
    """Number of the alignment that is meant, of those of a file.

    Parameters
    ----------
    names : sequence of str
        Theirs.
    wanted : str, optional
        Name of one; needed where there are several.
    kind : str
        What the file calls one.

    Raises
    ------
    InputError
        If there is none, none of this name, or several of which none is named.
    """
    listed = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    if not names:
        raise InputError(f"has no {kind}", limit=f">= 1 {kind}")
    if wanted is None and len(names) == 1:
        return 0
    if wanted is None or wanted not in names:
        raise InputError(
            "has several alignments" if wanted is None else "has no alignment of this name",
            field="--alignment",
            value=len(names) if wanted is None else wanted,
            limit=f"one of {listed}",
            remedy=f"name one: --alignment {names[0]!r}" if wanted is None else did_you_mean(wanted, names),
        )
    return list(names).index(wanted)


def refuse_kink(turned_rad: float, field: str, *, remedy: str, problem: str = "the line has a kink") -> None:
    """Refuse pieces whose directions differ by an angle where they meet; whole turns aside.

    Raises
    ------
    InputError
        If the angle is more than `KINK_RAD`.
    """
    kink = math.remainder(turned_rad, 2.0 * math.pi)
    if abs(kink) > KINK_RAD:
        raise InputError(
            problem,
            field=field,
            value=f"{1e3 * kink:.3f} mrad",
            limit=f"{1e3 * KINK_RAD:g} mrad",
            remedy=remedy,
        )


def add_cant(drawn: Drawn, at_m: float, cross_slope_m: float) -> None:
    """Add a station of cant behind those that there are; a step goes over a length that a rail can take.

    Parameters
    ----------
    drawn : Drawn
        Takes the station, and a note where the cant steps.
    at_m, cross_slope_m : float
        Its place, and the height of the left rail over the right one.
    """
    if drawn.cant and at_m <= drawn.cant[-1].at_m + 1e-6:
        if abs(cross_slope_m - drawn.cant[-1].cross_slope_m) > 1e-9:
            drawn.notes.append(f"cant steps at {at_m:.3f} m: the second value is laid 1 m behind")
            drawn.cant.append(CantStation(drawn.cant[-1].at_m + 1.0, cross_slope_m))
        return
    drawn.cant.append(CantStation(at_m, cross_slope_m))


def drawn_design(drawn: Drawn, *, step_smoothing_m: float | None = None) -> TrackDesign:
    """The design of what a file says; what was done is added to its notes.

    Parameters
    ----------
    drawn : Drawn
        What the file says.
    step_smoothing_m : float, optional
        Length over which steps of curvature are smoothed; `SMOOTHING_M` if not given.

    Raises
    ------
    InputError
        If it makes no line.
    """
    elements = _elements(drawn.pieces)
    stepped = steps(elements)
    smoothing = 0.0
    if stepped:
        smoothing = SMOOTHING_M if step_smoothing_m is None else step_smoothing_m
        largest = max(abs(step.curvature_1pm) for step in stepped)
        drawn.notes.append(
            f"curvature steps at {len(stepped)} places, by 1/{1.0 / largest:.0f} m at most: there it rises "
            f"over step_smoothing_m = {smoothing:g} m, to be changed in the file"
        )
    length = sum(element.length_m for element in elements)
    slope, turns = _on_track(drawn, drawn.start_m + length)
    gradients = [Gradient(drawn.start_m, _permil(slope))] if slope or turns else []
    gradients += [Gradient(turn.at_m, _permil(turn.slope)) for turn in turns]
    radii, ramp = _vertical(gradients, turns, start_m=drawn.start_m, end_m=drawn.start_m + length)
    if turns and ramp < _LONGEST_RAMP_M:
        drawn.notes.append(f"vertical curves lie close or are sharp: vertical_ramp_m = {ramp:g} m")
    design = TrackDesign(
        drawn.name,
        drawn.start_m,
        elements,
        tuple(gradients),
        vertical_radius_m=tuple(radii) if turns else 2000.0,
        vertical_ramp_m=ramp,
        rail_base_m=round(drawn.rail_base_m, 6),
        source=drawn.source,
        start_position_m=(0.0, 0.0, drawn.start_height_m),
        start_yaw_rad=drawn.start_yaw_rad,
        cant_stations=tuple(
            CantStation(station.at_m, round(1e3 * station.cross_slope_m, 6) / 1e3) for station in drawn.cant
        ),
        step_smoothing_m=smoothing,
        chainage_breaks=tuple(ChainageBreak(at, ahead) for at, _, ahead in drawn.breaks),
    )
    design.check()
    for at, back, ahead in drawn.breaks:
        drawn.notes.append(f"chainage break: at s = {at:.3f} m, {back:.3f} becomes {ahead:.3f} m")
    return design


def _permil(slope: float) -> float:
    """A slope that a decimal in permil gives exactly."""
    return round(1e3 * slope, 9) / 1e3


def _elements(pieces: Sequence[Piece]) -> tuple[Element, ...]:
    """Straights, curves, and transitions that say their ends where no straight or curve does."""
    level = [abs(piece.end_1pm - piece.start_1pm) <= STRAIGHT_1PM for piece in pieces]
    found: list[Element] = []
    for i, piece in enumerate(pieces):
        if level[i]:
            bend = piece.start_1pm
            straight = abs(bend) <= STRAIGHT_1PM
            found.append(Straight(piece.length_m) if straight else Curve(piece.length_m, 1.0 / bend))
            continue
        ends: list[float | None] = []
        for bend, other, near in ((piece.start_1pm, i - 1, "end_1pm"), (piece.end_1pm, i + 1, "start_1pm")):
            beside = 0 <= other < len(pieces) and level[other]
            meets = beside and abs(getattr(pieces[other], near) - bend) < SNAP_1PM
            ends.append(None if meets else _radius(bend))
        found.append(Transition(piece.length_m, *ends))
    return tuple(_once(found))


def _once(elements: list[Element]) -> list[Element]:
    """Transitions that meet say it once: the second takes it from the first, if they say nearly the same."""
    for i, (before, after) in enumerate(itertools.pairwise(elements)):
        if isinstance(before, Transition) and isinstance(after, Transition):
            end, start = before.end_radius_m, after.start_radius_m
            if end is not None and start is not None and abs(1.0 / end - 1.0 / start) < SNAP_1PM:
                elements[i + 1] = Transition(after.length_m, None, after.end_radius_m)
    return elements


def _radius(bend: float) -> float:
    return math.inf if abs(bend) <= STRAIGHT_1PM else 1.0 / bend


def _on_track(drawn: Drawn, end_m: float) -> tuple[float, list[Turn]]:
    """Slope at the start, and the changes of gradient that lie on the track with their vertical curves."""
    slope, kept, left = drawn.slope, [], []
    for turn in drawn.turns:
        first, last = turn.at_m - 0.5 * turn.length_m, turn.at_m + 0.5 * turn.length_m
        within = first >= drawn.start_m - 1e-6 and last <= end_m + 1e-6
        # A bend without length at the very start is the slope that the line begins with.
        if within and drawn.start_m < turn.at_m < end_m:
            kept.append(turn)
        elif turn.at_m <= drawn.start_m:
            slope = turn.slope
            left += [turn] if last > drawn.start_m else []
        elif first < end_m:
            left.append(turn)
    for turn in left:
        drawn.notes.append(
            f"the vertical curve about {turn.at_m:.3f} m reaches beyond the plan: it is left out, the "
            "gradient on the plan's side goes on"
        )
    return slope, kept


def _vertical(
    gradients: Sequence[Gradient], turns: Sequence[Turn], *, start_m: float, end_m: float
) -> tuple[list[float], float]:
    """Radii of the vertical curves, and the longest ramp of their bends that they have room for.

    Raises
    ------
    InputError
        If vertical curves overlap.
    """
    radii, slope = [], gradients[0].slope if gradients else 0.0
    for turn, gradient in zip(turns, gradients[1:], strict=True):
        change = abs(gradient.slope - slope)
        # A bend without length is as long as the ramp.
        radii.append(turn.length_m / change if change and turn.length_m else 1.0)
        slope = gradient.slope
    curved = [radius for radius, turn in zip(radii, turns, strict=True) if turn.length_m]
    longest = min([_LONGEST_RAMP_M, *(math.sqrt(24.0 * radius * _HEIGHT_M) for radius in curved)])
    sharp = any(not turn.length_m for turn in turns)
    tried = [round(longest * share, 3) for share in (1.0, 0.5, 0.2, 0.1)] + ([] if sharp else [0.0])
    for ramp in tried:
        try:
            build_vertical(
                gradients, start_m, end_m=end_m, radius_m=radii or 2000.0, ramp_m=ramp, height_m=0.0
            )
        except InputError:
            if ramp == tried[-1]:
                raise
            continue
        return radii, ramp
    raise AssertionError
