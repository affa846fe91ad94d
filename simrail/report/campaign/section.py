"""The section itself: tables and figures over the axes of a campaign, gathered for the template."""

import re
import shlex
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from simrail.campaign.cell import CellResult
from simrail.report.campaign.axes import (
    CampaignAxis,
    beside_ablations,
    campaign_axes,
    draws_of,
    finest,
    held,
    is_campaign,
)
from simrail.report.campaign.figures import box_figure, curvature_figure
from simrail.report.campaign.heat import Side, heat_maps, rails_figures, side_of
from simrail.report.campaign.odometry import odometry_frames, page_tables
from simrail.report.campaign.tables import HEADLINES, campaign_tables, write_tables
from simrail.report.figures import canvas
from simrail.report.pages.section import PageData, Section
from simrail.report.tables.methods import MethodStyle, readable
from simrail.report.tables.tables import NONE, Cell, Row, Table, method_row, number_cell, signed
from simrail.report.words.ablations import WORDS
from simrail.report.words.sentences import listed
from simrail.scoring.ablations import ABLATIONS, has_both, without_ablations
from simrail.scoring.table import CURVE_PREFIX, EVERY_CURVE

MOST_METHODS = 8
"""Methods that are drawn: those under test first."""

MOST_GROUPS = 6
"""IMUs and mounts with tables of their own on the page; the files hold all."""

MOST_MAPS = 6
"""Axes whose values are mapped."""

MOST_BOXES = 6
"""Axes along which the spread is drawn."""


def campaign_section(data: PageData) -> list[Section]:
    """Make the section; none for a scenario without lists, or whose methods say nothing of roll.

    Rails, where a method says what they look like, come first, in the band that most cases are judged in.
    """
    scores, cells, styles = data.scores, data.cells, data.attitude_styles
    axes = campaign_axes(cells) if is_campaign(data.scenario) else []
    if not axes or not (scores["quantity"] == "roll").any():
        return []
    # What stands beside a run has no part in one of its cells.
    command = str(data.manifest.get("command", data.scenario.command))
    words = shlex.split(command)
    if words[-2:-1] == ["--beside"]:
        command = command.removesuffix(f" --beside {shlex.quote(words[-1])}")
    tables = campaign_tables(scores, cells, axes, styles, command=command)
    odometries = odometry_frames(scores, cells)
    if tables["methods"].empty:
        return []
    by_name = {style.name: style for style in data.styles}
    kept = without_ablations(cells)
    rails = rails_figures(
        scores[scores["cell"].isin(kept["cell"])],
        kept,
        beside_ablations(axes),
        data.styles,
        band=data.judged_band,
        known=data.bands,
    )
    shown = {
        "axes": [(axis.title, ", ".join(axis.words)) for axis in axes],
        "cells": len(cells),
        "ablations": [
            (WORDS[one].title[0], one.column, WORDS[one].cost) for one in ABLATIONS if has_both(cells, one)
        ],
        "tracks": int(tables["methods"]["tracks"].max()),
        "rails": rails,
        "odometry": page_tables(odometries),
        # Where no method is under test, the odometry is what the campaign is about.
        "odometry_first": all(style.baseline for style in styles),
        "groups": [
            (
                words or "Methods",
                _methods_table(_of(tables["methods"], words), by_name),
                _pairs_table(_of(tables["pairs"], words), by_name),
                _consistency_table(_of(tables["consistency"], words), by_name),
            )
            for words in _real_first(tables["methods"]["of"])[:MOST_GROUPS]
        ],
        "groups_left_out": max(tables["methods"]["of"].nunique() - MOST_GROUPS, 0),
        "worst": [
            (
                readable(row["method"]),
                f"{row['rms_roll_deg']:.3f}\u00b0",
                " \u00b7 ".join(f"{axis.name} {row[axis.title]}" for axis in beside_ablations(axes)),
                row["command"],
            )
            for row in tables["worst"].to_dict("records")
        ],
        **_drawings(data, axes),
    }
    title, template = "The campaign as a whole", "campaign/section.html.j2"
    write = partial(write_tables, tables=tables | odometries)
    return [Section("campaign", title, template, shown, write_beside=write)]


