"""What disturbs a magnetometer beside an electrified line: traction currents, and steel along the track.

All of it is synthetic: conductors are straight and endless, structures are dipoles. They have the size and
the place of the real ones, which is enough to see what they do to a heading; they are no survey of a
line. Not there: other trains, and the reversal of currents at feeding points.

Everything is in the track frame: X along the track in the direction of increasing s, Y left, Z up from
the rails.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from simrail.core.errors import refuse_unless
from simrail.core.jit import FloatArray
from simrail.core.seeds import stream

MU0_OVER_2PI = 2e-7
"""Magnetic constant over 2 pi, T m/A."""

RAIL_HALF_SPACING_M = 0.75
"""Half the distance between the rail heads, which carry the return current."""


@dataclass(frozen=True)
class Traction:
    """What the vehicle draws from the line, and where it flows. Synthetic.

    The line current is the power over the voltage: mass times acceleration plus resistance, times speed,
    over the efficiency (times it where the vehicle brakes and feeds back), plus what is always on.
    Positive current flows in +X in the supply, and back in both rails, half in each.

    Attributes
    ----------
    supply : {"catenary", "third_rail"}
        Contact wire above the middle of the track, or a conductor rail beside it on the left.
    voltage_v, efficiency, auxiliary_w : float
        Line voltage, of the drive, and power of heating and fans.
    mass_kg, resistance_n : float
        Of the whole train that is fed here; resistance is constant.
    regenerative : bool
        Whether braking power goes back into the line; otherwise into resistors on the vehicle.
    share : float
        Field over that of an endless line. At a train that is fed from one side the line ends, and the
        field there is one half of it.
    """

    supply: Literal["catenary", "third_rail"] = "catenary"
    voltage_v: float = 750.0
    efficiency: float = 0.85
    auxiliary_w: float = 30e3
    mass_kg: float = 42e3
    resistance_n: float = 2500.0
    regenerative: bool = True
    share: float = 0.5

    @property
    def conductor_m(self) -> tuple[float, float]:
        """(left, up) of the supply in the track frame: common dimensions, of no particular line."""
        return (0.0, 5.5) if self.supply == "catenary" else (1.4, 0.15)

    def current_a(self, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Line current (n,) from speed, m/s, and acceleration, m/s2, both along the track."""
        towards = np.sign(speed)
        force = self.mass_kg * acceleration * towards + self.resistance_n * np.abs(towards)
        power = force * np.abs(speed)
        back = self.efficiency if self.regenerative else 0.0
        drawn = np.where(power > 0.0, power / self.efficiency, power * back)
        return (drawn + self.auxiliary_w) / self.voltage_v


@dataclass(frozen=True)
class Steel:
    """Masts, bridges and reinforcement along the track, as dipoles. Synthetic.

    Attributes
    ----------
    track_seed : int
        Seed of the track: the same structures at every pass.
    spacing_m : float
        Mean distance between two of them; their places are a Poisson process.
    moment_sd_am2 : float
        Standard deviation of each component of the magnetic moment.
    beside_m : tuple of float
        Least and largest distance from the track's centre, either side.
    height_m : tuple of float
        Least and largest height above the rails.
    """

    track_seed: int
    spacing_m: float = 20.0
    moment_sd_am2: float = 1500.0
    beside_m: tuple[float, float] = (1.8, 4.0)
    height_m: tuple[float, float] = (-0.5, 5.0)


def line_field(away: FloatArray, current_a: FloatArray | float) -> FloatArray:
    """Field of an endless straight conductor along X.

    Parameters
    ----------
    away : ndarray (n, 2)
        (y, z) of the points seen from the conductor, m.
    current_a : ndarray (n,) or float
        Current in +X, A.

    Returns
    -------
    ndarray (n, 3)
        T: of magnitude mu0 I / (2 pi d), counter-clockwise about +X (Ampere's law).
    """
    y, z = away.T
    strength = MU0_OVER_2PI * current_a / (y**2 + z**2)
    return np.column_stack([np.zeros_like(y), -strength * z, strength * y])


