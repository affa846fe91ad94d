"""What changes within a ride: a device that comes loose, a clock, an offset or a counter that jumps.

A fit of the whole ride bends around such a change, and what it leaves is a step, or what a step of some
parameter would do. So each of `GROUPS` is held against what a fit leaves, at a row of moments: how much of it
a change there would explain. That is linear, and costs no fit. Where one explains much, the ride is fitted
with that change, from a sound ride's values, and the moment is moved until it fits best.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import qr

from simrail.core.jit import FloatArray
from simrail.recording.evidence.finding import LIKELY, SURE
from simrail.recording.evidence.fit import Fit, Near, fit, hints, linear
from simrail.recording.evidence.model import (
    CHANNELS,
    FORCE_X,
    GAINS,
    INDEX,
    LATES,
    THEN,
    Ride,
    start_values,
)
from simrail.recording.evidence.readings import expected
from simrail.recording.evidence.search import explains
from simrail.recording.evidence.single import WHOLE, WORTH, Single, left_over
from simrail.recording.evidence.slack import accused, distance, slack_of

GROUPS = (
    ("then_roll", "then_pitch", "then_yaw"),
    ("then_offset",),
    ("then_wheel",),
    *((name,) for name, of in THEN.items() if "bias" in of),
)
"""What changes at once."""

BENT = (("then_offset",), ("then_wheel",))
"""What a fit without it bends around."""

MOMENTS, FEWER, ENDS = 24, 12, 6
"""Moments that are looked at, in a line and by fits; and blocks at both ends that tell nothing."""

SHARE = 0.25
"""Share of what a fit leaves that a change has to explain, for a fit with it."""

LESS = 0.8
"""Share of what a fit leaves that one with a change may leave at most."""

TRIED, FEW, ROUGH = 2, 6, 4
"""Changes that are followed by fits, and rounds of those, and of fits that only look for a moment."""

JERK_S = 2.0
"""How long before and after it a change of the wheel shows in its acceleration."""

OTHER_WAY = -2.0
"""Change of the factor of a wheel whose counter runs the other way from then on: far from any that a fit
without it takes, of which a ride that has this for half of its time shows none."""

AGREES, BOTH = 0.75, 0.1
"""Correlation of wheel and push, turned at a moment, from which on a counter has turned its sign; and
what either side of the moment has of it at least."""

MOST_PUSH_MPS2 = 3.0
"""An acceleration that no train has."""

STRAINED = 10.0
"""Strain of a fit from which on it is bent; sound rides, and those with one fault, have up to five."""


class Change(NamedTuple):
    """What may change, the block from which on, and the share of what is left that it explains."""

    group: tuple[str, ...]
    then: int
    share: float


def change_of(ride: Ride, found: Fit, blamed: int) -> tuple[Ride, Single] | None:
    """The ride with what changes within it, and what it says with that; None if nothing changes.

    Parameters
    ----------
    ride : Ride
        The blocks.
    found : Fit
        The best one of a ride that does not change.
    blamed : int
        How many figures it has wrong.
    """
    turned = _turned(ride)
    looked_at = changes(ride, found)[:TRIED]
    if blamed > 1 or found.strain > STRAINED:
        looked_at += bent(ride, found)
    if turned is not None:
        looked_at = [Change(BENT[1], turned, 1.0)]
    told = []
    for change in looked_at:
        other, one = _moved(ride, change, found)
        slack = slack_of(other, one)
        off = {name: distance(name, one.value(name), one.sd(name), slack[name]) for name in change.group}
        wrong = tuple(name for name in change.group if off[name] > LIKELY)
        if not wrong or accused(one, slack, WHOLE) or not explains(other, one):
            continue
        is_sure, was_left = max(off.values()) > SURE, left_over(found, one.noise)
        is_much = is_sure and _left_over(one, wrong, one.noise) < LESS * was_left
        if (turned is not None and is_sure) or is_much or _instead(one, wrong, was_left, blamed):
            told.append((other, one, wrong, change.group))
    if not told:
        return None
    noise = np.min([one.noise for _, one, _, _ in told], axis=0)
    other, one, wrong, group = min(told, key=lambda entry: _left_over(entry[1], entry[2], noise))
    figures = {name: (one.value(name), one.sd(name)) for name in wrong}
    figures |= hints(other, one, [*GAINS, *LATES], free=group)
    slack, moment = slack_of(other, one), _moment_s(other)
    return other, Single(one, wrong, figures, slack, changed_s=moment, way=other.way.device)


def _instead(one: Fit, wrong: tuple[str, ...], was_left: float, blamed: int) -> bool:
    """Whether a change is believed instead of what a fit without it blames: its moment has to save, too."""
    left = left_over(one, one.noise) + WORTH
    return blamed > 0 and left + WORTH * len(wrong) < was_left + WORTH * min(blamed, len(wrong))


def _left_over(found: Fit, wrong: tuple[str, ...], noise: FloatArray) -> float:
    return left_over(found, noise) + WORTH * len(wrong)


def changes(ride: Ride, found: Fit) -> list[Change]:
    """Changes that explain much of what a fit leaves, the best first; each group at its best moment."""
    if len(ride.measured) < 4 * ENDS:
        return []
    near = linear(ride, found.x, found.noise, found.weights, ())
    return _Left(near, found.left, found.noise, range(len(near.sds))).best()


def bent(ride: Ride, found: Fit) -> list[Change]:
    """Changes that bend a fit without them: those that a sound ride's values leave.

    Of clocks and wheels, which are far from linear, those of the best fits from there.
    """
    count = len(ride.measured)
    if count < 4 * ENDS:
        return []
    near = linear(ride, start_values(), found.noise, np.ones_like(found.weights), ())
    kept = np.setdiff1d(np.arange(len(near.sds)), [near.column(name) for name in WHOLE])
    told = _Left(near, near.rest * near.seen[:, None], found.noise, kept.tolist()).best()[:TRIED]
    for group in BENT:
        fits = {
            then: _best_from(_changing(ride, group, then), group, found, ROUGH)
            for then in _moments(count, FEWER)
        }
        told.append(Change(group, min(fits, key=lambda then: _bends(fits[then])), 1.0))
    return told


def _changing(ride: Ride, group: tuple[str, ...], then: int) -> Ride:
    """A ride in which something changes; where a wheel counts otherwise it seems to jerk, for some blocks."""
    if group != BENT[1]:
        return replace(ride, then=then)
    jerks = np.abs(np.arange(len(ride.measured)) - then + 0.5) < round(JERK_S / ride.block_s)
    return replace(ride, then=then, slid=jerks if ride.slid is None else jerks | ride.slid)


def _start(group: tuple[str, ...], found: Fit) -> FloatArray:
    """A sound ride's values; but what a fit without a change blames of a clock or a wheel came later."""
    x = start_values()
    for name in group if group in BENT else ():
        of = THEN[name]
        x[INDEX[name]] = found.value(of) - x[INDEX[of]]
    return x


