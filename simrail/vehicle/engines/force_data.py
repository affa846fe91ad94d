"""A vehicle, its track and its speed profile, laid out as the arrays that the force kernel takes.

What a vehicle or a ride decides travels to the kernel in these arrays, never as a module's global: a compiled
cache does not notice when a global of another module changes.
"""

from dataclasses import astuple
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.track.laid_track import LaidTrack
from simrail.vehicle.contact.contact import CONTACT
from simrail.vehicle.contact.contact_geometry import CONST
from simrail.vehicle.contact.contact_tables import contacts_of, rest_drops_m
from simrail.vehicle.engines import records
from simrail.vehicle.engines.records import RecordArray
from simrail.vehicle.model import SeriesDamper, Suspension, Tabled, VehicleModel
from simrail.vehicle.speed_profile import SpeedProfile

_BRAKE_WINDUP_RAD, _BRAKE_DAMPING_S = 5e-3, 0.02
"""Angle over which a brake's torque builds up, and the damping time of its mounting."""


class ForceData(NamedTuple):
    """Constants of `forces`: arrays of the records of `simrail.vehicle.engines.records`.

    Attributes
    ----------
    bodies, springs, series, links, stops, laws, wheels, spins, axles, drive : ndarray of records
        Of each, `BODY`, `SPRING`, `SERIES`, `LINK`, `STOP`, `LAW`, `WHEEL`, `SPIN`, `AXLE`, `DRIVE`.
    guide, traction, options : ndarray of records (1,)
        `GUIDE`, `TRACTION`, `OPTIONS`.
    track : ndarray of records
        The laid track, one `TRACK` for each interval of the grid.
    patches, const : ndarray of records (k, 2, n), (k,)
        The contact tables: `simrail.vehicle.contact.contact_geometry.PATCH` and `CONST`.
    """

    bodies: RecordArray
    springs: RecordArray
    series: RecordArray
    links: RecordArray
    stops: RecordArray
    laws: RecordArray
    wheels: RecordArray
    spins: RecordArray
    axles: RecordArray
    guide: RecordArray
    traction: RecordArray
    options: RecordArray
    drive: RecordArray
    track: RecordArray
    patches: RecordArray
    const: RecordArray


class Memory(NamedTuple):
    """What `forces` remembers from call to call, and its scratch: arrays of records.

    Attributes
    ----------
    guide_memo, axle_memos : ndarray of records (1,), (a,)
        `GUIDE_MEMO` and, for each axle, `AXLE_MEMO`.
    frame : ndarray of records (1,)
        `FRAME`, overwritten at every look at the track.
    contacts : ndarray of records (w,)
        `simrail.vehicle.contact.contact.CONTACT` of each wheel: forces and penetration of the last call,
        the rest of the last call in which they were wanted.
    """

    guide_memo: RecordArray
    axle_memos: RecordArray
    frame: RecordArray
    contacts: RecordArray


def memory_of(axles: int) -> Memory:
    """A `Memory` of nothing; each axle has two wheels."""
    return Memory(
        np.zeros(1, records.GUIDE_MEMO),
        np.zeros(axles, records.AXLE_MEMO),
        np.zeros(1, records.FRAME),
        np.zeros(2 * axles, CONTACT),
    )


def states_of(data: ForceData) -> int:
    """Number of first-order states: four creep states per wheel, one per series damper, one per brake."""
    brakes = len(data.spins) if data.traction["wheels_drive"][0] else 0
    return 4 * len(data.wheels) + len(data.series) + brakes


