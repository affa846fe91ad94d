"""Rails from several rides over the same line: aligned along the track, fused, and how sure that is.

A *pass* is one ride over rails that have not changed, and the estimate of them that it gave. Passes differ in
speed, direction, IMU and the noise of each; they may share the map, the kind of vehicle and the place of the
IMU on it.

Along the track they are moved onto each other by their own waves of 3 to 25 m
(`simrail.estimators.rails.along_track`). Then, octave by octave of the wavelength, each counts by the inverse
variance of its own error there, which is measured: it is what the pass and the mean of the others differ by,
less the others' share. The weights add up to 1, so that the rails themselves pass unchanged.

What passes differ by averages out, and is known from them. What is wrong in all of them alike (the map's, the
suspension's between IMU and rails, what a smoother's prior takes off short waves) shows in no difference and
does not average. It is taken to be what a pass says that it does not know, less what passes differ by: of the
variance u that they state and the scatter v that they show, n passes leave

    max(u - v, r v) + v / n,

so that an interval that holds for one pass holds for n. Rides over the same rails always have something in
common, also where they state no more than they scatter: it is taken for r v at least (`COMMON`).
The same goes for where the rails are along the track.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from simrail.estimators.rails.along_track import UNKNOWN_SD_M, Shifts, alike_of, shifts_of
from simrail.estimators.rails.octaves import Octaves, octaves_of
from simrail.estimators.rails.weighing import TINY_M2, fit, weigh
from simrail.estimators.trajectory.track_geometry import displaced

from simrail.core.columns import IRREGULARITY, IRREGULARITY_SD, require
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.core.shown import Facts, Shown, names
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording

WAVES_M = (3.0, 25.0)
"""Waves by which passes are moved onto each other."""

SHORTEST_M = 100.0
"""A stretch shared by all passes that can be fused."""

COMMON = {"alignment_m": 4.0, "vertical_profile_m": 1.0, "cross_level_m": 1.0, "gauge_m": 1.0}
"""Variance of the error that all passes have alike, at least, over that of what they differ by."""

COMMON_PLACE = 0.5
"""Of the variance that passes state for their position, what they have in common at least: the map's."""

LEAST_ALIKE, MOST_SDS, MOST_ERROR, MOST_UNFIT = 0.5, 4.0, 3.0, 0.25
"""Beyond these a pass is told of: correlation of its waves with the mean of the others; shift over the sd of
the position; own error over that of the others; share of the line where it does not fit."""

LEAST_SD_M = 1e-3
"""Of a position: no pass knows it better than to a millimetre."""

DRAWS = 20
"""Of the fused rails' error."""

ROOT = 0
"""Of the streams: an estimator has no seed of its own, and the same passes give the same draws."""


@dataclass(frozen=True, repr=False)
class Fused(Shown):
    """Rails from n passes.

    Attributes
    ----------
    geometry : pandas.DataFrame
        Over the places that all passes share, uniform ``position_m``: `simrail.core.columns.IRREGULARITY` and
        `IRREGULARITY_SD`. One that no pass observes is NaN throughout.
    geometry_draws : ndarray (draws, places, 4), optional
        Draws of true minus fused irregularities; those of the pass itself where there is one only.
    shifts : pandas.DataFrame
        Over the same places a column for each pass, ``0``, ``1``, ...: the rails of s are at s + shift in it.
    passes : pandas.DataFrame
        One row for each pass: ``shift_m`` (mean), ``shift_rms_m``, ``shift_sd_m``; for each irregularity its
        mean weight (``alignment_weight``, ...) and its own error (``alignment_error_m``, ...) in waves of 3 m
        to 25 m; ``told``, what is wrong with it, empty if nothing is.
    mount : str
        Where the IMUs sat; ``"several"`` if not all alike.
    """

    geometry: pd.DataFrame
    geometry_draws: FloatArray | None
    shifts: pd.DataFrame
    passes: pd.DataFrame
    mount: str

    def _facts(self) -> Facts:
        places, told = self.geometry.index, int((self.passes["told"] != "").sum())
        drawn = 0 if self.geometry_draws is None else len(self.geometry_draws)
        facts = {
            "passes": f"{len(self.passes)}, something is wrong with {told or 'none'}",
            "rails": f"s = {places[0]:g} to {places[-1]:g} m, {len(places):,} places"
            if len(places)
            else "none",
            "shifts": names(f"{shift:+.2f} m" for shift in self.passes["shift_m"]),
            "draws": str(drawn),
        }
        return f"of IMU {self.mount}", facts

    @property
    def estimate(self) -> Estimate:
        """The rails as an estimate that has no states."""
        return Estimate(
            states=pd.DataFrame(index=pd.Index([], name="time_s", dtype=np.float64)),
            mount=self.mount,
            geometry=self.geometry,
            geometry_draws=self.geometry_draws,
        )


