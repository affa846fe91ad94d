"""What an IMU should show of a body in its track: gyro and accelerometer as functions of the state.

The rigid-body kinematics of paper 001 (section 2; EQUATIONS 1.1, 1.2, 3.2), without its small angles where they cost
something, with the states of `simrail.estimators.track_relative.states`. All is written once, with `Dual`: the
Jacobian follows.

    h_m     = CURVE h - EVEN even - ODD odd                       curvature that the map has not
    q       = V^2 (bend + h_m)/g + lean + cant_m                  cant deficiency over g, over the chord
    cant_m  = CANT share + CANT_ALONG - EVEN even_r - ODD odd_r   roll that the map has not
    rho     = (ROLL + TILT q + cant_m + askew,
               PITCH + SQUAT A/g + LEAD dip + SLOPE + askew,
               YAW - LAG bend + askew)                            body in the map's track
    w       = V k + V h_m e_v,      e_v upwards in track axes
    gyro    = rho(w) + rho_dot + GYRO_BIAS + GYRO_OF_Z w_z
    a       = g e_v + origin + V^2 h_m (e_v x e_x) + Y of_y + Z of_z + 2 w x r_dot + r_ddot
    accel   = rho(a) + ACCEL_BIAS + ACCEL_OF_X a_x + ACCEL_OF_Y a_y

rho(v) is v in the body's axes. The heading that the map has not is in neither: only its rate, V h_m, is.
"""

from typing import NamedTuple

import numpy as np
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.dual import Dual, Vector, cross, turned
from simrail.estimators.track_relative.line import Ground

from simrail.core.jit import FloatArray


class Around(NamedTuple):
    """The trajectory about which everything is linearised, at n steps.

    Attributes
    ----------
    states : ndarray (n, 49)
    jerk : ndarray (n,)
        Slope of the acceleration, m/s3.
    sense : ndarray (n,)
        1, -1: direction of travel.
    nominal : tuple of float
        Place (y, z) of the mount where the vehicle stands centred on level track, m.
    gravity : float
        m/s2.
    in_time : bool
        The roll's derivative is by time, not by distance: a body that sways.
    """

    states: FloatArray
    jerk: FloatArray
    sense: FloatArray
    nominal: tuple[float, float]
    gravity: float
    in_time: bool


class Pose(NamedTuple):
    """The body in the map's track, and what it is made of."""

    rho: Vector
    rho_rate: Vector
    y: Dual
    y_rate: Dual
    y_rate_2: Dual
    z: Dual
    z_rate: Dual
    z_rate_2: Dual
    off_curvature: Dual


def duals(states: FloatArray) -> list[Dual]:
    """Every state as a Dual."""
    one = np.ones(len(states))
    return [Dual(states[:, i], {i: one}) for i in range(states.shape[1])]


def pose_of(x: list[Dual], ground: Ground, around: Around) -> Pose:
    """Where the body is in the map's track, and how that changes with time."""
    v, a, g, sense = x[at.V], x[at.A], around.gravity, around.sense
    # Where the speed multiplies what the body does in the track, it is taken for known: a smoothed motion is smaller
    # than the true one, and the speed would be raised until the product fits.
    run = v.value * sense  # d(distance)/dt
    own = v.value * v.value
    off = x[at.CURVE] * ground.bend - x[at.EVEN] * ground.even - x[at.ODD] * ground.odd
    cant = (
        x[at.CANT] * ground.canted
        + x[at.CANT_ALONG]
        - x[at.EVEN] * ground.even_roll
        - x[at.ODD] * ground.odd_roll
    )
    cant_rate = x[at.CANT] * ground.canted_1 * v + x[at.CANT_ALONG_1] * run
    square = v * v
    q = square * (ground.bend + off) * (1.0 / g) + ground.lean + cant
    turning = 1.0 + x[at.CURVE]
    q_rate = (
        (square * v * ground.bend_1 * turning + 2.0 * (v * a * ground.bend)) * (1.0 / g)
        + v * ground.lean_1
        + cant_rate
    )
    q_rate_2 = (square * square * ground.bend_2 + 5.0 * (square * a * ground.bend_1)) * (1.0 / g) + (
        square * ground.lean_2 + a * ground.lean_1
    )
    rate = 1.0 if around.in_time else run
    behind = x[at.LAG] * (-sense)
    rho = (
        x[at.ROLL] + x[at.TILT] * q + cant + ground.askew_roll,
        x[at.PITCH] + x[at.SQUAT] * a * (1.0 / g) + x[at.LEAD] * ground.dip * (-sense) + x[at.SLOPE] + ground.askew_pitch,
        x[at.YAW] + behind * ground.bend + ground.askew_yaw,
    )
    rho_rate = (
        x[at.ROLL_RATE] * rate + x[at.TILT] * q_rate + cant_rate + v * ground.askew_roll_1,
        x[at.PITCH_RATE] * run
        + x[at.SQUAT] * (around.jerk / g)
        + x[at.LEAD] * v * ground.dip_1 * (-sense)
        + v * ground.askew_pitch_1,
        x[at.YAW_RATE] * run + behind * v * ground.bend_1 + v * ground.askew_yaw_1,
    )
    gain = a.value * sense
    return Pose(
        rho=rho,
        rho_rate=rho_rate,
        y=around.nominal[0] + x[at.Y] + x[at.Y_TILT] * q + x[at.Y_BEND] * ground.bend,
        y_rate=x[at.Y_1] * run + x[at.Y_TILT] * q_rate + x[at.Y_BEND] * v * ground.bend_1,
        y_rate_2=x[at.Y_2] * own
        + x[at.Y_1] * gain
        + x[at.Y_TILT] * q_rate_2
        + x[at.Y_BEND] * (square * ground.bend_2 + a * ground.bend_1),
        z=around.nominal[1] + x[at.Z],
        z_rate=x[at.Z_1] * run,
        z_rate_2=x[at.Z_2] * own + x[at.Z_1] * gain,
        off_curvature=off,
    )


