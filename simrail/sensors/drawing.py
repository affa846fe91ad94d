"""The drawing of a simulated vehicle: what its owner would know, from the model that is simulated.

Places are the true ones. How far a real train may be from its drawing stands beside them in the
`VehicleSheet`, as synthetic figures (smaller by its scale on a scale vehicle), and an estimator takes them as
uncertain.
"""

from collections import defaultdict
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from simrail.recording.sheets.vehicle_sheet import PLACE_SD_M, SheetBody, Springs, Support, VehicleSheet
from simrail.vehicle.guidance import heading_weights
from simrail.vehicle.model import VehicleModel

LEAST_SHARE = 1e-6
"""Share of the vehicle's weight below which two bodies do not carry each other."""

LEAST_SHIFT_M = 0.2
"""Distance along the track up to which a body that stiffness turns counts as pointing along its supports: a
drawing has no stiffness, and no shipped vehicle but the one whose axles yaw in rods has more than 0.13 m."""

ABREAST_M = 1e-3
"""Distance along the vehicle up to which two bodies carry a third one side by side."""


class _Bearing(NamedTuple):
    """A spring, damper or rod between two bodies, as it acts vertically.

    By body: ``x_m``, where it holds it, along the vehicle; ``load_n``, the vertical force on it, upward, at
    rest in unit gravity.
    """

    x_m: dict[str, float]
    load_n: dict[str, float]
    stiffness_npm: float
    damping_nspm: float


def drawing(vehicle: VehicleModel, *, each_by_itself: bool = False) -> VehicleSheet:
    """The drawing of a vehicle.

    Parameters
    ----------
    vehicle : VehicleModel
        The vehicle.
    each_by_itself : bool
        True for rides of the kinematic engine, where every body follows the rails at its own place and rests
        on nothing.

    Returns
    -------
    VehicleSheet
        Which body rests on which follows from the static forces of springs and of rods that are not level.
        The place is the mean of theirs, weighted by vertical stiffness: springs at four corners bear at the
        pivot in the middle between them. Primary stiffness and damping are the sums of these elements'
        vertical ones, dampers on elastic mounts as if these were rigid; tabled laws (dry friction, bump
        stops) are left out, and so are, vertically, trailing arms, which carry no weight. Where stiffness
        turns a body otherwise than its supports do (`simrail.vehicle.guidance`), that is on the drawing.

    Raises
    ------
    InputError
        If the vehicle cannot rest.
    """
    place_sd = PLACE_SD_M * vehicle.wheel_rail.profile_scale
    at = {body.name: body.position_m[0] for body in vehicle.bodies}
    if each_by_itself:
        return VehicleSheet(tuple(SheetBody(name, x) for name, x in at.items()), place_sd)
    least = LEAST_SHARE * sum(body.mass_kg for body in vehicle.bodies)
    supports: dict[str, list[Support]] = {name: [] for name in at}
    primary: dict[str, tuple[float, float]] = {}
    for (first, second), bearings in _between(_bearings(vehicle)).items():
        load = sum(bearing.load_n[second] for bearing in bearings)
        if abs(load) <= least:
            continue
        upper, lower = (second, first) if load > 0.0 else (first, second)
        place = np.average(
            [bearing.x_m[upper] for bearing in bearings],
            weights=[bearing.stiffness_npm for bearing in bearings],
        )
        # What bears abreast of another support adds nothing to the drawing.
        x = round(float(place) - at[upper], 9)
        if all(abs(x - other.x_m) > ABREAST_M for other in supports[upper]):
            supports[upper].append(Support(lower, x))
        if lower in vehicle.axle_names:
            primary[lower] = (
                primary.get(lower, (0.0, 0.0))[0] + sum(bearing.stiffness_npm for bearing in bearings),
                primary.get(lower, (0.0, 0.0))[1] + sum(bearing.damping_nspm for bearing in bearings),
            )
    bodies = {
        body.name: SheetBody(
            body.name,
            at[body.name],
            tuple(supports[body.name]),
            primary_stiffness_npm=primary.get(body.name, (None, None))[0],
            primary_damping_nspm=primary.get(body.name, (None, None))[1],
            mass_kg=body.mass_kg,
            roll_inertia_kgm2=body.inertia_kgm2[0],
            pitch_inertia_kgm2=body.inertia_kgm2[1],
            height_m=body.position_m[2],
            springs=tuple(_springs_between(vehicle, body.name, s.on) for s in supports[body.name]),
        )
        for body in vehicle.bodies
    }
    for name in vehicle.axle_names:
        if not supports[name]:
            spins = {wheel.spin for wheel in vehicle.wheels if wheel.axle == name}
            bodies[name] = replace(bodies[name], wheelset=len(spins) == 1)
    weights = heading_weights(vehicle)
    sheet = VehicleSheet(tuple(bodies[name] for name in _from_the_rails_up(supports)), place_sd)
    return replace(sheet, bodies=tuple(_with_turn(sheet, body, weights) for body in sheet.bodies))


