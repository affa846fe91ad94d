"""What the acceleration of a mount is made of, seen from the moving track frame.

The track frame's own acceleration is what the estimators of Briales et al. 2021 take off the accelerometer;
the motion of the body in that frame is what they neglect (their Eq. 14 and section 8). Here both follow
exactly from the true motion, without differentiating any signal. No estimator uses this.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from simrail.core.columns import ACCEL, ATTITUDE, ODOMETRY, RELATIVE_POSITION, VELOCITY
from simrail.core.jit import FloatArray
from simrail.core.rotation import rotation_matrix
from simrail.track.design import TrackDesign


class Terms(NamedTuple):
    """Parts of an acceleration, components in the track frame, each ndarray (n, 3) in m/s2.

    Their sum is the acceleration of the mount in the global frame.

    Attributes
    ----------
    track : ndarray
        Acceleration of the origin of the track frame.
    angular : ndarray
        alpha x r + w x (w x r): the mount's place r in the turning frame.
    angular_of_deviation : ndarray
        The same of r less the mount's nominal place alone; a part of `angular`, not of the sum.
    coriolis : ndarray
        2 w x r'.
    relative : ndarray
        r'': acceleration in the track frame.
    """

    track: FloatArray
    angular: FloatArray
    angular_of_deviation: FloatArray
    coriolis: FloatArray
    relative: FloatArray


def acceleration_terms(
    motion: pd.DataFrame, track: TrackDesign, *, nominal_m: tuple[float, float, float], gravity_mps2: float
) -> Terms:
    """Take the acceleration of a mount apart (EQUATIONS 1.1; Briales et al. 2021, Eq. 14).

    With k the Darboux curvatures of the track frame and k' their derivatives, V = ds/dt, A = dV/dt:

        w = V k,   alpha = A k + V^2 k'
        r' = v - (V / cos th, 0, 0) - w x r
        r'' = a - track - alpha x r - w x (w x r) - 2 w x r'

    v and a are the mount's velocity and acceleration, turned into the track frame.

    Parameters
    ----------
    motion : pandas.DataFrame
        True motion of the mount (`simrail.ride.truth.Truth.motion`), n samples.
    track : TrackDesign
        The design track.
    nominal_m : tuple of float
        The mount's nominal place (x, y, z); y and z are those in the track frame.
    gravity_mps2 : float
        Gravity in the specific force of `motion`.
    """
    position, speed, speed_rate = motion[list(ODOMETRY)].to_numpy(dtype=np.float64).T
    frame = track.frame(position)
    to_track = np.swapaxes(frame.rotation, 1, 2)
    body = rotation_matrix(motion[list(ATTITUDE)].to_numpy(dtype=np.float64))
    felt = np.einsum("nij,nj->ni", body, motion[list(ACCEL)].to_numpy(dtype=np.float64))
    a = np.einsum("nij,nj->ni", to_track, felt - np.array([0.0, 0.0, gravity_mps2]))
    v = np.einsum("nij,nj->ni", to_track, motion[list(VELOCITY)].to_numpy(dtype=np.float64))

    square, secant = speed * speed, 1.0 / np.cos(frame.pitch_rad)
    along = (speed_rate + square * np.tan(frame.pitch_rad) * frame.rates[:, 1]) * secant
    origin = np.column_stack([along, square * frame.k[:, 2] * secant, -square * frame.k[:, 1] * secant])
    w = speed[:, None] * frame.k
    alpha = speed_rate[:, None] * frame.k + square[:, None] * frame.dk

    def turning(arm: FloatArray) -> FloatArray:
        acceleration: FloatArray = np.cross(alpha, arm) + np.cross(w, np.cross(w, arm))
        return acceleration

    beside = motion[list(RELATIVE_POSITION)].to_numpy(dtype=np.float64)
    r = np.column_stack([np.zeros(len(beside)), beside])
    deviation = np.column_stack([np.zeros(len(beside)), beside - np.asarray(nominal_m[1:])])
    rate = v - np.cross(w, r)
    rate[:, 0] -= speed * secant
    coriolis, angular = 2.0 * np.cross(w, rate), turning(r)
    return Terms(origin, angular, turning(deviation), coriolis, a - origin - angular - coriolis)


def below(signal: FloatArray, *, frequency_hz: float, rate_hz: float) -> FloatArray:
    """What of a signal (n, ...) lies below a frequency: its Fourier components up to there.

    The signal is taken as periodic, which a ride from rest to rest is.
    """
    spectrum = np.fft.rfft(signal, axis=0)
    spectrum[np.fft.rfftfreq(len(signal), 1.0 / rate_hz) > frequency_hz] = 0.0
    slow: FloatArray = np.fft.irfft(spectrum, n=len(signal), axis=0)
    return slow
