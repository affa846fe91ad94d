"""What a device reads of a ride, by the model of `simrail.recording.evidence.model`, and its slopes.

Only the motion and the map are looked up at fine times. All else is linear in their means over blocks: what a
body that leans and squats adds, how the device is turned, its factors. So are the slopes by those; those by
clocks follow from one another, and but three differences are taken: by the wheel, the place and the time.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from simrail.core.jit import FloatArray, IntArray
from simrail.core.rotation import rotation_matrix
from simrail.recording.evidence.line import ALONG, K1, K2, K3, LEVEL, UP
from simrail.recording.evidence.model import (
    ACCEL_GAIN,
    CHANNELS,
    CUTS,
    FINE,
    FORCE_X,
    GAINS,
    GLOBALS,
    GYRO_Z,
    INDEX,
    LATES,
    PACE,
    RAMPS,
    SLOW,
    THEN,
    TURNS,
    Ride,
    after,
    laters,
    motion_of,
    way_then,
    when_of,
)

STEPS = {"wheel": 1e-4, "shift": 0.05, "offset": 5e-3, PACE: 1e-5}
STEPS |= dict.fromkeys(SLOW, 5e-3) | dict.fromkeys(CUTS, 1e-3)
"""Parameters whose slopes are differences, and their steps."""

TURN_STEP_RAD = 1e-5

_PARTS = 10
_TURN, _LEAN_X, _LEAN_Y, _SQUAT_Y, _PUSH, _ALONG, _BESIDE, _UP = 0, 3, 4, 5, 6, 7, 8, 9
"""Columns of what a body feels: rates of the track; roll rate, and pitch rate, by lean; pitch rate by squat;
push, and gravity along it; what is left across; what is left upwards."""

_FORCE = slice(3, 6)
_BODY = 6
_ANGLES = ("roll", "pitch", "yaw")
_SPRINGS = {
    "lean": ((0, _LEAN_X), (1, _LEAN_Y), (4, _BESIDE)),
    "squat": ((1, _SQUAT_Y), (3, _PUSH)),
    "stretch": ((3, _PUSH),),
}
"""What each adds to the rates and forces of the body: (of the body, of the parts)."""


@dataclass(frozen=True)
class Readings:
    """What a device reads for some parameters.

    Attributes
    ----------
    by : dict
        The parameters.
    told : list of (float, ndarray)
        What the way says (b * FINE, 3) at each time after the stamps that a channel shows.
    parts : list of (ndarray (5,), ndarray (b, 10))
        For each of these, which channels show it, and the means over blocks of what a body feels.
    plain : ndarray (b, 5)
        Readings without gains of single channels, and without bias.
    expected : ndarray (b, 5)
        Readings.
    then : Readings, optional
        What it reads from `Ride.then` on, where something changes; ``expected`` holds that already.
    """

    by: Mapping[str, float]
    told: list[tuple[float, FloatArray]]
    parts: list[tuple[np.ndarray, FloatArray]]
    plain: FloatArray
    expected: FloatArray
    then: "Readings | None" = None


def expected(ride: Ride, x: FloatArray) -> FloatArray:
    """Means of the five channels (b, 5) that parameters (len(GLOBALS),) let expect."""
    return readings(ride, x).expected


def readings(ride: Ride, x: FloatArray, told: list[tuple[float, FloatArray]] | None = None) -> Readings:
    """What a device reads.

    Parameters
    ----------
    ride : Ride
        The blocks.
    x : ndarray (len(GLOBALS),)
        Parameters.
    told : list of (float, ndarray), optional
        What the way says, from parameters with the same clocks.
    """
    here = _steady(ride, x, told)
    if ride.then is None:
        return here
    then = _steady(ride, after(ride, x), told if x[INDEX["then_offset"]] == 0.0 else None)
    joined = np.concatenate([here.expected[: ride.then], then.expected[ride.then :]])
    return replace(here, expected=joined, then=then)


def _steady(ride: Ride, x: FloatArray, told: list[tuple[float, FloatArray]] | None) -> Readings:
    """What a device reads if nothing changes within the ride."""
    by, later = dict(zip(GLOBALS, x.tolist(), strict=True)), laters(x)
    if told is None:
        told = [(seconds, when_of(ride, x, later_s=seconds)) for seconds in sorted(set(later.tolist()))]
    turn, turn_gyro = _turns(by)[0], _turns_gyro(by)[0]
    plain, parts = np.empty((len(ride.measured), CHANNELS)), []
    for seconds, said in told:
        channels = later == seconds
        part = _parts(ride, x, by, said)
        plain[:, channels] = _device(_body(part, by), turn, turn_gyro, by)[:, channels]
        parts.append((channels, part))
    gains = x[[INDEX[name] for name in GAINS]]
    grown = x[[INDEX[name] for name in RAMPS]] * _share(ride)[:, None]
    return Readings(by, told, parts, plain, plain * gains + grown + x[-CHANNELS:])


def slopes(ride: Ride, x: FloatArray, here: Readings, solved_for: IntArray) -> FloatArray:
    """Slopes (b, 5, len(GLOBALS)) of the readings by what is solved for; others may be missing.

    Parameters
    ----------
    ride : Ride
        The blocks.
    x : ndarray (len(GLOBALS),)
        Parameters.
    here : Readings
        Of these.
    solved_for : ndarray (m,)
        Which of them.
    """
    found = _slopes(ride, x, here, {GLOBALS[i] for i in solved_for})
    if ride.then is None or here.then is None:
        return found
    first, wanted = ride.then, {GLOBALS[i] for i in solved_for}
    found[first:] = _slopes(ride, after(ride, x), here.then, wanted)[first:]
    for name, of in THEN.items():
        found[first:, :, INDEX[name]] = found[first:, :, INDEX[of]]
    found[first:, :, INDEX["then_wheel"]] -= way_then(ride, x) * found[first:, :, INDEX["shift"]]
    return found


def _slopes(ride: Ride, x: FloatArray, here: Readings, wanted: set[str]) -> FloatArray:
    """Slopes (b, 5, len(GLOBALS)) if nothing changes within the ride."""
    steady = _steady(ride, x, here.told).expected if ride.then is not None else here.expected
    found = np.zeros((*here.plain.shape, len(GLOBALS)))
    by = here.by
    gains = x[[INDEX[name] for name in GAINS]]
    for channels, part in here.parts:
        for name, values in _linear(part, by, wanted):
            found[:, channels, INDEX[name]] = (values * gains)[:, channels]
    for name, step in STEPS.items():
        if name in wanted or name == "offset":
            other = x.copy()
            other[INDEX[name]] += step
            told = None if name == "offset" else here.told
            found[:, :, INDEX[name]] = (_steady(ride, other, told).expected - steady) / step
    # What a clock of one sensor does, another's does the other way; and a drift is an offset that grows.
    earlier, middles = found[:, :, INDEX["offset"]], ride.fine_s[FINE // 2 :: FINE] - ride.middle_s
    found[:, :, INDEX["drift"]] = earlier * middles[:, None]
    found[:, : GYRO_Z + 1, INDEX["gyro_offset"]] = -(1.0 - by["drift"]) * earlier[:, : GYRO_Z + 1]
    for channel, (gain, late) in enumerate(zip(GAINS, LATES, strict=True)):
        found[:, channel, INDEX[gain]] = here.plain[:, channel]
        found[:, channel, INDEX[late]] = -(1.0 - by["drift"]) * earlier[:, channel]
        found[:, channel, len(GLOBALS) - CHANNELS + channel] = 1.0
        found[:, channel, INDEX[RAMPS[channel]]] = _share(ride)
    return found


def _share(ride: Ride) -> FloatArray:
    """Share (b,) of the ride that is over."""
    share: FloatArray = (np.arange(len(ride.measured)) + 0.5) / len(ride.measured)
    return share


def _parts(ride: Ride, x: FloatArray, by: Mapping[str, float], told: FloatArray) -> FloatArray:
    """Means over blocks (b, 10) of what a body feels, of what the way says at its times."""
    moved, gravity = motion_of(ride, x, told), ride.recording.gravity_mps2
    line, speed, push = ride.table.at(moved.place_m), moved.speed_mps, moved.acceleration_mps2
    step, square = ride.block_s / FINE / by[PACE], speed**2
    parts = np.empty((len(speed), _PARTS))
    parts[:, _TURN : _TURN + 3] = speed[:, None] * line[:, K1 : K3 + 1]
    beside = square * line[:, K3] + gravity * line[:, LEVEL]
    parts[:, _LEAN_X] = np.gradient(beside, gravity * step)
    parts[:, _LEAN_Y] = beside / gravity * parts[:, _TURN + 2]
    parts[:, _SQUAT_Y] = np.gradient(push, -gravity * step)
    parts[:, _PUSH], parts[:, _ALONG], parts[:, _BESIDE] = push, gravity * line[:, ALONG], beside
    parts[:, _UP] = gravity * line[:, UP] - square * line[:, K2]
    for name, which in zip(SLOW, (slice(0, _PUSH), slice(_PUSH, _PARTS)), strict=True):
        if by[name] > 0.0:
            parts[:, which] = _low_pass(parts[:, which], by[name] / ride.block_s * FINE)
    for name, which in zip(CUTS, (slice(0, _PUSH), slice(_PUSH, _PARTS)), strict=True):
        if by[name] > 0.0:
            parts[:, which] -= _low_pass(parts[:, which], FINE / (by[name] * ride.block_s))
    means: FloatArray = parts.reshape(-1, FINE, _PARTS).mean(axis=1)
    return means


def _low_pass(values: FloatArray, samples: float) -> FloatArray:
    """Signals (n, m) behind a low-pass of the first order, of a time constant in samples."""
    decay = np.exp(-1.0 / samples)
    passed: FloatArray = lfilter([1.0 - decay], [1.0, -decay], values, axis=0, zi=decay * values[:1])[0]
    return passed


def _body(part: FloatArray, by: Mapping[str, float]) -> FloatArray:
    """Rates and forces (b, 6) of the body."""
    body = np.empty((len(part), _BODY))
    body[:, :3] = part[:, _TURN : _TURN + 3]
    body[:, 3] = part[:, _PUSH] + part[:, _ALONG]
    body[:, 4], body[:, 5] = part[:, _BESIDE], part[:, _UP]
    for name, added in _SPRINGS.items():
        for to, of in added:
            body[:, to] += by[name] * part[:, of]
    return body


def _turns(by: Mapping[str, float]) -> FloatArray:
    """Rotation of the device (3, 3), and its slopes by its three angles, as (4, 3, 3)."""
    angles = np.array([by[name] for name in _ANGLES])
    found = rotation_matrix(angles + TURN_STEP_RAD * np.vstack([np.zeros(3), np.eye(3)]))
    found[1:] = (found[1:] - found[0]) / TURN_STEP_RAD
    return found


def _turns_gyro(by: Mapping[str, float]) -> FloatArray:
    """The same of the gyro, whose angles may be others than the accelerometer's."""
    return _turns({angle: by[angle] + by[own] for angle, own in zip(_ANGLES, TURNS, strict=True)})