def _springs_between(vehicle: VehicleModel, upper: str, lower: str) -> Springs:
    """All that pushes the upper of two bodies to the side, up and against roll, as the lower one stands.

    Rods and series dampers as in `_bearings`; trailing arms push to the side at their bushings.
    """
    pair = {upper, lower}
    rows: list[tuple[float, ...]] = []  # y, z, stiffness and damping along y and z
    for spring in vehicle.suspensions:
        if {spring.inner, spring.outer} == pair:
            rows.append((*spring.position_m[1:], *spring.stiffness_npm[1:], *spring.damping_nspm[1:]))
    for damper in vehicle.series:
        if {damper.inner, damper.outer} == pair:
            along = [damper.damping_nspm * (damper.axis == axis) for axis in (1, 2)]
            rows.append((*damper.position_m[1:], 0.0, 0.0, *along))
    for rod in vehicle.rods:
        if {rod.inner, rod.outer} == pair:
            share = (np.subtract(rod.outer_position_m, rod.inner_position_m)[1:] / rod.length_m) ** 2
            rows.append((*rod.inner_position_m[1:], *rod.stiffness_npm * share, *rod.damping_nspm * share))
    for arm in vehicle.arms:
        if {arm.axle, arm.frame} == pair:
            for place in arm.bushings_m:
                rows.append((*place[1:], arm.stiffness_npm[1], 0.0, arm.damping_nspm[1], 0.0))
    y, z, side, up, side_damping, up_damping = np.array(rows, dtype=np.float64).reshape(-1, 6).T
    height = float(np.average(z, weights=side if side.any() else np.ones_like(z)))
    roll, roll_damping = (
        float((vertical * y**2 + lateral * (z - height) ** 2).sum())
        for vertical, lateral in ((up, side), (up_damping, side_damping))
    )
    bars = [bar for bar in vehicle.rotations if {bar.inner, bar.outer} == pair]
    return Springs(
        lateral_npm=float(side.sum()),
        vertical_npm=float(up.sum()),
        roll_nmprad=roll + sum(bar.stiffness_nmprad[0] for bar in bars),
        lateral_nspm=float(side_damping.sum()),
        vertical_nspm=float(up_damping.sum()),
        roll_nmsprad=roll_damping + sum(bar.damping_nmsprad[0] for bar in bars),
        height_m=height,
    )


def _with_turn(sheet: VehicleSheet, body: SheetBody, weights: dict[str, dict[str, float]]) -> SheetBody:
    """A body with what turns it, where that is not the chord of its supports."""
    chord = sheet.chord(body.name)
    turned = replace(body, turned_by=tuple(weights.get(body.name, {}).items()))
    other = replace(sheet, bodies=tuple(turned if b is body else b for b in sheet.bodies)).chord(body.name)
    if not turned.turned_by or chord is None or other is None:
        return body
    return turned if abs(other.centre_m - chord.centre_m) > LEAST_SHIFT_M else body


def _bearings(vehicle: VehicleModel) -> list[_Bearing]:
    """Springs, dampers and rods, as they act vertically."""
    found = []
    for spring, force in zip(vehicle.suspensions, vehicle.preload_n(1.0), strict=True):
        place = dict.fromkeys((spring.inner, spring.outer), spring.position_m[0])
        load = {spring.inner: -float(force), spring.outer: float(force)}
        found.append(_Bearing(place, load, spring.stiffness_npm[2], spring.damping_nspm[2]))
    for damper in vehicle.series:
        ends = (damper.inner, damper.outer)
        place, load = dict.fromkeys(ends, damper.position_m[0]), dict.fromkeys(ends, 0.0)
        found.append(_Bearing(place, load, 0.0, damper.damping_nspm if damper.axis == 2 else 0.0))
    for rod, tension in zip(vehicle.rods, vehicle.rod_tension_n(1.0), strict=True):
        rise = (rod.outer_position_m[2] - rod.inner_position_m[2]) / rod.length_m
        place = {rod.inner: rod.inner_position_m[0], rod.outer: rod.outer_position_m[0]}
        load = {rod.inner: float(tension) * rise, rod.outer: -float(tension) * rise}
        found.append(_Bearing(place, load, rod.stiffness_npm * rise**2, rod.damping_nspm * rise**2))
    return found


def _between(bearings: list[_Bearing]) -> dict[tuple[str, str], list[_Bearing]]:
    """Bearings by the two bodies that they connect."""
    pairs: dict[tuple[str, str], list[_Bearing]] = defaultdict(list)
    for bearing in bearings:
        first, second = sorted(bearing.x_m)
        pairs[first, second].append(bearing)
    return pairs


def _from_the_rails_up(supports: dict[str, list[Support]]) -> list[str]:
    """Names of the bodies, each after those that it rests on."""
    placed: list[str] = []
    while len(placed) < len(supports):
        open_ones = [name for name in supports if name not in placed]
        ready = [name for name in open_ones if all(s.on in placed for s in supports[name])]
        placed += ready or open_ones[:1]
    return placed
