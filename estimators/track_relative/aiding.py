"""What the track-relative smoother takes beside its IMU: one small class for each kind of measurement.

An aiding measurement is z = h(x) + v with v of a known variance R. A class says z and R at the steps of the
filter (`Aiding.rows`) and h as a function of the states, written with `Dual` (`Aiding.shown`): its Jacobian H
follows. The wheel is one of them, so that the filter runs without it; a ride may have any number of each.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
from simrail.estimators.odometry.bogie_delay import BogieDelayOdometry
from simrail.estimators.odometry.zero_velocity_kernel import PITCH
from simrail.estimators.odometry.zero_velocity_kernel import V as SPEED
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.dual import Dual
from simrail.estimators.track_relative.measurement import Pose
from simrail.estimators.track_relative.noise import AXLE, class_of, motion_of

from simrail.core.columns import MAGNETIC, RAIL_DISPLACEMENT
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording

if TYPE_CHECKING:
    from simrail.estimators.track_relative.model import Steps

STANDS_MPS = 0.01
"""Standard deviation of the speed of a train that stands by its IMU: some millimetres are rolled unseen."""

MAGNETIC_SD_RAD, MAGNETIC_S = 0.05, 100.0
"""What iron and currents turn a magnetic heading by, and over how long that hangs together; synthetic."""

ODOMETRY_S = 100.0
"""Over which the errors of an odometry without a wheel hang together: from one stop to the next."""

DELAY_S = 15.0
"""Over which the errors of a speed by the delay between two bogies hang together: half the area under their
autocorrelation, 14 s on eight simulated rides of a metro car and 12.5 s on six of the tests' two bogies."""

FOLLOWS = 2.0
"""Two measurements of which nobody knows how far they hang together are each believed half: by covariance
intersection with equal weights."""


class Rows(NamedTuple):
    """Values and variances, (n, m) each, of m measurements at n steps; infinite where one is not made."""

    values: FloatArray
    variances: FloatArray


class Aiding(Protocol):
    """A kind of measurement."""

    def rows(self, recording: Recording, steps: "Steps", /) -> Rows:
        """What was measured, and how well."""
        ...

    def shown(self, x: list[Dual], pose: Pose, /) -> list[Dual]:
        """What the states, and the body in the map's track by them, say of it."""
        ...


@dataclass(frozen=True)
class WheelWay:
    """The way of an encoder's wheel, to a count."""

    def rows(self, recording: Recording, steps: "Steps") -> Rows:
        """Made wherever the wheel does not slip."""
        assert recording.encoder_sheet is not None
        variance = np.where(steps.slipping, np.inf, recording.encoder_sheet.pulse_m**2 / 12.0)
        return Rows(steps.way[:, None], variance[:, None])

    def shown(self, x: list[Dual], _pose: Pose) -> list[Dual]:
        """`WAY`, m."""
        return [x[at.WAY]]


@dataclass(frozen=True)
class Standstill:
    """A speed of zero where an IMU shows that the train stands: in place of a wheel that does not turn."""

    def rows(self, _recording: Recording, steps: "Steps") -> Rows:
        """Made at rest."""
        variance = np.where(steps.resting, STANDS_MPS**2, np.inf)
        return Rows(np.zeros((len(variance), 1)), variance[:, None])

    def shown(self, x: list[Dual], _pose: Pose) -> list[Dual]:
        """`V`, m/s."""
        return [x[at.V]]


@dataclass(frozen=True)
class OdometryPlace:
    """The place that an odometry found, where the filter has no wheel and linearises about it.

    It is made of the same signals, so that it is believed as much as one that is new every `ODOMETRY_S`, and
    says nothing new of a train that stands.
    """

    def rows(self, _recording: Recording, steps: "Steps") -> Rows:
        """Made while the train runs."""
        sd = steps.odometry[:, 3]
        variance = np.where(steps.resting, np.inf, sd**2 * ODOMETRY_S / steps.dt)
        return Rows(steps.odometry[:, :1], variance[:, None])

    def shown(self, x: list[Dual], _pose: Pose) -> list[Dual]:
        """`S`, m."""
        return [x[at.S]]


