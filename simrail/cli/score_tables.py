"""The scores as the command line shows them at the end of a run: tables of each case, and notes."""

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
from simrail.report.tables.pivot import Case, Mean, cases
from simrail.report.tables.running import decay_words, running_words
from simrail.report.words.ablations import state_words
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

MOST_GROUPS = 12


def print_scores(console: Console, results: Results) -> None:
    """Print the tables of every case, ride by ride and IMU by IMU: means over all draws."""
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
    for number, (_, members) in enumerate(shown.groupby("case", sort=True)):
        if number == MOST_GROUPS:
            console.print(f"... and {shown['case'].nunique() - number} more cases: see scores.csv")
            break
        rows = scores[scores["cell"].isin(members["cell"])]
        console.print(_case(console, rows, members, styles, bands, limit))
    if len(shown) and any(has_both(cells, one) for one in ABLATIONS):
        print_costs(console, cases(scores, cells), styles)
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
    console.print(
        f"[bold]cell {first['cell']}[/bold]: ride {first['ride']}, {first['imu']} on {first['mount']}"
    )
    columns = ["estimator", "quantity", "band", "reference", "window", "metric", "value", "unit", "status"]
    print(campaign.scores[columns].to_string(index=False, float_format=lambda value: f"{value:.9g}"))
    print_warnings(console, campaign)


def print_warnings(console: Console, campaign: CampaignResult) -> None:
    """Print what was unusual in the plan and in the rides."""
    for warning in campaign.warnings:
        console.print(f"[yellow]warning:[/yellow] {warning}", highlight=False, soft_wrap=True)


def _way(first: pd.Series) -> str:
    """Speed and direction of a ride, or how many passes there are."""
    if "passes" not in first:
        return f"{first['speed_kmh']:g} km/h {first['direction']}"
    return f"{first['passes']} passes" if first["passes"] > 1 else "one pass"


def _case(
    console: Console,
    rows: pd.DataFrame,
    members: pd.DataFrame,
    styles: list[MethodStyle],
    bands: dict[str, Band],
    derailment_limit: float,
) -> Group:
    """Title, the ride itself and rails where they are scored, attitude, and notes.

    Title and notes may be wider than a table.
    """
    first = members.iloc[0]
    draws = f"mean of {len(members)} draws" if len(members) > 1 else "one draw"
    title = Text(
        f"{first['ride']}: {_way(first)}, "
        f"{first['imu']} on {first['mount']}, odometry: {first['odometry']}, "
        f"{state_words(first.to_dict(), comma=', ')}",
        style="bold",
    )
    wanted = rows["metric"].isin(("rms", "sd", "us_per_sample")) | (rows["estimator"] == RIDE)
    shown = rows[(rows["status"] == OK) & wanted]
    of_cases = cases(shown, members)
    if not of_cases:
        return Group(title)
    case = of_cases[0]
    notes: list[str] = []
    parts: list[RenderableType] = [title]
    ride = running_words(case, derailment_limit=derailment_limit)
    if ride:
        parts.append(Text(f"The ride itself: {ride}"))
    mapping = [style for style in styles if case.get(style.name, JUDGED[0], "sd").draws]
    if mapping:
        band = judged_band(case)
        heading = f"Rails: sd of the error {waves_words(band, bands)}, mm; {draws}"
        parts += [Text(heading), _rails(console, case, mapping, band)]
        notes += _lost_rails(case, mapping, band)
    attitude = [s for s in attitude_methods(styles) if case.get(s.name, "roll", "rms").draws]
    if attitude:
        parts += [
            Text(f"Attitude: rms error, deg; {draws}"),
            _attitude(console, case, attitude, bool(mapping)),
        ]
        notes += _lost_attitude(case, attitude)
    astray = case.get(f"odometry:{first['odometry']}", "position", "rms")
    if astray.draws and first["odometry"] != "truth":
        notes.insert(0, f"the odometry's position error is {astray.value:.3g} m rms")
    if any(style.baseline for style in (*mapping, *attitude)):
        notes.insert(0, "* baseline")
    parts.append(Text("; ".join(notes), style="dim"))
    return Group(*parts)


def _rails(console: Console, case: Case, styles: list[MethodStyle], band: str) -> Table:
    """Standard deviations of the errors of those methods that say what the rails look like."""
    heads = {q: QUANTITIES[q].replace(" ", "\n").replace("cross-", "cross-\n") for q in RAILS}
    columns = [_Column(head, q, "sd", {"band": band}) for q, head in heads.items()]
    return _table(console, case, styles, columns, timed=True)


def _attitude(console: Console, case: Case, styles: list[MethodStyle], beside_rails: bool) -> Table:
    """Rms errors of the attitude; the time is told once, with the rails where there are any."""
    columns = []
    for quantity, reference, window in ATTITUDE:
        if not (beside_rails and reference == "design"):
            head = f"{quantity}\n{window}" + ("\nvs\ndesign" if reference == "design" else "")
            columns.append(_Column(head, quantity, "rms", {"window": window, "reference": reference}))
    return _table(console, case, styles, columns, timed=not beside_rails)


class _Column(NamedTuple):
    """A column of a table: its head, and which figure it holds."""

    head: str
    quantity: str
    metric: str
    where: dict[str, str]

    def mean(self, case: Case, style: MethodStyle) -> Mean:
        """Mean of a method over the draws of a case."""
        return case.get(style.name, self.quantity, self.metric, **self.where)


def _table(
    console: Console, case: Case, styles: list[MethodStyle], columns: list[_Column], *, timed: bool
) -> Table:
    """Method, figures that some method has, and time per sample; long names are folded, never cut."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("method", overflow="fold")
    # A ride without curves has no columns of them.
    filled = [column for column in columns if any(column.mean(case, style).draws for style in styles)]
    for head in [*(column.head for column in filled), *(["us per\nsample"] if timed else [])]:
        table.add_column(head, justify="right", no_wrap=True)
    for style in styles:
        means = [column.mean(case, style) for column in filled]
        time = case.get(style.name, "roll", "us_per_sample")
        table.add_row(
            f"{style.name}{' *' if style.baseline else ' (ablation)' if style.ablation else ''}",
            *(f"{mean.value:.3f}" if mean.draws else "-" for mean in means),
            *([f"{time.value:.2f}" if time.draws else "-"] if timed else []),
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
