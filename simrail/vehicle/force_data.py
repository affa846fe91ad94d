"""A vehicle, its track and its speed profile, laid out as the arrays that the force kernel takes.

Constants travel to the kernel as arguments, never as module globals: a compiled cache does not notice
when a global changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from simrail.jit import FloatArray
from simrail.profile import SpeedProfile
from simrail.track.laid import LaidTrack
from simrail.vehicle.contact import ContactTable, build_contact, static_height
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.profiles import rail_60e1, s1002

WHEEL_PROFILES = {"S1002": s1002}
RAIL_PROFILES = {"60E1": rail_60e1}


class ForceData(NamedTuple):
    """Constants of `forces`, as contiguous float64 arrays (b bodies, m springs, w wheels, p spins).

    bodies (b, 1): mass. springs (m, 17): inner, outer, inner arm (3), outer arm (3), stiffness (3),
    damping (3), rest deflection (3). wheels (w, 4): axle, side, spin, radius. spins (p,): inertia.
    axles (a, 2): body, first wheel. guide (10,): body, offset, stiffness and damping along, pitch, yaw,
    gravity, profile pieces. drive (n, 5): start time and cubic of s(t), highest power first.
    grid (2,): start and step of `table`, the laid track. coef, const: the contact table.
    """

    bodies: FloatArray
    springs: FloatArray
    wheels: FloatArray
    spins: FloatArray
    axles: FloatArray
    guide: FloatArray
    drive: FloatArray
    grid: FloatArray
    table: FloatArray
    coef: FloatArray
    const: FloatArray


def contact_of(model: VehicleModel, *, gravity_mps2: float = 9.81) -> ContactTable:
    """Contact table of a vehicle's wheels at their mean static load."""
    pair = model.wheel_rail
    return build_contact(
        WHEEL_PROFILES[pair.wheel_profile](),
        RAIL_PROFILES[pair.rail_profile](),
        gauge_m=pair.gauge_m,
        rail_inclination=pair.rail_inclination,
        wheel_radius_m=model.wheels[0].radius_m,
        static_load_n=float(np.mean(model.wheel_load_n(gravity_mps2))),
        friction=pair.friction,
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
    contact = contact_of(model, gravity_mps2=gravity_mps2)
    return ForceData(
        bodies=np.array([[body.mass_kg] for body in model.bodies]),
        springs=springs,
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
            ]
        ),
        drive=np.ascontiguousarray(np.column_stack([times[:-1], cubics])),
        grid=np.array([track.table_start_m, track.table_step_m]),
        table=track.table,
        coef=contact.coef,
        const=contact.const,
    )


def rest_drop_m(model: VehicleModel, *, gravity_mps2: float) -> float:
    """How much lower (negative) the wheels stand at rest than their nominal radius says."""
    return static_height(contact_of(model, gravity_mps2=gravity_mps2))


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