@dataclass(frozen=True)
class Odometer:
    """The speed that an odometer shows, with one scale for the whole ride."""

    def rows(self, recording: Recording, steps: "Steps") -> Rows:
        """Each reading is that of the step that ends next."""
        assert recording.odometer is not None and recording.odometer_sheet is not None
        speed = recording.odometer["speed_mps"]
        number, _, _ = _step_after(speed.index.to_numpy(dtype=np.float64), steps)
        return _at_steps(
            number, speed.to_numpy(dtype=np.float64), recording.odometer_sheet.speed_sd_mps, steps
        )

    def shown(self, x: list[Dual], _pose: Pose) -> list[Dual]:
        """V (1 + `SCALE`), m/s."""
        return [x[at.V] + x[at.V] * x[at.SCALE]]


@dataclass(frozen=True, eq=False)
class Fixes:
    """Places along the map: of a satellite receiver, brought to the line, or of balises.

    Attributes
    ----------
    time_s : ndarray (k,)
        Ascending, in the recording's time.
    position_m : ndarray (k,)
        Along the map. The map's own chainage may be off: a fix is of where the train is by the map.
    sd_m : ndarray (k,) or float
        Standard deviation of each.

    Raises
    ------
    InputError
        If the three are not alike long and finite, the times not ascending, or an sd not positive.
    """

    time_s: FloatArray
    position_m: FloatArray
    sd_m: FloatArray | float

    def __post_init__(self) -> None:
        time = np.asarray(self.time_s, dtype=np.float64)
        for name, values in (
            ("position_m", self.position_m),
            ("sd_m", np.broadcast_to(self.sd_m, time.shape)),
        ):
            values = np.asarray(values, dtype=np.float64)
            if values.shape != time.shape or not np.isfinite(values).all():
                raise InputError(
                    "is not one finite value for each time",
                    field=name,
                    value=values.shape,
                    limit=str(time.shape),
                )
        if not (np.isfinite(time).all() and (np.diff(time) > 0.0).all()):
            raise InputError(
                "is not ascending", field="time_s", limit="finite, each later than the one before"
            )
        if not (np.asarray(self.sd_m) > 0.0).all():
            raise InputError("is not positive", field="sd_m", value=float(np.min(self.sd_m)), limit="> 0 m")

    def rows(self, _recording: Recording, steps: "Steps") -> Rows:
        """Each is brought forward to the step that ends next; of several in one step the last counts."""
        time = np.asarray(self.time_s, dtype=np.float64)
        number, last, since = _step_after(time, steps)
        # A step of 32 ms at 80 km/h is 0.7 m.
        run = since * steps.odometry[last, 1]
        return _at_steps(number, np.asarray(self.position_m, dtype=np.float64) + run, self.sd_m, steps)

    def shown(self, x: list[Dual], _pose: Pose) -> list[Dual]:
        """`S`, m."""
        return [x[at.S]]


@dataclass(frozen=True)
class Received:
    """Place and speed of a satellite receiver, as the recording has them.

    A sample is taken by the step that ends after it came, so that a filter looks at nothing later, and is
    brought forward by what the train has run since the moment that it speaks of. The part of its place's
    error that wanders is believed as much as one that is new every two correlation times.
    """

    def rows(self, recording: Recording, steps: "Steps") -> Rows:
        """Made where there is a sample of either."""
        frame, sheet = recording.gnss, recording.gnss_sheet
        if frame is None or sheet is None:
            raise _lacking(
                "satellite receiver",
                field="gnss",
                limit="a recording with place or speed by satellite",
                add="[gnss] to the scenario or the ride file",
            )
        time = frame.index.to_numpy(dtype=np.float64)
        number, last, since = _step_after(time, steps)
        since += sheet.latency_s
        speed, acceleration = steps.odometry[last, 1], steps.odometry[last, 2]
        counts = max(1.0, 2.0 * sheet.correlation_s * sheet.rate_hz)
        sds = (
            math.hypot(sheet.position_sd_m * math.sqrt(counts), sheet.position_noise_m),
            sheet.speed_sd_mps,
        )
        moved = (since * (speed - 0.5 * since * acceleration) - sheet.ahead_m, since * acceleration)
        both = []
        for name, sd, more in zip(("position_m", "speed_mps"), sds, moved, strict=True):
            values = frame.get(name)
            seen = np.full(len(time), np.nan) if values is None else values.to_numpy(dtype=np.float64)
            both.append(_at_steps(number, seen + more, sd, steps))
        return Rows(np.hstack([rows.values for rows in both]), np.hstack([rows.variances for rows in both]))

    def shown(self, x: list[Dual], _pose: Pose) -> list[Dual]:
        """`S`, m, and `V`, m/s."""
        return [x[at.S], x[at.V]]