def fuse(estimates: Sequence[Estimate], *, common: Mapping[str, float] = COMMON) -> Fused:
    """Fuse the rails of several passes; see the module.

    Parameters
    ----------
    estimates : sequence of Estimate
        Each with its `geometry`, all of the same step. Where its states hold ``position_m`` and
        ``position_sd_m``, they say how well it knows where it is; else an sd of a metre is taken. Where all
        have `geometry_draws`, these say in which waves they are unsure; else in those where they differ.
    common : mapping of str to float
        For each of `simrail.core.columns.IRREGULARITY`, the variance that all passes have in common at least,
        over that of what they differ by; 0 for one that it lacks.

    Raises
    ------
    InputError
        If there is none, or one says nothing of the rails, or steps differ, or they share less than 100 m.
    """
    passes = _Passes.of(estimates)
    if passes.n == 1:
        return _alone(estimates[0], passes)
    return _together(passes, common)


def rails_and_place_of(estimate: Estimate, recording: Recording) -> Estimate:
    """What fusing asks of an estimate: its rails, and where it was; by the odometry if it does not say."""
    states, place = estimate.states, ["position_m", "position_sd_m"]
    if not set(place) <= set(states.columns) and recording.odometry is not None:
        states = recording.odometry
    states = states[[name for name in place if name in states.columns]]
    return replace(estimate, states=states, innovations=None, covariance=None, covariance_of=())


@dataclass(frozen=True)
class _Passes:
    """What n passes say over the places that they share.

    Attributes
    ----------
    place_m : ndarray (places,)
    lines : ndarray (n, 4, places)
        Irregularities; NaN where one is not observed.
    variance : ndarray (n, 4, places)
        As stated; NaN where nothing is.
    draws : list of ndarray (draws, 4, places), or None
    position_sd_m : ndarray (n, places)
    mount : str
    """

    place_m: FloatArray
    lines: FloatArray
    variance: FloatArray
    draws: list[FloatArray] | None
    position_sd_m: FloatArray
    mount: str

    @property
    def n(self) -> int:
        """Number of passes."""
        return len(self.lines)

    @property
    def step_m(self) -> float:
        """Distance of the places."""
        return float((self.place_m[-1] - self.place_m[0]) / (len(self.place_m) - 1))

    @classmethod
    def of(cls, estimates: Sequence[Estimate]) -> "_Passes":
        """Bring estimates to the places that all of them have; refuse what has none."""
        if not estimates:
            raise InputError("there is no pass to be fused", field="estimates", value=0, limit="1 or more")
        frames = [_geometry_of(estimate, i) for i, estimate in enumerate(estimates)]
        step = float(np.diff(frames[0].index[:2])[0])
        numbers = [_numbers(frame, step, i) for i, frame in enumerate(frames)]
        first, last = max(own[0] for own in numbers), min(own[-1] for own in numbers)
        if (last - first) * step < SHORTEST_M:
            raise InputError(
                "share too little of the line",
                field="estimates",
                value=f"{max(0.0, (last - first) * step):g} m",
                limit=f"{SHORTEST_M:g} m or more",
                remedy="fuse rides over the same stretch of the same line",
            )
        cuts = [slice(int(first - own[0]), int(last - own[0]) + 1) for own in numbers]
        place = step * np.arange(first, last + 1)
        lines, variance = (
            np.stack([_columns(frame, names)[:, cut] for frame, cut in zip(frames, cuts, strict=True)])
            for names in (IRREGULARITY, IRREGULARITY_SD)
        )
        drawn = [estimate.geometry_draws for estimate in estimates]
        draws = [
            np.swapaxes(own[:, cut], 1, 2) for own, cut in zip(drawn, cuts, strict=True) if own is not None
        ]
        mounts = {estimate.mount for estimate in estimates}
        return cls(
            place_m=place,
            lines=lines,
            variance=np.square(variance),
            draws=draws if len(draws) == len(estimates) else None,
            position_sd_m=np.stack([_position_sd(estimate, place) for estimate in estimates]),
            mount=mounts.pop() if len(mounts) == 1 else "several",
        )


