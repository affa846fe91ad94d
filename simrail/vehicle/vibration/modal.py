"""Exact motion of a linear vehicle under inputs that are cubic from sample to sample.

With the state x = (q, q', F) of `simrail.vehicle.vibration.linear_model`, ``x' = A x + B r``, and the
eigenvectors V of A, each modal coordinate z = V^-1 x moves by itself. Between two samples at a distance h the
input is the cubic through the four samples around them (Lagrange), ``u(t + s h) = sum_m p_m s^m``, and then
exactly

    z(t + h) = e^a z(t) + h sum_m m! f_{m+1} p_m,    a = lambda h,  u = (V^-1 B) r,
    f_0 = e^a,   f_{k+1} = (f_k - 1/k!) / a

(variation of constants; the f are the phi functions of exponential integrators). There is no error of
integration at any frequency, and no limit on the step but what the input loses between its samples. One of
each pair of conjugate modes is kept.

A first-order hold is not enough. A wave at f has an image at f_s - f, of ``(f/f_s)^2`` of its height if
straight lines join its samples, so that its acceleration is that of the wave itself; a wheel's contact, at a
quarter of f_s, passes some of it: 3 % of the acceleration of an axle, and all of that of a rail. With cubics
it is ``(f/f_s)^2`` of that.
"""

from contextlib import suppress
from dataclasses import dataclass
from math import factorial

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
    decay : ndarray (m,), complex
        e^a.
    weights : ndarray (4, m), complex
        What u at the samples before, at the beginning, at the end and after a step adds to z.
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
    weights: ComplexArray
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
    inverse, off = np.zeros_like(vectors), np.inf
    with suppress(np.linalg.LinAlgError):
        inverse = np.linalg.inv(vectors)
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
    return Modes(
        eigenvalues=kept,
        decay=np.exp(kept * step_s),
        weights=step_s * hold_weights(kept * step_s),
        drive=inverse[keep] @ b,
        place=shape[:n],
        rate=shape[n : 2 * n],
        acceleration=shape[n : 2 * n] * kept,
        direct=b[n : 2 * n],
    )


_LAGRANGE = np.array(
    [
        [0.0, -1.0 / 3.0, 0.5, -1.0 / 6.0],
        [1.0, -0.5, -1.0, 0.5],
        [0.0, 1.0, 0.5, -0.5],
        [0.0, -1.0 / 6.0, 0.0, 1.0 / 6.0],
    ]
)
"""Powers 1, s, s^2, s^3 of the cubics that are 1 at s = -1, 0, 1, 2 in turn and 0 at the other three."""


def phi_functions(a: ComplexArray, count: int) -> ComplexArray:
    """f_0 to f_count (count + 1, m) at a (m,); by their series where the recursion would lose digits."""
    out = np.empty((count + 1, len(a)), dtype=np.complex128)
    small = np.abs(a) < 0.5
    safe = np.where(small, 1.0, a)
    recursed = np.exp(safe)
    for k in range(count + 1):
        # f_k = sum_j a^j / (j + k)!; eighteen terms at 0.5 are below 1e-20.
        series = sum(a**j / float(factorial(j + k)) for j in range(18))
        out[k] = np.where(small, series, recursed)
        recursed = (recursed - 1.0 / factorial(k)) / safe
    return out


def hold_weights(a: ComplexArray) -> ComplexArray:
    """Weights (4, m) of four samples over one step of unit length at a (m,): ``sum_m m! f_{m+1} p_m``."""
    powers = np.array([factorial(m) for m in range(4)])[:, None] * phi_functions(a, 4)[1:]
    weights: ComplexArray = _LAGRANGE @ powers
    return weights


@njit
def march_modes(
    decay: ComplexArray, weights: ComplexArray, force: ComplexArray, state: ComplexArray, out: ComplexArray
) -> None:
    """Run modes through samples: from z before the first, ``state`` (m,), to z at each, ``out`` (n, m).

    ``force`` (n + 3, m) is u from two samples before the first to one after the last; ``state`` becomes z at
    the last one.
    """
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            state[j] = (
                decay[j] * state[j]
                + weights[0, j] * force[i, j]
                + weights[1, j] * force[i + 1, j]
                + weights[2, j] * force[i + 2, j]
                + weights[3, j] * force[i + 3, j]
            )
            out[i, j] = state[j]
