"""What an IMU should show: against rotation matrices moved through time, and its slopes against steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.dual import Dual
from simrail.estimators.track_relative.line import Ground, Lines, ground_at, lines_of
from simrail.estimators.track_relative.measurement import Around, Pose, duals, pose_of, shown, told

from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.recording.recording import Recording
from simrail.track.design import TrackDesign, TrackFrame

GRAVITY = 9.81
NOMINAL = (0.2, 0.6)

SIZES = {
    (at.ROLL, at.ROLL_SLOW, at.PITCH, at.YAW): 5e-3,
    (at.ROLL_RATE, at.PITCH_RATE, at.YAW_RATE): 2e-3,
    (at.CANT_ALONG,): 1e-3,
    (at.CANT_ALONG_1,): 1e-4,
    (at.CANT, at.SLOPE): 2e-3,
    (at.Y, at.Z): 5e-3,
    (at.Y_1, at.Z_1): 2e-3,
    (at.Y_2, at.Z_2): 1e-3,
    (at.CURVE,): 0.01,
    (at.EVEN, at.ODD): 0.5,
    (at.HEADING, at.SCALE, at.TREAD, at.LEFT, at.RIGHT): 2e-3,
    (at.TILT, at.TORSION, at.Y_TILT): 0.3,
    (at.SQUAT,): 0.02,
    (at.TILT_RATE,): 0.05,
    (at.LAG, at.LEAD): 0.5,
    (at.Y_BEND,): 2.0,
    at.GYRO_BIAS: 1e-3,
    at.ACCEL_BIAS: 0.02,
    (*at.GYRO_OF_Z, *at.ACCEL_OF_X, *at.ACCEL_OF_Y): 3e-3,
}
"""Of random states; the train's own are given apart."""

SLOW = 12.0
"""m, in which ROLL_SLOW follows."""

MOTION = [
    at.ROLL_RATE, at.PITCH_RATE, at.YAW_RATE, at.CANT_ALONG_1, at.Y_1, at.Y_2, at.Z_1, at.Z_2,
]  # fmt: skip
"""States that are multiplied by a speed that is taken for known."""


def at_rest(states: FloatArray, *, in_time: bool = False) -> FloatArray:
    """The states of a body that does not move in its track: what is slow of its roll stands still as well."""
    still = states.copy()
    still[:, MOTION] = 0.0
    if not in_time:
        still[:, at.ROLL_RATE] = (still[:, at.ROLL] - still[:, at.ROLL_SLOW]) / SLOW
    return still


def random_states(place: FloatArray, speed: FloatArray, name: str) -> FloatArray:
    """States (n, m) at places and speeds."""
    rng, n = stream(8, "shown", name), len(place)
    states = np.zeros((n, at.STATES))
    for numbers, size in SIZES.items():
        states[:, list(numbers)] = size * rng.uniform(-1.0, 1.0, (n, len(numbers)))
    states[:, at.S], states[:, at.V], states[:, at.A] = place, speed, rng.uniform(-0.6, 0.6, n)
    return states


def around_of(
    states: FloatArray, *, in_time: bool = False, jerk: float = 0.1, sees_rails: bool = False
) -> Around:
    sense = np.where(states[:, at.V].real < 0.0, -1.0, 1.0)
    return Around(states, np.full(len(states), jerk), sense, NOMINAL, GRAVITY, in_time, SLOW, sees_rails)


# --- Slopes -----------------------------------------------------------------------------------------------


def wavy(lines: Lines) -> Lines:
    """The map's lines with waves on all of them, so that no slope is zero by the map's simplicity."""
    s = lines.places
    sizes = {
        "askew_roll": 2e-3, "askew_pitch": 1e-3, "askew_yaw": 3e-3, "bend": 2e-3, "lean": 0.02, "dip": 2e-4,
        "canted": 0.3, "torsion": 4e-3, "even": 1e-4, "odd": 7e-5, "even_roll": 1e-3, "odd_roll": 8e-4,
    }  # fmt: skip
    waves = {
        name: getattr(lines, name) + size * np.sin(s / (5.0 + i) + i)
        for i, (name, size) in enumerate(sizes.items())
    }
    return lines._replace(**waves)


PLACES = np.array([30.0, 83.25, 130.0, 172.5, 190.25, 264.75, 320.0, 385.0, 450.0])
"""On the map's grid: straight, transitions and curves of both hands, with cant and in vertical curves."""