def _drawings(data: PageData, axes: Sequence[CampaignAxis]) -> dict[str, Any]:
    """Maps of the roll error over axes, its spread along each, and over curvature, with captions.

    What somebody chooses, as the IMU, is held at one value in all that does not show it.
    """
    styles = sorted(data.attitude_styles, key=lambda style: bool(style.baseline))[:MOST_METHODS]
    muted = {style.label for style in styles if style.baseline}
    of_all = draws_of(data.scores, data.cells, axes)
    roll, curves = (
        without_ablations(draws)
        for draws in (of_all, draws_of(data.scores, data.cells, axes, window=EVERY_CURVE))
    )
    # A map over two axes of which one follows from the other would be empty but for a line of cells.
    fine = finest(beside_ablations(axes), data.cells) or list(axes)
    by_column = {axis.column: axis for axis in fine}
    speed, direction = by_column.get("speed_kmh"), by_column.get("direction")

    def heat(
        name: str, draws: pd.DataFrame, across: Side, down: Side, what: str
    ) -> tuple[str, canvas.Drawing]:
        shown = [axis for axis in fine if axis.column in (*across.columns, *down.columns)]
        kept = held(fine, *shown)
        own = kept.of(draws)
        by_method = {style.label: own[own["estimator"] == style.name] for style in styles}
        others = [axis.name for axis in fine if axis not in shown and axis.column not in kept.values]
        caption = f"{what}; mean over {listed(['draws', *others])}"
        caption += f"; {kept.words}." if kept.words else "."
        make = partial(heat_maps, by_method, across, down, unit="\u00b0", what=caption, muted=muted)
        return caption, canvas.drawn(name, make)

    down, speeds = curve_side(curves), side_of(speed or fine[0])
    across = side_of(speed, direction) if speed and direction else speeds
    named = f"{across.title.partition(',')[0]}"
    maps = []
    if len(down.keys) > 1:
        where = "in each curve of the line (radius by design, positive to the left)"
        what = f"Rms roll error {where} by speed"
        maps.append(heat("curves", curves, speeds, down, what))
    arrows = " (arrows: direction of travel)" if direction is not None else ""
    for axis in fine[:MOST_MAPS]:
        if axis.column not in across.columns:
            what = f"Rms roll error over the whole ride by {named} and {axis.name}{arrows}"
            maps.append(heat(f"roll-by-{axis.name.replace(' ', '-')}", roll, across, side_of(axis), what))
    unlike = {example.cell.get("speed_kmh"): example for example in reversed(data.examples)}
    rides = list(reversed(unlike.values()))
    words = [_words_of(example, axes) for example in rides]
    spread = (
        "How the rms roll error over the whole ride spreads over cells with a value of an axis: box from 25 "
        "to 75 %, white line at the median, strokes from 5 to 95 %"
    )
    kept = held(axes)
    spread += f"; {kept.words}, but along that axis itself." if kept.words else "."
    curvature = (
        "Mean roll error where the track has a curvature, in single rides. A line through zero that rises or "
        "falls is an error that the track itself causes; a level one is a bias."
    )
    more = [
        (spread, canvas.drawn("spread", lambda: box_figure(of_all, styles, axes[:MOST_BOXES], what=spread))),
        (
            curvature,
            canvas.drawn("curvature", lambda: curvature_figure(rides, styles, words=words, what=curvature)),
        ),
    ]
    maps = [(caption, drawing) for caption, drawing in maps if drawing]
    return {"maps": maps[:1], "more": [*maps[1:], *((caption, one) for caption, one in more if one)]}


def curve_side(curves: pd.DataFrame) -> Side:
    """Rows of the heat map over curves, from the sharpest right to the sharpest left one, by their design."""
    names = [str(name) for name in curves["window"].unique()]
    found = {name: re.search(r" R(-?[\d.]+)$", name) for name in names}
    radius = {name: float(match[1]) for name, match in found.items() if match}
    names.sort(key=lambda name: 1.0 / radius[name] if name in radius else 0.0)
    words = [
        signed(f"R {radius[name]:+g}") if name in radius else name.removeprefix(CURVE_PREFIX)
        for name in names
    ]
    return Side("curve radius, m", [(name,) for name in names], words, ["window"])


def _words_of(example: CellResult, axes: Sequence[CampaignAxis]) -> str:
    words = []
    for axis in axes:
        if example.cell.get(axis.column) in axis.values:
            word = axis.words[axis.values.index(example.cell[axis.column])]
            unit = axis.title.partition(", ")[2]
            words.append(f"{word} {unit}" if unit in ("km/h", "m", "s") else word)
    return " \u00b7 ".join(words[:3])


