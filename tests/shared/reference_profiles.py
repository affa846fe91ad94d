"""The reference profiles of EN 15302 for checking calculations of equivalent conicity: wheels A, B; rail A.

Synthetic shapes of arcs and lines, made for this purpose: no wheel is turned to them. Arcs and joints are
those of EN 15302:2021, Annex I, as given by github.com/rohrbecka/EN15302, in millimetres. The rail is given
as it lies in the track: its lateral zero is at half the distance of the tape circles, 750 mm, which makes a
gauge of 1435.16 mm, and it is not to be inclined again.

Not here: profiles that vehicles run on (`simrail.vehicle.contact.profiles`), conicity
(`simrail.vehicle.contact.wheelset`).
"""

from typing import Literal

import numpy as np

from simrail.core.jit import FloatArray
from simrail.vehicle.contact.profiles import RailProfile, WheelProfile

GAUGE_M = 1.43516
"""Gauge at which rail A lies as it is given."""

_SOURCE = "EN 15302:2021 Annex I, after github.com/rohrbecka/EN15302"

# Each from the end of the one before: an arc (end, centre, its depth, radius), the radius negative where the
# arc lies above its centre; or a line (end, depth at zero, slope, 0).
_Piece = tuple[float, float, float, float]
_FLANGE_TIP_MM = -55.0
_WHEEL_A: tuple[_Piece, ...] = (
    (-49.6625, -55.0, 16.00065, 12.0),
    (-39.7645, -58.5583, 8.83556, 20.0),
    (-38.7372, -93.57685, -2.7475, 0.0),
    (-29.4591, -25.5816, 17.64215, -14.0),
    (-10.8749, -2.6594, 97.16493, -96.76055),
    (18.4173, 18.4173, 344.50806, -345.0),
    (30.0, -0.49194, 0.0, 0.0),
    (60.0, 1.50804, -0.066666, 0.0),
)
_WHEEL_B: tuple[_Piece, ...] = (
    (-49.6625, -55.0, 16.0, 12.0),
    (-39.7640, -58.5583, 8.8349, 20.0),
    (-38.7879, -93.5767, -2.7475, 0.0),
    (-29.3505, -25.6322, 17.7814, -14.0),
    (-0.4787, 2.5204, 119.9745, -120.0),
    (30.0, 0.0, -0.025, 0.0),
    (60.0, 0.75, -0.05, 0.0),
)
_RAIL_A: tuple[_Piece, ...] = (
    (-23.2401, -19.63949, 15.899044, -13.0),
    (-7.8749, -1.0825, 80.277908, -80.0),
    (13.0989, 17.5966, 299.48349, -300.0),
    (28.6709, 14.29829, 79.508225, -80.0),
    (39.2705, 26.33535, 13.598369, -13.0),
)
_RAIL_START_MM = -32.634


def _depth_mm(pieces: tuple[_Piece, ...], y: FloatArray) -> FloatArray:
    """Depth (mm) at lateral positions (mm)."""
    ends = [piece[0] for piece in pieces]
    depth = np.empty_like(y)
    which = np.minimum(np.searchsorted(ends, y, side="left"), len(pieces) - 1)
    for i, (_, first, second, radius) in enumerate(pieces):
        at = y[which == i]
        if radius == 0.0:
            depth[which == i] = first + second * at
        else:
            depth[which == i] = second + np.sign(radius) * np.sqrt(radius**2 - (at - first) ** 2)
    return depth


def en15302_wheel(kind: Literal["A", "B"]) -> WheelProfile:
    """Reference wheel A (near S1002) or B, from the flange tip to 60 mm outside the tape circle."""
    y = np.arange(_FLANGE_TIP_MM, 60.0 + 1e-9, 0.05)
    depth = _depth_mm({"A": _WHEEL_A, "B": _WHEEL_B}[kind], y)
    return WheelProfile(f"EN 15302 wheel {kind}", y * 1e-3, depth * 1e-3, _SOURCE)


def en15302_rail_a() -> RailProfile:
    """Reference rail A (60E1 leaning 1:20), as it lies in the track at `GAUGE_M`; inclination 0."""
    y = np.arange(_RAIL_START_MM, 39.27, 0.05)
    return RailProfile("EN 15302 rail A", y * 1e-3, _depth_mm(_RAIL_A, y) * 1e-3, _SOURCE)
