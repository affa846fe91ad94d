"""The report page: gathers figures, tables and sentences and writes one self-contained HTML file.

Nothing is fetched when the page is opened: styles and figures are in it. What it says is computed
from the scores (`simrail.report.words.findings`); how it looks is in ``page.html.j2``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from simrail.campaign.cell import CellResult
from simrail.campaign.stored_results import StoredResults
from simrail.report.campaign.section import campaign_view
from simrail.report.campaign.tables import write_tables
from simrail.report.figures.attitude import attitude_figure, error_figure
from simrail.report.figures.ride import imu_figure, odometry_figure, speed_figure
from simrail.report.figures.score import curves_figure, rms_figure
from simrail.report.figures.track import plan_figure, profile_figure, profile_words
from simrail.report.papers.briales_2021.section import paper_view as beside_briales
from simrail.report.papers.gonzalez_2023.section import paper_view as beside_gonzalez
from simrail.report.papers.gonzalez_2023.tunings import tunings_of
from simrail.report.tables.geometry_bands import band_of_all
from simrail.report.tables.geometry_tables import geometry_table, overview_table
from simrail.report.tables.geometry_view import MOST_DRAWN, GeometryView, geometry_view
from simrail.report.tables.methods import MethodStyle, attitude_methods, method_styles
from simrail.report.tables.pivot import Figures, cases, of_cell
from simrail.report.tables.provenance import facts, parts
from simrail.report.tables.tables import Table, consistency_table, error_table, odometry_table
from simrail.report.tables.tiles import Tile, tiles
from simrail.report.words.alike import one_of_each
from simrail.report.words.findings import findings
from simrail.report.words.geometry_findings import geometry_findings
from simrail.report.words.ride_words import axis_words, ride_facts, ride_title
from simrail.report.words.sentences import Finding, unbroken
from simrail.scenario.build import bands_by_name, goals_mm, limits_of
from simrail.scenario.cells import methods
from simrail.scenario.scenario import Scenario, ScenarioFile
from simrail.scoring.table import LEFT_OPEN, NO_SAMPLES, OK
from simrail.track.bands import Band

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
    left_out: int


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
    beside: StoredResults | None = None,
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
    beside : StoredResults, optional
        Results of another scenario of the same publication, one of `SETS_BESIDE`.
    """
    all_cases = cases(scores, cells)
    styles = list(method_styles(scenario).values())
    paper = _beside_paper(scenario, all_cases, styles, examples, beside)
    campaign = campaign_view(scenario, scores, cells, styles, examples, manifest, band=band_of_all(all_cases))
    if campaign is not None:
        write_tables(path.parent / TABLES, campaign.tables)
    drawn = examples[:MOST_RIDES]
    rides = [_ride(example, all_cases, styles, scenario.spec) for example in drawn]
    if len({ride.title for ride in rides}) < len(rides):
        # One ride may be drawn as two IMUs recorded it.
        rides = [
            replace(ride, title=f"{ride.title} \u00b7 {example.recording.mount}")
            for ride, example in zip(rides, drawn, strict=True)
        ]
    environment = Environment(
        loader=PackageLoader("simrail.report", "."),
        autoescape=select_autoescape(default=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["unbroken"] = unbroken
    geometry = scenario.spec.geometry
    text = environment.get_template("pages/page.html.j2").render(
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
        ride_count=cells["ride"].nunique(),
        cases=[_case(case, styles, bands_by_name(scenario.spec)) for case in all_cases[:MOST_TABLES]],
        rails=overview_table(all_cases, styles, known=bands_by_name(scenario.spec)),
        bands=[bands_by_name(scenario.spec)[name] for name in (*geometry.bands, *geometry.own_bands)],
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
    former: StoredResults | None,
) -> Any:
    """The section that sets a scenario beside a publication; None if it names none."""
    ran = methods(scenario)
    if scenario.spec.paper == "briales_2021":
        return beside_briales(all_cases, ran, styles, examples)
    if scenario.spec.paper == "gonzalez_2023":
        tunings = tunings_of(ran, scenario.folder)
        return beside_gonzalez(
            all_cases, ran, styles, examples, tunings=tunings, scenario=scenario, former=former
        )
    return None


def _ride(
    example: CellResult,
    all_cases: list[Figures],
    styles: list[MethodStyle],
    spec: ScenarioFile,
) -> RideView:
    name = example.recording.name
    drawn = [style for style in attitude_methods(styles) if style.name in example.estimates]
    case = of_cell(all_cases, example.cell)
    known = bands_by_name(spec)
    said: list[Finding] = []
    if case:
        # Where rails are scored, they are what the ride was for.
        said += geometry_findings(case, styles, all_cases, goals_mm=goals_mm(spec), known=known)
        said += findings(case, attitude_methods(styles), others=all_cases)
    geometry = geometry_view(example, case, styles, limits=limits_of(spec), known=known)
    drawn = one_of_each(case, drawn) if case else drawn
    left_out = [s.name for s in drawn if not s.baseline][MOST_DRAWN:] if geometry else []
    drawn = [style for style in drawn if style.name not in left_out]
    first = [s for s in drawn if not s.baseline] + [s for s in drawn if s.baseline == "general purpose"]
    by_name = {style.name: style for style in drawn}
    comparisons = []
    for style in drawn:
        twin = by_name.get(style.twin)
        if style.compensated and twin:
            title = f"{style.kind}, with and without compensation"
            comparisons.append(
                (title, Markup(attitude_figure(example, [style, twin], what=f"{title}, {name}")))
            )
    nothing = Markup("")
    return RideView(
        key="ride-" + "".join(c if c.isalnum() else "-" for c in f"{name}-{example.cell.get('cell', '')}"),
        title=ride_title(example),
        facts=ride_facts(example),
        tiles=tiles(case, styles, known=known) if case else [],
        findings=said,
        speed=Markup(speed_figure(example, conditions=spec.rail_condition)),
        imu=Markup(imu_figure(example)),
        attitude=Markup(attitude_figure(example, first or drawn, what=f"Attitude, {name}"))
        if drawn
        else nothing,
        comparisons=comparisons,
        errors=Markup(error_figure(example, drawn)) if drawn else nothing,
        odometry=nothing if example.recording.odometry is None else Markup(odometry_figure(example)),
        rms=Markup(rms_figure(case, attitude_methods(styles))) if case else nothing,
        curves=Markup(curves_figure(case, attitude_methods(styles))) if case else nothing,
        geometry=geometry,
        left_out=len(left_out),
    )


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
            "profile_words": profile_words(entry["track"]),
        }
        for entry in found.values()
    ]


def _case(case: Figures, styles: list[MethodStyle], known: Mapping[str, Band]) -> CaseView:
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
        error_table(case, attitude_methods(styles), reference="truth"),
        error_table(case, attitude_methods(styles), reference="design"),
        consistency_table(case, styles),
        geometry_table(case, styles, known=known),
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
