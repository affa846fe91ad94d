"""What an IMU should show of a body in its track: gyro and accelerometer as functions of the state.

The rigid-body kinematics of paper 001 (section 2; EQUATIONS 1.1, 1.2, 3.2), without its small angles where
they cost something, with the states of `simrail.estimators.track_relative.states`. All is written once, with
`Dual`: the Jacobian follows.

    h_m     = CURVE h - EVEN even - ODD odd                       curvature that the map has not
    q       = V^2 (bend + h_m)/g + lean + cant_m                  cant deficiency over g, over the chord
    cant_m  = CANT share + CANT_ALONG - EVEN even_r - ODD odd_r   roll that the map has not
    rho     = (ROLL - ROLL_SLOW + TILT q + TILT_RATE q_dot + TORSION twist + cant_m + askew,
               PITCH + SQUAT A/g - sense LEAD dip + SLOPE + askew,
               YAW - sense LAG bend + askew)                      body in the map's track
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
    states : ndarray (n, 52)
    jerk : ndarray (n,)
        Slope of the acceleration, m/s3.
    sense : ndarray (n,)
        1, -1: direction of travel.
    nominal : tuple of float
        Place (y, z) of the mount where the vehicle stands centred on level track, m.
    gravity : float
        m/s2.
    in_time : bool
        The derivative of the roll is by time, not by distance: a body that sways.
    slow_m : float
        Way in which ROLL_SLOW follows ROLL.
    sees_rails : bool
        There is a rail sensor.
    """

    states: FloatArray
    jerk: FloatArray
    sense: FloatArray
    nominal: tuple[float, float]
    gravity: float
    in_time: bool
    slow_m: float
    sees_rails: bool


class Deviation(NamedTuple):
    """How the track differs from the map, and what that makes of the cant deficiency.

    Attributes
    ----------
    curvature : Dual
        That the map has not, 1/m.
    cant, cant_rate : Dual
        Roll that the map has not, rad and rad/s.
    q, q_rate, q_rate_2 : Dual
        Cant deficiency over g, over the body's chord, and its derivatives by time.
    """

    curvature: Dual
    cant: Dual
    cant_rate: Dual
    q: Dual
    q_rate: Dual
    q_rate_2: Dual


class Pose(NamedTuple):
    """The body in the map's track.

    Attributes
    ----------
    track : Deviation
        What is below it.
    rho, rho_rate : Vector
        Small turn out of the map's track, and its rate.
    level : Dual
        Its roll by the rails: without the cant that the map has not, and without what it leans on springs and
        in a chord, unless it sees the rails, which leans with it.
    y, y_rate, y_rate_2, z, z_rate, z_rate_2 : Dual
        Place of the mount in the track, and its derivatives by time.
    """

    track: Deviation
    rho: Vector
    rho_rate: Vector
    level: Dual
    y: Dual
    y_rate: Dual
    y_rate_2: Dual
    z: Dual
    z_rate: Dual
    z_rate_2: Dual


def duals(states: FloatArray) -> list[Dual]:
    """Every state of (n, 52) as a Dual."""
    one = np.ones(len(states))
    return [Dual(states[:, i], {i: one}) for i in range(states.shape[1])]


def deviation_of(x: list[Dual], ground: Ground, around: Around) -> Deviation:
    """The track against the map, and the cant deficiency on it."""
    v, a, per_g = x[at.V], x[at.A], 1.0 / around.gravity
    square, run = v * v, _run(x, around)
    bend, lean, canted = ground.bend, ground.lean, ground.canted
    curvature = x[at.CURVE] * bend[0] - x[at.EVEN] * ground.even - x[at.ODD] * ground.odd
    joints = x[at.EVEN] * ground.even_roll + x[at.ODD] * ground.odd_roll
    cant = x[at.CANT] * canted[0] + x[at.CANT_ALONG] - joints
    cant_rate = x[at.CANT] * canted[1] * v + x[at.CANT_ALONG_1] * run
    bent_rate = square * v * bend[1] * (1.0 + x[at.CURVE]) + 2.0 * (v * a * bend[0])
    bent_rate_2 = square * square * bend[2] + 5.0 * (square * a * bend[1])
    return Deviation(
        curvature=curvature,
        cant=cant,
        cant_rate=cant_rate,
        q=square * (bend[0] + curvature) * per_g + lean[0] + cant,
        q_rate=bent_rate * per_g + v * lean[1] + cant_rate,
        q_rate_2=bent_rate_2 * per_g + square * lean[2] + a * lean[1],
    )


