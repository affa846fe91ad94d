"""A wheel has left its rail: where, how, and what has most likely brought it there.

Forces beyond the contact table mean nothing, so a ride ends where it derails. What is said of it is read from
the rails there and from the contact of the last moments before.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simrail.core.jit import FloatArray, IntArray
from simrail.vehicle.contact.contact_geometry import ContactTable
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.engines.force_data import Memory
from simrail.vehicle.engines.records import Record, RecordArray
from simrail.vehicle.model import Wheel

LOOK_BACK_M = 2.0
"""Y/Q is a mean over so much way, as EN 14363 has it."""
LOOK_BACK_S = 0.25
"""Wheels that lost their load within this time before have something to do with it."""
RAILS_LOOK_BACK_M = 5.0
UNLOADED = 0.1
"""A side that carries less than this share of its load has lost it."""


@dataclass(frozen=True)
class Derailment:
    """Where and how a wheel left its rail.

    Attributes
    ----------
    axle, wheel : str
        Names.
    time_s, place_m, speed_mps : float
        When, where (s of the axle), how fast (ds/dt).
    gauge_m : float
        Gauge of the laid track there.
    lift_m : float
        How high the wheel's tape circle stood over its rail.
    shift_m : float
        How far the wheel stood outward of its place on the rail; negative inward.
    y_over_q : float
        Mean of its Y/Q over the last 2 m, or over what of them is known; positive where it pressed outward.
    cause : str
        The likely cause, in words.
    from_the_track : bool
        Whether the rails alone explain it.
    """

    axle: str
    wheel: str
    time_s: float
    place_m: float
    speed_mps: float
    gauge_m: float
    lift_m: float
    shift_m: float
    y_over_q: float
    cause: str
    from_the_track: bool

    @property
    def words(self) -> str:
        """All of it in one line."""
        return (
            f"derailed: axle {self.axle} left the rail at s = {self.place_m:.1f} m, {self.time_s:.2f} s, "
            f"{3.6 * abs(self.speed_mps):.0f} km/h: wheel {self.wheel} lifted {1e3 * self.lift_m:.1f} mm, "
            f"{1e3 * self.shift_m:+.1f} mm outward, Y/Q {self.y_over_q:.2f}, "
            f"gauge {1e3 * self.gauge_m:.1f} mm; likely cause: {self.cause}"
        )


class DerailedError(RuntimeError):
    """A wheel left its rail: the ride ends there. ``derailment`` says where, how, and why."""

    def __init__(self, derailment: Derailment) -> None:
        super().__init__(derailment)
        self.derailment = derailment

    def __str__(self) -> str:
        return self.derailment.words


def refuse_derailed(memory: Memory, setup: Setup, history: Callable[[float], RecordArray]) -> None:
    """Raise `DerailedError` if a wheel has left its rail.

    Parameters
    ----------
    memory : Memory
        Of the engine.
    setup : Setup
        What the engine was given.
    history : callable
        Given the time, what the contact was until then: records `simrail.vehicle.contact.contact.CONTACT`
        (k, w) at the output rate, the last ones at least.
    """
    memos = memory.axle_memos
    derailed = np.flatnonzero(memos["derailed"])
    if derailed.size:
        axle = int(derailed[np.argmin(memos["derailed_time_s"][derailed])])
        memo = memos[axle]
        raise DerailedError(_explain(setup, axle, memo, history(float(memo["derailed_time_s"]))))


def _explain(setup: Setup, axle: int, memo: Record, told: RecordArray) -> Derailment:
    """Say what a memo of a derailed axle means."""
    model = setup.model
    name = model.axle_names[axle]
    number = 2 * axle + int(memo["derailed"]) - 1
    wheel = model.wheels[number]
    place = float(memo["derailed_s_m"])
    y_left, _, y_right, _ = setup.track.rails(setup.track.design.on_track(place))
    gauge_m = model.wheel_rail.gauge_m + float(y_left - y_right)
    cause = _track_cause(setup, wheel, memo, gauge_m)
    return Derailment(
        axle=name,
        wheel=wheel.name,
        time_s=float(memo["derailed_time_s"]),
        place_m=place,
        speed_mps=float(memo["speed_mps"]),
        gauge_m=gauge_m,
        lift_m=float(memo["lift_m"]),
        shift_m=float(memo["shift_m"]),
        y_over_q=_y_over_q(told[:, number], wheel.side),
        cause=cause or _motion_cause(setup, number, memo, told),
        from_the_track=bool(cause),
    )


def _table(setup: Setup, number: int) -> ContactTable | None:
    """Contact table of a wheel; None where the contact is prescribed."""
    if setup.model.wheel_rail.linear is not None:
        return None
    contacts = contacts_of(setup.model, gravity_mps2=setup.gravity_mps2)
    return contacts.tables[contacts.of_wheel[number]]


def _track_cause(setup: Setup, wheel: Wheel, memo: Record, gauge_m: float) -> str:
    """What of the rails alone explains a derailment; an empty text if nothing does."""
    table = _table(setup, setup.model.wheels.index(wheel))
    if table is None:
        return ""
    way = np.sign(float(memo["speed_mps"])) or 1.0
    s = setup.track.design.on_track(
        float(memo["derailed_s_m"]) - way * np.linspace(0.0, RAILS_LOOK_BACK_M, 101)
    )
    rails = setup.track.rails(s)[::-1]
    across, heights = (rails[:, :2] if wheel.side > 0 else rails[:, 2:]).T
    fall = float(np.max(np.maximum.accumulate(heights) - heights))
    high, play = float(table.const["flange_height_m"]), float(table.const["derailed_shift_m"])
    if fall > high:
        return f"the rail falls by {1e3 * fall:.0f} mm within {RAILS_LOOK_BACK_M:g} m, and no wheel follows"
    if np.ptp(across) > high:
        return f"the rail leads aside by {1e3 * np.ptp(across):.0f} mm within {RAILS_LOOK_BACK_M:g} m"
    wider = gauge_m - setup.model.wheel_rail.gauge_m
    if wider > play:
        return f"the gauge is {1e3 * wider:.0f} mm too wide"
    if wider < -play:
        return f"the gauge is {-1e3 * wider:.0f} mm too narrow"
    return ""


def _motion_cause(setup: Setup, number: int, memo: Record, told: RecordArray) -> str:
    """What of the vehicle's motion explains a derailment."""
    table = _table(setup, number)
    if table is None:
        return "the wheelset went beyond where the prescribed linear contact has its flange"
    loads = setup.model.wheel_load_n(setup.gravity_mps2)
    last = told[-max(round(LOOK_BACK_S * setup.rate_hz), 1) :]
    sides = np.array([wheel.side for wheel in setup.model.wheels])
    for side, word in ((1, "left"), (-1, "right")):
        of_side = sides == side
        if len(last) and last["load_n"][:, of_side].sum(axis=1).min() < UNLOADED * loads[of_side].sum():
            return f"the {word} wheels lost their load together, as a vehicle does that turns over or jumps"
    was_up = bool(len(last)) and bool((last["normal_n"][:, number] <= 0.0).any())
    if memo["lift_m"] > table.const["flange_height_m"]:
        return "the wheel lost its load and lifted by more than its flange is high"
    if was_up:
        return "the wheel had lost its load, and nothing guided it"
    if memo["shift_m"] < 0.0:
        return "the wheel fell inward of its rail, where the contact table ends"
    angle = float(np.max(_last_metres(told[:, number])["angle_rad"], initial=0.0))
    limit = nadal(angle, float(table.const["friction"]))
    pressed = _y_over_q(told[:, number], int(sides[number]))
    end = f"where the contact table ends, {1e3 * float(memo['lift_m']):.0f} mm up its flange"
    if pressed > limit:
        return f"it climbed to {end}; Y/Q was above Nadal's {limit:.2f} at {np.rad2deg(angle):.0f} degrees"
    return f"it was thrown to {end}, with Y/Q below Nadal's {limit:.2f}"