@dataclass(frozen=True)
class SecondImuSpeed:
    """The speed by the delay between two IMUs on two bogies.

    That of the causal odometry (`simrail.estimators.odometry.bogie_delay`), wherever a delay was believed:
    not while the train stands or crawls, nor where both bogies do not feel the same. It is brought forward
    to the step that ends next. Its place is not taken: the error of that adds up.

    What that odometry reckons between two delays is made of the first IMU's signals, as this filter is. So
    it is believed as much as one that is new every two `DELAY_S`, which is as long as its errors last.
    """

    def rows(self, recording: Recording, steps: "Steps") -> Rows:
        """Made where a delay was believed."""
        if recording.second_imu is None or recording.second_imu_sheet is None:
            raise _lacking(
                "second IMU",
                field="second_imu",
                limit="an IMU on another bogie",
                add="[second_imu] to the scenario or the ride file",
            )
        method = BogieDelayOdometry()
        trace = method.trace(recording)
        assert trace.heard is not None
        (heard,) = np.nonzero(trace.heard.searches[:, 0] == 1.0)
        time, states = trace.time_s[heard], trace.found.states[heard]
        number, last, since = _step_after(time, steps)
        run = since * steps.odometry[last, 2]
        sd = np.sqrt(trace.found.covariances[heard, SPEED, SPEED])
        shared = max(1.0, 2.0 * DELAY_S / method.every_s)
        speed = states[:, SPEED] * np.cos(states[:, PITCH]) + run
        return _at_steps(number, speed, sd * math.sqrt(shared), steps)

    def shown(self, x: list[Dual], _pose: Pose) -> list[Dual]:
        """`V`, m/s."""
        return [x[at.V]]


@dataclass(frozen=True)
class MagneticHeading:
    """How far a magnetic heading has left the map's since the first rest.

    The level part of the field is found with the map's roll and pitch where the odometry is. What iron turns
    it by all along is taken off as the mean over the rest at the start: a ride that does not begin with one
    has no row. What changes of that is believed as much as what is new every `MAGNETIC_S`.
    """

    def rows(self, recording: Recording, steps: "Steps") -> Rows:
        """Made from the first step on in which the train runs."""
        field, sheet = recording.magnetometer, recording.magnetometer_sheet
        if field is None or sheet is None:
            raise _lacking(
                "magnetometer",
                field="magnetometer",
                limit="a recording with a magnetometer",
                add="a [magnetometer] to the scenario or the ride file",
            )
        n = len(steps.time_s)
        out = Rows(np.zeros((n, 1)), np.full((n, 1), math.inf))
        running = np.flatnonzero(~steps.resting)
        if len(running) == 0 or running[0] == 0:
            return out
        block = round(steps.dt * recording.imu_sheet.rate_hz)
        samples = field[list(MAGNETIC)].to_numpy(dtype=np.float64)[: n * block]
        x, y, z = samples.reshape(n, block, 3).mean(axis=1).T
        track = recording.track
        frame = track.frame(np.clip(steps.odometry[:, 0], track.start_m, track.end_m))
        (sr, cr), (sp, cp) = ((np.sin(a), np.cos(a)) for a in (frame.roll_rad, frame.pitch_rad))
        across = sr * y + cr * z
        ahead, aside = cp * x + sp * across, cr * y - sr * z
        away = sheet.north_rad - np.arctan2(aside, ahead) - frame.yaw_rad
        first = running[0]
        start = math.atan2(np.sin(away[:first]).mean(), np.cos(away[:first]).mean())
        level = sheet.intensity_t * math.cos(sheet.inclination_rad)
        white = sheet.noise_tpsqrthz / level
        variance = (white**2 + 2.0 * MAGNETIC_SD_RAD**2 * MAGNETIC_S) / steps.dt
        turned = frame.rates[:, 2] * steps.odometry[:, 3]
        out.values[:, 0] = np.angle(np.exp(1j * (away - start)))
        out.variances[first:, 0] = variance + (turned[first:] ** 2) * ODOMETRY_S / steps.dt
        return out

    def shown(self, x: list[Dual], _pose: Pose) -> list[Dual]:
        """`HEADING` and `YAW`, rad."""
        return [x[at.HEADING] + x[at.YAW]]


