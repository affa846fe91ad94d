"""Compiled loops of the attitude estimators: arrays in, arrays out, no allocation.

The three-state extended Kalman filter and the gradient descent algorithm of Briales et al. 2021
(paper 000). Both get the accelerometer with the track's acceleration already taken off
(`simrail.estimators.attitude.compensation`), so nothing here knows of tracks, recordings or data frames.
"""

import math

from simrail.core.jit import FloatArray, njit, njit_inline

Covariance = tuple[float, float, float, float, float, float]
"""Upper triangle of a covariance of roll, pitch and yaw, row by row."""


@njit_inline
def correct(
    p: Covariance, d_roll: float, d_pitch: float, h0: float, h1: float, error: float, variance: float
) -> tuple[Covariance, float, float, float]:
    """`simrail.estimators.kalman.update` for a row (h0, h1, 0), with heading only considered (Schmidt).

    ``error`` is z - h(x) at the predicted state, ``d_roll`` and ``d_pitch`` what earlier rows moved it by.
    Returns P, both moves, and e^2/s.
    """
    p00, p01, p02, p11, p12, p22 = p
    v0, v1, v2 = h0 * p00 + h1 * p01, h0 * p01 + h1 * p11, h0 * p02 + h1 * p12
    inverse = 1.0 / (h0 * v0 + h1 * v1 + variance)
    g0, g1 = v0 * inverse, v1 * inverse
    e = error - h0 * d_roll - h1 * d_pitch
    p = (p00 - g0 * v0, p01 - g0 * v1, p02 - g0 * v2, p11 - g1 * v1, p12 - g1 * v2, p22)
    return p, d_roll + g0 * e, d_pitch + g1 * e, e * e * inverse


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

    Predict with x += step_s f(x, w) and A = I + step_s F, update with h(x) = C^T g e_z by three scalar
    updates that are linearised at the predicted state, which equals the block update because the
    accelerometer's noise is independent between its axes. Heading is unobservable from gravity: its
    gain is held at zero and its cross-covariances are carried along (Schmidt).

    Specialised by hand: the covariance is six numbers in registers, which stays symmetric by construction. On
    the arrays of `simrail.estimators.kalman` the same filter takes 2.6 times as long.

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
    roll, pitch, yaw = start[0], start[1], start[2]
    p = (start_variance[0], 0.0, 0.0, start_variance[1], 0.0, start_variance[2])
    sr, cr = math.sin(roll), math.cos(roll)
    sp, cp = math.sin(pitch), math.cos(pitch)
    for k in range(rate.shape[0]):
        if k > 0:
            # Euler rates f(x, w) and A = I + step F (EQUATIONS 2.2).
            y, z = rate[k, 1], rate[k, 2]
            secant = 1.0 / cp
            tangent = sp * secant
            u = y * cr - z * sr
            w = y * sr + z * cr
            roll += step_s * (rate[k, 0] + w * tangent)
            pitch += step_s * u
            yaw += step_s * w * secant
            a00 = 1.0 + step_s * u * tangent
            a01 = step_s * w * secant * secant
            a20 = step_s * u * secant
            a21 = step_s * w * tangent * secant
            p = propagate(p, a00, a01, -step_s * w, a20, a21, process[k])
            sr, cr = math.sin(roll), math.cos(roll)
            sp, cp = math.sin(pitch), math.cos(pitch)

        # Innovation, z less gravity in body axes, and the three rows of its Jacobian (EQUATIONS 2.2).
        ex = force[k, 0] + gravity * sp
        ey = force[k, 1] - gravity * sr * cp
        ez = force[k, 2] - gravity * cr * cp
        p, d_roll, d_pitch, nis = correct(p, 0.0, 0.0, 0.0, -gravity * cp, ex, noise[k, 0])
        h0, h1 = gravity * cr * cp, -gravity * sr * sp
        p, d_roll, d_pitch, square = correct(p, d_roll, d_pitch, h0, h1, ey, noise[k, 1])
        nis += square
        h0, h1 = -gravity * sr * cp, -gravity * cr * sp
        p, d_roll, d_pitch, square = correct(p, d_roll, d_pitch, h0, h1, ez, noise[k, 2])
        nis += square
        roll += d_roll
        pitch += d_pitch
        sr, cr = math.sin(roll), math.cos(roll)
        sp, cp = math.sin(pitch), math.cos(pitch)

        states[k, 0], states[k, 1], states[k, 2] = roll, pitch, yaw
        p00, p01, p02, p11, p12, p22 = p
        covariance[k, 0, 0], covariance[k, 0, 1], covariance[k, 0, 2] = p00, p01, p02
        covariance[k, 1, 0], covariance[k, 1, 1], covariance[k, 1, 2] = p01, p11, p12
        covariance[k, 2, 0], covariance[k, 2, 1], covariance[k, 2, 2] = p02, p12, p22
        innovations[k, 0], innovations[k, 1], innovations[k, 2], innovations[k, 3] = ex, ey, ez, nis


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
    a, b, c, d = start[0], start[1], start[2], start[3]
    quaternions[0, 0], quaternions[0, 1], quaternions[0, 2], quaternions[0, 3] = a, b, c, d
    half = 0.5 * step_s
    for k in range(1, rate.shape[0]):
        x, y, z = half * rate[k, 0], half * rate[k, 1], half * rate[k, 2]
        fx, fy, fz = force[k, 0], force[k, 1], force[k, 2]
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
        a, b, c, d = a * inverse, b * inverse, c * inverse, d * inverse
        quaternions[k, 0], quaternions[k, 1], quaternions[k, 2], quaternions[k, 3] = a, b, c, d
