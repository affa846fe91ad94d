"""How long a step of RK4 may be for a vehicle: its stiffest springs are wheels on rails.

An axle swings on its contacts: up and down and in roll on the Hertz springs of both wheels, and its wheels
turn on the tangential springs that creep is at short distance (`simrail.vehicle.contact.contact`). RK4
follows an oscillation of circular frequency w up to ``w h = 2.83``; long before that its frequency is off by
``(w h)^4 / 120``. A step beyond the limit need not blow up, since contacts part and creep saturates: it
chatters, which looks like a ride.

Not here: judging a scenario by it (`simrail.scenario.check_ride`).
"""

import math
from dataclasses import dataclass

import numpy as np

from simrail.vehicle.contact.contact import static_height
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.model import VehicleModel

STABLE = 2.5
"""Largest w h. RK4's limit of 2.83 less the 12 % by which a wheel's resonance rises when its load doubles."""
ACCURATE = 1.05
"""Largest w h of the normal resonance, which an axle's accelerations show, for a frequency right to 1 %."""
_OUTPUT_STEP_S = 1e-3
_USUAL_STEP_S = 0.5e-3


@dataclass(frozen=True)
class Resonance:
    """Circular frequencies on the contact springs at static load, rad/s: the highest of any axle or wheel.

    Attributes
    ----------
    normal_radps : float
        Of an axle in heave or roll.
    tangential_radps : float
        Of a wheel or wheelset turning against creep, at rest; it falls with speed and is damped.
    """

    normal_radps: float
    tangential_radps: float

    @property
    def longest_step_s(self) -> float:
        """Longest step that is stable."""
        return STABLE / max(self.normal_radps, self.tangential_radps)

    @property
    def advised_step_s(self) -> float:
        """Longest step, a whole part of 1 ms and at most 0.5 ms, that is stable and accurate."""
        step = min(self.longest_step_s, ACCURATE / self.normal_radps, _USUAL_STEP_S)
        return _OUTPUT_STEP_S / math.ceil(_OUTPUT_STEP_S / step - 1e-9)


def contact_resonance(model: VehicleModel, *, gravity_mps2: float = 9.81) -> Resonance:
    """Resonance of a vehicle's axles and wheels on their rails.

    Notes
    -----
    Per wheel the vertical stiffness is ``3/2 N0/d`` with d the static approach of Hertz, or the prescribed
    one; the tangential one f11/L0 with L0 the relaxation length, and f11 that of the centred wheelset. Of
    the wheels' loads the greatest is taken, whose contact is the stiffest. Springs above the axle count
    for nothing.
    """
    pair = model.wheel_rail
    table = contacts_of(model, gravity_mps2=gravity_mps2).tables[-1]
    if pair.linear is None:
        penetration, f11 = (float(np.polyval(*table.piece(name, 0.0))) for name in ("penetration", "f11"))
        approach = penetration - static_height(table)
        vertical, creep = 1.5 * table.static_load_n / approach, f11 * approach
    else:
        vertical, creep = pair.linear.vertical_stiffness_npm, pair.linear.f11_n
    axles = [model.body(name) for name in model.axle_names]
    half = pair.tape_circle_half_m
    normal = max(2.0 * vertical * max(1.0 / b.mass_kg, half**2 / b.inertia_kgm2[0]) for b in axles)
    tangential = max(
        creep
        / table.const["relaxation_length_m"]
        * sum(w.radius_m**2 for w in model.wheels if w.spin == spin)
        / inertia
        for spin, inertia in model.spin_inertia_kgm2.items()
    )
    return Resonance(math.sqrt(normal), math.sqrt(tangential))
