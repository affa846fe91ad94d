"""What every engine of motion shares: what it is given, where it starts, which rows it puts out, how it ends.

An engine integrates the equations of motion step by step. What it says of the ride, and when, is decided
here, once: output rows, accelerations from the velocities, wheel loads, derailment. Not here: the
equations (`simrail.vehicle.engines.forces`) and how they are integrated.

Accelerations are the sixth-order central differences of the engine's own velocities at its steps. The
accelerations of the states themselves differ from the motion by the integrator's error, which the
stiff contact makes systematic (2e-4 m/s2 in a sharp curve at 0.5 ms: 0.4 m in a minute of dead
reckoning); the velocities are three orders better, and one evaluation in five is saved.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from simrail.core.jit import FloatArray
from simrail.core.rotation import euler_angles, rotation_matrix
from simrail.track.laid_track import LaidTrack
from simrail.vehicle.contact.contact_tables import rest_drops_m
from simrail.vehicle.engines.force_data import ForceData, Memory, memory_of, pack
from simrail.vehicle.engines.records import RecordArray
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.speed_profile import SpeedProfile

_DIFFERENCE = (45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0)
_REACH = len(_DIFFERENCE)

HALTS = (0.205, 0.3475, 0.4425, 0.5175, 0.58, 0.615, 0.6325)
"""Shares of what is left of the settling after which all that moves is stopped; see `settled`."""


@dataclass(frozen=True)
class Setup:
    """What an engine is given: one vehicle on one laid track, and how it is to run there.

    Attributes
    ----------
    model : VehicleModel
        The vehicle.
    track : LaidTrack
        The track.
    profile : SpeedProfile
        How it is driven.
    step_s : float
        Step of the integrator.
    rate_hz : float
        Output rate; its period must be a multiple of the step.
    gravity_mps2 : float
        Gravity.
    settle_s : float
        Time at rest before the ride, in which the springs come to rest; not part of the output.
    drive : {"guide", "wheels"}
        Whether the guide pulls the vehicle along or its wheels drive and brake it.
    """

    model: VehicleModel
    track: LaidTrack
    profile: SpeedProfile
    step_s: float = 0.5e-3
    rate_hz: float = 1000.0
    gravity_mps2: float = 9.81
    settle_s: float = 4.0
    drive: Literal["guide", "wheels"] = "guide"

    @property
    def every(self) -> int:
        """Steps from one output row to the next."""
        return round(1.0 / (self.rate_hz * self.step_s))

    def pack(self) -> ForceData:
        """The arrays that the force kernel takes; see `simrail.vehicle.engines.force_data.pack`."""
        return pack(self.model, self.track, self.profile, gravity_mps2=self.gravity_mps2, drive=self.drive)


@dataclass(frozen=True)
class Segment:
    """Output of one stretch of the simulation: n rows at the output rate, b bodies, p spins.

    Attributes
    ----------
    time_s : ndarray (n,)
        Times, uniform.
    position, velocity, acceleration : ndarray (n, b, 3)
        Of the centres of gravity, global axes.
    rotation : ndarray (n, b, 3, 3)
        From body axes to global ones.
    rate, angular_acceleration : ndarray (n, b, 3)
        Angular rate and its derivative, body axes.
    spin_rad : ndarray (n, p)
        Angle that each spin has turned about its axle, absolute.
    states : ndarray (n, k)
        First-order states, the four creep states of every wheel at first.
    contacts : ndarray of records (n, w)
        `simrail.vehicle.contact.contact.CONTACT` of each wheel.
    """

    time_s: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    rotation: FloatArray
    rate: FloatArray
    angular_acceleration: FloatArray
    spin_rad: FloatArray
    states: FloatArray
    contacts: RecordArray

    def body(self, index: int) -> FloatArray:
        """Motion (n, 18) of one body: the columns of `simrail.ride.truth.BODY_ARRAYS`."""
        return np.hstack(
            [
                self.position[:, index],
                self.velocity[:, index],
                self.acceleration[:, index],
                euler_angles(self.rotation[:, index]),
                self.rate[:, index],
                self.angular_acceleration[:, index],
            ]
        )


def start_poses(setup: Setup) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Position (3,) and rotation (3, 3) of each body at rest at the profile's start, on the rails there.

    A body stands as an axle would at its place: over the middle of the rails, and leaning with them.
    Dropped onto irregular rails instead, wheels would bounce for seconds.
    """
    model, track = setup.model, setup.track
    drops = rest_drops_m(model, gravity_mps2=setup.gravity_mps2)
    half = model.wheel_rail.tape_circle_half_m
    for body, drop in zip(model.bodies, drops, strict=True):
        s = np.array([setup.profile.start_m + body.position_m[0]])
        frame = track.design.frame(s)
        y_left, z_left, y_right, z_right = track.rails(s)[0]
        lean = frame.roll_rad + (z_left - z_right) / (2.0 * half)
        design, rotation = (
            rotation_matrix(np.column_stack([roll, frame.pitch_rad, frame.yaw_rad]))[0]
            for roll in (frame.roll_rad, lean)
        )
        middle = design @ np.array([0.0, 0.5 * (y_left + y_right), 0.5 * (z_left + z_right)])
        offset = np.array([0.0, body.position_m[1], body.position_m[2] + drop])
        yield frame.position[0] + middle + rotation @ offset, rotation


