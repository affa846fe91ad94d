"""Running safety: what wheel and rail forces say of derailment, track shift and wheel unloading.

The quantities of EN 14363 (and UIC 518, from which it grew) from arrays of forces at one rate:

* (Y/Q)_2m, the derailment quotient, and (sum Y)_2m, the track shift force of an axle: each low-passed at
  20 Hz, then its sliding mean over 2 m of track, every 0.5 m;
* Q and Y, the wheel load and the guiding force, low-passed at 20 Hz, and the wheel unloading
  dQ/Q0 = (Q0 - Q)/Q0.

Of each the greatest value, and the percentile that EN 14363 evaluates, 99.85 % (on either side where the
quantity has two). Limits: the 0.8 that EN 14363 sets, and Prud'homme's; Nadal's
is `simrail.vehicle.engines.derailment.nadal_limit`.

Sources. Quantities, filters (20 Hz), windows (2 m every 0.5 m) and percentiles (0.15 and 99.85 %): the table
of EN 14363 and UIC 518 at gensys.se/course/UIC518_tests.html. (Y/Q)_2m <= 0.8: railwaynews.net on UIC 518.
From memory, because no text of the standards could be read: the clauses (EN 14363:2016, 7.5 and 7.6 for
processing and limits; 6.1 for dQ/Q0 <= 0.6 on twisted track), the filter's slope of 24 dB per octave, and
the factor 0.85 of freight wagons in Prud'homme's limit.

Signs: Y along the lateral axis of the track, the same way for both wheels of an axle; Q normal to the plane
of the rails, positive where wheel and rail press. Truths are met in `simrail.scoring.ride_figures` only.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

CUT_OFF_HZ = 20.0
WINDOW_M = 2.0
STEP_M = 0.5
PERCENTILE = 99.85
"""EN 14363 takes the percentiles 0.15 % and 99.85 % of safety quantities."""

DERAILMENT_LIMIT = 0.8
"""Limit of (Y/Q)_2m in EN 14363."""

UNLOADING_LIMIT = 0.6
"""Limit of dQ/Q0 on twisted track, standing or at walking pace (EN 14363, 6.1; from memory)."""

TRACK_SHIFT_FACTOR = {"passenger": 1.0, "freight": 0.85}
"""Factor of Prud'homme's limit: locomotives and coaches 1.0, freight wagons 0.85 (from memory)."""

LEAST_RATE_HZ = 100.0
"""Lowest rate of forces that a low-pass at 20 Hz makes sense of."""

_CARRIES = 0.01
"""Below this share of its static load a wheel carries nothing: its quotient Y/Q is 0/0, and counts as 0."""


def prudhomme_limit_n(axle_load_n: float, *, factor: float = 1.0) -> float:
    """Greatest (sum Y)_2m that ballasted track bears: factor (10 kN + P0/3), P0 = 2 Q0 (Prud'homme 1967).

    Parameters
    ----------
    axle_load_n : float
        Static load of the axle, P0.
    factor : float
        See `TRACK_SHIFT_FACTOR`.
    """
    return factor * (10e3 + axle_load_n / 3.0)


def low_pass(values: FloatArray, rate_hz: float, *, cut_off_hz: float = CUT_OFF_HZ) -> FloatArray:
    """Low-pass without a shift of place: -3 dB at the cut-off, 24 dB per octave beyond.

    A Butterworth filter of second order runs forward and backward, |H|^2 = 1/(1 + (f/f0)^4) of both runs
    together; f0 lies so much above the cut-off that they reach 1/sqrt(2) there.

    Parameters
    ----------
    values : ndarray (n,)
        Samples.
    rate_hz : float
        Their rate; at least `LEAST_RATE_HZ`.
    cut_off_hz : float
        Where it lets 1/sqrt(2) through.

    Raises
    ------
    InputError
        If the rate is too low.
    """
    if rate_hz < LEAST_RATE_HZ:
        raise InputError(
            "is too low for forces that are low-passed at 20 Hz",
            field="truth_rate_hz",
            value=rate_hz,
            limit=f"{LEAST_RATE_HZ:g} Hz",
            remedy="keep the contact forces at a higher rate",
        )
    # A digital filter bends the axis of frequency: the corner is moved in the tangent's scale.
    corner = np.tan(np.pi * cut_off_hz / rate_hz) / (np.sqrt(2.0) - 1.0) ** 0.25
    sos = butter(2, 2.0 * np.arctan(corner) / np.pi, output="sos")
    filtered: FloatArray = sosfiltfilt(sos, values)
    return filtered


def travelled(position_m: FloatArray) -> FloatArray:
    """Distance travelled (n,) from places (n,), whichever way the vehicle runs."""
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(position_m)))])


def sliding_mean(
    distance_m: FloatArray, values: FloatArray, *, window_m: float = WINDOW_M, step_m: float = STEP_M
) -> tuple[FloatArray, FloatArray]:
    """Mean over a window of distance, not of time: what is slow counts no more than what is fast.

    With v(s) linear between the samples, (1/w) integral of v ds over [s - w/2, s + w/2], exactly.

    Parameters
    ----------
    distance_m : ndarray (n,)
        Distance travelled, never falling.
    values : ndarray (n,)
        Values there.
    window_m, step_m : float
        Length of the window, and how far it moves on each time.

    Returns
    -------
    middle_m : ndarray (k,)
        Middles of the windows that lie within the way; none if the way is shorter than one.
    mean : ndarray (k,)
        Means.
    """
    way = float(distance_m[-1] - distance_m[0])
    count = int(np.floor((way - window_m) / step_m + 1e-9)) + 1 if way >= window_m else 0
    begin = distance_m[0] + step_m * np.arange(count)
    length = np.diff(distance_m)
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * length)])

    def up_to(place: FloatArray) -> FloatArray:
        at = np.clip(np.searchsorted(distance_m, place, side="right") - 1, 0, len(length) - 1)
        into = np.clip(place - distance_m[at], 0.0, length[at])
        slope = (values[at + 1] - values[at]) / np.where(length[at] > 0.0, length[at], 1.0)
        until: FloatArray = integral[at] + into * (values[at] + 0.5 * slope * into)
        return until

    return begin + 0.5 * window_m, (up_to(begin + window_m) - up_to(begin)) / window_m


def greatest_percentile(values: FloatArray, percentile: float = PERCENTILE) -> float:
    """Greater one, by size, of the upper percentile and of the lower, 100 % less it (EN 14363)."""
    low, high = np.percentile(values, [100.0 - percentile, percentile])
    return float(max(abs(low), abs(high)))


def section_percentiles(
    distance_m: FloatArray, values: FloatArray, section_m: float, *, percentile: float = PERCENTILE
) -> FloatArray:
    """`greatest_percentile` of each whole track section of a length (m,), as EN 14363 evaluates tests.

    Sections of 250 m on straight track, 100 m in curves, 70 m in sharp ones (from memory).
    """
    number = np.floor((distance_m - distance_m[0]) / section_m).astype(np.int64)
    whole = int(np.floor((distance_m[-1] - distance_m[0]) / section_m + 1e-9))
    parts = (values[number == i] for i in range(whole))
    return np.array([greatest_percentile(part, percentile) for part in parts if len(part)])


def estimated_maximum(section_values: FloatArray, *, coefficient: float = 3.0) -> float:
    """Mean of the sections' percentiles and `coefficient` standard deviations (n - 1) above it.

    EN 14363's one-dimensional estimate; 3.0 for safety, 2.2 for track loading and ride (from memory).

    Raises
    ------
    ValueError
        If there are fewer than two sections.
    """
    if len(section_values) < 2:
        raise ValueError("a standard deviation needs two sections")
    return float(np.mean(section_values) + coefficient * np.std(section_values, ddof=1))


@dataclass(frozen=True)
class WheelForces:
    """Forces of a wheel on its rail; n samples at one rate.

    Attributes
    ----------
    wheel : str
        Name, ``"<axle>.left"`` or ``"<axle>.right"``.
    static_load_n : float
        Q0.
    vertical_n, lateral_n : ndarray (n,)
        Q and Y; see the module for their signs.
    """

    wheel: str
    static_load_n: float
    vertical_n: FloatArray
    lateral_n: FloatArray

    @property
    def axle(self) -> str:
        """Name of its axle."""
        return self.wheel.rpartition(".")[0]


@dataclass(frozen=True)
class SafetySeries:
    """What EN 14363 makes of the forces of one axle; n samples, k windows of 2 m.

    Attributes
    ----------
    axle : str
        Its name.
    wheels : tuple of str
        Names of its wheels.
    middle_m : ndarray (k,)
        Middles of the windows, distance travelled.
    derailment_quotient : ndarray (w, k)
        (Y/Q)_2m of each wheel.
    sum_y_n : ndarray (k,)
        (sum Y)_2m of the axle.
    wheel_load_n, guiding_force_n : ndarray (w, n)
        Q and Y of each wheel, low-passed.
    static_load_n : ndarray (w,)
        Q0 of each wheel.
    """

    axle: str
    wheels: tuple[str, ...]
    middle_m: FloatArray
    derailment_quotient: FloatArray
    sum_y_n: FloatArray
    wheel_load_n: FloatArray
    guiding_force_n: FloatArray
    static_load_n: FloatArray

    @property
    def unloading(self) -> FloatArray:
        """dQ/Q0 = (Q0 - Q)/Q0 of each wheel (w, n)."""
        return 1.0 - self.wheel_load_n / self.static_load_n[:, None]


def safety_series(
    wheels: Sequence[WheelForces], position_m: FloatArray, *, rate_hz: float
) -> list[SafetySeries]:
    """Low-passed forces and their means over 2 m, axle by axle.

    Parameters
    ----------
    wheels : sequence of WheelForces
        Wheels of a vehicle.
    position_m : ndarray (n,)
        Place of the vehicle.
    rate_hz : float
        Rate of the samples.

    Raises
    ------
    InputError
        If the rate is below `LEAST_RATE_HZ`.
    """
    distance = travelled(position_m)
    series = []
    for axle in dict.fromkeys(wheel.axle for wheel in wheels):
        own = [wheel for wheel in wheels if wheel.axle == axle]
        static = np.array([wheel.static_load_n for wheel in own])
        lateral = np.array([low_pass(wheel.lateral_n, rate_hz) for wheel in own])
        load = np.array([low_pass(wheel.vertical_n, rate_hz) for wheel in own])
        carries = load > _CARRIES * static[:, None]
        quotient = np.where(carries, lateral / np.where(carries, load, 1.0), 0.0)
        middle, shift = sliding_mean(distance, lateral.sum(axis=0))
        series.append(
            SafetySeries(
                axle=axle,
                wheels=tuple(wheel.wheel for wheel in own),
                middle_m=middle,
                derailment_quotient=np.array([sliding_mean(distance, one)[1] for one in quotient]),
                sum_y_n=shift,
                wheel_load_n=load,
                guiding_force_n=lateral,
                static_load_n=static,
            )
        )
    return series
