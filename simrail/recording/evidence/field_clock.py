"""The clock of a magnetometer against the IMU's: the field on the body turns as the gyro says, at that time.

A field that is constant around the train turns on the body's axes by

    dB/dt = -w x B,

so its change over a block is the integral of -w(t + offset) x B, with w of the gyro: no map, no attitude and
no way are needed. Beside the offset the fit solves for what a sound ride may have: iron of the vehicle (a
constant h on the body's axes, which adds w x h) and a factor, a gyro's bias (b x B, of the size that a rest
leaves), and a drift of the field on each axis.

What the line adds (steel, currents) is noise here, which lasts: as in `simrail.recording.evidence.fit`, a
residual's variance is enlarged by its correlations, and large residuals weigh less.
"""

import math
from typing import NamedTuple

import numpy as np

from simrail.core.columns import GYRO, MAGNETIC
from simrail.core.jit import FloatArray
from simrail.core.resample import rate_of
from simrail.recording.evidence.finding import Finding, verdict_of
from simrail.recording.evidence.judge import KINDS
from simrail.recording.recording import Recording

BLOCK_S = 0.5
"""Length of a block, over which the field's noise is less than what a curve turns it by."""

OFFSETS_S = np.arange(-6.0, 6.01, 0.25)
"""Where the search for the offset begins."""

STEP_S = 0.02
"""Step of the difference for the slope."""

CLOCK_SD_S, OWN_INTERVALS = 0.03, 0.2
"""What a sound clock may be off: so much, and a share of the interval of the device's own samples."""

CORRELATED_S, OUTLIER = 10.0, 3.0
"""As in the fit of a ride."""

LEAST_TURN_RAD = 0.1
"""Turn of the gyro about the vertical, there and back counted, from which on a field tells of its clock."""

FOLLOWED = 0.5
"""Share of the field's changes that the gyro has to explain."""

KEY = "magnetometer_offset"


def weigh_field_clock(recording: Recording) -> tuple[Finding, ...]:
    """What a ride says of the clock of its magnetometer; nothing where it has none.

    Parameters
    ----------
    recording : Recording
        A ride that has passed `simrail.recording.check_form.check_recording`.
    """
    if recording.magnetometer is None:
        return ()
    name, unit = "magnetometer: offset of the clock", "s"
    turn = _turn(recording)
    found = _fitted(recording) if turn > LEAST_TURN_RAD else None
    if found is None or found[2] < FOLLOWED:
        why = "there is no turn that the field follows"
        return (Finding(name, KEY, 0.0, math.inf, 0.0, unit, "nothing", "could not be judged", why),)
    value, sd, _ = found
    slack = CLOCK_SD_S + OWN_INTERVALS / rate_of(recording.imu.index.to_numpy())
    off = abs(value) / math.hypot(sd, slack)
    verdict = verdict_of(off)
    why, setting = "", "magnetometer.time_offset_s"
    if verdict != "sound":
        side = "late" if value < 0.0 else "early"
        why = f"the stamps of the magnetometer are {abs(value):.2f} s {side} against the gyro's"
    elif sd > KINDS["offset"].wanted:
        verdict, why = "could not be judged", "the ride tells too little of it"
    rests_on = f"{np.degrees(turn):.0f} deg of turns"
    return (Finding(name, KEY, value, sd, 0.0, unit, rests_on, verdict, why, setting, setting),)


def _turn(recording: Recording) -> float:
    """Turn about Z, there and back counted, by means over blocks; what a gyro's bias turns is taken off."""
    rate = recording.imu_sheet.rate_hz
    block = max(1, round(BLOCK_S * rate))
    values = recording.imu[GYRO[2]].to_numpy()
    whole = len(values) // block * block
    means = values[:whole].reshape(-1, block).mean(axis=1) if whole else np.zeros(1)
    return float(np.abs(means - np.median(means)).sum() * block / rate)


