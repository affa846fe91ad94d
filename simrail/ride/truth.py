"""What happened: the motion of every body of the vehicle, as the engine that ran computed it.

A `Truth` holds, at the engine's output rate, position, velocity, acceleration, attitude, angular rate
and angular acceleration of each body, the wheel rotations and the creep states. The motion of any
mount follows from them by rigid-body kinematics, exactly; no engine is asked again. Where a ride has
vibration, its linear short-wave part is kept apart (`Truth.short_waves`) and added there.

Nothing here is seen by an estimator.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from simrail.core.columns import CONTACT, MOTION
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.shown import Facts, Shown, names
from simrail.core.turning import turning_rows
from simrail.ride.mount_motion import Remembered, mount_motion
from simrail.ride.vibration.short_waves import ShortWaves, superposed
from simrail.track.design import TrackDesign

BODY_ARRAYS = ("position", "velocity", "acceleration", "angles", "rate", "angular_acceleration")
"""Fields of `BodyMotion` with a row for each sample; in this order they are columns on disk."""


@dataclass(frozen=True)
class Mount:
    """Where a sensor sits.

    Attributes
    ----------
    name : str
        Name of the sensor.
    body : str
        Body that carries it.
    position_m : tuple of float
        (x, y, z) when the vehicle stands centred on level track: x forward from the body's centre of
        gravity, y left of the track centre, z above the rail plane.
    roll_rad, pitch_rad, yaw_rad : float
        Misalignment: ZYX angles of the sensor axes in the body axes.
    """

    name: str
    body: str
    position_m: tuple[float, float, float]
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0


@dataclass(frozen=True)
class BodyMotion:
    """Motion of one body's centre of gravity; n samples.

    Attributes
    ----------
    offset_m : float
        Nominal distance of the centre of gravity ahead of the vehicle's reference point.
    height_m : float
        Its nominal height above the rail plane.
    position, velocity, acceleration : ndarray (n, 3)
        In the global frame; m, m/s, m/s2 (gravity not included).
    angles : ndarray (n, 3)
        Roll, pitch, yaw (ZYX Euler, yaw unwrapped), rad.
    rate, angular_acceleration : ndarray (n, 3)
        Angular rate and its derivative, body components; rad/s, rad/s2.
    """

    offset_m: float
    height_m: float
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    angles: FloatArray
    rate: FloatArray
    angular_acceleration: FloatArray


@dataclass(frozen=True, repr=False)
class Truth(Shown):
    """Motion of a vehicle over a ride.

    Attributes
    ----------
    time_s : ndarray (n,)
        Uniform, from 0, at the engine's output rate.
    track : TrackDesign
        The design track.
    reference_position_m : ndarray (n,)
        Where the driver wants the vehicle's reference point, s along the track; where its wheels drive it,
        where it is.
    bodies : dict of str to BodyMotion
        By body name.
    wheel_angles : dict of str to ndarray (n,)
        Rotation of each wheel relative to its axle box, rad, positive forward, 0 at the start.
    wheel_states : dict of str to ndarray (n, m)
        What the contact of each wheel remembered (creep states), where the engine has a contact.
    wheel_radius_m : dict of str to float
        Nominal radius of each wheel.
    gravity_mps2 : float
        Gravity.
    manifest : dict
        Engine, step, versions, wall time, real-time factor, vehicle; plain JSON values.
    contacts : dict of str to ndarray (k, 12)
        Forces and contact of each wheel, columns `simrail.core.columns.CONTACT`, if the ride kept them.
    contact_every : int
        Rows from one of them to the next: they belong to ``time_s[::contact_every]``.
    axle_offsets_m : dict of str to float
        How far each axle is ahead of the vehicle's reference point, where not all axles are among `bodies`.
    short_waves : ShortWaves, optional
        Motion and loads by short waves, which neither `bodies` nor `contacts` hold; None without vibration.
    """

    time_s: FloatArray
    track: TrackDesign
    reference_position_m: FloatArray
    bodies: dict[str, BodyMotion]
    wheel_angles: dict[str, FloatArray]
    wheel_states: dict[str, FloatArray]
    wheel_radius_m: dict[str, float]
    gravity_mps2: float
    manifest: dict[str, Any]
    contacts: dict[str, FloatArray] = field(default_factory=dict)
    contact_every: int = 1
    axle_offsets_m: dict[str, float] = field(default_factory=dict)
    short_waves: ShortWaves | None = None
    _remembered: Remembered = field(default_factory=Remembered, init=False, repr=False, compare=False)

    def _facts(self) -> Facts:
        way, seconds = self.reference_position_m, self.time_s[-1] - self.time_s[0]
        fastest = float(np.abs(self._speeds[0]).max())
        facts = {
            "time": f"{seconds:.1f} s at {self.rate_hz:g} Hz, {len(self.time_s):,} samples",
            "way": f"s = {way[0]:.1f} to {way[-1]:.1f} m, up to {3.6 * fastest:.0f} km/h",
            "bodies": names(self.body_names, most=8),
            "wheels": names(self.wheel_names, most=8),
            "holds": "contact forces" * bool(self.contacts)
            + ", " * bool(self.contacts and self.short_waves)
            + "vibration" * (self.short_waves is not None)
            or "neither contact forces nor vibration",
        }
        return f"{self.manifest.get('vehicle', 'of a ride')} on {self.track.name}", facts

    @property
    def rate_hz(self) -> float:
        """Output rate of the engine."""
        return float(round((len(self.time_s) - 1) / (self.time_s[-1] - self.time_s[0]), 6))

    @property
    def body_names(self) -> list[str]:
        """Names of the bodies that can carry a mount."""
        return list(self.bodies)

    @property
    def wheel_names(self) -> list[str]:
        """Names of the wheels that can carry an encoder."""
        return list(self.wheel_angles)

    def wheel_angle(self, wheel: str) -> FloatArray:
        """Rotation (n,) of a wheel relative to its axle box, rad; see `wheel_angles`."""
        if wheel not in self.wheel_angles:
            raise InputError(
                "the ride has no such wheel", field="wheel", value=wheel, limit=", ".join(self.wheel_names)
            )
        return self.wheel_angles[wheel]

    def contact(self, wheel: str) -> pd.DataFrame:
        """Forces between a wheel and its rail, and where they touch, as the engine that ran had them.

        Parameters
        ----------
        wheel : str
            Name of the wheel, or its place as in `wheel_at`.

        Returns
        -------
        pandas.DataFrame
            Indexed by ``time_s``, columns `simrail.core.columns.CONTACT`: forces on the wheel; Q, Y and s in
            the track frame at its axle, creep forces and creepages in the contact's plane. Where two patches
            touch, forces are of both, and creepages, place and angle of the one that carries more.
            Where none does, all but ``position_m`` is 0. With vibration, the forces hold what the engine
            computed, longer waves only (``attrs["waves_above_m"]``); `short_wave_load` has the rest of Q.

        Raises
        ------
        InputError
            If there is no such wheel, or the ride kept no contact.
        """
        name = self.wheel_at(wheel)
        # Of a long ride forces are kept of every wheel, angles of some.
        known = list(self.contacts) or self.wheel_names
        if name not in known:
            raise InputError(
                "the vehicle has no such wheel", field="wheel", value=wheel, limit=", ".join(known)
            )
        if name not in self.contacts:
            raise InputError(
                "this ride kept no forces between wheels and rails",
                field="contact_rate_hz",
                value=0.0,
                remedy="set contact_rate_hz, e.g. to 200.0; the kinematic engine has no forces",
                limit="> 0 Hz",
            )
        index = pd.Index(self.time_s[:: self.contact_every], name="time_s")
        frame = pd.DataFrame(np.array(self.contacts[name]), index=index, columns=list(CONTACT))
        if self.short_waves is not None:
            frame.attrs["waves_above_m"] = self.short_waves.longest_wave_m
        return frame

    def short_wave_load(self, wheel: str) -> FloatArray:
        """Vertical load (k,) of a wheel by short waves, N, at the times of `contact`; 0 without vibration.

        It is linear: where it takes off more than the wheel's load, the wheel would leave the rail.
        """
        name = self.wheel_at(wheel)
        if self.short_waves is None:
            return np.zeros(len(self.contact(wheel)))
        return np.array(self.short_waves.loads[name], dtype=np.float64)

    def body(self, name: str, *, ahead_m: float = 0.0, rows: slice = slice(None)) -> BodyMotion:
        """Motion of a body at some samples with its short-wave part, as felt ahead of its centre of gravity.

        The place matters for a body that bends alone: there its motion is that of a rigid body that moves as
        that part of it does.

        Raises
        ------
        InputError
            If the ride has no such body.
        """
        body = self._engine_motion(name)
        body = replace(body, **{field: getattr(body, field)[rows] for field in BODY_ARRAYS})
        if self.short_waves is None:
            return body
        places = self.reference_position_m[rows] + body.offset_m
        frame = self.track.frame(np.clip(places, self.track.start_m, self.track.end_m))
        return superposed(body, self.short_waves.of(name, ahead_m, rows), frame, *self._speeds[:, rows])

    def _engine_motion(self, name: str) -> BodyMotion:
        """What the engine computed of a body."""
        if name not in self.bodies:
            raise InputError(
                "the ride has no such body", field="body", value=name, limit=", ".join(self.body_names)
            )
        return self.bodies[name]

    @property
    def _speeds(self) -> FloatArray:
        """Speed of the reference point and its rate, (2, n)."""
        speeds = self._remembered.get("speeds")
        if speeds is None:
            speed = np.gradient(self.reference_position_m, self.time_s)
            speeds = np.stack([speed, np.gradient(speed, self.time_s)])
            self._remembered.keep("speeds", speeds)
        return speeds

    def wheel_at(self, place: str) -> str:
        """Name of a wheel from its place in the direction of travel, e.g. ``"trailing.left"``.

        The direction is that in which the ride begins. Names of wheels are returned as they are. Left and
        right stay those of increasing s.
        """
        where, _, side = place.partition(".")
        if where not in ("leading", "trailing"):
            return place
        axles = {wheel.split(".")[0] for wheel in self.wheel_angles if wheel.endswith("." + side)}
        turns = self.turning_rows
        forward = self.reference_position_m[turns[1]] >= self.reference_position_m[0]
        pick = max if (where == "leading") == bool(forward) else min
        offsets = self.axle_offsets_m or {name: body.offset_m for name, body in self.bodies.items()}
        axle = pick(axles, key=lambda name: offsets[name], default=where)
        return f"{axle}.{side}"

    @property
    def turning_rows(self) -> list[int]:
        """Samples where the ride begins, where it turns back, and where it ends."""
        return turning_rows(self.reference_position_m, step=max(1, round(0.1 * self.rate_hz)))

    def motion(
        self, mount: Mount, rows: range | None = None, columns: Sequence[str] = MOTION
    ) -> pd.DataFrame:
        """Motion of a mount by rigid-body kinematics.

        It is worked out once for each place, rows and columns: what was asked for last is remembered, up to
        256 MB. A truth must not be written to.

        Parameters
        ----------
        mount : Mount
            Where, and on which body.
        rows : range, optional
            Numbers of the samples wanted; all by default. A row has the same bits in any company.
        columns : sequence of str
            Columns of `simrail.core.columns.MOTION` that are wanted. Those that do not speak of the track
            (up to ``accel_*``) are much the cheaper ones.

        Returns
        -------
        pandas.DataFrame
            Indexed by ``time_s``; not to be written to. ``gyro_*`` and ``accel_*`` are what
            a perfect IMU at the mount would feel: C^T omega and C^T (a + g e_z). ``position_m``,
            ``speed_mps`` and ``acceleration_mps2`` are s, ds/dt and d2s/dt2 of the point of the track
            frame abeam of the mount, ``lateral_m`` and ``vertical_m`` its place in that frame.

        Raises
        ------
        InputError
            If the vehicle has no such body.
        """
        self._engine_motion(mount.body)
        wanted = range(len(self.time_s)) if rows is None else rows
        # The name of a mount moves nothing: IMUs of any name in one place share its motion.
        key = replace(mount, name=""), wanted, tuple(columns)
        data = self._remembered.get(key)
        if data is None:
            data = mount_motion(self, mount, wanted, columns)
            data.flags.writeable = False
            self._remembered.keep(key, data)
        index = pd.Index(self.time_s[wanted.start : wanted.stop : wanted.step], name="time_s")
        return pd.DataFrame(data, index=index, columns=list(columns), copy=False)
