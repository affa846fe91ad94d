"""The report page: gathers figures, tables and sentences and writes one self-contained HTML file.

Nothing is fetched when the page is opened: styles and figures are in it. What it says is computed
from the scores (`simrail.report.findings`); how it looks is in ``page.html.j2``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from simrail.example import CellResult
from simrail.former import FormerResults
from simrail.report.attitude_figures import attitude_figure, error_figure
from simrail.report.campaign.section import campaign_view
from simrail.report.campaign.tables import write_tables
from simrail.report.findings import Finding, findings
from simrail.report.geometry_tables import geometry_table, overview_table
from simrail.report.geometry_view import GeometryView, geometry_view
from simrail.report.methods import MethodStyle, method_styles
from simrail.report.paper_000.section import paper_view as beside_briales
from simrail.report.paper_001.section import paper_view as beside_gonzalez
from simrail.report.paper_001.tunings import tunings_of
from simrail.report.pivot import Figures, cases, of_cell
from simrail.report.provenance import facts, parts
from simrail.report.ride_figures import direction_of, imu_figure, odometry_figure, speed_figure
from simrail.report.score_figures import curves_figure, rms_figure
from simrail.report.tables import Table, consistency_table, error_table, odometry_table
from simrail.report.tiles import Tile, tiles
from simrail.report.track_figures import plan_figure, profile_figure
from simrail.scenario.build import goals_mm, limits_of
from simrail.scenario.cells import methods
from simrail.scenario.scenario import Scenario, ScenarioFile
from simrail.score_table import LEFT_OPEN, NO_SAMPLES, OK

MOST_RIDES = 6
"""Rides that are drawn; the tables hold all."""

TABLES = "tables"
"""Folder beside the page for the tables of a campaign, as CSV and LaTeX."""

SETS_BESIDE = ("gonzalez_2023",)
"""Publications whose section can hold the results of a second scenario as well."""

MOST_TABLES = 24
"""Cases whose table is on the page; ``scores.csv`` holds all."""


@dataclass(frozen=True)
class RideView:
    """One ride as the template needs it."""

    key: str
    title: str
    facts: list[str]
    tiles: list[Tile]
    findings: list[Finding]
    speed: Markup
    imu: Markup
    attitude: Markup
    comparisons: list[tuple[str, Markup]]
    errors: Markup
    odometry: Markup
    rms: Markup
    curves: Markup
    geometry: GeometryView | None


@dataclass(frozen=True)
class CaseView:
    """The tables of one case."""

    title: str
    draws: str
    truth: Table
    design: Table
    consistency: Table
    geometry: Table | None


def write_report(
    path: Path,
    *,
    scenario: Scenario,
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    examples: Sequence[CellResult],
    manifest: Mapping[str, Any],
    beside: FormerResults | None = None,
) -> None:
    """Write the report of a campaign; where it has axes, its tables into the folder `TABLES` beside it.

    Parameters
    ----------
    path : Path
        The HTML file.
    scenario : Scenario
        What was run.
    scores : pandas.DataFrame
        The score table.
    cells : pandas.DataFrame
        One row per cell: labels and values of the axes.
    examples : sequence of CellResult
        Rides to draw, first draw of each.
    manifest : mapping
        What the campaign noted of itself: command, versions, times; plain values.
    beside : FormerResults, optional
        Results of another scenario of the same publication, one of `SETS_BESIDE`.
    """
    all_cases = cases(scores, cells)
    styles = list(method_styles(methods(scenario)).values())
    paper = _beside_paper(scenario, all_cases, styles, examples, beside)
    campaign = campaign_view(scenario, scores, cells, styles, examples, manifest)
    if campaign is not None:
        write_tables(path.parent / TABLES, campaign.tables)
    rides = [_ride(example, all_cases, styles, scenario.spec) for example in examples[:MOST_RIDES]]
    environment = Environment(
        loader=PackageLoader("simrail.report", "."),
        autoescape=select_autoescape(default=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    text = environment.get_template("page.html.j2").render(
        scenario=scenario,
        manifest=manifest,
        facts=facts(manifest),
        parts=parts(scenario, cells, examples),
        styles=styles,
        paper=paper,
        campaign=campaign,
        tracks=_tracks(examples),
        rides=rides,
        rides_left_out=max(len(examples) - MOST_RIDES, 0),
        cases=[_case(case, styles) for case in all_cases[:MOST_TABLES]],
        rails=overview_table(all_cases, styles),
        cases_left_out=max(len(all_cases) - MOST_TABLES, 0),
        odometry=odometry_table(all_cases[:MOST_TABLES]),
        failures=_failures(scores),
        rows=len(scores),
        imus=len(scores[["mount", "imu"]].drop_duplicates()),
    )
    path.write_text(text, encoding="utf-8")


def _beside_paper(
    scenario: Scenario,
    all_cases: list[Figures],
    styles: Sequence[MethodStyle],
    examples: Sequence[CellResult],
    former: FormerResults | None,
) -> Any:
    """The section that sets a scenario beside a publication; None if it names none."""
    ran = methods(scenario)
    if scenario.spec.paper == "briales_2021":
        return beside_briales(all_cases, ran, styles, examples)
    if scenario.spec.paper == "gonzalez_2023":
        tunings = tunings_of(ran, scenario.folder)
        return beside_gonzalez(all_cases, ran, styles, examples, tunings=tunings, former=former)
    return None


def _ride(
    example: CellResult,
    all_cases: list[Figures],
    styles: list[MethodStyle],
    spec: ScenarioFile,
) -> RideView:
    name = example.recording.name
    drawn = [style for style in styles if style.name in example.estimates]
    case = of_cell(all_cases, example.cell)
    said = findings(case, styles, others=all_cases) if case else []
    first = [s for s in drawn if not s.baseline] + [s for s in drawn if s.baseline == "general purpose"]
    by_name = {style.name: style for style in drawn}
    comparisons = []
    for style in drawn:
        twin = by_name.get(style.twin)
        if style.compensated and twin:
            title = f"{style.label.removesuffix(' compensated')}, with and without compensation"
            comparisons.append(
                (title, Markup(attitude_figure(example, [style, twin], what=f"{title}, {name}")))
            )
    nothing = Markup("")
    return RideView(
        key="ride-" + "".join(c if c.isalnum() else "-" for c in f"{name}-{example.cell.get('cell', '')}"),
        title=_ride_title(example),
        facts=_ride_facts(example),
        tiles=tiles(case, styles) if case else [],
        findings=said,
        speed=Markup(speed_figure(example, conditions=spec.rail_condition)),
        imu=Markup(imu_figure(example)),
        attitude=Markup(attitude_figure(example, first or drawn, what=f"Attitude, {name}"))
        if drawn
        else nothing,
        comparisons=comparisons,
        errors=Markup(error_figure(example, drawn)) if drawn else nothing,
        odometry=Markup(odometry_figure(example)),
        rms=Markup(rms_figure(case, styles)) if case else nothing,
        curves=Markup(curves_figure(case, styles)) if case else nothing,
        geometry=geometry_view(example, case, styles, all_cases, limits_of(spec), goals_mm(spec)),
    )


_UNITS = {"kmh": "km/h", "mps2": "m/s\u00b2", "mps3": "m/s\u00b3", "m": "m", "s": "s", "hz": "Hz"}


def axis_words(name: str, value: object) -> str:
    """A value of an axis as people say it: ``ride.speed_kmh``, 20.0 becomes ``speed 20 km/h``."""
    *words, last = name.rpartition(".")[2].split("_")
    shown = f"{value:g}" if isinstance(value, float) else str(value)
    if words and last in _UNITS:
        return f"{' '.join(words)} {shown} {_UNITS[last]}"
    return f"{' '.join([*words, last])} {shown}"


def _ride_title(example: CellResult) -> str:
    axes = [
        axis_words(name, value) for name, value in example.cell.items() if "." in name and name != "imu.grade"
    ]
    return " \u00b7 ".join([example.recording.name, *axes])


def _ride_facts(example: CellResult) -> list[str]:
    motion, recording = example.motion, example.recording
    position, speed = motion["position_m"].to_numpy(), np.abs(motion["speed_mps"].to_numpy())
    moving = speed > 0.01
    way = "increasing" if direction_of(example) > 0 else "decreasing"
    mean = 3.6 * float(speed[moving].mean()) if moving.any() else 0.0
    duration = float(motion.index[-1] - motion.index[0])
    x, y, z = recording.mount_position_m
    return [
        f"{abs(position[-1] - position[0]):.0f} m towards {way} distance, {duration:.0f} s",
        f"mean {mean:.1f} km/h while moving, at most {3.6 * float(speed.max()):.1f} km/h",
        f"IMU {recording.imu_sheet.grade} at {recording.imu_sheet.rate_hz:g} Hz on '{recording.mount_body}', "
        f"{x:g}, {y:g}, {z:g} m (forward, left, up)",
        f"position and speed from the odometry '{recording.odometry_source}'"
        + (" (an ablation: a train has no such thing)" if recording.odometry_source == "truth" else ""),
    ]


def _tracks(examples: Sequence[CellResult]) -> list[dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for example in examples:
        track, position = example.recording.track, example.motion["position_m"].to_numpy()
        entry = found.setdefault(track.name, {"track": track, "stops": {}})
        if not entry["stops"]:
            entry["stops"] = {"start": float(position[0]), "end": float(position[-1])}
    return [
        {
            "name": entry["track"].name,
            "synthetic": entry["track"].synthetic,
            "length_m": entry["track"].length_m,
            "plan": Markup(plan_figure(entry["track"], stops=entry["stops"])),
            "profile": Markup(profile_figure(entry["track"])),
        }
        for entry in found.values()
    ]


def _case(case: Figures, styles: list[MethodStyle]) -> CaseView:
    labels = case.labels
    title = f"{labels['ride']} \u00b7 IMU {labels['mount']} ({labels['imu']})"
    axes = [f"odometry {labels['odometry']}"]
    axes += [
        axis_words(name, value)
        for name, value in labels.items()
        if "." in name and not name.startswith("imu.grade")
    ]
    tracks, draws = int(case.table["track_draws"].max()), int(case.table["draws"].max())
    said = (
        "one draw" if draws <= 1 else f"mean \u00b1 standard deviation between {draws} draws of the sensors"
    )
    if tracks > 1:
        said += f" over {tracks} draws of the track"
    return CaseView(
        " \u00b7 ".join([title, *axes]),
        said,
        error_table(case, styles, reference="truth"),
        error_table(case, styles, reference="design"),
        consistency_table(case, styles),
        geometry_table(case, styles),
    )


def _failures(scores: pd.DataFrame) -> list[tuple[str, str, str, int]]:
    """(method, IMU, reason, figures) of what has no value; what cannot have one is left out."""
    failed = scores[~scores["status"].isin((OK, NO_SAMPLES, *LEFT_OPEN))]
    if failed.empty:
        return []
    # One line per kind of fault: how many samples of a window it hit is in the table itself.
    reason = failed["status"].astype(str).str.replace(r" in \d+ of \d+ samples", "", regex=True)
    counted = failed.assign(reason=reason).groupby(["estimator", "imu", "reason"], observed=True).size()
    listed = counted.reset_index(name="figures").itertuples(index=False)
    return [(str(name), str(imu), str(why), int(figures)) for name, imu, why, figures in listed]
