"""A vehicle, its track and its speed profile, laid out as the arrays that the force kernel takes.

Constants travel to the kernel as arguments, never as module globals: a compiled cache does not notice
when a global changes.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.track.laid_track import LaidTrack
from simrail.vehicle.contact.contact_tables import contacts_of, rest_drops_m
from simrail.vehicle.model import SeriesDamper, Tabled, VehicleModel
from simrail.vehicle.speed_profile import SpeedProfile

DRIVER = 18
"""Where in `ForceData.guide` the constants of `simrail.vehicle.engines.traction_forces` begin."""


class ForceData(NamedTuple):
    """Constants of `forces`, as contiguous float64 arrays (b bodies, m springs, w wheels, p spins).

    bodies (b, 1): mass. springs (m, 17): inner, outer, inner arm (3), outer arm (3), stiffness (3),
    damping (3), rest deflection (3). series (d, 11): inner, outer, inner arm (3), outer arm (3), axis,
    stiffness, damping. turns (r, 8): inner, outer, stiffness (3), damping (3). stops (q, 12): inner,
    outer, inner arm (3), outer arm (3), axis, 1 if over the rate, first row in laws, rows. laws (l, 5):
    start and cubic, highest power first. wheels (w, 6): axle, side, spin, radius, contact table, static
    load. spins (p, 6): inertia, axle, wheel radius, share of traction, share of braking, body that
    carries motor and brake. axles (a, 2): body, first wheel. guide (29,): body, offset, stiffness and
    damping along, pitch, yaw, gravity, profile pieces, stiffness and damping lateral, vertical, roll,
    height at rest, weight carried; then the driver's: 1 if the wheels drive and not the guide, direction
    of travel, greatest tractive effort, power, braking effort, gain on the speed's error, gain on the
    place's, catch-up speed, creepage of the slide protection (0: none), windup angle and damping time of
    the brakes. switches (11,): 1 if spins are gyroscopic, 1 if the contact is prescribed, then f11, f22,
    f23, f33, conicity, vertical stiffness and damping, lateral and yaw gravitational stiffness per
    wheel. drive (n, 5): start time and cubic of s(t), highest power first. grid (2,): start and step of
    `table`, the laid track. coef (k, 2, n, 10, 4), const (k, 21): the contact tables.

    Whoever adds an array here adds to every call of the kernel: two more made it a third slower.
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
    """Number of first-order states: four creep states per wheel, one per series damper, one per brake."""
    brakes = data.spins.shape[0] if data.guide[DRIVER] else 0
    return int(4 * data.wheels.shape[0] + data.series.shape[0] + brakes)


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
    contacts = contacts_of(model, gravity_mps2=gravity_mps2)
    loads = model.wheel_load_n(gravity_mps2)
    wheels = np.array(
        [
            [names.index(w.axle), w.side, spin_names.index(w.spin), w.radius_m, kind, load]
            for w, kind, load in zip(model.wheels, contacts.of_wheel, loads, strict=True)
        ]
    )
    first = [wheel_names.index(next(w.name for w in model.wheels if w.axle == a)) for a in model.axle_names]
    axles = np.array([[names.index(a), i] for a, i in zip(model.axle_names, first, strict=True)], dtype=float)
    times, cubics = profile.pieces
    guide = model.guide
    held = model.body(guide.body)
    stops, laws = _stops(model)
    drop = rest_drops_m(model, gravity_mps2=gravity_mps2)[names.index(guide.body)]
    traction, spins = _traction(model, profile, drive)
    return ForceData(
        bodies=np.array([[body.mass_kg] for body in model.bodies]),
        springs=springs,
        series=_series(model),
        turns=_turns(model),
        stops=stops,
        laws=laws,
        wheels=np.ascontiguousarray(wheels, dtype=float),
        spins=spins,
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
                held.position_m[2] + drop,
                model.guide_load_n(gravity_mps2),
                *traction,
            ]
        ),
        switches=_switches(model),
        drive=np.ascontiguousarray(np.column_stack([times[:-1], cubics])),
        grid=np.array([track.table_start_m, track.table_step_m]),
        table=track.table,
        coef=np.stack([table.coef for table in contacts.tables]),
        const=np.stack([table.const for table in contacts.tables]),
    )


def _traction(model: VehicleModel, profile: SpeedProfile, drive: str) -> tuple[FloatArray, FloatArray]:
    """The driver's part of the guide, all zero if the guide itself drives, and the rows of the spins."""
    traction, spins = np.zeros(11), np.zeros((len(model.spin_inertia_kgm2), 6))
    spins[:, 0] = list(model.spin_inertia_kgm2.values())
    if drive == "guide":
        return traction, spins
    made = model.traction
    if made is None:
        raise InputError(
            "the wheels cannot drive a vehicle without traction",
            file=f"vehicle {model.name}",
            field="traction",
            remedy='give it a [traction], or ride with drive = "guide"',
        )
    traction[:] = (
        1.0,
        profile.direction,
        made.tractive_effort_n,
        made.power_w,
        made.braking_effort_n,
        made.speed_gain_nspm,
        made.position_gain_1ps,
        made.catch_up_mps,
        made.slide_protection_creepage,
        made.brake_windup_rad,
        made.brake_damping_s,
    )
    driven, braked = dict(made.driven), dict(made.braked)
    for row, spin in zip(spins, model.spin_inertia_kgm2, strict=True):
        wheel = next(w for w in model.wheels if w.spin == spin)
        axle = model.body_names.index(wheel.axle)
        carrier = axle if made.reaction == "axle" else model.body_names.index(made.reaction)
        row[1:] = axle, wheel.radius_m, driven.get(spin, 0.0), braked.get(spin, 0.0), carrier
    return traction, spins


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


def _switches(model: VehicleModel) -> FloatArray:
    linear = model.wheel_rail.linear
    switches = np.zeros(11)
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
        )
    return switches
