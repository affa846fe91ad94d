"""The rails under a bogie frame, through its primary suspension: inverse dynamics of the frame.

A frame is where its springs put it. What it does is known at every sample, so the force that makes it do so
is, and so is how far the springs under it are pressed together: the axles are there. All is linear about a
vehicle that stands, and by frequency (s = i omega) a quotient of polynomials. Of a frame at (y, z) with roll
phi and pitch theta, its centre of gravity at height z_G, springs above at z_S, below at z_P, in the axes of
the track that turns and curves (q: cant deficiency over g; phi_t: its roll):

    heave    F_front + F_rear = m s^2 z + B s^2 (C s + K)/(B s^2 + C s + K) z
    pitch    -x_front F_front - x_rear F_rear = I_y s^2 theta
    axle i   v_i = z - x_i theta + F_i/(k_i + c_i s)
    roll     w = phi + (I_x s^2 (phi + phi_t) + M - h F_e + W d - e F_p - e W_f phi)/k_phi,
             e = z_G - z_P,   h = z_S - z_G

with the mass B above, on springs K, C; M and F_e the moment and the lateral force of these, d how far they
are bent to the side, W and W_f the weight above the springs above and below, F_p the lateral force of the
axles. The body above is a rigid one that sways on its springs; its ground is the mean of the frames that bear
it, each of which has its share of the body. A spring pulls in the axes of the body below at the point on the
body above, so that a body that leans out loads the outer side.

w is the mean roll of both axles, of which the rails' own follows by
`simrail.estimators.track_relative.under_frame`.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simrail.recording.sheets.vehicle_sheet import SheetBody, VehicleSheet

ComplexArray = npt.NDArray[np.complex128]


@dataclass(frozen=True)
class Bogie:
    """A frame on two axles, and what it bears. SI; places along and above the frame's reference point.

    Attributes
    ----------
    mass, roll_inertia, pitch_inertia, height : float
        Of the frame: kg, kg m2, and height of its centre of gravity over the rails, m.
    front, rear : float
        Places of the axles, forward.
    front_stiffness, rear_stiffness, front_damping, rear_damping : float
        Vertical, of both sides, N/m and N s/m.
    primary_roll, primary_roll_damping, primary_height : float
        Of both axles against roll, N m/rad and N m s/rad; height of the springs, m.
    secondary_vertical, secondary_lateral, secondary_roll : float
    secondary_vertical_damping, secondary_lateral_damping, secondary_roll_damping, secondary_height : float
        Of the springs above, alike.
    load, load_inertia, load_height : float
        Share of the mass above, kg, and of its roll inertia, kg m2; height of its centre of gravity, m.
    bearers : tuple of float
        Places of the frames that bear it, from this one, m.
    """

    mass: float
    roll_inertia: float
    pitch_inertia: float
    height: float
    front: float
    rear: float
    front_stiffness: float
    rear_stiffness: float
    front_damping: float
    rear_damping: float
    primary_roll: float
    primary_roll_damping: float
    primary_height: float
    secondary_vertical: float
    secondary_lateral: float
    secondary_roll: float
    secondary_vertical_damping: float
    secondary_lateral_damping: float
    secondary_roll_damping: float
    secondary_height: float
    load: float
    load_inertia: float
    load_height: float
    bearers: tuple[float, ...] = (0.0,)


UNCERTAIN = (
    ("front_stiffness", "rear_stiffness", "primary_roll"),
    ("front_damping", "rear_damping", "primary_roll_damping"),
    ("secondary_vertical",),
    ("secondary_roll",),
    ("secondary_lateral",),
    ("secondary_vertical_damping", "secondary_roll_damping"),
    ("secondary_lateral_damping",),
    ("mass",),
    ("roll_inertia",),
    ("pitch_inertia",),
    ("load",),
    ("load_inertia",),
)
"""Numbers of a drawing that may be wrong, and which of them by the same factor."""


def changed(bogie: Bogie, names: tuple[str, ...], share: float) -> Bogie:
    """A bogie of which some numbers are larger by a share."""
    return replace(bogie, **{name: getattr(bogie, name) * (1.0 + share) for name in names})


def bogie_of(sheet: VehicleSheet, name: str) -> Bogie | None:
    """The frame of a name; None if it is not one on two axles under one body, or the drawing lacks a number.

    A body on several supports puts its mass on them as its centre of gravity lies between; what it carries
    itself is added to it.
    """
    frame = sheet.body(name)
    above = sheet.above(name)
    if frame is None or len(above) != 1 or len(frame.springs) != 2 or not _is_whole(frame):
        return None
    load = above[0]
    if not load.springs or not _is_whole(load):
        return None
    places = [support.x_m for support in load.supports]
    number = [support.on for support in load.supports].index(name)
    share, over, under = _share(places, number), load.springs[number], frame.springs
    order = sorted((0, 1), key=lambda i: -frame.supports[i].x_m)
    front, rear = (under[i] for i in order)
    assert frame.mass_kg and frame.roll_inertia_kgm2 and frame.pitch_inertia_kgm2
    assert load.roll_inertia_kgm2 and frame.height_m is not None and load.height_m is not None
    return Bogie(
        mass=frame.mass_kg,
        roll_inertia=frame.roll_inertia_kgm2,
        pitch_inertia=frame.pitch_inertia_kgm2,
        height=frame.height_m,
        front=frame.supports[order[0]].x_m,
        rear=frame.supports[order[1]].x_m,
        front_stiffness=front.vertical_npm,
        rear_stiffness=rear.vertical_npm,
        front_damping=front.vertical_nspm,
        rear_damping=rear.vertical_nspm,
        primary_roll=front.roll_nmprad + rear.roll_nmprad,
        primary_roll_damping=front.roll_nmsprad + rear.roll_nmsprad,
        primary_height=0.5 * (front.height_m + rear.height_m),
        secondary_vertical=over.vertical_npm,
        secondary_lateral=over.lateral_npm,
        secondary_roll=over.roll_nmprad,
        secondary_vertical_damping=over.vertical_nspm,
        secondary_lateral_damping=over.lateral_nspm,
        secondary_roll_damping=over.roll_nmsprad,
        secondary_height=over.height_m,
        load=share * _mass_with_load(sheet, load),
        load_inertia=share * load.roll_inertia_kgm2,
        load_height=load.height_m,
        bearers=tuple(x - places[number] for x in places),
    )


def _is_whole(body: SheetBody) -> bool:
    known = (body.mass_kg, body.roll_inertia_kgm2, body.pitch_inertia_kgm2, body.height_m)
    return None not in known


def _share(places: list[float], number: int) -> float:
    """Share of a body's weight that one of its supports bears, its centre of gravity being at 0."""
    if len(places) != 2 or places[0] == places[1]:
        return 1.0 / len(places)
    other = places[1 - number]
    return other / (other - places[number])


