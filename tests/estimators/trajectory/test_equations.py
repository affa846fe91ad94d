"""The project's own derivation of what the trajectory smoother measures, by sympy from rotation matrices.

Nothing of EQUATIONS or of paper 001 is taken over: specific force and body rate follow here from
C = Rz Ry Rx and differentiation, and their first order from Taylor's series. Then the code is asked; the
kernels are asked in symbols, by running their Python on arrays of sympy's.
"""

from __future__ import annotations

from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import sympy as sp
from simrail.estimators.trajectory.kernel import TERMS, constant_rows, linearise
from simrail.estimators.trajectory.model import beyond_first_order, jacobian_slips, track_terms
from taylor_pieces import taylor_pieces
from turning import rotation, turning
from twins.trajectory import measured as measured_by_vectors

t, s, g, small = sp.symbols("t s g small", real=True)
STATE = sp.symbols("roll roll_rate pitch pitch_rate yaw yaw_rate y yd ydd z zd zdd", real=True)
TRACK = sp.symbols(TERMS, real=True)


def first_order(expression: sp.Matrix) -> sp.Matrix:
    """Taylor's series in `small` up to its first power, at small = 1."""
    return expression.subs(small, 0) + expression.diff(small).subs(small, 0)


@lru_cache
def derived() -> tuple[sp.Matrix, sp.Matrix]:
    """The eight measurements, of first order in the angles, and their Jacobian."""
    roll, roll_rate, pitch, pitch_rate, yaw, yaw_rate, y, yd, ydd, z, zd, zdd = STATE
    moving = [sp.Function(name)(t) for name in "abc"]
    rates = turning(rotation(*moving), t)
    for function, rate in zip(moving, (roll_rate, pitch_rate, yaw_rate), strict=True):
        rates = rates.subs(function.diff(t), rate)
    body_rate = rates.subs(dict(zip(moving, (small * roll, small * pitch, yaw), strict=True)))

    origin, of_y, of_z, twice = (sp.Matrix(TRACK[at : at + 3]) for at in (3, 6, 9, 12))
    a = origin + of_y * y + of_z * z + twice.cross(sp.Matrix([0, yd, zd])) + sp.Matrix([0, ydd, zdd])
    rho = [small * (angle - base) for angle, base in zip((roll, pitch, yaw), TRACK[:3], strict=True)]
    gravity = rotation(small * roll, small * pitch, yaw).T * sp.Matrix([0, 0, g])
    force = first_order(rotation(*rho).T * a) + first_order(gravity)
    rows = sp.Matrix([*first_order(body_rate), *force, y, z])
    return rows, rows.jacobian(STATE)


def kernel_in_symbols() -> tuple[sp.Matrix, sp.Matrix]:
    x, track = np.array(STATE, dtype=object), np.array([TRACK], dtype=object)
    value, rows = np.zeros(8, dtype=object), np.zeros((8, 16), dtype=object)
    constant_rows.py_func(rows)
    rows[rows == 1.0] = 1  # sympy tells a float from an integer
    linearise.py_func(x, track, np.empty((0, 3)), 0, g, value, rows)
    assert not rows[:, 12:].any()
    return sp.Matrix(value), sp.Matrix(rows[:, :12])


def test_kernel_measures_what_is_derived_exactly() -> None:
    value, jacobian = derived()
    ours, our_jacobian = kernel_in_symbols()
    assert sp.simplify(sp.expand(ours - value)) == sp.zeros(8, 1)
    assert sp.simplify(sp.expand(our_jacobian - jacobian)) == sp.zeros(8, 12)
    assert sum(entry != 0 for entry in our_jacobian) == 35


@pytest.fixture(scope="module")
def somewhere() -> tuple[np.ndarray, np.ndarray]:
    """A state and terms of the track with nothing zero."""
    rng = np.random.default_rng(7)
    return 0.3 * rng.standard_normal(12), rng.standard_normal(15)


