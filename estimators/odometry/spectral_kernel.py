"""Compiled loop of the spectral odometry: a speed that is known late, and what follows from it by now.

Four states at the centre of the newest frame: way s, speed v, acceleration a, and the error e of what the
vibration tells of the speed. Acceleration and error are Gauss-Markov processes (R. A. Singer, IEEE Trans.
Aerosp. Electron. Syst. AES-6 (1970) 473-483):

    s' = v,   v' = a,   a' = -a / tau_a + white,   e' = -e / tau_e + white
    z = v + sigma e + u          at the frame's centre, sigma = +-1 the direction of running

A frame is known at its end, half of its length after its centre. The filter stays at the centre; what it says
of each sample is its state led on by the time that has passed since.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm
from simrail.estimators.kalman import update

from simrail.core.jit import FloatArray, IntArray, njit

STATES = 4
S, V, A, E = range(STATES)


class Led(NamedTuple):
    """Transition over so many samples: F and Q, each (m, 4, 4), row j over j samples."""

    f: FloatArray
    q: FloatArray


def led_on(
    step_s: float, samples: int, *, sd: tuple[float, float], correlation_s: tuple[float, float]
) -> Led:
    """F and Q over 0 to ``samples`` samples; sd and correlation time of acceleration and of the error.

    The first step is by C. F. Van Loan (IEEE Trans. Autom. Control AC-23 (1978) 395-404).
    """
    generator, drive = np.zeros((STATES, STATES)), np.zeros((STATES, STATES))
    generator[S, V] = generator[V, A] = 1.0
    for state, deviation, time in zip((A, E), sd, correlation_s, strict=True):
        generator[state, state] = -1.0 / time
        drive[state, state] = 2.0 * deviation**2 / time
    whole = np.block([[-generator, drive], [np.zeros_like(drive), generator.T]]) * step_s
    made = expm(whole)
    f1 = made[STATES:, STATES:].T
    q1 = f1 @ made[:STATES, STATES:]
    led = Led(np.empty((samples + 1, STATES, STATES)), np.empty((samples + 1, STATES, STATES)))
    led.f[0], led.q[0] = np.eye(STATES), 0.0
    for j in range(samples):
        led.f[j + 1] = f1 @ led.f[j]
        led.q[j + 1] = f1 @ led.q[j] @ f1.T + q1
    return led


@njit
def spectral_filter(
    speed: FloatArray,
    variance: FloatArray,
    direction: FloatArray,
    ends: IntArray,
    half: int,
    led: Led,
    start_variance: FloatArray,
    out: FloatArray,
) -> None:
    """Run the filter over frames, and say at each sample what is known by then.

    Parameters
    ----------
    speed, variance : ndarray (m,)
        Signed speed that each frame tells, m/s, and the variance of its white part u, (m/s)^2; NaN for a
        frame that tells none.
    direction : ndarray (m,)
        sigma of each frame.
    ends : ndarray of int (m,)
        Last sample of each frame.
    half : int
        Samples from the centre of a frame to its end.
    led : Led
        Transitions over as many samples as lie between a frame's centre and the next but one's end, at least.
    start_variance : ndarray (4,)
        Of the state at sample 0, which is zero.
    out : ndarray (n, 6), out
        s, v, a in m, m/s and m/s2, and their variances.
    """
    x, p = np.zeros(STATES), np.zeros((STATES, STATES))
    xl, pl, work = np.zeros(STATES), np.zeros((STATES, STATES)), np.zeros((STATES, STATES))
    h, gain, v = np.zeros(STATES), np.zeros(STATES), np.zeros(STATES)
    for i in range(STATES):
        p[i, i] = start_variance[i]
    longest = led.f.shape[0] - 1
    h[V] = 1.0
    origin, frame = 0, 0
    for k in range(out.shape[0]):
        if frame < len(ends) and ends[frame] == k:
            _lead(x, p, led, k - half - origin, xl, pl, work)
            for i in range(STATES):
                x[i] = xl[i]
                for c in range(STATES):
                    p[i, c] = 0.5 * (pl[i, c] + pl[c, i])
            origin = k - half
            if not np.isnan(speed[frame]):
                h[E] = direction[frame]
                update(x, p, h, speed[frame] - x[V] - h[E] * x[E], variance[frame], gain, v)
            frame += 1
        lag = min(k - origin, longest)
        for i in range(3):
            value, spread = 0.0, led.q[lag, i, i]
            for c in range(STATES):
                value += led.f[lag, i, c] * x[c]
                for j in range(STATES):
                    spread += led.f[lag, i, c] * p[c, j] * led.f[lag, i, j]
            out[k, i], out[k, 3 + i] = value, spread


@njit
def _lead(
    x: FloatArray, p: FloatArray, led: Led, lag: int, xl: FloatArray, pl: FloatArray, work: FloatArray
) -> None:
    """State and covariance led on by so many samples: F x and F P F' + Q."""
    for i in range(STATES):
        xl[i] = 0.0
        for c in range(STATES):
            xl[i] += led.f[lag, i, c] * x[c]
            work[i, c] = 0.0
            for j in range(STATES):
                work[i, c] += led.f[lag, i, j] * p[j, c]
    for i in range(STATES):
        for c in range(STATES):
            pl[i, c] = led.q[lag, i, c]
            for j in range(STATES):
                pl[i, c] += work[i, j] * led.f[lag, c, j]
