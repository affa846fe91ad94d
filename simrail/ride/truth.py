"""What happened: the motion of every body of the vehicle, as the engine that ran computed it.

A `Truth` holds, at the engine's output rate, position, velocity, acceleration, attitude, angular rate
and angular acceleration of each body, the wheel rotations and the creep states. The motion of any
mount follows from them by rigid-body kinematics, exactly; no engine is asked again. Where a ride has
vibration, its linear short-wave part is kept apart (`Truth.short_waves`) and added there.

Nothing here is seen by an estimator.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from simrail.core.columns import CONTACT, MOTION
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.rotation import euler_angles, rotation_matrix
from simrail.ride.vibration.short_waves import ShortWaves, superposed
from simrail.track.design import TrackDesign, TrackFrame


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


@dataclass(frozen=True)
class Truth:
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
    short_waves: ShortWaves | None = None

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
                "the vehicle has no such wheel", field="wheel", value=wheel, limit=", ".join(self.wheel_names)
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
        if name not in self.wheel_angles:
            raise InputError(
                "the vehicle has no such wheel", field="wheel", value=wheel, limit=", ".join(self.wheel_names)
            )
        if name not in self.contacts:
            raise InputError(
                "this ride kept no forces between wheels and rails",
                field="contact_rate_hz",
                value=0.0,
                remedy="set contact_rate_hz, e.g. to 200.0; the kinematic engine has no forces",
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

    def body(self, name: str, *, ahead_m: float = 0.0) -> BodyMotion:
        """Motion of a body with its short-wave part, as felt ``ahead_m`` before its centre of gravity.

        The place matters for a body that bends alone: there its motion is that of a rigid body that moves as
        that part of it does.

        Raises
        ------
        InputError
            If the vehicle has no such body.
        """
        if name not in self.bodies:
            raise InputError(
                "the vehicle has no such body", field="body", value=name, limit=", ".join(self.body_names)
            )
        body = self.bodies[name]
        if self.short_waves is None:
            return body
        places = np.clip(self.reference_position_m + body.offset_m, self.track.start_m, self.track.end_m)
        speed = np.gradient(self.reference_position_m, self.time_s)
        return superposed(
            body,
            self.short_waves.of(name, ahead_m),
            self.track.frame(places),
            speed,
            np.gradient(speed, self.time_s),
        )

    def wheel_at(self, place: str) -> str:
        """Name of a wheel from its place in the direction of travel, e.g. ``"trailing.left"``.

        Names of wheels are returned as they are. Left and right stay those of increasing s.
        """
        where, _, side = place.partition(".")
        if where not in ("leading", "trailing"):
            return place
        axles = {wheel.split(".")[0] for wheel in self.wheel_angles if wheel.endswith("." + side)}
        forward = self.reference_position_m[-1] >= self.reference_position_m[0]
        pick = max if (where == "leading") == bool(forward) else min
        axle = pick(axles, key=lambda name: self.bodies[name].offset_m, default=where)
        return f"{axle}.{side}"

    def motion(self, mount: Mount) -> pd.DataFrame:
        """Motion of a mount by rigid-body kinematics.

        Parameters
        ----------
        mount : Mount
            Where, and on which body.

        Returns
        -------
        pandas.DataFrame
            Indexed by ``time_s``, columns `simrail.core.columns.MOTION`. ``gyro_*`` and ``accel_*`` are what
            a perfect IMU at the mount would feel: C^T omega and C^T (a + g e_z). ``position_m``,
            ``speed_mps`` and ``acceleration_mps2`` are s, ds/dt and d2s/dt2 of the point of the track
            frame abeam of the mount, ``lateral_m`` and ``vertical_m`` its place in that frame.

        Raises
        ------
        InputError
            If the vehicle has no such body.
        """
        body = self.body(mount.body, ahead_m=mount.position_m[0])
        rotation = rotation_matrix(body.angles)
        lever = np.asarray(mount.position_m, dtype=np.float64) - np.array([0.0, 0.0, body.height_m])
        omega = body.rate
        arm_velocity = np.cross(omega, lever)
        arm_acceleration = np.cross(body.angular_acceleration, lever) + np.cross(omega, arm_velocity)
        position = body.position + rotation @ lever
        velocity = body.velocity + _rotate(rotation, arm_velocity)
        acceleration = body.acceleration + _rotate(rotation, arm_acceleration)
        felt = acceleration + np.array([0.0, 0.0, self.gravity_mps2])
        misalignment = np.array([[mount.roll_rad, mount.pitch_rad, mount.yaw_rad]])
        tilt = rotation_matrix(misalignment)[0]
        rotation = rotation @ tilt
        guess = self.reference_position_m + body.offset_m + mount.position_m[0]
        frame, speed, speed_rate, beside = _along_track(self.track, guess, position, velocity, acceleration)
        angles = euler_angles(rotation) if np.any(misalignment) else body.angles
        relative = euler_angles(np.swapaxes(frame.rotation, 1, 2) @ rotation)
        data = np.column_stack(
            [
                position,
                velocity,
                angles,
                omega @ tilt,
                _rotate(np.swapaxes(rotation, 1, 2), felt),
                frame.s_m,
                speed,
                speed_rate,
                beside,
                relative,
            ]
        )
        return pd.DataFrame(data, index=pd.Index(self.time_s, name="time_s"), columns=list(MOTION))


def _rotate(rotation: FloatArray, vectors: FloatArray) -> FloatArray:
    rotated: FloatArray = np.einsum("nij,nj->ni", rotation, vectors)
    return rotated


def abeam(
    track: TrackDesign, guess: FloatArray, position: FloatArray
) -> tuple[TrackFrame, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Track frame abeam of points: the one whose plane normal to its X axis holds the point.

    Parameters
    ----------
    track : TrackDesign
        The design.
    guess : ndarray (n,)
        Places s to begin from, within some metres.
    position : ndarray (n, 3)
        The points, global.

    Returns
    -------
    frame : TrackFrame
    rotation : ndarray (n, 3, 3)
        Of the frame.
    rho : ndarray (n, 3)
        The points in it; rho_x = 0, found by Newton's method.
    stretch : ndarray (n,)
        d(rho_x)/ds with the sign turned.
    s : ndarray (n,)
        The places.
    """
    s = guess
    for _ in range(4):
        s = np.clip(s, track.start_m, track.end_m)
        frame = track.frame(s)
        rotation = frame.rotation
        rho = np.einsum("nji,nj->ni", rotation, position - frame.position)
        stretch = 1.0 / np.cos(frame.pitch_rad) - frame.k[:, 2] * rho[:, 1] + frame.k[:, 1] * rho[:, 2]
        step = rho[:, 0] / stretch
        s = s + step
        if np.max(np.abs(step)) < 1e-9:
            break
    return frame, rotation, rho, stretch, s


