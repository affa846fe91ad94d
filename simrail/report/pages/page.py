"""The report page: a list of sections, each of which takes what it needs of the campaign.

What it says is computed from the scores (`simrail.report.words.findings`); how it looks is in the templates.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup

from simrail.campaign.budget import OF_THE_RIDE, budget_sentence
from simrail.campaign.cell import CellResult
from simrail.campaign.stored_results import StoredResults
from simrail.core.columns import IRREGULARITY
from simrail.estimation.bibliography import citations, entries
from simrail.estimation.estimate import description_of
from simrail.report.campaign.axes import is_campaign
from simrail.report.campaign.odometry import odometry_frames, page_tables
from simrail.report.campaign.passes import passes_section
from simrail.report.campaign.section import campaign_section
from simrail.report.campaign.verdicts import budget_chart, verdicts_section
from simrail.report.figures import canvas
from simrail.report.figures.geometry import bands_figure, has_rails
from simrail.report.figures.track import plan_figure, profile_figure, profile_words
from simrail.report.pages.answer import answer_section
from simrail.report.pages.explorer import distance_figures, explorer_section
from simrail.report.pages.frame import page_text
from simrail.report.pages.section import PageData, Section
from simrail.report.papers import SECTIONS as PAPERS
from simrail.report.tables.ablations import cost_tables, pairs_of
from simrail.report.tables.geometry import (
    BAND,
    JUDGED,
    bands_of_case,
    geometry_table,
    indicator_table,
    is_zero,
    overview_table,
)
from simrail.report.tables.pivot import Case
from simrail.report.tables.provenance import facts, parts
from simrail.report.tables.running import decay_words, running_table
from simrail.report.tables.tables import consistency_table, error_table, odometry_table
from simrail.report.words.ablations import WORDS, state_words
from simrail.report.words.findings import findings
from simrail.report.words.geometry_findings import geometry_findings
from simrail.report.words.sentences import Finding, axis_words
from simrail.report.words.verdicts import imu_words, short_name
from simrail.scenario.axes import each
from simrail.scenario.build import Parts, goals_mm, limits_of
from simrail.scenario.build_estimator import odometry_estimator
from simrail.scenario.requirements import requirements_of
from simrail.scenario.scenario import Scenario
from simrail.scoring.ablations import ABLATIONS
from simrail.scoring.running_safety import TRACK_SHIFT_FACTOR
from simrail.scoring.table import EXACT_MAP, is_failure
from simrail.track.bands import BANDS, why_not
from simrail.track.design import TrackDesign

SETS_BESIDE = ("gonzalez_2023",)
"""Publications whose section can hold the results of a second scenario as well."""

MOST_TABLES = 6
"""Cases whose table is on the page; ``scores.csv`` holds all."""

BANDS_CAPTION = (
    "Standard deviation of the error by band of wavelengths; hollow: no IMU at all, whose error is the rails "
    "themselves. Strokes: one standard deviation between draws."
)

MOST_ROWS = 12
"""Rows of a table that is open at first."""


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
    progress: Callable[[str, float], None] | None = None,
) -> None:
    """Write the report of a campaign; where it has axes, its tables into a folder beside it as well.

    Parameters
    ----------
    path : Path
        The HTML file.
    scenario, scores, cells, examples, manifest, beside, budgets
        The campaign, see `PageData`.
    progress : callable, optional
        Is told what is made, and which share of it is done.
    """
    data = PageData(scenario, scores, cells, examples, manifest, beside, budgets)
    sections = sections_of(data, progress)
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
        sections=[
            (one.anchor, one.title, one.folded, Markup(page_text(one.template, **one.data)))
            for one in sections
        ],
    )
    path.write_text(text, encoding="utf-8")
    for section in sections:
        if section.write_beside is not None:
            section.write_beside(path.parent)


def sections_of(data: PageData, progress: Callable[[str, float], None] | None = None) -> list[Section]:
    """All sections of a page, in its order."""
    sections, makers = [], in_order(data)
    for done, make in enumerate(makers):
        if progress is not None:
            progress("page", done / len(makers))
        sections += make(data)
    return sections


def _section(name: str, title: str, *, folded: bool = False, **data: Any) -> Section:
    return Section(name, title, f"pages/sections/{name}.html.j2", data, folded)


def _budget(data: PageData) -> list[Section]:
    """What the error of the ride's first method is made of, where that was asked for."""
    budgets = data.budgets
    own = pd.DataFrame() if budgets is None or budgets.empty else budgets[budgets["number"] == OF_THE_RIDE]
    if own.empty:
        return []
    first = own.iloc[0]
    method = next((one.label for one in data.styles if one.name == first["estimator"]), first["estimator"])
    sentence = f"{budget_sentence(own)}, by {method} with {short_name(first['imu'])} on {first['mount']}."
    chart = canvas.drawn("budget", partial(budget_chart, own, sentence))
    return [_section("budget", "What the error is made of", sentence=sentence, chart=chart)]


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
    """What stands beside a publication; it needs the rides themselves, not what a page keeps of them."""
    name = data.scenario.spec.paper if data.stored_views is None else None
    sections = PAPERS[name](data) if name is not None else []
    return [replace(section, folded=True) for section in sections]


