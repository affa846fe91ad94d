"""The scores as the command line shows them at the end of a run: tables, and notes.

A few cases have a table each. Of many, those of one vehicle, IMU and odometry share one, which has the least
and the most of their means: an average over unlike rides would say nothing.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import pandas as pd
from rich import box
from rich.console import Console, Group, RenderableType
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from simrail.campaign.result import CampaignResult
from simrail.cli.ablation_tables import print_costs, print_odometries
from simrail.cli.verdict_tables import print_verdicts
from simrail.report.campaign.odometry import odometry_frames
from simrail.report.tables.geometry import (
    JUDGED,
    QUANTITIES,
    baseline_of,
    behind_baseline,
    judged_band,
    waves_words,
)
from simrail.report.tables.methods import MethodStyle, attitude_methods, method_styles
from simrail.report.tables.pivot import CASE_COLUMNS, Case, cases
from simrail.report.tables.running import decay_words, running_words
from simrail.report.words.ablations import state_words
from simrail.report.words.verdicts import short_name
from simrail.results import Results
from simrail.scenario.build import bands_by_name
from simrail.scoring.ablations import ABLATIONS, has_both, without_ablations
from simrail.scoring.ride_figures import RIDE
from simrail.scoring.running_safety import DERAILMENT_LIMIT
from simrail.scoring.table import OK
from simrail.track.bands import Band

ATTITUDE = tuple(
    (quantity, reference, window)
    for quantity in ("roll", "pitch")
    for reference, window in (("truth", "whole"), ("truth", "curve"), ("design", "curve"))
)
"""Columns of the attitude. Beside rails, those against the design are left out: the design is no goal."""

RAILS = (*JUDGED, "gauge")
"""Columns of the rails."""

WIDEST = 80
"""Characters of a line that a table keeps to, however wide the terminal is."""

MOST_TABLES = 3
"""Cases that have a table each, and tables of more."""

MOST_NAMES = 3
"""Rides of a shared table that are told by name."""


def print_scores(console: Console, results: Results) -> None:
    """Print means over all draws: of each case where they are few, else what those of an IMU lie between."""
    campaign = results.campaign
    scores, cells = campaign.scores, campaign.cells
    styles = list(method_styles(results.scenario).values())
    bands = bands_by_name(results.scenario.spec)
    safety = results.scenario.spec.running_safety
    limit = DERAILMENT_LIMIT if safety is None else safety.derailment_limit
    odometries = odometry_frames(scores, cells)
    # Of odometries alone their own table says all; what ablations would change stands in others.
    shown = without_ablations(cells)
    alone = bool(odometries) and all(style.baseline for style in styles)
    # Where something is asked for, the answer stands in place of the means.
    verdicts = campaign.verdicts
    shown = shown[:0] if alone or len(verdicts) else shown
    print_verdicts(console, verdicts, styles)
    tables, vehicles = _members(shown), shown["vehicle"].nunique()
    for members in tables[:MOST_TABLES]:
        rows = scores[scores["cell"].isin(members["cell"])]
        parts = _cases(console, rows, members, styles, bands, limit)
        console.print(Group(Text(_title(members, with_vehicle=vehicles > 1), style="bold"), *parts))
    if len(tables) > MOST_TABLES:
        console.print(f"... and {len(tables) - MOST_TABLES} more tables: see the report, or scores.csv")
    if len(shown) and any(has_both(cells, one) for one in ABLATIONS):
        if shown["case"].nunique() <= MOST_TABLES:
            print_costs(console, cases(scores, cells), styles)
        else:
            console.print(Text("What the ablations change stands in the report.", style="dim"))
    print_odometries(console, odometries, by_class=alone)
    kicks = scores[(scores["estimator"] == RIDE) & (scores["status"] == OK)]
    for sentence in decay_words(cases(kicks, cells)):
        console.print(Text(sentence), soft_wrap=True)
    if campaign.stopped is not None:
        # What was not reached is to be seen; what was, is no less than what was asked for.
        colour = "green" if campaign.stopped.reached else "yellow"
        console.print(Text(campaign.stopped.words, style=colour), soft_wrap=True)
    print_warnings(console, campaign)
    reasons = list(dict.fromkeys((failure.estimator, failure.reason) for failure in campaign.failures))
    for estimator, reason in reasons[:10]:
        console.print(f"[red]failed:[/red] {estimator}: {reason}", highlight=False)
    wall = results.manifest["wall_s"]
    factor = results.manifest["real_time_factor"]
    speed = f", engine at {factor:.1f} x real time" if factor else ""
    console.print(
        f"{wall['total']:.1f} s{speed}. Report: {results.folder / 'report.html'}",
        highlight=False,
        soft_wrap=True,
    )


def print_cell(console: Console, campaign: CampaignResult) -> None:
    """Print every score of one cell."""
    first = campaign.cells.iloc[0]
    where = f"ride {first['ride']}, {short_name(first['imu'])} on {first['mount']}"
    console.print(f"[bold]cell {first['cell']}[/bold]: {where}")
    columns = ["estimator", "quantity", "band", "reference", "window", "metric", "value", "unit", "status"]
    print(campaign.scores[columns].to_string(index=False, float_format=lambda value: f"{value:.9g}"))
    print_warnings(console, campaign)


def print_warnings(console: Console, campaign: CampaignResult) -> None:
    """Print what was unusual in the plan and in the rides."""
    for warning in campaign.warnings:
        console.print(f"[yellow]warning:[/yellow] {warning}", highlight=False, soft_wrap=True)


def _members(cell_table: pd.DataFrame) -> list[pd.DataFrame]:
    """Cells of each table: of a case, or where these are many of all that share vehicle, IMU and odometry."""
    few = cell_table["case"].nunique() <= MOST_TABLES
    shared = ["case"] if few else [name for name in CASE_COLUMNS if name != "ride"]
    return [members for _, members in cell_table.groupby(shared, sort=few, observed=True, dropna=False)]


def _title(members: pd.DataFrame, *, with_vehicle: bool) -> str:
    """Which rides, on which mount, and what the train knows."""
    first = members.iloc[0]
    rides = list(dict.fromkeys(members["ride"]))
    more = f" and {len(rides) - MOST_NAMES} more" if len(rides) > MOST_NAMES else ""
    mount = f"{first['mount']} of {first['vehicle']}" if with_vehicle else first["mount"]
    return (
        f"{', '.join(rides[:MOST_NAMES])}{more}: {_way(members)}, {short_name(first['imu'])} on {mount}, "
        f"odometry: {first['odometry']}, {state_words(first.to_dict(), comma=', ')}"
    )


def _way(members: pd.DataFrame) -> str:
    """Speed and direction, or how many passes there are."""
    if "passes" in members:
        passes = members["passes"]
        return f"{_span(passes, 'g')} passes" if passes.max() > 1 else "one pass"
    directions = list(dict.fromkeys(members["direction"]))
    way = directions[0] if len(directions) == 1 else "both ways"
    return f"{_span(members['speed_kmh'], '.3g')} km/h {way}"


def _span(values: Iterable[float], form: str, *, between: str = " to ") -> str:
    """The least and the most of values, once where they look alike; "" for none."""
    known = list(values)
    ends = (min(known), max(known)) if known else ()
    return between.join(dict.fromkeys(f"{end:{form}}" for end in ends))


def _cases(
    console: Console,
    rows: pd.DataFrame,
    members: pd.DataFrame,
    styles: list[MethodStyle],
    bands: dict[str, Band],
    derailment_limit: float,
) -> list[RenderableType]:
    """The ride itself and rails where they are scored, attitude, and notes, which may be wider."""
    parts: list[RenderableType] = []
    wanted = rows["metric"].isin(("rms", "sd", "us_per_sample")) | (rows["estimator"] == RIDE)
    every = cases(rows[(rows["status"] == OK) & wanted], members)
    if not every:
        return parts
    alone = every[0] if len(every) == 1 else None
    each = len(members) // len(every)
    draws = f"mean of {each} draws" if each > 1 else "one draw"
    what = draws if alone else f"least and most of {len(every)} kinds of ride, {draws}"
    notes: list[str] = []
    ride = running_words(alone, derailment_limit=derailment_limit) if alone else ""
    if ride:
        parts.append(Text(f"The ride itself: {ride}"))
    mapping = [s for s in styles if any(case.get(s.name, JUDGED[0], "sd").draws for case in every)]
    if mapping:
        band = judged_band(every[0])
        parts.append(Text(f"Rails: sd of the error {waves_words(band, bands)}, mm; {what}"))
        parts.append(_rails(console, every, mapping, band))
        notes += _lost_rails(alone, mapping, band) if alone else []
    attitude = [
        s for s in attitude_methods(styles) if any(case.get(s.name, "roll", "rms").draws for case in every)
    ]
    if attitude:
        parts.append(Text(f"Attitude: rms error, deg; {what}"))
        parts.append(_attitude(console, every, attitude, bool(mapping)))
        notes += _lost_attitude(alone, attitude) if alone else []
    notes = [*_baselines([*mapping, *attitude]), *_astray(every), *notes]
    return [*parts, Text("; ".join(notes), style="dim")]


def _baselines(styles: list[MethodStyle]) -> list[str]:
    return ["* baseline"] if any(style.baseline for style in styles) else []


def _astray(every: Sequence[Case]) -> list[str]:
    """By how much the odometry is off, unless it is the truth."""
    name = every[0].labels["odometry"]
    astray = [case.get(f"odometry:{name}", "position", "rms") for case in every]
    known = [mean.value for mean in astray if mean.draws]
    if not known or name == "truth":
        return []
    return [f"the odometry's position error is {_span(known, '.3g')} m rms"]


def _rails(console: Console, every: Sequence[Case], styles: list[MethodStyle], band: str) -> Table:
    """Standard deviations of the errors of those methods that say what the rails look like."""
    heads = {q: QUANTITIES[q].replace(" ", "\n").replace("cross-", "cross-\n") for q in RAILS}
    columns = [_Column(head, q, "sd", {"band": band}) for q, head in heads.items()]
    return _table(console, every, styles, columns, timed=len(every) == 1)


def _attitude(
    console: Console, every: Sequence[Case], styles: list[MethodStyle], beside_rails: bool
) -> Table:
    """Rms errors of the attitude; the time is told once, with the rails where there are any."""
    columns = []
    for quantity, reference, window in ATTITUDE:
        # Against the design nothing is told beside rails, nor where each figure is two.
        if reference == "truth" or (len(every) == 1 and not beside_rails):
            head = f"{quantity}\n{window}" + ("\nvs\ndesign" if reference == "design" else "")
            columns.append(_Column(head, quantity, "rms", {"window": window, "reference": reference}))
    return _table(console, every, styles, columns, timed=len(every) == 1 and not beside_rails)


class _Column(NamedTuple):
    """A column of a table: its head, and which figure it holds."""

    head: str
    quantity: str
    metric: str
    where: dict[str, str]

    def words(self, every: Sequence[Case], style: MethodStyle, *, digits: int = 3) -> str:
        """Mean of a method over the draws of a case, or what those of several lie between; "-" for none."""
        means = [case.get(style.name, self.quantity, self.metric, **self.where) for case in every]
        return _span((m.value for m in means if m.draws), f".{digits}f", between="\u2013") or "-"


def _table(
    console: Console, every: Sequence[Case], styles: list[MethodStyle], columns: list[_Column], *, timed: bool
) -> Table:
    """Method, figures that some method has, and time per sample; long names are folded, never cut."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("method", overflow="fold")
    # A ride without curves has no columns of them.
    filled = [c for c in columns if any(c.words(every, style) != "-" for style in styles)]
    for head in [*(column.head for column in filled), *(["us per\nsample"] if timed else [])]:
        table.add_column(head, justify="right", no_wrap=True)
    time = _Column("", "roll", "us_per_sample", {})
    for style in styles:
        table.add_row(
            f"{style.name}{' *' if style.baseline else ' (ablation)' if style.ablation else ''}",
            *(column.words(every, style) for column in filled),
            *([time.words(every, style, digits=2)] if timed else []),
            style="dim" if style.baseline else None,
        )
    if Measurement.get(console, console.options, table).maximum > WIDEST:
        table.width = WIDEST
    return table


def _lost_rails(case: Case, styles: list[MethodStyle], band: str) -> list[str]:
    """What rails that lie as designed know better than a method, by quantity."""
    floor, lost = baseline_of(case, styles), []
    for quantity in RAILS:
        worse = [style.name for style in behind_baseline(case, styles, quantity, band=band)]
        if worse:
            lost.append(f"in {QUANTITIES[quantity]} than {', '.join(worse)}")
    return [f"{floor.name}, which uses no IMU, errs less {' and '.join(lost)}"] if floor and lost else []


def _lost_attitude(case: Case, styles: list[MethodStyle]) -> list[str]:
    """Which methods err more in roll in curves than the design angles do."""
    floor = next((style for style in styles if not style.uses_imu), None)
    if floor is None:
        return []
    least = case.get(floor.name, "roll", "rms", window="curve").value
    beaten = [
        s.name for s in styles if s.uses_imu and case.get(s.name, "roll", "rms", window="curve").value > least
    ]
    note = f"{floor.name}, which uses no IMU, has the smaller roll error in curves than {', '.join(beaten)}"
    return [note] if beaten else []
