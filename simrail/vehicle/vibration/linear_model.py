"""The linear vertical model of a vehicle on a flexible track: mass, damping and stiffness matrices.

Built from the same `VehicleModel` that a ride is integrated with, about its place at rest on level track.
A sprung body has all six small motions; a body that carries wheels has heave, pitch, and roll about where
its wheels touch the rails, as if creep held these points. It gives way: at a speed V the contact of a wheel
is a damper f22 / V across and, where both wheels of an axle turn as one, f11 / V along (Kalker's
coefficients). With a speed given, an axle has sway and yaw of its own on these dampers, and one with
independent wheels goes where it points, ``F_y = -f22 (y' / V - psi)``; a fixed one is held in yaw by its
wheels. Without, axles roll as well and everything heaves as well, but frames roll and sway by up to 4 dB,
bodies by up to 12 dB, too much or too little: where both axles of a bogie move against each other, and the
body above 20 Hz.
Under each wheel a rail mass goes along with it, on a spring and a damper. Wheel and rail meet in Hertz's
contact, linear about the static load. Each element is one generalised deflection ``d = g q`` with a stiffness
and a damping, so that

    M q'' + C q' + K q + sum_j g_j F_j = E r,    F_j' = k_j (g_j q' - F_j / c_j)

with F_j the force of a damper in series with its mounts and r (w,) what wheel and rail push apart at each
wheel: height of rail and wheel surfaces beyond what the ride has seen. What preloads add to stiffness
(pendulum terms), contact angles and creepage are left out: they turn frequencies of some hertz by some
percent, and those are the multibody ride's.

Not here: how it moves in time (`simrail.vehicle.vibration.modal`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.vehicle.contact.contact import static_height
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.model import Suspension, VehicleModel

SWAY, HEAVE, ROLL, PITCH, YAW = 1, 2, 3, 4, 5
"""Numbers of some motions among the six of a body: x, y, z, roll, pitch, yaw."""
BENDING = -1
"""Number of the coordinate of a body's bending."""
_OF_AXLE = (HEAVE, ROLL, PITCH)
_FREE_FREE = 4.730040744862704
"""First root of cos(a) cosh(a) = 1: a times length is the wave number of a free beam's first bending."""


@dataclass(frozen=True)
class TrackSupport:
    """The track under one wheel: a mass of rail that goes along with it, on a spring and a damper.

    Attributes
    ----------
    mass_kg, stiffness_npm, damping_nspm : float
        Effective mass, stiffness and damping, > 0.
    """

    mass_kg: float
    stiffness_npm: float
    damping_nspm: float


@dataclass(frozen=True)
class Bending:
    """First vertical bending of a body: that of a uniform beam with free ends, its middle the body's.

    Attributes
    ----------
    body : str
        Which body bends.
    frequency_hz, damping_ratio : float
        Of the free body.
    length_m : float
        Length of the beam.
    """

    body: str
    frequency_hz: float
    damping_ratio: float
    length_m: float

    def shape(self, x_m: float) -> tuple[float, float]:
        """Rise and slope of the mode at a distance ahead of the middle, for a rise of 1 at rms over the mass.

        With u = a x / L from the middle, ``shape = A cos u + B cosh u``, scaled so that the modal mass is the
        body's mass.
        """
        a = _FREE_FREE
        u = a * x_m / self.length_m
        # Both end moments vanish: A cos(a/2) = B cosh(a/2); the mean square over the length is 1.
        ratio = np.cos(0.5 * a) / np.cosh(0.5 * a)
        mean = (
            0.5 * (1.0 + np.sin(a) / a)
            + 0.5 * ratio**2 * (1.0 + np.sinh(a) / a)
            + ratio / a * 2.0 * (np.cos(0.5 * a) * np.sinh(0.5 * a) + np.sin(0.5 * a) * np.cosh(0.5 * a))
        )
        scale = 1.0 / np.sqrt(mean)
        rise = scale * (np.cos(u) + ratio * np.cosh(u))
        slope = scale * a / self.length_m * (-np.sin(u) + ratio * np.sinh(u))
        return float(rise), float(slope)


