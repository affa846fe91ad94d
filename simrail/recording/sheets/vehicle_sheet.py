"""What a train's owner knows of its vehicle from a drawing: what rests on what, and where.

A `VehicleSheet` lists the bodies of a vehicle, axles and bogie frames among them, with the places where each
rests on those below it. From these it says which chord of the track a body points along
(`VehicleSheet.chord`): on a curved line a car body does not point along the track where an IMU sits, but from
one of its pivots to the other. It holds what a drawing has, and how far the train itself may be from it.
"""

import math
from dataclasses import dataclass, replace

PLACE_SD_M = 0.02
"""Standard deviation of a place along the vehicle where nobody has said it; synthetic."""

NO_LEVER_M = 0.1
"""What rests so near over the support of a body below, as a car body on a bolster, does not hang on it."""

STIFFNESS_RELATIVE_SD = 0.2
"""Relative standard deviation of stiffness, damping and inertia where nobody has said it; synthetic."""


@dataclass(frozen=True)
class Support:
    """Where a body rests on another.

    Attributes
    ----------
    on : str
        Name of the body or axle below it.
    x_m : float
        Place along the upper body, in its own coordinates: forward from its reference point, as in
        `Recording.mount_position_m`. Of a bogie, its pivot.
    """

    on: str
    x_m: float


@dataclass(frozen=True)
class Springs:
    """Springs and dampers between a body and one that it rests on, of both sides together.

    Attributes
    ----------
    lateral_npm, vertical_npm, roll_nmprad : float
        Stiffness, N/m and N m/rad; that against roll has what the vertical springs give by their distance
        and what an anti-roll bar adds.
    lateral_nspm, vertical_nspm, roll_nmsprad : float
        Damping alike, N s/m and N m s/rad.
    height_m : float
        Of the line along which they push to the side, over the rails.
    """

    lateral_npm: float
    vertical_npm: float
    roll_nmprad: float
    lateral_nspm: float
    vertical_nspm: float
    roll_nmsprad: float
    height_m: float


@dataclass(frozen=True)
class SheetBody:
    """A car body, a bogie frame or an axle.

    Attributes
    ----------
    name : str
        Its name, e.g. that of `Recording.mount_body`.
    x_m : float
        Where its reference point is along the vehicle; forward, from any point that all bodies share.
    supports : tuple of Support
        What it rests on; empty for what runs on the rails by itself: an axle, or a carrier that a test rig
        guides along them.
    ends_m : tuple of float, optional
        Its rear and its front end, in its own coordinates; None where the drawing does not say.
    primary_stiffness_npm, primary_damping_nspm : float, optional
        Of an axle: vertical stiffness and damping of its suspension, both sides together; None where the
        drawing does not say.
    turned_by : tuple of (str, float), optional
        Where it does not point from support to support: by how much its heading follows the lateral offset
        of each axle, in 1/m (rad per m). They sum to 0, times the places of the axles to 1.
    wheelset : bool, optional
        Of an axle: whether its wheels turn as one, so that their taper keeps it near the middle of the track;
        None where the drawing does not say.
    mass_kg, roll_inertia_kgm2, pitch_inertia_kgm2, height_m : float, optional
        Mass, inertia about the centre of gravity, and its height over the rails; its place along the vehicle
        is ``x_m``. None where the drawing does not say.
    springs : tuple of Springs
        One for each of ``supports``; none where the drawing does not say.
    """

    name: str
    x_m: float = 0.0
    supports: tuple[Support, ...] = ()
    ends_m: tuple[float, float] | None = None
    primary_stiffness_npm: float | None = None
    primary_damping_nspm: float | None = None
    turned_by: tuple[tuple[str, float], ...] = ()
    wheelset: bool | None = None
    mass_kg: float | None = None
    roll_inertia_kgm2: float | None = None
    pitch_inertia_kgm2: float | None = None
    height_m: float | None = None
    springs: tuple[Springs, ...] = ()


