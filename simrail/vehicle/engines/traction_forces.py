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

from __future__ import annotations

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed


@njit_borrowed
def driver(behind: float, wanted: float, speed: float, traction: FloatArray) -> tuple[float, float]:
    """Tractive and braking effort (N, both >= 0) that the driver asks for.

    Parameters
    ----------
    behind : float
        How far ahead of the vehicle its place by the profile is, m along the track.
    wanted, speed : float
        Speed of the profile, and of the vehicle, m/s along the track.
    traction : ndarray (11,)
        The driver's part of `simrail.vehicle.engines.force_data.ForceData.guide`.
    """
    way, pull, brake = traction[1], traction[2], traction[4]
    gain, back, chase = traction[5], traction[6], traction[7]
    rounding, holding = 1e-3, 0.05  # m/s: where "never backwards" is rounded, and below which brakes hold
    v = way * wanted + chase * np.tanh(back * way * behind / chase)
    v = 0.5 * (v + np.sqrt(v * v + rounding * rounding))
    effort = gain * (v - way * speed)
    still = np.exp(-(v * v + speed * speed) / (holding * holding))
    if effort > 0.0:
        return pull * np.tanh(effort / pull), brake * still
    asked = brake * np.tanh(-effort / brake)
    return 0.0, asked + (brake - asked) * still


@njit_borrowed
def traction_forces(
    behind: float,
    wanted: float,
    speed: float,
    traction: FloatArray,
    spins: FloatArray,
    pose: FloatArray,
    spin: FloatArray,
    brakes: FloatArray,
    wrench: FloatArray,
    torque: FloatArray,
    brakes_rate: FloatArray,
) -> None:
    """Add the torques of motors and brakes to the spins, and their reactions to the bodies.

    ``behind``, ``wanted`` and ``speed`` as in `driver`; ``brakes`` (p,) are the states of the brakes and
    ``brakes_rate`` their derivatives (written); the rest as in `simrail.vehicle.engines.forces.forces`.
    """
    pull, brake = driver(behind, wanted, speed, traction)
    way, power, limit, windup, damping = traction[1], traction[3], traction[8], traction[9], traction[10]
    tau = 1e-3  # s: keeps the brake's state within reach of the integrator however fast the wheel turns
    for k in range(spins.shape[0]):
        m = spins[k]
        axle, carrier, radius = pose[int(m[1])], pose[int(m[5])], m[2]
        ex, ey, ez = axle[7], axle[10], axle[13]
        rate = spin[k] - carrier[15] * ex - carrier[16] * ey - carrier[17] * ez
        kept = 1.0
        if limit > 0.0:
            v = axle[3] * axle[6] + axle[4] * axle[9] + axle[5] * axle[12]
            # Below 1 m/s or so a sliding speed, above it a creepage.
            slide = (spin[k] * radius - v) / (limit * np.sqrt(v * v + 1.0))
            kept = 1.0 / (1.0 + slide * slide * slide * slide)
        spent = pull * rate * radius / power
        drive = pull / np.sqrt(np.sqrt(1.0 + spent * spent * spent * spent))
        slope = (rate - abs(rate) * brakes[k]) / (windup + tau * abs(rate))
        brakes_rate[k] = slope
        grip = min(max(brakes[k] + damping * slope, -1.0), 1.0)
        moment = kept * radius * (way * drive * m[3] - brake * m[4] * grip)
        torque[k] += moment
        w = wrench[int(m[5])]
        w[3] -= moment * ex
        w[4] -= moment * ey
        w[5] -= moment * ez
