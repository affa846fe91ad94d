"""What a vehicle looks like: boxes and wheels made from the figures of its model.

A model knows masses and moments of inertia, where springs sit and how big the wheels are. The box of a body
is that of uniform density with its moments; its height is cut where it would stand in the wheels. Vertices
are in the body's axes from its centre of gravity, faces turn counter-clockwise seen from outside.
"""

from dataclasses import dataclass

import numpy as np

from simrail.core.jit import FloatArray
from simrail.vehicle.contact.contact_pair import incline
from simrail.vehicle.contact.profile_files import profiles_of
from simrail.vehicle.model import Body, VehicleModel

USUAL_GAUGE_M = 1.435
"""Gauge of the size that widths of beams, sleepers and tyres are chosen for; others are scaled."""

GAUGE_DEPTH_M = 0.014
"""Depth below the top of a full-size rail at which gauge is measured."""

_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True)
class Box:
    """A box of a body: its corners (8, 3) in the body's axes, and what it is: axle, frame, car or window."""

    body: str
    kind: str
    corners: FloatArray

    @property
    def faces(self) -> tuple[tuple[int, ...], ...]:
        """Corners of each of the six faces."""
        return _FACES


@dataclass(frozen=True)
class Disc:
    """A wheel: where its tape circle's middle is in the axle's axes, and its sizes, m."""

    wheel: str
    body: str
    side: int
    middle_m: tuple[float, float, float]
    radius_m: float
    width_m: float
    flange_m: float


def scale_of(vehicle: VehicleModel) -> float:
    """Size of a vehicle, 1 for one of the usual gauge."""
    return vehicle.wheel_rail.gauge_m / USUAL_GAUGE_M


def boxes_of(vehicle: VehicleModel) -> list[Box]:
    """Boxes of all bodies."""
    size = scale_of(vehicle)
    boxes: list[Box] = []
    for body in vehicle.bodies:
        if body.name in vehicle.axle_names:
            boxes += _axle(vehicle, body, size)
        elif _is_car(vehicle, body):
            boxes += _car(vehicle, body, size)
        else:
            boxes += _frame(vehicle, body, size)
    return boxes


def discs_of(vehicle: VehicleModel) -> list[Disc]:
    """Wheels of all axles."""
    size, half = scale_of(vehicle), vehicle.wheel_rail.tape_circle_half_m
    return [
        Disc(
            wheel.name,
            wheel.axle,
            wheel.side,
            (0.0, wheel.side * half, 0.0),
            wheel.radius_m,
            0.135 * size,
            0.028 * size,
        )
        for wheel in vehicle.wheels
    ]


def profile_lines(vehicle: VehicleModel) -> tuple[FloatArray, FloatArray, float]:
    """Cross-sections of a left wheel and its rail as they lie, for a front view.

    Returns
    -------
    wheel : ndarray (k, 2)
        Outward from the tape circle, upward from the wheel's surface there.
    rail : ndarray (k, 2)
        Outward from the highest point of the head, upward from it.
    offset_m : float
        Where on the rail the tape circle stands when the axle is in the middle of level rails.
    """
    pair, size = vehicle.wheel_rail, scale_of(vehicle)
    wheel, rail = profiles_of(pair)
    head = incline(rail, pair.rail_inclination, gauge_depth_m=GAUGE_DEPTH_M * size)
    abscissa = np.linspace(head.spline.x[0], head.spline.x[-1], 120)
    every = max(1, len(wheel.lateral_m) // 240)
    touch = float(np.interp(0.0, wheel.lateral_m, wheel.depth_m))
    return (
        np.column_stack([wheel.lateral_m, touch - wheel.depth_m])[::every],
        np.column_stack([abscissa, -head.depth(abscissa)]),
        pair.tape_circle_half_m - 0.5 * pair.gauge_m + head.gauge_abscissa_m,
    )


def _box(body: str, kind: str, middle: tuple[float, float, float], size: tuple[float, float, float]) -> Box:
    return Box(body, kind, np.asarray(middle) + _CORNERS * np.asarray(size))


def _dimensions(body: Body) -> FloatArray:
    """Length, width and height of the uniform box that has a body's moments of inertia."""
    inertia = np.asarray(body.inertia_kgm2)
    dimensions: FloatArray = np.sqrt(np.maximum(6.0 / body.mass_kg * (inertia.sum() - 2.0 * inertia), 0.0))
    return dimensions


def _is_car(vehicle: VehicleModel, body: Body) -> bool:
    """Whether a body is carried by others than its axles, or is the only one on them."""
    heights = [other.position_m[2] for other in vehicle.bodies if other.name not in vehicle.axle_names]
    alone = len(heights) == 1
    return alone or body.position_m[2] > 1.3 * min(heights)


def _axle(vehicle: VehicleModel, body: Body, size: float) -> list[Box]:
    half, thick = vehicle.wheel_rail.tape_circle_half_m, 0.15 * size
    boxes = [
        _box(body.name, "axle", (0.0, (i - 1.5) * 0.5 * half, 0.0), (thick, 0.5 * half, thick))
        for i in range(4)
    ]
    for side in (-1.0, 1.0):
        place = side * (half + 0.22 * size)
        boxes.append(_box(body.name, "axle", (0.0, place, 0.0), (0.34 * size, 0.16 * size, 0.26 * size)))
    return boxes


def _frame(vehicle: VehicleModel, body: Body, size: float) -> list[Box]:
    """Two side beams and two transoms."""
    radius = max(wheel.radius_m for wheel in vehicle.wheels)
    length = float(np.clip(_dimensions(body)[0], 1.2 * size, 4.2 * size))
    beam = vehicle.wheel_rail.tape_circle_half_m + 0.22 * size
    thick = 0.15 * size
    # Over the axle boxes: that is where it lies on them.
    lift = max(radius + 0.22 * size - body.position_m[2], 0.0)
    # Beams come in pieces, so that what is farther is known of each and not of the whole beam.
    piece = length / 6
    boxes = [
        _box(body.name, "frame", ((i - 2.5) * piece, side * beam, lift), (piece, 0.16 * size, thick))
        for side in (-1, 1)
        for i in range(6)
    ]
    for x in (-0.2 * size, 0.2 * size):
        boxes.append(_box(body.name, "frame", (x, 0.0, lift), (0.14 * size, 2.0 * beam - 0.16 * size, thick)))
    return boxes


def _car(vehicle: VehicleModel, body: Body, size: float) -> list[Box]:
    """A car body with windows, its floor over the wheels."""
    length, width, height = _dimensions(body)
    width, height = min(width, 2.75 * size), float(np.clip(height, 1.2 * size, 2.45 * size))
    floor = 2.0 * max(wheel.radius_m for wheel in vehicle.wheels) + 0.28 * size
    low = floor - body.position_m[2]
    boxes = [_box(body.name, "car", (0.0, 0.0, low + 0.5 * height), (length, width, height))]
    count = max(1, int(length / (1.75 * size)))
    for side in (-1.0, 1.0):
        for i in range(count):
            x = length * ((i + 0.5) / count - 0.5)
            pane = (0.68 * length / count, 0.01 * size, 0.36 * height)
            middle = (x, side * (0.5 * width + 0.006 * size), low + 0.66 * height)
            boxes.append(_box(body.name, "window", middle, pane))
    return boxes
