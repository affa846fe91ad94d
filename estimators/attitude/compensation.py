"""Track-frame compensation: what the accelerometer feels of the design track, taken off.

A train that knows where it is on its design track knows the acceleration of the track frame there.
Briales et al. 2021 (paper 000) subtract it from the accelerometer, so that what is left points along
gravity. Used by every attitude estimator, and the only place that evaluates the design track for them.

It assumes that the body's axes are those of the track frame and that the body does not move in it;
what is neglected is the body's own relative motion.
"""

from typing import NamedTuple, Protocol

import numpy as np
from simrail.estimators.attitude.compensation_kernel import (
    MOTION,
    Course,
    force_less_motion,
    frame_motion,
)

from simrail.core.columns import ACCEL, ODOMETRY
from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording, odometry_of, rows_of
from simrail.track.design import Straight, TrackDesign, TrackFrame


class Compensating(Protocol):
    """An attitude estimator that can take the design track's acceleration off the accelerometer."""

    @property
    def compensated(self) -> bool:
        """Whether it does."""
        ...


def needs_of(estimator: Compensating) -> tuple[str, ...]:
    """What it needs beside the IMU: the odometry, for the compensation."""
    return ("odometry",) if estimator.compensated else ()


def role_of(estimator: Compensating) -> str:
    """Under test with compensation; a filter that knows nothing of trains without."""
    return "method" if estimator.compensated else "general_purpose"


def design_frame(recording: Recording) -> TrackFrame:
    """Design track frame at the odometry's positions.

    Positions beyond the track's ends, where an odometry error may put a train that stands at a
    terminus, are taken at the end.

    Returns
    -------
    TrackFrame
        Arrays of one row per sample.
    """
    return _frame(recording, odometry_of(recording)["position_m"].to_numpy(dtype=np.float64))


_LEVEL = TrackDesign("level", 0.0, (Straight(1.0),))


def start_frame(recording: Recording) -> TrackFrame:
    """Design track frame, of one row, where the ride begins: by the odometry, or the platform known.

    Without a map it is level, and yaw counts from there.
    """
    if not recording.track.is_map:
        return _LEVEL.frame(np.zeros(1))
    known = np.array([recording.start_position_m])
    if recording.odometry is not None:
        known = recording.odometry["position_m"].to_numpy(dtype=np.float64)[:1]
    return _frame(recording, known)


def _frame(recording: Recording, position_m: FloatArray) -> TrackFrame:
    return recording.track.frame(_on_map(recording, position_m), places=False)


def _on_map(recording: Recording, position_m: FloatArray) -> FloatArray:
    """Positions, those beyond the ends of the map at its ends.

    Raises
    ------
    InputError
        If one is not a number.
    """
    on_map = recording.track.on_track(np.clip(position_m, recording.track.start_m, recording.track.end_m))
    return np.ascontiguousarray(on_map, dtype=np.float64)


class TrackMotion(NamedTuple):
    """How the track frame moves along with the train, and what that does to what is carried in it; n samples.

    Attributes
    ----------
    rows : ndarray (12, n)
        The four, one row for each of their components.
    """

    rows: FloatArray

    @property
    def origin(self) -> FloatArray:
        """Acceleration of the frame's origin (n, 3), m/s2, components in the track frame."""
        return self.rows[0:3].T

    @property
    def of_y(self) -> FloatArray:
        """What is added per m of y in the frame (n, 3), 1/s2."""
        return self.rows[3:6].T

    @property
    def of_z(self) -> FloatArray:
        """What is added per m of z in the frame (n, 3), 1/s2."""
        return self.rows[6:9].T

    @property
    def rate(self) -> FloatArray:
        """Angular rate of the frame (n, 3), rad/s, its own components."""
        return self.rows[9:12].T


def track_motion(recording: Recording, *, printed: bool = False) -> TrackMotion:
    """Motion of the track frame abeam of the IMU (EQUATIONS 1.1 and 2.1).

    With k the Darboux curvatures of the track frame per metre of horizontal arc length, k' their
    derivative, V = ds/dt and A = dV/dt (both signed), a place r = (0, y, z) that is fixed in the frame has
    the acceleration c = origin + y of_y + z of_z:

        w = V k,   alpha = A k + V^2 k'
        c = (A/cos th + V^2 tan th th'/cos th, V^2 k3/cos th, -V^2 k2/cos th)
            + alpha x r + w x (w x r)

    Running backwards changes nothing but the signs of V and A.

    Parameters
    ----------
    recording : Recording
        Its odometry frame and design track are used; its signals are not.
    printed : bool
        Use paper 000, Eqs. 3-6 as they are printed, to show what it costs: k = (roll', pitch', yaw')
        without the coupling of cant and slope, k' = (0, 0, yaw''), no 1/cos th.
    """
    course = _course(recording, printed=printed)
    rows = np.empty((MOTION, len(course.speed)))
    frame_motion(course, rows)
    return TrackMotion(rows)


def _course(recording: Recording, *, printed: bool) -> Course:
    """What the kernels take of the map and of the odometry."""
    place, speed, rate = rows_of(odometry_of(recording), ODOMETRY)
    return Course(*recording.track.pieces, _on_map(recording, place), speed, rate, printed)


def track_acceleration(recording: Recording, *, printed: bool = False) -> FloatArray:
    """Acceleration of the IMU's nominal place in the moving track frame; see `track_motion`.

    Returns
    -------
    ndarray (n, 3)
        c, m/s2, components in the track frame.
    """
    motion = track_motion(recording, printed=printed)
    _, r_y, r_z = recording.mount_position_m
    return motion.origin + r_y * motion.of_y + r_z * motion.of_z


class GravityForce(NamedTuple):
    """Specific force that is left for gravity, n samples.

    Attributes
    ----------
    force : ndarray (n, 3)
        m/s2, body frame, C-contiguous.
    curves : ndarray (4, n)
        Horizontal curvature of the track, 1/m, its slope, 1/m2, and the same of the vertical one, wherever
        they were met; (4, 0) without compensation.
    """

    force: FloatArray
    curves: FloatArray


def gravity_and_curves(recording: Recording, *, compensated: bool, printed: bool = False) -> GravityForce:
    """`gravity_force`, and of what curves the compensation is made."""
    measured, n = rows_of(recording.imu, ACCEL), len(recording.imu)
    if not compensated:
        return GravityForce(np.column_stack(measured), np.empty((4, 0)))
    found = GravityForce(np.empty((n, 3)), np.empty((4, n)))
    _, r_y, r_z = recording.mount_position_m
    force_less_motion(_course(recording, printed=printed), measured, r_y, r_z, *found)
    return found


def gravity_force(recording: Recording, *, compensated: bool, printed: bool = False) -> FloatArray:
    """Specific force that is left for gravity, z = accelerometer - c (paper 000, Eq. 33).

    Parameters
    ----------
    recording : Recording
        The recording.
    compensated : bool
        False leaves the accelerometer as it is: the general-purpose filter.
    printed : bool
        See `track_acceleration`.

    Returns
    -------
    ndarray (n, 3)
        m/s2, body frame, C-contiguous.
    """
    return gravity_and_curves(recording, compensated=compensated, printed=printed).force
