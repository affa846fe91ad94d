"""The fields of currents and steel against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrail.sensors.magnetic_surroundings import (
    Steel,
    Traction,
    dipole_field,
    line_field,
    steel_field,
    structures,
    traction_field,
)


@pytest.mark.parametrize(("y", "z"), [(0.0, -4.9), (2.0, 0.0), (-3.0, 4.0)])
def test_a_conductors_field_is_amperes(y, z):
    current = 630.0
    field = line_field(np.array([[y, z]]), current)[0]
    distance = np.hypot(y, z)
    assert np.linalg.norm(field) == pytest.approx(
        4e-7 * np.pi * current / (2.0 * np.pi * distance), rel=1e-12
    )
    # Right-hand rule about +X: e_x x away.
    np.testing.assert_allclose(
        field / np.linalg.norm(field), np.cross([1.0, 0.0, 0.0], [0.0, y, z]) / distance, atol=1e-12
    )


def test_a_conductors_circulation_is_mu0_times_current():
    around = np.linspace(0.0, 2.0 * np.pi, 2001)
    path = np.column_stack([1.0 + 2.0 * np.cos(around), 0.3 + 2.0 * np.sin(around)])
    field = line_field(path, 100.0)[:, 1:]
    middle = 0.5 * (field[1:] + field[:-1])
    assert np.sum(middle * np.diff(path, axis=0)) == pytest.approx(4e-7 * np.pi * 100.0, rel=1e-4)


def test_return_current_closes_the_loop():
    """No net current: far away the field falls off faster than that of one conductor (1/d^2)."""
    traction = Traction(share=1.0)
    near, far = (
        np.linalg.norm(traction_field(np.array([[d, 0.0]]), traction, np.array([500.0]))[0])
        for d in (300.0, 600.0)
    )
    assert far / near == pytest.approx(0.25, rel=0.03)
    # In the middle between the rails their fields cancel; what is left is the wire's.
    middle = traction_field(np.array([[0.0, 0.0]]), traction, np.array([500.0]))[0]
    np.testing.assert_allclose(middle, [0.0, 2e-7 * 500.0 / 5.5, 0.0], atol=1e-18)
    third = traction_field(np.array([[0.0, 0.0]]), replace(traction, supply="third_rail"), np.array([500.0]))[
        0
    ]
    assert np.linalg.norm(third) == pytest.approx(2e-7 * 500.0 / np.hypot(1.4, 0.15), rel=1e-12)
    half = traction_field(np.array([[0.0, 0.6]]), Traction(), np.array([500.0]))
    np.testing.assert_allclose(
        2.0 * half, traction_field(np.array([[0.0, 0.6]]), traction, np.array([500.0]))
    )


def test_line_current_is_power_over_voltage():
    traction = Traction(voltage_v=750.0, efficiency=0.8, auxiliary_w=15e3, mass_kg=40e3, resistance_n=2000.0)
    speed, acceleration = np.array([0.0, 10.0, 10.0, 10.0]), np.array([0.0, 1.0, 0.0, -1.0])
    expected = (
        np.array([0.0, (40e3 + 2e3) * 10 / 0.8, 2e3 * 10 / 0.8, -(40e3 - 2e3) * 10 * 0.8]) + 15e3
    ) / 750.0
    np.testing.assert_allclose(traction.current_a(speed, acceleration), expected, rtol=1e-12)
    # The mirrored ride draws the same.
    np.testing.assert_allclose(traction.current_a(-speed, -acceleration), expected, rtol=1e-12)
    braking = replace(traction, regenerative=False).current_a(speed[3:], acceleration[3:])
    assert braking == pytest.approx(20.0)


def test_a_dipoles_field_is_the_textbooks():
    moment = np.array([0.0, 0.0, 1000.0])
    axial = dipole_field(np.array([[0.0, 0.0, 2.0]]), moment)[0]
    beside = dipole_field(np.array([[2.0, 0.0, 0.0]]), moment)[0]
    np.testing.assert_allclose(axial, [0.0, 0.0, 1e-7 * 2.0 * 1000.0 / 8.0], rtol=1e-12)
    np.testing.assert_allclose(beside, [0.0, 0.0, -1e-7 * 1000.0 / 8.0], rtol=1e-12)


def test_far_structures_are_left_out_only_where_they_are_nothing():
    steel = Steel(track_seed=7)
    position = np.linspace(100.0, 300.0, 500)
    place = np.broadcast_to([0.0, 0.6], (500, 2))
    whole = np.zeros((500, 3))
    for s, y, z, *moment in structures(steel, (0.0, 500.0)):
        whole += dipole_field(np.column_stack([position - s, place - [y, z]]), np.array(moment))
    assert np.abs(steel_field(position, place, steel, (0.0, 500.0)) - whole).max() < 20e-9


def test_structures_stand_on_both_sides_alike():
    _, y, z, *_ = structures(Steel(track_seed=3), (100.0, 40_100.0)).T
    n = len(y)
    assert np.mean(y > 0.0) == pytest.approx(0.5, abs=4.0 * 0.5 / np.sqrt(n))
    for values, (low, high) in ((np.abs(y), (1.8, 4.0)), (z, (-0.5, 5.0))):
        assert values.mean() == pytest.approx(0.5 * (low + high), abs=4.0 * (high - low) / np.sqrt(12.0 * n))