def pose_of(x: list[Dual], ground: Ground, around: Around) -> Pose:
    """Where the body is in the map's track, and how that changes with time."""
    track = deviation_of(x, ground, around)
    v, a, g = x[at.V], x[at.A], around.gravity
    run, behind = _run(x, around), -around.sense
    lag, lead = x[at.LAG] * behind, x[at.LEAD] * behind
    roll, rolls = x[at.ROLL], x[at.ROLL_RATE]
    if not around.in_time:
        roll = roll - x[at.ROLL_SLOW]
        rolls = (rolls - roll * (1.0 / around.slow_m)) * run
    tilt = x[at.TILT] * track.q + x[at.TILT_RATE] * track.q_rate
    tilt_rate = x[at.TILT] * track.q_rate + x[at.TILT_RATE] * track.q_rate_2
    beside = tilt + x[at.TORSION] * ground.torsion[0] + ground.askew[0]
    rho = (
        roll + beside + track.cant,
        x[at.PITCH] + x[at.SQUAT] * a * (1.0 / g) + lead * ground.dip[0] + x[at.SLOPE] + ground.askew[1],
        x[at.YAW] + lag * ground.bend[0] + ground.askew[2],
    )
    rho_rate = (
        rolls
        + tilt_rate
        + track.cant_rate
        + x[at.TORSION] * v * ground.torsion[1]
        + v * ground.askew_slope[0],
        x[at.PITCH_RATE] * run
        + x[at.SQUAT] * (around.jerk / g)
        + lead * v * ground.dip[1]
        + v * ground.askew_slope[1],
        x[at.YAW_RATE] * run + lag * v * ground.bend[1] + v * ground.askew_slope[2],
    )
    own, gain = v.value * v.value, a.value * around.sense
    bend_rate_2 = v * v * ground.bend[2] + a * ground.bend[1]
    return Pose(
        track=track,
        rho=rho,
        rho_rate=rho_rate,
        level=roll + beside if around.sees_rails else roll,
        y=around.nominal[0] + x[at.Y] + x[at.Y_TILT] * track.q + x[at.Y_BEND] * ground.bend[0],
        y_rate=x[at.Y_1] * run + x[at.Y_TILT] * track.q_rate + x[at.Y_BEND] * v * ground.bend[1],
        y_rate_2=x[at.Y_2] * own
        + x[at.Y_1] * gain
        + x[at.Y_TILT] * track.q_rate_2
        + x[at.Y_BEND] * bend_rate_2,
        z=around.nominal[1] + x[at.Z],
        z_rate=x[at.Z_1] * run,
        z_rate_2=x[at.Z_2] * own + x[at.Z_1] * gain,
    )


def _run(x: list[Dual], around: Around) -> FloatArray:
    """d(distance)/dt (n,), for what the body does in the track: the speed is taken for known there.

    A smoothed motion is smaller than the true one: as a state the speed would be raised until the product
    fits.
    """
    return np.asarray(x[at.V].value * around.sense)


def shown(x: list[Dual], ground: Ground, around: Around, pose: Pose) -> list[Dual]:
    """What three gyros and three accelerometers show, rad/s and m/s2."""
    track = pose.track
    rate = _rate(x, ground, track)
    seen, borne = turned(rate, pose.rho), turned(_felt(x, ground, around, track, pose, rate), pose.rho)
    gyro = [seen[i] + pose.rho_rate[i] + x[at.GYRO_BIAS[i]] + x[at.GYRO_OF_Z[i]] * rate[2] for i in range(3)]
    accel = [
        borne[i] + x[at.ACCEL_BIAS[i]] + x[at.ACCEL_OF_X[i]] * borne[0] + x[at.ACCEL_OF_Y[i]] * borne[1]
        for i in range(3)
    ]
    return [*gyro, *accel]


def _rate(x: list[Dual], ground: Ground, track: Deviation) -> Vector:
    """Angular rate of the track frame, its own axes."""
    v, k, up = x[at.V], ground.k, ground.up
    off = v * track.curvature
    return v * k[0] + off * up[0], v * k[1] + off * up[1], v * k[2] + off * up[2]


def _felt(
    x: list[Dual], ground: Ground, around: Around, track: Deviation, pose: Pose, rate: Vector
) -> Vector:
    """Specific force at the mount, track axes (EQUATIONS 1.1)."""
    v, a, g = x[at.V], x[at.A], around.gravity
    k, dk, up, square = ground.k, ground.dk, ground.up, v * v
    secant = 1.0 / np.cos(ground.frame.pitch_rad)
    stretch = np.tan(ground.frame.pitch_rad) * secant
    away = square * track.curvature
    zero = Dual(np.zeros(len(around.jerk)))
    place, moves = (zero, pose.y, pose.z), (zero, pose.y_rate, pose.z_rate)
    alpha = (a * k[0] + square * dk[0], a * k[1] + square * dk[1], a * k[2] + square * dk[2])
    swung, pulled, coriolis = cross(alpha, place), cross(rate, cross(rate, place)), cross(rate, moves)
    carried = [swung[i] + pulled[i] + 2.0 * coriolis[i] for i in range(3)]
    return (
        g * up[0] + a * secant + square * ground.pitch_slope * stretch + carried[0],
        g * up[1] + square * k[2] * secant + away * up[2] + pose.y_rate_2 + carried[1],
        g * up[2] - square * k[1] * secant - away * up[1] + pose.z_rate_2 + carried[2],
    )


def told(x: list[Dual], ground: Ground, around: Around, pose: Pose) -> list[Dual]:
    """What the estimate says: turn of the body out of the map's track (three), S, V, y, z, and roll.

    The slopes are those of roll, pitch and yaw of the body, in which the map is read at S and turned by
    HEADING. The last is the roll that is the rails' (`Pose.level`): the track is taken off where the train
    is, so that the place has no share in it.
    """
    here = x[at.S] - around.states[:, at.S]
    roll, pitch, yaw = ground.frame.rates.T
    return [
        pose.rho[0] + here * roll,
        pose.rho[1] + here * pitch,
        pose.rho[2] + here * yaw + x[at.HEADING],
        x[at.S],
        x[at.V],
        pose.y,
        pose.z,
        pose.level,
    ]
