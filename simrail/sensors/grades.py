"""IMU grades: the error terms of a device, in SI units, from the figures that its data sheet prints.

A grade is a handful of numbers; `simrail.sensors.imu` turns them into samples. Files in data-sheet
units are read by `simrail.scenario.imu_file`.

Conventions (IEEE Std 952): a printed noise density is read as the Allan coefficient N, so the standard
deviation of one sample is N sqrt(rate). A printed bias instability is read as IEEE's coefficient B,
whose Allan deviation is flat at sqrt(2 ln 2 / pi) B = 0.664 B. A printed initial bias "+-b" is read as
a uniform distribution between -b and +b.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from simrail.errors import InputError
from simrail.jit import FloatArray

STANDARD_GRAVITY_MPS2 = 9.80665
"""The g of data sheets (mg, ug), by definition; local gravity is a matter of the recording."""

FLICKER_FLOOR = math.sqrt(2.0 * math.log(2.0) / math.pi)
"""Allan floor of a process with bias instability B, over B (IEEE Std 952): 0.664."""

# Peak of the Allan deviation of a Gauss-Markov process over its standard deviation, and where it lies
# in correlation times. Both follow from `gauss_markov_allan`; a test finds them again. In terms of the
# driving noise q = sigma sqrt(2/T) the peak reads 0.437 q sqrt(T), as printed by IEEE Std 952.
GAUSS_MARKOV_PEAK = 0.6173643
GAUSS_MARKOV_PEAK_AT = 1.8926


def gauss_markov_allan(averaging_s: FloatArray, *, sd: float, correlation_s: float) -> FloatArray:
    """Allan deviation of a stationary first-order Gauss-Markov process.

    With x = tau/T:  sigma_A^2 = sd^2 (2/x) [1 - (3 - 4 exp(-x) + exp(-2x)) / (2x)]  (IEEE Std 952,
    annex on exponentially correlated noise, with q^2 T/2 = sd^2).

    Parameters
    ----------
    averaging_s : ndarray
        Averaging times tau, s, > 0.
    sd : float
        Standard deviation of the process.
    correlation_s : float
        Correlation time T, s.

    Returns
    -------
    ndarray
        Allan deviation, in the unit of `sd`.
    """
    x = np.asarray(averaging_s, dtype=np.float64) / correlation_s
    # 2x - 3 + 4 exp(-x) - exp(-2x) cancels to 2x^3/3 - x^4/2 for small x.
    bracket = np.where(
        x < 1e-3,
        x**2 / 3.0 - x**3 / 4.0,
        (2.0 * x + 4.0 * np.expm1(-x) - np.expm1(-2.0 * x)) / (2.0 * x),
    )
    allan: FloatArray = sd * np.sqrt(2.0 / x * bracket)
    return allan


@dataclass(frozen=True)
class ImuGrade:
    """Error terms of an IMU; every axis of a triad has the same figures and its own samples.

    Attributes
    ----------
    name : str
        Name of the grade.
    rate_hz : float
        Output rate, > 0.
    gyro_noise_radpsqrts, accel_noise_mpsqrts : float
        Allan coefficient N of the white noise, rad/s/sqrt(Hz) and m/s2/sqrt(Hz).
    gyro_bias_instability_radps, accel_bias_instability_mps2 : float
        Bias instability B; its Gauss-Markov process has the standard deviation `bias_sd(B)`.
    gyro_bias_correlation_s, accel_bias_correlation_s : float
        Correlation time of that process. Data sheets do not print it.
    gyro_turn_on_bias_radps, accel_turn_on_bias_mps2 : float
        Bound of the constant bias, uniform between minus and plus.
    gyro_range_radps, accel_range_mps2 : float
        Largest magnitude that is measured; infinite for no limit.
    gyro_resolution_radps, accel_resolution_mps2 : float
        Size of one count; 0 for no quantisation.
    bandwidth_hz : float, optional
        -3 dB frequency of the device's own second-order response (Butterworth), before sampling.
    source : str
        Where the figures come from, and what was assumed.
    """

    name: str
    rate_hz: float
    gyro_noise_radpsqrts: float = 0.0
    accel_noise_mpsqrts: float = 0.0
    gyro_bias_instability_radps: float = 0.0
    accel_bias_instability_mps2: float = 0.0
    gyro_bias_correlation_s: float = 300.0
    accel_bias_correlation_s: float = 300.0
    gyro_turn_on_bias_radps: float = 0.0
    accel_turn_on_bias_mps2: float = 0.0
    gyro_range_radps: float = math.inf
    accel_range_mps2: float = math.inf
    gyro_resolution_radps: float = 0.0
    accel_resolution_mps2: float = 0.0
    bandwidth_hz: float | None = None
    source: str = ""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, int | float):
                continue
            positive = (
                field.name.endswith(("rate_hz", "correlation_s", "bandwidth_hz")) or "range" in field.name
            )
            if math.isnan(value) or value < 0.0 or (positive and value == 0.0):
                raise InputError(
                    "is out of range",
                    field=f"imu grade {self.name}: {field.name}",
                    value=value,
                    limit="> 0" if positive else ">= 0",
                )

    @classmethod
    def from_datasheet(
        cls,
        name: str,
        rate_hz: float,
        *,
        gyro_noise_degpsqrthz: float = 0.0,
        accel_noise_ugpsqrthz: float = 0.0,
        gyro_bias_instability_degph: float = 0.0,
        accel_bias_instability_mg: float = 0.0,
        gyro_bias_correlation_s: float = 300.0,
        accel_bias_correlation_s: float = 300.0,
        gyro_turn_on_bias_degps: float = 0.0,
        accel_turn_on_bias_mg: float = 0.0,
        gyro_range_degps: float = math.inf,
        accel_range_g: float = math.inf,
        gyro_resolution_degps: float = 0.0,
        accel_resolution_mg: float = 0.0,
        bandwidth_hz: float | None = None,
        source: str = "",
    ) -> ImuGrade:
        """Build a grade from the figures of a data sheet, in the units that data sheets print.

        Parameters
        ----------
        name : str
            Name of the grade.
        rate_hz : float
            Output rate.
        gyro_noise_degpsqrthz, accel_noise_ugpsqrthz : float
            Noise densities, deg/s/sqrt(Hz) and ug/sqrt(Hz), read as Allan coefficients N.
        gyro_bias_instability_degph, accel_bias_instability_mg : float
            Bias instabilities B, deg/h and mg.
        gyro_bias_correlation_s, accel_bias_correlation_s : float
            Correlation times of the Gauss-Markov processes, an assumption.
        gyro_turn_on_bias_degps, accel_turn_on_bias_mg : float
            Bounds of the initial bias, deg/s and mg.
        gyro_range_degps, accel_range_g : float
            Ranges, deg/s and g.
        gyro_resolution_degps, accel_resolution_mg : float
            Resolutions, deg/s and mg.
        bandwidth_hz : float, optional
            Bandwidth of the device.
        source : str
            Where the figures come from.

        Returns
        -------
        ImuGrade
            The same figures in SI units; g is the standard 9.80665 m/s2.
        """
        milli_g = 1e-3 * STANDARD_GRAVITY_MPS2
        return cls(
            name=name,
            rate_hz=rate_hz,
            gyro_noise_radpsqrts=math.radians(gyro_noise_degpsqrthz),
            accel_noise_mpsqrts=accel_noise_ugpsqrthz * 1e-3 * milli_g,
            gyro_bias_instability_radps=math.radians(gyro_bias_instability_degph) / 3600.0,
            accel_bias_instability_mps2=accel_bias_instability_mg * milli_g,
            gyro_bias_correlation_s=gyro_bias_correlation_s,
            accel_bias_correlation_s=accel_bias_correlation_s,
            gyro_turn_on_bias_radps=math.radians(gyro_turn_on_bias_degps),
            accel_turn_on_bias_mps2=accel_turn_on_bias_mg * milli_g,
            gyro_range_radps=math.radians(gyro_range_degps),
            accel_range_mps2=accel_range_g * STANDARD_GRAVITY_MPS2,
            gyro_resolution_radps=math.radians(gyro_resolution_degps),
            accel_resolution_mps2=accel_resolution_mg * milli_g,
            bandwidth_hz=bandwidth_hz,
            source=source,
        )


def bias_sd(bias_instability: float) -> float:
    """Standard deviation of the Gauss-Markov process whose Allan deviation peaks at the floor 0.664 B.

    sd = 0.6643 B / 0.6174 = 1.076 B: the peak of the process, at 1.89 correlation times, is as high
    as the flat floor that a data sheet's bias instability stands for.
    """
    return bias_instability * FLICKER_FLOOR / GAUSS_MARKOV_PEAK