def _device(body: FloatArray, turn: FloatArray, turn_gyro: FloatArray, by: Mapping[str, float]) -> FloatArray:
    """Readings (b, 5) of what a body does (b, 6), in the axes of a device."""
    read = np.empty((len(body), CHANNELS))
    read[:, :FORCE_X] = by["gyro"] * (body[:, :3] @ turn_gyro)
    read[:, FORCE_X:] = by[ACCEL_GAIN] * (body[:, _FORCE] @ turn[:, :2])
    return read


def _linear(part: FloatArray, by: Mapping[str, float], wanted: set[str]) -> list[tuple[str, FloatArray]]:
    """Slopes (b, 5) by what the means over blocks are linear in, without gains of single channels."""
    body, (turn, *turned), (turn_gyro, *turned_gyro) = _body(part, by), _turns(by), _turns_gyro(by)
    found = [
        (name, _device(body, other, other_gyro, by))
        for name, other, other_gyro in zip(_ANGLES, turned, turned_gyro, strict=True)
    ]
    for name, other in zip(TURNS, turned_gyro, strict=True):
        if name in wanted:
            one = np.zeros((len(body), CHANNELS))
            one[:, :FORCE_X] = _device(body, turn, other, by)[:, :FORCE_X]
            found.append((name, one))
    for name, added in _SPRINGS.items():
        more = np.zeros_like(body)
        for to, of in added:
            more[:, to] = part[:, of]
        found.append((name, _device(more, turn, turn_gyro, by)))
    for name, which in (("gyro", slice(0, FORCE_X)), (ACCEL_GAIN, slice(FORCE_X, CHANNELS))):
        if name in wanted:
            one = np.zeros((len(body), CHANNELS))
            one[:, which] = _device(body, turn, turn_gyro, {"gyro": 1.0, ACCEL_GAIN: 1.0})[:, which]
            found.append((name, one))
    return found