def _geometry_of(estimate: Estimate, number: int) -> pd.DataFrame:
    """The rails of a pass, or a fault that says which one has none."""
    field = f"estimates[{number}].geometry"
    if estimate.geometry is None or len(estimate.geometry) < 2:
        raise InputError(
            "says nothing of the rails",
            field=field,
            limit="rails over two places or more",
            remedy="choose an estimator of the rails, with a geometry_step_m > 0",
        )
    require(estimate.geometry, IRREGULARITY, what=field)
    return estimate.geometry


def _numbers(frame: pd.DataFrame, step_m: float, number: int) -> np.ndarray:
    """Places as whole multiples of the step."""
    place = frame.index.to_numpy(dtype=np.float64)
    numbers = np.rint(place / step_m).astype(np.int64)
    if not (np.array_equal(np.diff(numbers), np.ones(len(place) - 1)) and step_m > 0.0):
        raise InputError(
            "is not over the same step as the first pass",
            field=f"estimates[{number}].geometry",
            value=f"{np.diff(place[:2])[0]:g} m",
            limit=f"{step_m:g} m, uniform",
            remedy="estimate all passes with one geometry_step_m",
        )
    return numbers


def _columns(frame: pd.DataFrame, names: Sequence[str]) -> FloatArray:
    """Columns of a frame as lines (4, places), NaN for one that it lacks."""
    missing = np.full(len(frame), np.nan)
    return np.stack([frame[name].to_numpy(dtype=np.float64) if name in frame else missing for name in names])


def _position_sd(estimate: Estimate, place_m: FloatArray) -> FloatArray:
    """Sd of a pass's position, over the places."""
    if not {"position_m", "position_sd_m"} <= set(estimate.states.columns) or not len(estimate.states):
        return np.full(len(place_m), UNKNOWN_SD_M)
    known = estimate.states[["position_m", "position_sd_m"]].to_numpy(dtype=np.float64)
    known = known[np.argsort(known[:, 0], kind="stable")]
    return np.asarray(np.maximum(np.interp(place_m, known[:, 0], known[:, 1]), LEAST_SD_M))


def _alone(estimate: Estimate, passes: _Passes) -> Fused:
    """One pass, as it is."""
    assert estimate.geometry is not None
    names = [name for name in (*IRREGULARITY, *IRREGULARITY_SD) if name in estimate.geometry]
    nowhere = pd.DataFrame({"0": np.zeros(len(passes.place_m))}, index=_index(passes.place_m))
    row = {"shift_m": 0.0, "shift_rms_m": 0.0, "shift_sd_m": 0.0, "told": ""}
    table = pd.DataFrame([row], index=pd.Index([0], name="pass"))
    return Fused(estimate.geometry[names], estimate.geometry_draws, nowhere, table, passes.mount)


def _index(place_m: FloatArray) -> pd.Index:
    return pd.Index(place_m, name="position_m")


def _together(passes: _Passes, common: Mapping[str, float]) -> Fused:
    """Two passes or more."""
    place = passes.place_m
    bank = octaves_of(len(place), passes.step_m)
    used = [int(at) for at in np.flatnonzero(np.isfinite(passes.lines).all(axis=(0, 2)))]
    waves = bank.passed(passes.lines[:, used], bank.between(WAVES_M))
    claimed = np.sqrt(np.square(passes.position_sd_m).mean(axis=1))
    shifts = shifts_of(waves, claimed, passes.step_m)
    position_sd = _position_sd_of(passes, shifts.shift_m)
    lines = {
        IRREGULARITY[at]: _line_of(passes, at, shifts.shift_m, bank, common.get(IRREGULARITY[at], 0.0))
        for at in used
    }
    frame = {name: np.full(len(place), np.nan) for name in (*IRREGULARITY, *IRREGULARITY_SD)}
    draws = np.full((DRAWS, len(place), len(IRREGULARITY)), np.nan)
    for name, line in lines.items():
        at = IRREGULARITY.index(name)
        frame[name] = line.values
        moved = displaced(place, line.values[:, None], position_sd)[:, 0]
        frame[IRREGULARITY_SD[at]] = np.sqrt(bank.sum_of(line.density) * line.profile + moved)
        draws[:, :, at] = _draws_of(line, (name, passes.mount, passes.n), position_sd, place, bank)
    # Passes that neither differ nor state an sd, such as a baseline that answers 0, have no interval.
    unsure = any((frame[IRREGULARITY_SD[at]] > 0.0).all() for at in used)
    columns = [*IRREGULARITY, *(IRREGULARITY_SD if unsure else ())]
    return Fused(
        geometry=pd.DataFrame(frame, index=_index(place))[columns],
        geometry_draws=draws if unsure else None,
        shifts=pd.DataFrame(shifts.shift_m.T, _index(place), [str(i) for i in range(passes.n)]),
        passes=_table(passes, waves, shifts, lines),
        mount=passes.mount,
    )


