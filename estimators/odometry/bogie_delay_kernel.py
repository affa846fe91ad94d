"""Compiled search for the delay between two IMUs on two bogies.

What one bogie feels, the next one feels once the train has run the distance L between them. With D(t) the
way, the sample of the one behind at t has its counterpart ahead at t' where D(t') = D(t) - L. The shape of
the speed over the last seconds is that of a filter; what is searched is a constant c that is added to it:

    D(t') + c t' = D(t) + c t - L,      rho(c) = sum of b(t) a(t') / sqrt(sum of b(t)^2 sum of a(t')^2)

over a window of the signal b behind and a ahead, both through the same band pass. The largest rho, and a
parabola through it and its neighbours, give c. So a window may hold braking and setting off. While nobody
knows how far the clocks are apart, that is what is searched: what it does to c grows with the speed, and over
a window that holds setting off no one c has both ends right.

The variance of c follows from rho and the band f1..f2. Of the delay between two signals of flat spectra, each
in noise of its own, seen for W seconds (Cramer-Rao bound: A. H. Quazi, IEEE Trans. ASSP 29(3) (1981) 527-533,
for signals that are not weak):

    sd_delay^2 = 3 (1/rho^2 - 1) / (8 pi^2 W (f2^3 - f1^3))

times (V^2/L)^2, with what two bogies that are not alike add.

Not here: the row of the filter (`simrail.estimators.odometry.zero_velocity_kernel`).
"""

import math
from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed

STEP_S = 2e-3
"""Step of the search, as a delay: a fifth of the width of the peak that a band up to 60 Hz makes."""

BESIDE, ALONE = 5, 0.8
"""Another peak more than so many steps aside, and more than this share as high, leaves open which it is."""

RECENT_S, ALIKE_SDS = 20.0, 3.0
"""Before the clocks' offset is known: searches of so long ago bear one out that tells the same within so many
standard deviations."""

MOST_NODES, MOST_CANDIDATES = 300, 4001
"""Steps that the way goes back, and steps of a search."""

CRAWLING = 0.25
"""Share of the least speed below which the train, seconds ago, had hardly left: there the shape is vague."""


class Echo(NamedTuple):
    """Two IMUs on a ride of k steps of a filter.

    Attributes
    ----------
    first, second : ndarray (n,), (m,)
        Their vertical forces through the band pass.
    first_s, second_s : ndarray (n,), (m,)
        Their stamps, each by its own clock.
    rate_hz : float
        Of both, about.
    end_s : ndarray (k,)
        Time at the end of each step, by the first clock.
    spacing_m : float
        How far the second is behind the first; below 0 for ahead.
    every, window, stride : int
        Steps from one search to the next; samples in a window, and every which of them is looked at.
    window_s, lag_s : float
        Length of the window; how late the band pass is: what it gives speaks of so long ago.
    least_speed_mps, least_correlation : float
        What a search asks for.
    width_sds, width_mps : float
        It goes so many standard deviations to either side, and this far at least.
    delay_variance : float
        sd_delay^2 / (1/rho^2 - 1), s^2.
    floor_mps, floor_share : float
        What two bogies that are not alike add to each: a speed, and a share of the speed.
    unlike_s : float
        Time within which what they add to all changes.
    shared : float
        Searches that look at the same sample: the variance of each is so many times larger.
    """

    first: FloatArray
    second: FloatArray
    first_s: FloatArray
    second_s: FloatArray
    rate_hz: float
    end_s: FloatArray
    spacing_m: float
    every: int
    window: int
    stride: int
    window_s: float
    lag_s: float
    least_speed_mps: float
    least_correlation: float
    width_sds: float
    width_mps: float
    delay_variance: float
    floor_mps: float
    floor_share: float
    unlike_s: float
    shared: float


class Pair(NamedTuple):
    """The two IMUs by the way that the train runs.

    Attributes
    ----------
    behind, ahead : ndarray (n,), (m,)
        Signals of the one behind and of the one ahead.
    behind_s, ahead_s : ndarray (n,), (m,)
        Their stamps.
    later_behind, later_ahead : float
        How much later than what it speaks of a sample is stamped, by the first clock.
    """

    behind: FloatArray
    ahead: FloatArray
    behind_s: FloatArray
    ahead_s: FloatArray
    later_behind: float
    later_ahead: float


class Span(NamedTuple):
    """Samples begin..last of the one behind, below 0 if there are too few; the last seen of the one ahead."""

    begin: int
    last: int
    seen: int


