"""How an IMU answers to a motion, chance aside: scale, axes, g-sensitivity, vibration, temperature, counts.

The coefficients are constants of one device: drawn once, uniform within the bounds of its grade, each
kind from its own stream.
"""

import math
from dataclasses import dataclass, fields

import numpy as np

from simrail.core.jit import FloatArray, njit
from simrail.core.rotation import rotation_matrix
from simrail.recording.sheets.grades import REFERENCE_TEMPERATURE_C, ImuGrade, Triad
from simrail.sensors.imu_noise import Streams

_CUBIC = 1.5 * math.sqrt(3.0)
"""u - u^3 has its maximum 2 / (3 sqrt 3) at u = 1 / sqrt 3."""


@dataclass(frozen=True)
class Temperature:
    """Temperature of a device over the ride: ambient + (start - ambient) exp(-t / time constant).

    Attributes
    ----------
    start_c, ambient_c : float
        Temperature at time 0 and after a long time, degrees Celsius.
    time_constant_s : float
        Time constant of the warming or cooling.
    """

    start_c: float
    ambient_c: float
    time_constant_s: float = 600.0

    def above_reference_k(self, time_s: FloatArray) -> FloatArray:
        """Kelvin above the temperature of calibration, at times (n,)."""
        fading = np.exp(np.asarray(time_s) / -self.time_constant_s)
        above: FloatArray = (
            self.ambient_c - REFERENCE_TEMPERATURE_C + (self.start_c - self.ambient_c) * fading
        )
        return above


@dataclass(frozen=True)
class TriadResponse:
    """Coefficients of one triad of one device; see `ImuGrade` for the terms.

    Attributes
    ----------
    axes : ndarray (3, 3)
        From the true vector in the mount's axes to the axes that sense it.
    scale, scale_per_k, bias_per_k, bend, rectification : ndarray (3,)
        Relative scale error, the same per kelvin, bias per kelvin, amplitude of the nonlinearity, bias
        per mean square of the vibration.
    force_gain : ndarray (3, 3)
        Output per specific force (g-sensitivity).
    full_scale : float
        Range; infinite for none.
    """

    axes: FloatArray
    scale: FloatArray
    scale_per_k: FloatArray
    bias_per_k: FloatArray
    bend: FloatArray
    rectification: FloatArray
    force_gain: FloatArray
    full_scale: float

    @property
    def is_perfect(self) -> bool:
        """Whether it changes nothing."""
        errors = (self.scale, self.scale_per_k, self.bias_per_k, self.bend, self.rectification)
        absent = not any(np.any(error) for error in (*errors, self.force_gain))
        return absent and np.array_equal(self.axes, np.eye(3))


def draw_response(grade: ImuGrade, kind: str, streams: Streams) -> TriadResponse:
    """Draw the coefficients of one triad of a device."""
    terms = grade.triad(kind)

    def bounded(name: str, bound: float, size: int = 3) -> FloatArray:
        if bound == 0.0:
            return np.zeros(size)
        return streams(name).uniform(-1.0, 1.0, size) * bound

    turn = rotation_matrix(bounded("package_misalignment", grade.package_misalignment_rad)[None])[0]
    lean = bounded(f"{kind}_nonorthogonality", terms.nonorthogonality)
    sensed = np.array([[1.0, 0.0, 0.0], [lean[0], 1.0, 0.0], [lean[1], lean[2], 1.0]])
    sensed /= np.linalg.norm(sensed, axis=1)[:, None]
    bend = bounded(f"{kind}_nonlinearity", terms.nonlinearity)
    return TriadResponse(
        axes=np.ascontiguousarray(sensed @ turn.T),
        scale=bounded(f"{kind}_scale", terms.scale_error),
        scale_per_k=bounded(f"{kind}_scale_temperature", terms.scale_temperature),
        bias_per_k=bounded(f"{kind}_bias_temperature", terms.bias_temperature),
        bend=bend * terms.range if terms.nonlinearity > 0.0 else bend,
        rectification=bounded(f"{kind}_vibration_rectification", terms.vibration_rectification),
        force_gain=bounded(f"{kind}_g_sensitivity", terms.g_sensitivity, 9).reshape(3, 3),
        full_scale=terms.range,
    )