def _starts(group: tuple[str, ...], found: Fit) -> list[FloatArray]:
    """Values that a change is sought from; of a wheel also those of one that counts the other way then."""
    starts = [_start(group, found)]
    if group == BENT[1]:
        turned = start_values()
        turned[INDEX[group[0]]] = OTHER_WAY
        starts.append(turned)
    return starts


def _moments(count: int, most: int) -> list[int]:
    """Blocks at which a change is looked for."""
    return sorted({int(place) for place in np.linspace(ENDS, count - ENDS, most)})


class _Left:
    """What is left of a ride near some parameters, when some of them are solved for beside a change.

    Parameters
    ----------
    near : Near
        The ride near them.
    left : ndarray (b, 5)
        What is left there.
    noise : ndarray (2, 5)
        Of a fit.
    columns : sequence of int
        What is solved for, of ``near``.
    """

    def __init__(self, near: Near, left: FloatArray, noise: FloatArray, columns: Sequence[int]) -> None:
        # A step makes noise of its own: that of a block is taken from its neighbours.
        rough = 1.4826 * np.median(np.abs(np.diff(left, axis=0)), axis=0) / np.sqrt(2.0)
        root = near.seen[:, None] / np.maximum(rough, 1e-2 * noise[0])
        self._flat = near.jacobian.reshape(near.rest.size, -1) * root.reshape(-1, 1)
        self._near, kept = near, np.asarray(columns)
        rows = np.vstack([self._flat[:, kept], np.diag(1.0 / near.sds[kept])])
        self._base = qr(rows, mode="economic", overwrite_a=True, check_finite=False)[0]
        rest = np.concatenate([(near.rest * root).ravel(), near.off[kept] / near.sds[kept]])
        self._rest = rest - self._base @ (self._base.T @ rest)
        self._total = float(self._rest @ self._rest)

    def share(self, group: Sequence[str], then: int) -> float:
        """Share of it that a change of some parameters from a block on explains."""
        begin, end = then * CHANNELS, len(self._flat)
        late = np.zeros((len(self._rest), len(group)))
        for i, name in enumerate(group):
            late[begin:end, i] = self._flat[begin:, self._near.column(THEN[name])]
        late -= self._base @ (self._base.T @ late)
        gain = late.T @ self._rest
        solved = np.linalg.lstsq(late.T @ late, gain, rcond=1e-9)[0]
        return float(gain @ solved) / self._total if self._total > 0.0 else 0.0

    def best(self) -> list[Change]:
        """The best moment of each group that explains much, the best first."""
        moments, told = _moments(len(self._flat) // CHANNELS, MOMENTS), []
        for group in GROUPS:
            shares = [self.share(group, then) for then in moments]
            best = int(np.argmax(shares))
            if shares[best] > SHARE:
                told.append(Change(group, moments[best], shares[best]))
        return sorted(told, key=lambda change: -change.share)


def _moved(ride: Ride, change: Change, before: Fit) -> tuple[Ride, Fit]:
    """The ride and its fit with a change, when it fits best; `before` is one without it."""

    def at(then: int, rounds: int) -> tuple[Ride, Fit]:
        other = _changing(ride, change.group, then)
        return other, _best_from(other, change.group, before, rounds)

    count = len(ride.measured)
    best = at(change.then, FEW)
    step = max(1, count // MOMENTS // 2)
    while True:
        assert best[0].then is not None
        places = (best[0].then - step, best[0].then + step)
        beside = [at(then, FEW) for then in places if ENDS <= then <= count - ENDS]
        better = min(beside, key=lambda pair: _bends(pair[1]))
        if _bends(better[1]) < _bends(best[1]):
            best = better
        elif step == 1:
            break
        else:
            step //= 2
    assert best[0].then is not None
    return at(best[0].then, 15)


def _turned(ride: Ride) -> int | None:
    """Block from which on a wheel counts the other way, by the accelerometer; None if it does not.

    However a fit without that bends, even out of the map: wheel and push agree up to there, and then with
    the other sign.
    """
    wheel, felt = expected(ride, start_values())[:, FORCE_X], ride.measured[:, FORCE_X]
    # Where it turns, a wheel seems to jerk as no train does.
    felt, wheel = felt - np.median(felt), np.where(np.abs(wheel) > MOST_PUSH_MPS2, 0.0, wheel)
    along = np.cumsum(wheel * felt) / max(float(np.linalg.norm(wheel) * np.linalg.norm(felt)), 1e-12)
    if len(along) <= 2 * ENDS:
        return None
    then = ENDS + int(np.argmax(2.0 * along[ENDS:-ENDS] - along[-1]))
    parts = along[then], along[then] - along[-1]
    return then + 1 if sum(parts) > AGREES and min(parts) > BOTH else None


def _best_from(ride: Ride, group: tuple[str, ...], before: Fit, rounds: int) -> Fit:
    """The best fit with a change, of those from all starts."""
    fits = [fit(ride, begin, free=group, rounds=rounds) for begin in _starts(group, before)]
    return min(fits, key=_bends)


def _bends(found: Fit) -> float:
    """What a fit leaves and what it strains: beside the right moment a map that bends may leave as little."""
    return found.cost + found.strain / found.left.size


def _moment_s(ride: Ride) -> float:
    """Time stamp of the IMU at which something changes."""
    assert ride.then is not None
    return float(ride.recording.imu.index[0]) + ride.then * ride.block_s