class Heard(NamedTuple):
    """Room for a search, and what came of each.

    Attributes
    ----------
    node_s, node_m : ndarray (q,)
        Times of the last steps, the last first, and the way since.
    rho : ndarray (r,)
        Of each candidate.
    searches : ndarray (k, 6)
        By step: 1 if it was taken, 0 if not, -1 if none was made; c, m/s; rho; standard deviation of c, 0 if
        none was found; how far the second clock is ahead by that delay alone, s, and the standard deviation
        of that.
    """

    node_s: FloatArray
    node_m: FloatArray
    rho: FloatArray
    searches: FloatArray


def room_to_hear(steps: int) -> Heard:
    """Room for a ride of so many steps."""
    searches = np.zeros((steps, 6))
    searches[:, 0] = -1.0
    return Heard(np.empty(MOST_NODES), np.empty(MOST_NODES), np.empty(MOST_CANDIDATES), searches)


@njit_borrowed
def search_delay(
    echo: Echo,
    heard: Heard,
    k: int,
    speed: float,
    sd: float,
    offset_s: float,
    length: float,
    acceleration: FloatArray,
    step_s: float,
    by_clock: bool = False,
) -> tuple[float, float]:
    """What the delay adds to the speed at the end of step k, in its own direction, and the variance of that.

    Parameters
    ----------
    echo, heard : Echo, Heard
    k : int
    speed, sd : float
        Speed by the filter, signed; standard deviation of what is searched.
    offset_s : float
        How far the second clock is ahead.
    length : float
        Distance of both IMUs, > 0.
    acceleration : ndarray (k,)
        Of each step so far.
    step_s : float
        Length of a step.
    by_clock : bool
        Search how far the second clock is ahead, in place of c, which is the c that does the same at the
        speed of now.

    Returns
    -------
    c, variance : float
        Variance 0 where nothing was found.
    """
    pair = _pair(echo, speed, offset_s)
    span = _span(echo, pair, echo.end_s[k])
    if span.begin < 0:
        return 0.0, 0.0
    begin_s = pair.behind_s[span.begin] - pair.later_behind
    nodes = _way_back(echo, heard, k, speed, acceleration, step_s, begin_s, length)
    if nodes == 0:
        return 0.0, 0.0
    size = abs(speed)
    step = STEP_S * size * size / length
    sides = min(math.ceil(max(echo.width_sds * sd, echo.width_mps) / step), (heard.rho.shape[0] - 1) // 2)
    best = 0
    for i in range(2 * sides + 1):
        c = (i - sides) * step
        if by_clock:
            ahead_s = offset_s - c * length / (size * speed) * math.copysign(1.0, echo.spacing_m)
            pair, c = _pair(echo, speed, ahead_s), 0.0
        heard.rho[i] = _correlation(heard, pair, span, nodes, c, length, echo.stride)
        if heard.rho[i] > heard.rho[best]:
            best = i
    most = heard.rho[best]
    heard.searches[k, 0], heard.searches[k, 2] = 0.0, most
    if most < echo.least_correlation or not _is_alone(heard.rho, best, sides):
        return 0.0, 0.0
    left, right = heard.rho[best - 1], heard.rho[best + 1]
    bend = left - 2.0 * most + right
    c = (best - sides + (0.5 * (left - right) / bend if bend < 0.0 else 0.0)) * step
    by_noise = echo.delay_variance * (1.0 / (most * most) - 1.0) * (size * size / length) ** 2
    variance = echo.shared * (by_noise + (echo.floor_mps + echo.floor_share * size) ** 2)
    heard.searches[k, 1], heard.searches[k, 3] = c, math.sqrt(variance)
    return c, variance


@njit_borrowed
def _pair(echo: Echo, speed: float, offset_s: float) -> Pair:
    """Which of both runs ahead, and how much later than what it speaks of each is stamped."""
    first, second = echo.lag_s, echo.lag_s + offset_s
    if (speed > 0.0) == (echo.spacing_m > 0.0):
        return Pair(echo.second, echo.first, echo.second_s, echo.first_s, second, first)
    return Pair(echo.first, echo.second, echo.first_s, echo.second_s, first, second)


@njit_borrowed
def _span(echo: Echo, pair: Pair, now: float) -> Span:
    """Samples of the window: nothing that is stamped later than now, nor what lies in the filter's future."""
    last = _index_at(pair.behind_s, min(now, now + pair.later_behind), echo.rate_hz)
    begin = last - echo.window + 1
    if begin < 0:
        return Span(-1, last, -1)
    return Span(begin, last, _index_at(pair.ahead_s, min(now, now + pair.later_ahead), echo.rate_hz))


@njit_borrowed
def _is_alone(rho: FloatArray, best: int, sides: int) -> bool:
    """Whether the largest rho lies inside the search, and no other peak is nearly as high."""
    if best == 0 or best == 2 * sides:
        return False
    for i in range(1, 2 * sides):
        is_peak = rho[i] >= max(rho[i - 1], rho[i + 1])
        if is_peak and abs(i - best) > BESIDE and rho[i] > ALONE * rho[best]:
            return False
    return True


@njit_borrowed
def is_borne_out(echo: Echo, heard: Heard, k: int, step_s: float) -> bool:
    """Whether searches before step k, in other samples, tell the same offset of the clocks.

    As long as nobody knows that offset a search is wide, and one wave in another's place leads everything
    astray. A true offset is the same at any speed; a false one is not.

    Parameters
    ----------
    echo, heard : Echo, Heard
    k : int
        Step whose search tells ``heard.searches[k, 4]``.
    step_s : float
        Length of a step.
    """
    same = others = 0
    apart = math.ceil(echo.window_s / step_s)
    for i in range(max(0, k - round(RECENT_S / step_s)), k + 1 - apart):
        if heard.searches[i, 3] > 0.0:
            sd = math.hypot(heard.searches[i, 5], heard.searches[k, 5])
            if abs(heard.searches[i, 4] - heard.searches[k, 4]) < ALIKE_SDS * sd:
                same += 1
            else:
                others += 1
    return same > 0 and same >= others


@njit_borrowed
def _index_at(stamps: FloatArray, time_s: float, rate_hz: float) -> int:
    """Last sample whose stamp is not later than a time; -1 if there is none."""
    n: int = stamps.shape[0]
    i: int = min(max(int((time_s - stamps[0]) * rate_hz), 0), n - 1)
    while i >= 0 and stamps[i] > time_s:
        i -= 1
    while i + 1 < n and stamps[i + 1] <= time_s:
        i += 1
    return i


@njit_borrowed
def _way_back(
    echo: Echo,
    heard: Heard,
    k: int,
    speed: float,
    acceleration: FloatArray,
    step_s: float,
    begin_s: float,
    length: float,
) -> int:
    """Way of the last steps, back from step k by the accelerations; how many, 0 if they do not reach.

    They reach where the train had yet to run the distance of the IMUs, and some, to the window's begin.
    """
    sign = 1.0 if speed > 0.0 else -1.0
    v, way, way_at_begin = sign * speed, 0.0, -1.0
    heard.node_s[0], heard.node_m[0] = echo.end_s[k], 0.0
    for q in range(1, min(heard.node_s.shape[0], k + 1)):
        before = v - sign * acceleration[k + 1 - q] * step_s
        if before < CRAWLING * echo.least_speed_mps:
            return 0
        way += 0.5 * (v + before) * step_s
        v = before
        heard.node_s[q], heard.node_m[q] = echo.end_s[k - q], way
        if way_at_begin < 0.0 and heard.node_s[q] <= begin_s:
            way_at_begin = way
        if way_at_begin >= 0.0 and way > way_at_begin + 1.3 * length:
            return q + 1
    return 0


@njit_borrowed
def _correlation(
    heard: Heard, pair: Pair, span: Span, nodes: int, c: float, length: float, stride: int
) -> float:
    """rho(c) over the window; -1 where it reaches beyond what is known."""
    now = heard.node_s[0]
    both = squares = others = 0.0
    here = there = 0
    j = span.seen
    for i in range(span.last, span.begin - 1, -stride):
        t = pair.behind_s[i] - pair.later_behind
        while here < nodes - 2 and heard.node_s[here + 1] > t:
            here += 1
        share = (heard.node_s[here] - t) / (heard.node_s[here] - heard.node_s[here + 1])
        way = heard.node_m[here] + share * (heard.node_m[here + 1] - heard.node_m[here])
        way += c * (now - t) + length
        low = heard.node_m[there] + c * (now - heard.node_s[there])
        high = heard.node_m[there + 1] + c * (now - heard.node_s[there + 1])
        while there < nodes - 2 and high < way:
            there += 1
            low, high = high, heard.node_m[there + 1] + c * (now - heard.node_s[there + 1])
        if high < way or high <= low:
            return -1.0
        share = (way - low) / (high - low)
        place = heard.node_s[there] + share * (heard.node_s[there + 1] - heard.node_s[there])
        place += pair.later_ahead
        while j >= 0 and pair.ahead_s[j] > place:
            j -= 1
        if j < 0 or j + 1 > span.seen:
            return -1.0
        share = (place - pair.ahead_s[j]) / (pair.ahead_s[j + 1] - pair.ahead_s[j])
        value = pair.ahead[j] + share * (pair.ahead[j + 1] - pair.ahead[j])
        both += pair.behind[i] * value
        squares += pair.behind[i] * pair.behind[i]
        others += value * value
    return both / math.sqrt(squares * others) if squares > 0.0 and others > 0.0 else -1.0
