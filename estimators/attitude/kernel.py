"""Compiled loops of the attitude estimators: arrays in, arrays out, no allocation.

The three-state extended Kalman filter and the gradient descent algorithm of Briales et al. 2021
(paper 000). Both get the accelerometer with the track's acceleration already taken off
(`simrail.estimators.attitude.compensation`), so nothing here knows of tracks, recordings or data frames.
"""

import math

from simrail.core.jit import FloatArray, njit, njit_borrowed, njit_inline
from simrail.core.sine import sine_cosine

Covariance = tuple[float, float, float, float, float, float]
"""Upper triangle of a covariance of roll, pitch and yaw, row by row."""


@njit_inline
def propagate(
    p: Covariance, a00: float, a01: float, a10: float, a20: float, a21: float, q: float
) -> Covariance:
    """P <- A P A' + q I for A = [[a00, a01, 0], [a10, 1, 0], [a20, a21, 1]]."""
    p00, p01, p02, p11, p12, p22 = p
    m00, m01, m02 = a00 * p00 + a01 * p01, a00 * p01 + a01 * p11, a00 * p02 + a01 * p12
    m10, m11, m12 = a10 * p00 + p01, a10 * p01 + p11, a10 * p02 + p12
    m20 = a20 * p00 + a21 * p01 + p02
    m21 = a20 * p01 + a21 * p11 + p12
    m22 = a20 * p02 + a21 * p12 + p22
    return (
        m00 * a00 + m01 * a01 + q,
        m00 * a10 + m01,
        m00 * a20 + m01 * a21 + m02,
        m10 * a10 + m11 + q,
        m10 * a20 + m11 * a21 + m12,
        m20 * a20 + m21 * a21 + m22 + q,
    )


Three = tuple[float, float, float]
"""A vector, or roll, pitch and yaw."""

Turns = tuple[float, float, float, float]
"""Sine and cosine of roll, then of pitch."""


@njit_inline
def predicted(
    angles: Three, p: Covariance, turns: Turns, rate: Three, process: float, step_s: float
) -> tuple[Three, Covariance, Turns]:
    """One step of the EKF: Euler rates f(x, w) and A = I + step F (EQUATIONS 2.2)."""
    roll, pitch, yaw = angles
    sr, cr, sp, cp = turns
    x, y, z = rate
    secant = 1.0 / cp
    tangent = sp * secant
    u = y * cr - z * sr
    w = y * sr + z * cr
    roll += step_s * (x + w * tangent)
    pitch += step_s * u
    yaw += step_s * w * secant
    a00 = 1.0 + step_s * u * tangent
    a01 = step_s * w * secant * secant
    a20 = step_s * u * secant
    a21 = step_s * w * tangent * secant
    p = propagate(p, a00, a01, -step_s * w, a20, a21, process)
    sr, cr = sine_cosine(roll)
    sp, cp = sine_cosine(pitch)
    return (roll, pitch, yaw), p, (sr, cr, sp, cp)