def _mass_with_load(sheet: VehicleSheet, body: SheetBody) -> float:
    """Mass of a body and of what rests on it."""
    total = body.mass_kg or 0.0
    for upper in sheet.bodies:
        on = [support.on for support in upper.supports]
        if body.name in on:
            places = [support.x_m for support in upper.supports]
            total += _share(places, on.index(body.name)) * _mass_with_load(sheet, upper)
    return total


class Frame(NamedTuple):
    """Spectra of a frame's motion, (f,).

    Attributes
    ----------
    y, z, roll, pitch : ndarray
        Of its centre of gravity, m and rad.
    deficiency, track_roll : ndarray
        Cant deficiency over g, and roll of the track, rad.
    ground : ndarray (4, f)
        Mean of y, roll, deficiency and track roll over all frames that bear the load.
    """

    y: ComplexArray
    z: ComplexArray
    roll: ComplexArray
    pitch: ComplexArray
    deficiency: ComplexArray
    track_roll: ComplexArray
    ground: ComplexArray


def alone(
    y: ComplexArray,
    z: ComplexArray,
    roll: ComplexArray,
    pitch: ComplexArray,
    deficiency: ComplexArray,
    track_roll: ComplexArray,
) -> Frame:
    """A frame that bears its load by itself."""
    ground = np.stack([y, roll, deficiency, track_roll])
    return Frame(y, z, roll, pitch, deficiency, track_roll, ground)


def axles_under(bogie: Bogie, frame: Frame, s: ComplexArray, gravity: float) -> ComplexArray:
    """Spectra (3, f): height of the front and of the rear axle, m, and mean roll of both, rad."""
    front, rear = _heights(bogie, frame, s)
    return np.stack([front, rear, _roll(bogie, frame, s, gravity)])


def _heights(bogie: Bogie, frame: Frame, s: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    square = s * s
    above = bogie.secondary_vertical + bogie.secondary_vertical_damping * s
    swung = bogie.load * square
    force = bogie.mass * square * frame.z + swung * above / (swung + above) * frame.z
    moment = bogie.pitch_inertia * square * frame.pitch
    base = bogie.front - bogie.rear
    on_front = -(moment + bogie.rear * force) / base
    on_rear = force - on_front
    front = frame.z - bogie.front * frame.pitch + on_front / (bogie.front_stiffness + bogie.front_damping * s)
    rear = frame.z - bogie.rear * frame.pitch + on_rear / (bogie.rear_stiffness + bogie.rear_damping * s)
    return front, rear


def _roll(bogie: Bogie, frame: Frame, s: ComplexArray, gravity: float) -> ComplexArray:
    square, g = s * s, gravity
    weight, all_weight = bogie.load * g, (bogie.load + bogie.mass) * g
    lever, h, e = (
        bogie.load_height - bogie.secondary_height,
        bogie.secondary_height - bogie.height,
        bogie.height - bogie.primary_height,
    )
    side = bogie.secondary_lateral + bogie.secondary_lateral_damping * s
    turn = bogie.secondary_roll + bogie.secondary_roll_damping * s
    turned = square * frame.track_roll
    seat = frame.y - h * frame.roll
    y, roll, deficiency, track_roll = frame.ground
    ground, ground_turned = y - h * roll, square * track_roll
    # The body above: its lateral motion and roll, by Cramer's rule.
    a11, a12 = bogie.load * square + side, side * lever
    a22 = bogie.load_inertia * square + turn + lever * lever * side - weight * lever
    b1 = side * ground - bogie.load * (g * deficiency - bogie.load_height * ground_turned) - weight * roll
    b2 = turn * roll + lever * (side * ground - weight * roll) - bogie.load_inertia * ground_turned
    over = 1.0 / (a11 * a22 - a12 * a12)
    body_y, body_roll = (b1 * a22 - a12 * b2) * over, (a11 * b2 - a12 * b1) * over
    bent = body_y + lever * body_roll - seat
    force, moment = -side * bent, turn * (frame.roll - body_roll)
    inertia = bogie.mass * (square * frame.y + g * frame.deficiency - bogie.height * turned)
    borne = inertia + force - weight * frame.roll
    torque = (
        bogie.roll_inertia * (square * frame.roll + turned)
        + moment
        - h * force
        + weight * bent
        - e * borne
        - e * all_weight * frame.roll
    )
    return np.asarray(
        frame.roll + torque / (bogie.primary_roll + bogie.primary_roll_damping * s), dtype=np.complex128
    )
