"""Does a kick decay? Growth of the wheelsets' lateral motion after it, and the speed at which it is zero.

On smooth straight track a small kick makes every oscillation of the vehicle decay or grow as exp(g t), and
after a while the one with the greatest g is left. Below the critical speed g < 0: the kick dies out. The
speed at which g crosses zero is the critical speed, found by riding, as `simrail.vehicle.stability` finds it
from eigenvalues. The kick must be small: with a large one the contact is not linear, and a vehicle that is
stable for small ones may hunt.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import pandas as pd

from simrail.core.jit import FloatArray
from simrail.ride.truth import Truth
from simrail.scoring.table import FULL, OK, table_of, unit_of

WINDOW_S = 1.0
"""Windows of the envelope: some six periods of hunting."""

SMALLEST_M = 1e-9
"""An envelope below this is rounding of positions that are kilometres large."""

LARGEST_M = 3e-4
"""An envelope above this may have left the linear part of the contact."""

CRUISE = 1e-3
"""The vehicle is at its speed if it is within this share of the greatest one."""


def growth_rate_1ps(lateral_m: FloatArray, rate_hz: float) -> float:
    """Growth g of a motion, 1/s: slope of the logarithm of its envelope, by least squares.

    The envelope is the rms over `WINDOW_S` and all signals, one window after the other, up to the
    first one outside `SMALLEST_M` to `LARGEST_M`.

    Parameters
    ----------
    lateral_m : ndarray (n, k)
        Lateral displacements of k wheelsets.
    rate_hz : float
        Rate.

    Returns
    -------
    float
        NaN if there are fewer than three windows.
    """
    length = round(WINDOW_S * rate_hz)
    windows = len(lateral_m) // length
    squares = np.mean(lateral_m**2, axis=1)[: windows * length].reshape(windows, length)
    envelope = np.sqrt(np.mean(squares, axis=1))
    outside = np.flatnonzero((envelope < SMALLEST_M) | (envelope > LARGEST_M))
    count = int(outside[0]) if len(outside) else windows
    if count < 3:
        return float("nan")
    time = WINDOW_S * np.arange(count)
    return float(np.polyfit(time, np.log(envelope[:count]), 1)[0])


def lateral_motion(truth: Truth, *, after_m: float) -> FloatArray:
    """Lateral displacements (n, k) of the axles in the design track frame, m.

    From when all axles have passed a place to where the vehicle leaves its speed.

    Parameters
    ----------
    truth : Truth
        A ride over straight track.
    after_m : float
        Where the kick ends.
    """
    axles = list(dict.fromkeys(wheel.rpartition(".")[0] for wheel in truth.wheel_names))
    at = truth.reference_position_m
    speed = np.abs(np.gradient(at, truth.time_s))
    offsets = [truth.bodies[axle].offset_m for axle in axles]
    forward = at[-1] >= at[0]
    passed = at + min(offsets) > after_m if forward else at + max(offsets) < after_m
    rows = np.flatnonzero(passed & (speed >= (1.0 - CRUISE) * speed.max()))
    columns = []
    for axle, offset in zip(axles, offsets, strict=True):
        body = truth.bodies[axle]
        frame = truth.track.frame(np.clip(at[rows] + offset, truth.track.start_m, truth.track.end_m))
        beside = np.asarray(body.position)[rows] - frame.position
        columns.append(np.einsum("nj,nj->n", frame.rotation[:, :, 1], beside))
    return np.column_stack(columns)


def score_kick(truth: Truth, *, after_m: float) -> pd.DataFrame:
    """Growth of the lateral motion after a kick as a figure, `simrail.scoring.table.FIGURE_COLUMNS`."""
    lateral = lateral_motion(truth, after_m=after_m)
    growth = growth_rate_1ps(lateral, truth.rate_hz)
    status = OK if np.isfinite(growth) else "no three seconds of small lateral motion after the kick"
    unit = unit_of("lateral_growth", "mean")
    row = ("lateral_growth", FULL, "truth", "whole", "mean", growth, unit, len(lateral), status)
    return table_of([row])


def decay_limit(growth_1ps: Mapping[float, float] | Sequence[tuple[float, float]]) -> float | None:
    """Speed at which growth crosses zero, linear between the first speed that grows and the one below it.

    Parameters
    ----------
    growth_1ps : mapping or sequence of pairs
        Speeds to growth rates; in any unit of speed, any order.

    Returns
    -------
    float or None
        None if none grows, or the slowest does already.
    """
    points = sorted(growth_1ps.items() if isinstance(growth_1ps, Mapping) else growth_1ps)
    for (slow, before), (fast, after) in pairwise(points):
        if before <= 0.0 < after:
            return float(slow - before * (fast - slow) / (after - before))
    return None