SPEEDS = np.array([12.0, -15.0, 20.0, 16.0, -19.0, 14.0, 0.5, -9.0, 17.0])

Shown = Callable[[list[Dual], Ground, Around, Pose], list[Dual]]


def rows_of(formula: Shown, x: list[Dual], ground: Ground, around: Around) -> list[Dual]:
    """What is shown or told of states, by the pose that they say."""
    return formula(x, ground, around, pose_of(x, ground, around))


def slopes_by_step(formula: Shown, states: FloatArray, ground: Ground, around: Around, i: int) -> FloatArray:
    """Complex step: exact to rounding."""
    moved = states.astype(complex)
    moved[:, i] += 1e-30j
    rows = rows_of(formula, duals(moved), ground, around)  # type: ignore[arg-type]
    return np.array([row.value.imag / 1e-30 for row in rows])


@pytest.mark.parametrize("formula", [shown, told])
@pytest.mark.parametrize("in_time", [False, True])
def test_slopes_equal_the_complex_step(exact_bend: Recording, formula: Shown, in_time: bool) -> None:
    """Of every state but the place, to rounding; of speed and acceleration with a body at rest in it."""
    states = random_states(PLACES, SPEEDS, "slopes")
    ground = ground_at(exact_bend, wavy(lines_of(exact_bend)), states[:, at.S])
    found = rows_of(formula, duals(states), ground, around_of(states, in_time=in_time))
    for i in range(at.STATES):
        if i == at.S:
            continue
        if i in (at.V, at.A):
            resting = at_rest(states, in_time=in_time)
            around = around_of(resting, in_time=in_time)
            ours, wanted = (
                rows_of(formula, duals(resting), ground, around),
                slopes_by_step(formula, resting, ground, around, i),
            )
        else:
            around = around_of(states, in_time=in_time)
            ours, wanted = found, slopes_by_step(formula, states, ground, around, i)
        for row, slope in zip(ours, wanted, strict=True):
            np.testing.assert_allclose(row.slopes.get(i, 0.0 * slope), slope, rtol=1e-11, atol=1e-13)


def test_the_speed_is_known_where_the_body_moves(exact_bend: Recording) -> None:
    """Its slope is that of a body at rest in the track but for the terms of the rates' own products."""
    states = random_states(PLACES, SPEEDS, "slopes")
    states[:, at.TILT_RATE] = 0.0  # it turns the body by the rate of the cant: of second order in all
    ground = ground_at(exact_bend, lines_of(exact_bend), states[:, at.S])
    still = at_rest(states)
    moving, resting = (rows_of(shown, duals(x), ground, around_of(x)) for x in (states, still))
    for row in range(3):
        np.testing.assert_array_equal(moving[row].slopes[at.V], resting[row].slopes[at.V])


@pytest.mark.parametrize("formula", [shown, told])
def test_slopes_by_the_place_equal_steps_on_the_map(exact_bend: Recording, formula: Shown) -> None:
    """A step of the map's own grid to either side, where the map is smooth.

    What is read off the grid has exactly these slopes. Of the track frame itself, the step errs by h^2/6 of
    the third derivative: below 1e-5. Left out on purpose, and held here, is the slope of dk; left out and not
    held that of the tangent of the track's pitch: V^2 theta'^2 in a vertical curve, along X.
    """
    states = random_states(PLACES, SPEEDS, "place")
    states[:, [at.EVEN, at.ODD]] = 0.0  # how the weights of a joint change along it is left out
    lines, h = wavy(lines_of(exact_bend)), 0.25
    around, here = around_of(states), ground_at(exact_bend, lines, states[:, at.S])
    sides = []
    for side in (1.0, -1.0):
        moved = states.copy()
        moved[:, at.S] += side * h
        ground = ground_at(exact_bend, lines, moved[:, at.S])._replace(dk=here.dk)
        # The turn is out of the map's track where the train is: about the moved states.
        linear_about = around if formula is shown else around_of(moved)
        rows = np.array([row.value for row in rows_of(formula, duals(moved), ground, linear_about)])
        if formula is told:
            rows[:3] += [ground.frame.roll_rad, ground.frame.pitch_rad, ground.frame.yaw_rad]
        sides.append(rows)
    wanted = (sides[0] - sides[1]) / (2.0 * h)
    found = rows_of(formula, duals(states), here, around)
    left_out = SPEEDS**2 * here.frame.rates[:, 1] ** 2
    for number, (row, slope) in enumerate(zip(found, wanted, strict=True)):
        error = np.abs(row.slopes.get(at.S, 0.0 * slope) - slope)
        assert (error < 1e-5 + (left_out if formula is shown and number == 3 else 0.0)).all()