def nadal(angle_rad: float, friction: float) -> float:
    """Nadal's limit of Y/Q for a flange angle: (tan(angle) - mu)/(1 + mu tan(angle)) (Nadal 1896)."""
    slope = float(np.tan(angle_rad))
    return (slope - friction) / (1.0 + friction * slope)


def _last_metres(told: RecordArray) -> RecordArray:
    """What was told (k,) of the last 2 m before the end."""
    if not len(told):
        return told
    near: RecordArray = told[np.abs(told["position_m"] - told["position_m"][-1]) < LOOK_BACK_M]
    return near


def _y_over_q(told: RecordArray, side: int) -> float:
    """Mean of a wheel's Y/Q over the last 2 m, positive outward; where it carried nothing it is 0."""
    last = _last_metres(told)
    if not len(last):
        return 0.0
    return float(np.mean(outward_ratio(last["guiding_n"], last["load_n"], side)))


def outward_ratio(guiding_n: FloatArray, load_n: FloatArray, side: int | IntArray) -> FloatArray:
    """Y/Q of wheels (..., w), positive where they press their rails outward; 0 where they carry nothing.

    ``side`` is +1 of a left wheel and -1 of a right one, or (w,).
    """
    ratio: FloatArray = -side * guiding_n / np.where(load_n > 0.0, load_n, np.inf)
    return ratio
