"""What there is to know of a vehicle before it runs: loads, contact, modes, the speed where it hunts.

Computes; how it is shown is in `simrail.report.tables.vehicle_text` and `simrail.report.pages.vehicle_page`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.vehicle.contact.contact_geometry import ContactTable
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.contact.wheelset import WheelsetAtRest, conicity, contact_state, push_sideways
from simrail.vehicle.linear import running_vehicle
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.stability import (
    CriticalSpeed,
    Mode,
    RootLocus,
    critical_speed,
    modes_of,
    root_locus,
    standstill_modes,
)

SLOWEST_MPS = 2.0
SPEEDS = 50
_SHIFT_M = 0.0075
_FULL_SCALE_RADIUS_M = 0.46
AMPLITUDE_M = 0.003
"""Amplitude for which EN 15302 asks for the equivalent conicity first."""

Progress = Callable[[str, float], None]
"""Called with (what is computed, share done)."""


@dataclass(frozen=True)
class Conicity:
    """Contact of a wheelset over its lateral shift.

    Attributes
    ----------
    table : ContactTable
        The contact of the first axle's wheels.
    rest : WheelsetAtRest
        The wheelset pushed sideways.
    abscissa_m, slope : ndarray (n, 2)
        Where the contact lies on the left and right wheel (from the tape circle, outward), and the
        tangent of the contact angle there; of the patch that carries more.
    amplitude_m, equivalent : ndarray (k,)
        Amplitudes, and the equivalent conicity there; NaN where nothing steers back. Empty for wheels that
        turn independently: a difference of their radii steers nothing.
    scale : float
        Wheel radius over that of a full-scale wheel (1 for a full-scale vehicle); amplitudes scale with it.
    """

    table: ContactTable
    rest: WheelsetAtRest
    abscissa_m: FloatArray
    slope: FloatArray
    amplitude_m: FloatArray
    equivalent: FloatArray
    scale: float

    @property
    def steers(self) -> bool:
        """Whether there is an equivalent conicity."""
        return self.equivalent.size > 0

    @property
    def at_3_mm(self) -> float:
        """Equivalent conicity at 3 mm (times the scale of a scale vehicle), where there is one."""
        return float(np.interp(AMPLITUDE_M * self.scale, self.amplitude_m, self.equivalent))


@dataclass(frozen=True)
class VehicleStudy:
    """All of it.

    Attributes
    ----------
    model : VehicleModel
        The vehicle.
    wheel_load_n : ndarray (w,)
        Static load of each wheel.
    conicity : Conicity or None
        None if the contact is prescribed, not one of profiles.
    standstill : list of Mode
        On the springs, wheelsets held.
    running : list of Mode
        At `running_mps`.
    running_mps : float
        That speed.
    locus : RootLocus
        Over the speeds searched.
    critical : CriticalSpeed or None
        Where hunting begins; None if all wheels turn independently, so that no wheelset can hunt.
    """

    model: VehicleModel
    wheel_load_n: FloatArray
    conicity: Conicity | None
    standstill: list[Mode]
    running: list[Mode]
    running_mps: float
    locus: RootLocus
    critical: CriticalSpeed | None


def study_vehicle(
    model: VehicleModel,
    *,
    running_mps: float,
    top_mps: float,
    gravity_mps2: float = 9.81,
    progress: Progress | None = None,
) -> VehicleStudy:
    """Study a vehicle.

    Parameters
    ----------
    model : VehicleModel
        The vehicle.
    running_mps : float
        Speed of the mode table.
    top_mps : float
        Highest speed searched for hunting.
    gravity_mps2 : float
        Gravity.
    progress : callable, optional
        See `Progress`.
    """
    say = progress or (lambda _what, _share: None)
    say("preparing", 0.0)
    vehicle = running_vehicle(model, gravity_mps2=gravity_mps2)
    standstill = standstill_modes(vehicle)
    contact = None
    if model.wheel_rail.linear is None:
        contact = contact_over_shift(model, gravity_mps2=gravity_mps2, say=say)
    speeds = np.linspace(min(SLOWEST_MPS, 0.5 * top_mps), top_mps, SPEEDS)
    locus = root_locus(vehicle, speeds, progress=lambda done, n: say("root locus", done / n))
    say("critical speed", 0.0)
    critical = critical_speed(vehicle, locus) if model.has_wheelsets else None
    running = modes_of(vehicle.linearised(running_mps), vehicle)
    return VehicleStudy(
        model=model,
        wheel_load_n=model.wheel_load_n(gravity_mps2),
        conicity=contact,
        standstill=standstill,
        running=running,
        running_mps=running_mps,
        locus=locus,
        critical=critical,
    )


def contact_over_shift(model: VehicleModel, *, gravity_mps2: float, say: Progress) -> Conicity:
    """Contact and conicity over the lateral shift, as far as the flange lets the wheelset go."""
    contacts = contacts_of(model, gravity_mps2=gravity_mps2)
    table = contacts.tables[contacts.of_wheel[0]]
    radius = model.wheels[0].radius_m
    scale = 1.0 if radius > 0.15 else radius / _FULL_SCALE_RADIUS_M
    y = np.linspace(-_SHIFT_M, _SHIFT_M, 151) * scale
    while True:
        try:
            rest = push_sideways(table, y)
            break
        except InputError:
            y = 0.9 * y
    abscissa, slope = np.empty((y.size, 2)), np.empty((y.size, 2))
    for i, at in enumerate(y):
        for k, side in enumerate((1.0, -1.0)):
            patch = _loaded_patch(table, side, float(at), float(rest.z_m[i]), float(rest.roll_rad[i]))
            abscissa[i, k], slope[i, k] = patch["abscissa_m"], patch["slope"]
    amplitude = np.linspace(0.5e-3, 7e-3, 14) * scale
    amplitude = amplitude[amplitude <= y[-1]] if model.has_wheelsets else amplitude[:0]
    values = []
    for i, a in enumerate(amplitude):
        values.append(conicity(table, float(a)))
        say("conicity", (i + 1) / len(amplitude))
    return Conicity(table, rest, abscissa, slope, amplitude, np.array(values), scale)


def _loaded_patch(table: ContactTable, side: float, y: float, z: float, roll: float) -> dict[str, float]:
    patches = contact_state(table, side, y_m=y, z_m=z, roll_rad=roll).values()
    return max(patches, key=lambda patch: patch["normal_n"])