@njit_inline
def updated(
    angles: Three, p: Covariance, turns: Turns, force: Three, noise: Three, gravity: float
) -> tuple[Three, Covariance, Turns, tuple[float, float, float, float]]:
    """One update of the EKF; the last is the innovation, and its normalised square.

    For roll and pitch, with P their covariance and M = H' R^-1 H, of two rows, their adjoints at hand:

        (P^-1 + M)^-1 = (P + det P adj M)/D,    (I + P M)^-1 = adj(I + P M)/D
        D = det(I + P M) = 1 + tr P M + det P det M,    NIS = e' R^-1 (e - H dx)

    Heading is only considered: its covariance with the two goes the way of their errors, (I + P M)^-1.
    """
    roll, pitch, yaw = angles
    sr, cr, sp, cp = turns
    p00, p01, p02, p11, p12, p22 = p
    # Innovation, z less gravity in body axes, and the three rows of its Jacobian (EQUATIONS 2.2).
    lift, lean = gravity * cp, gravity * sp
    ex, ey, ez = force[0] + lean, force[1] - lift * sr, force[2] - lift * cr
    x1, y0, y1, z0, z1 = -lift, lift * cr, -lean * sr, -lift * sr, -lean * cr
    ix, iy, iz = 1.0 / noise[0], 1.0 / noise[1], 1.0 / noise[2]
    m00 = y0 * y0 * iy + z0 * z0 * iz
    m01 = y0 * y1 * iy + z0 * z1 * iz
    m11 = x1 * x1 * ix + y1 * y1 * iy + z1 * z1 * iz
    b0 = y0 * (ey * iy) + z0 * (ez * iz)
    b1 = x1 * (ex * ix) + y1 * (ey * iy) + z1 * (ez * iz)
    area = p00 * p11 - p01 * p01
    c00, c01 = p00 * m00 + p01 * m01, p00 * m01 + p01 * m11
    c10, c11 = p01 * m00 + p11 * m01, p01 * m01 + p11 * m11
    inverse = 1.0 / (1.0 + (c00 + c11) + area * (m00 * m11 - m01 * m01))
    q00, q01, q11 = (p00 + area * m11) * inverse, (p01 - area * m01) * inverse, (p11 + area * m00) * inverse
    d_roll, d_pitch = q00 * b0 + q01 * b1, q01 * b0 + q11 * b1
    p02, p12 = (p02 + (c11 * p02 - c01 * p12)) * inverse, (p12 + (c00 * p12 - c10 * p02)) * inverse
    nis = ex * ix * (ex - x1 * d_pitch)
    nis += ey * iy * (ey - y0 * d_roll - y1 * d_pitch) + ez * iz * (ez - z0 * d_roll - z1 * d_pitch)
    roll += d_roll
    pitch += d_pitch
    sr, cr = sine_cosine(roll)
    sp, cp = sine_cosine(pitch)
    return (roll, pitch, yaw), (q00, q01, p02, q11, p12, p22), (sr, cr, sp, cp), (ex, ey, ez, nis)


Quaternion = tuple[float, float, float, float]
"""Scalar first."""


@njit_inline
def descended(q: Quaternion, rate: Three, force: Three, beta: float, step_s: float) -> Quaternion:
    """One step of the gradient descent algorithm; see `attitude_gda`."""
    a, b, c, d = q
    half = 0.5 * step_s
    x, y, z = half * rate[0], half * rate[1], half * rate[2]
    fx, fy, fz = force
    length = math.sqrt(fx * fx + fy * fy + fz * fz)
    scale = 1.0 / length if length > 0.0 else 0.0
    f0 = 2.0 * (b * d - a * c) - fx * scale
    f1 = 2.0 * (a * b + c * d) - fy * scale
    f2 = 1.0 - 2.0 * (b * b + c * c) - fz * scale
    g0 = b * f1 - c * f0
    g1 = d * f0 + a * f1 - 2.0 * b * f2
    g2 = d * f1 - a * f0 - 2.0 * c * f2
    g3 = b * f0 + c * f1
    size = math.sqrt(g0 * g0 + g1 * g1 + g2 * g2 + g3 * g3)
    # Without a direction of gravity (free fall) or at the exact minimum there is nothing to correct.
    gain = beta * step_s / size if size > 0.0 and length > 0.0 else 0.0
    a, b, c, d = (
        a - b * x - c * y - d * z - gain * g0,
        b + a * x + c * z - d * y - gain * g1,
        c + a * y - b * z + d * x - gain * g2,
        d + a * z + b * y - c * x - gain * g3,
    )
    inverse = 1.0 / math.sqrt(a * a + b * b + c * c + d * d)
    return a * inverse, b * inverse, c * inverse, d * inverse


