"""The page of one estimate on one ride, without scores."""

from importlib.metadata import version
from pathlib import Path

import numpy as np

from simrail.core.resample import GAPS
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording, odometry_of
from simrail.report.figures.estimate import estimate_looks, estimate_view, place_of, shown_bands
from simrail.report.pages.explorer import explorer_data
from simrail.report.pages.frame import page_text
from simrail.report.tables.geometry import BAND, indicator_table
from simrail.report.tables.tables import Table
from simrail.report.words.sentences import recording_facts
from simrail.track.bands import BANDS

MOST_GAPS = 20


def write_estimate_page(
    path: Path, recording: Recording, estimate: Estimate, *, label: str, method: str, us_per_sample: float
) -> None:
    """Write the page.

    Parameters
    ----------
    path : Path
        The HTML file.
    recording : Recording
        The ride.
    estimate : Estimate
        What the method concluded from it.
    label, method : str
        Name of the method, and its options in full.
    us_per_sample : float
        Time that it took.
    """
    view = estimate_view(recording, estimate)
    shown = explorer_data([view], estimate_looks(label))
    text = page_text(
        "pages/estimate.html.j2",
        recording=recording,
        label=label,
        method=method,
        version=version("simrail"),
        tiles=_tiles(recording, estimate, us_per_sample),
        facts=ride_facts(recording),
        data=shown["data"],
        quality=_quality(estimate),
        gaps=_gaps(recording),
    )
    path.write_text(text, encoding="utf-8")


def _quality(estimate: Estimate) -> Table | None:
    """Track quality of the rails by sections; None where there are none, or the ride is too short."""
    geometry = estimate.geometry
    if geometry is None or len(geometry) < 2 or BANDS[BAND] not in shown_bands(geometry.index.to_numpy()):
        return None
    return indicator_table(None, geometry, limits={}, band=BANDS[BAND])


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
    difference = estimate.states[angle].to_numpy(dtype=np.float64) - getattr(frame, angle)
    wrapped = (difference + np.pi) % (2.0 * np.pi) - np.pi
    return float(np.rad2deg(np.sqrt(np.mean(wrapped**2))))


def _tiles(recording: Recording, estimate: Estimate, us_per_sample: float) -> list[tuple[str, str, str]]:
    duration = f"{recording.imu.index[-1] - recording.imu.index[0]:.0f} s"
    position = place_of(recording)
    tiles = [("way", f"{abs(position[-1] - position[0]):.0f} m", f"in {duration}")]
    if recording.odometry is None:
        tiles = [("duration", duration, "no odometry tells the way")]
    for angle in ("roll_rad", "pitch_rad"):
        if angle in estimate.states and recording.odometry is not None and recording.track.is_map:
            word = angle.removesuffix("_rad")
            difference = design_difference_deg(recording, estimate, angle)
            tiles.append(
                (f"{word} less design", f"{difference:.3f}\u00b0", "rms; not an error: there is no truth")
            )
    tiles.append(("time", f"{us_per_sample:.2f} \u00b5s", "per sample"))
    return tiles


def _gaps(recording: Recording) -> list[str]:
    if recording.gaps is None:
        return []
    lines = [
        f"{missing:.0f} samples between {start_s:.3f} and {end_s:.3f} s"
        for start_s, end_s, missing in recording.gaps.head(MOST_GAPS)[list(GAPS)].to_numpy(dtype=np.float64)
    ]
    more = len(recording.gaps) - MOST_GAPS
    return lines + ([f"and {more} more"] if more > 0 else [])