def shown(x: list[Dual], ground: Ground, around: Around) -> list[Dual]:
    """What three gyros and three accelerometers show, rad/s and m/s2."""
    pose = pose_of(x, ground, around)
    v, a, g = x[at.V], x[at.A], around.gravity
    square = v * v
    up = ground.gravity
    off = v * pose.off_curvature
    rate: Vector = tuple(v * k + off * e for k, e in zip(ground.k, up, strict=True))  # type: ignore[assignment]
    # Slope of the track frame's turn: alpha = a k + V^2 k'.
    alpha: Vector = tuple(a * k + square * dk for k, dk in zip(ground.k, ground.dk, strict=True))  # type: ignore[assignment]
    secant = 1.0 / np.cos(ground.pitch)
    stretch = np.tan(ground.pitch) * secant
    away = square * pose.off_curvature
    zero = Dual(np.zeros(len(around.jerk)))
    place: Vector = (zero, pose.y, pose.z)
    moves: Vector = (zero, pose.y_rate, pose.z_rate)
    carried = cross(alpha, place)
    around_axis = cross(rate, cross(rate, place))
    coriolis = cross(rate, moves)
    force = (
        g * up[0] + a * secant + square * ground.pitch_slope * stretch,
        g * up[1] + square * ground.k[2] * secant + away * up[2] + pose.y_rate_2,
        g * up[2] - square * ground.k[1] * secant - away * up[1] + pose.z_rate_2,
    )
    felt: Vector = tuple(
        force[i] + carried[i] + around_axis[i] + 2.0 * coriolis[i] for i in range(3)
    )  # type: ignore[assignment]
    seen = turned(rate, pose.rho)
    gyro = [
        seen[i] + pose.rho_rate[i] + x[at.GYRO_BIAS[i]] + x[at.GYRO_OF_Z[i]] * rate[2] for i in range(3)
    ]
    borne = turned(felt, pose.rho)
    accel = [
        borne[i] + x[at.ACCEL_BIAS[i]] + x[at.ACCEL_OF_X[i]] * borne[0] + x[at.ACCEL_OF_Y[i]] * borne[1]
        for i in range(3)
    ]
    return [*gyro, *accel]


def told(x: list[Dual], ground: Ground, around: Around) -> list[Dual]:
    """What the estimate says: roll, pitch and yaw less those of the map at S, S, V, y and z.

    The angles' values are those of the body's turn out of the map's track; their slopes include that the map
    is read at S.
    """
    pose = pose_of(x, ground, around)
    roll_slope = ground.k[0].value + np.sin(ground.pitch) * ground.k[2].value
    yaw_slope = (
        ground.k[2].value * np.cos(ground.roll) + ground.k[1].value * np.sin(ground.roll)
    ) / np.cos(ground.pitch)
    here = x[at.S] - around.states[:, at.S]
    roll = pose.rho[0] + here * roll_slope
    pitch = pose.rho[1] + here * ground.pitch_slope.value
    yaw = pose.rho[2] + x[at.HEADING] + here * yaw_slope
    return [roll, pitch, yaw, x[at.S], x[at.V], pose.y, pose.z]
