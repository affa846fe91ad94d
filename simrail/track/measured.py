"""Measured rails: alignment, vertical profile, cross-level and gauge over distance, to lay a track from.

`measured_rails` places samples on a track and refuses what cannot be rails: places that do not rise, holes,
gaps, and amplitudes that only a wrong unit explains. Between the samples lies the cubic spline through them;
nothing is filtered, so a file that holds certain wavelengths only lays rails of those. Samples closer than
`FINEST_STEP_M` are averaged over that length.

Signs are those of `simrail.core.columns.IRREGULARITY`: up and to the left positive, cross-level the left rail
above the right one, gauge wider. Reading a file is the matter of `simrail.scenario.measured_file`.
"""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline

from simrail.core.columns import IRREGULARITY
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

FINEST_STEP_M = 1.0 / 64.0
"""Distance of the finest knots that rails are laid with for a file."""

CLOSEST_M = 1e-3
"""Samples closer than this are taken for another unit."""

GAP = 1.5
"""Distance of two samples, over the usual one, from which on there is a gap between them."""

SAMPLES_PER_WAVE = 4.0
"""Samples that the shortest wanted wave needs in a file."""

CHORD_M = 18.8976
"""62 ft: the chord over which the U.S. law measures alignment and profile."""

LARGEST_M = {
    "alignment_m": 2.0 * 5.0 * 0.0254,
    "vertical_profile_m": 2.0 * 3.0 * 0.0254,
    "cross_level_m": 2.0 * 3.0 * 0.0254,
    "gauge_m": 2.0 * 1.5 * 0.0254,
}
"""Largest amplitudes that are taken for rails: twice what class 1, 10 mph for freight, is allowed at most.

Of alignment and vertical profile the offset from the middle of a chord of 62 ft, 5 in and 3 in (49 CFR 213.55
and 213.63); of cross-level its value on straight track, 3 in (213.63); of gauge its deviation, 1 1/2 in wide
(213.53). Rails beyond are another unit, or no rails.
"""

LARGEST_CANT_M = 0.2
"""What a cross-level may be larger if it has the cant of the design in it, before that is taken off."""

SMALLEST_M = 5e-5
"""A whole file whose values stay within this of their mean is taken for another unit.

No standard's: a track that rides well has deviations of some millimetres, one at the scale 1:10 of some
tenths; a thousandth of the former is below it.
"""


@dataclass(frozen=True)
class MeasuredRails:
    """Measured rails, placed on a track.

    Attributes
    ----------
    name : str
        What to call them: the file.
    digest : str
        SHA-256 of places and values: equal rails have equal ones, whatever their file is called.
    step_m : float
        Usual distance of two samples.
    replaces_spectrum : bool
        Whether what the spectrum gives is left out where these lie.
    partial : bool
        Whether they may cover less than a ride.
    has_cant : bool
        Whether the cross-level is that of the rails as they lie, the cant of the design included.
    position_m : ndarray (n,)
        Places on the track, rising.
    values_m : ndarray (n, 4)
        In the order of `simrail.core.columns.IRREGULARITY`.
    notes : tuple of str
        What was taken for what, and what they do not hold.
    """

    name: str = field(compare=False)
    digest: str
    step_m: float
    replaces_spectrum: bool
    partial: bool
    has_cant: bool
    position_m: FloatArray = field(compare=False, repr=False)
    values_m: FloatArray = field(compare=False, repr=False)
    notes: tuple[str, ...] = field(default=(), compare=False, repr=False)

    @property
    def start_m(self) -> float:
        """Where they begin, s along the track."""
        return float(self.position_m[0])

    @property
    def end_m(self) -> float:
        """Where they end."""
        return float(self.position_m[-1])

    def at(self, s: FloatArray) -> FloatArray:
        """Values at places s (n,), m; (n, 4). Beyond the ends those at the ends."""
        spline = CubicSpline(self.position_m, self.values_m)
        return np.asarray(spline(np.clip(s, self.start_m, self.end_m)))

    def check_carries(self, wavelength_m: float) -> None:
        """Refuse samples too far apart for a wave.

        Raises
        ------
        InputError
            Naming the distance of the samples and its limit.
        """
        if self.step_m * SAMPLES_PER_WAVE > wavelength_m * (1.0 + 1e-9):
            raise InputError(
                "the samples are too far apart for the shortest wanted wave",
                field="wavelengths_m",
                value=f"{wavelength_m:g} m, with {self.name} every {self.step_m:.6g} m",
                limit=f"samples every {wavelength_m / SAMPLES_PER_WAVE:g} m, a quarter of the wave",
                remedy=f"take a finer file, or wavelengths_m = [{SAMPLES_PER_WAVE * self.step_m:.6g}, ...]",
            )

    def check_covers(self, low_m: float, high_m: float) -> None:
        """Refuse a ride whose wheels run from ``low_m`` to ``high_m``, unless part of it is enough.

        Raises
        ------
        InputError
            Naming both stretches.
        """
        if not self.partial and not (self.start_m <= low_m and high_m <= self.end_m):
            raise InputError(
                "the measured rails are too short for the ride",
                field="measured.start_m",
                value=f"{self.name} lies from {self.start_m:g} to {self.end_m:g} m",
                limit=f"the ride's wheels run from {low_m:g} to {high_m:g} m",
                remedy="shorten the ride, move start_m, or set partial = true: beyond the file then lies "
                "what else is laid",
            )


