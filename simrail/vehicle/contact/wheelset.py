"""Readings of a contact table for two wheels on one axle: conicity, rolling radii, and the push of gravity.

For plots, reports and checks. Everything here asks the same compiled kernel that a ride uses, at
rest, so that what is read is what acts.

Not here: making tables, forces in motion.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.vehicle.contact.contact import Motion, RailHere, WheelForce, read_patch, wheel_force
from simrail.vehicle.contact.contact_geometry import ContactTable


def contact_state(
    table: ContactTable,
    side: float,
    *,
    y_m: float,
    z_m: float,
    roll_rad: float = 0.0,
    yaw_rad: float = 0.0,
    y_rail_m: float = 0.0,
    z_rail_m: float = 0.0,
) -> dict[str, dict[str, float]]:
    """Where and how hard a wheel at rest touches its rail.

    Parameters
    ----------
    table : ContactTable
    side : float
        +1 left wheel, -1 right wheel.
    y_m, z_m, roll_rad, yaw_rad : float
        Pose of the axle's centre relative to its nominal place in the track frame.
    y_rail_m, z_rail_m : float
        Deviation of this rail.

    Returns
    -------
    dict
        ``"tread"`` and ``"flange"``, each with ``penetration_m`` (vertical, negative when apart),
        ``slope`` (tangent of the contact angle), ``abscissa_m`` and ``radius_m`` of the contact on
        the wheel, and ``normal_n``.
    """
    motion, rail = Motion(y_m, z_m, roll_rad, yaw_rad), RailHere(0.0, y_rail_m, z_rail_m)
    state = {}
    for patch, name in enumerate(("tread", "flange")):
        touch = read_patch(table.patches, table.const, side, patch, motion, rail)
        approach = max(touch.penetration, 0.0) / np.hypot(1.0, touch.slope)
        state[name] = {
            "penetration_m": touch.penetration,
            "slope": touch.slope,
            "abscissa_m": touch.abscissa,
            "radius_m": touch.radius,
            "normal_n": float(table.const["hertz_npm15"] * approach**1.5),
        }
    return state


class WheelsetAtRest(NamedTuple):
    """A wheelset pushed sideways on straight track, each wheel under its static load.

    Arrays of the shape of ``y_m``: pose; rolling radii (the two patches weighed by their forces);
    lateral force of the two normal forces on the wheelset (negative pushes to the right).
    """

    y_m: FloatArray
    z_m: FloatArray
    roll_rad: FloatArray
    radius_left_m: FloatArray
    radius_right_m: FloatArray
    lateral_n: FloatArray


def push_sideways(table: ContactTable, y_m: FloatArray) -> WheelsetAtRest:
    """Pose, radii and lateral normal force of a wheelset at the lateral displacements ``y_m``.

    Parameters
    ----------
    table : ContactTable
    y_m : ndarray
        Lateral displacements of the wheelset, m, positive to the left.

    Returns
    -------
    WheelsetAtRest

    Raises
    ------
    InputError
        If a displacement lies beyond the flange.
    """
    y = np.atleast_1d(np.asarray(y_m, dtype=float))
    half, load = table.const["tape_circle_half_m"], table.static_load_n
    patches, rail = table.patches, RailHere(table.const["friction"])
    rest, zeta, rate = np.empty((5, y.size)), np.zeros(4), np.zeros(4)

    def vertical(side: float, at: float, lift: float, roll: float) -> WheelForce:
        force = wheel_force(patches, table.const, side, Motion(at, lift, roll), rail, zeta, rate)
        if force.flag < 0:
            raise InputError(
                "the wheelset is off the rails",
                field="y_m",
                value=at,
                limit=f"|y| < {table.const['derailed_shift_m']:.4f} m",
            )
        return force

    left, right = 0.0, 0.0  # heights of the two wheels
    for i, at in enumerate(y):
        for _ in range(60):
            lift, roll = 0.5 * (left + right), 0.5 * (left - right) / half
            forces = [vertical(side, at, lift, roll) for side in (1.0, -1.0)]
            # Newton per wheel on penetration, whose load grows with its 1.5th power.
            steps = [
                f.penetration * (1.0 - (load / f.fz) ** (2.0 / 3.0)) if f.fz > 0.0 else f.penetration - 1e-5
                for f in forces
            ]
            left, right = left + np.clip(steps[0], -1e-3, 1e-3), right + np.clip(steps[1], -1e-3, 1e-3)
            if max(abs(steps[0]), abs(steps[1])) < 1e-13:
                break
        radii = []
        for side in (1.0, -1.0):
            touching = contact_state(table, side, y_m=at, z_m=lift, roll_rad=roll).values()
            total = sum(p["normal_n"] for p in touching)
            radii.append(sum(p["normal_n"] * p["radius_m"] for p in touching) / total)
        rest[:, i] = lift, roll, radii[0], radii[1], forces[0].fy + forces[1].fy
    shape = np.shape(y_m)
    return WheelsetAtRest(y.reshape(shape), *(row.reshape(shape) for row in rest))


def rolling_radius_difference(table: ContactTable, y_m: FloatArray) -> FloatArray:
    """Left minus right rolling radius (m) of a wheelset displaced by ``y_m`` (m, left positive)."""
    rest = push_sideways(table, y_m)
    return rest.radius_left_m - rest.radius_right_m


def conicity(table: ContactTable, amplitude_m: float) -> float:
    """Equivalent conicity of EN 15302 at an amplitude: that of the cone of the same wavelength.

    Parameters
    ----------
    table : ContactTable
    amplitude_m : float
        Lateral amplitude of the wheelset's kinematic oscillation.

    Returns
    -------
    float
        tan(gamma), from the wavelength L of ``y'' = -dr(y)/(2 half r0)`` (Klingel's motion with the
        true radius difference dr) by ``L = 2 pi sqrt(half r0/tan(gamma))``; NaN where the radius
        difference does not steer back and there is no oscillation.

    Notes
    -----
    The quarter period is an energy integral: with G the integral of dr from 0, y = a sin(q), it is
    the integral over q of ``a cos(q)/sqrt(2 (G(a) - G(y))/(2 half r0))``, which is smooth.
    """
    half, radius = table.const["tape_circle_half_m"], table.const["wheel_radius_m"]
    y = np.linspace(0.0, amplitude_m, 401)
    difference = rolling_radius_difference(table, y)
    difference -= difference[0]
    potential = CubicSpline(y, cumulative_simpson(difference, x=y, initial=0.0))
    nodes, weights = np.polynomial.legendre.leggauss(200)
    q = 0.25 * np.pi * (nodes + 1.0)
    fall = float(potential(amplitude_m)) - potential(amplitude_m * np.sin(q))
    if not (fall > 0.0).all():
        return float("nan")
    root = amplitude_m * np.cos(q) * np.sqrt(half * radius / fall)
    wavelength = 4.0 * 0.25 * np.pi * float(weights @ root)
    return float(half * radius * (2.0 * np.pi / wavelength) ** 2)