@dataclass(frozen=True, eq=False)
class LinearVehicle:
    """Matrices of a vehicle on its track; n coordinates, w wheels, d dampers in series with their mounts.

    Attributes
    ----------
    coordinates : tuple of (str, int)
        Body and number of the motion (x, y, z, roll, pitch, yaw) of each coordinate; ``(body, BENDING)`` is
        its bending, ``(wheel, HEAVE)`` the rail under a wheel.
    mass, damping, stiffness : ndarray (n, n)
        M, C, K.
    series : ndarray (d, n)
        Rows g_j of the dampers in series.
    series_stiffness_npm, series_damping_nspm : ndarray (d,)
        k_j and c_j.
    input : ndarray (n, w)
        E: force on each coordinate per metre that wheel and rail are pushed apart, N/m.
    load : ndarray (w, n)
        Load of each wheel by the coordinates, N/m; to it comes ``contact_npm`` r.
    contact_npm : ndarray (w,)
        Stiffness of each wheel's contact.
    axle_heights_m : dict of str to float
        Height of each axle above the points that it rolls about; empty where axles sway by themselves.
    """

    coordinates: tuple[tuple[str, int], ...]
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    series: FloatArray
    series_stiffness_npm: FloatArray
    series_damping_nspm: FloatArray
    input: FloatArray
    load: FloatArray
    contact_npm: FloatArray
    axle_heights_m: dict[str, float]

    def row(self, body: str, motion: int) -> FloatArray:
        """Row (n,) that takes one motion of a body out of the coordinates; zeros if the rails hold it."""
        row = np.zeros(len(self.coordinates))
        if motion == SWAY and body in self.axle_heights_m:
            return -self.axle_heights_m[body] * self.row(body, ROLL)
        if (body, motion) in self.coordinates:
            row[self.coordinates.index((body, motion))] = 1.0
        return row

    def response(self, frequency_hz: float) -> FloatArray:
        """Complex response (n, w) of the coordinates to unit inputs at a frequency, from M, C and K."""
        omega = 2.0 * np.pi * frequency_hz
        k, c = self.series_stiffness_npm, self.series_damping_nspm
        dynamic = self.stiffness - omega**2 * self.mass + 1j * omega * self.damping
        dynamic = dynamic + self.series.T @ (
            (1j * omega * k * c / (k + 1j * omega * c))[:, None] * self.series
        )
        answer: FloatArray = np.linalg.solve(dynamic, self.input)
        return answer


def contact_stiffness_npm(model: VehicleModel, *, gravity_mps2: float = 9.81) -> FloatArray:
    """Vertical stiffness (w,) of each wheel's contact at its static load: 3/2 N0 / approach (Hertz)."""
    pair = model.wheel_rail
    if pair.linear is not None:
        return np.full(len(model.wheels), float(pair.linear.vertical_stiffness_npm))
    contacts = contacts_of(model, gravity_mps2=gravity_mps2)
    stiffness = []
    for table in contacts.tables:
        penetration = float(np.polyval(*table.piece("penetration", 0.0)))
        stiffness.append(1.5 * table.static_load_n / (penetration - static_height(table)))
    return np.array(stiffness)[list(contacts.of_wheel)]


def creep_coefficients_n(model: VehicleModel, *, gravity_mps2: float = 9.81) -> tuple[FloatArray, FloatArray]:
    """Kalker's coefficients f11 and f22 (w,) of each wheel at its static load, N."""
    pair = model.wheel_rail
    if pair.linear is not None:
        even = np.ones(len(model.wheels))
        return even * float(pair.linear.f11_n), even * float(pair.linear.f22_n)
    contacts = contacts_of(model, gravity_mps2=gravity_mps2)
    found = []
    for table in contacts.tables:
        approach = float(np.polyval(*table.piece("penetration", 0.0))) - static_height(table)
        found.append([approach * float(np.polyval(*table.piece(name, 0.0))) for name in ("f11", "f22")])
    along, across = np.array(found)[list(contacts.of_wheel)].T
    return along, across


def linear_vehicle(
    model: VehicleModel,
    support: TrackSupport | None,
    *,
    bending: Sequence[Bending] = (),
    gravity_mps2: float = 9.81,
    speed_mps: float | None = None,
) -> LinearVehicle:
    """Build the linear model of a vehicle.

    Parameters
    ----------
    model : VehicleModel
        The vehicle.
    support : TrackSupport, optional
        The track under each wheel; None for one that does not give way.
    bending : sequence of Bending
        Bodies that bend.
    gravity_mps2 : float
        Gravity, for the loads of the contacts.
    speed_mps : float, optional
        Speed at which contacts creep, > 0; None for contacts that hold.

    Raises
    ------
    InputError
        If the body that is to bend is not one of the vehicle's sprung bodies.
    """
    builder = _Builder(model, bending, creeps=speed_mps is not None)
    for stiffness, damping, row in builder.elements():
        builder.add(stiffness, damping, row)
    contact = contact_stiffness_npm(model, gravity_mps2=gravity_mps2)
    loads = []
    for wheel, k in zip(model.wheels, contact, strict=True):
        place = np.array(model.body(wheel.axle).position_m)
        place[1] = wheel.side * model.wheel_rail.tape_circle_half_m
        rail = builder.unit(wheel.name, HEAVE) * (support is not None)
        damping = 0.0 if model.wheel_rail.linear is None else model.wheel_rail.linear.vertical_damping_nspm
        closer = rail - builder.point(wheel.axle, place)[2]
        builder.add(k, damping, closer)
        if support is not None:
            builder.add(support.stiffness_npm, support.damping_nspm, rail)
            builder.mass += support.mass_kg * np.outer(rail, rail)
        loads.append(k * closer)
    if speed_mps is not None:
        builder.add_creep(*creep_coefficients_n(model, gravity_mps2=gravity_mps2), speed_mps)
    return builder.finished(np.array(loads), contact)