def pack(
    model: VehicleModel,
    track: LaidTrack,
    profile: SpeedProfile,
    *,
    gravity_mps2: float,
    drive: Literal["guide", "wheels"] = "guide",
) -> ForceData:
    """Lay a vehicle, a track and a speed profile out as the arrays that `forces` takes.

    Raises
    ------
    InputError
        If the wheels shall drive a vehicle that has no traction.
    """
    index = model.body_names.index
    contacts = contacts_of(model, gravity_mps2=gravity_mps2)
    spin_names, wheel_names = list(model.spin_inertia_kgm2), model.wheel_names
    loads = model.wheel_load_n(gravity_mps2)
    wheels = [
        (index(w.axle), w.side, spin_names.index(w.spin), kind, w.radius_m, load)
        for w, kind, load in zip(model.wheels, contacts.of_wheel, loads, strict=True)
    ]
    first = [wheel_names.index(next(w.name for w in model.wheels if w.axle == a)) for a in model.axle_names]
    times, cubics = profile.pieces
    stops, laws = _stops(model)
    traction, spins = _traction(model, profile, drive)
    return ForceData(
        bodies=np.array([(body.inertia_kgm2, body.mass_kg) for body in model.bodies], records.BODY),
        springs=_springs(model, gravity_mps2),
        series=np.array(
            [(*_ends(model, e), e.axis, e.stiffness_npm, e.damping_nspm) for e in model.series],
            records.SERIES,
        ),
        links=_links(model, gravity_mps2),
        stops=stops,
        laws=laws,
        wheels=np.array(wheels, records.WHEEL),
        spins=spins,
        axles=np.array([(index(a), i) for a, i in zip(model.axle_names, first, strict=True)], records.AXLE),
        guide=_guide(model, gravity_mps2),
        traction=traction,
        options=_options(model, track, gravity_mps2),
        drive=np.array(
            list(zip(times[:-1], map(tuple, cubics), profile.directions, strict=True)), records.DRIVE
        ),
        track=_writable(track.table).reshape(len(track.table), -1).view(records.TRACK)[:, 0],
        patches=np.stack([table.patches for table in contacts.tables]),
        const=np.array([table.const for table in contacts.tables], CONST),
    )


def _writable(table: FloatArray) -> FloatArray:
    """The array that a read-only view is of: kernels would be compiled for both, and write into neither."""
    base = table.base
    return base if isinstance(base, np.ndarray) and base.shape == table.shape else table


def _springs(model: VehicleModel, gravity_mps2: float) -> RecordArray:
    """Springs; at rest one is already shortened by what it carries."""
    springs = np.zeros(len(model.suspensions), records.SPRING)
    preload = model.preload_n(gravity_mps2)
    for i, (spring, force) in enumerate(zip(model.suspensions, preload, strict=True)):
        sag = force / spring.stiffness_npm[2] if spring.stiffness_npm[2] > 0.0 else 0.0
        springs[i] = (*_ends(model, spring), spring.stiffness_npm, spring.damping_nspm, sag)
    return springs


def _links(model: VehicleModel, gravity_mps2: float) -> RecordArray:
    """Springs of rotations, rods and trailing arms. A rod that carries weight is strained by it at rest."""
    index, nowhere = model.body_names.index, np.zeros((2, 3))
    rows: list[tuple[Any, ...]] = [
        (
            *(records.ROTATION, index(e.inner), index(e.outer), nowhere, nowhere),
            *(e.stiffness_nmprad, e.damping_nmsprad, 0.0),
        )
        for e in model.rotations
    ]
    for rod, tension in zip(model.rods, model.rod_tension_n(gravity_mps2), strict=True):
        inner, outer = (
            (np.subtract(place, model.body(body).position_m), np.zeros(3))
            for body, place in ((rod.inner, rod.inner_position_m), (rod.outer, rod.outer_position_m))
        )
        factors = (rod.stiffness_npm, 0.0, 0.0), (rod.damping_nspm, 0.0, 0.0)
        length_m = rod.length_m - tension / rod.stiffness_npm
        rows.append((records.ROD, index(rod.inner), index(rod.outer), inner, outer, *factors, length_m))
    for pair in model.arms:
        ends = [np.subtract(pair.bushings_m, model.body(b).position_m) for b in (pair.axle, pair.frame)]
        factors = pair.stiffness_npm, pair.damping_nspm
        rows.append((records.ARMS, index(pair.axle), index(pair.frame), *ends, *factors, 0.0))
    return np.array(rows, records.LINK)


