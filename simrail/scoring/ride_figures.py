"""What a ride itself was like: running safety and ride comfort, as figures of the score table.

They are of the truth, not of an estimate: in the table they stand under the estimator `RIDE`. Each is the
worst of the vehicle, over all its wheels or axles; `running_safety` has it wheel by wheel.

* ``derailment_quotient``: (Y/Q)_2m, by size; ``sum_y``: (sum Y)_2m in kN, and ``sum_y_relative``, that over
  Prud'homme's limit for the axle; ``guiding_force`` and ``wheel_load``: Y and Q in kN; ``wheel_unloading``:
  dQ/Q0, 1 where a wheel carries nothing. Metrics are ``max``, ``p9985`` (the percentile of EN 14363) and, of
  the unloading, ``rms`` (`simrail.scoring.running_safety`).
* ``comfort_nmv`` (its metric is ``p95``: it is made of 95th percentiles), ``sperling_lateral`` and
  ``sperling_vertical`` (``rms``: of rms accelerations), where an IMU sits (`simrail.scoring.ride_comfort`).
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from simrail.core.columns import ACCEL
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.ride.truth import Mount, Truth
from simrail.scoring.metrics import IntArray, Row
from simrail.scoring.ride_comfort import MeanComfort, mean_comfort, sperling
from simrail.scoring.running_safety import (
    PERCENTILE,
    SafetySeries,
    WheelForces,
    greatest_percentile,
    prudhomme_limit_n,
    safety_series,
    travelled,
)
from simrail.scoring.table import FULL, NO_SAMPLES, OK, table_of, unit_of
from simrail.scoring.windows import STANDSTILL_MPS, chosen_windows, windows_of
from simrail.vehicle.model import VehicleModel

RIDE = "truth"
"""Estimator of the figures of the ride itself."""

_LEFT_OUT = ("standstill", "cropped")


@dataclass(frozen=True)
class AxleSafety:
    """One axle's running safety along the track.

    Attributes
    ----------
    series : SafetySeries
        Its forces as EN 14363 evaluates them.
    time_s : ndarray (n,)
        Times of the wheel loads.
    position_m : ndarray (n,)
        Place s of the axle at these times.
    middle_position_m : ndarray (k,)
        Place s of the middles of the windows of 2 m.
    shift_limit_n : float
        Prud'homme's limit of its sum of Y.
    """

    series: SafetySeries
    time_s: FloatArray
    position_m: FloatArray
    middle_position_m: FloatArray
    shift_limit_n: float


@dataclass(frozen=True)
class RideComfort:
    """Comfort where a mount is.

    Attributes
    ----------
    mean : MeanComfort
        N_MV of EN 12299 and what it is made of.
    sperling_lateral, sperling_vertical : float
        Wz for comfort.
    """

    mean: MeanComfort
    sperling_lateral: float
    sperling_vertical: float


def axles_of(truth: Truth, vehicle: VehicleModel, *, factor: float = 1.0) -> list[AxleSafety]:
    """Running safety of each axle of a ride.

    Parameters
    ----------
    truth : Truth
        A ride that kept its contact forces at `simrail.scoring.running_safety.LEAST_RATE_HZ` or more.
    vehicle : VehicleModel
        What ran; its static wheel loads are Q0.
    factor : float
        Of Prud'homme's limit, see `simrail.scoring.running_safety.TRACK_SHIFT_FACTOR`.

    Raises
    ------
    InputError
        If the ride kept no forces, or at too low a rate.
    """
    static = dict(zip(vehicle.wheel_names, vehicle.wheel_load_n(truth.gravity_mps2), strict=True))
    rate_hz = truth.rate_hz / truth.contact_every
    by_axle: dict[str, list[str]] = {}
    for wheel in vehicle.wheel_names:
        by_axle.setdefault(wheel.rpartition(".")[0], []).append(wheel)
    axles = []
    for names in by_axle.values():
        frames = {wheel: truth.contact(wheel) for wheel in names}
        wheels = [
            WheelForces(
                wheel,
                float(static[wheel]),
                frame["wheel_load_n"].to_numpy(),
                frame["guiding_force_n"].to_numpy(),
            )
            for wheel, frame in frames.items()
        ]
        frame = frames[names[0]]
        position = frame["position_m"].to_numpy()
        (series,) = safety_series(wheels, position, rate_hz=rate_hz)
        axles.append(
            AxleSafety(
                series,
                frame.index.to_numpy(dtype=np.float64),
                position,
                np.interp(series.middle_m, travelled(position), position),
                prudhomme_limit_n(float(series.static_load_n.sum()), factor=factor),
            )
        )
    return axles


def running_safety(truth: Truth, vehicle: VehicleModel, *, factor: float = 1.0) -> pd.DataFrame:
    """Running safety of a ride, wheel by wheel.

    Parameters
    ----------
    truth, vehicle, factor
        See `axles_of`.

    Returns
    -------
    pandas.DataFrame
        Indexed by ``wheel``: ``static_load_n``; greatest ``wheel_load_n`` and, by size,
        ``guiding_force_n``; ``least_load``, smallest Q/Q0; ``unloading_rms``, of dQ/Q0; greatest
        ``derailment_quotient`` and its ``derailment_quotient_p9985``; greatest ``sum_y_n`` of its axle, and
        ``sum_y_relative``, that over Prud'homme's limit. What needs 2 m of way is NaN on a shorter one.

    Raises
    ------
    InputError
        See `axles_of`.
    """
    records: dict[str, dict[str, float]] = {}
    for axle in axles_of(truth, vehicle, factor=factor):
        series = axle.series
        shift = _greatest(series.sum_y_n)
        for i, wheel in enumerate(series.wheels):
            quotient = series.derailment_quotient[i]
            records[wheel] = {
                "static_load_n": float(series.static_load_n[i]),
                "wheel_load_n": float(series.wheel_load_n[i].max()),
                "guiding_force_n": _greatest(series.guiding_force_n[i]),
                "least_load": float(1.0 - series.unloading[i].max()),
                "unloading_rms": _rms(series.unloading[i]),
                "derailment_quotient": _greatest(quotient),
                "derailment_quotient_p9985": greatest_percentile(quotient) if len(quotient) else np.nan,
                "sum_y_n": shift,
                "sum_y_relative": shift / axle.shift_limit_n,
            }
    frame = pd.DataFrame.from_dict(records, orient="index")
    return frame.rename_axis("wheel")


def ride_comfort(truth: Truth, mount: Mount) -> RideComfort:
    """Ride comfort where a mount is, from the beginning of the motion to its end.

    Parameters
    ----------
    truth : Truth
        A ride at `simrail.scoring.ride_comfort.LEAST_RATE_HZ` or more.
    mount : Mount
        A place on the floor of the car body.

    Raises
    ------
    InputError
        If the rate is too low, or the vehicle does not run for 5 s.
    """
    motion = truth.motion(mount)
    acceleration = motion[list(ACCEL)].to_numpy()
    runs = np.abs(motion["speed_mps"].to_numpy()) >= STANDSTILL_MPS
    mean = mean_comfort(acceleration, truth.rate_hz, counts=runs)
    moving = np.flatnonzero(runs)
    while_moving = acceleration[moving[0] : moving[-1] + 1]
    return RideComfort(
        mean,
        sperling(while_moving[:, 1], truth.rate_hz, "lateral"),
        sperling(while_moving[:, 2], truth.rate_hz, "vertical"),
    )


def score_running_safety(
    truth: Truth,
    vehicle: VehicleModel,
    *,
    factor: float = 1.0,
    windows: Collection[str] | None = None,
) -> pd.DataFrame:
    """Running safety as figures, columns `simrail.scoring.table.FIGURE_COLUMNS`.

    Parameters
    ----------
    truth, vehicle, factor
        See `axles_of`.
    windows : collection of str, optional
        Windows to keep. A place counts to that which the axle is in.

    Raises
    ------
    InputError
        See `axles_of`.
    """
    axles = axles_of(truth, vehicle, factor=factor)
    parts: list[tuple[AxleSafety, Mapping[str, IntArray], Mapping[str, IntArray]]] = []
    for axle in axles:
        speed = np.gradient(axle.position_m, axle.time_s)
        at_samples = windows_of(truth.track, axle.position_m, speed)
        moves = np.ones(len(axle.middle_position_m))
        at_middles = windows_of(truth.track, axle.middle_position_m, moves)
        parts.append((axle, at_samples, at_middles))
    every = {name: np.empty(0, dtype=np.intp) for _, *own in parts for one in own for name in one}
    rows: list[Row] = []
    for window in chosen_windows(every, windows):
        if window in _LEFT_OUT:
            continue
        quotients = [q[m.get(window, [])] for a, _, m in parts for q in a.series.derailment_quotient]
        shifts = [a.series.sum_y_n[m.get(window, [])] for a, _, m in parts]
        relative = [y / a.shift_limit_n for y, (a, _, _) in zip(shifts, parts, strict=True)]
        guiding = [y[s.get(window, [])] for a, s, _ in parts for y in a.series.guiding_force_n]
        loads = [q[s.get(window, [])] for a, s, _ in parts for q in a.series.wheel_load_n]
        unloadings = [u[s.get(window, [])] for a, s, _ in parts for u in a.series.unloading]
        rows += _worst("derailment_quotient", window, quotients, _TWO_SIDED)
        rows += _worst("sum_y", window, [1e-3 * y for y in shifts], _TWO_SIDED)
        rows += _worst("sum_y_relative", window, relative, _TWO_SIDED)
        rows += _worst("guiding_force", window, [1e-3 * y for y in guiding], _TWO_SIDED)
        rows += _worst("wheel_load", window, [1e-3 * q for q in loads], _ONE_SIDED)
        rows += _worst("wheel_unloading", window, unloadings, _ONE_SIDED | {"rms": _rms})
    return table_of(rows)


def score_ride_comfort(truth: Truth, mount: Mount) -> pd.DataFrame:
    """Ride comfort as figures, of the ride as a whole; columns as for `score_running_safety`.

    A ride that is too short for a figure has a row that says so.
    """
    names = (("comfort_nmv", "p95"), ("sperling_lateral", "rms"), ("sperling_vertical", "rms"))
    values, periods, status = [np.nan] * 3, 0, OK
    try:
        comfort = ride_comfort(truth, mount)
    except InputError as error:
        status = error.problem
    else:
        values = [comfort.mean.n_mv, comfort.sperling_lateral, comfort.sperling_vertical]
        periods = comfort.mean.periods
    return table_of(
        [
            (quantity, FULL, "truth", "whole", metric, value, unit_of(quantity, metric), periods, status)
            for (quantity, metric), value in zip(names, values, strict=True)
        ]
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _greatest(values: FloatArray) -> float:
    return float(np.abs(values).max()) if len(values) else np.nan


def _upper(values: FloatArray) -> float:
    return float(np.percentile(values, PERCENTILE))


_TWO_SIDED: dict[str, Callable[[FloatArray], float]] = {"max": _greatest, "p9985": greatest_percentile}
_ONE_SIDED: dict[str, Callable[[FloatArray], float]] = {
    "max": lambda values: float(values.max()),
    "p9985": _upper,
}


def _worst(
    quantity: str, window: str, series: list[FloatArray], metrics: Mapping[str, Callable[[FloatArray], float]]
) -> list[Row]:
    """Figures of a quantity in a window: each metric of each series, and of these the greatest."""
    n = sum(map(len, series))
    filled = [values for values in series if len(values)]
    status = OK if filled else NO_SAMPLES
    return [
        (
            quantity,
            FULL,
            "truth",
            window,
            metric,
            max(map(of, filled)) if filled else np.nan,
            unit_of(quantity, metric),
            n,
            status,
        )
        for metric, of in metrics.items()
    ]