@dataclass(frozen=True)
class SeenRails:
    """How a body rolls and where it is in its track, by a sensor that sees both rails from it.

    With u_l and u_r the rails seen from the mount and p its place in the track, the rails stand at p + A u
    (`simrail.estimators.trajectory.track_geometry`). On rails without irregularities

        roll = atan2(u_r,z - u_l,z, u_l,y - u_r,y),      p = -A (u_l + u_r) / 2

    of the medians over a step, which leave outliers aside. What irregularities add is a process over the
    distance: as white noise that tells as much of what is slow it has the variance c sd^2 length / way, with
    c = 4/sqrt(3) of a Matern 3/2 process and 16/(3 sqrt(5)) of a Matern 5/2, and a train that stands learns
    nothing. Sizes are those by which the mount moves in its track
    (`simrail.estimators.track_relative.noise`), which rails are not rougher than. In long waves a body
    follows the rails, so that its motion and this noise are one and not two: each is believed half
    (`FOLLOWS`). An axle stands on the rails and sees them always alike, which says nothing of it.
    """

    def rows(self, recording: Recording, steps: "Steps") -> Rows:
        """Made while the train runs; on an axle there is none."""
        frame, sheet = recording.rail_displacement, recording.rail_sensor_sheet
        if frame is None or sheet is None:
            raise _lacking(
                "rail sensor",
                field="rail_displacement",
                limit="a recording with both rails as they are seen from the IMU",
                add="[rail_sensor] to the scenario or [rail_displacement] to the ride file",
                option="rail_sensor",
            )
        n, block = len(steps.time_s), round(steps.dt * recording.imu_sheet.rate_hz)
        seen = frame[list(RAIL_DISPLACEMENT)].to_numpy(dtype=np.float64)[: n * block]
        left_y, left_z, right_y, right_z = np.median(seen.reshape(n, block, 4), axis=1).T
        roll = np.arctan2(right_z - left_z, left_y - right_y)
        y, z, c, s = 0.5 * (left_y + right_y), 0.5 * (left_z + right_z), np.cos(roll), np.sin(roll)
        values = np.column_stack([roll, s * z - c * y, -s * y - c * z])
        motion, base = motion_of(recording), recording.track.rail_base_m
        three, five = 4.0 / math.sqrt(3.0), 16.0 / (3.0 * math.sqrt(5.0))
        by_way = FOLLOWS * np.array(
            [
                three * motion.roll_sd**2 * motion.roll_length,
                five * motion.y_sd**2 * motion.y_length,
                five * motion.z_sd**2 * motion.z_length,
            ]
        )
        own = sheet.noise_m**2 / block * np.array([2.0 / base**2, 0.5, 0.5])
        way = np.abs(steps.odometry[:, 1]) * steps.dt
        runs = ~steps.resting & (way > 0.0) & (class_of(recording) is not AXLE)
        variances = np.full((n, 3), math.inf)
        variances[runs] = by_way / way[runs, None] + own
        return Rows(values, variances)

    def shown(self, _x: list[Dual], pose: Pose) -> list[Dual]:
        """Roll beside the track as it lies, rad, and the place in it, m."""
        return [pose.level, pose.y, pose.z]


def _lacking(what: str, *, field: str, limit: str, add: str, option: str = "") -> InputError:
    """Of what an option asks for that is not there; the option's name is the field's if none is given."""
    return InputError(
        f"the recording has no {what}",
        field=field,
        limit=limit,
        remedy=f"add {add}, or set {option or field} = false",
    )


def _step_after(
    time: FloatArray, steps: "Steps"
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], FloatArray]:
    """Number of the step that ends at each time or next after it; that of none beyond the last.

    The same, of none the last; and what goes by from each time to that step's, s.
    """
    number = np.searchsorted(steps.end_s, time - 1e-9)
    last = np.minimum(number, len(steps.time_s) - 1)
    return number, last, steps.time_s[last] - time


def _at_steps(
    number: npt.NDArray[np.int64], values: FloatArray, sd: FloatArray | float, steps: "Steps"
) -> Rows:
    """Rows of values that belong to steps of these numbers."""
    n = len(steps.end_s)
    out = Rows(np.zeros((n, 1)), np.full((n, 1), math.inf))
    made = (number < n) & np.isfinite(values)
    out.values[number[made], 0] = values[made]
    out.variances[number[made], 0] = np.broadcast_to(np.square(sd), values.shape)[made]
    return out


def aiding_of(recording: Recording, *, smoothed: bool) -> tuple[Aiding, ...]:
    """What a recording has beside its IMU."""
    if recording.has_wheel:
        return (WheelWay(),)
    speed: tuple[Aiding, ...] = ()
    if recording.odometer is not None and recording.odometer_sheet is not None:
        speed = (Odometer(),)
    return (Standstill(), *speed) if smoothed else (Standstill(), OdometryPlace(), *speed)