def start_memory(setup: Setup) -> Memory:
    """Memory of the force kernel at the start: every axle looks for its place on the track from here."""
    model, start_m = setup.model, setup.profile.start_m
    memory = memory_of(len(model.axle_names))
    memory.guide_memo["s_m"] = start_m + model.body(model.guide.body).position_m[0]
    memory.axle_memos["s_m"] = [start_m + model.body(name).position_m[0] for name in model.axle_names]
    return memory


def settled(setup: Setup, solve: Callable[[int, int], FloatArray], halt: Callable[[], None]) -> FloatArray:
    """Steps before the start of the ride, of a vehicle that comes to rest where it stands.

    Bodies sway for longer than anybody waits, since a rail that is canted lets them lean further than the
    rails do. So they are stopped now and then on their way (dynamic relaxation): of a deviation in a mode of
    f hertz, cos(2 pi f T) is left after a time T between two stops. Where the settling takes 4 s, the times
    are .82, 1.11, .92, .60, .32, .14 and .06 s, and the product of all is below 1/7 from 0.2 to 3 Hz and
    below 1/4 up to 8 Hz, of a mode without a damper; dampers do the rest.
    """
    first = -max(round(setup.settle_s / setup.step_s), 2 * _REACH)
    for share in HALTS:
        until = round(first * (1.0 - share))
        if first < until < -2 * _REACH:
            solve(first, until)
            halt()
            first = until
    return solve(first, 0)


def stretches(
    setup: Setup,
    solve: Callable[[int, int], FloatArray],
    halt: Callable[[], None],
    rates_of: Callable[[FloatArray], FloatArray],
    *,
    duration_s: float,
    segment_s: float,
) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Solve stretch by stretch, and take the output rows out of the steps.

    Parameters
    ----------
    setup : Setup
        What the engine was given.
    solve : callable
        Given the first and the last step, integrates from the present state, and returns what the
        engine stores at every step, both ends included: (steps + 1, ...). Step 0 is the start of the ride.
    halt : callable
        Stops all bodies and wheels where they are.
    rates_of : callable
        Takes velocities and angular rates (m, b, 6) out of m stored steps.
    duration_s : float
        Length of the ride.
    segment_s : float
        Length of a stretch.

    Yields
    ------
    time_s : ndarray (n,)
    rows : ndarray (n, ...)
        What the engine stored at these times.
    slopes : ndarray (n, b, 6)
        Derivatives of the rates.
    """
    step_s, every = setup.step_s, setup.every
    total = round(duration_s / step_s)
    per_segment = max(every, round(segment_s / step_s) // every * every)
    # Steps at hand, from `first` on; differences reach 3 steps, so rows lag behind the solution, and a few
    # steps are solved beyond the end.
    steps = settled(setup, solve, halt)[-1 - 2 * _REACH :]
    first = 1 - len(steps)
    done = 0
    while done <= total:
        solved = first + len(steps) - 1
        until = min(solved + per_segment, total + every * _REACH)
        steps = np.concatenate([steps, solve(solved, until)[1:]])
        numbers = np.arange(done, min(until - _REACH, total) + 1, every)
        rates = rates_of(steps)
        begin, end = done - first, int(numbers[-1]) - first + 1
        slopes = np.zeros((len(numbers), *rates.shape[1:]))
        for k, weight in enumerate(_DIFFERENCE, start=1):
            slopes += (
                weight / step_s * (rates[begin + k : end + k : every] - rates[begin - k : end - k : every])
            )
        yield np.multiply(numbers, step_s), steps[begin:end:every], slopes
        done = int(numbers[-1]) + every
        keep = done - _REACH - first
        steps, first = steps[keep:], first + keep
