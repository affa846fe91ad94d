"""The page of one estimate on one ride, without scores."""

from importlib.metadata import version
from pathlib import Path

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.core.columns import ATTITUDE
from simrail.core.resample import GAPS
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording, odometry_of
from simrail.report.figures.estimate import estimated_attitude_figure, innovation_figure, moves, place_of
from simrail.report.figures.ride import imu_figure, speed_figure
from simrail.report.pages.frame import page_text
from simrail.report.words.sentences import recording_facts

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
    # Where there is no truth, the odometry says where the figures of the ride are drawn.
    ride = CellResult({}, recording, odometry_of(recording), {}) if moves(recording) else None
    innovations = estimate.innovations
    has_attitude = any(name in estimate.states for name in ATTITUDE)
    text = page_text(
        "pages/estimate.html.j2",
        recording=recording,
        label=label,
        method=method,
        version=version("simrail"),
        tiles=_tiles(recording, estimate, us_per_sample),
        facts=ride_facts(recording),
        attitude=estimated_attitude_figure(recording, estimate, label=label) if has_attitude else "",
        speed=speed_figure(ride) if ride else "",
        imu=imu_figure(ride) if ride else "",
        innovations=innovation_figure(recording, estimate)
        if innovations is not None and len(innovations) > 1
        else "",
        gaps=_gaps(recording),
    )
    path.write_text(text, encoding="utf-8")


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
