"""The report page: a list of sections, each of which takes what it needs of the campaign.

What it says is computed from the scores (`simrail.report.words.findings`); how it looks is in the templates.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup

from simrail.campaign.cell import CellResult
from simrail.campaign.stored_results import StoredResults
from simrail.report.campaign.axes import is_campaign
from simrail.report.campaign.odometry import odometry_frames, page_tables
from simrail.report.campaign.passes import passes_section
from simrail.report.campaign.section import campaign_section
from simrail.report.campaign.verdicts import verdicts_section
from simrail.report.figures.track import plan_figure, profile_figure, profile_words
from simrail.report.pages.frame import page_text
from simrail.report.pages.ride import ride_sections
from simrail.report.pages.section import PageData, Section
from simrail.report.papers import SECTIONS as PAPERS
from simrail.report.tables.ablations import cost_tables, pairs_of
from simrail.report.tables.geometry import geometry_table, overview_table
from simrail.report.tables.pivot import Case
from simrail.report.tables.provenance import facts, parts
from simrail.report.tables.running import decay_words, running_table
from simrail.report.tables.tables import consistency_table, error_table, odometry_table
from simrail.report.words.ablations import WORDS, state_words
from simrail.report.words.sentences import axis_words
from simrail.scenario.scenario import Scenario
from simrail.scoring.ablations import ABLATIONS
from simrail.scoring.running_safety import TRACK_SHIFT_FACTOR
from simrail.scoring.table import EXACT_MAP, is_failure
from simrail.track.design import TrackDesign

SETS_BESIDE = ("gonzalez_2023",)
"""Publications whose section can hold the results of a second scenario as well."""

MOST_TABLES = 24
"""Cases whose table is on the page; ``scores.csv`` holds all."""


def write_report(
    path: Path,
    *,
    scenario: Scenario,
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    examples: Sequence[CellResult],
    manifest: Mapping[str, Any],
    beside: StoredResults | None = None,
    budgets: pd.DataFrame | None = None,
) -> None:
    """Write the report of a campaign; where it has axes, its tables into a folder beside it as well.

    Parameters
    ----------
    path : Path
        The HTML file.
    scenario, scores, cells, examples, manifest, beside, budgets
        The campaign, see `PageData`.
    """
    data = PageData(scenario, scores, cells, examples, manifest, beside, budgets)
    sections = [section for make in in_order(data) for section in make(data)]
    spec = scenario.spec.monte_carlo
    text = page_text(
        "pages/page.html.j2",
        scenario=scenario,
        manifest=manifest,
        parts=parts(scenario, cells, examples),
        methods=len(data.styles),
        draws=(spec.track_draws, spec.sensor_draws),
        ride_count=cells["ride"].nunique(),
        imus=scores["mount"].nunique(),
        grades=scores["imu"].nunique(),
        contents=[(section.anchor, section.title) for section in sections],
        sections=[(one.anchor, one.title, Markup(page_text(one.template, **one.data))) for one in sections],
    )
    path.write_text(text, encoding="utf-8")
    for section in sections:
        if section.write_beside is not None:
            section.write_beside(path.parent)


def _section(name: str, title: str, **data: Any) -> Section:
    return Section(name, title, f"pages/sections/{name}.html.j2", data)


def _failures(data: PageData) -> list[Section]:
    """What has no value: method, IMU, reason, figures; what cannot have one is left out."""
    scores = data.scores
    failed = scores[is_failure(scores)]
    if failed.empty:
        return []
    # One line per kind of fault: how many samples of a window it hit is in the table itself.
    reason = failed["status"].astype(str).str.replace(r" in \d+ of \d+ samples", "", regex=True)
    counted = failed.assign(reason=reason).groupby(["estimator", "imu", "reason"], observed=True).size()
    listed = counted.reset_index(name="figures")[["estimator", "imu", "figures", "reason"]]
    rows = list(listed.itertuples(index=False, name=None))
    return [_section("failures", "What failed", failures=rows)]


def _paper(data: PageData) -> list[Section]:
    """What stands beside a publication."""
    name = data.scenario.spec.paper
    return PAPERS[name](data) if name is not None else []


def _tracks(data: PageData) -> list[Section]:
    tracks: dict[str, TrackDesign] = {}
    stops: dict[str, dict[str, float]] = {}
    for example in data.examples:
        track, position = example.line, example.motion["position_m"]
        tracks.setdefault(track.name, track)
        stops.setdefault(track.name, {"start": float(position.iloc[0]), "end": float(position.iloc[-1])})
    shown = [
        (track, plan_figure(track, stops=stops[name]), profile_figure(track), profile_words(track))
        for name, track in tracks.items()
    ]
    return [_section("track", "Track", tracks=shown)]


def _rails(data: PageData) -> list[Section]:
    table = overview_table(data.shown_cases, data.styles, known=data.bands)
    return [_section("rails", "Rails", rails=table)] if table is not None else []


def _running(data: PageData) -> list[Section]:
    """What the ride itself was like."""
    spec = data.scenario.spec
    safety = spec.running_safety
    table = running_table(data.shown_cases, derailment_limit=data.derailment_limit)
    if table is None:
        return []
    factor = 1.0 if safety is None else TRACK_SHIFT_FACTOR[safety.vehicle]
    shown = {
        "running": table,
        "safety": safety,
        "factor": factor,
        "comfort": spec.ride_comfort is not None,
        "kicks": decay_words(data.cases),
    }
    return [_section("running", "Running safety and comfort", **shown)]


def _ablations(data: PageData) -> list[Section]:
    """What the scores are with what a train has, and with each ablation beside it."""
    sections = []
    for one in ABLATIONS:
        groups = [
            (group.title, cost_tables(group, data.attitude_styles, data.styles))
            for group in pairs_of(data.cases, one)[:MOST_TABLES]
        ]
        groups = [group for group in groups if group[1]]
        if groups:
            shown = {"groups": groups, "legend": WORDS[one].legend, "own": WORDS[one].title[0]}
            template = "pages/sections/ablation.html.j2"
            sections.append(Section(f"{one.column}-costs", WORDS[one].cost, template, shown))
    return sections


def _scores(data: PageData) -> list[Section]:
    shown = [_case(data, case) for case in data.shown_cases[:MOST_TABLES]]
    left_out = max(len(data.shown_cases) - MOST_TABLES, 0)
    return [_section("scores", "Scores", cases=shown, rows=len(data.scores), cases_left_out=left_out)]


def _case(data: PageData, case: Case) -> dict[str, Any]:
    """The tables of one case."""
    labels = case.labels
    title = [labels["ride"], f"IMU {labels['mount']} ({labels['imu']})", f"odometry {labels['odometry']}"]
    title.append(state_words(labels))
    axes = [axis_words(*axis) for axis in case.axes.items()]
    tracks, draws = int(case.table["track_draws"].max()), int(case.table["draws"].max())
    maps = data.scenario.spec.monte_carlo.map_draws if labels["map"] != EXACT_MAP else 1
    of_maps = " and of the map" * (maps > 1)
    words = f"mean \u00b1 standard deviation between {draws} draws of the sensors{of_maps}"
    return {
        "title": " \u00b7 ".join([*title, *axes]),
        "draws": (words if draws > 1 else "one draw") + f" over {tracks} draws of the track" * (tracks > 1),
        "truth": error_table(case, data.attitude_styles, reference="truth"),
        "design": error_table(case, data.attitude_styles, reference="design"),
        "consistency": consistency_table(case, data.styles),
        "geometry": geometry_table(case, data.styles, known=data.bands),
    }


def _odometry(data: PageData) -> list[Section]:
    table = odometry_table(data.cases[:MOST_TABLES])
    # A campaign has them in a section of its own.
    frames = {} if is_campaign(data.scenario) else odometry_frames(data.scores, data.cells)
    shown = {"odometry": table, "over_all": page_tables(frames)}
    return [_section("odometry", "Odometry", **shown)] if table.rows else []


def _words(data: PageData) -> list[Section]:
    geometry = data.scenario.spec.geometry
    bands = [data.bands[name] for name in (*geometry.bands, *geometry.own_bands)]
    shown = {"scenario": data.scenario, "bands": bands, "rails": bool(_rails(data))}
    return [_section("words", "Words of this page", **shown)]


def _parts(data: PageData) -> list[Section]:
    rows = parts(data.scenario, data.cells, data.examples)
    return [_section("parts", "Parts and sources", parts=rows)]


def _again(data: PageData) -> list[Section]:
    lines = facts(data.manifest)
    return [_section("again", "Make it again", scenario=data.scenario, manifest=data.manifest, facts=lines)]


SectionMaker = Callable[[PageData], list[Section]]
"""Makes sections of a campaign."""

SECTIONS: tuple[SectionMaker, ...] = (
    verdicts_section,
    _failures,
    _paper,
    passes_section,
    campaign_section,
    ride_sections,
    _tracks,
    _rails,
    _running,
    _ablations,
    _scores,
    _odometry,
    _words,
    _parts,
    _again,
)
"""What the page holds, in its order; a function that has nothing to show makes no section."""


def in_order(data: PageData) -> list[SectionMaker]:
    """The parts of the page; where the ride itself is asked for, its figures before what attitudes err by."""
    if not data.asks_of_ride:
        return list(SECTIONS)
    places: dict[SectionMaker, int] = {_failures: -2, _running: -1, campaign_section: SECTIONS.index(_scores)}
    return sorted(SECTIONS, key=lambda make: places.get(make, SECTIONS.index(make)))