class _Builder:
    """Coordinates of a vehicle on its track, and matrices that grow element by element."""

    def __init__(self, model: VehicleModel, bending: Sequence[Bending], *, creeps: bool) -> None:
        self.model, self.creeps = model, creeps
        self.bending = {bent.body: bent for bent in bending}
        self.axles = axles = set(model.axle_names)
        for bent in bending:
            if bent.body in axles or bent.body not in model.body_names:
                raise InputError(
                    "cannot bend",
                    field="bending.body",
                    value=bent.body,
                    limit=", ".join(name for name in model.body_names if name not in axles),
                    remedy="name a body above the axles",
                )
        of_axle = (*_OF_AXLE, SWAY, YAW) if creeps else _OF_AXLE
        listed = [(b.name, k) for b in model.bodies for k in (of_axle if b.name in axles else range(6))]
        listed += [(bent.body, BENDING) for bent in bending]
        listed += [(wheel.name, HEAVE) for wheel in model.wheels]
        self.coordinates = tuple(listed)
        n = len(listed)
        self.mass, self.damping, self.stiffness = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
        for body in model.bodies:
            for k, inertia in enumerate((body.mass_kg,) * 3 + tuple(body.inertia_kgm2)):
                if (body.name, k) in self.coordinates:
                    at = self.coordinates.index((body.name, k))
                    self.mass[at, at] = inertia
                    if k == ROLL and body.name in axles and not creeps:
                        self.mass[at, at] += body.mass_kg * body.position_m[2] ** 2
        for bent in bending:
            at, mass = self.coordinates.index((bent.body, BENDING)), model.body(bent.body).mass_kg
            omega = 2.0 * np.pi * bent.frequency_hz
            self.mass[at, at], self.stiffness[at, at] = mass, mass * omega**2
            self.damping[at, at] = 2.0 * bent.damping_ratio * mass * omega

    def unit(self, name: str, motion: int) -> FloatArray:
        """Row (n,) of one coordinate; zeros where there is no such coordinate."""
        row = np.zeros(len(self.coordinates))
        if (name, motion) in self.coordinates:
            row[self.coordinates.index((name, motion))] = 1.0
        return row

    def turn(self, name: str) -> FloatArray:
        """Rows (3, n) of a body's small rotation."""
        return np.array([self.unit(name, 3 + k) for k in range(3)])

    def point(self, name: str, place_m: FloatArray) -> FloatArray:
        """Rows (3, n) of the displacement of a point of a body: ``t + theta x r``, and its bending."""
        x, y, z = np.subtract(place_m, self.model.body(name).position_m)
        cross = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        if name in self.axles and not self.creeps:
            cross[1, 0] = -place_m[2]  # an axle rolls about where its wheels touch the rails
        rows: FloatArray = np.array([self.unit(name, k) for k in range(3)]) + cross @ self.turn(name)
        if name in self.bending:
            rise, slope = self.bending[name].shape(x)
            rows[2] += rise * self.unit(name, BENDING)
            rows[0] -= z * slope * self.unit(name, BENDING)
        return rows

    def add(self, stiffness: float, damping: float, row: FloatArray) -> None:
        """Add an element by its deflection ``row q``."""
        self.stiffness += stiffness * np.outer(row, row)
        self.damping += damping * np.outer(row, row)

    def add_creep(self, along_n: FloatArray, across_n: FloatArray, speed_mps: float) -> None:
        """Add the creep of all contacts, by f11 and f22 (w,), at a speed."""
        wheels = self.model.wheels
        for wheel, f11, f22 in zip(wheels, along_n, across_n, strict=True):
            place = np.array(self.model.body(wheel.axle).position_m)
            place[1:] = wheel.side * self.model.wheel_rail.tape_circle_half_m, 0.0
            slip_x, slip_y, _ = self.point(wheel.axle, place)
            self.add(0.0, f22 / speed_mps, slip_y)
            if sum(other.spin == wheel.spin for other in wheels) > 1:
                # What an axle turns about itself, its wheels do as well: only its yaw makes them slip.
                yaw = slip_x * np.abs(self.unit(wheel.axle, YAW))
                self.add(0.0, f11 / speed_mps, yaw)
            else:
                self.stiffness -= f22 * np.outer(slip_y, self.unit(wheel.axle, YAW))

    def elements(self) -> Iterator[tuple[float, float, FloatArray]]:
        """Stiffness, damping and row of every element that is not a contact nor in series."""
        for spring in self.model.suspensions:
            yield from zip(spring.stiffness_npm, spring.damping_nspm, self._stretch(spring), strict=True)
        for turned in self.model.rotations:
            rows = self.turn(turned.outer) - self.turn(turned.inner)
            yield from zip(turned.stiffness_nmprad, turned.damping_nmsprad, rows, strict=True)
        for rod in self.model.rods:
            inner, outer = np.array(rod.inner_position_m), np.array(rod.outer_position_m)
            way = (outer - inner) / rod.length_m
            row = way @ (self.point(rod.outer, outer) - self.point(rod.inner, inner))
            yield rod.stiffness_npm, rod.damping_nspm, row
        yield from self._arms()
        for stop in self.model.tabled:
            x, force = np.array([(0.0, 0.0), *stop.points]).T
            slope = float(PchipInterpolator(x, force).derivative()(0.0))
            row = self._between(stop.inner, stop.outer, stop.position_m)[stop.axis]
            yield (0.0, slope, row) if stop.over == "speed_mps" else (slope, 0.0, row)
        yield from self._guide()

    def _arms(self) -> Iterator[tuple[float, float, FloatArray]]:
        """Trailing arms, as `simrail.vehicle.engines.suspension_forces.arm_force` has them."""
        for pair in self.model.arms:
            turns, square = [], 0.0
            for bushing in pair.bushings_m:
                rows = self._between(pair.axle, pair.frame, bushing)
                x, _, z = np.subtract(bushing, self.model.body(pair.axle).position_m)
                square = x * x + z * z
                length = np.sqrt(square)
                yield pair.stiffness_npm[0], pair.damping_nspm[0], (x * rows[0] + z * rows[2]) / length
                yield pair.stiffness_npm[1], pair.damping_nspm[1], rows[1]
                turns.append((z * rows[0] - x * rows[2]) / square)
            mean = 0.5 * (turns[0] + turns[1])
            yield 2.0 * square * pair.stiffness_npm[2], 2.0 * square * pair.damping_nspm[2], mean

    def _guide(self) -> Iterator[tuple[float, float, FloatArray]]:
        """The guide's springs, at the centre of gravity of its body."""
        guide = self.model.guide
        held = (
            (0, guide.stiffness_npm, guide.damping_nspm),
            (1, guide.lateral_stiffness_npm, guide.lateral_damping_nspm),
            (2, guide.vertical_stiffness_npm, guide.vertical_damping_nspm),
            (3, guide.roll_stiffness_nmprad, guide.roll_damping_nmsprad),
            (4, guide.pitch_stiffness_nmprad, guide.pitch_damping_nmsprad),
            (5, guide.yaw_stiffness_nmprad, guide.yaw_damping_nmsprad),
        )
        for motion, stiffness, damping in held:
            yield stiffness, damping, self.unit(guide.body, motion)

    def _between(self, inner: str, outer: str, place_m: tuple[float, float, float]) -> FloatArray:
        at = np.array(place_m)
        return self.point(outer, at) - self.point(inner, at)

    def _stretch(self, spring: Suspension) -> FloatArray:
        return self._between(spring.inner, spring.outer, spring.position_m)

    def finished(self, loads: FloatArray, contact_npm: FloatArray) -> LinearVehicle:
        """The model, without coordinates that nothing holds and nothing moves (a wheelset's own pitch)."""
        series = [self._between(e.inner, e.outer, e.position_m)[e.axis] for e in self.model.series]
        rows = np.array(series).reshape(-1, len(self.coordinates))
        used = np.abs(self.stiffness).sum(0) + np.abs(self.damping).sum(0) + np.abs(rows).sum(0) > 0.0
        at = np.flatnonzero(used)
        square = np.ix_(at, at)
        return LinearVehicle(
            coordinates=tuple(self.coordinates[i] for i in at),
            mass=self.mass[square],
            damping=self.damping[square],
            stiffness=self.stiffness[square],
            series=rows[:, at],
            series_stiffness_npm=np.array([float(e.stiffness_npm) for e in self.model.series]),
            series_damping_nspm=np.array([float(e.damping_nspm) for e in self.model.series]),
            input=-loads[:, at].T,
            load=loads[:, at],
            contact_npm=contact_npm,
            axle_heights_m={}
            if self.creeps
            else {name: self.model.body(name).position_m[2] for name in self.axles},
        )