@dataclass(frozen=True)
class Chord:
    """The chord of the track that a body points along.

    With y(x) the lateral offset of the track from any straight line, x along it from the body's reference
    point, the body's heading against that line is (y_front - y_rear) / (2 half_m). y_front is the mean of y
    at centre_m + half_m - half_wheelbase_m and at centre_m + half_m + half_wheelbase_m, since both axles of a
    bogie hold its pivot; y_rear likewise. A chord with half_m = 0 is the tangent at centre_m.

    That is so where wheels keep to the middle of the track. In a curve they do not: a frame turns in the play
    of its wheels in the gauge, its leading axle outward, until its trailing axle stands radially or flanges
    touch. Its heading is then the tangent at a place behind its middle, seen in the direction of running, and
    what rests on it turns or moves along. `play_m` is how far the middle of the chord has moved once the
    trailing axle of each frame stands radially. Simulated bogies move it by 0.8 to 1.3 times as much in
    curves of 300 and 1000 m; where rods let the axles yaw, by several times as much; in sharp curves and
    with long wheelbases by no more than R sigma / (2 half_m), with the lateral play sigma of both flanges.

    Attributes
    ----------
    centre_m : float
        Middle between its ends, in the body's own coordinates.
    half_m : float
        Half its length; 0 for a body that points along the track where it is.
    half_wheelbase_m : float
        Half the wheelbase of the bogies under its ends; 0 where its ends are on axles or on other bodies.
    sd_m : float
        Standard deviation of the place of each end along the body, independent of the other's.
    play_m : float
        How far the middle of the chord moves in a curve, against the direction of running, once the trailing
        axle of each frame stands radially; below 0 for a body that hangs between two others and is turned
        the other way, 0 for a car body on two bogies alike.
    weights : tuple of (float, float), optional
        Where stiffness turns the body otherwise (`SheetBody.turned_by`): places in the body's own
        coordinates, and by how much its heading follows y there, 1/m. ``centre_m`` is then where the tangent
        to an arc is parallel to the body; the length and the wheelbase are still those between supports.
    shift_sd_m : float
        Standard deviation of the middle for what of the weights is not known: the stiffness, and of an axle
        how far play turns it, as much as ``play_m``.
    """

    centre_m: float
    half_m: float
    half_wheelbase_m: float
    sd_m: float
    play_m: float = 0.0
    weights: tuple[tuple[float, float], ...] = ()
    shift_sd_m: float = 0.0

    @property
    def held_at(self) -> tuple[tuple[float, float], ...]:
        """Offsets from ``centre_m``, and by how much the heading follows y there, 1/m; none for a tangent."""
        if self.weights:
            return tuple((x - self.centre_m, weight) for x, weight in self.weights)
        if self.half_m == 0.0:
            return ()
        weight = 0.25 / self.half_m
        return tuple(
            (side * self.half_m + offset, side * weight)
            for side in (1.0, -1.0)
            for offset in (self.half_wheelbase_m, -self.half_wheelbase_m)
        )


