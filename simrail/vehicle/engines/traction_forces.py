"""Traction and braking through the wheels, compiled: the driver, the motors and the brakes.

Where the wheels drive, nothing pulls the vehicle along but what wheels and rails pass on: on a slippery
rail a driven wheel spins, a braked one slides, and time is lost.

Driver: the speed that he wants is the profile's, and more or less of it by ``chase tanh(gain behind/chase)``
when the vehicle is behind its place or ahead of it: a bounded catch-up, and never backwards. His effort is
a gain times what the speed lacks, limited by ``limit tanh(effort/limit)``; less than nothing is braking.
Where he wants to stand and stands, the brakes hold with all they have.

Motors: torque as shares of the effort, less where the power ends. Brakes: dry friction with an elastic
mounting. The state q of a brake is its share of slip, -1 to 1, of the same kind as the creep states:
``q' = (w - |w| q)/(windup + tau |w|)`` with w the wheel's rate against what carries the brake; at rest it
stays where it is, so that a standing train is held by springs, neither creeping nor chattering. A slide
protection takes torque back by ``1/(1 + (creepage/limit)^4)``.

Not here: what the rails give (`simrail.vehicle.contact.contact`).
"""

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed, njit_inner
from simrail.vehicle.engines.records import Record, RecordArray

_ROUNDING_MPS = 1e-3
"""Speed within which "never backwards" is rounded: far below any that is scored."""
_HOLDING_MPS = 0.05
"""Speed below which the brakes hold, chosen so that a stop ends without a jolt."""
_BRAKE_LAG_S = 1e-3
"""Keeps the brake's state within reach of the integrator however fast the wheel turns: two usual steps."""
_SLIDE_SPEED_MPS = 1.0
"""The slide protection watches a sliding speed below this, a creepage above it."""


@njit_borrowed
def driver(behind: float, wanted: float, speed: float, traction: Record) -> tuple[float, float]:
    """Tractive and braking effort (N, both >= 0) that the driver asks for.

    Parameters
    ----------
    behind : float
        How far ahead of the vehicle its place by the profile is, m along the track.
    wanted, speed : float
        Speed of the profile, and of the vehicle, m/s along the track.
    traction : record
        `simrail.vehicle.engines.records.TRACTION`.
    """
    way, chase = traction.direction, traction.catch_up
    limit, brake = traction.tractive_effort, traction.braking_effort
    # v = way wanted + chase tanh(gain behind / chase), rounded off at 0.
    v = way * wanted + chase * np.tanh(traction.position_gain * way * behind / chase)
    v = 0.5 * (v + np.sqrt(v * v + _ROUNDING_MPS * _ROUNDING_MPS))
    effort = traction.speed_gain * (v - way * speed)
    still = np.exp(-(v * v + speed * speed) / (_HOLDING_MPS * _HOLDING_MPS))
    if effort > 0.0:
        return limit * np.tanh(effort / limit), brake * still
    asked = brake * np.tanh(-effort / brake)
    return 0.0, asked + (brake - asked) * still


@njit_inner
def traction_forces(
    efforts: tuple[float, float],
    traction: Record,
    spins: RecordArray,
    pose: RecordArray,
    rate: FloatArray,
    brakes: FloatArray,
    wrench: RecordArray,
    torque: FloatArray,
    brakes_rate: FloatArray,
) -> None:
    """Add the torques of motors and brakes to the spins, and their reactions to the bodies.

    ``efforts`` as the `driver` asks for; ``brakes`` (p,) are the states of the brakes and ``brakes_rate``
    their derivatives (written); the rest as in `simrail.vehicle.engines.forces.forces`.
    """
    pull, brake = efforts
    limit = traction.slide_protection
    for k in range(spins.shape[0]):
        spin = spins[k]
        axle, carrier, radius = pose[spin.axle], pose[spin.carrier], spin.radius_m
        ex, ey, ez = axle.rotation[0, 1], axle.rotation[1, 1], axle.rotation[2, 1]
        w = rate[k] - carrier.wx * ex - carrier.wy * ey - carrier.wz * ez
        # Slide protection: 1 / (1 + (creepage/limit)^4).
        share = 1.0
        if limit > 0.0:
            v = axle.vx * axle.rotation[0, 0] + axle.vy * axle.rotation[1, 0] + axle.vz * axle.rotation[2, 0]
            slide = (rate[k] * radius - v) / (limit * np.sqrt(v * v + _SLIDE_SPEED_MPS * _SLIDE_SPEED_MPS))
            share = 1.0 / (1.0 + slide * slide * slide * slide)
        # Motor: the effort, less where its power ends: F / (1 + (F w r/P)^4)^(1/4).
        spent = pull * w * radius / traction.power
        drive = pull / np.sqrt(np.sqrt(1.0 + spent * spent * spent * spent))
        # Brake: q' = (w - |w| q)/(windup + tau |w|), and Voigt damping of its mounting.
        slope = (w - abs(w) * brakes[k]) / (traction.windup + _BRAKE_LAG_S * abs(w))
        brakes_rate[k] = slope
        grip = min(max(brakes[k] + traction.damping * slope, -1.0), 1.0)
        moment = (
            share
            * radius
            * (traction.direction * drive * spin.traction_share - brake * spin.braking_share * grip)
        )
        torque[k] += moment
        reaction = wrench[spin.carrier]
        reaction.mx -= moment * ex
        reaction.my -= moment * ey
        reaction.mz -= moment * ez