def traction_field(place: FloatArray, traction: Traction, current_a: FloatArray) -> FloatArray:
    """Field (n, 3) of supply and return at places (left, up) (n, 2) in the track frame, on its axes; T."""
    field = line_field(place - np.asarray(traction.conductor_m), current_a)
    for side in (RAIL_HALF_SPACING_M, -RAIL_HALF_SPACING_M):
        field += line_field(place - np.array([side, 0.0]), -0.5 * current_a)
    return traction.share * field


def steel_field(
    position: FloatArray, place: FloatArray, steel: Steel, track_m: tuple[float, float]
) -> FloatArray:
    """Field of the structures along the track.

    Parameters
    ----------
    position : ndarray (n,)
        s of the points, m.
    place : ndarray (n, 2)
        (left, up) of the points in the track frame, m.
    steel : Steel
        What stands there.
    track_m : tuple of float
        s at both ends of the track.

    Returns
    -------
    ndarray (n, 3)
        T, on the axes of the track frame, which is taken to be straight over the reach of a structure.
    """
    field = np.zeros((len(position), 3))
    reach = 15.0 * steel.beside_m[1]  # a dipole has fallen to 1/3000 there
    for s, y, z, *moment in structures(steel, track_m):
        near = np.flatnonzero(np.abs(position - s) < reach)
        if len(near):
            away = np.column_stack([position[near] - s, place[near] - [y, z]])
            field[near] += dipole_field(away, np.asarray(moment))
    return field


def dipole_field(away: FloatArray, moment: FloatArray) -> FloatArray:
    """Field (n, 3) of a dipole of moment (3,), A m2, at points (n, 3) seen from it, m; T.

    B = mu0 / (4 pi) (3 (m.e) e - m) / d^3.
    """
    distance = np.linalg.norm(away, axis=1, keepdims=True)
    along = away / distance
    field: FloatArray = 0.5 * MU0_OVER_2PI * (3.0 * (along @ moment)[:, None] * along - moment) / distance**3
    return field


def structures(steel: Steel, track_m: tuple[float, float]) -> FloatArray:
    """Place (s, left, up), m, and moment, A m2, of each structure: (k, 6), in the order of s."""
    generator = stream(steel.track_seed, "track", "steel")
    rows = []
    s = track_m[0] + generator.exponential(steel.spacing_m)
    while s < track_m[1]:
        side = 1.0 if generator.uniform() < 0.5 else -1.0
        y, z = side * generator.uniform(*steel.beside_m), generator.uniform(*steel.height_m)
        rows.append([s, y, z, *generator.normal(0.0, steel.moment_sd_am2, 3)])
        s += generator.exponential(steel.spacing_m)
    return np.array(rows).reshape(-1, 6)


def check_traction(traction: Traction) -> None:
    """Refuse traction without voltage, mass or a possible efficiency; raises `InputError`."""
    for field in ("voltage_v", "mass_kg", "share"):
        value = getattr(traction, field)
        refuse_unless(0.0 < value < np.inf, f"traction.{field}", value, "> 0")
    for field in ("auxiliary_w", "resistance_n"):
        value = getattr(traction, field)
        refuse_unless(0.0 <= value < np.inf, f"traction.{field}", value, ">= 0")
    refuse_unless(
        0.0 < traction.efficiency <= 1.0, "traction.efficiency", traction.efficiency, "above 0, at most 1"
    )


def check_steel(steel: Steel) -> None:
    """Refuse structures within the vehicle's way, or none; raises `InputError`."""
    refuse_unless(steel.spacing_m >= 1.0, "steel.spacing_m", steel.spacing_m, ">= 1 m")
    refuse_unless(steel.moment_sd_am2 >= 0.0, "steel.moment_sd_am2", steel.moment_sd_am2, ">= 0")
    near, far = steel.beside_m
    refuse_unless(1.5 <= near <= far, "steel.beside_m", steel.beside_m, ">= 1.5 m, least first")
    low, high = steel.height_m
    refuse_unless(low <= high, "steel.height_m", steel.height_m, "least first")
