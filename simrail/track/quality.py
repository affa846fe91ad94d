"""Indicators of track quality in the manner of EN 13848-5: standard deviation and isolated defects.

They are computed alike from estimated and from true geometry. Limits are the caller's: no limit is built in,
since the standard's own were not at hand.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from simrail.core.columns import IRREGULARITY, require
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.track.bands import Band, band_pass, twist

SECTION_M = 200.0
"""Length over which EN 13848-5 is commonly said to take standard deviations."""

LEAST_FILLED = 0.5
"""Share of a section that must be known for it to count."""

INDICATORS = ("quantity", "start_m", "end_m", "sd_m", "peak_m", "peak_position_m", "defects", "sd_exceeded")
"""Columns of `section_indicators`."""


@dataclass(frozen=True)
class Limits:
    """Limits of one quantity, m; None for none.

    Attributes
    ----------
    sd_m : float, optional
        Of the standard deviation over a section.
    defect_m : float, optional
        Of the distance from the section's mean to a peak: beyond it lies an isolated defect.
    """

    sd_m: float | None = None
    defect_m: float | None = None


def section_indicators(
    geometry: pd.DataFrame,
    *,
    band: Band | None = None,
    section_m: float = SECTION_M,
    twist_base_m: float | None = None,
    limits: Mapping[str, Limits] | None = None,
) -> pd.DataFrame:
    """Indicators of every section of a line.

    Parameters
    ----------
    geometry : pandas.DataFrame
        Indexed by uniform ``position_m``, columns `simrail.core.columns.IRREGULARITY`.
    band : Band, optional
        Wavelengths to look at; all of them if not given.
    section_m : float
        Length of a section; sections begin at its whole multiples.
    twist_base_m : float, optional
        Adds the quantity ``twist``, unfiltered in any band, over this base.
    limits : mapping of str to Limits, optional
        By quantity (``"alignment"``, ``"cross_level"``, ``"twist"`` ...).

    Returns
    -------
    pandas.DataFrame
        Columns `INDICATORS`, one row per quantity and section: the standard deviation about the section's
        mean; the largest deviation from that mean, with its sign, and where it lies; how many isolated
        defects there are (stretches beyond the limit; a stretch across a border counts in both sections);
        whether the standard deviation exceeds its limit (False without one). Quantities that are not
        observable, and sections known by less than half, are left out.

    Raises
    ------
    InputError
        If the band or the base does not fit the geometry, or a limit is for no such quantity.
    """
    require(geometry, IRREGULARITY, what="geometry")
    position = geometry.index.to_numpy(dtype=np.float64)
    if len(position) < 2:
        return pd.DataFrame(columns=list(INDICATORS))
    step = float(position[1] - position[0])
    values = {name.removesuffix("_m"): geometry[name].to_numpy(dtype=np.float64) for name in IRREGULARITY}
    finite = {name: line for name, line in values.items() if np.isfinite(line).all()}
    lines = finite
    if band is not None:
        lines = {name: band_pass(line, band.edges_m(name), step_m=step) for name, line in finite.items()}
    if twist_base_m is not None and "cross_level" in finite:
        lines = {**lines, "twist": twist(finite["cross_level"], base_m=twist_base_m, step_m=step)}
    for name in limits or {}:
        if name not in (*values, "twist"):
            raise InputError(
                "no such quantity", field="limits", value=name, limit=", ".join((*values, "twist"))
            )
    rows = [
        row
        for name, line in lines.items()
        for row in section_rows(name, line, position, section_m, (limits or {}).get(name, Limits()))
    ]
    return pd.DataFrame(rows, columns=list(INDICATORS))


def section_rows(
    name: str, line: FloatArray, position: FloatArray, section_m: float, limits: Limits
) -> list[tuple[str, float, float, float, float, float, int, bool]]:
    """Rows of one quantity, in the order of `INDICATORS`.

    Parameters
    ----------
    name : str
        The quantity.
    line, position : ndarray (n,)
        Its values over uniform places, m; NaN where nothing is known.
    section_m : float
        Length of a section.
    limits : Limits
        Of the quantity.
    """
    step_m = float(position[1] - position[0])
    sections = np.floor(position / section_m + 1e-9).astype(np.int64)
    rows: list[tuple[str, float, float, float, float, float, int, bool]] = []
    for number in np.unique(sections):
        inside = np.flatnonzero((sections == number) & np.isfinite(line))
        if len(inside) * step_m < LEAST_FILLED * section_m:
            continue
        away = line[inside] - line[inside].mean()
        sd, worst = float(np.sqrt(np.mean(away**2))), int(np.argmax(np.abs(away)))
        beyond = np.abs(away) > (np.inf if limits.defect_m is None else limits.defect_m)
        defects = int(np.count_nonzero(np.diff(beyond.astype(np.int8), prepend=0) == 1))
        peak, place = float(away[worst]), float(position[inside[worst]])
        start = float(number * section_m)
        exceeded = bool(limits.sd_m is not None and sd > limits.sd_m)
        rows.append((name, start, start + section_m, sd, peak, place, defects, exceeded))
    return rows