def _tracks(data: PageData) -> list[Section]:
    tracks: dict[str, TrackDesign] = {}
    stops: dict[str, dict[str, float]] = {}
    for example in data.examples:
        track, position = example.line, example.motion["position_m"]
        tracks.setdefault(track.name, track)
        stops.setdefault(track.name, {"start": float(position.iloc[0]), "end": float(position.iloc[-1])})
    shown = [
        (
            track,
            canvas.drawn(f"plan-{name}", partial(plan_figure, track, stops=stops[name])),
            canvas.drawn(f"profile-{name}", partial(profile_figure, track)),
            profile_words(track),
        )
        for name, track in tracks.items()
    ]
    return [_section("track", "Track", folded=len(shown) > 1, tracks=shown)] if shown else []


def _rails(data: PageData) -> list[Section]:
    table = overview_table(data.shown_cases, data.styles, known=data.bands)
    if table is None:
        return []
    return [_section("rails", "Rails", folded=True, rails=table)]


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
    folded = len(table.rows) > MOST_ROWS and not data.asks_of_ride
    return [_section("running", "Running safety and comfort", folded=folded, **shown)]


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
            sections.append(Section(f"{one.column}-costs", WORDS[one].cost, template, shown, folded=True))
    return sections


def _scores(data: PageData) -> list[Section]:
    """What the best methods err by over distance, what the scores say, and the tables of cases."""
    cases = data.shown_cases
    shown = [_case(data, case) for case in cases[:MOST_TABLES]]
    first = next(iter(cases), None)
    campaign = is_campaign(data.scenario) and len(cases) > 1
    drawings = distance_figures(data)
    if first is not None and bands_of_case(first):
        make = partial(bands_figure, first, data.styles, known=data.bands)
        if by_bands := canvas.drawn("bands", make):
            drawings.append((BANDS_CAPTION, by_bands))
    said = [] if first is None or campaign else _said(data, first)
    words = {
        "cases": shown,
        "drawings": drawings,
        "findings": said,
        "rows": len(data.scores),
        "cases_left_out": max(len(cases) - MOST_TABLES, 0),
        "opened": not campaign,
        "indicators": _indicators(data),
    }
    return [Section("scores", "Errors and scores", "pages/sections/scores.html.j2", words)]


def _indicators(data: PageData) -> dict[str, Any] | None:
    """Indicators of track quality of the first ride that is long enough for them, by the best method."""
    limits = limits_of(data.scenario.spec)
    ranked = data.leading or data.styles
    for example in data.examples:
        mapped = (s for s in [*ranked, *data.styles] if not is_zero(s) and has_rails(example, s))
        style = next(mapped, None)
        geometry = example.estimates[style.name].geometry if style else None
        if style is None or geometry is None or example.rails is None:
            continue
        places = geometry.index.to_numpy(dtype="float64")
        step, band = float(places[1] - places[0]), BANDS[BAND]
        if any(why_not(band.edges_m(q), count=len(places), step_m=step) for q in JUDGED):
            continue
        truth = example.rails.irregularities(places)[list(IRREGULARITY)].set_index(geometry.index)
        table = indicator_table(truth, geometry, limits=limits, band=band)
        ride = example.recording.name
        return {"table": table, "method": style.label, "ride": ride, "limits": limits, "band": BAND}
    return None


