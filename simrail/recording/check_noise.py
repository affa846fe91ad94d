"""Is this the noise of that device? What a signal is when nothing moves it, held against the sheet.

Noise is told best at rest, at any stop. A train that never stands shakes its devices; but what rails and
wheels shake grows with the speed, and what does so alike at any speed is the device's own.
"""

import numpy as np

from simrail.core.jit import FloatArray
from simrail.recording.check_samples import STUCK_COUNTS
from simrail.recording.evidence.way import way_of
from simrail.recording.recording import ImuSheet, Recording, imus
from simrail.recording.triads import Triad, rests_of, sample_noise, triads_of

LOUD, SILENT = {"gyro": 10.0, "accel": 30.0}, 0.1
"""Noise at rest over that of the sheet from which on it is told: an engine that idles shakes the
accelerometer more than the gyro; and below which samples were smoothed, or are of a better device."""

HUM, HUM_SAMPLES, HUM_SHARE, SLOW_HZ = 0.3, 128, 0.5, 5.0
"""Share of `LOUD` from which on a single tone at rest is told; samples of such a rest; what the tone has at
least of the power of all that is faster than bodies swing."""

WINDOW_S, WINDOW_SAMPLES, WINDOWS = 1.0, 200, 8
"""Parts of a ride in which its noise is taken: so long, of so many samples; and how many there must be."""

ALIKE, FASTER = 1.4, 2.0
"""Greatest over least noise of the parts of a ride (9th and 1st tenth) that is the same at all speeds: of 200
samples it is known to 7 %, so of pure noise the ratio is 1.2; where the greatest speed is this many times the
least. What shakes with the speed at all (rails: at least as its first power) has twice as much there."""

ROUNDED = float(np.sqrt(12.0))
"""Steps over the noise of a sample from which on rounding leaves more than the device does."""


def noise_warnings(recording: Recording) -> tuple[str, ...]:
    """Warnings, a line each, of a noise that is far from what the sheet says, and of what hides it.

    The noise of a sample is taken from second differences, x[k-1] - 2 x[k] + x[k+1] over sqrt(6): bias and
    its wandering do not show in them. At rest (the quietest for what is loud), else over the whole ride, if
    it is alike at all speeds. A tone at rest, steps that are coarser than the noise and a bandwidth that
    folds are told, too.

    Parameters
    ----------
    recording : Recording
        A ride; of both IMUs, where there are two. A sheet without noise says nothing.
    """
    told: list[str] = []
    for table, alone in imus(recording):
        rests = rests_of(alone)
        for signal in triads_of(alone, table):
            told += _rounded(signal)
            if signal.noise < STUCK_COUNTS * signal.steps.min():
                continue  # what is left is rounding
            told += _at_rest(signal, rests) if rests else _under_way(signal, alone)
        told += _folded(alone.imu_sheet, table)
    return tuple(told)


def _at_rest(signal: Triad, rests: list[slice]) -> list[str]:
    """Warnings of a tone at rest, else of a noise that is too loud or too silent in all rests."""
    longest = max(rests, key=lambda rest: rest.stop - rest.start)
    tone = _tone(signal.values[longest], signal.sheet.rate_hz)
    if tone is not None and tone[1] > HUM * LOUD[signal.kind] * signal.noise:
        frequency, size = tone
        return [
            f"{signal.field}: hums at rest at {frequency:.3g} Hz with {size:.2g} {signal.unit} rms, which "
            f"{signal.beside(size)}: mains or a motor in its supply (or a faster tone that folds there), "
            "or an engine that shakes it"
        ]
    found = [sample_noise(signal.values[rest]) for rest in rests]
    if min(found) > LOUD[signal.kind] * signal.noise:
        noise, why = min(found), "the device is another, or shakes while the train stands"
    elif max(found) < SILENT * signal.noise:
        noise, why = max(found), "the samples were smoothed, or the device is another"
    else:
        return []
    return [
        f"{signal.field}: noise of {noise:.2g} {signal.unit} a sample at rest {signal.beside(noise)}: {why}"
    ]


def _tone(values: FloatArray, rate_hz: float) -> tuple[float, float] | None:
    """Frequency and rms of a tone that has most of the power of an axis (n, 3); None without."""
    count = len(values)
    if count < HUM_SAMPLES:
        return None
    window = np.hanning(count)[:, None]
    power = np.abs(np.fft.rfft(window * (values - values.mean(axis=0)), axis=0)) ** 2
    power *= 2.0 / (count * float(np.sum(window**2)))  # sums to the variance
    power[np.fft.rfftfreq(count, 1.0 / rate_hz) < max(SLOW_HZ, 3.0 * rate_hz / count)] = 0.0
    axis = int(np.argmax(power.max(axis=0)))
    peak = int(np.argmax(power[:, axis]))
    tone, total = float(power[max(peak - 2, 0) : peak + 3, axis].sum()), float(power[:, axis].sum())
    if total == 0.0 or tone < HUM_SHARE * total:
        return None
    return peak * rate_hz / count, float(np.sqrt(tone))


def _under_way(signal: Triad, recording: Recording) -> list[str]:
    """A warning of a noise that is too loud and alike at all speeds, on a ride without a rest."""
    size = max(WINDOW_SAMPLES, round(WINDOW_S * signal.sheet.rate_hz))
    count = len(signal.values) // size
    way = way_of(recording) if count >= WINDOWS else None
    if way is None:
        return []
    times = recording.imu.index.to_numpy()[: count * size].reshape(count, size).mean(axis=1)
    speed = np.quantile(np.interp(times, way.time_s, np.abs(way.speed_mps)), (0.1, 0.9))
    noise = np.array([sample_noise(part) for part in np.split(signal.values[: count * size], count)])
    least, most = np.quantile(noise, (0.1, 0.9))
    if most > ALIKE * least or speed[1] < FASTER * speed[0] or least < LOUD[signal.kind] * signal.noise:
        return []
    return [
        f"{signal.field}: noise of {least:.2g} {signal.unit} a sample {signal.beside(least)}, and alike from "
        f"{speed[0]:.3g} to {speed[1]:.3g} m/s: no rail shakes so; the device is another, or its unit or its "
        "supply is wrong"
    ]


def _rounded(signal: Triad) -> list[str]:
    """A warning of numbers in steps that leave more than the noise, and that the sheet does not have."""
    steps = signal.steps
    axis = int(np.argmax(np.where(np.isfinite(steps), steps, 0.0)))
    step, first = float(steps[axis]), signal.values[0, axis]
    if not np.isfinite(step) or step < max(ROUNDED * signal.noise, 2.0 * signal.least):
        return []
    counts = (signal.values[:, axis] - first) / step
    if np.abs(counts - np.rint(counts)).max() > 0.01:
        return []
    return [
        f"{signal.field}: stands in steps of {step:.3g} {signal.unit}, and the noise of a sample of "
        f"{signal.sheet.grade} is {signal.noise:.2g} {signal.unit}: rounding leaves more than the device "
        "does; log it with more decimals, or mend the resolution and the noise of its sheet"
    ]


def _folded(sheet: ImuSheet, table: str) -> list[str]:
    """A warning of a device that passes more than its samples can show."""
    if sheet.bandwidth_hz is None or sheet.bandwidth_hz <= 0.5 * sheet.rate_hz:
        return []
    return [
        f"{table}: the bandwidth of {sheet.grade} ({sheet.bandwidth_hz:g} Hz) is above half the rate of the "
        f"file ({0.5 * sheet.rate_hz:g} Hz): faster vibration folds into its samples; set a lower filter "
        "of the device or a higher rate, or mend the sheet"
    ]
