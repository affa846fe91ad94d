"""The map that the train carries: the design with errors of a survey, by size and by seed.

What was laid is one thing, what the train knows of it another: cant settles and is tamped, a radius is read
off an old drawing, a transition was moved. `draw_map` makes of a design the map of one draw; nothing of it
changes the rails. The sizes (`MapErrors`) are known to the train, as the accuracy of a survey is; single
defects (`MapDefect`) are not.

The default sizes are synthetic: orders of magnitude of what a design drawing and a line as it lies differ by.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.track.alignment import element_starts
from simrail.track.design import CantStation, Curve, Element, Straight, TrackDesign, Transition
from simrail.track.deviation import Deviation
from simrail.track.elements import SMOOTH_STEP, cross_slope, require_number
from simrail.track.joints import end_values

STEP_M = 5.0
"""Distance of the values of cant and height along the line; twenty of them in a correlation length."""

LEAST_SHARE = 0.2
"""Of its length that every element keeps, however its ends are moved."""

SHORT_M = 1.0
"""Length of a transition that a map does not have: a step that a line of continuous curvature can have."""

NODE_M = 0.01
"""Length of the arc at a vertex of a curve that was surveyed as a polyline."""


@dataclass(frozen=True)
class MapErrors:
    """Standard deviations of what a map says, by kind; all independent and normal.

    Attributes
    ----------
    cant_sd_m : float
        Cant of a curve: one error per curve.
    cant_along_sd_m, cant_along_length_m : float
        Cant that wanders along the whole line: its standard deviation, and the distance at which its
        correlation has fallen to 1/e.
    radius_relative_sd : float
        Curvature of a curve, relative: one error per curve.
    place_sd_m : float
        Place of each joint of two elements, along the line.
    gradient_sd : float
        Slope of each gradient, dz/ds.
    chainage_scale_sd, chainage_offset_sd_m : float
        Relative error of all lengths, and a common shift of all places, along the line.
    """

    cant_sd_m: float = 0.003
    cant_along_sd_m: float = 0.001
    cant_along_length_m: float = 100.0
    radius_relative_sd: float = 0.01
    place_sd_m: float = 0.5
    gradient_sd: float = 2e-4
    chainage_scale_sd: float = 0.0
    chainage_offset_sd_m: float = 0.0

    def check(self) -> None:
        """Refuse sizes that are none.

        Raises
        ------
        InputError
            Naming the field and the limit.
        """
        for name, limit in _LIMITS.items():
            require_number(getattr(self, name), name, least=0.0, within=limit)
        require_number(self.cant_along_length_m, "cant_along_length_m", least=4.0 * STEP_M)


_LIMITS = {
    "cant_sd_m": 0.1,
    "cant_along_sd_m": 0.1,
    "radius_relative_sd": 0.2,
    "place_sd_m": 50.0,
    "gradient_sd": 0.02,
    "chainage_scale_sd": 0.05,
    "chainage_offset_sd_m": 200.0,
}
"""Largest sizes: beyond lies a wrong unit."""

UNSTATED = MapErrors(
    cant_sd_m=0.008,
    cant_along_sd_m=0.003,
    radius_relative_sd=0.02,
    place_sd_m=2.0,
    gradient_sd=5e-4,
    chainage_scale_sd=1e-4,
    chainage_offset_sd_m=1.0,
)
"""What is taken of a map that nobody has said anything of: wide, and synthetic."""

EXACT = MapErrors(**dict.fromkeys(_LIMITS, 0.0))
"""A map without errors: an ablation."""


@dataclass(frozen=True)
class MapDefect:
    """One fault of a map, at a place.

    Attributes
    ----------
    kind : str
        ``"missing_transition"``: the map has a step of curvature and cant in its middle;
        ``"straightened_transition"``: the map goes on as before it, and steps at its end;
        ``"coarse_curve"``: a curve and its transitions are known at vertices ``size_m`` apart only;
        ``"settled"``: the ground has sunk by ``size_m`` over ``length_m`` since the survey.
    at_m : float
        s in the transition or curve, or of the middle of the settled place.
    size_m : float
        See ``kind``.
    length_m : float
        Of a settled place.
    """

    kind: Literal["missing_transition", "straightened_transition", "coarse_curve", "settled"]
    at_m: float
    size_m: float = 0.0
    length_m: float = 0.0


def draw_map(
    design: TrackDesign, errors: MapErrors, *, seed: int, draw: int, defects: Sequence[MapDefect] = ()
) -> TrackDesign:
    """The map of one draw: from where to where the design goes, and what lies between with errors.

    Parameters
    ----------
    design : TrackDesign
        What was laid.
    errors : MapErrors
        Sizes.
    seed, draw : int
        Root seed and number of the draw. Each kind of error has a stream of its own, and each error in it
        its own place: another size of one kind changes no other.
    defects : sequence of MapDefect
        Faults at places of the design.

    Returns
    -------
    TrackDesign
        Of the same name, start and end. The first and the last element take up what chainage and places
        are shifted.

    Raises
    ------
    InputError
        If a size is out of range, or a defect is not at what its kind needs.
    """
    errors.check()
    moved = _moved_joints(design, errors, seed, draw)
    elements = _with_defects(design, _wrong_curves(moved.elements, errors, seed, draw), defects)
    known = replace(
        moved,
        elements=elements if not design.cant_stations else _without_cant(elements),
        cant_stations=_wrong_stations(design, moved, errors, seed=seed, draw=draw),
        deviation=_deviation(design, errors, defects, seed=seed, draw=draw),
    )
    known.check()
    return known


def _normals(seed: int, draw: int, kind: str, n: int) -> FloatArray:
    """Standard normal numbers of a kind of error."""
    return stream(seed, "map", draw, kind).standard_normal(n)


def _moved_joints(design: TrackDesign, errors: MapErrors, seed: int, draw: int) -> TrackDesign:
    """Joints of the elements, and gradients, where the chainage and the survey put them."""
    scale = 1.0 + errors.chainage_scale_sd * _normals(seed, draw, "chainage_scale", 1)[0]
    offset = errors.chainage_offset_sd_m * _normals(seed, draw, "chainage_offset", 1)[0]
    starts = element_starts(design.elements, design.start_m)
    lengths = np.diff(starts)
    most = 0.5 * (1.0 - LEAST_SHARE) * np.minimum(lengths[:-1], lengths[1:])
    along = errors.place_sd_m * _normals(seed, draw, "place", len(most))
    joints = starts[1:-1] + np.clip(along, -most, most)
    joints = design.start_m + scale * (joints - design.start_m) + offset
    lengths = np.diff(joints, prepend=design.start_m, append=design.end_m)
    gradients = [
        gradient
        if gradient.from_m <= design.start_m
        else replace(
            gradient, from_m=float(design.start_m + scale * (gradient.from_m - design.start_m) + offset)
        )
        for gradient in design.gradients
    ]
    if (lengths <= 0.0).any() or any(gradient.from_m >= design.end_m for gradient in gradients):
        raise InputError(
            "errors of the chainage push the first or the last element off the map",
            field="chainage_offset_sd_m",
            value=float(offset),
            limit="shorter than the first and the last element of the track",
            remedy="take smaller errors, or lengthen these elements",
        )
    elements = [
        replace(element, length_m=float(length))
        for element, length in zip(_with_neighbours(design.elements), lengths, strict=True)
    ]
    stations = tuple(
        replace(station, at_m=float(design.start_m + scale * (station.at_m - design.start_m) + offset))
        for station in design.cant_stations
    )
    return replace(design, elements=tuple(elements), gradients=tuple(gradients), cant_stations=stations)


def _with_neighbours(elements: Sequence[Element]) -> list[Element]:
    """Transitions that say of an end what the straight or curve beside it is take it from there instead.

    Else a curve of another radius would step against its own transition.
    """
    ends = end_values(elements)
    around = [None, *elements, None]
    found = []
    for i, element in enumerate(elements):
        if isinstance(element, Transition):
            for end, there in (("start", i - 1), ("end", i + 1)):
                beside = around[there + 1]
                if beside is not None and not isinstance(beside, Transition):
                    meets = ends[there][end == "start"] == ends[i][end == "end"]
                    changes: dict[str, Any] = (
                        {f"{end}_radius_m": None, f"{end}_cant_m": None} if meets else {}
                    )
                    element = replace(element, **changes)
        found.append(element)
    return found


def _without_cant(elements: Sequence[Element]) -> tuple[Element, ...]:
    """Elements of a line whose cant stands beside the plan."""
    return tuple(
        element if isinstance(element, Transition) else replace(element, cant_m=0.0) for element in elements
    )


def _wrong_stations(
    design: TrackDesign, moved: TrackDesign, errors: MapErrors, *, seed: int, draw: int
) -> tuple[CantStation, ...]:
    """Stations of cant, those of a curve with the error of its cant."""
    wrong = errors.cant_sd_m * _normals(seed, draw, "cant", len(design.elements))
    starts = element_starts(design.elements, design.start_m)
    found = []
    for station, placed in zip(design.cant_stations, moved.cant_stations, strict=True):
        error = 0.0
        for i, element in enumerate(design.elements):
            # Where a curve ends, its cant does.
            if isinstance(element, Curve) and starts[i] - SHORT_M <= station.at_m <= starts[i + 1] + SHORT_M:
                error = cross_slope(wrong[i], element.curvature_1pm)
        found.append(replace(placed, cross_slope_m=_in_mm(placed.cross_slope_m + error)))
    return tuple(found)


def _wrong_curves(
    elements: tuple[Element, ...], errors: MapErrors, seed: int, draw: int
) -> tuple[Element, ...]:
    """Curves of another radius and another cant."""
    cant = errors.cant_sd_m * _normals(seed, draw, "cant", len(elements))
    bend = errors.radius_relative_sd * _normals(seed, draw, "radius", len(elements))
    return tuple(
        replace(
            element,
            radius_m=float(element.radius_m / (1.0 + bend[i])),
            cant_m=_in_mm(element.cant_m + cant[i]),
        )
        if isinstance(element, Curve)
        else element
        for i, element in enumerate(elements)
    )


def _in_mm(value_m: float) -> float:
    """Rounded to 1 um, so that a file in mm gives the very same number."""
    return float(round(1000.0 * value_m, 3)) / 1000.0


def _with_defects(
    design: TrackDesign, elements: tuple[Element, ...], defects: Sequence[MapDefect]
) -> tuple[Element, ...]:
    """Elements with the defects that are not of the height, at the places that the design gives them."""
    changed = list(elements)
    at = [(int(design.segment(defect.at_m)), defect) for defect in defects if defect.kind != "settled"]
    # From the last to the first, since a polyline has more elements than the curve.
    for index, defect in sorted(at, key=lambda pair: -pair[0]):
        element = changed[index]
        wanted = Curve if defect.kind == "coarse_curve" else Transition
        if not isinstance(element, wanted):
            raise InputError(
                "is not at such a place of the track",
                field="at_m",
                value=defect.at_m,
                limit=f"in a {wanted.word} for {defect.kind}; there is a {element.word}",
            )
        if defect.kind == "coarse_curve":
            ends = [changed[i] for i in (index - 1, index + 1) if 0 < i < len(changed) - 1]
            if len(ends) < 2 or not all(isinstance(end, Transition) for end in ends):
                raise InputError(
                    "a coarse curve needs a transition at either end",
                    field="at_m",
                    limit="a curve between two transitions",
                    remedy="choose another curve",
                )
            require_number(defect.size_m, "chord_m", least=1.0)
            changed[index - 2 : index + 3] = _polyline(design, changed[index - 2 : index + 3], defect.size_m)
        else:
            neighbours = [changed[i] for i in (index - 1, index + 1) if 0 <= i < len(changed)]
            if len(neighbours) < 2 or any(isinstance(beside, Transition) for beside in neighbours):
                raise InputError(
                    "needs a straight or a curve before and after the transition",
                    field="at_m",
                    value=defect.at_m,
                    limit="a straight or a curve on both sides",
                )
            before, after = neighbours
            spare = element.length_m - min(SHORT_M, element.length_m)
            first = spare if defect.kind == "straightened_transition" else 0.5 * spare
            changed[index - 1] = replace(before, length_m=before.length_m + first)
            changed[index] = replace(element, length_m=element.length_m - spare)
            changed[index + 1] = replace(after, length_m=after.length_m + spare - first)
    return tuple(changed)


def _polyline(design: TrackDesign, elements: Sequence[Element], size_m: float) -> list[Element]:
    """A curve, its transitions and their neighbours (5 elements) as vertices of a polyline give them.

    The curvature at a vertex is the turn from the middle of the chord before it to the middle of that after
    it, per length; between vertices it is taken to be linear, as cant is. So the whole turn is kept, and the
    neighbours lose a chord each.
    """
    before, *curve, after = elements
    length = sum(element.length_m for element in curve)
    step = length / max(2, round(length / size_m))
    if min(before.length_m, after.length_m) <= step:
        raise InputError(
            "is longer than what lies before or after the curve",
            field="chord_m",
            value=step,
            limit=f"less than {min(before.length_m, after.length_m):g} m",
        )
    group = replace(design, elements=tuple(elements), start_m=-before.length_m, gradients=(), deviation=None)
    vertices = step * np.arange(round(length / step) + 1)
    turn = group.frame(vertices + 0.5 * step).yaw_rad - group.frame(vertices - 0.5 * step).yaw_rad
    slope = group.rail_base_m * np.sin(group.frame(vertices).roll_rad)
    parts: list[Element] = [replace(before, length_m=before.length_m - step)]
    for bend, cant in zip(turn / step, slope, strict=True):
        node = Curve(NODE_M, 1.0 / bend, _in_mm(-cant if bend > 0.0 else cant)) if bend else Straight(NODE_M)
        parts += [Transition(step - NODE_M), node]
    parts[1] = Transition(step - 0.5 * NODE_M)
    return [*parts, Transition(step - 0.5 * NODE_M), replace(after, length_m=after.length_m - step)]


def _deviation(
    design: TrackDesign, errors: MapErrors, defects: Sequence[MapDefect], *, seed: int, draw: int
) -> Deviation | None:
    """Cant that wanders, slopes that are wrong, and places that have settled; None if nothing is."""
    n = math.ceil(design.length_m / STEP_M) + 1
    places = design.start_m + STEP_M * np.arange(n)
    cant = errors.cant_along_sd_m * _wandering(
        _normals(seed, draw, "cant_along", 2 * n), errors.cant_along_length_m
    )
    # One error of slope for each gradient, the level before the first among them.
    begins = np.array([gradient.from_m for gradient in design.gradients])
    slopes = errors.gradient_sd * _normals(seed, draw, "gradient", len(begins) + 1)
    slope = slopes[np.searchsorted(begins, places, side="right")]
    height = np.concatenate([[0.0], np.cumsum(0.5 * STEP_M * (slope[1:] + slope[:-1]))])
    for defect in defects:
        if defect.kind == "settled":
            require_number(defect.length_m, "length_m", least=4.0 * STEP_M)
            require_number(defect.size_m, "size_m", within=1.0)
            inside = np.clip(1.0 - np.abs(places - defect.at_m) / (0.5 * defect.length_m), 0.0, 1.0)
            height += defect.size_m * np.polyval(SMOOTH_STEP, inside)
    if design.deviation is not None:
        cant += design.deviation.cant(places, derivatives=0)[0]
        height += design.deviation.height(places, derivatives=0)[0]
    if not (cant.any() or height.any()):
        return None
    return Deviation(
        design.start_m,
        STEP_M,
        tuple(_in_mm(value) for value in cant),
        tuple(_in_mm(value) for value in height),
    )


def _wandering(normals: FloatArray, length_m: float) -> FloatArray:
    """Stationary Gaussian process of unit variance at steps of `STEP_M`, (n,) of 2 n normal numbers.

    Matern 3/2, rho(d) = (1 + w d) exp(-w d): its slope is finite, as that of rails is. Drawn exactly, by its
    two states x and x' (P. Hartikainen, S. Sarkka, MLSP 2010):

        F = exp(-w h) [1 + w h, h; -w^2 h, 1 - w h],   P = diag(1, w^2),   Q = P - F P F'

    ``length_m`` is where rho = 1/e, w d = 2.1462.
    """
    w = 2.146193220620583 / length_m
    p = np.diag([1.0, w * w])
    f = math.exp(-w * STEP_M) * np.array([[1.0 + w * STEP_M, STEP_M], [-w * w * STEP_M, 1.0 - w * STEP_M]])
    root = np.linalg.cholesky(p - f @ p @ f.T)
    drives = normals.reshape(-1, 2)
    state = np.sqrt(p) @ drives[0]
    process = np.empty(len(drives))
    for k in range(len(drives)):
        if k:
            state = f @ state + root @ drives[k]
        process[k] = state[0]
    return process
