"""Single samples that jump there and back: bits that flip on a wire, not what a device has measured.

A device that passes much less than its sample rate answers to the shortest blow with more than one sample.
With a bandwidth of 0.3 of the rate the samples around the greatest differ by a tenth of it at least, whatever
the moment of the blow (Butterworth and Bessel filters of order one to six). A sample that jumps with
quieter neighbours came about behind the filter. Of a device whose filter nobody knows only rests tell, where
nothing shakes it.
"""

import numpy as np
import numpy.typing as npt

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording, imus
from simrail.recording.triads import Triad, rests_of, triads_of

FILTERED = 0.3
"""Bandwidth over sample rate up to which a blow shows in more than one sample."""

ALONE = 0.05
"""Share of a jump that its neighbours may differ by from each other, and from those beyond them."""

NOISES, STEPS = 20.0, 30.0
"""A jump over the noise of a sample by the sheet, and over the median size of steps from sample to sample;
of pure noise the greatest of a day at 1 kHz is some 7 of the former."""

MOST = 0.01
"""Share of samples that are spikes; what is more than that is the signal."""


def spike_warnings(recording: Recording) -> tuple[str, ...]:
    """A warning for each triad in which single samples jump there and back, with the first of them.

    Parameters
    ----------
    recording : Recording
        A ride; of both IMUs, where there are two. A sheet without noise says nothing.
    """
    told: list[str] = []
    for table, alone in imus(recording):
        bandwidth, rate = alone.imu_sheet.bandwidth_hz, alone.imu_sheet.rate_hz
        is_filtered = bandwidth is not None and bandwidth <= FILTERED * rate
        parts = [slice(None)] if is_filtered else rests_of(alone)
        for triad in triads_of(alone, table):
            told += _spikes(triad, parts, alone.imu.index.to_numpy(dtype=np.float64))
    return tuple(told)


def _spikes(triad: Triad, parts: list[slice], time_s: FloatArray) -> list[str]:
    """A warning of the axis that jumps most often in some parts of the ride."""
    found = [
        np.concatenate([[], *(time_s[part][_alone(triad.values[part, axis], triad.noise)] for part in parts)])
        for axis in range(3)
    ]
    axis = int(np.argmax([len(times) for times in found]))
    if not 0 < len(found[axis]) <= max(1.0, MOST * len(time_s)):
        return []
    count = f"{len(found[axis])} single samples" if len(found[axis]) > 1 else "a single sample"
    return [
        f"{triad.field}: {count} of {'XYZ'[axis]} jump{'s' * (len(found[axis]) == 1)} there and back between "
        f"quiet neighbours, first at time_s = {found[axis][0]:.6g}, as no motion does: bits that flipped "
        "on the way to the file; drop those lines, so that they are gaps, and mend the wiring"
    ]


def _alone(values: FloatArray, noise: float) -> npt.NDArray[np.int64]:
    """Numbers of the samples (n,) that stand alone."""
    if len(values) < 5:
        return np.zeros(0, dtype=np.int64)
    step = np.diff(values)
    jump = np.abs(values[2:-2] - 0.5 * (values[1:-3] + values[3:-1]))
    beside = np.abs(np.stack([step[:-3], step[3:], values[3:-1] - values[1:-3]])).max(axis=0)
    least = max(NOISES * noise, STEPS * float(np.median(np.abs(step))))
    return np.flatnonzero((jump > least) & (beside < ALONE * jump + 4.0 * noise)) + 2
