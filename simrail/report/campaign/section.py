"""The section itself: tables and figures over the axes of a campaign, gathered for the template."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from markupsafe import Markup

from simrail.campaign.cell import CellResult
from simrail.report.campaign.axes import CampaignAxis, campaign_axes, draws_of, finest, is_campaign
from simrail.report.campaign.figures import box_figure, curvature_figure
from simrail.report.campaign.heat import Side, heat_figure, side_of
from simrail.report.campaign.rails import rails_figures
from simrail.report.campaign.tables import CampaignTables, campaign_tables
from simrail.report.tables.methods import MethodStyle, attitude_methods, readable
from simrail.report.tables.tables import Cell, Row, Table
from simrail.scenario.build import bands_by_name
from simrail.scenario.scenario import Scenario
from simrail.scoring.table import CURVE_PREFIX, EVERY_CURVE, FULL

MOST_METHODS = 8
"""Methods that are drawn: those under test first."""


@dataclass(frozen=True)
class CampaignView:
    """The section as the template needs it."""

    axes: list[tuple[str, str]]
    cells: int
    tracks: int
    rails: list[tuple[str, Markup]]
    methods: Table
    pairs: Table
    consistency: Table
    worst: list[tuple[str, str, str, str]]
    figures: list[tuple[str, Markup]]
    tables: CampaignTables


def campaign_view(
    scenario: Scenario,
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    styles: Sequence[MethodStyle],
    examples: Sequence[CellResult],
    manifest: Mapping[str, object],
    *,
    band: str = FULL,
) -> CampaignView | None:
    """Make the section; None for a scenario without lists, or whose methods say nothing of roll.

    Rails, where a method says what they look like, come first, in a band.
    """
    axes = campaign_axes(cells) if is_campaign(scenario) else []
    if not axes or not (scores["quantity"] == "roll").any():
        return None
    # What stands beside a run has no part in one of its cells.
    command = str(manifest.get("command", f"simrail run {scenario.called}")).partition(" --beside ")[0]
    tables = campaign_tables(scores, cells, axes, attitude_methods(styles), command=command)
    if tables.methods.empty:
        return None
    label = {style.name: style for style in styles}
    return CampaignView(
        axes=[(axis.title, ", ".join(axis.words)) for axis in axes],
        cells=len(cells),
        tracks=int(tables.methods["tracks"].max()),
        rails=[
            (caption, Markup(svg))
            for caption, svg in rails_figures(
                scores, cells, axes, styles, band=band, known=bands_by_name(scenario.spec)
            )
        ],
        methods=_methods_table(tables.methods, label),
        pairs=_pairs_table(tables.pairs, label),
        consistency=_consistency_table(tables.consistency, label),
        worst=[
            (
                readable(row["method"]),
                f"{row['rms_roll_deg']:.3f}\u00b0",
                " \u00b7 ".join(f"{axis.title.partition(',')[0]} {row[axis.title]}" for axis in axes),
                row["command"],
            )
            for row in tables.worst.to_dict("records")
        ],
        figures=_figures(scores, cells, axes, attitude_methods(styles), examples),
        tables=tables,
    )


def _figures(
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    axes: Sequence[CampaignAxis],
    styles: Sequence[MethodStyle],
    examples: Sequence[CellResult],
) -> list[tuple[str, Markup]]:
    shown = sorted(styles, key=lambda style: bool(style.baseline))[:MOST_METHODS]
    roll = draws_of(scores, cells, axes)
    # A map over two axes of which one follows from the other would be empty but for a line of cells.
    fine = finest(axes, cells)
    by_column = {axis.column: axis for axis in fine}
    speed, direction = by_column.get("speed_kmh"), by_column.get("direction")
    found: list[tuple[str, str]] = []
    curves = draws_of(scores, cells, axes, window=EVERY_CURVE)
    down = _curve_side(curves, examples)
    across = side_of(speed or fine[0])
    if len(down.keys) > 1:
        found.append(
            (
                "Rms roll error in each curve of the line (radius, positive to the left), mean over all "
                "other axes and draws. An error that grows with the speed, and most in sharp curves, is of "
                "the acceleration that a method takes for gravity.",
                heat_figure(curves, shown, across, down, what="Roll error over speed and curve radius"),
            )
        )
    if speed and direction:
        across = side_of(speed, direction)
    for axis in fine:
        if axis.column in across.columns:
            continue
        found.append(
            (
                f"Rms roll error over the whole ride, by {_lower(across.title)} and {_lower(axis.title)}; "
                "mean over all other axes and draws."
                + (" Arrows: direction of travel." if direction else ""),
                heat_figure(roll, shown, across, side_of(axis), what=f"Roll error by {axis.title}"),
            )
        )
    found.append(
        (
            "How the rms roll error over the whole ride spreads over all cells with a value of an axis: box "
            "from 25 to 75 %, white line at the median, strokes from 5 to 95 %.",
            box_figure(roll, shown, axes[:6], what="Spread of the roll error along every axis"),
        )
    )
    kept = _unlike(examples, axes)
    words = [_words_of(example, axes) for example in kept]
    found.append(
        (
            "Mean roll error where the track has a curvature, in single rides. A line through zero that "
            "rises or falls is an error that the track itself causes; a level one is a bias.",
            curvature_figure(kept, shown, words=words, what="Roll error against curvature"),
        )
    )
    return [(caption, Markup(svg)) for caption, svg in found if svg]


def _curve_side(curves: pd.DataFrame, examples: Sequence[CellResult]) -> Side:
    """Rows of the heat map over curves, from the sharpest right to the sharpest left one."""
    names = [str(name) for name in curves["window"].unique()]
    radius: dict[str, float] = {}
    for example in examples:
        track = example.recording.track
        place = np.arange(track.start_m, track.end_m, 1.0)
        bend, number = track.frame(place).k[:, 2], np.asarray(track.segment(place))
        for k in np.unique(number):
            middle = float(np.median(bend[number == k]))
            if middle != 0.0:
                radius.setdefault(CURVE_PREFIX + track.segment_name(int(k)), 1.0 / middle)
    names.sort(key=lambda name: 1.0 / radius[name] if name in radius else 0.0)
    words = [
        f"{radius[name]:+.0f} m" if name in radius else name.removeprefix(CURVE_PREFIX) for name in names
    ]
    return Side("curve radius", [(name,) for name in names], words, ["window"])


def _unlike(examples: Sequence[CellResult], axes: Sequence[CampaignAxis]) -> list[CellResult]:
    """Examples of unlike speeds, as far as they go."""
    kept: dict[object, CellResult] = {}
    for example in examples:
        kept.setdefault(example.cell.get("speed_kmh"), example)
    return list(kept.values())


def _words_of(example: CellResult, axes: Sequence[CampaignAxis]) -> str:
    said = []
    for axis in axes:
        if example.cell.get(axis.column) in axis.values:
            word = axis.words[axis.values.index(example.cell[axis.column])]
            unit = axis.title.partition(", ")[2]
            said.append(f"{word} {unit}" if unit in ("km/h", "m", "s") else word)
    return " \u00b7 ".join(said[:3])


def _lower(title: str) -> str:
    return title.partition(",")[0]


def _methods_table(frame: pd.DataFrame, label: Mapping[str, MethodStyle]) -> Table:
    titles = {
        ("roll", "whole"): "roll",
        ("roll", "curve"): "roll in curves",
        ("pitch", "whole"): "pitch",
        ("yaw_debiased", "whole"): "yaw\u00b9",
    }
    kept = {key: frame[(frame["quantity"] == key[0]) & (frame["window"] == key[1])] for key in titles}
    kept = {key: rows.set_index("method") for key, rows in kept.items() if len(rows)}
    rows = []
    for name in dict.fromkeys(frame["method"]):
        cells = [_with_interval(rows_.loc[name]) if name in rows_.index else _NONE for rows_ in kept.values()]
        first = next(iter(kept.values()))
        if name in first.index:
            spread = first.loc[name]
            cells += [_number(spread[key]) for key in ("sd_track", "sd_sensor", "p95_of_cells")]
        else:
            cells += [_NONE] * 3
        rows.append(_row(label[name], cells))
    columns = [titles[key] for key in kept] + ["tracks", "sensors", "of cells"]
    groups = [("mean rms error, \u00b0, and its 95 % interval", len(kept)), ("roll, sd by", 2), ("p95", 1)]
    return Table(groups, columns, rows)


def _pairs_table(frame: pd.DataFrame, label: Mapping[str, MethodStyle]) -> Table:
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
        style, other = label[row["method"]], label[row["against"]]
        rows.append(Row(f"{style.label} against {other.label}", "", style.colour, cells))
    return Table([], ["difference, \u00b0", "wins", "effect size", "recordings"], rows)


def _consistency_table(frame: pd.DataFrame, label: Mapping[str, MethodStyle]) -> Table:
    rows = []
    for name in dict.fromkeys(frame["method"] if len(frame) else ()):
        cells = []
        for metric, scale, decimals in (("nees", 1.0, 2), ("coverage95", 100.0, 1)):
            own = frame[(frame["method"] == name) & (frame["metric"] == metric)]
            if own.empty:
                cells += [_NONE, _NONE]
                continue
            row = own.iloc[0]
            spread = f"{scale * row['low95']:.{decimals}f} to {scale * row['high95']:.{decimals}f}"
            cells.append(
                Cell(
                    f"{scale * row['mean']:.{decimals}f}",
                    spread if np.isfinite(row["low95"]) else "",
                    "" if row["inside"] else "worse",
                )
            )
            bounds = f"{scale * row['lower_bound']:.{decimals}f} to {scale * row['upper_bound']:.{decimals}f}"
            cells.append(Cell(bounds))
        rows.append(_row(label[name], cells))
    groups = [("NEES of roll", 2), ("inside the 95 % interval, %", 2)]
    return Table(groups, ["found", "if consistent", "found", "if consistent"], rows)


_NONE = Cell("\u2013", mark="none")


def _row(style: MethodStyle, cells: list[Cell]) -> Row:
    return Row(style.label, style.baseline, style.colour, cells)


def _with_interval(row: pd.Series) -> Cell:
    known = np.isfinite(row["low95"])
    return Cell(f"{row['mean']:.3f}", f"{row['low95']:.3f} to {row['high95']:.3f}" if known else "")


def _number(value: float) -> Cell:
    return Cell(f"{value:.3f}") if np.isfinite(value) else _NONE


def _signed(value: float, decimals: int = 3) -> str:
    return f"{value:+.{decimals}f}".replace("-", "\u2212") if np.isfinite(value) else "\u2013"