def test_the_outputs_are_the_states_that_they_are_named_after(exact_bend: Recording) -> None:
    """Roll, pitch, yaw, S, V, y and z by the states of that name; and the yaw by the heading of the map."""
    states = random_states(PLACES, SPEEDS, "outputs")
    rows = rows_of(
        told, duals(states), ground_at(exact_bend, lines_of(exact_bend), states[:, at.S]), around_of(states)
    )
    named = (at.ROLL, at.PITCH, at.YAW, at.S, at.V, at.Y, at.Z)
    for number, state in (*enumerate(named), (2, at.HEADING)):
        np.testing.assert_array_equal(rows[number].slopes[state], 1.0)
    for number, value in ((3, PLACES), (4, SPEEDS)):
        np.testing.assert_array_equal(rows[number].value, value)


# --- Motion through time ----------------------------------------------------------------------------------

POLYNOMIALS = {
    "askew_roll": (1e-3, 2e-4, -3e-5), "askew_pitch": (-8e-4, 1e-4, 2e-5), "askew_yaw": (2e-3, -3e-4, 4e-5),
    "bend": (3e-3, 9e-5, -4e-6), "lean": (-0.05, -1.5e-3, 6e-5), "dip": (3e-4, 2e-5, 1e-6),
    "torsion": (6e-3, -4e-4, 2e-5), "canted": (0.6, 0.02, 1e-3),
}  # fmt: skip
"""Of the distance from the place: value, slope, and half the second slope."""

EVEN, ODD, EVEN_ROLL, ODD_ROLL = 6e-5, -3e-5, 9e-4, 5e-4


def polynomial(name: str, d: FloatArray, order: int = 0) -> FloatArray:
    """Its derivative of that order at distances d."""
    return np.asarray(np.polynomial.Polynomial(POLYNOMIALS[name]).deriv(order)(d))


def smooth_ground(track: TrackDesign, place: float) -> Ground:
    """The map's frame at one place, and about it lines that are polynomials."""
    zero = np.zeros(1)

    def known(name: str, slopes: int) -> tuple[Dual, ...]:
        return tuple(Dual(polynomial(name, zero, order)) for order in range(slopes + 1))

    frame = track.frame(np.array([place]))
    k, dk = (tuple(Dual(values[:, i]) for i in range(3)) for values in (frame.k, frame.dk))
    up = frame.rotation[:, 2, :]  # the global Z in the track's axes
    askew = [known(name, 1) for name in ("askew_roll", "askew_pitch", "askew_yaw")]
    return Ground(
        frame=frame, k=k, dk=dk, pitch_slope=Dual(frame.rates[:, 1]),
        up=tuple(Dual(up[:, i]) for i in range(3)), askew=tuple(a[0] for a in askew),
        askew_slope=tuple(a[1] for a in askew), bend=known("bend", 2), lean=known("lean", 2),
        dip=known("dip", 1), torsion=known("torsion", 1), canted=known("canted", 1),
        even=zero + EVEN, odd=zero + ODD, even_roll=zero + EVEN_ROLL, odd_roll=zero + ODD_ROLL,
    )  # type: ignore[arg-type]  # fmt: skip


