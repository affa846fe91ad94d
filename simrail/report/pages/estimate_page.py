"""The page of estimates on one recorded ride, which has no truth."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd

from simrail.core.resample import GAPS
from simrail.estimation.bibliography import citations, entries
from simrail.estimation.estimate import Estimate
from simrail.recording.files.asked import RideReference
from simrail.recording.recording import Recording, odometry_of
from simrail.report.figures.estimate import estimate_looks, estimate_view, place_of
from simrail.report.figures.views import ATTITUDES, RAILS
from simrail.report.pages.explorer import explorer_data
from simrail.report.pages.frame import page_text
from simrail.report.tables.geometry import BAND
from simrail.report.tables.recorded import (
    BAND_WORDS,
    LIKELY,
    MethodResult,
    TextTable,
    beside_each_other,
    difference_table,
    differences,
    exceedance_table,
    exceedance_words,
    rails_table,
    reference_table,
    sections_table,
)
from simrail.report.words.sentences import recording_facts
from simrail.scoring.score import wrap
from simrail.track.rail_limits import RailLimits, exceedances, rail_sections, rail_summary

MOST_GAPS = 20

MOST_PLACES = 25
"""Places beyond a limit that the page lists; the file has all."""


@dataclass(frozen=True)
class RideEstimates:
    """What was concluded from one recorded ride.

    Attributes
    ----------
    recording : Recording
        The ride.
    results : tuple of MethodResult
        Its methods; the first is what others are compared with.
    limits : RailLimits
        What rails are held against.
    reference : RideReference, optional
        What estimates are compared with, if there is something.
    scores : pandas.DataFrame, optional
        Scores against it, with a column ``estimator``.
    """

    recording: Recording
    results: tuple[MethodResult, ...]
    limits: RailLimits
    reference: RideReference | None = None
    scores: pd.DataFrame | None = None


@dataclass(frozen=True)
class _Rails:
    """Rails of one method, as the page has them."""

    name: str
    words: str
    summary: TextTable
    places: TextTable
    more: int
    sections: TextTable


def write_estimate_page(path: Path, found: RideEstimates) -> None:
    """Write the page.

    Parameters
    ----------
    path : Path
        The HTML file.
    found : RideEstimates
        What it shows.
    """
    view = estimate_view(found.results, found.limits, found.reference)
    groups = {panel.group for panel in view.panels}
    first = [group for group in (f"{RAILS} in {BAND}", ATTITUDES) if group in groups] or [ATTITUDES]
    shown = explorer_data([view], estimate_looks(found.results), first=first)
    several = len(found.results) > 1
    text = page_text(
        "pages/estimate.html.j2",
        recording=found.recording,
        label=" beside ".join(result.name for result in found.results) if several else found.results[0].label,
        results=found.results,
        several=several,
        version=version("simrail"),
        tiles=_tiles(found),
        facts=ride_facts(found.results[0].recording),
        data=shown["data"],
        rails=[_rails(result, found.limits) for result in found.results if result.lines],
        limits=found.limits,
        bands=BAND_WORDS,
        beside=beside_each_other(found.results) if several else None,
        differences=difference_table(differences(found.results)) if several else None,
        reference=None if found.scores is None else reference_table(found.scores),
        sources=_sources(found.reference),
        gaps=_gaps(found.recording),
        citations=citations((result.name, result.cites) for result in found.results),
        bibtex=entries(result.cites for result in found.results),
    )
    path.write_text(text, encoding="utf-8")


def _rails(result: MethodResult, limits: RailLimits) -> _Rails:
    places = exceedances(result.lines, limits)
    return _Rails(
        result.name,
        exceedance_words(places, limits, result.lines),
        rails_table(rail_summary(result.lines, limits)),
        exceedance_table(places, most=MOST_PLACES),
        max(len(places) - MOST_PLACES, 0),
        sections_table(rail_sections(result.lines, limits)),
    )


def _sources(reference: RideReference | None) -> str:
    if reference is None:
        return ""
    named = [reference.source, reference.rail_source]
    band = f" (in {reference.rail_band})" if reference.rail_band else ""
    return " and ".join(name for name in named if name) + (band if reference.rail_source else "")


def ride_facts(recording: Recording) -> list[str]:
    """What there is to know of a recording, one line each."""
    position, time = place_of(recording), recording.imu.index.to_numpy()
    lost = "no gaps"
    if recording.gaps is not None and len(recording.gaps):
        missing = int(recording.gaps["missing"].sum())
        lost = f"{missing} of them lost and interpolated, in {len(recording.gaps)} gaps"
    track = recording.track
    named = f"track '{track.name}'{' (synthetic)' if track.synthetic else ''}"
    named = named if track.is_map else "a line without a map"
    way = f"from s = {position[0]:.1f} m of {named}"
    if recording.odometry is not None:
        speed = 3.6 * float(np.abs(recording.odometry["speed_mps"].to_numpy()).max())
        way = f"from s = {position[0]:.1f} to {position[-1]:.1f} m of {named}, at most {speed:.1f} km/h"
    return [
        f"{len(time)} samples at {recording.imu_sheet.rate_hz:g} Hz, {time[-1] - time[0]:.1f} s; {lost}",
        way,
        *recording_facts(recording),
        *(f"note: {note}" for note in recording.notes),
    ]


def design_difference_deg(recording: Recording, estimate: Estimate, angle: str) -> float:
    """RMS difference of an estimated angle to the design's at the odometry's place, deg; it is no error."""
    frame = recording.track.frame_extended(odometry_of(recording)["position_m"].to_numpy())
    difference = wrap(estimate.states[angle].to_numpy(dtype=np.float64) - getattr(frame, angle))
    return float(np.rad2deg(np.sqrt(np.mean(difference**2))))


def design_differences(result: MethodResult) -> dict[str, float]:
    """Root mean squares of roll and pitch less the design, deg, of what a method has on a line with a map."""
    if result.recording.odometry is None or not result.recording.track.is_map:
        return {}
    return {
        angle.removesuffix("_rad"): design_difference_deg(result.recording, result.estimate, angle)
        for angle in ("roll_rad", "pitch_rad")
        if angle in result.estimate.states
    }


def _tiles(found: RideEstimates) -> list[tuple[str, str, str]]:
    result = found.results[0]
    recording = result.recording
    duration = f"{recording.imu.index[-1] - recording.imu.index[0]:.0f} s"
    position = place_of(recording)
    tiles = [("way", f"{abs(position[-1] - position[0]):.0f} m", f"in {duration}")]
    if recording.odometry is None:
        tiles = [("duration", duration, "no odometry tells the way")]
    if result.lines:
        tiles.append(_rails_tile(result, found.limits))
    for word, difference in design_differences(result).items():
        note = "rms; not an error: there is no truth"
        tiles.append((f"{word} less design", f"{difference:.3f}\u00b0", note))
    tiles.append(("time", f"{result.seconds:.1f} s", "with what had to be compiled"))
    if len(found.results) == 1:
        return tiles
    return [tiles[0], *((f"{title}, {result.name}", value, note) for title, value, note in tiles[1:])]


def _rails_tile(result: MethodResult, limits: RailLimits) -> tuple[str, str, str]:
    places = exceedances(result.lines, limits)
    whose = "example limits" if limits.is_example else "limits as given"
    if places["chance"].notna().any():
        sure = int((places["chance"] >= LIKELY).sum())
        return "places beyond a limit", str(len(places)), f"{sure} of them surely; {whose}"
    return "places beyond a limit", str(len(places)), whose


def _gaps(recording: Recording) -> Sequence[str]:
    if recording.gaps is None:
        return []
    lines = [
        f"{missing:.0f} {'sample' if missing == 1 else 'samples'} between {start_s:.3f} and {end_s:.3f} s"
        for start_s, end_s, missing in recording.gaps.head(MOST_GAPS)[list(GAPS)].to_numpy(dtype=np.float64)
    ]
    more = len(recording.gaps) - MOST_GAPS
    return lines + ([f"and {more} more"] if more > 0 else [])
