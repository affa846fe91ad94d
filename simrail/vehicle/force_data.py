"""A vehicle, its track and its speed profile, laid out as the arrays that the force kernel takes.

Constants travel to the kernel as arguments, never as module globals: a compiled cache does not notice
when a global changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from simrail.jit import FloatArray
from simrail.profile import SpeedProfile
from simrail.track.laid import LaidTrack
from simrail.vehicle.contact import ContactTable, build_contact, static_height
from simrail.vehicle.model import SeriesDamper, Tabled, VehicleModel
from simrail.vehicle.profile_files import profiles_of


class ForceData(NamedTuple):
    """Constants of `forces`, as contiguous float64 arrays (b bodies, m springs, w wheels, p spins).

    bodies (b, 1): mass. springs (m, 17): inner, outer, inner arm (3), outer arm (3), stiffness (3),
    damping (3), rest deflection (3). series (d, 11): inner, outer, inner arm (3), outer arm (3), axis,
    stiffness, damping. turns (r, 8): inner, outer, stiffness (3), damping (3). stops (q, 12): inner,
    outer, inner arm (3), outer arm (3), axis, 1 if over the rate, first row in laws, rows. laws (l, 5):
    start and cubic, highest power first. wheels (w, 4): axle, side, spin, radius. spins (p,): inertia.
    axles (a, 2): body, first wheel. guide (18,): body, offset, stiffness and damping along, pitch, yaw,
    gravity, profile pieces, stiffness and damping lateral, vertical, roll, height at rest, weight
    carried. switches (12,): 1 if spins are gyroscopic, 1 if the contact is prescribed, then f11, f22,
    f23, f33, conicity, vertical stiffness and damping, lateral and yaw gravitational stiffness per
    wheel, static load. drive (n, 5): start time and cubic of s(t), highest power first.
    grid (2,): start and step of `table`, the laid track. coef, const: the contact table.
    """

    bodies: FloatArray
    springs: FloatArray
    series: FloatArray
    turns: FloatArray
    stops: FloatArray
    laws: FloatArray
    wheels: FloatArray
    spins: FloatArray
    axles: FloatArray
    guide: FloatArray
    switches: FloatArray
    drive: FloatArray
    grid: FloatArray
    table: FloatArray
    coef: FloatArray
    const: FloatArray


def states_of(data: ForceData) -> int:
    """Number of first-order states: four creep states per wheel, then one per series damper."""
    return int(4 * data.wheels.shape[0] + data.series.shape[0])


def contact_of(model: VehicleModel, *, gravity_mps2: float = 9.81) -> ContactTable:
    """Contact table of a vehicle's wheels at their mean static load."""
    pair = model.wheel_rail
    return build_contact(
        *profiles_of(pair),
        gauge_m=pair.gauge_m,
        rail_inclination=pair.rail_inclination,
        wheel_radius_m=model.wheels[0].radius_m,
        tape_circle_half_m=pair.tape_circle_half_m,
        static_load_n=float(np.mean(model.wheel_load_n(gravity_mps2))),
        friction=pair.friction,
        smoothing=pair.smoothing,
        creep_law=pair.creep,
    )


def pack(model: VehicleModel, track: LaidTrack, profile: SpeedProfile, *, gravity_mps2: float) -> ForceData:
    """Lay a vehicle, a track and a speed profile out as the arrays that `forces` takes."""
    names, wheel_names = model.body_names, model.wheel_names
    preload = model.preload_n(gravity_mps2)
    springs = np.zeros((len(model.suspensions), 17))
    for row, spring, force in zip(springs, model.suspensions, preload, strict=True):
        inner, outer = names.index(spring.inner), names.index(spring.outer)
        row[0:2] = inner, outer
        row[2:5] = np.subtract(spring.position_m, model.bodies[inner].position_m)
        row[5:8] = np.subtract(spring.position_m, model.bodies[outer].position_m)
        row[8:11], row[11:14] = spring.stiffness_npm, spring.damping_nspm
        # At rest the spring is already shortened by what it carries.
        row[16] = force / spring.stiffness_npm[2] if spring.stiffness_npm[2] > 0.0 else 0.0
    spin_names = list(model.spin_inertia_kgm2)
    wheels = np.array(
        [[names.index(w.axle), w.side, spin_names.index(w.spin), w.radius_m] for w in model.wheels]
    )
    first = [wheel_names.index(next(w.name for w in model.wheels if w.axle == a)) for a in model.axle_names]
    axles = np.array([[names.index(a), i] for a, i in zip(model.axle_names, first, strict=True)], dtype=float)
    times, cubics = profile.pieces
    guide = model.guide
    held = model.body(guide.body)
    stops, laws = _stops(model)
    contact = contact_of(model, gravity_mps2=gravity_mps2)
    return ForceData(
        bodies=np.array([[body.mass_kg] for body in model.bodies]),
        springs=springs,
        series=_series(model),
        turns=_turns(model),
        stops=stops,
        laws=laws,
        wheels=np.ascontiguousarray(wheels, dtype=float),
        spins=np.array(list(model.spin_inertia_kgm2.values())),
        axles=axles,
        guide=np.array(
            [
                names.index(guide.body),
                held.position_m[0],
                guide.stiffness_npm,
                guide.damping_nspm,
                guide.pitch_stiffness_nmprad,
                guide.pitch_damping_nmsprad,
                guide.yaw_stiffness_nmprad,
                guide.yaw_damping_nmsprad,
                gravity_mps2,
                float(len(cubics)),
                guide.lateral_stiffness_npm,
                guide.lateral_damping_nspm,
                guide.vertical_stiffness_npm,
                guide.vertical_damping_nspm,
                guide.roll_stiffness_nmprad,
                guide.roll_damping_nmsprad,
                held.position_m[2] + _drop(model, contact),
                model.guide_load_n(gravity_mps2),
            ]
        ),
        switches=_switches(model, contact.static_load_n),
        drive=np.ascontiguousarray(np.column_stack([times[:-1], cubics])),
        grid=np.array([track.table_start_m, track.table_step_m]),
        table=track.table,
        coef=contact.coef,
        const=contact.const,
    )