def _guide(model: VehicleModel, gravity_mps2: float) -> RecordArray:
    held = model.body(model.guide.body)
    body = model.body_names.index(held.name)
    height_m = held.position_m[2] + rest_drops_m(model, gravity_mps2=gravity_mps2)[body]
    _, *springs = astuple(model.guide)  # in the order of GUIDE
    row = (body, held.position_m[0], *springs, height_m, model.guide_load_n(gravity_mps2))
    return np.array([row], records.GUIDE)


def _traction(model: VehicleModel, profile: SpeedProfile, drive: str) -> tuple[RecordArray, RecordArray]:
    """The driver and his means, all zero if the guide itself drives, and the spins."""
    traction, spins = np.zeros(1, records.TRACTION), np.zeros(len(model.spin_inertia_kgm2), records.SPIN)
    spins["inertia"] = list(model.spin_inertia_kgm2.values())
    if drive == "guide":
        return traction, spins
    means = model.traction
    if means is None:
        raise InputError(
            "the wheels cannot drive a vehicle without traction",
            file=f"vehicle {model.name}",
            field="traction",
            remedy='give it a [traction], or ride with drive = "guide"',
            limit="a vehicle with traction",
        )
    _, _, *limits, _ = astuple(means)  # in the order of TRACTION
    traction[0] = (1, profile.direction, *limits, _BRAKE_WINDUP_RAD, _BRAKE_DAMPING_S)
    for i, (spin, inertia) in enumerate(model.spin_inertia_kgm2.items()):
        wheel = next(w for w in model.wheels if w.spin == spin)
        axle = model.body_names.index(wheel.axle)
        carrier = axle if means.reaction == "axle" else model.body_names.index(means.reaction)
        shares = means.driven.get(spin, 0.0), means.braked.get(spin, 0.0)
        spins[i] = (axle, carrier, inertia, wheel.radius_m, *shares)
    return traction, spins


def _ends(
    model: VehicleModel, element: Suspension | SeriesDamper | Tabled
) -> tuple[int, int, FloatArray, FloatArray]:
    """Inner and outer body of an element, and its arm on each."""
    inner, outer = model.body(element.inner), model.body(element.outer)
    return (
        model.body_names.index(element.inner),
        model.body_names.index(element.outer),
        np.subtract(element.position_m, inner.position_m),
        np.subtract(element.position_m, outer.position_m),
    )


def _stops(model: VehicleModel) -> tuple[RecordArray, RecordArray]:
    """Tabled elements and the pieces of their laws."""
    stops: list[tuple[Any, ...]] = []
    laws: list[tuple[float, FloatArray]] = []
    for element in model.tabled:
        x, force = np.array([(0.0, 0.0), *element.points]).T
        curve = PchipInterpolator(x, force)
        last = (force[-1] - force[-2]) / (x[-1] - x[-2])
        over_rate = element.over == "speed_mps"
        stops.append((*_ends(model, element), element.axis, over_rate, len(laws), len(x)))
        laws += zip(x, [*curve.c.T, np.array([0.0, 0.0, last, force[-1]])], strict=True)
    return np.array(stops, records.STOP), np.array(laws, records.LAW)


def _options(model: VehicleModel, track: LaidTrack, gravity_mps2: float) -> RecordArray:
    linear = np.zeros(9)
    if model.wheel_rail.linear is not None:
        linear[:] = astuple(model.wheel_rail.linear)  # in the order of OPTIONS
        linear[7:] *= 0.5  # the gravitational stiffnesses are a wheelset's
    switches = model.gyroscopic, model.wheel_rail.linear is not None
    row = (*switches, gravity_mps2, track.table_start_m, track.table_step_m, *linear)
    return np.array([row], records.OPTIONS)