def _along_track(
    track: TrackDesign,
    guess: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> tuple[TrackFrame, FloatArray, FloatArray, FloatArray]:
    """Track frame abeam of points, with ds/dt, d2s/dt2 and the (lateral, vertical) place in it.

    The rates follow by differentiating the condition of `abeam` (EQUATIONS 1.1).
    """
    frame, rotation, rho, stretch, _ = abeam(track, guess, position)
    v = np.einsum("nji,nj->ni", rotation, velocity)
    a = np.einsum("nji,nj->ni", rotation, acceleration)
    k, dk = frame.k, frame.dk
    y, z = rho[:, 1], rho[:, 2]
    speed = v[:, 0] / stretch
    y_rate = v[:, 1] + speed * k[:, 0] * z
    z_rate = v[:, 2] - speed * k[:, 0] * y
    secant = 1.0 / np.cos(frame.pitch_rad)
    stretch_rate = (
        speed * (np.tan(frame.pitch_rad) * secant * frame.rates[:, 1] - dk[:, 2] * y + dk[:, 1] * z)
        - k[:, 2] * y_rate
        + k[:, 1] * z_rate
    )
    turning = speed * (k[:, 2] * v[:, 1] - k[:, 1] * v[:, 2])
    speed_rate = (a[:, 0] + turning - speed * stretch_rate) / stretch
    return frame, speed, speed_rate, rho[:, 1:]