@dataclass(frozen=True)
class VehicleSheet:
    """The drawing of a vehicle.

    Attributes
    ----------
    bodies : tuple of SheetBody
        Each stands after those that it rests on: axles first.
    place_sd_m : float
        Standard deviation of each place along the vehicle (`Support.x_m`), independent of the others; the
        default is synthetic.
    stiffness_relative_sd : float
        Relative standard deviation of each stiffness, damping, mass and inertia; the default is synthetic.
    """

    bodies: tuple[SheetBody, ...]
    place_sd_m: float = PLACE_SD_M
    stiffness_relative_sd: float = STIFFNESS_RELATIVE_SD

    def body(self, name: str) -> SheetBody | None:
        """The body of a name; None if it is not on the drawing."""
        return next((body for body in self.bodies if body.name == name), None)

    def above(self, name: str) -> list[SheetBody]:
        """The bodies that rest on the one of a name, in the order of the drawing."""
        return [body for body in self.bodies if any(support.on == name for support in body.supports)]

    def chord(self, body: str) -> Chord | None:
        """The chord that a body points along, in its own coordinates; None if it is not on the drawing.

        * A body on two or more supports: from its rearmost to its foremost one.
        * A body on one support only, or several abreast: the chord of what it rests on, which turns it.
        * What runs on the rails by itself and has, alone, a body of several supports over it (an axle in
          a bogie frame, or under a two-axle wagon): the chord of that body, which guides it.
        * Any other axle: the tangent at its own place.

        Where stiffness turns it otherwise, and the drawing says so, that holds.
        """
        here = self.body(body)
        if here is None:
            return None
        chord = self._by_supports(here)
        return self._turned(here, chord) if here.turned_by and chord is not None else chord

    def section(self, body: str) -> Chord | None:
        """The chord of the section that a body is held in, in its own coordinates.

        Bodies that hang on each other and have two places to rest on in all lie in one plane: were their
        joints to turn otherwise than in yaw, the section would fold. Of more places it is the straight line
        of least squares through them, as where springs bear a stiff section alike. None for a body by itself.
        """
        here, names = self.body(body), self._hung_together(body)
        bearers = {
            (other.x_m + support.x_m, support.on)
            for other in self.bodies
            if other.name in names
            for support in other.supports
            if support.on not in names
        }
        if here is None or len(names) == 1 or len(bearers) < 2:
            return None
        (rear, lower), *between, (front, upper) = sorted(bearers)
        chord = Chord(
            centre_m=0.5 * (rear + front) - here.x_m,
            half_m=0.5 * (front - rear),
            half_wheelbase_m=0.5 * (self._half_wheelbase_m(lower) + self._half_wheelbase_m(upper)),
            sd_m=self.place_sd_m,
        )
        if not between:
            return chord
        places = [x - here.x_m for x, _ in bearers]
        mean = sum(places) / len(places)
        spread = sum((x - mean) ** 2 for x in places)
        weights = tuple((x, (x - mean) / spread) for x in sorted(places))
        return replace(chord, centre_m=0.5 * sum(weight * x * x for x, weight in weights), weights=weights)

    def _hung_together(self, name: str) -> set[str]:
        """The bodies that joints connect with one, and itself."""
        joints = [
            {body.name, support.on}
            for body in self.bodies
            for support in body.supports
            if self._is_joint(body.x_m + support.x_m, support.on)
        ]
        names = {name}
        for _ in joints:
            names = names.union(*(joint for joint in joints if joint & names))
        return names

    def _is_joint(self, x_m: float, below: str) -> bool:
        """Whether what rests on a body here hangs on it: one that bogies bear, elsewhere than over them."""
        lower = self.body(below)
        if lower is None:
            return False
        on = [self.body(support.on) for support in lower.supports]
        is_carried = any(body is not None and body.supports for body in on)
        over = (lower.x_m + support.x_m for support in lower.supports)
        return is_carried and not any(math.isclose(x_m, x, abs_tol=NO_LEVER_M) for x in over)

    def _turned(self, here: SheetBody, chord: Chord) -> Chord:
        """A chord where the stiffness between a body and its axles turns it."""
        at = {axle.name: axle.x_m - here.x_m for axle in self.bodies}
        weights = tuple((at[axle], weight) for axle, weight in here.turned_by)
        centre = 0.5 * sum(weight * x * x for x, weight in weights)
        # An axle that yaws in its rods is turned by play as much as they let it.
        free = 0.0 if here.supports else chord.play_m
        return replace(
            chord,
            centre_m=centre,
            weights=weights,
            shift_sd_m=math.hypot(self.stiffness_relative_sd * (centre - chord.centre_m), free),
        )

    def _by_supports(self, here: SheetBody) -> Chord | None:
        """The chord that the supports of a body say."""
        if len({support.x_m for support in here.supports}) == 1:
            below = self.body(here.supports[0].on)
            chord = None if below is None else self._by_supports(below)
            return None if below is None or chord is None else _seen_from(here, below, chord)
        if here.supports:
            return self._from_support_to_support(here)
        over = self.above(here.name)
        if len(over) == 1 and len({support.x_m for support in over[0].supports}) > 1:
            return _seen_from(here, over[0], self._from_support_to_support(over[0]))
        return Chord(0.0, 0.0, 0.0, self.place_sd_m)

    def _play(self, body: SheetBody) -> tuple[float, float]:
        """Displacement a + t x of a body in play, at x along the vehicle, for unit curvature: (a, t).

        The frames turn about their middles by t = half their wheelbase, which stands their trailing axle
        radially for a ride towards larger x; bodies above follow rigidly.
        """
        below = [(self.body(support.on), body.x_m + support.x_m) for support in body.supports]
        bearers = sorted(((x, entry) for entry, x in below if entry is not None), key=lambda pair: pair[0])
        if not bearers:
            return 0.0, 0.0
        (rear, lower), (front, upper) = bearers[0], bearers[-1]
        if rear == front:
            return self._play(lower)
        if not lower.supports and not upper.supports:
            turn = 0.5 * (front - rear)
            return -0.5 * (front + rear) * turn, turn
        (a, t), (b, u) = self._play(lower), self._play(upper)
        displaced_rear, displaced_front = a + t * rear, b + u * front
        turn = (displaced_front - displaced_rear) / (front - rear)
        return displaced_rear - turn * rear, turn

    def _from_support_to_support(self, body: SheetBody) -> Chord:
        """Chord of a body on two or more supports."""
        rear, *_, front = sorted(body.supports, key=lambda support: support.x_m)
        return Chord(
            centre_m=0.5 * (rear.x_m + front.x_m),
            half_m=0.5 * (front.x_m - rear.x_m),
            half_wheelbase_m=0.5 * (self._half_wheelbase_m(rear.on) + self._half_wheelbase_m(front.on)),
            sd_m=self.place_sd_m,
            play_m=self._play(body)[1],
        )

    def _half_wheelbase_m(self, name: str) -> float:
        """Half the wheelbase of a bogie; 0 for an axle, and for a body that rests on bogies itself."""
        here = self.body(name)
        below = () if here is None else tuple(self.body(support.on) for support in here.supports)
        if here is None or len(below) < 2 or any(axle is None or axle.supports for axle in below):
            return 0.0
        places = [support.x_m for support in here.supports]
        return 0.5 * (max(places) - min(places))


def _seen_from(body: SheetBody, other: SheetBody, chord: Chord) -> Chord:
    """The chord of another body, in the coordinates of this one."""
    centre = other.x_m + chord.centre_m - body.x_m
    return replace(chord, centre_m=centre)
