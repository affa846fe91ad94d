"""The sections of single rides: how each was driven, what was concluded from it, and how it errs."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.core.columns import ATTITUDE, IRREGULARITY
from simrail.estimation.choose_odometry import TRUTH
from simrail.report.figures.attitude import attitude_figure, error_figure
from simrail.report.figures.contact import contact_figure
from simrail.report.figures.geometry import bands_figure, has_rails, rails_figure, stretch_of, stretch_words
from simrail.report.figures.ride import direction_of, imu_figure, odometry_figure, runs_of, speed_figure
from simrail.report.figures.score import curves_figure, rms_figure
from simrail.report.pages.section import PageData, Section
from simrail.report.tables.geometry import BAND, JUDGED, indicator_table, is_zero, judged_band, waves_words
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case, of_cell
from simrail.report.tables.running import running_tiles
from simrail.report.tables.tables import Table
from simrail.report.tables.tiles import tiles
from simrail.report.words.ablations import value_words
from simrail.report.words.findings import findings, one_of_each
from simrail.report.words.geometry_findings import geometry_findings
from simrail.report.words.sentences import axis_words, recording_facts, vibration_facts
from simrail.scenario.build import goals_mm, limits_of
from simrail.scoring.ablations import AXES, MAP
from simrail.track.bands import BANDS, Band, why_not
from simrail.track.quality import Limits

MOST_RIDES = 6
"""Rides that are drawn; the tables hold all."""

LONG_M = 400.0
"""Stretch that is drawn unfiltered."""

WAVES = 5.0
"""So many of the longest waves of a band are drawn of it: 125 m of D1."""

MOST_DRAWN = 3
"""Methods of one figure of rails; the tables hold all."""


def ride_sections(data: PageData) -> list[Section]:
    """A section for each ride that is drawn."""
    drawn = data.examples[:MOST_RIDES]
    titles = [ride_title(example) for example in drawn]
    if len(set(titles)) < len(titles):
        # One ride may be drawn as two IMUs recorded it.
        titles = [f"{title} \u00b7 {e.recording.mount}" for title, e in zip(titles, drawn, strict=True)]
    sections = []
    for example, title in zip(drawn, titles, strict=True):
        name = f"{example.recording.name}-{example.cell.get('cell', '')}"
        anchor = "ride-" + "".join(letter if letter.isalnum() else "-" for letter in name)
        shown = ride_data(data, example)
        sections.append(Section(anchor, f"Ride {title}", "pages/sections/ride.html.j2", shown))
    if sections:
        sections[-1].data["rides_left_out"] = max(len(data.examples) - MOST_RIDES, 0)
    return sections


def ride_data(data: PageData, example: CellResult) -> dict[str, Any]:
    """What the template shows of a ride."""
    spec, styles, name = data.scenario.spec, data.attitude_styles, example.recording.name
    case = of_cell(data.cases, example.cell)
    geometry = geometry_view(example, case, data.styles, limits=limits_of(spec), known=data.bands)
    drawn = [style for style in styles if has_attitude(example, style.name)]
    drawn = one_of_each(case, drawn) if case else drawn
    left_out = [style for style in drawn if not style.baseline][MOST_DRAWN:] if geometry else []
    drawn = [style for style in drawn if style not in left_out]
    first = [s for s in drawn if not s.baseline] + [s for s in drawn if s.baseline == "general purpose"]
    comparisons = []
    for style in drawn:
        twin = next((other for other in drawn if other.name == style.twin), None)
        if style.compensated and twin:
            title = f"{style.kind}, with and without compensation"
            comparisons.append((title, attitude_figure(example, [style, twin], what=f"{title}, {name}")))
    of_scores: dict[str, Any] = {"tiles": [], "findings": [], "rms": "", "curves": ""}
    if case:
        of_scores = {
            "tiles": running_tiles(case, derailment_limit=data.derailment_limit)
            if data.asks_of_ride
            else tiles(case, data.styles, known=data.bands),
            "findings": [
                # Where rails are scored, they are what the ride was for.
                *geometry_findings(case, data.styles, data.cases, goals_mm=goals_mm(spec), known=data.bands),
                *findings(case, styles, others=data.cases),
            ],
            "rms": rms_figure(case, styles),
            "curves": curves_figure(case, styles),
        }
    return of_scores | {
        "scenario": data.scenario,
        "styles": data.styles,
        "facts": [*ride_facts(example), *vibration_facts(example.shaken)],
        "speed": speed_figure(example, conditions=spec.rail_condition),
        "imu": imu_figure(example),
        "attitude": attitude_figure(example, first or drawn, what=f"Attitude, {name}") if drawn else "",
        "comparisons": comparisons,
        "errors": error_figure(example, drawn) if drawn else "",
        "contact": contact_figure(example) if example.contacts else "",
        "odometry": ""
        if example.recording.odometry is None or example.recording.odometry_source == TRUTH
        else odometry_figure(example),
        "geometry": geometry,
        "left_out": len(left_out),
        "rides_left_out": 0,
        "asks_of_ride": data.asks_of_ride,
    }


def has_attitude(example: CellResult, name: str) -> bool:
    """Whether a method estimated roll, pitch and yaw; one that is an odometry and nothing else did not."""
    found = example.estimates.get(name)
    return found is not None and all(angle in found.states for angle in ATTITUDE)


def ride_title(example: CellResult) -> str:
    """Name of a ride, and the values of its axes; its map and what shakes it stand in the facts."""
    told = ("imu.grade", *AXES)
    axes = [
        axis_words(name, value) for name, value in example.cell.items() if "." in name and name not in told
    ]
    return " \u00b7 ".join([example.recording.name, *axes])


def ride_facts(example: CellResult) -> list[str]:
    """Length, speed, IMU, odometry and map of a ride, a line each."""
    motion, recording = example.motion, example.recording
    speed = np.abs(motion["speed_mps"].to_numpy())
    moving = speed > 0.01
    runs, places = runs_of(example)
    way = f"towards {'increasing' if direction_of(example) > 0 else 'decreasing'} distance"
    if runs > 1:
        way = f"in {runs} runs, to and fro between {places.min():.0f} and {places.max():.0f} m"
    mean = 3.6 * float(speed[moving].mean()) if moving.any() else 0.0
    duration = float(motion.index[-1] - motion.index[0])
    return [
        f"{np.abs(np.diff(places)).sum():.0f} m {way}, {duration:.0f} s",
        f"mean {mean:.1f} km/h while moving, at most {3.6 * float(speed.max()):.1f} km/h",
        *recording_facts(recording),
        f"the line from {value_words(MAP, example.cell['map'], title=True)}",
    ]


def geometry_view(
    example: CellResult,
    case: Case | None,
    styles: Sequence[MethodStyle],
    *,
    limits: Mapping[str, Limits],
    known: Mapping[str, Band] = BANDS,
) -> dict[str, Any] | None:
    """What the template of rails shows; None if no method of the ride says what the rails look like.

    Parameters
    ----------
    example : CellResult
        The ride.
    case : Case, optional
        Its scores; they say in which band it is judged.
    styles : sequence of MethodStyle
        The scenario's methods.
    limits : mapping of str to Limits
        Limits of the indicators.
    known : mapping of str to Band
        The scenario's bands by name.
    """
    drawn = [s for s in styles if not is_zero(s) and has_rails(example, s)][:MOST_DRAWN]
    if not drawn:
        return None
    first, band = drawn[0], known.get(judged_band(case)) if case is not None else None
    if band is not None and not _holds(example, first, band):
        band = None
    stretches: dict[Band | None, float] = {None: LONG_M}
    if band is not None:
        stretches[band] = WAVES * max(band.edges_m(quantity)[1] for quantity in JUDGED)
    rails = []
    for part, length_m in stretches.items():
        stretch = stretch_of(example, first.name, band=part, length_m=length_m)
        words = f" {waves_words(part.name, known)}" if part else ", unfiltered"
        what = f"Rails over distance{words}"
        svg = rails_figure(example, drawn, band=part, limits=stretch, with_interval=not part, what=what)
        rails.append((part is not None, f"{stretch_words(example, stretch)}{words}", svg))
    return {
        "methods": [style.label for style in drawn],
        "rails": rails,
        "bands": bands_figure(case, styles, known=known) if case is not None else "",
        "indicators": _indicators(example, first, limits),
        "limits": limits,
        "band": BAND,
    }


def _holds(example: CellResult, style: MethodStyle, band: Band) -> bool:
    """Whether a ride is long enough, and its places near enough to each other, for a band."""
    geometry = example.estimates[style.name].geometry
    assert geometry is not None
    step = float(geometry.index[1] - geometry.index[0])
    return not any(why_not(band.edges_m(q), count=len(geometry), step_m=step) for q in JUDGED)


def _indicators(example: CellResult, style: MethodStyle, limits: Mapping[str, Limits]) -> Table | None:
    geometry = example.estimates[style.name].geometry
    if geometry is None or example.rails is None or not _holds(example, style, BANDS[BAND]):
        return None
    truth = example.rails.irregularities(geometry.index.to_numpy(dtype="float64"))[list(IRREGULARITY)]
    return indicator_table(truth.set_index(geometry.index), geometry, limits=limits, band=BANDS[BAND])
