"""How a creep force saturates at the friction limit: three laws; and falling friction.

The first two take Kalker's linear force and say which part of it the contact can give. With q = linear force
over friction limit, the force over the friction limit is

    she      q - q^2/3 + q^3/27 for q < 3, then 1        (Shen, Hedrick, Elkins 1983)
    polach   (2/pi) (k_A e/(1 + (k_A e)^2) + arctan(k_S e)),  e = pi q/4      (Polach, Wear 258, 2005)

Their slope at q = 0 is 1, Kalker's, for Polach with k_A = k_S = 1; smaller factors are his reduction for
contaminated rails and make it (k_A + k_S)/2. The third, "fastsim", looks into the contact
(`simrail.vehicle.contact.fastsim`) and is the one to take where spin matters.

Friction falls with the sliding speed w (Polach 2005):

    mu = mu0 ((1 - floor) exp(-decay w) + floor)

Not here: linear forces and spin, whose part of the lateral force q holds (`simrail.vehicle.contact.contact`).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import njit_borrowed

LAWS = ("she", "polach", "fastsim")
"""Names of the laws; the kernel knows them by their places here."""
SHE, FASTSIM = 0.0, 2.0
"""Places of two of them."""
_SLIDING_ROUND_MPS = 5e-3
"""Sliding speed below which the fall of friction is rounded, so that forces stay smooth through rest."""
_NO_CREEP = 1e-7
"""Of q: below it Polach's law is its own slope at 0, to rounding."""


@dataclass(frozen=True)
class CreepLaw:
    """Choice of a creep law.

    Attributes
    ----------
    law : {"she", "polach", "fastsim"}
        See the module.
    adhesion, slip : float
        Polach's k_A and k_S, 0 < k_S <= k_A <= 1.
    friction_floor : float
        Friction at very fast sliding over friction at rest, 0 to 1.
    friction_decay_spm : float
        How fast it falls, s/m; 0 for constant friction.
    """

    law: Literal["she", "polach", "fastsim"] = "she"
    adhesion: float = 1.0
    slip: float = 1.0
    friction_floor: float = 1.0
    friction_decay_spm: float = 0.0

    def constants(self) -> dict[str, float]:
        """What the kernel takes of it, by the names of `contact_geometry.CONSTANTS`.

        Raises
        ------
        InputError
            For a value out of its range, naming the field.
        """
        if self.law not in LAWS:
            raise InputError("no such creep law", field="creep_law", value=self.law, limit=", ".join(LAWS))
        for field, value, low, high in (
            ("adhesion", self.adhesion, 0.0, 1.0),
            ("slip", self.slip, 0.0, self.adhesion),
            ("friction_floor", self.friction_floor, 0.0, 1.0),
        ):
            if not low < value <= high:
                raise InputError("out of range", field=field, value=value, limit=f"> {low:g}, <= {high:g}")
        if not (np.isfinite(self.friction_decay_spm) and self.friction_decay_spm >= 0.0):
            raise InputError(
                "out of range", field="friction_decay_spm", value=self.friction_decay_spm, limit=">= 0 s/m"
            )
        return {
            "creep_law": float(LAWS.index(self.law)),
            "polach_adhesion": self.adhesion,
            "polach_slip": self.slip,
            "friction_floor": self.friction_floor,
            "friction_decay_spm": self.friction_decay_spm,
            # The cubic law's force is at its end there, Polach's within 1e-3 of it. FASTSIM's is from
            # 32/(3 pi) on, unless there is spin, which still turns it.
            "windup_onset": {"she": 3.0, "polach": 10.0 / self.slip, "fastsim": 10.0}[self.law],
        }


@njit_borrowed
def saturation(q: float, law: float, adhesion: float, slip: float) -> float:
    """Force over linear force, from q, the linear force over the friction limit."""
    if law == SHE:
        return 1.0 - q / 3.0 + q * q / 27.0 if q < 3.0 else 1.0 / q
    if q < _NO_CREEP:
        return 0.5 * (adhesion + slip)
    e = 0.25 * np.pi * q
    a = adhesion * e
    part: float = (a / (1.0 + a * a) + np.arctan(slip * e)) * 2.0 / (np.pi * q)
    return part


@njit_borrowed
def fallen(friction: float, floor: float, decay: float, sliding_x: float, sliding_y: float) -> float:
    """Friction coefficient at a sliding speed (its two components, m/s)."""
    if decay == 0.0:
        return friction
    w0 = _SLIDING_ROUND_MPS
    w = np.sqrt(sliding_x * sliding_x + sliding_y * sliding_y + w0 * w0) - w0
    sliding: float = friction * ((1.0 - floor) * np.exp(-decay * w) + floor)
    return sliding
