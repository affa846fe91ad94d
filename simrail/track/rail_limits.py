"""Rails as an estimate has them against limits: by bands, by sections, and where they are exceeded.

How sure an exceedance is follows from the estimate's own standard deviation at that place: with an estimate
x, a limit L and a standard deviation s of a normal error, what lies there is beyond the limit with the
chance Phi((|x| - L)/s) + Phi((-|x| - L)/s). Of a band of wavelengths the standard deviation is known by
draws of the estimate's error alone; without them no chance is told.

Functions of values over a uniform grid of places: nothing here knows an estimator or the truth.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from scipy.special import ndtr

from simrail.core.columns import IRREGULARITY
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.track.bands import BANDS, TWIST_BASE_M, Band, band_pass, sd_of_draws, twist, why_not
from simrail.track.quality import SECTION_M, Limits, section_rows

UNFILTERED = "full"
"""The band of what no filter has cut."""

TWIST = "twist"
OPEN_CHANCE = 0.05
"""A place whose chance of lying beyond its limit is larger is not ruled out."""

QUANTITIES = (*(name.removesuffix("_m") for name in IRREGULARITY), TWIST)

EXCEEDANCES = (
    "quantity",
    "band",
    "start_m",
    "end_m",
    "peak_m",
    "peak_position_m",
    "limit_m",
    "sd_m",
    "chance",
)
"""Columns of `exceedances`."""

SECTIONS = (
    "quantity",
    "band",
    "start_m",
    "end_m",
    "sd_m",
    "peak_m",
    "peak_position_m",
    "defects",
    "sd_exceeded",
    "error_sd_m",
)
"""Columns of `rail_sections`."""

SUMMARY = (
    "quantity",
    "band",
    "known_m",
    "sd_m",
    "worst_sd_m",
    "worst_start_m",
    "peak_m",
    "peak_position_m",
    "error_sd_m",
    "limit_m",
    "sd_limit_m",
    "exceedances",
    "sd_exceedances",
    "open_m",
)
"""Columns of `rail_summary`."""


@dataclass(frozen=True)
class RailLimits:
    """What rails are held against.

    Attributes
    ----------
    peaks, sds : mapping of (str, str) to float
        By quantity and band: greatest distance from zero, and standard deviation of a section, m.
    section_m : float
        Length of a section.
    twist_base_m : float
        Base of the twist.
    is_example : bool
        True if nobody has set them.
    """

    peaks: Mapping[tuple[str, str], float] = field(default_factory=dict)
    sds: Mapping[tuple[str, str], float] = field(default_factory=dict)
    section_m: float = SECTION_M
    twist_base_m: float = TWIST_BASE_M
    is_example: bool = False

    def of(self, quantity: str, band: str) -> Limits:
        """Both limits of a quantity in a band."""
        return Limits(self.sds.get((quantity, band)), self.peaks.get((quantity, band)))


EXAMPLE_LIMITS = RailLimits(
    peaks={
        ("vertical_profile", "D1"): 4e-3,
        ("vertical_profile", "D2"): 8e-3,
        ("alignment", "D1"): 4e-3,
        ("alignment", "D2"): 8e-3,
        ("cross_level", "D1"): 4e-3,
        (TWIST, UNFILTERED): 6e-3,
    },
    sds={("vertical_profile", "D1"): 1.5e-3, ("alignment", "D1"): 1.0e-3},
    is_example=True,
)
"""Examples, round figures of no standard: EN 13848-5 was not at hand, and its limits depend on the speed."""


@dataclass(frozen=True)
class RailLine:
    """One quantity of the rails in one band, over its places.

    Attributes
    ----------
    quantity, band : str
        ``"alignment"`` ... or ``"twist"``; ``"D1"`` ... or ``"full"``.
    place, value : ndarray (n,)
        m; a value is NaN where the band has none.
    sd : ndarray (n,), optional
        Standard deviation of its error, m.
    """

    quantity: str
    band: str
    place: FloatArray
    value: FloatArray
    sd: FloatArray | None = None

    @property
    def step_m(self) -> float:
        """Distance of the places."""
        return float(self.place[1] - self.place[0])


def rail_lines(
    geometry: pd.DataFrame,
    draws: FloatArray | None = None,
    *,
    bands: Iterable[Band] = tuple(BANDS.values()),
    twist_base_m: float = TWIST_BASE_M,
) -> list[RailLine]:
    """Every quantity that an estimate has, in every band that its rails are long and fine enough for.

    Parameters
    ----------
    geometry : pandas.DataFrame
        Over a uniform ``position_m``, columns `simrail.core.columns.IRREGULARITY`, and ``IRREGULARITY_SD``
        where they are known.
    draws : ndarray (m, n, 4), optional
        Draws of the error of `IRREGULARITY`.
    bands : iterable of Band
        Bands to cut out, beside what is unfiltered.
    twist_base_m : float
        Base of the twist, which is made of the unfiltered cross-level; left out if it is no multiple of the
        step.

    Returns
    -------
    list of RailLine
        By bands, the unfiltered ones and the twist last.
    """
    place = geometry.index.to_numpy(dtype=np.float64)
    if len(place) < 2:
        return []
    step = float(place[1] - place[0])
    known = {
        name.removesuffix("_m"): (
            geometry[name].to_numpy(dtype=np.float64),
            None if draws is None else draws[:, :, at],
        )
        for at, name in enumerate(IRREGULARITY)
        if name in geometry and np.isfinite(geometry[name].to_numpy(dtype=np.float64)).all()
    }
    lines = []
    for band in bands:
        for quantity, (value, errors) in known.items():
            edges = band.edges_m(quantity)
            if why_not(edges, count=len(place), step_m=step):
                continue
            sd = None if errors is None else sd_of_draws(band_pass(errors, edges, step_m=step))
            lines.append(RailLine(quantity, band.name, place, band_pass(value, edges, step_m=step), sd))
    for quantity, (value, errors) in known.items():
        own = f"{quantity}_sd_m"
        sd = geometry[own].to_numpy(dtype=np.float64) if own in geometry else None
        if sd is None and errors is not None:
            sd = sd_of_draws(errors)
        lines.append(RailLine(quantity, UNFILTERED, place, value, sd))
    if "cross_level" in known:
        value, errors = known["cross_level"]
        try:
            turned = twist(value, base_m=twist_base_m, step_m=step)
        except InputError:
            return lines
        sd = None if errors is None else sd_of_draws(twist(errors, base_m=twist_base_m, step_m=step))
        lines.append(RailLine(TWIST, UNFILTERED, place, turned, sd))
    return lines


def chance_beyond(value: FloatArray, sd: FloatArray, limit: float) -> FloatArray:
    """Chance that what is estimated as `value`, with a normal error of `sd`, lies beyond +-`limit`."""
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.abs(value)
        chance: FloatArray = ndtr((size - limit) / sd) + ndtr((-size - limit) / sd)
    return chance


def exceedances(lines: Iterable[RailLine], limits: RailLimits) -> pd.DataFrame:
    """Stretches on which an estimate lies beyond a limit.

    Parameters
    ----------
    lines : iterable of RailLine
        What was found, as `rail_lines` gives it.
    limits : RailLimits
        Its ``peaks``.

    Returns
    -------
    pandas.DataFrame
        Columns `EXCEEDANCES`, a row per stretch in the order of the lines and of the places: where it begins
        and ends, its largest value with its sign and place, the standard deviation there, and the chance that
        what lies there is beyond the limit; both NaN where no standard deviation is known.
    """
    rows: list[tuple[object, ...]] = []
    for line in lines:
        limit = limits.peaks.get((line.quantity, line.band))
        if limit is None:
            continue
        size = np.nan_to_num(np.abs(line.value))
        edges = np.flatnonzero(np.diff(np.concatenate([[False], size > limit, [False]])))
        for first, end in edges.reshape(-1, 2):
            at = first + int(np.argmax(size[first:end]))
            sd = np.nan if line.sd is None else float(line.sd[at])
            value = float(line.value[at])
            chance = float(chance_beyond(np.array(value), np.array(sd), limit))
            ends = float(line.place[first]), float(line.place[end - 1])
            rows.append((line.quantity, line.band, *ends, value, float(line.place[at]), limit, sd, chance))
    return pd.DataFrame(rows, columns=list(EXCEEDANCES))


def rail_sections(lines: Iterable[RailLine], limits: RailLimits) -> pd.DataFrame:
    """Indicators of each section of each line; see `simrail.track.quality.section_indicators`.

    Returns
    -------
    pandas.DataFrame
        Columns `SECTIONS`; ``error_sd_m`` is the root mean square of the estimate's own standard deviation
        over the section, NaN where it has none.
    """
    rows: list[tuple[object, ...]] = []
    for line in lines:
        own = limits.of(line.quantity, line.band)
        for row in section_rows(line.quantity, line.value, line.place, limits.section_m, own):
            start, end = row[1], row[2]
            inside = (line.place >= start) & (line.place < end) & np.isfinite(line.value)
            error = np.nan if line.sd is None else float(np.sqrt(np.mean(line.sd[inside] ** 2)))
            rows.append((row[0], line.band, *row[1:], error))
    return pd.DataFrame(rows, columns=list(SECTIONS))


def rail_summary(lines: Iterable[RailLine], limits: RailLimits) -> pd.DataFrame:
    """One row per line: what was found over the whole ride, and how often it lies beyond its limits.

    Returns
    -------
    pandas.DataFrame
        Columns `SUMMARY`. ``worst_sd_m`` is the largest standard deviation of a section, which begins at
        ``worst_start_m``; ``open_m`` is the way on which the estimate is below its limit, and the chance that
        the rails are not is above `OPEN_CHANCE`.
    """
    rows: list[tuple[object, ...]] = []
    for line in lines:
        inside = np.flatnonzero(np.isfinite(line.value))
        if not len(inside):
            continue
        value, step = line.value[inside], line.step_m
        worst = int(np.argmax(np.abs(value)))
        sections = rail_sections([line], limits)
        row = sections.iloc[int(sections["sd_m"].argmax())] if len(sections) else None
        limit = limits.peaks.get((line.quantity, line.band), np.nan)
        sd = None if line.sd is None else line.sd[inside]
        left_open = np.nan
        if sd is not None and np.isfinite(limit):
            below = np.abs(value) <= limit
            left_open = step * int(np.count_nonzero(below & (chance_beyond(value, sd, limit) > OPEN_CHANCE)))
        rows.append(
            (
                line.quantity,
                line.band,
                step * len(inside),
                float(value.std()),
                np.nan if row is None else float(row["sd_m"]),
                np.nan if row is None else float(row["start_m"]),
                float(value[worst]),
                float(line.place[inside[worst]]),
                np.nan if sd is None else float(np.sqrt(np.mean(sd**2))),
                limit,
                limits.sds.get((line.quantity, line.band), np.nan),
                len(exceedances([line], limits)),
                int(sections["sd_exceeded"].sum()),
                left_open,
            )
        )
    return pd.DataFrame(rows, columns=list(SUMMARY))