class _Blocks(NamedTuple):
    """Field and turn of a ride, in blocks that are far enough from its ends to be moved.

    Attributes
    ----------
    values : ndarray (b, 3)
        Means of the field, over its size.
    first_s, block_s : ndarray (b,), float
        When each block begins, and its length.
    at_s, held : ndarray (n,), ndarray (n, 3)
        Times, and the integral of the angle that the gyro has turned by then.
    most_s : float
        Largest offset that can be told.
    """

    values: FloatArray
    first_s: FloatArray
    block_s: float
    at_s: FloatArray
    held: FloatArray
    most_s: float

    @property
    def change(self) -> FloatArray:
        """Of the field (b - 1, 3) from block to block."""
        return np.diff(self.values, axis=0)

    def columns(self, offset: float) -> FloatArray:
        """Expected changes (n, 3, 10) at an offset: by the turn, by iron, by a gyro's bias, of itself."""
        first = self.first_s + offset
        begins = [np.interp(first, self.at_s, self.held[:, i]) for i in range(3)]
        ends = [np.interp(first + self.block_s, self.at_s, self.held[:, i]) for i in range(3)]
        # Means of the angle over the blocks, as the field's are.
        angle = np.diff((np.array(ends) - np.array(begins)).T / self.block_s, axis=0)
        between = 0.5 * (self.values[1:] + self.values[:-1])
        made = np.zeros((len(angle), 3, 10))
        made[:, :, 0] = -np.cross(angle, between)
        for i, axis in enumerate(np.eye(3)):
            made[:, :, 1 + i] = np.cross(angle, axis)
            made[:, :, 4 + i] = -np.cross(axis, between)
            made[:, :, 7 + i] = axis
        return made

    def solve(self, offset: float, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Factors (10,) of the columns at an offset, and what they leave of the changes."""
        columns = self.columns(offset)
        made, change = columns.reshape(-1, 10) * weights.reshape(-1, 1), self.change
        found, *_ = np.linalg.lstsq(made, change.ravel() * weights.ravel(), rcond=None)
        solved: FloatArray = np.asarray(found, dtype=np.float64)
        return solved, change - (columns @ solved)


def _blocks(recording: Recording) -> _Blocks | None:
    """The blocks of a ride; None of one that is too short."""
    assert recording.magnetometer is not None
    time = recording.imu.index.to_numpy()
    rate = recording.imu_sheet.rate_hz
    block = max(2, round(BLOCK_S * rate))
    edges = np.arange(0, len(time), block)
    margin = int(np.ceil((OFFSETS_S[-1] + 1.0) * rate / block))
    if len(edges) < 2 * margin + 16:
        margin = max(1, len(edges) // 8)
    if len(edges) < 2 * margin + 8:
        return None
    field = recording.magnetometer[list(MAGNETIC)].to_numpy()
    size = float(np.median(np.linalg.norm(field, axis=1)))
    smooth = _means(field / size, block)
    rates = recording.imu[list(GYRO)].to_numpy()
    # What a stamp of the gyro says is as old as its response.
    turned = np.vstack([np.zeros(3), np.cumsum(rates, axis=0) / rate])
    held = np.vstack([np.zeros(3), np.cumsum(0.5 * (turned[1:] + turned[:-1]), axis=0) / rate])
    at = np.asarray((np.arange(len(turned)) - 0.5) / rate - recording.imu_sheet.lag_s, dtype=np.float64)
    begins = np.asarray((edges - 0.5) / rate, dtype=np.float64)
    inner = slice(margin, len(smooth) - margin)
    most = float(min(OFFSETS_S[-1], margin * block / rate - 0.5))
    return _Blocks(smooth[inner], begins[inner], block / rate, at, held, most)


def _fitted(recording: Recording) -> tuple[float, float, float] | None:
    """Seconds to add to the field's stamps, their sd, and the share of the field's changes explained."""
    blocks = _blocks(recording)
    if blocks is None:
        return None
    change = blocks.change
    weights = np.ones_like(change)
    trials = [
        (float(np.sum(np.abs(blocks.solve(offset, weights)[1]))), offset)
        for offset in OFFSETS_S
        if abs(offset) <= blocks.most_s
    ]
    _, offset = min(trials)
    sd, left, solved = math.inf, change, np.zeros(10)
    for _ in range(12):
        solved, left = blocks.solve(offset, weights)
        spread = np.maximum(1.4826 * np.median(np.abs(left), axis=0), 1e-9)
        weights = np.minimum(1.0, OUTLIER * spread / np.maximum(np.abs(left), 1e-12)) / spread
        slope = (blocks.columns(offset + STEP_S) - blocks.columns(offset - STEP_S)) @ solved / (2.0 * STEP_S)
        full = np.concatenate([blocks.columns(offset), slope[:, :, None]], axis=2).reshape(-1, 11)
        normal = (full * (weights**2).reshape(-1, 1)).T @ full
        scale = np.sqrt(np.maximum(np.diag(normal), 1e-30))
        inverse = np.linalg.pinv(normal / np.outer(scale, scale), hermitian=True) / np.outer(scale, scale)
        step = float((inverse @ ((full * (weights**2).reshape(-1, 1)).T @ left.ravel()))[-1])
        sd = math.sqrt(inverse[-1, -1]) * _longer(left * weights, blocks.block_s)
        offset = float(np.clip(offset + np.clip(step, -0.5, 0.5), -blocks.most_s, blocks.most_s))
        if abs(step) < 0.01 * sd:
            break
    total = (change - change.mean(axis=0)) * weights
    explained = 1.0 - float(np.sum((left * weights) ** 2) / max(np.sum(total**2), 1e-30))
    return offset, sd, explained


def _means(values: FloatArray, block: int) -> FloatArray:
    """Means (n // block, 3) over blocks."""
    whole = len(values) // block * block
    means: FloatArray = values[:whole].reshape(-1, block, values.shape[1]).mean(axis=1)
    return means


def _longer(rest: FloatArray, block_s: float) -> float:
    """Standard deviation of weighted residuals (n, 3), enlarged by their correlations."""
    most = max(1, min(round(CORRELATED_S / block_s), len(rest) // 4))
    power = float(np.mean(rest**2))
    longer = 1.0
    for lag in range(1, most + 1):
        longer += (
            2.0 * (1.0 - lag / (most + 1.0)) * float(np.mean(rest[lag:] * rest[:-lag])) / max(power, 1e-30)
        )
    return math.sqrt(power * max(longer, 1.0))