def _table(passes: _Passes, waves: FloatArray, shifts: Shifts, lines: Mapping[str, "_Line"]) -> pd.DataFrame:
    """What is found of each pass."""
    table: dict[str, object] = {
        "shift_m": shifts.shift_m.mean(axis=1),
        "shift_rms_m": np.sqrt(np.square(shifts.shift_m).mean(axis=1)),
        "shift_sd_m": np.sqrt(np.square(shifts.sd_m).mean(axis=1)),
    }
    for name, line in lines.items():
        what = name.removesuffix("_m")
        table |= {f"{what}_weight": line.weight, f"{what}_error_m": line.error}
    table["told"] = _told(passes, waves, shifts, lines)
    return pd.DataFrame(table, index=pd.RangeIndex(passes.n, name="pass"))


def _position_sd_of(passes: _Passes, shift_m: FloatArray) -> FloatArray:
    """Sd of the places of the fused rails, over them."""
    stated = np.square(passes.position_sd_m)
    weight = 1.0 / stated.mean(axis=1)
    weight /= weight.sum()
    scatter = np.square(shift_m).mean() * passes.n / (passes.n - 1.0)
    mean = weight @ stated
    common = max(mean.mean() - scatter, COMMON_PLACE * mean.mean())
    left = common + np.square(weight).sum() * scatter
    return np.asarray(np.sqrt(left * mean / mean.mean()))


class _Line(NamedTuple):
    """One fused irregularity.

    Attributes
    ----------
    values : ndarray (places,)
    density : ndarray (frequencies,)
        Spectral density of its error, m2/(1/m), but for what a wrong place makes.
    profile : ndarray (places,)
        How that is spread over the places; its mean is 1.
    weight, error : ndarray (n,)
        Mean weight of each pass, and its own error (root mean square), over the octaves of `WAVES_M`.
    unfit : ndarray (n,)
        Share of the places where a pass does not fit the others.
    """

    values: FloatArray
    density: FloatArray
    profile: FloatArray
    weight: FloatArray
    error: FloatArray
    unfit: FloatArray


def _line_of(passes: _Passes, at: int, shift_m: FloatArray, bank: Octaves, common: float) -> _Line:
    """Fuse one irregularity."""
    place = passes.place_m
    moved = _each_moved(place, passes.lines[:, at], shift_m)
    parts = bank.cut(moved)
    claims, profile = _claims_of(passes, at, moved)
    weighed = weigh(parts, bank, np.ones(passes.n) if claims is None else claims)
    # Octaves overlap, and their sum is not all: by the lines themselves it is.
    scatter = np.square(moved - moved.mean(axis=0)).sum(axis=0).mean() / (passes.n - 1.0)
    scale = float(scatter / max(bank.total(weighed.own.mean(axis=1)), TINY_M2))
    stated = np.zeros_like(weighed.own)
    if passes.draws is not None:
        stated = np.stack([_in_octaves(passes, i, at, bank) for i in range(passes.n)], axis=1)
    elif claims is not None:
        stated = weighed.own * claims / [max(scale * bank.total(own), TINY_M2) for own in weighed.own.T]
    alike = np.maximum((weighed.weight * stated).sum(axis=1) - weighed.scatter, common * weighed.scatter)
    fits = fit(bank.passed(moved, bank.between(WAVES_M)), passes.step_m)
    weight = weighed.weight[:, :, None] * fits
    weight /= weight.sum(axis=1, keepdims=True)
    inside = (bank.wavelengths_m >= WAVES_M[0]) & (bank.wavelengths_m <= WAVES_M[1])
    return _Line(
        values=np.einsum("knp,knp->p", weight, parts),
        density=scale * bank.density(alike + weighed.of_mean),
        profile=profile,
        weight=weight[inside].mean(axis=(0, 2)),
        error=np.sqrt(scale * weighed.own[inside].sum(axis=0)),
        unfit=(fits < 1.0).mean(axis=1),
    )