class Moving(NamedTuple):
    """A body that moves through a place at time 0, by the meaning of its states; all by time t (n,)."""

    x: FloatArray
    place: float
    track: TrackDesign
    sense: float
    jerk: float
    in_time: bool

    def distance(self, t: FloatArray) -> FloatArray:
        return self.x[at.V] * t + self.x[at.A] * t**2 / 2.0 + self.jerk * t**3 / 6.0

    def speed(self, t: FloatArray) -> FloatArray:
        return self.x[at.V] + self.x[at.A] * t + self.jerk * t**2 / 2.0

    def deviation(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Yaw of the track against the map's since time 0; roll against it; cant deficiency over g."""
        x, d = self.x, self.distance(t)
        joints = x[at.EVEN] * EVEN + x[at.ODD] * ODD
        turned = x[at.CURVE] * np.polynomial.Polynomial(POLYNOMIALS["bend"]).integ()(d) - joints * d
        along = x[at.CANT_ALONG] + x[at.CANT_ALONG_1] * self.sense * d
        cant = x[at.CANT] * polynomial("canted", d) + along - x[at.EVEN] * EVEN_ROLL - x[at.ODD] * ODD_ROLL
        bend = polynomial("bend", d) * (1.0 + x[at.CURVE]) - joints
        return turned, cant, self.speed(t) ** 2 * bend / GRAVITY + polynomial("lean", d) + cant

    def rho(self, t: FloatArray) -> FloatArray:
        """Rotation vector (n, 3) of the body out of the map's track."""
        x, d, acceleration = self.x, self.distance(t), self.x[at.A] + self.jerk * t
        run, (_, cant, q) = self.sense * d, self.deviation(t)
        roll = x[at.ROLL] - (0.0 if self.in_time else x[at.ROLL_SLOW])
        rolled = x[at.ROLL_RATE] * t if self.in_time else (x[at.ROLL_RATE] - roll / SLOW) * run
        pitch = x[at.PITCH] + x[at.PITCH_RATE] * run + x[at.SQUAT] * acceleration / GRAVITY + x[at.SLOPE]
        pitch = pitch - self.sense * x[at.LEAD] * polynomial("dip", d)
        yaw = x[at.YAW] + x[at.YAW_RATE] * run - self.sense * x[at.LAG] * polynomial("bend", d)
        h = 1e-3
        late = x[at.TILT_RATE] * (self.deviation(t + h)[2] - self.deviation(t - h)[2]) / (2.0 * h)
        roll = roll + rolled + x[at.TILT] * q + late + x[at.TORSION] * polynomial("torsion", d) + cant
        askew = [polynomial(name, d) for name in ("askew_roll", "askew_pitch", "askew_yaw")]
        return np.column_stack([roll + askew[0], pitch + askew[1], yaw + askew[2]])

    def mount(self, t: FloatArray) -> FloatArray:
        """Place (n, 3) of the mount in the track."""
        x, d = self.x, self.distance(t)
        run, (_, _, q) = self.sense * d, self.deviation(t)
        y, z = (x[i] + x[i + 1] * run + x[i + 2] * run**2 / 2.0 for i in (at.Y, at.Z))
        y = NOMINAL[0] + y + x[at.Y_TILT] * q + x[at.Y_BEND] * polynomial("bend", d)
        return np.column_stack([0.0 * t, y, NOMINAL[1] + z])

    def frame(self, t: FloatArray) -> tuple[FloatArray, TrackFrame]:
        """Rotation (n, 3, 3) of the track: the map's, turned about the vertical; and the map's frame."""
        frame = self.track.frame(self.place + self.distance(t))
        turned = np.column_stack([0.0 * t, 0.0 * t, self.deviation(t)[0]])
        return Rotation.from_rotvec(turned).as_matrix() @ frame.rotation, frame


H = 4e-3
"""s, between the times of a derivative; of fourth order: truncation and rounding are below 1e-7 m/s2."""

TIMES = H * np.arange(-2.0, 3.0)
FIRST, SECOND = (
    np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12.0 * H),
    np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12.0 * H**2),
)


