"""IMU grades: the error terms of a device, in SI units.

A grade is a handful of numbers; `simrail.sensors.imu` turns them into samples,
`simrail.recording.sheets.datasheet` makes them from what a data sheet prints, and
`simrail.recording.sheets.imu_file` reads files of such figures.

Conventions (IEEE Std 952): noise is given by the Allan coefficient N, so the standard deviation of one
sample is N sqrt(rate). Bias instability is the coefficient B, whose Allan deviation is flat at
sqrt(2 ln 2 / pi) B = 0.664 B. Whatever a sheet prints as "+-b" (initial bias, scale factor error,
misalignment, ...) is the bound of a uniform distribution, drawn once per device and axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np

from simrail.core.errors import Faults, InputError
from simrail.core.jit import FloatArray
from simrail.recording.recording import ImuSheet
from simrail.recording.sheets.allan import (
    bias_sd,
    flicker_stages,
    gauss_markov_allan,
    random_walk_allan,
    white_allan,
)

REFERENCE_TEMPERATURE_C = 25.0
"""Where a device has no temperature error: that of its calibration."""


@dataclass(frozen=True)
class Triad:
    """The terms that both triads of a grade may have, without their units: see `ImuGrade`."""

    noise: float
    bias_instability: float
    bias_correlation: float
    random_walk: float
    turn_on_bias: float
    scale_error: float
    nonlinearity: float
    nonorthogonality: float
    g_sensitivity: float
    vibration_rectification: float
    bias_temperature: float
    scale_temperature: float
    range: float
    resolution: float


@dataclass(frozen=True)
class ImuGrade:
    """Error terms of an IMU; every axis of a triad has the same figures and its own draws.

    A term that is left out is not there. "Bound" means a constant of each axis and device, uniform
    between minus and plus.

    Attributes
    ----------
    name : str
        Name of the grade.
    rate_hz : float
        Output rate, > 0.
    gyro_noise_radpsqrts, accel_noise_mpsqrts : float
        Allan coefficient N of the white noise (angle and velocity random walk), rad/s/sqrt(Hz) and
        m/s2/sqrt(Hz).
    gyro_bias_instability_radps, accel_bias_instability_mps2 : float
        In-run bias instability B, by the process that `bias_process` names.
    gyro_bias_correlation_s, accel_bias_correlation_s : float
        Correlation time of the Gauss-Markov process. Data sheets do not print it.
    bias_process : {"gauss_markov", "flicker"}
        One Gauss-Markov process whose Allan deviation peaks at 0.664 B, or a sum of them that is flat at
        0.664 B over `flicker_range_s`. Stationary from the first sample, either way.
    flicker_range_s : tuple of float
        Averaging times between which the floor is flat.
    gyro_random_walk_radpspsqrts, accel_random_walk_mps2psqrts : float
        Rate random walk K, rad/s/sqrt(s) and m/s2/sqrt(s); 0 at the first sample.
    gyro_turn_on_bias_radps, accel_turn_on_bias_mps2 : float
        Bound of the constant bias.
    gyro_scale_error, accel_scale_error : float
        Bound of the relative error of the scale factor.
    gyro_nonlinearity, accel_nonlinearity : float
        Largest deviation from the straight line through zero and full scale, as a fraction of the range:
        bound of the amplitude of an odd cubic. Needs a range.
    package_misalignment_rad : float
        Bound of the turns of the whole package about its three axes.
    gyro_nonorthogonality_rad, accel_nonorthogonality_rad : float
        Bound of the three angles by which Y leans towards X, and Z towards X and Y.
    gyro_g_sensitivity_radspm : float
        Bound of each of the nine coefficients from specific force to rate, rad/s per m/s2.
    gyro_vibration_rectification_rads3pm2, accel_vibration_rectification_s2pm : float
        Bound of the bias per mean square of the vibration along the axis, rad/s and m/s2 per (m/s2)2.
    vibration_averaging_s : float
        Time constant of the running means of force and squared vibration.
    gyro_bias_temperature_radpspk, accel_bias_temperature_mps2pk : float
        Bound of the bias per kelvin away from 25 degrees Celsius.
    gyro_scale_temperature_1pk, accel_scale_temperature_1pk : float
        Bound of the relative scale error per kelvin away from 25 degrees Celsius.
    gyro_range_radps, accel_range_mps2 : float
        Largest magnitude that is measured; infinite for no limit.
    gyro_resolution_radps, accel_resolution_mps2 : float
        Size of one count of the rate; 0 for no quantisation. Of increments, one count is this times the
        sample interval.
    bandwidth_hz : float, optional
        -3 dB frequency of the device's own second-order response (Butterworth), before sampling.
    gyro_bandwidth_hz, accel_bandwidth_hz : float, optional
        The same of one triad, where it has one of its own; see `bandwidth_of`.
    gyro_axis_noise, accel_axis_noise : tuple of float
        White noise of the axes x, y, z over that of the triad, at most 1.
    oversampling : int
        The device samples this many times as fast and averages over each interval; 1 for no averaging.
    output : {"rates", "increments"}
        Whether the device sends rates or angle and velocity increments; see `simrail.sensors.imu`.
    clock_jitter_s : float
        Standard deviation of the time at which a sample is really taken; below a tenth of the interval.
    clock_drift : float
        Bound of the relative error of the device's second.
    dropped_fraction : float
        Share of the samples that never arrive, < 0.5.
    dropped_burst : float
        Mean number of samples that are lost in a row, >= 1.
    source : str
        Where the figures come from.
    assumed : tuple of str
        What was assumed where the source is silent, a sentence each.
    """

    name: str
    rate_hz: float
    gyro_noise_radpsqrts: float = 0.0
    accel_noise_mpsqrts: float = 0.0
    gyro_bias_instability_radps: float = 0.0
    accel_bias_instability_mps2: float = 0.0
    gyro_bias_correlation_s: float = 300.0
    accel_bias_correlation_s: float = 300.0
    bias_process: Literal["gauss_markov", "flicker"] = "gauss_markov"
    flicker_range_s: tuple[float, float] = (1.0, 1000.0)
    gyro_random_walk_radpspsqrts: float = 0.0
    accel_random_walk_mps2psqrts: float = 0.0
    gyro_turn_on_bias_radps: float = 0.0
    accel_turn_on_bias_mps2: float = 0.0
    gyro_scale_error: float = 0.0
    accel_scale_error: float = 0.0
    gyro_nonlinearity: float = 0.0
    accel_nonlinearity: float = 0.0
    package_misalignment_rad: float = 0.0
    gyro_nonorthogonality_rad: float = 0.0
    accel_nonorthogonality_rad: float = 0.0
    gyro_g_sensitivity_radspm: float = 0.0
    gyro_vibration_rectification_rads3pm2: float = 0.0
    accel_vibration_rectification_s2pm: float = 0.0
    vibration_averaging_s: float = 1.0
    gyro_bias_temperature_radpspk: float = 0.0
    accel_bias_temperature_mps2pk: float = 0.0
    gyro_scale_temperature_1pk: float = 0.0
    accel_scale_temperature_1pk: float = 0.0
    gyro_range_radps: float = math.inf
    accel_range_mps2: float = math.inf
    gyro_resolution_radps: float = 0.0
    accel_resolution_mps2: float = 0.0
    bandwidth_hz: float | None = None
    gyro_bandwidth_hz: float | None = None
    accel_bandwidth_hz: float | None = None
    gyro_axis_noise: tuple[float, float, float] = (1.0, 1.0, 1.0)
    accel_axis_noise: tuple[float, float, float] = (1.0, 1.0, 1.0)
    oversampling: int = 1
    output: Literal["rates", "increments"] = "rates"
    clock_jitter_s: float = 0.0
    clock_drift: float = 0.0
    dropped_fraction: float = 0.0
    dropped_burst: float = 1.0
    source: str = ""
    assumed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        faults = Faults()
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, int | float):
                with faults.gathered():
                    _judge(self.name, field.name, value)
        here = f"imu grade {self.name}: "
        for name, choices in (
            ("bias_process", ("gauss_markov", "flicker")),
            ("output", ("rates", "increments")),
        ):
            with faults.gathered():
                judge_choice(here + name, getattr(self, name), choices)
        if not faults.found:
            for judged in (_judge_nonlinearity, _judge_jitter, _judge_flicker, _judge_axis_noise):
                with faults.gathered():
                    judged(self)
        faults.refuse()

    @classmethod
    def from_datasheet(cls, name: str, rate_hz: float, **figures: Any) -> ImuGrade:
        """Build a grade in the units of data sheets.

        See `simrail.recording.sheets.datasheet.grade_from_datasheet`.
        """
        from simrail.recording.sheets.datasheet import grade_from_datasheet

        return grade_from_datasheet(name, rate_hz, **figures)

    def triad(self, kind: str) -> Triad:
        """Terms of the triad ``"gyro"`` or ``"accel"``; those that it does not have are 0."""
        values = {term: getattr(self, name) for term, name in _FIELDS[kind].items()}
        return Triad(**dict.fromkeys(_TERMS, 0.0) | values)

    def bandwidth_of(self, kind: str) -> float | None:
        """-3 dB frequency of the triad ``"gyro"`` or ``"accel"``: its own, or that of the device."""
        own: float | None = getattr(self, f"{kind}_bandwidth_hz")
        return self.bandwidth_hz if own is None else own

    @property
    def lag_s(self) -> float:
        """Age of what a sample says at its time stamp, for slow motion: response and averaging.

        sqrt(2) / (2 pi bandwidth), and half the time over which the device averages; of two bandwidths, the
        larger age. Like a real device, the simulated one does not correct it.
        """
        bandwidths = [band for kind in ("gyro", "accel") if (band := self.bandwidth_of(kind))]
        response = math.sqrt(2.0) / (2.0 * math.pi * min(bandwidths)) if bandwidths else 0.0
        return response + 0.5 * (self.oversampling - 1) / (self.oversampling * self.rate_hz)

    def bias_stages(self, kind: str) -> tuple[FloatArray, FloatArray]:
        """Correlation times and standard deviations (m,) of the processes that make the wandering bias."""
        terms = self.triad(kind)
        if terms.bias_instability == 0.0:
            return np.empty(0), np.empty(0)
        if self.bias_process == "flicker":
            return flicker_stages(terms.bias_instability, self.flicker_range_s)
        return np.array([terms.bias_correlation]), np.array([bias_sd(terms.bias_instability)])

    def allan(self, averaging_s: FloatArray) -> dict[str, FloatArray]:
        """Analytic Allan deviation of each triad of a resting device.

        The root sum of squares of white noise, wandering bias, random walk and quantisation. A count of a
        rate, c, is white noise of c / sqrt(12 rate) where the noise crosses many counts; a count of an
        increment, q, is sqrt(3) (q / sqrt(12)) / tau (IEEE Std 952). Constants do not show.

        Parameters
        ----------
        averaging_s : ndarray (n,)
            Averaging times, s.

        Returns
        -------
        dict of str to ndarray (n,)
            ``"gyro"`` in rad/s and ``"accel"`` in m/s2.
        """
        tau = np.asarray(averaging_s, dtype=np.float64)
        found = {}
        for kind in ("gyro", "accel"):
            terms = self.triad(kind)
            if self.output == "rates":
                counting = white_allan(tau, terms.resolution / math.sqrt(12.0 * self.rate_hz))
            else:
                counting = 0.5 * terms.resolution / self.rate_hz / tau
            parts = [white_allan(tau, terms.noise), random_walk_allan(tau, terms.random_walk), counting]
            for correlation, sd in zip(*self.bias_stages(kind), strict=True):
                parts.append(gauss_markov_allan(tau, sd=float(sd), correlation_s=float(correlation)))
            found[kind] = np.sqrt(np.sum(np.square(parts), axis=0))
        return found


_TERMS = [term.name for term in fields(Triad)]
_FIELDS = {
    kind: {
        term: field.name
        for term in _TERMS
        for field in fields(ImuGrade)
        if field.name.startswith(f"{kind}_{term}")
    }
    for kind in ("gyro", "accel")
}
"""Field of a grade that holds a term, by triad and term."""


def imu_sheet(grade: ImuGrade, *, delay_s: float) -> ImuSheet:
    """What the data sheet of a grade tells an estimator: the figures that both have, None for no range."""
    shared = {
        field.name: getattr(grade, field.name) for field in fields(ImuSheet) if hasattr(grade, field.name)
    }
    bandwidths = [band for kind in ("gyro", "accel") if (band := grade.bandwidth_of(kind)) is not None]
    shared["bandwidth_hz"] = min(bandwidths, default=None)
    unlimited = {name: None for name, value in shared.items() if value == math.inf}
    return ImuSheet(grade=grade.name, delay_s=delay_s, **shared | unlimited)


def silent_noise(grade: ImuGrade) -> tuple[str, ...]:
    """Warnings, a line each, of triads without white noise on a device that has errors.

    Every real gyroscope and accelerometer has some: it is missing from the file then, and what an estimator
    reaches would be better than it is. A device without any error is meant to have none.
    """
    triads = {kind: grade.triad(kind) for kind in ("gyro", "accel")}
    errors = [
        getattr(terms, name)
        for terms in triads.values()
        for name in _TERMS
        if name not in ("range", "bias_correlation", "resolution")
    ]
    if not any(errors) and grade.package_misalignment_rad == 0.0:
        return ()
    wanted = {
        "gyro": ("gyro", "angle random walk: gyro_noise_degpsqrth, or its density: gyro_noise_degpsqrthz"),
        "accel": (
            "accelerometer",
            "velocity random walk: accel_noise_mpspsqrth, or its density: accel_noise_ugpsqrthz",
        ),
    }
    return tuple(
        f"IMU {grade.name} has no white noise of the {wanted[kind][0]}: give its {wanted[kind][1]}"
        for kind, terms in triads.items()
        if terms.noise == 0.0
    )


_POSITIVE = ("rate_hz", "correlation_s", "bandwidth_hz", "averaging_s")
_SMALL = ("scale_error", "nonlinearity", "misalignment_rad", "nonorthogonality_rad", "1pk", "clock_drift")


_LARGEST = {"gyro": 100.0, "accel": 1e4}
"""Largest bias, noise or count, rad/s and m/s2 (of noise per root of a second): a slip of units is beyond."""

_MOST = {
    "rate_hz": 1e5,
    "oversampling": 1000.0,
    "correlation_s": 1e9,
    "bandwidth_hz": 1e6,
    "dropped_burst": 1e6,
}
"""Largest values of others, by how their names end."""


def _judge(grade: str, name: str, value: float) -> None:
    """Refuse a figure that no device can have."""
    limit, fine = ">= 0", value >= 0.0
    if name.endswith(_POSITIVE) or "range" in name:
        limit, fine = "> 0", value > 0.0
    elif name in ("oversampling", "dropped_burst"):
        limit, fine = ">= 1", value >= 1.0
    elif name == "dropped_fraction":
        limit, fine = ">= 0 and < 0.5", 0.0 <= value < 0.5
    elif name.endswith(_SMALL):
        limit, fine = ">= 0 and < 0.2", 0.0 <= value < 0.2
    most = next((top for end, top in _MOST.items() if name.endswith(end)), math.inf)
    if "range" not in name and not name.endswith("bandwidth_hz"):
        most = min(most, _LARGEST.get(name.partition("_")[0], math.inf))
        most = 1e9 if name.endswith("correlation_s") else most
    if fine and value > most:
        limit, fine = f"{limit} and <= {most:g}", False
    if not fine or (math.isinf(value) and "range" not in name):
        raise InputError("is out of range", field=f"imu grade {grade}: {name}", value=value, limit=limit)


def judge_choice(field: str, value: Any, choices: tuple[str, ...]) -> None:
    """Refuse a word that is none of the possible ones."""
    if value not in choices:
        limit = "one of " + ", ".join(choices)
        raise InputError("is not one of the possible values", field=field, value=value, limit=limit)


def _judge_nonlinearity(grade: ImuGrade) -> None:
    """Refuse fractions of a full scale that is not given."""
    faults = Faults()
    for kind, unit in (("gyro", "radps"), ("accel", "mps2")):
        terms = grade.triad(kind)
        with faults.gathered():
            if terms.nonlinearity > 0.0 and math.isinf(terms.range):
                raise InputError(
                    "is a fraction of a full scale that is not given",
                    field=f"imu grade {grade.name}: {kind}_nonlinearity",
                    value=terms.nonlinearity,
                    remedy=f"give {kind}_range_{unit} as well",
                    limit="a full scale beside it",
                )
    faults.refuse()


def _judge_axis_noise(grade: ImuGrade) -> None:
    """Refuse axes that are noisier than their triad."""
    faults = Faults()
    for kind in ("gyro", "accel"):
        shares = getattr(grade, f"{kind}_axis_noise")
        with faults.gathered():
            if len(shares) != 3 or not all(0.0 <= share <= 1.0 for share in shares):
                raise InputError(
                    "is not the share of each axis in the noise of the triad",
                    field=f"imu grade {grade.name}: {kind}_axis_noise",
                    value=list(shares),
                    limit="three numbers from 0 to 1",
                    remedy="give the figures of the axes x, y, z as a list in the place of that of the triad",
                )
    faults.refuse()


def _judge_jitter(grade: ImuGrade) -> None:
    """Refuse a clock that would change the order of samples."""
    if grade.clock_jitter_s > 0.1 / grade.rate_hz:
        raise InputError(
            "is more than a tenth of the sample interval",
            field=f"imu grade {grade.name}: clock_jitter_s",
            value=grade.clock_jitter_s,
            limit=f"<= {0.1 / grade.rate_hz:g} s",
        )


def _judge_flicker(grade: ImuGrade) -> None:
    """Refuse a floor that is flat nowhere."""
    low, high = grade.flicker_range_s
    if grade.bias_process == "flicker" and not 10.0 / grade.rate_hz <= low < high < math.inf:
        raise InputError(
            "is not (shortest, longest)",
            field=f"imu grade {grade.name}: flicker_range_s",
            value=grade.flicker_range_s,
            limit=f"{10.0 / grade.rate_hz:g} s <= shortest < longest",
            remedy="the floor is flat from the shortest to the longest averaging time",
        )