def kernel_at(
    x: np.ndarray, track: np.ndarray, slips: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    value, rows = np.zeros(8), np.zeros((8, 16))
    constant_rows(rows)
    linearise(x, track[None], np.empty((0, 3)) if slips is None else slips[None], 0, 9.81, value, rows)
    return value, rows[:, :12]


def test_jacobian_equals_finite_differences(somewhere: tuple[np.ndarray, np.ndarray]) -> None:
    """Central differences of what is at most quadratic in the state are exact but for rounding."""
    x, track = somewhere
    step = 1e-3
    differences = [
        (kernel_at(x + e, track)[0] - kernel_at(x - e, track)[0]) / (2.0 * step) for e in step * np.eye(12)
    ]
    np.testing.assert_allclose(kernel_at(x, track)[1], np.column_stack(differences), rtol=0, atol=1e-8)


def test_the_twin_by_vectors_is_the_same(somewhere: tuple[np.ndarray, np.ndarray]) -> None:
    for ours, theirs in zip(kernel_at(*somewhere), measured_by_vectors(*somewhere, 9.81), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-13)


# A track with everything in it at once, a ride on it, and a body that moves in its frame.
ANGLES = (
    sp.Rational(8, 100) * sp.sin(s / 31 + sp.Rational(1, 3)),
    sp.Rational(3, 100) * sp.cos(s / 47),
    sp.Rational(7, 10) * sp.sin(s / 60) + s / 400,
)
RIDE = 40 + 12 * t - sp.Rational(9, 20) * t**2 + sp.Rational(1, 50) * t**3
PLACE = (sp.Rational(35, 100) + sp.sin(3 * t) / 90, sp.Rational(8, 10) + sp.cos(2 * t) / 70)
TIMES = np.array([0.0, 1.7, 4.0, 9.0, 14.0])


@lru_cache
def frame() -> SimpleNamespace:
    """The track's frame at the times, k straight from the rotation matrix."""
    k = turning(rotation(*ANGLES), s)
    parts = [sp.Matrix(ANGLES), sp.Matrix(ANGLES).diff(s), sp.Matrix(ANGLES).diff(s, 2), k, k.diff(s)]
    places = [float(RIDE.subs(t, time)) for time in TIMES]
    values = [np.array([sp.lambdify(s, part, "numpy")(x).ravel() for x in places]) for part in parts]
    angles, rates, second, k_values, dk = values
    roll, pitch, yaw = angles.T
    return SimpleNamespace(
        roll_rad=roll, pitch_rad=pitch, yaw_rad=yaw, rates=rates, second=second, k=k_values, dk=dk
    )


@lru_cache
def recording() -> SimpleNamespace:
    columns = [sp.lambdify(t, RIDE.diff(t, order), "numpy") for order in range(3)]
    data = np.array([[column(time) for column in columns] for time in TIMES])
    pieces = taylor_pieces(ANGLES, s, np.array([float(RIDE.subs(t, time)) for time in TIMES]))
    data[:, 0] = pieces.starts  # to the last bit
    track = SimpleNamespace(start_m=0.0, end_m=1e4, on_track=np.asarray, pieces=pieces)
    odometry = pd.DataFrame(data, columns=["position_m", "speed_mps", "acceleration_mps2"])
    return SimpleNamespace(track=track, odometry=odometry)


def test_terms_of_the_track_give_the_acceleration_of_a_body_that_moves_in_it() -> None:
    """Second derivative of the global position, in the axes of the track, to rounding."""
    roll, pitch, yaw = (angle.subs(s, RIDE) for angle in ANGLES)
    c = rotation(roll, pitch, yaw)
    line = sp.Matrix([sp.cos(yaw), sp.sin(yaw), -sp.tan(pitch)]) * RIDE.diff(t)
    arm = (c * sp.Matrix([0, *PLACE])).diff(t, 2)
    function = sp.lambdify(t, [c, line.diff(t) + arm], "numpy", cse=True)
    states = sp.lambdify(t, [PLACE[0].diff(t, i) for i in range(3)] + [PLACE[1].diff(t, i) for i in range(3)])
    terms = track_terms(recording(), frame())
    for k, time in enumerate(TIMES):
        axes, acceleration = function(time)
        x = np.zeros(12)
        x[:6:2], x[6:] = terms[k, :3], states(time)
        # A body that is turned as the track is: gravity's share is taken off again.
        value, _ = kernel_at(x, terms[k])
        force = value[3:6] - 9.81 * np.array([-x[2], x[0], 1.0])
        np.testing.assert_allclose(force, axes.T @ acceleration.ravel(), rtol=0, atol=1e-12)


def test_what_is_beyond_first_order_makes_the_design_exact() -> None:
    """A body that keeps to the design: first order and what is beyond it give rates and gravity exactly."""
    speed = recording().odometry["speed_mps"].to_numpy()
    angles = np.column_stack([frame().roll_rad, frame().pitch_rad, frame().yaw_rad])
    beyond = beyond_first_order(angles, speed[:, None] * frame().rates, 9.81)
    for k in range(len(TIMES)):
        x = np.zeros(12)
        x[:6:2], x[1:6:2] = (
            (frame().roll_rad[k], frame().pitch_rad[k], frame().yaw_rad[k]),
            speed[k] * frame().rates[k],
        )
        value, _ = kernel_at(x, np.array([*x[:6:2], *np.zeros(12)]))
        c = np.array(rotation(*x[:6:2]), dtype=float)
        np.testing.assert_allclose(value[:3] + beyond[k, :3], speed[k] * frame().k[k], rtol=0, atol=1e-13)
        np.testing.assert_allclose(value[3:6] + beyond[k, 3:], 9.81 * c[2], rtol=0, atol=1e-13)
    assert np.abs(beyond[:, 5]).max() > 0.01


# What the appendix of paper 001 prints, typed off it; rho_tw, rho_v, rho_h, and rho_h'.
V, A, TW, RV, RH, RH1 = sp.symbols("V A tw v h h1", real=True)


def printed() -> tuple[sp.Matrix, sp.Matrix]:
    """Rows 4 to 6 of g and of J as printed; J's columns in the paper's numbers."""
    pb, _, tb, _, sb, _, y, yd, ydd, z, zd, zdd = STATE
    pt, tt, st = TRACK[:3]
    p, e, f = pb - pt, tb - tt, sb - st
    turned, spun = V**2 * (TW * RV - RH1) - RH * A, RV * RH * V**2
    g4 = (turned - f * V**2 * (TW**2 + RH**2) - e * (spun + TW * A)) * y
    g4 += (-2 * RH * V - 2 * TW * V * e) * yd + f * ydd
    g4 += (RV * A + TW * RH * V**2 + f * (spun - TW * A) + e * (TW**2 + RH**2) * V**2) * z
    g4 += (2 * RV * V - 2 * f * TW * V) * zd - e * zdd
    g4 += -g * tb + f * RH * V**2 + e * RV * V**2 + A
    g5 = (-f * turned - V**2 * (TW**2 + RH**2) + p * (spun + TW * A)) * y
    g5 += (2 * RH * V * f + 2 * TW * V * p) * yd + ydd
    g5 += (-f * (RV * A + TW * RH * V**2) + spun - TW * A - V**2 * p * (TW**2 + RH**2)) * z
    g5 += (-2 * RV * V * f - 2 * TW * V) * zd + p * zdd
    g5 += g * pb - f * A - p * RV * V**2 + RH * V**2
    g6 = (e * turned + p * V**2 * (TW**2 + RH**2) + spun + TW * A) * y
    g6 += (-2 * RH * V * e + 2 * TW * V) * yd - p * ydd
    g6 += (e * (RV * A + TW * RH * V**2) - p * (spun - TW * A) - V**2 * (TW**2 + RH**2)) * z
    g6 += (2 * e * RV * V + 2 * p * TW * V) * zd + zdd
    g6 += e * A - p * RH * V**2 - RV * V**2 + g
    rows = sp.Matrix([g4, g5, g6])
    j = rows.jacobian(STATE)
    j[0, 2] = -y * (spun + TW * A) - 2 * TW * V * yd + z * V**2 * (TW**2 + RH**2) - zdd - g + RV * V
    j[1, 9] = -f * (RV * A + TW * RH * V**2) + spun - TW * A - V**2 * p * TW**2 + RH**2
    j[2, 0] = V**2 * (TW**2 + RH**2) * y + ydd + (TW * A - spun) * z + 2 * TW * V * zd - RH * V**2
    return rows, j


def test_printed_is_what_paper_001_prints(somewhere: tuple[np.ndarray, np.ndarray]) -> None:
    """Appendix 1 with the track's angle rates for curvatures, g4C, g5C, g6C, J43, J5,10 and J61 included."""
    x, _ = somewhere
    terms = track_terms(recording(), frame(), printed=True)
    odometry = recording().odometry
    speed, push = odometry["speed_mps"].to_numpy(), odometry["acceleration_mps2"].to_numpy()
    slips = jacobian_slips(frame(), speed)
    names = (STATE, TRACK[:3], (V, A, TW, RV, RH, RH1, g))
    function = sp.lambdify(names, list(printed()), "numpy")
    for k in range(len(TIMES)):
        at = (speed[k], push[k], *frame().rates[k], frame().second[k, 2], 9.81)
        value, jacobian = function(x, terms[k, :3], at)
        ours, rows = kernel_at(x, terms[k], slips[k])
        np.testing.assert_allclose(ours[3:6], value.ravel(), rtol=0, atol=1e-12)
        np.testing.assert_allclose(rows[3:6], jacobian, rtol=0, atol=1e-12)
        _, by_vectors = measured_by_vectors(x, terms[k], 9.81, slips[k])
        np.testing.assert_allclose(by_vectors[3:6], jacobian, rtol=0, atol=1e-12)
        _, right = kernel_at(x, track_terms(recording(), frame())[k])
        assert np.abs(right[3:6] - jacobian).max() > 0.01
