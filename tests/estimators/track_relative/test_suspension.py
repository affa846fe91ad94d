"""Inverse dynamics of a frame against a vehicle that is put together from energies, forwards."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from simrail.estimators.track_relative.suspension import (
    UNCERTAIN,
    Bogie,
    alone,
    axles_under,
    bogie_of,
    changed,
)

from simrail.core.jit import FloatArray
from simrail.core.toml_files import load
from simrail.recording.sheets.vehicle_sheet import VehicleSheet
from simrail.sensors.drawing import drawing
from simrail.vehicle.file import VehicleFile

G = 9.81
BOGIE = Bogie(
    mass=2100.0,
    roll_inertia=950.0,
    pitch_inertia=1200.0,
    height=0.42,
    front=1.1,
    rear=-0.8,
    front_stiffness=2.3e6,
    rear_stiffness=2.6e6,
    front_damping=15e3,
    rear_damping=19e3,
    primary_roll=1.7e6,
    primary_roll_damping=12e3,
    primary_height=0.31,
    secondary_vertical=0.8e6,
    secondary_lateral=0.31e6,
    secondary_roll=0.75e6,
    secondary_vertical_damping=31e3,
    secondary_lateral_damping=22e3,
    secondary_roll_damping=27e3,
    secondary_height=0.65,
    load=11e3,
    load_inertia=17e3,
    load_height=1.5,
)
S = 2j * np.pi * np.array([0.05, 0.4, 0.6, 1.3, 4.0, 7.0, 15.0])


def turn(angle: float) -> FloatArray:
    """From the axes of a body that rolls by an angle to those of the track, (y, z)."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def ways(x: FloatArray) -> FloatArray:
    """Deflections of the springs below (left, right) and above, along y and z of the body below each, (8,).

    ``x`` is y, z, roll of axle, frame and body, the first about the middle of the track. Springs as far apart
    as their stiffness against roll says.
    """
    b = BOGIE
    out = []
    below = np.sqrt(b.primary_roll / (b.front_stiffness + b.rear_stiffness))
    above = np.sqrt(b.secondary_roll / b.secondary_vertical)
    for lower, upper, low, high, apart, height in (
        (x[0:3], x[3:6], 0.0, b.height, below, b.primary_height),
        (x[3:6], x[6:9], b.height, b.load_height, above, b.secondary_height),
    ):
        for side in (apart, -apart):
            point = upper[:2] + [0.0, high] + turn(upper[2]) @ [side, height - high]
            out.append(turn(lower[2]).T @ (point - lower[:2] - [0.0, low]) - [side, height - low])
    return np.concatenate(out)


def energy(x: FloatArray) -> float:
    """Of springs, which bear the weight at rest, and of weight."""
    b = BOGIE
    stiff = np.array([5e6, b.front_stiffness + b.rear_stiffness] * 2)
    stiff = np.concatenate([stiff, [b.secondary_lateral, b.secondary_vertical] * 2]) / 2.0
    rest = np.array([0.0, (b.load + b.mass) * G / 2.0] * 2 + [0.0, b.load * G / 2.0] * 2)
    way = ways(x)
    return float(0.5 * (stiff * way**2).sum() - (rest * way).sum() + G * (b.mass * x[4] + b.load * x[7]))


def hessian(step: float = 1e-3) -> FloatArray:
    """Second derivatives of the energy at rest; the third difference of a smooth function is below 1e-6."""
    n = 9
    out, eye = np.empty((n, n)), step * np.eye(n)
    for i in range(n):
        for j in range(n):
            corners = [(a, b, energy(a * eye[i] + b * eye[j])) for a in (1, -1) for b in (1, -1)]
            out[i, j] = sum(a * b * value for a, b, value in corners) / (4.0 * step**2)
    return out


def test_roll_of_the_axles_is_that_which_moves_the_frame() -> None:
    """Cant deficiency and a rolling track move it as well: forwards by energies, back by the formula."""
    b = BOGIE
    jacobian = np.array([ways(1e-6 * e) - ways(-1e-6 * e) for e in np.eye(9)]).T / 2e-6
    damping = np.array(
        [0.0, b.primary_roll_damping / (b.primary_roll / (b.front_stiffness + b.rear_stiffness))] * 2
    )
    above = b.secondary_roll_damping / (b.secondary_roll / b.secondary_vertical)
    damping = np.concatenate([damping, [b.secondary_lateral_damping, above] * 2]) / 2.0
    c, k = jacobian.T @ (damping[:, None] * jacobian), hessian()
    mass = np.diag([0.0] * 3 + [b.mass, b.mass, b.roll_inertia, b.load, b.load, b.load_inertia])
    rng = np.random.default_rng(4)
    for s in S:
        axle_y, axle_roll, q, track_roll = rng.standard_normal(4) + 1j * rng.standard_normal(4)
        matrix = s**2 * mass + s * c + k
        given = np.array([axle_y, 0.0, axle_roll])
        forces = np.zeros(9, dtype=complex)
        for first, m, inertia, height in (
            (3, b.mass, b.roll_inertia, b.height),
            (6, b.load, b.load_inertia, b.load_height),
        ):
            forces[first] = -m * (G * q - height * s**2 * track_roll)
            forces[first + 2] = -inertia * s**2 * track_roll
        free = slice(3, 9)
        found = np.linalg.solve(matrix[free, free], forces[free] - matrix[free, :3] @ given)
        frame = alone(*(np.array([v]) for v in (found[0], 0.0, found[2], 0.0, q, track_roll)))
        assert axles_under(b, frame, np.array([s]), G)[2, 0] == pytest.approx(axle_roll, rel=2e-5)


