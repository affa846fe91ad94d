"""Channels of the kinematic engine that tests move a body by."""

import numpy as np

from simrail.core.jit import FloatArray
from simrail.ride.kinematic import Channel


def harmonic(amplitude: float, *, frequency_hz: float, phase_rad: float = 0.0) -> Channel:
    """A channel that swings in time: amplitude * sin(2 pi f t + phase)."""

    def channel(t: FloatArray, *_: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        omega = 2.0 * np.pi * frequency_hz
        angle = omega * t + phase_rad
        swing = amplitude * np.sin(angle)
        return swing, amplitude * omega * np.cos(angle), -(omega**2) * swing

    return channel
