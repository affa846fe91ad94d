"""Whether a ride contradicts its sheets, and bounds of the error for where it does not.

A sheet that is wrong does not show in every innovation: a filter explains what it sees by the states that it
has. It shows in these states, which leave what was known of them before the ride; and in innovations that go
on having one sign. Both are judged here, from nothing that is later. States that a sheet calls known to the
millimetre move nowhere: that a map is worse than its sheet shows in what the gyro finds in its curves.

A bound is what the error stays within 99.9 % of the time where all is as the sheets say. It grows with what
speaks against them; once that is too much (`contradiction` above 1) it is a fault, and none holds any more.
"""

import numpy as np
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.line import numbers_at
from simrail.estimators.track_relative.noise import AT_MPS
from simrail.estimators.track_relative.output import Trace

from simrail.core.jit import FloatArray
from simrail.core.trailing import trailing_sum
from simrail.track.design import STRAIGHT

CONSTANTS = (
    *(at.SCALE, at.CURVE, at.EVEN, at.ODD, at.CANT, at.SLOPE),
    *(*at.GYRO_BIAS, *at.ACCEL_BIAS, *at.GYRO_OF_Z, *at.ACCEL_OF_X, *at.ACCEL_OF_Y),
)
"""States of which a sheet says how large they are: of wheel, map and IMU. What the body does has none."""

MOST_SDS = 5.0
"""Of these, from what was known before. A map has some thirty errors: 4 in one of a thousand rides."""

WINDOW_S = 5.0
"""Over which innovations are added up."""

MOST_SUM = (8.0, 14.0, 6.0, 5.0, 9.5, 11.0)
"""Of innovations over their sds and the root of their number, of three gyros and three accelerometers:
one and a half times the largest of sound rides of simrail's vehicles, with the best IMUs, behind which
nothing hides; shaking is not white. Synthetic."""

MOST_OTHER_SUM = 6.5
"""The same of every measurement beside the IMU's."""

MOST_BENT = 1.4
"""Mean square of the sums over whole curves and transitions, of the gyro about Z, at `AT_MPS`: sound rides of
simrail's vehicles reach 1.2, but for a train's end body, which its neighbours turn: 1.7. A larger limit would
miss more maps that are worse than their sheet. Synthetic."""

PATIENCE = 6
"""Curves and transitions without any surprise that are counted beside those of the ride: three of its own are
a chance, twenty are not."""

LEAST_S, MOVES_MPS = 1.0, 1.0
"""An element counts if the train ran on it, faster than that, for so long."""

BOUND_SDS = 3.29
"""Standard deviations that a normal error exceeds in one of a thousand cases."""

ALLOWED = 2.0
"""Times that, since an sd is of a class of vehicles and lines, and not of this one; synthetic."""


def contradiction(trace: Trace) -> FloatArray:
    """How much speaks against the sheets at each step, over what is still borne (n,)."""
    sd = np.sqrt(np.diag(trace.course.start_covariance)[: at.STATES])
    known = [i for i in CONSTANTS if sd[i] > 0.0]
    off = np.abs(trace.states[:, known] - trace.course.start[known]) / sd[known]
    off = off.max(axis=1, initial=0.0) / MOST_SDS
    sums = np.abs(_sums(trace)) / np.array([*MOST_SUM, *[MOST_OTHER_SUM] * (trace.surprises.shape[1] - 6)])
    worst = np.maximum(off, sums.max(axis=1, initial=0.0))
    return np.asarray(np.maximum(worst, in_curves(trace) / MOST_BENT))


def in_curves(trace: Trace) -> FloatArray:
    """Mean square (n,) of the sums of the Z gyro's innovations over each curve and transition passed so far.

    Each sum is over the root of its number. What a model of yaw lacks goes by the distance, so that it is
    correlated over more samples the slower the train is: the square is taken in proportion to the speed.
    """
    steps, place = trace.course.steps, trace.course.around.states[:, at.S]
    speed = np.abs(trace.course.around.states[:, at.V])
    number, _, _ = numbers_at(trace.course.lines, place)
    is_bent = np.array([element.kind != STRAIGHT for element in trace.course.recording.track.elements])
    squares, passed = np.zeros(len(place)), np.zeros(len(place))
    ends = np.flatnonzero(np.diff(number)) + 1
    for first, last in zip([0, *ends], ends, strict=False):
        runs = first + np.flatnonzero(speed[first:last] > MOVES_MPS)
        if is_bent[number[first]] and len(runs) * steps.dt >= LEAST_S:
            total = trace.surprises[runs, 2].sum()
            squares[last] = total**2 / len(runs) * speed[runs].mean() / AT_MPS
            passed[last] = 1.0
    return np.asarray(np.cumsum(squares) / (np.cumsum(passed) + PATIENCE))


def _sums(trace: Trace) -> FloatArray:
    """Sums (n, m) of the innovations of the last `WINDOW_S`, over the root of their number."""
    window = max(1, round(WINDOW_S / trace.course.steps.dt))
    made = np.isfinite(trace.surprises)
    number = trailing_sum(made.astype(np.float64), window)
    added = trailing_sum(np.where(made, trace.surprises, 0.0), window)
    return np.asarray(added / np.sqrt(np.maximum(number, window)))


def faults_and_widening(trace: Trace) -> tuple[FloatArray, FloatArray]:
    """Whether there has been a fault, 0 or 1, and what an sd is widened by, (1 + n,).

    The first is of before the ride, the others of the end of each step.
    """
    against = np.concatenate([[0.0], contradiction(trace)])
    faults = np.maximum.accumulate(against > 1.0)
    return faults.astype(np.float64), ALLOWED * BOUND_SDS * np.maximum(1.0, against)
