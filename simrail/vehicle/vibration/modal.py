"""Exact motion of a linear vehicle under inputs that go in straight lines from sample to sample.

With the state x = (q, q', F) of `simrail.vehicle.vibration.linear_model`, ``x' = A x + B r``, and the
eigenvectors V of A, each modal coordinate z = V^-1 x moves by itself. Between two samples at a distance h the
input is linear (first-order hold), and then exactly

    z(t + h) = e^a z(t) + h [(f1 - f2) u(t) + f2 u(t + h)],    a = lambda h,  u = (V^-1 B) r,
    f1 = (e^a - 1) / a,   f2 = (e^a - 1 - a) / a^2

(Franklin, Powell and Workman, Digital Control of Dynamic Systems, triangle hold). There is no error of
integration at any frequency, and no limit on the step but what the input loses between its samples. One of
each pair of conjugate modes is kept.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray, njit
from simrail.vehicle.vibration.linear_model import LinearVehicle

ComplexArray = npt.NDArray[np.complex128]

_RESOLVED = 1e-7
"""How well eigenvectors must rebuild the state matrix: worse, and two modes are one."""


@dataclass(frozen=True, eq=False)
class Modes:
    """A linear vehicle in modal form at a step; m modes, w inputs.

    Attributes
    ----------
    eigenvalues : ndarray (m,), complex
        1/s; one of each conjugate pair.
    decay, before, after : ndarray (m,), complex
        e^a, h (f1 - f2), h f2.
    drive : ndarray (m, w), complex
        V^-1 B.
    place, rate, acceleration : ndarray (n, m), complex
        Rows of the coordinates and their derivatives: a signal is the real part of row times z; to the
        acceleration comes ``direct`` r.
    direct : ndarray (n, w)
        M^-1 E.
    """

    eigenvalues: ComplexArray
    decay: ComplexArray
    before: ComplexArray
    after: ComplexArray
    drive: ComplexArray
    place: ComplexArray
    rate: ComplexArray
    acceleration: ComplexArray
    direct: FloatArray


def state_space(vehicle: LinearVehicle) -> tuple[FloatArray, FloatArray]:
    """A (2 n + d, 2 n + d) and B (2 n + d, w) of ``x' = A x + B r`` with x = (q, q', F)."""
    n, d = len(vehicle.coordinates), len(vehicle.series)
    inverse = np.linalg.inv(vehicle.mass)
    k, c = vehicle.series_stiffness_npm, vehicle.series_damping_nspm
    a = np.zeros((2 * n + d, 2 * n + d))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n, :n] = -inverse @ vehicle.stiffness
    a[n : 2 * n, n : 2 * n] = -inverse @ vehicle.damping
    a[n : 2 * n, 2 * n :] = -inverse @ vehicle.series.T
    a[2 * n :, n : 2 * n] = k[:, None] * vehicle.series
    a[2 * n :, 2 * n :] = -np.diag(k / c)
    b = np.zeros((2 * n + d, vehicle.input.shape[1]))
    b[n : 2 * n] = inverse @ vehicle.input
    return a, b


def modes_of(vehicle: LinearVehicle, *, step_s: float) -> Modes:
    """Modal form of a linear vehicle.

    Parameters
    ----------
    vehicle : LinearVehicle
        The vehicle.
    step_s : float
        Distance h of the samples.

    Raises
    ------
    InputError
        If the vehicle has modes that cannot be told apart, or one that grows.
    """
    a, b = state_space(vehicle)
    n = len(vehicle.coordinates)
    # Forces in newtons beside places in metres: in units of a stiffness they are alike.
    scale = np.ones(len(a))
    scale[2 * n :] = 1.0 / np.maximum(vehicle.series_stiffness_npm, 1.0)
    a, b = scale[:, None] * a / scale, scale[:, None] * b
    eigenvalues, vectors = (part.astype(np.complex128) for part in np.linalg.eig(a))
    inverse: ComplexArray = np.linalg.inv(vectors)
    off = np.abs((vectors * eigenvalues) @ inverse - a).max() / np.abs(a).max()
    if not off < _RESOLVED or eigenvalues.real.max() > _RESOLVED * np.abs(eigenvalues).max():
        raise InputError(
            "has no modal form: two of its modes are one, or one of them grows",
            field="vibration",
            value=f"{off:.1e}",
            limit=f"{_RESOLVED:g}",
            remedy="look for a body that nothing holds",
        )
    keep = eigenvalues.imag >= 0.0
    weight = np.where(eigenvalues.imag[keep] > 0.0, 2.0, 1.0)
    kept, shape = eigenvalues[keep], vectors[:, keep] * weight
    z = kept * step_s
    small = np.abs(z) < 1e-3  # there the quotients lose digits, and their series does not
    safe = np.where(small, 1.0, z)
    f1: ComplexArray = np.where(small, 1.0 + z / 2.0 + z**2 / 6.0 + z**3 / 24.0, np.expm1(safe) / safe)
    f2: ComplexArray = np.where(small, 0.5 + z / 6.0 + z**2 / 24.0, (np.expm1(safe) - safe) / safe**2)
    return Modes(
        eigenvalues=kept,
        decay=np.exp(z),
        before=step_s * (f1 - f2),
        after=step_s * f2,
        drive=inverse[keep] @ b,
        place=shape[:n],
        rate=shape[n : 2 * n],
        acceleration=shape[n : 2 * n] * kept,
        direct=b[n : 2 * n],
    )


@njit
def march_modes(
    decay: ComplexArray, before: ComplexArray, after: ComplexArray, force: ComplexArray, state: ComplexArray
) -> None:
    """Run modes through inputs: ``force`` (k, m), u at each sample, becomes z there; in place.

    ``state`` (2, m) holds z and u of the sample before the first one, and then those of the last one.
    """
    for i in range(force.shape[0]):
        for j in range(force.shape[1]):
            u = force[i, j]
            z = decay[j] * state[0, j] + before[j] * state[1, j] + after[j] * u
            state[0, j] = z
            state[1, j] = u
            force[i, j] = z