def sensed(body: Moving) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Rate and specific force (3,) in the body's axes, rate of the track in its own, by numbers; and rho'."""
    track, frame = body.frame(TIMES)
    turned = track @ Rotation.from_rotvec(body.rho(TIMES)).as_matrix()
    velocity = (body.speed(TIMES) / np.cos(frame.pitch_rad))[:, None] * track[:, :, 0]
    arm = np.einsum("nij,nj->ni", track, body.mount(TIMES))
    force = FIRST @ velocity + SECOND @ arm + np.array([0.0, 0.0, GRAVITY])

    def rate(rotation: FloatArray) -> FloatArray:
        skew = rotation[2].T @ np.einsum("n,nij->ij", FIRST, rotation)
        return np.array([skew[2, 1], skew[0, 2], skew[1, 0]])

    return rate(turned), turned[2].T @ force, rate(track), FIRST @ body.rho(TIMES)


def left_out(body: Moving, rho_rate: FloatArray, rate: FloatArray) -> tuple[float, float]:
    """What the formulas neglect, rad/s and m/s2, bounded term by term.

    Of a turn rho: rho x rho'/2 of its rate, and the third order of the series. Of the deviation: 2 V A h_m in
    the rate of q, and its angular acceleration, (A h_m + V^2 h_m') r. Of the second derivative of q: what is
    multiplied by A^2 or the jerk or by the deviation of the map, and the second derivative of the cant.
    """
    zero = np.zeros(1)
    x, rho = body.x, float(np.linalg.norm(body.rho(zero)))
    v, a, j = x[at.V], x[at.A], body.jerk
    b = [abs(float(polynomial("bend", zero, order)[0])) for order in range(3)]
    off = abs(x[at.CURVE]) * b[0] + abs(x[at.EVEN] * EVEN) + abs(x[at.ODD] * ODD)
    off_slope, arm = abs(x[at.CURVE]) * b[1], np.hypot(*NOMINAL) + 0.05
    q_rate = 2.0 * abs(v * a) * off / GRAVITY
    q_rate_2 = (2.0 * a * a + 2.0 * abs(v * j)) * (b[0] + off) / GRAVITY
    q_rate_2 += abs(x[at.CURVE]) * (v**4 * b[2] + 5.0 * v * v * abs(a) * b[1]) / GRAVITY
    canted = [abs(float(polynomial("canted", zero, order)[0])) for order in (1, 2)]
    q_rate_2 += abs(x[at.CANT]) * (v * v * canted[1] + abs(a) * canted[0]) + abs(x[at.CANT_ALONG_1] * a)
    y_rate, y_rate_2 = abs(x[at.Y_TILT]) * q_rate, abs(x[at.Y_TILT]) * q_rate_2
    moving, speed = float(np.linalg.norm(rho_rate)), float(np.linalg.norm(rate))
    late = abs(x[at.TILT_RATE])
    gyro = 0.5 * rho * moving + rho**3 / 6.0 * speed + abs(x[at.TILT]) * q_rate + late * q_rate_2
    accel = (
        late * q_rate * 1.1 * GRAVITY
        + rho**3 / 6.0 * 1.1 * GRAVITY
        + (abs(a) * off + v * v * off_slope) * arm
    )
    return gyro + 1e-7, accel + y_rate_2 + 2.0 * speed * y_rate + 1e-6


PASSING = [
    (80.0, 15.0),
    (130.0, -18.0),
    (190.0, 12.0),
    (190.0, -19.0),
    (260.0, 20.0),
    (300.0, -14.0),
    (35.0, 9.0),
]
"""Place and speed: a straight, transitions and curves of both hands, canted, sloped, in vertical curves."""


@pytest.mark.parametrize("in_time", [False, True], ids=["by distance", "by time"])
@pytest.mark.parametrize(("place", "speed"), PASSING)
def test_a_body_moved_through_time_shows_it(
    bend: Callable, place: float, speed: float, in_time: bool
) -> None:
    """Rotations and places by the meaning of the states, differentiated by numbers."""
    track = bend(15.0, 1).track
    states = random_states(np.full(5, place), np.full(5, speed), f"{place} {speed}")
    states[:3, at.TILT_RATE] = 0.0  # of which more is left out than of all else
    sense, jerk, ground = float(np.sign(speed)), 0.1, smooth_ground(track, place)
    for x in states:
        found = np.array(
            [
                row.value[0]
                for row in rows_of(shown, duals(x[None]), ground, around_of(x[None], in_time=in_time))
            ]
        )
        rate, force, of_track, rho_rate = sensed(Moving(x, place, track, sense, jerk, in_time))
        gyro, accel = left_out(Moving(x, place, track, sense, jerk, in_time), rho_rate, of_track)
        wanted_rate = rate + x[list(at.GYRO_BIAS)] + x[list(at.GYRO_OF_Z)] * of_track[2]
        across = x[list(at.ACCEL_OF_X)] * force[0] + x[list(at.ACCEL_OF_Y)] * force[1]
        assert np.linalg.norm(found[:3] - wanted_rate) < gyro
        assert np.linalg.norm(found[3:] - (force + x[list(at.ACCEL_BIAS)] + across)) < accel
