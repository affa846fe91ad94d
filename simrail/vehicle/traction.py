"""What drives and brakes a vehicle through its wheels: motors, brakes and the driver's gains.

The forces that come of it are in `simrail.vehicle.engines.traction_forces`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Traction:
    """Motors, brakes and driver of a vehicle that its wheels drive
    (`simrail.vehicle.engines.traction_forces`).

    Attributes
    ----------
    driven, braked : tuple of (str, float)
        Spins and their shares of the tractive and of the braking effort; each set sums to 1.
    tractive_effort_n, power_w, braking_effort_n : float
        Greatest tractive effort and power, greatest braking effort, of the whole vehicle at the rims.
    speed_gain_nspm : float
        Effort that the driver asks for per m/s that the speed lacks.
    position_gain_1ps, catch_up_mps : float
        Speed that he adds per m that the vehicle is behind, and the most that he adds.
    slide_protection_creepage : float
        Creepage at which half of the torque is taken back; 0 for none.
    reaction : str
        Body that carries motors and brakes, ``"axle"`` for each axle itself.
    brake_windup_rad, brake_damping_s : float
        Angle over which a brake's torque builds up, and the damping time of its mounting.
    """

    driven: tuple[tuple[str, float], ...]
    braked: tuple[tuple[str, float], ...]
    tractive_effort_n: float
    power_w: float
    braking_effort_n: float
    speed_gain_nspm: float
    position_gain_1ps: float
    catch_up_mps: float
    slide_protection_creepage: float = 0.0
    reaction: str = "axle"
    brake_windup_rad: float = 5e-3
    brake_damping_s: float = 0.02