def measured_rails(
    name: str,
    position_m: FloatArray,
    columns: Mapping[str, FloatArray],
    *,
    start_m: float | None = None,
    scale: float = 1.0,
    bridge_gaps_m: float = 0.0,
    replaces_spectrum: bool = False,
    partial: bool = False,
    has_cant: bool = False,
    where: Callable[[int], str] = "sample {}".format,
) -> MeasuredRails:
    """Place measured rails on a track.

    Parameters
    ----------
    name : str
        What to call them.
    position_m : ndarray (n,)
        Where each sample was taken.
    columns : mapping of str to ndarray (n,)
        Some of `simrail.core.columns.IRREGULARITY`, m; those that are left out are zero.
    start_m : float, optional
        Where the first sample lies, s along the track; positions are places on the track if not given.
    scale : float
        Factor on the values, after they were judged.
    bridge_gaps_m : float
        Up to this length gaps, and samples that are NaN, are bridged by a smooth step from the value before
        to that behind; longer ones are refused.
    replaces_spectrum, partial, has_cant : bool
        As in `MeasuredRails`.
    where : callable, optional
        Words for a sample's place, in messages.

    Raises
    ------
    InputError
        Naming the sample, or the quantity, and the limit.
    """
    names = [column for column in IRREGULARITY if column in columns]
    values = np.zeros((len(position_m), len(IRREGULARITY)))
    for column in names:
        values[:, IRREGULARITY.index(column)] = columns[column]
    _refuse_disorder(position_m, where)
    known = np.isfinite(values).all(axis=1)
    if bridge_gaps_m == 0.0 and not known.all():
        _refuse_hole(values, int(np.argmin(known)), where)
    if np.count_nonzero(known) < 2:
        raise InputError("has less than two samples", value=int(np.count_nonzero(known)), limit=">= 2")
    samples = np.flatnonzero(known)
    step = float(np.median(np.diff(position_m)))
    if step < CLOSEST_M:
        raise InputError(
            "has samples closer than any that are taken along a track",
            field="position",
            value=f"{step:.3g} m apart",
            limit=f">= {CLOSEST_M:g} m",
            remedy="mend its unit (kilometres?)",
        )
    _refuse_gap(position_m[samples], step, bridge_gaps_m, lambda i: where(int(samples[i])))
    for column in names:
        larger = LARGEST_CANT_M if has_cant and column == "cross_level_m" else 0.0
        refuse_amplitude(
            column, position_m[samples], values[samples, IRREGULARITY.index(column)], larger_m=larger
        )
    places, values = _bridged(position_m[samples], scale * values[samples], step)
    places, values = _thinned(places, values)
    if start_m is not None:
        places = places - places[0] + start_m
    places, values = np.ascontiguousarray(places), np.ascontiguousarray(values)
    for array in (places, values):
        array.flags.writeable = False
    digest = hashlib.sha256(places.tobytes() + values.tobytes()).hexdigest()
    return MeasuredRails(name, digest, step, replaces_spectrum, partial, has_cant, places, values)


def _refuse_disorder(position_m: FloatArray, where: Callable[[int], str]) -> None:
    """Refuse places that are no numbers, or do not rise from sample to sample."""
    bad = np.flatnonzero(~np.isfinite(position_m))
    if len(bad):
        raise InputError(
            "holds no number",
            field="position",
            value=f"nan in {where(int(bad[0]))}",
            limit="a place for every sample",
            remedy="drop that line, or mend it",
        )
    fallen = np.flatnonzero(np.diff(position_m) <= 0.0)
    if len(fallen):
        before, i = position_m[fallen[0]], int(fallen[0]) + 1
        raise InputError(
            "is not sorted: the places do not rise",
            field="position",
            value=f"{position_m[i]:.12g} m after {before:.12g} m, {where(i)}",
            limit=f"> {before:.12g} m",
            remedy="sort the file by place, and keep one line of each",
        )


