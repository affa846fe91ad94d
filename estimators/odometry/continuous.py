"""An odometry whose place runs with its speed, for estimators that follow the track along it.

A causal odometry that matches curves corrects itself: in a transition its place may jump by 0.15 m within one
sample. Whoever takes the track's frame at that place has a frame that jumps, and a smoother of trajectories
takes that for a motion of the body. Here the corrections are spread over time; the speed stays as it is.
"""

import numpy as np
import pandas as pd
from scipy import signal

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording, odometry_of

JUMP_M = 0.01
"""A place that is further than this from where the speed leads within one sample has been corrected: a pulse
of an encoder is some mm."""

SPREAD_S = 5.0
"""Time constant over which a correction is spread: half a metre is 2 % of the speed of a train at 5 m/s."""


def jumps(odometry: pd.DataFrame) -> FloatArray:
    """How far each place is from where the mean speed leads from the one before, (n - 1,), m."""
    place, speed = (odometry[name].to_numpy(dtype=np.float64) for name in ("position_m", "speed_mps"))
    steps = np.diff(odometry.index.to_numpy(dtype=np.float64))
    difference: FloatArray = np.diff(place) - 0.5 * steps * (speed[1:] + speed[:-1])
    return difference


def with_continuous_odometry(recording: Recording, *, causal: bool) -> Recording:
    """The recording with an odometry that does not jump; itself where it does not.

    Parameters
    ----------
    recording : Recording
        With an odometry.
    causal : bool
        True: a correction is spread over the time after it. False: over that before it too.
    """
    odometry = odometry_of(recording)
    off = jumps(odometry)
    if np.max(np.abs(off), initial=0.0) <= JUMP_M:
        return recording
    corrections = np.concatenate([[0.0], np.cumsum(off)])
    place = odometry["position_m"].to_numpy(dtype=np.float64) - corrections
    keep = np.exp(-1.0 / (SPREAD_S * recording.imu_sheet.rate_hz))
    share, fade = [1.0 - keep], [1.0, -keep]
    spread = signal.lfilter(share, fade, corrections)
    if not causal:
        # Both ways about the last value, so that the end is not drawn to zero.
        spread = corrections[-1] + signal.lfilter(share, fade, (spread - corrections[-1])[::-1])[::-1]
    return recording.with_odometry(odometry.assign(position_m=place + spread), recording.odometry_source)