def _said(data: PageData, case: Case) -> list[Finding]:
    """What the scores of a case say; where rails are scored, they are what the ride was for."""
    goals = goals_mm(data.scenario.spec)
    return [
        *geometry_findings(case, data.styles, data.cases, goals_mm=goals, known=data.bands),
        *findings(case, data.attitude_styles, others=data.cases),
    ]


def _case(data: PageData, case: Case) -> dict[str, Any]:
    """The tables of one case."""
    labels = case.labels
    title = [
        labels["ride"],
        f"IMU {imu_words(labels)}",
        f"odometry {labels['odometry']}",
    ]
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
    cases = data.shown_cases
    table = odometry_table(cases[:MOST_ROWS])
    # A campaign has them in a section of its own.
    frames = {} if is_campaign(data.scenario) else odometry_frames(data.scores, data.cells)
    left_out = max(len(cases) - MOST_ROWS, 0)
    shown = {"odometry": table, "over_all": page_tables(frames), "cases_left_out": left_out}
    folded = len(table.rows) > 1
    return [_section("odometry", "Odometry", folded=folded, **shown)] if table.rows else []


def _words(data: PageData) -> list[Section]:
    geometry = data.scenario.spec.geometry
    bands = [data.bands[name] for name in (*geometry.bands, *geometry.own_bands)]
    shown = {"scenario": data.scenario, "bands": bands, "rails": bool(_rails(data))}
    return [_section("words", "Words of this page", folded=True, **shown)]


def _parts(data: PageData) -> list[Section]:
    rows = parts(data.scenario, data.cells, data.examples)
    return [_section("parts", "Parts and sources", folded=True, parts=rows)]


def _cite(data: PageData) -> list[Section]:
    """What the methods rest on, with BibTeX to copy."""
    told = {name: description_of(one).cites for name, one in Parts(data.scenario).estimators(0).items()}
    for name in each(data.scenario.spec.odometry):
        odometry = odometry_estimator(data.scenario, name)
        if odometry is not None:
            told[f"odometry {name}"] = description_of(odometry).cites
    shown = {"citations": citations(told.items()), "bibtex": entries(told.values())}
    return [_section("cite", "Cite the methods", folded=True, **shown)]


def _again(data: PageData) -> list[Section]:
    lines = facts(data.manifest)
    return [_section("again", "Make it again", scenario=data.scenario, manifest=data.manifest, facts=lines)]


SectionMaker = Callable[[PageData], list[Section]]
"""Makes sections of a campaign."""

SECTIONS: tuple[SectionMaker, ...] = (
    verdicts_section,
    _budget,
    _failures,
    _scores,
    campaign_section,
    explorer_section,
    _paper,
    passes_section,
    _tracks,
    _rails,
    _running,
    _ablations,
    _odometry,
    _words,
    _parts,
    _cite,
    _again,
)
"""What the page holds after its answer, in its order; what has nothing to show makes no section."""


def in_order(data: PageData) -> list[SectionMaker]:
    """The parts of the page: the answer first, which is a verdict where the scenario has requirements.

    Where the ride itself is asked for, its figures come before what attitudes err by.
    """
    first = [] if requirements_of(data.scenario.spec) else [answer_section]
    if not data.asks_of_ride:
        return [*first, *SECTIONS]
    after = SECTIONS.index(_tracks) + 0.5
    places: dict[SectionMaker, float] = {
        _budget: -3,
        _failures: -2,
        _running: -1,
        _scores: after,
        campaign_section: after,
    }
    return [*first, *sorted(SECTIONS, key=lambda make: places.get(make, SECTIONS.index(make)))]
