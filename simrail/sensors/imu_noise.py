"""What a resting IMU adds by chance: white noise, wandering bias, random walk, bias at switch-on.

Every term has its own named stream, drawn row by row: a new term, a new sensor or a longer ride changes
no sample of another. The numbers are drawn in blocks that stay in the processor's cache and added in one
pass. The closed forms of these processes are in `simrail.recording.sheets.allan`.
"""

from collections.abc import Callable

import numpy as np

from simrail.core.jit import FloatArray, njit
from simrail.recording.sheets.grades import ImuGrade

BLOCK = 2048
"""Rows drawn at a time."""

Streams = Callable[[str], np.random.Generator]
"""Gives the stream of a term, e.g. of ``"gyro_white"``."""


def add_noise(samples: FloatArray, grade: ImuGrade, kind: str, streams: Streams) -> None:
    """Add the random errors of one triad to its samples, in place.

    A wandering bias is a sum of Gauss-Markov sequences, b[k+1] = a b[k] + sqrt(1 - a^2) sd w[k] with
    a = exp(-1/(T rate)) and b[0] of standard deviation sd: exact at any rate, stationary from the first
    sample. The random walk begins at 0 and steps by K / sqrt(rate).

    Parameters
    ----------
    samples : ndarray (n, 3)
        Samples at the grade's rate, a contiguous block or columns of one.
    grade : ImuGrade
        The device.
    kind : {"gyro", "accel"}
        Which triad.
    streams : callable
        Random streams by the name of the term.
    """
    terms = grade.triad(kind)
    count = len(samples)
    bias = streams(f"{kind}_turn_on_bias").uniform(-1.0, 1.0, 3) * terms.turn_on_bias
    correlation, sd = grade.bias_stages(kind)
    decay = np.exp(-1.0 / (correlation * grade.rate_hz))
    drive = sd * np.sqrt(1.0 - decay**2)
    stages = len(sd)
    density = terms.noise * np.sqrt(grade.rate_hz) * np.array(getattr(grade, f"{kind}_axis_noise"))
    noisy = bool(density.any())
    step = terms.random_walk / np.sqrt(grade.rate_hz)
    walking = step > 0.0
    flicker = "flicker" if grade.bias_process == "flicker" else "bias_instability"
    bias_stream = streams(f"{kind}_{flicker}") if stages else None
    walk_stream = streams(f"{kind}_random_walk") if walking else None
    white_stream = streams(f"{kind}_white") if noisy else None
    rows = min(BLOCK, count)
    wander = np.zeros((rows, 3 * stages))
    walk = np.zeros((rows, 3 if walking else 0))
    white = np.zeros((rows, 3 if noisy else 0))
    state = np.zeros(3 * stages)
    walked = np.zeros(3)
    for begin in range(0, count, BLOCK):
        block = samples[begin : begin + BLOCK]
        if bias_stream is not None:
            bias_stream.standard_normal(out=wander[: len(block)])
            if begin == 0:
                state[:] = wander[0] * np.tile(sd, 3)
        if walk_stream is not None:
            walk_stream.standard_normal(out=walk[: len(block)])
            if begin == 0:
                walk[0] = 0.0
        if white_stream is not None:
            white_stream.standard_normal(out=white[: len(block)])
        _add(block, bias, wander, decay, drive, state, begin == 0, walk, step, walked, white, density)


@njit
def _add(
    samples: FloatArray,
    bias: FloatArray,
    wander: FloatArray,
    decay: FloatArray,
    drive: FloatArray,
    state: FloatArray,
    first: bool,
    walk: FloatArray,
    step: float,
    walked: FloatArray,
    white: FloatArray,
    density: FloatArray,
) -> None:
    """One pass over a block (n, 3): bias, stages (3 axes x m), walk and white noise; keeps the states."""
    stages = len(decay)
    walking = walk.shape[1] > 0
    noisy = white.shape[1] > 0
    for k in range(samples.shape[0]):
        for axis in range(3):
            total = bias[axis]
            wandering = 0.0
            for m in range(stages):
                j = axis * stages + m
                if k > 0 or not first:
                    state[j] = decay[m] * state[j] + wander[k, j] * drive[m]
                wandering += state[j]
            total += wandering
            if walking:
                walked[axis] += step * walk[k, axis]
                total += walked[axis]
            if noisy:
                total += white[k, axis] * density[axis]
            samples[k, axis] += total