def _refuse_hole(values: FloatArray, i: int, where: Callable[[int], str]) -> None:
    column = IRREGULARITY[int(np.argmin(np.isfinite(values[i])))]
    raise InputError(
        "holds no number",
        field=column.removesuffix("_m"),
        value=f"nan in {where(i)}",
        limit="finite numbers",
        remedy="mend that line, or set bridge_gaps_m to the length of the gaps that are to be bridged",
    )


def _refuse_gap(
    position_m: FloatArray, step_m: float, bridge_gaps_m: float, where: Callable[[int], str]
) -> None:
    steps = np.diff(position_m)
    i = int(np.argmax(steps))
    if steps[i] > GAP * step_m and steps[i] > bridge_gaps_m:
        raise InputError(
            "has a gap",
            field="position",
            value=f"{steps[i]:.6g} m after {where(i)}",
            limit=f"{max(GAP * step_m, bridge_gaps_m):.6g} m, where samples are {step_m:.6g} m apart",
            remedy=f"fill it, or set bridge_gaps_m = {np.ceil(10.0 * steps[i]) / 10.0:g}",
        )


def refuse_amplitude(
    column: str, position_m: FloatArray, values: FloatArray, *, larger_m: float = 0.0
) -> None:
    """Refuse amplitudes that only a wrong unit explains (`LARGEST_M` and ``larger_m``, `SMALLEST_M`)."""
    quantity, limit = column.removesuffix("_m"), LARGEST_M[column] + larger_m
    if column == "gauge_m" and np.abs(np.median(values)) > 0.5:
        raise InputError(
            "is the gauge itself, not its deviation",
            field=quantity,
            value=f"{np.median(values):.6g} m in the median",
            limit="a deviation from the nominal gauge",
            remedy="set nominal_gauge_mm = 1435.0, or what is nominal there",
        )
    chord = column in ("alignment_m", "vertical_profile_m")
    sizes = chord_offset(position_m, values) if chord else values
    largest = float(np.abs(sizes).max())
    if largest > limit:
        raise InputError(
            "is larger than on any track that trains run on" + (", over a chord of 18.9 m" if chord else ""),
            field=quantity,
            value=f"{largest:.6g} m",
            limit=f"{limit:.3g} m, twice what 49 CFR 213 allows class 1",
            remedy="mend its unit"
            + (" (millimetres?)" if largest > 100.0 * limit else "")
            + "; if the file's cross-level has the cant in it, cross_level_has_cant = true"
            * (column == "cross_level_m"),
        )
    spread = float(np.abs(values - values.mean()).max())
    if 0.0 < spread < SMALLEST_M:
        raise InputError(
            "is smaller than on any track",
            field=quantity,
            value=f"{spread:.3g} m at most from its mean",
            limit=f">= {SMALLEST_M:g} m",
            remedy="mend its unit (metres?), or leave the column out",
        )


def chord_offset(position_m: FloatArray, values: FloatArray, *, chord_m: float = CHORD_M) -> FloatArray:
    """Offset of a line from the middle of a chord that runs along it, m.

    Of a line shorter than the chord the chord is the line.
    """
    length = float(position_m[-1] - position_m[0])
    half = 0.5 * min(chord_m, length)
    middle = np.linspace(position_m[0] + half, position_m[-1] - half, max(2, 4 * len(position_m)))
    ahead, here, behind = (np.interp(middle + shift, position_m, values) for shift in (half, 0.0, -half))
    return np.asarray(here - 0.5 * (ahead + behind))


def _bridged(position_m: FloatArray, values: FloatArray, step_m: float) -> tuple[FloatArray, FloatArray]:
    """Samples with those of smooth steps in the gaps, the usual distance apart."""
    places, lines = [position_m[:1]], [values[:1]]
    for i in np.flatnonzero(np.diff(position_m) > GAP * step_m):
        u = np.linspace(0.0, 1.0, round((position_m[i + 1] - position_m[i]) / step_m) + 1)[1:-1, None]
        places.append(position_m[i] + (position_m[i + 1] - position_m[i]) * u[:, 0])
        lines.append(values[i] + (values[i + 1] - values[i]) * u**3 * (10.0 - 15.0 * u + 6.0 * u**2))
    all_places, all_lines = np.concatenate([*places, position_m[1:]]), np.concatenate([*lines, values[1:]])
    order = np.argsort(all_places, kind="stable")
    return all_places[order], all_lines[order]


def _thinned(position_m: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means over `FINEST_STEP_M` where samples are closer than that."""
    if float(np.median(np.diff(position_m))) >= FINEST_STEP_M:
        return position_m, values
    _, cell, count = np.unique(
        np.floor((position_m - position_m[0]) / FINEST_STEP_M), return_inverse=True, return_counts=True
    )
    means = [np.bincount(cell, weights=line) / count for line in (position_m, *values.T)]
    return means[0], np.stack(means[1:], axis=-1)