def respond(
    samples: FloatArray,
    gyro: TriadResponse,
    accel: TriadResponse,
    *,
    vibration: FloatArray | None,
    above_k: FloatArray | None,
) -> None:
    """Turn true rates and forces into what the device makes of them, in place.

    For each triad, with u the true vector, f the true specific force and d the kelvin above reference:

        v = axes u;   v_i <- v_i (1 + scale_i + scale_per_k_i d)
        y_i = v_i + bend_i (3 sqrt 3 / 2) (w - w^3) + (force_gain f)_i + rectification_i ms_i + bias_per_k_i d

    where w is v_i over the full scale, between -1 and 1, and ms the mean square of the vibration.

    Parameters
    ----------
    samples : ndarray (n, 6)
        Rates and specific forces.
    gyro, accel : TriadResponse
        The coefficients.
    vibration : ndarray (n, 3), optional
        Running mean squares of the vibration.
    above_k : ndarray (n,), optional
        Temperature above the reference.
    """
    if gyro.is_perfect and accel.is_perfect:
        return
    shaking = np.zeros((0, 3)) if vibration is None else vibration
    warmth = np.zeros(0) if above_k is None else above_k
    # The coefficients of both triads in the order of their fields, as the kernel takes them.
    columns = [
        np.array([getattr(triad, field.name) for triad in (gyro, accel)]) for field in fields(TriadResponse)
    ]
    _respond(samples, shaking, warmth, *columns)


@njit
def _respond(
    samples: FloatArray,
    vibration: FloatArray,
    above_k: FloatArray,
    axes: FloatArray,
    scale: FloatArray,
    scale_per_k: FloatArray,
    bias_per_k: FloatArray,
    bend: FloatArray,
    rectification: FloatArray,
    force_gain: FloatArray,
    full_scale: FloatArray,
) -> None:
    shaken, warm = vibration.shape[0] > 0, above_k.shape[0] > 0
    for k in range(samples.shape[0]):
        fx, fy, fz = samples[k, 3], samples[k, 4], samples[k, 5]
        kelvin = above_k[k] if warm else 0.0
        for triad in range(2):
            at = 3 * triad
            x, y, z = samples[k, at], samples[k, at + 1], samples[k, at + 2]
            if triad == 1:
                x, y, z = fx, fy, fz
            for i in range(3):
                v = axes[triad, i, 0] * x + axes[triad, i, 1] * y + axes[triad, i, 2] * z
                v *= 1.0 + scale[triad, i] + scale_per_k[triad, i] * kelvin
                if bend[triad, i] != 0.0:
                    w = min(max(v / full_scale[triad], -1.0), 1.0)
                    v += bend[triad, i] * _CUBIC * (w - w**3)
                v += (
                    force_gain[triad, i, 0] * fx + force_gain[triad, i, 1] * fy + force_gain[triad, i, 2] * fz
                )
                if shaken:
                    v += rectification[triad, i] * vibration[k, i]
                samples[k, at + i] = v + bias_per_k[triad, i] * kelvin


@njit
def mean_square_vibration(
    force: FloatArray, rate_hz: float, averaging_s: float, at: FloatArray
) -> FloatArray:
    """Mean square of the vibration of each axis, by causal running means.

    With a = 1 - exp(-1/(rate T)): mean m' = m + a (f - m), mean square s += a ((f - m) (f - m') - s), from
    m = f and s = 0 at first. The product of the deviations from the old and the new mean is unbiased, as in
    Welford's running variance.

    Parameters
    ----------
    force : ndarray (n, 3)
        Specific force at the rate of the truth.
    rate_hz, averaging_s : float
        That rate, and the time constant T of both means.
    at : ndarray (k,)
        Samples at which it is wanted, increasing, as fractional places in the input; the last before counts.

    Returns
    -------
    ndarray (k, 3)
        (m/s2)^2.
    """
    gain = 1.0 - np.exp(-1.0 / (rate_hz * averaging_s))
    variances = np.zeros((len(at), 3))
    mx, my, mz = force[0, 0], force[0, 1], force[0, 2]
    sx, sy, sz = 0.0, 0.0, 0.0
    done = 0
    for k in range(len(at)):
        last = min(int(at[k]), force.shape[0] - 1)
        while done <= last:
            dx, dy, dz = force[done, 0] - mx, force[done, 1] - my, force[done, 2] - mz
            mx += gain * dx
            my += gain * dy
            mz += gain * dz
            sx += gain * (dx * (1.0 - gain) * dx - sx)
            sy += gain * (dy * (1.0 - gain) * dy - sy)
            sz += gain * (dz * (1.0 - gain) * dz - sz)
            done += 1
        variances[k, 0], variances[k, 1], variances[k, 2] = sx, sy, sz
    return variances


def digitise(samples: FloatArray, terms: Triad, *, increments: bool) -> FloatArray:
    """Clip at the last count within the range and round to whole counts.

    Rates are rounded one by one. Increments are rounded in their running sum, so that nothing is lost
    between samples: what one misses, the next one brings; they are returned as rates again.
    """
    limit, size = terms.range, terms.resolution
    if size == 0.0:
        return samples if math.isinf(limit) else np.clip(samples, -limit, limit)
    last = np.floor(limit / size * (1.0 + 1e-12))
    if not increments:
        return np.clip(np.rint(samples / size), -last, last) * size
    clipped = np.clip(samples, -last * size, last * size)
    total = np.rint(np.cumsum(clipped, axis=0) / size)
    counts: FloatArray = np.diff(total, axis=0, prepend=np.zeros((1, samples.shape[1]))) * size
    return counts
