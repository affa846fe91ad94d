"""Verdicts as the command line shows them."""

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import pandas as pd
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from simrail.campaign.budget import budget_sentence
from simrail.report.campaign.verdicts import LEAST_SHARE, groups_of
from simrail.report.tables.methods import MethodStyle, method_styles
from simrail.report.tables.tables import signed
from simrail.report.words.verdicts import (
    best_method,
    devices_words,
    judged_methods,
    share_words,
    short_name,
    verdict_sentence,
)
from simrail.results import Results
from simrail.scenario.cells import first_cells
from simrail.scenario.requirements import requirements_of
from simrail.scoring.share import ENOUGH, NOT_ENOUGH, UNDECIDED
from simrail.scoring.verdicts import imu_pairs

_COLOURS = {ENOUGH: "green", NOT_ENOUGH: "red"}


def print_verdicts(console: Console, verdicts: pd.DataFrame, styles: Sequence[MethodStyle]) -> None:
    """Print each requirement at each mount: a sentence, and a table of IMUs by methods."""
    for _, _, _, rows in groups_of(verdicts):
        console.print()
        console.print(Text(verdict_sentence(rows, styles), style="bold"), soft_wrap=True)
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
        table.add_column("IMU", no_wrap=True)
        methods = judged_methods(rows, styles)
        for style in methods:
            table.add_column(style.label, overflow="fold")
        for imu, own in rows.groupby("imu", sort=False):
            cells = [_cell(own[own["estimator"] == style.name]) for style in methods]
            table.add_row(short_name(imu), *cells)
        console.print(table)
        console.print(Text(devices_words(rows), style="dim"), soft_wrap=True)


def print_budgets(console: Console, budgets: pd.DataFrame) -> None:
    """Print what errors are made of, one table for each IMU, mount and requirement."""
    if budgets.empty:
        return
    for _, own in budgets.groupby(["number", "vehicle", "mount", "imu"], sort=False):
        first = own.iloc[0]
        console.print()
        words = f"{budget_sentence(own)}, {short_name(first['imu'])} on the {first['mount']}"
        console.print(Text(words, style="bold"))
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
        for title in ("what", "share of the square", "95 %"):
            table.add_column(title, justify="left" if title == "what" else "right")
        for row in own[(own["share"].abs() >= LEAST_SHARE)].to_dict("records"):
            ends = f"{100.0 * row['low95']:.1f} to {100.0 * row['high95']:.1f}"
            table.add_row(row["words"], f"{100.0 * row['share']:.1f} %", ends)
        console.print(table)


def print_coarsest(console: Console, results: Results) -> None:
    """Print the coarsest IMU that is enough, by the bias instability of its gyro, for each requirement."""
    grades = {
        cell.imu.grade: results.campaign.plan.parts.grade(cell) for cell in first_cells(results.scenario)
    }
    styles = list(method_styles(results.scenario).values())
    for _, _, mount, rows in groups_of(results.campaign.verdicts):
        best = best_method(rows, styles)
        own = rows[rows["estimator"] == best.name] if best is not None else rows[:0]
        enough = own.loc[own["verdict"] == ENOUGH, "imu"].astype(str).unique()
        coarsest = max(enough, key=lambda imu: grades[imu].gyro_bias_instability_radps, default=None)
        if coarsest is not None:
            words = f"{short_name(coarsest)} is the coarsest that is enough"
        else:
            words = _none_enough(own)
        console.print(
            f"{rows['requirement'].iloc[0]}, on the {mount}: {words}", highlight=False, soft_wrap=True
        )


def _none_enough(verdicts: pd.DataFrame) -> str:
    """Where no IMU is enough: whether that is known, or open for want of devices."""
    undecided = verdicts[verdicts["verdict"] == UNDECIDED]
    if undecided.empty:
        return "none of these is enough"
    names = ", ".join(map(short_name, undecided["imu"].astype(str).unique()))
    return f"open for {names}: {undecided['devices'].max()} devices do not show it, take more (--devices)"


MOST_COMPARED = 3
"""IMUs of which each pair is told; of more, verdicts say enough."""


def print_pairs(console: Console, results: Results) -> None:
    """Print which of two IMUs errs less on the same rides, by each method under test."""
    campaign = results.campaign
    pairs = imu_pairs(campaign.scores, campaign.cells, requirements_of(results.scenario.spec))
    if pairs.empty or len({*pairs["first"], *pairs["second"]}) > MOST_COMPARED:
        return
    styles = method_styles(results.scenario).values()
    labels = {style.name: style.label for style in styles if style.uses_imu and not style.baseline}
    for wanted, own in pairs[pairs["estimator"].isin(list(labels))].groupby("requirement", sort=False):
        console.print()
        words = f"{str(wanted).partition(' ')[0]}: which IMU errs less, on the same rails with the same map"
        console.print(Text(words, style="bold"), soft_wrap=True)
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
        for title in ("mount", "method", "errs less", "on"):
            table.add_column(title, no_wrap=title == "mount")
        table.add_column(f"by, mean, {own['unit'].iloc[0]}", justify="right")
        for row in own.to_dict("records"):
            table.add_row(row["mount"], labels[row["estimator"]], *pair_words(row))
        console.print(table)


def pair_words(pair: Mapping[Hashable, Any]) -> tuple[str, str, str]:
    """Which of a pair errs less, or that it is open; on how many rides, and by how much with its interval."""
    first_is_better = pair["difference"] < 0.0
    better = short_name(pair["first"] if first_is_better else pair["second"])
    won = pair["won"] if first_is_better else pair["pairs"] - pair["won"]
    ends = (-pair["high95"], -pair["low95"]) if first_is_better else (pair["low95"], pair["high95"])
    told = better if ends[0] > 0.0 else f"open; in the mean {better}"
    by = f"{abs(pair['difference']):.4f} ({signed(f'{ends[0]:.4f}')} to {ends[1]:.4f})"
    return told, f"{won} of {pair['pairs']}", by


def _cell(rows: pd.DataFrame) -> Text:
    """The verdict of an IMU with a method; of several kinds of rides, the one that fewest devices meet."""
    if rows.empty:
        return Text("")
    worst = rows.sort_values("share", na_position="first").iloc[0]
    return Text(share_words(worst), style=_COLOURS.get(worst["verdict"], "yellow"))