def rest_drop_m(model: VehicleModel, *, gravity_mps2: float) -> float:
    """How much lower (negative) the wheels stand at rest than their nominal radius says."""
    if model.wheel_rail.linear is not None:
        return 0.0
    return static_height(contact_of(model, gravity_mps2=gravity_mps2))


def _drop(model: VehicleModel, contact: ContactTable) -> float:
    return 0.0 if model.wheel_rail.linear is not None else static_height(contact)


def _ends(model: VehicleModel, element: SeriesDamper | Tabled) -> list[float]:
    """Inner and outer body, both arms and the axis of a one-axis element."""
    inner, outer = model.body(element.inner), model.body(element.outer)
    return [
        float(model.body_names.index(element.inner)),
        float(model.body_names.index(element.outer)),
        *np.subtract(element.position_m, inner.position_m),
        *np.subtract(element.position_m, outer.position_m),
        float(element.axis),
    ]


def _series(model: VehicleModel) -> FloatArray:
    rows = [[*_ends(model, e), e.stiffness_npm, e.damping_nspm] for e in model.series]
    return np.array(rows, dtype=float).reshape(-1, 11)


def _turns(model: VehicleModel) -> FloatArray:
    index = model.body_names.index
    rows = [
        [index(e.inner), index(e.outer), *e.stiffness_nmprad, *e.damping_nmsprad] for e in model.rotations
    ]
    return np.array(rows, dtype=float).reshape(-1, 8)


def _stops(model: VehicleModel) -> tuple[FloatArray, FloatArray]:
    """Tabled elements and the pieces of their laws."""
    rows: list[list[float]] = []
    laws: list[FloatArray] = []
    count = 0
    for element in model.tabled:
        x, force = np.array([(0.0, 0.0), *element.points]).T
        curve = PchipInterpolator(x, force)
        last = (force[-1] - force[-2]) / (x[-1] - x[-2])
        pieces = np.vstack([np.column_stack([x[:-1], curve.c.T]), [x[-1], 0.0, 0.0, last, force[-1]]])
        rows.append([*_ends(model, element), float(element.over == "speed_mps"), count, len(pieces)])
        laws.append(pieces)
        count += len(pieces)
    return np.array(rows, dtype=float).reshape(-1, 12), np.vstack([np.zeros((0, 5)), *laws])


def _switches(model: VehicleModel, static_load_n: float) -> FloatArray:
    linear = model.wheel_rail.linear
    switches = np.zeros(12)
    switches[0] = float(model.gyroscopic)
    if linear is not None:
        switches[1:] = (
            1.0,
            linear.f11_n,
            linear.f22_n,
            linear.f23_nm,
            linear.f33_nm2,
            linear.conicity,
            linear.vertical_stiffness_npm,
            linear.vertical_damping_nspm,
            0.5 * linear.gravitational_stiffness_npm,
            0.5 * linear.gravitational_yaw_stiffness_nmprad,
            static_load_n,
        )
    return switches


def spread(parts: Sequence[FloatArray]) -> tuple[FloatArray, list[FloatArray]]:
    """Lay arrays into one, with a header that says where each begins and what shape it has.

    A compiled function takes some 0.15 us per array that it is handed; at 8,000 calls a simulated second
    one array instead of sixteen is worth it. `simrail.vehicle.exudyn_engine` takes them out again.

    Returns
    -------
    arena : ndarray (m,)
        Header of five numbers per part (offset, then the shape padded with ones to four), then the parts.
    views : list of ndarray
        The parts, as views into the arena.
    """
    head = 5 * len(parts)
    arena = np.zeros(head + sum(part.size for part in parts))
    views = []
    at = head
    for i, part in enumerate(parts):
        arena[5 * i : 5 * i + 5] = at, *part.shape, *(1,) * (4 - part.ndim)
        views.append(arena[at : at + part.size].reshape(part.shape))
        views[-1][...] = part
        at += part.size
    return arena, views