@njit
def attitude_ekf(
    rate: FloatArray,
    force: FloatArray,
    process: FloatArray,
    noise: FloatArray,
    start: FloatArray,
    start_variance: FloatArray,
    step_s: float,
    gravity: float,
    states: FloatArray,
    covariance: FloatArray,
    innovations: FloatArray,
) -> None:
    """Run the Euler-angle EKF (paper 000, Eqs. 21-39; EQUATIONS 2.2).

    Predict with x += step_s f(x, w) and A = I + step_s F, update with h(x) = C^T g e_z with all three axes at
    once, linearised at the predicted state, in the form of the information of two states (`updated`). Heading
    is unobservable from gravity: its gain is held at zero and its cross-covariances are carried along
    (Schmidt).

    Specialised by hand: the covariance is six numbers in registers, which stays symmetric by construction,
    and what an update waits for is one division and one series, not three divisions in turn. By three scalar
    updates in registers a step takes 1.3 times as long, on the arrays of `simrail.estimators.kalman` 5 times.

    Parameters
    ----------
    rate : ndarray (n, 3)
        Body rate that holds over the step that ends at each sample, rad/s; row 0 is not used.
    force : ndarray (n, 3)
        Specific force without the track's acceleration, m/s2, body frame.
    process : ndarray (n,)
        Variance that each step adds to every angle, rad2; row 0 is not used.
    noise : ndarray (n, 3)
        Variance of `force`, (m/s2)^2.
    start, start_variance : ndarray (3,)
        Roll, pitch, yaw before the first update, rad, and their variances, rad2.
    step_s, gravity : float
        Sample interval in s and gravity in m/s2.
    states : ndarray (n, 3), out
        Roll, pitch, yaw after each update, rad.
    covariance : ndarray (n, 3, 3), out
        Their covariance, rad2.
    innovations : ndarray (n, 4), out
        Measured minus predicted force, m/s2, and the normalised innovation squared.
    """
    angles = start[0], start[1], start[2]
    p = (start_variance[0], 0.0, 0.0, start_variance[1], 0.0, start_variance[2])
    sr, cr = sine_cosine(start[0])
    sp, cp = sine_cosine(start[1])
    turns = sr, cr, sp, cp
    for k in range(rate.shape[0]):
        if k > 0:
            angles, p, turns = predicted(
                angles, p, turns, (rate[k, 0], rate[k, 1], rate[k, 2]), process[k], step_s
            )
        measured = force[k, 0], force[k, 1], force[k, 2]
        variance = noise[k, 0], noise[k, 1], noise[k, 2]
        angles, p, turns, innovation = updated(angles, p, turns, measured, variance, gravity)
        states[k, 0], states[k, 1], states[k, 2] = angles
        p00, p01, p02, p11, p12, p22 = p
        covariance[k, 0, 0], covariance[k, 0, 1], covariance[k, 0, 2] = p00, p01, p02
        covariance[k, 1, 0], covariance[k, 1, 1], covariance[k, 1, 2] = p01, p11, p12
        covariance[k, 2, 0], covariance[k, 2, 1], covariance[k, 2, 2] = p02, p12, p22
        innovations[k, 0], innovations[k, 1], innovations[k, 2], innovations[k, 3] = innovation


@njit_borrowed
def with_deviations(
    angles: FloatArray, covariance: FloatArray, considered: FloatArray, states: FloatArray
) -> None:
    """Add variances that are not estimated to a covariance, and put its roots beside the angles.

    Parameters
    ----------
    angles, considered : ndarray (n, 3)
    covariance : ndarray (n, 9), in and out
    states : ndarray (6, n), out
    """
    for axis in range(3):
        for k in range(angles.shape[0]):
            variance = covariance[k, 4 * axis] + considered[k, axis]
            covariance[k, 4 * axis] = variance
            states[axis, k], states[3 + axis, k] = angles[k, axis], math.sqrt(variance)


@njit
def attitude_gda(
    rate: FloatArray,
    force: FloatArray,
    start: FloatArray,
    beta: float,
    step_s: float,
    quaternions: FloatArray,
) -> None:
    """Run the gradient descent algorithm (paper 000, Eqs. 40-42; EQUATIONS 2.4).

    q += step_s (q (x) (0, w) / 2 - beta grad/|grad|), then normalised; grad = J^T f of the mismatch f
    between the predicted and the measured direction of gravity. The force is normalised first, else
    part of the unit step is spent on |force| != g.

    Parameters
    ----------
    rate : ndarray (n, 3)
        Body rate that holds over the step that ends at each sample, rad/s; row 0 is not used.
    force : ndarray (n, 3)
        Specific force without the track's acceleration, body frame; any unit.
    start : ndarray (4,)
        Unit quaternion (a, b, c, d) at the first sample, body to global.
    beta : float
        Speed of the correction of the quaternion, 1/s.
    step_s : float
        Sample interval, s.
    quaternions : ndarray (n, 4), out
        The estimate; row 0 is `start`.
    """
    q = start[0], start[1], start[2], start[3]
    quaternions[0, 0], quaternions[0, 1], quaternions[0, 2], quaternions[0, 3] = q
    for k in range(1, rate.shape[0]):
        turned, pull = (rate[k, 0], rate[k, 1], rate[k, 2]), (force[k, 0], force[k, 1], force[k, 2])
        q = descended(q, turned, pull, beta, step_s)
        quaternions[k, 0], quaternions[k, 1], quaternions[k, 2], quaternions[k, 3] = q