def _real_first(groups: pd.Series) -> list[str]:
    """IMUs and mounts in their order, those of an ideal IMU last: they are floors."""
    return sorted(dict.fromkeys(groups), key=lambda words: str(words).startswith("ideal"))


def _of(frame: pd.DataFrame, words: str) -> pd.DataFrame:
    """Rows of one IMU, mount and vehicle."""
    return frame[frame["of"] == words] if len(frame) else frame


def _methods_table(frame: pd.DataFrame, by_name: Mapping[str, MethodStyle]) -> Table:
    headlines = {
        title: frame[(frame["quantity"] == quantity) & (frame["window"] == window)].set_index("method")
        for title, (quantity, _, window) in HEADLINES.items()
    }
    headlines = {title: means for title, means in headlines.items() if len(means)}
    spreads = next(iter(headlines.values()))
    rows = []
    for name in dict.fromkeys(frame["method"]):
        cells = [
            _with_interval(means.loc[name]) if name in means.index else NONE for means in headlines.values()
        ]
        for column in ("sd_track", "sd_sensor", "p95_of_cells"):
            cells.append(number_cell(spreads.loc[name, column]) if name in spreads.index else NONE)
        rows.append(method_row(by_name[name], cells))
    groups = [
        ("mean rms error, \u00b0, and its 95 % interval", len(headlines)),
        ("roll, sd by", 2),
        ("p95", 1),
    ]
    return Table(groups, [*headlines, "tracks", "sensors", "of cells"], rows)


def _pairs_table(frame: pd.DataFrame, by_name: Mapping[str, MethodStyle]) -> Table:
    rows = []
    for row in frame.to_dict("records"):
        sure = not row["difference_low95"] <= 0.0 <= row["difference_high95"]
        cells = [
            Cell(
                _signed(row["difference"]),
                f"{_signed(row['difference_low95'])} to {_signed(row['difference_high95'])}",
                "best" if sure and row["difference"] < 0.0 else "",
            ),
            Cell(
                f"{100.0 * row['win_rate']:.0f} %",
                f"{100.0 * row['win_rate_low95']:.0f} to {100.0 * row['win_rate_high95']:.0f} %",
            ),
            Cell(_signed(row["effect_size"], 2)),
            Cell(f"{row['pairs']:,}"),
        ]
        style, other = by_name[row["method"]], by_name[row["against"]]
        rows.append(Row(f"{style.label} against {other.label}", "", style.colour, cells))
    return Table([], ["difference, \u00b0", "wins", "effect size", "recordings"], rows)


def _consistency_table(frame: pd.DataFrame, by_name: Mapping[str, MethodStyle]) -> Table:
    rows = []
    for name in dict.fromkeys(frame["method"] if len(frame) else ()):
        cells = []
        for metric, scale, decimals in (("nees", 1.0, 2), ("coverage95", 100.0, 1)):
            own = frame[(frame["method"] == name) & (frame["metric"] == metric)]
            if own.empty:
                cells += [NONE, NONE]
                continue
            row = own.iloc[0]
            mark = "" if row["inside"] else "worse"
            cells.append(_with_interval(row, scale=scale, decimals=decimals, mark=mark))
            cells.append(Cell(_range(row, "lower_bound", "upper_bound", scale=scale, decimals=decimals)))
        rows.append(method_row(by_name[name], cells))
    groups = [("NEES of roll", 2), ("inside the 95 % interval, %", 2)]
    return Table(groups, ["found", "if consistent"] * 2, rows)


def _range(row: pd.Series, low: str, high: str, *, scale: float = 1.0, decimals: int = 3) -> str:
    return f"{scale * row[low]:.{decimals}f} to {scale * row[high]:.{decimals}f}"


def _with_interval(row: pd.Series, *, scale: float = 1.0, decimals: int = 3, mark: str = "") -> Cell:
    is_known = np.isfinite(row["low95"])
    spread = _range(row, "low95", "high95", scale=scale, decimals=decimals) if is_known else ""
    return Cell(f"{scale * row['mean']:.{decimals}f}", spread, mark)


def _signed(value: float, decimals: int = 3) -> str:
    return signed(f"{value:+.{decimals}f}") if np.isfinite(value) else NONE.text