def _claims_of(passes: _Passes, at: int, moved: FloatArray) -> tuple[FloatArray | None, FloatArray]:
    """Variance (n,) that each pass states but for what a wrong place makes, and how it is spread, mean 1."""
    place, sds = passes.place_m, passes.position_sd_m
    by_place = [displaced(place, line[:, None], sd)[:, 0] for line, sd in zip(moved, sds, strict=True)]
    stated = passes.variance[:, at] - np.stack(by_place)
    if not np.isfinite(stated).all():
        return None, np.ones(len(place))
    claims = np.maximum(stated.mean(axis=1), TINY_M2)
    # A tenth of the mean everywhere: no place is sure because others are unsure.
    profile = np.maximum(stated, 0.0).mean(axis=0) + 0.1 * claims.mean()
    return claims, profile / profile.mean()


def _told(passes: _Passes, waves: FloatArray, shifts: Shifts, lines: Mapping[str, _Line]) -> list[str]:
    """What is wrong with each pass, in words; empty if nothing is."""
    told: list[list[str]] = [[] for _ in range(passes.n)]
    alike = alike_of(_each_moved(passes.place_m, waves, shifts.shift_m))
    for i, words in enumerate(told):
        moved, sd = float(shifts.shift_m[i].mean()), float(passes.position_sd_m[i].mean())
        if alike[i] < LEAST_ALIKE:
            words.append(f"shows other rails than the others (correlation {alike[i]:.2f})")
        if abs(moved) > MOST_SDS * sd:
            words.append(
                f"lies {moved:+.2f} m along the track from the others, and states an sd of {sd:.2f} m"
            )
        for name, line in lines.items():
            what = name.removesuffix("_m").replace("_", " ")
            typical = float(np.median(np.delete(line.error, i)))
            if passes.n > 2 and line.error[i] > MOST_ERROR * typical:
                words.append(f"{what} errs {line.error[i] / typical:.1f} times as much as that of the others")
            elif line.unfit[i] > MOST_UNFIT:
                words.append(f"{what} does not fit the others over {line.unfit[i]:.0%} of the line")
    return ["; ".join(words) for words in told]


def _moved(place: FloatArray, line: FloatArray, shift: FloatArray) -> FloatArray:
    """A line (..., places) as it is a shift further on; beyond its ends as there."""
    return np.asarray(CubicSpline(place, line, axis=-1)(np.clip(place + shift, place[0], place[-1])))


def _each_moved(place: FloatArray, lines: FloatArray, shifts: FloatArray) -> FloatArray:
    """Lines (n, ..., places) of passes, each by its own shift."""
    return np.stack([_moved(place, line, shift) for line, shift in zip(lines, shifts, strict=True)])


def _in_octaves(passes: _Passes, i: int, at: int, bank: Octaves) -> FloatArray:
    """Variance (k,) that the draws of a pass state in each octave, but for what a wrong place makes."""
    assert passes.draws is not None
    drawn = np.square(bank.cut(passes.draws[i][:, at])).mean(axis=(1, 2))
    place, line, sd = passes.place_m, passes.lines[i, at], passes.position_sd_m[i]
    roots, weights = np.polynomial.hermite_e.hermegauss(5)
    wrong = np.stack([_moved(place, line, root * sd) - line for root in roots])
    by_place = np.einsum("d,kdp->k", weights / weights.sum(), np.square(bank.cut(wrong))) / len(place)
    return np.asarray(np.maximum(drawn - by_place, 0.0))


def _draws_of(
    line: _Line, name: tuple[str | int, ...], position_sd: FloatArray, place: FloatArray, bank: Octaves
) -> FloatArray:
    """Draws (draws, places) of the error of a fused line."""
    step = float(place[1] - place[0])
    gain = np.sqrt(line.density / (2.0 * step))  # white noise has twice the step
    drawn = np.empty((DRAWS, len(place)))
    for draw in range(DRAWS):
        rng = stream(ROOT, "fused rails", draw, *name)
        noise = bank.passed(rng.standard_normal(len(place)), gain) * np.sqrt(line.profile)
        along = stream(ROOT, "fused rails", draw, *name[1:], "position").standard_normal()
        drawn[draw] = noise + _moved(place, line.values, along * position_sd) - line.values
    return drawn
