"""A wheel has left its rail: where, how, and what has most likely brought it there.

Forces beyond the contact table mean nothing, so a ride ends where it derails. What is said of it is read from
the rails there and from the contact of the last moments before.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from simrail.core.jit import FloatArray, IntArray
from simrail.track.laid_track import CHANNELS
from simrail.vehicle.contact.contact_geometry import COLUMNS, ContactTable
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.engines.force_data import Memory
from simrail.vehicle.engines.records import Record, RecordArray
from simrail.vehicle.model import Wheel

LOOK_BACK_M = 2.0
"""Y and Q are means over so much way; EN 14363 takes Y/Q over as much."""
LOOK_BACK_S = 0.25
"""What happened within this time before has something to do with it."""
UNLOADED, UNLOADED_S = 0.1, 0.05
"""A side that carries less than this share of its load, in the mean over this time, has lost it."""
THROWN_S = 0.05
"""A wheel that runs up its flange within less is thrown; one that takes longer climbs by steady forces.

Limits of Y/Q that depend on the duration of a force, as JNR's, draw that line (Evaluation of time-duration
dependent wheel load criteria for wheelclimb derailment, J. Dyn. Sys. Meas. Control 103, 1981); the
figure is ours.
"""
RAILS_LOOK_BACK = 180.0
"""Flange heights (5 m at full size) within which rails must not fall or lead aside by a flange height."""
SWING, SWING_S = 0.25, 2.0
"""An axle swings that goes from side to side and back within this time, by this share of the way to the end
of its flange."""


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
        Its Y over its Q, each in the mean over the last 2 m, or over what of them is known; positive where it
        pressed outward.
    cause : str
        The likely cause, in words.
    from_the_track : bool
        Whether the rails alone explain it.
    swung : bool
        Whether the axle has swung from side to side before, as one does that hunts.
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
    swung: bool

    @property
    def words(self) -> str:
        """All of it in one line."""
        over = f"{1e3 * abs(self.lift_m):.1f} mm {'over' if self.lift_m > 0.0 else 'under'}"
        aside = f"{1e3 * abs(self.shift_m):.1f} mm {'outward' if self.shift_m > 0.0 else 'inward'}"
        return (
            f"derailed: axle {self.axle} left the rail at s = {self.place_m:.1f} m, {self.time_s:.2f} s, "
            f"{3.6 * abs(self.speed_mps):.0f} km/h: wheel {self.wheel} stood {over} and {aside} of its "
            f"place, Y/Q {round(self.y_over_q, 2) + 0.0:.2f} (2 m mean), gauge {1e3 * self.gauge_m:.1f} mm; "
            f"likely cause: {self.cause}"
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
        swung=_swings(setup, axle, told),
    )


def _table(setup: Setup, number: int) -> ContactTable:
    """Contact table of a wheel; where the contact is prescribed, only its limits count."""
    contacts = contacts_of(setup.model, gravity_mps2=setup.gravity_mps2)
    return contacts.tables[contacts.of_wheel[number]]


def _track_cause(setup: Setup, wheel: Wheel, memo: Record, gauge_m: float) -> str:
    """What of the rails alone explains a derailment; an empty text if nothing does."""
    if setup.model.wheel_rail.linear is not None:
        return ""
    const = _table(setup, setup.model.wheels.index(wheel)).const
    high, end = float(const["flange_height_m"]), float(const["derailed_shift_m"])
    within = RAILS_LOOK_BACK * high
    (fell, fall), (led, aside) = _rail_leads(setup, wheel, memo, within)
    if fell > high:
        return f"the rail falls by {1e3 * fall:.0f} mm within {within:.1f} m, and no wheel follows"
    if led > high:
        return f"the rail leads aside by {1e3 * aside:.0f} mm within {within:.1f} m"
    wider = gauge_m - setup.model.wheel_rail.gauge_m
    # With one flange at the end of its rail, the other wheel stands at the end of its table, or beyond.
    if memo["shift_m"] < 0.0 and wider > -float(const["first_shift_m"]) - end:
        return f"the gauge is {1e3 * wider:.0f} mm too wide: only the edge of the tread is left on the rail"
    if wider < -end:
        return f"the gauge is {-1e3 * wider:.0f} mm too narrow: no wheelset fits between the rails"
    return ""


def _rail_leads(
    setup: Setup, wheel: Wheel, memo: Record, within_m: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """How far a rail falls, and how far it leads aside, within a length.

    The way before is as long, or what is run in `LOOK_BACK_S` if that is more: a wheel whose rail has fallen
    away from under it flies on.

    Returns
    -------
    (fell, fall), (led, aside) : float
        On the way before, and with what comes within the same length ahead; m.
    """
    speed, samples = float(memo["speed_mps"]), 100
    step = within_m / samples
    before = int(np.ceil(max(within_m, LOOK_BACK_S * abs(speed)) / step))
    way = (np.sign(speed) or 1.0) * step * np.arange(-before, samples + 1)
    s = np.clip(float(memo["derailed_s_m"]) + way, setup.track.design.start_m, setup.track.design.end_m)
    rails = setup.track.rails(s)
    across, heights = (rails[:, :2] if wheel.side > 0 else rails[:, 2:]).T

    def falls(z: FloatArray) -> float:
        windows = sliding_window_view(np.pad(z, (0, samples), mode="edge"), samples + 1)
        return float(np.max(z - windows.min(axis=1)))

    def spreads(y: FloatArray) -> float:
        windows = sliding_window_view(np.pad(y, (0, samples), mode="edge"), samples + 1)
        return float(np.max(np.ptp(windows, axis=1)))

    here = before + 1
    return (falls(heights[:here]), falls(heights)), (spreads(across[:here]), spreads(across))


def _motion_cause(setup: Setup, number: int, memo: Record, told: RecordArray) -> str:
    """What of the vehicle's motion explains a derailment."""
    if setup.model.wheel_rail.linear is not None:
        return "the wheelset went beyond where the prescribed linear contact has its flange"
    wheel, table = setup.model.wheels[number], _table(setup, number)
    last = told[-_rows(setup, LOOK_BACK_S) :]
    lost = _lost_sides(setup, number // 2, last)
    if lost:
        return lost
    if memo["lift_m"] > table.const["flange_height_m"]:
        return "the wheel lost its load and lifted by more than its flange is high"
    climb = _climb(told[:, number])
    if _was_up(setup, number, climb):
        return "the wheel had lost its load as it passed its flange, and nothing guided it"
    if memo["shift_m"] < 0.0:
        return "the wheel went inward to where the contact table ends"
    side = "friction_left" if wheel.side > 0 else "friction_right"
    factor = setup.track.channels(float(memo["derailed_s_m"]))[CHANNELS.index(side)]
    angle, friction = flange_angle(table), float(table.const["friction"]) * float(factor)
    limit = f"{nadal_limit(angle, friction):.2f} ({np.rad2deg(angle):.0f} degrees, friction {friction:.2f})"
    if len(climb) < THROWN_S * setup.rate_hz:
        blow = f"within {1e3 * len(climb) / setup.rate_hz:.0f} ms"
        return f"a blow from the side threw the wheel up its flange {blow}; Nadal's limit of Y/Q is {limit}"
    way = abs(float(memo["derailed_s_m"]) - float(climb["position_m"][0]))
    return f"flange climbing within {way:.1f} m; Nadal's limit of Y/Q is {limit}"


def _rows(setup: Setup, duration_s: float) -> int:
    """How many rows are told in a time, at least one."""
    return max(round(duration_s * setup.rate_hz), 1)


def _lost_sides(setup: Setup, axle: int, last: RecordArray) -> str:
    """Which wheels lost their load together in the last moments (k, w); an empty text if none.

    Of the derailed axle and the one nearest to it: a long vehicle turns over from one end. A single axle has
    no sides to speak of: there it is a matter of the one wheel.
    """
    model = setup.model
    if not len(last) or len(model.axle_names) < 2:
        return ""
    x = np.array([model.bodies[model.body_names.index(name)].position_m[0] for name in model.axle_names])
    pair = np.sort(np.argsort(np.abs(x - x[axle]), kind="stable")[:2])
    loads = model.wheel_load_n(setup.gravity_mps2)
    rows = min(_rows(setup, UNLOADED_S), len(last))
    lost = []
    for side in (1, -1):
        wheels = [i for i in (*(2 * pair), *(2 * pair + 1)) if model.wheels[i].side == side]
        share = last["load_n"][:, wheels].sum(axis=1) / loads[wheels].sum()
        lost.append(sliding_window_view(share, rows).mean(axis=1) < UNLOADED)
    left, right = lost
    of = " and ".join(model.axle_names[i] for i in pair)
    if (left & right).any():
        return f"all wheels of {of} lost their load at once, as a vehicle does that jumps"
    for of_side, word in ((left, "left"), (right, "right")):
        if of_side.any():
            return f"the {word} wheels of {of} lost their load together, as a vehicle does that turns over"
    return ""


def _climb(told: RecordArray) -> RecordArray:
    """What was told (k,) of a wheel since its tread last carried."""
    on_tread = np.flatnonzero((told["flag"] == 1) | (told["flag"] == 3))
    since: RecordArray = told[int(on_tread[-1]) + 1 :] if on_tread.size else told
    return since


def _was_up(setup: Setup, number: int, climb: RecordArray) -> bool:
    """Whether a wheel has lost its load (`UNLOADED`) at any time since its tread last carried (k,).

    In the mean, for on a steep flange at high friction a wheel on a rigid rail rattles upward.
    """
    if not len(climb):
        return False
    rows = min(_rows(setup, UNLOADED_S), len(climb))
    load = sliding_window_view(climb["load_n"], rows).mean(axis=1)
    return bool(load.min() < UNLOADED * setup.model.wheel_load_n(setup.gravity_mps2)[number])


def _swings(setup: Setup, axle: int, told: RecordArray) -> bool:
    """Whether an axle goes from one side to the other and back at the end of what was told (k, w)."""
    last = told[-_rows(setup, SWING_S) :]
    first, second = last["shift_m"][:, 2 * axle], last["shift_m"][:, 2 * axle + 1]
    # Both wheels stand outward by the axle's displacement, with opposite signs, and by half the play.
    y = 0.5 * (first - second)
    wide = SWING * float(_table(setup, 2 * axle).const["derailed_shift_m"])
    side = np.sign(y[np.abs(y) > wide])
    return int(np.count_nonzero(np.diff(side))) >= 2


def flange_angle(table: ContactTable) -> float:
    """Greatest contact angle (rad) of a wheel on its rail.

    The slope of the penetration over the shift is the tangent of the contact angle; of the two patches the
    deeper one touches.
    """
    cubic = table.coef[:, :, COLUMNS.index("penetration")]
    deeper = np.argmax(cubic[:, :, 3], axis=0)
    return float(np.arctan(np.max(cubic[deeper, np.arange(cubic.shape[1]), 2])))


def nadal_limit(contact_angle_rad: float, friction: float) -> float:
    """Y/Q above which a flange can climb: (tan a - mu) / (1 + mu tan a) (Nadal 1896).

    Parameters
    ----------
    contact_angle_rad : float
        Steepest angle of the flange, a.
    friction : float
        Coefficient of friction, mu.
    """
    tangent = np.tan(contact_angle_rad)
    return float((tangent - friction) / (1.0 + friction * tangent))


def _last_metres(told: RecordArray) -> RecordArray:
    """What was told (k,) of the last 2 m before the end."""
    if not len(told):
        return told
    near: RecordArray = told[np.abs(told["position_m"] - told["position_m"][-1]) < LOOK_BACK_M]
    return near


def _y_over_q(told: RecordArray, side: int) -> float:
    """A wheel's Y over its Q, each in the mean over the last 2 m, positive outward; 0 if it carried nothing.

    A mean of the ratio itself would count a wheel that rattles as one that is not pressed outward.
    """
    last = _last_metres(told)
    guiding, load = np.sum(last["guiding_n"], keepdims=True), np.sum(last["load_n"], keepdims=True)
    return float(outward_ratio(guiding, load, side)[0])


def outward_ratio(guiding_n: FloatArray, load_n: FloatArray, side: int | IntArray) -> FloatArray:
    """Y/Q of wheels (..., w), positive where they press their rails outward; 0 where they carry nothing.

    ``side`` is +1 of a left wheel and -1 of a right one, or (w,).
    """
    ratio: FloatArray = -side * guiding_n / np.where(load_n > 0.0, load_n, np.inf)
    return ratio
