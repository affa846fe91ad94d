"""Modes of a running vehicle, their locus over the speed, and the speed at which it begins to hunt.

An eigenvalue ``lambda`` of the state matrix (`simrail.vehicle.linear`) is a motion ``exp(lambda t)``:
frequency |Im|/2 pi, damping ratio -Re/|lambda|. A vehicle hunts where an oscillatory one has Re > 0.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from simrail.core.jit import FloatArray
from simrail.vehicle.linear import ComplexArray, RunningVehicle

DIRECTIONS = ("longitudinal", "lateral", "bounce", "roll", "pitch", "yaw")
"""Words for the six motions of a body."""

SLOWEST_HZ = 0.02
"""Slower motions do not count as oscillations: a drift that takes a minute is no hunting."""

MARGIN_1PS = 1e-5
"""A growth below this is rounding of the differences, not growth."""


@dataclass(frozen=True)
class Mode:
    """One oscillation.

    Attributes
    ----------
    eigenvalue_1ps : complex
        Of the pair, the one with positive imaginary part, 1/s.
    shares : dict of (body, direction) to float
        Share of the kinetic energy (mean over a cycle) in each motion of each body; they sum to 1. Spins
        of wheels and creep states have none.
    """

    eigenvalue_1ps: complex
    shares: dict[tuple[str, str], float]

    @property
    def frequency_hz(self) -> float:
        """Frequency of the damped oscillation."""
        return abs(self.eigenvalue_1ps.imag) / (2.0 * np.pi)

    @property
    def natural_frequency_hz(self) -> float:
        """|lambda|/2 pi: the frequency that it would have undamped."""
        return abs(self.eigenvalue_1ps) / (2.0 * np.pi)

    @property
    def damping(self) -> float:
        """Damping ratio; negative when the motion grows."""
        return -self.eigenvalue_1ps.real / abs(self.eigenvalue_1ps)

    def words(self, *, most: int = 3, least: float = 0.1) -> str:
        """What moves, the largest share first: ``"body lateral 70 %, body roll 20 %"``."""
        ranked = sorted(self.shares.items(), key=lambda item: -item[1])
        texts = [f"{b} {d} {100 * share:.0f} %" for (b, d), share in ranked[:most] if share >= least]
        return ", ".join(texts)


def modes_of(
    matrix: FloatArray, vehicle: RunningVehicle, *, motions: Sequence[int] | None = None
) -> list[Mode]:
    """Oscillatory modes of a state matrix, by rising natural frequency.

    Parameters
    ----------
    matrix : ndarray
        `RunningVehicle.linearised`, or `RunningVehicle.held` of it.
    vehicle : RunningVehicle
        Whose.
    motions : sequence of int, optional
        Motions that the matrix holds, numbered as by `RunningVehicle.held`; all of them if not given.
    """
    of = np.arange(6 * vehicle.bodies) if motions is None else np.array(motions, dtype=int)
    values, vectors = np.linalg.eig(matrix)
    n = len(of)
    weight = np.array([[body.mass_kg] * 3 + [*body.inertia_kgm2] for body in vehicle.model.bodies]).ravel()[
        of
    ]
    names = [(vehicle.model.bodies[k // 6].name, DIRECTIONS[k % 6]) for k in of]
    modes = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value.imag > 2.0 * np.pi * 1e-3:
            energy = weight * np.abs(vector[n : 2 * n]) ** 2
            energy /= max(energy.sum(), 1e-300)
            modes.append(Mode(complex(value), dict(zip(names, energy.tolist(), strict=True))))
    return sorted(modes, key=lambda mode: mode.natural_frequency_hz)


def standstill_modes(vehicle: RunningVehicle) -> list[Mode]:
    """Modes of the vehicle on its springs, its wheelsets held but in pitch.

    They do not depend on the speed: only wheels know how fast they roll.
    """
    matrix, motions = vehicle.held(vehicle.linearised(1.0))
    return modes_of(matrix, vehicle, motions=motions)


@dataclass(frozen=True)
class RootLocus:
    """Eigenvalues over the speed.

    Attributes
    ----------
    speed_mps : ndarray (k,)
        Speeds.
    eigenvalues_1ps : ndarray (k, n), complex
        Of the state matrix at each speed, in no order.
    """

    speed_mps: FloatArray
    eigenvalues_1ps: ComplexArray


def root_locus(
    vehicle: RunningVehicle,
    speeds_mps: FloatArray,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> RootLocus:
    """Eigenvalues at each of some speeds; ``progress`` is called with (done, in all)."""
    values, at = [], None
    for i, speed in enumerate(speeds_mps):
        at = vehicle.equilibrium(float(speed), start=at)
        values.append(np.linalg.eigvals(vehicle.linearised(float(speed), at=at)).astype(complex))
        if progress is not None:
            progress(i + 1, len(speeds_mps))
    return RootLocus(np.asarray(speeds_mps, dtype=float), np.array(values))


def growth_1ps(eigenvalues: ComplexArray) -> float:
    """Largest real part among the oscillatory eigenvalues; -inf if none oscillates."""
    oscillating = np.abs(eigenvalues.imag) > 2.0 * np.pi * SLOWEST_HZ
    return float(np.max(eigenvalues.real[oscillating], initial=-np.inf))


@dataclass(frozen=True)
class CriticalSpeed:
    """Where hunting begins.

    Attributes
    ----------
    speed_mps : float or None
        The lowest speed above which an oscillation grows; None if there is none in the range searched.
        If one grows at the lowest speed already (a wheelset that nothing guides), that speed.
    frequency_hz : float or None
        Frequency of that oscillation there.
    searched_mps : (float, float)
        The range.
    from_the_start : bool
        True if an oscillation grows at the lowest speed already.
    """

    speed_mps: float | None
    frequency_hz: float | None
    searched_mps: tuple[float, float]
    from_the_start: bool = False


def critical_speed(vehicle: RunningVehicle, locus: RootLocus) -> CriticalSpeed:
    """Find where the first oscillation begins to grow.

    Parameters
    ----------
    vehicle : RunningVehicle
        The vehicle.
    locus : RootLocus
        Over the range to search, fine enough that no growth lies wholly between two of its speeds.
    """
    return first_crossing(
        lambda v: np.linalg.eigvals(vehicle.linearised(v)).astype(complex),
        locus.speed_mps,
        list(locus.eigenvalues_1ps),
    )


def first_crossing(
    eigenvalues: Callable[[float], ComplexArray],
    speeds_mps: FloatArray,
    known: Sequence[ComplexArray] | None = None,
    *,
    accuracy_mps: float = 1e-7,
) -> CriticalSpeed:
    """Critical speed of anything whose eigenvalues (1/s) are known as a function of the speed.

    The first of the rising speeds at which an oscillation grows brackets the crossing with the one
    before it; bisection within the bracket (Brent's).
    """
    searched = (float(speeds_mps[0]), float(speeds_mps[-1]))
    for i, speed in enumerate(speeds_mps):
        here = eigenvalues(float(speed)) if known is None else known[i]
        if growth_1ps(here) > MARGIN_1PS:
            break
    else:
        return CriticalSpeed(None, None, searched)
    if i == 0:
        return CriticalSpeed(searched[0], _fastest_growing_hz(here), searched, from_the_start=True)

    def growth(v: float) -> float:
        # Where nothing oscillates, nothing hunts: any negative number brackets as well.
        return max(growth_1ps(eigenvalues(v)), -1e3)

    low, high = float(speeds_mps[i - 1]), float(speeds_mps[i])
    speed_mps = low if growth(low) >= 0.0 else float(brentq(growth, low, high, xtol=accuracy_mps, rtol=1e-9))
    return CriticalSpeed(speed_mps, _fastest_growing_hz(eigenvalues(speed_mps)), searched)


def _fastest_growing_hz(eigenvalues: ComplexArray) -> float:
    oscillating = eigenvalues[eigenvalues.imag > 2.0 * np.pi * SLOWEST_HZ]
    return float(oscillating[np.argmax(oscillating.real)].imag / (2.0 * np.pi))