def test_heights_of_the_axles_are_those_that_move_the_frame() -> None:
    """Two springs at unequal distances, a mass over them: the equations of motion, forwards."""
    b, rng = BOGIE, np.random.default_rng(5)
    for s in S:
        front, rear = rng.standard_normal(2) + 1j * rng.standard_normal(2)
        k, x = (
            np.array([b.front_stiffness + b.front_damping * s, b.rear_stiffness + b.rear_damping * s]),
            np.array([b.front, b.rear]),
        )
        over = b.secondary_vertical + b.secondary_vertical_damping * s
        # Unknown: z, pitch (nose down), height of the load.
        matrix = np.array(
            [
                [b.mass * s**2 + k.sum() + over, -(k * x).sum(), -over],
                [-(k * x).sum(), b.pitch_inertia * s**2 + (k * x * x).sum(), 0.0],
                [-over, 0.0, b.load * s**2 + over],
            ]
        )
        push = k * np.array([front, rear])
        z, pitch, _ = np.linalg.solve(matrix, np.array([push.sum(), -(push * x).sum(), 0.0]))
        frame = alone(*(np.array([v]) for v in (0.0, z, 0.0, pitch, 0.0, 0.0)))
        found = axles_under(b, frame, np.array([s]), G)[:2, 0]
        np.testing.assert_allclose(found, [front, rear], rtol=1e-9)


def sheet_of(name: str) -> VehicleSheet:
    return drawing(load(VehicleFile, "vehicle", name).model(name))


def test_a_bogie_is_read_off_its_drawing() -> None:
    """Sums by hand over the vehicle's file."""
    bogie = bogie_of(sheet_of("metro_irw_bogie"), "frame")
    assert bogie is not None
    expected = Bogie(
        mass=2000.0,
        roll_inertia=900.0,
        pitch_inertia=1100.0,
        height=0.38,
        front=0.9,
        rear=-0.9,
        front_stiffness=2.4e6,
        rear_stiffness=2.4e6,
        front_damping=16e3,
        rear_damping=16e3,
        primary_roll=2 * 2.4e6 * 0.6**2,
        primary_roll_damping=2 * 16e3 * 0.6**2,
        primary_height=0.29,
        secondary_vertical=0.8e6,
        secondary_lateral=0.3e6,
        secondary_roll=0.8e6 * 0.95**2,
        secondary_vertical_damping=30e3,
        secondary_lateral_damping=24e3,
        secondary_roll_damping=30e3 * 0.95**2,
        secondary_height=0.6,
        load=12e3,
        load_inertia=18e3,
        load_height=1.45,
    )
    for entry in fields(Bogie):
        assert getattr(bogie, entry.name) == pytest.approx(getattr(expected, entry.name)), entry.name


def test_a_coach_is_borne_by_both_bogies_and_a_module_by_its_neighbours() -> None:
    coach = bogie_of(sheet_of("manchester_1"), "frame_front")
    assert coach is not None
    assert (coach.load, coach.load_inertia) == (16e3, 28.4e3)
    assert coach.bearers == (0.0, -19.0)
    sheet = sheet_of("manchester_1")
    body = sheet.body("body")
    assert body is not None
    # The front bogie 6 m before the centre of gravity, the rear one 13 m behind: 13/19 of the weight.
    moved = replace(body, supports=tuple(replace(s, x_m=s.x_m - 3.5) for s in body.supports))
    other = replace(sheet, bodies=tuple(moved if b is body else b for b in sheet.bodies))
    ahead = bogie_of(other, "frame_front")
    assert ahead is not None and ahead.load == pytest.approx(32e3 * 13.0 / 19.0)
    end = bogie_of(sheet_of("metro_irw_train"), "frame_front")
    assert end is not None and end.load == 10e3 + 3e3  # half of the module that hangs between


def test_what_a_drawing_lacks_is_not_made_up() -> None:
    sheet = sheet_of("metro_irw_bogie")
    assert bogie_of(sheet, "front") is None and bogie_of(sheet, "body") is None
    assert bogie_of(sheet, "nothing") is None
    for name, lacking in (("frame", {"springs": ()}), ("body", {"mass_kg": None}), ("body", {"springs": ()})):
        bodies = tuple(replace(b, **lacking) if b.name == name else b for b in sheet.bodies)
        assert bogie_of(replace(sheet, bodies=bodies), "frame") is None


def test_every_stiffness_damping_mass_and_inertia_may_err() -> None:
    sure = {"bearers", "height", "front", "rear", "primary_height", "secondary_height", "load_height"}
    assert {name for names in UNCERTAIN for name in names} == {entry.name for entry in fields(Bogie)} - sure
    assert changed(BOGIE, ("load",), 0.1).load == pytest.approx(1.1 * BOGIE.load)
