"""The track as it lies: the design and one realisation of its irregularities, as one table of splines.

The table holds what an engine needs at every wheel and every step: the design line, the deviations of both
rails and their friction, as C2 cubic splines on a uniform grid. C2, because the second derivative of a
rail is what shakes an axle: a piecewise-linear table puts 0.4 m/s^2 of facet noise on it. The splines *are*
the rails: truth and references are read from the same table.

This module knows nothing of wheels.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.interpolate import CubicSpline

from simrail.core.columns import IRREGULARITY
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.shown import Facts, Shown, names
from simrail.core.toml_files import blame
from simrail.track.defects import check_defects, deviations, shortest_wave_m
from simrail.track.design import TrackDesign
from simrail.track.irregularity import PERIOD_M, SAMPLES_PER_WAVE, Irregularity, fade, realise_all
from simrail.track.measured import FINEST_STEP_M, MeasuredRails, refuse_amplitude
from simrail.track.rail_condition import RailCondition, check_conditions, friction_factors
from simrail.track.sections import section_gain

CHANNELS = (
    "x",
    "y",
    "z",
    "yaw",
    "pitch",
    "roll",
    "y_left",
    "z_left",
    "y_right",
    "z_right",
    "friction_left",
    "friction_right",
)
"""Columns of the table: design line (global, m and rad), rail deviations in the track frame (m), friction
of each rail over that of a clean one."""

RAILS = slice(6, 10)
"""The rail deviations among the channels."""


@dataclass(frozen=True, eq=False, repr=False)
class LaidTrack(Shown):
    """A design track with one realisation of its irregularities.

    Attributes
    ----------
    design : TrackDesign
        The design.
    irregularity : Irregularity
        What was drawn.
    seed : int
        With which root seed.
    table_start_m, table_step_m : float
        Knot i stands at table_start_m + i table_step_m; knots are whole multiples of the step, so the
        first lies at most one step before the track's start and the last one after its end.
    conditions : tuple of RailCondition
        What lies on the rails.
    table : ndarray (n_intervals, 12, 4)
        Cubic coefficients of `CHANNELS`, C-contiguous, read-only. In interval i with
        t = s - s_i: value = ((c0 t + c1) t + c2) t + c3.
    """

    design: TrackDesign
    irregularity: Irregularity
    seed: int
    table_start_m: float
    table_step_m: float
    table: FloatArray
    conditions: tuple[RailCondition, ...] = ()

    def _facts(self) -> Facts:
        low, high = self.irregularity.wavelengths_m
        facts = {
            "design": f"{self.design.name}, {self.design.length_m:,.0f} m",
            "rails": f"{self.irregularity.spectrum}, waves of {low:g} to {high:g} m, seed {self.seed}",
            "defects": names(type(defect).__name__ for defect in self.irregularity.defects),
            "conditions": names(type(condition).__name__ for condition in self.conditions),
            "knots": f"{len(self.table) + 1:,} at {self.table_step_m:g} m",
        }
        return self.design.name, facts

    def channels(self, s: npt.ArrayLike, *, derivative: int = 0) -> FloatArray:
        """All channels, or their derivative with respect to s, at places s.

        Parameters
        ----------
        s : array_like (...)
            Places on the track, m.
        derivative : int
            0, 1, 2 or 3.

        Returns
        -------
        ndarray (..., 12)
            In the order of `CHANNELS`.

        Raises
        ------
        InputError
            If a place is off the track.
        """
        return self._evaluate(s, slice(None), derivative)

    def rails(self, s: npt.ArrayLike, *, derivative: int = 0) -> FloatArray:
        """Rail deviations y_left, z_left, y_right, z_right in the track frame, m; (..., 4)."""
        return self._evaluate(s, RAILS, derivative)

    def irregularities(self, s: npt.ArrayLike) -> pd.DataFrame:
        """The four irregularities of the rails at places s (n,).

        Returns
        -------
        pandas.DataFrame
            Indexed by ``position_m``, columns `simrail.core.columns.IRREGULARITY`, m.
        """
        s = np.atleast_1d(np.asarray(s, dtype=float))
        y_left, z_left, y_right, z_right = self.rails(s).T
        values = (
            0.5 * (y_left + y_right),
            0.5 * (z_left + z_right),
            z_left - z_right,
            y_left - y_right,
        )
        index = pd.Index(s, name="position_m")
        return pd.DataFrame(dict(zip(IRREGULARITY, values, strict=True)), index=index)

    def _evaluate(self, s: npt.ArrayLike, columns: slice, derivative: int) -> FloatArray:
        s = self.design.on_track(s)
        interval = np.floor((s - self.table_start_m) / self.table_step_m).astype(np.int64)
        interval = np.clip(interval, 0, self.table.shape[0] - 1)
        t = (s - (self.table_start_m + interval * self.table_step_m))[..., None]
        c = self.table[interval, columns]
        if derivative == 0:
            return ((c[..., 0] * t + c[..., 1]) * t + c[..., 2]) * t + c[..., 3]
        if derivative == 1:
            return (3.0 * c[..., 0] * t + 2.0 * c[..., 1]) * t + c[..., 2]
        if derivative == 2:
            return 6.0 * c[..., 0] * t + 2.0 * c[..., 1]
        return 6.0 * c[..., 0] + 0.0 * t


def knot_step_m(irregularity: Irregularity) -> float:
    """Distance of the spline knots: 0.125 m, or the half, quarter, ... of it that shorter waves need."""
    shortest = min(irregularity.wavelengths_m[0], shortest_wave_m(irregularity.defects))
    needed = shortest / SAMPLES_PER_WAVE
    if irregularity.measured is not None:
        needed = min(needed, max(irregularity.measured.step_m, FINEST_STEP_M))
    return 0.125 * 0.5 ** max(0, math.ceil(math.log2(0.125 / needed)))


def lay(
    design: TrackDesign,
    irregularity: Irregularity,
    *,
    seed: int,
    conditions: Sequence[RailCondition] = (),
) -> LaidTrack:
    """Draw the irregularities and lay the track.

    Parameters
    ----------
    design : TrackDesign
        The design.
    irregularity : Irregularity
        What to draw.
    seed : int
        Root seed; another seed is another track.
    conditions : sequence of RailCondition
        What lies on the rails, and where.

    Raises
    ------
    InputError
        If the design makes no line, the irregularity cannot be drawn, the track is shorter than both
        fades, or longer than the period of the irregularity, or a rail condition does not fit.
    """
    design.check()
    irregularity.check()
    check_conditions(conditions, design.start_m, design.end_m)
    check_defects(irregularity.defects, design.start_m, design.end_m)
    check_stretch(irregularity, design)
    check_measured(irregularity, design)
    table_step_m = knot_step_m(irregularity)
    first = math.floor(design.start_m / table_step_m)
    last = max(math.ceil(design.end_m / table_step_m), first + 4)
    knots = np.arange(first, last + 1)
    s = np.asarray(knots * table_step_m, dtype=np.float64)
    rails = _rails(_drawn(design, irregularity, seed, knots, table_step_m))
    if irregularity.defects:
        rails += deviations(irregularity.defects, s)
    splines = (
        _design_splines(design, s),
        _coefficients(CubicSpline(s, rails)),
        _coefficients(CubicSpline(s, friction_factors(conditions, s))),
    )
    table = np.concatenate(splines, axis=1)
    table = np.ascontiguousarray(table).view()
    table.flags.writeable = False  # of this view: kernels get what it is a view of
    start = float(s[0])
    return LaidTrack(design, irregularity, int(seed), start, table_step_m, table, tuple(conditions))


def stretch_m(irregularity: Irregularity, design: TrackDesign) -> tuple[float, float]:
    """Where what the spectrum gives begins and ends."""
    start, end = irregularity.start_m, irregularity.end_m
    return design.start_m if start is None else start, design.end_m if end is None else end


def check_stretch(irregularity: Irregularity, design: TrackDesign) -> None:
    """Refuse irregularities that are off the track, or have no room to fade in and out.

    Raises
    ------
    InputError
        Naming the field of the irregularity.
    """
    start, end = stretch_m(irregularity, design)
    for name, place in (("start_m", start), ("end_m", end)):
        if not design.start_m <= place <= design.end_m:
            raise InputError(
                "the irregularity is not on the track",
                field=f"irregularity.{name}",
                value=place,
                limit=f"{design.start_m:g} to {design.end_m:g} m",
                remedy="move it onto the track, or leave it out: the irregularity then has all of the track",
            )
    if irregularity.fade_m == 0.0 and (start, end) != (design.start_m, design.end_m):
        raise InputError(
            "the rails would have a step where the irregularity begins or ends",
            field="irregularity.fade_m",
            value=0.0,
            limit="> 0 m with start_m or end_m",
            remedy="e.g. 40.0",
        )
    whole = design.length_m <= PERIOD_M
    if not (2.0 * irregularity.fade_m <= end - start and whole):
        raise InputError(
            "track and irregularity do not fit",
            field="irregularity.fade_m" if whole else "irregularity",
            value=f"{irregularity.fade_m:g} m twice on a track of {end - start:g} m",
            limit=f"twice the fade <= track <= {PERIOD_M:g} m, where the realisation would repeat",
            remedy="shorten fade_m" if whole else "cut the track in two",
        )


def overlap_m(measured: MeasuredRails, design: TrackDesign) -> tuple[float, float]:
    """Where measured rails lie on a track."""
    return max(measured.start_m, design.start_m), min(measured.end_m, design.end_m)


def check_measured(irregularity: Irregularity, design: TrackDesign) -> None:
    """Refuse measured rails that are off the track, or have no room to fade in and out.

    Raises
    ------
    InputError
        Naming the field of the irregularity.
    """
    measured = irregularity.measured
    if measured is None:
        return
    start, end = overlap_m(measured, design)
    value = f"{measured.name} lies from {measured.start_m:g} to {measured.end_m:g} m"
    if not end - start > 2.0 * irregularity.fade_m:
        off = end <= start
        raise InputError(
            "the measured rails are not on the track" if off else "the measured rails are too short to fade",
            field="irregularity.measured.start_m" if off else "irregularity.fade_m",
            value=value if off else f"{irregularity.fade_m:g} m twice; {value}",
            limit=f"the track is {design.start_m:g} to {design.end_m:g} m"
            if off
            else f"< {0.5 * (end - start):g} m",
            remedy="set start_m to where the first sample lies on the track" if off else "shorten fade_m",
        )
    if irregularity.fade_m == 0.0 and (start, end) != (design.start_m, design.end_m):
        raise InputError(
            "the rails would have a step where the measured ones begin or end",
            field="irregularity.fade_m",
            value=f"0 m; {value}",
            limit=f"> 0 m, or a file from {design.start_m:g} to {design.end_m:g} m",
            remedy="e.g. 20.0",
        )
    if measured.has_cant:
        s = measured.position_m[(measured.position_m >= start) & (measured.position_m <= end)]
        with blame(measured.name):
            level = _less_cant(measured, design, s)[:, IRREGULARITY.index("cross_level_m")]
            refuse_amplitude("cross_level_m", s, level)


def _drawn(
    design: TrackDesign,
    irregularity: Irregularity,
    seed: int,
    knots: npt.NDArray[np.int64],
    step_m: float,
) -> FloatArray:
    """What spectrum and file give at the knots, faded, in the order of `IRREGULARITY`, m; (n, 4)."""
    s: FloatArray = np.asarray(knots * step_m, dtype=np.float64)
    drawn: FloatArray = np.zeros((len(knots), 4))
    if irregularity.spectrum != "none":
        period = realise_all(irregularity, seed=seed, step_m=step_m)
        drawn = period[knots % period.shape[0]]
        start, end = stretch_m(irregularity, design)
        drawn *= fade(s, start, end_m=end, length_m=irregularity.fade_m)[:, None]
        if irregularity.section_gain is not None:
            gain = section_gain(s, irregularity.section_gain, start_m=design.start_m, seed=seed)
            drawn[:, [i for i, name in enumerate(IRREGULARITY) if name != "gauge_m"]] *= gain[:, None]
    measured = irregularity.measured
    if measured is not None:
        start, end = overlap_m(measured, design)
        here = fade(s, start, end_m=end, length_m=irregularity.fade_m)[:, None]
        if measured.replaces_spectrum:
            drawn *= 1.0 - here
        drawn += here * _less_cant(measured, design, s)
    return drawn


def _less_cant(measured: MeasuredRails, design: TrackDesign, s: FloatArray) -> FloatArray:
    """Measured rails at places s (n,), less the cant of the design where their cross-level has it; (n, 4)."""
    values = measured.at(s)
    if measured.has_cant:
        values[:, IRREGULARITY.index("cross_level_m")] -= design.rail_base_m * np.sin(
            design.frame_extended(s).roll_rad
        )
    return values


def _rails(drawn: FloatArray) -> FloatArray:
    """Rail deviations from alignment, vertical profile, cross-level and gauge, (n, 4) each."""
    alignment, vertical, level, gauge = drawn.T
    return np.stack(
        [alignment + 0.5 * gauge, vertical + 0.5 * level, alignment - 0.5 * gauge, vertical - 0.5 * level],
        axis=-1,
    )


def _design_splines(design: TrackDesign, s: FloatArray) -> FloatArray:
    frame = design.frame_extended(s)
    values = np.column_stack([frame.position, frame.yaw_rad, frame.pitch_rad, frame.roll_rad])
    # Exact slopes at both ends: the ends then are as good as the middle.
    ends = [0, -1]
    slope = np.column_stack(
        [
            np.cos(frame.yaw_rad[ends]),
            np.sin(frame.yaw_rad[ends]),
            -np.tan(frame.pitch_rad[ends]),
            frame.rates[ends][:, ::-1],
        ]
    )
    return _coefficients(CubicSpline(s, values, bc_type=((1, slope[0]), (1, slope[1]))))


def _coefficients(spline: CubicSpline) -> FloatArray:
    """Coefficients (intervals, channels, 4) of a spline, highest power first."""
    return np.asarray(spline.c.transpose(1, 2, 0))
