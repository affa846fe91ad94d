"""First section of a page with requirements: the verdict in a sentence, its chart, and the table."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from simrail.campaign.budget import FLOOR, TOGETHER, budget_sentence
from simrail.core.jit import FloatArray
from simrail.report.figures import canvas
from simrail.report.pages.section import PageData, Section
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.tiles import Tile
from simrail.report.words.sentences import significant
from simrail.report.words.verdicts import (
    MARKS,
    best_method,
    devices_words,
    glance_sentence,
    judged_methods,
    short_name,
    verdict_sentence,
)
from simrail.scenario.requirements import looks_of, requirements_of
from simrail.scoring.requirement import Requirement
from simrail.scoring.share import ENOUGH, NOT_ENOUGH
from simrail.scoring.verdicts import device_figures, verdict_table

MOST_CHARTS = 12
"""Requirements times mounts that are drawn; ``verdicts.csv`` holds all."""

MANY = 3
"""Requirements times mounts from which they are shown at a glance first, and one by one behind."""

MOST_DOTS = 60
"""Devices that are drawn of an IMU with a method, evenly by rank."""

LEAST_SHARE = 0.002
"""Terms with less of the squared error are not drawn."""

LABELS = {FLOOR: "the method's own floor", TOGETHER: "together"}

COLOURS = {ENOUGH: "#15803d", NOT_ENOUGH: "#b42318"}
"""Of verdicts; any other is muted."""

TONES = {ENOUGH: "good", NOT_ENOUGH: "bad"}
"""The same as variables of the page."""


def verdicts_section(data: PageData) -> list[Section]:
    """Make the section; none for a scenario that asks for nothing."""
    wanted = requirements_of(data.scenario.spec)
    table = verdict_table(data.scores, data.cells, wanted, looks=looks_of(data.scenario.spec))
    if table.empty:
        return []
    groups: list[dict[str, Any]] = []
    figures = [device_figures(data.scores, data.cells, one) for one in wanted]
    for number, vehicle, mount, rows in groups_of(table):
        devices = figures[number]
        devices = devices[(devices["vehicle"] == vehicle) & (devices["mount"] == mount)]
        drawn = len(groups) < MOST_CHARTS
        groups.append(
            {
                "sentence": verdict_sentence(rows, data.styles),
                "devices": devices_words(rows),
                "chart": canvas.drawn(
                    f"verdict-{len(groups) + 1}",
                    partial(decision_chart, rows, devices, wanted[number], data.styles),
                )
                if drawn
                else "",
                "columns": [style.label for style in judged_methods(rows, data.styles)],
                "rows": list(_table_rows(rows, judged_methods(rows, data.styles))),
                "budgets": list(_budgets(data.budgets, number, vehicle, mount)),
            }
        )
    shown = {
        "groups": groups,
        "tiles": verdict_tiles(groups_of(table), data.styles, wanted),
        "chance": 100.0 * max(one.chance for one in wanted),
        "overview": overview(table, data.styles) if len(groups) >= MANY else None,
    }
    return [Section("verdict", "Verdict", "campaign/verdicts.html.j2", shown)]


def verdict_tiles(
    groups: Iterator[tuple[int, str, str, pd.DataFrame]],
    styles: Sequence[MethodStyle],
    wanted: Sequence[Requirement],
) -> list[Tile]:
    """How many IMUs are enough, what the best of them keeps to, and what no IMU at all does; of the first."""
    number, _, mount, rows = next(groups)
    best, requirement = best_method(rows, styles), wanted[number]
    if best is None:
        return []
    unit = "\u00b0" if requirement.unit == "deg" else f" {requirement.unit}"
    own = rows[(rows["estimator"] == best.name) & rows["devices"].gt(0)]
    enough = own.loc[own["verdict"] == ENOUGH, "imu"].astype(str).unique()
    count = len(own["imu"].unique())
    tiles = [Tile("IMUs that are enough", f"{len(enough)} of {count}", f"on the {mount}, with {best.label}")]
    asked = f"{100.0 * requirement.share:g} % of the devices stay below"
    if own["at_share"].notna().any():
        least, *others = own.sort_values("at_share").to_dict("records")
        note = f"{short_name(least['imu'])}: {asked}"
        if others and np.isfinite(others[0]["at_share"]):
            note += f", of {short_name(others[0]['imu'])} below {significant(others[0]['at_share'])}{unit}"
        note += f"; asked are {requirement.limit:g}{unit}"
        tiles.append(Tile("the best IMU", f"{significant(least['at_share'])}{unit}", note))
    floors = [style for style in styles if not style.uses_imu]
    zero = rows[rows["estimator"].isin([style.name for style in floors]) & rows["at_share"].notna()]
    if len(zero):
        value = float(zero["at_share"].median())
        beats = tiles[1:] and value < float(own["at_share"].min())
        note = "beats every IMU" if beats else "what is known without any sensor"
        tiles.append(Tile("no IMU at all", f"{significant(value)}{unit}", note))
    return tiles


def overview(table: pd.DataFrame, styles: Sequence[MethodStyle]) -> dict[str, Any]:
    """All verdicts at a glance, of the best method: a row per IMU, a column per requirement and mount."""
    columns, cells = [], {}
    for _, vehicle, mount, rows in groups_of(table):
        best = best_method(rows, styles)
        if best is None:
            continue
        several = len(table["vehicle"].drop_duplicates()) > 1
        columns.append(
            (str(rows["requirement"].iloc[0]).partition(" for ")[0], mount, vehicle if several else "")
        )
        for imu, own in rows[rows["estimator"] == best.name].groupby("imu", sort=False):
            worst = own.sort_values("share", na_position="first").iloc[0]
            cells[str(imu), len(columns) - 1] = _cell(worst) | {"percent": f"{100.0 * worst['share']:.0f}"}
    heads: list[tuple[str, int]] = []
    for words, _, _ in columns:
        if heads and heads[-1][0] == words:
            heads[-1] = words, heads[-1][1] + 1
        else:
            heads.append((words, 1))
    imus = list(dict.fromkeys(table["imu"].astype(str)))
    return {
        "sentence": glance_sentence(table, styles),
        "heads": heads,
        "mounts": [" ".join(word for word in (mount, vehicle) if word) for _, mount, vehicle in columns],
        "rows": [(short_name(imu), [cells.get((imu, i)) for i in range(len(columns))]) for imu in imus],
    }


def _budgets(
    budgets: pd.DataFrame | None, number: int, vehicle: str, mount: str
) -> Iterator[tuple[str, str]]:
    """Sentence and figure of each budget of a requirement at a mount."""
    if budgets is None or budgets.empty:
        return
    own = budgets[
        (budgets["number"] == number) & (budgets["vehicle"] == vehicle) & (budgets["mount"] == mount)
    ]
    for imu, budget in own.groupby("imu", sort=False):
        sentence = f"{short_name(imu)}: {budget_sentence(budget)}."
        name = f"budget-{number + 1}-{vehicle}-{mount}-{short_name(imu)}"
        yield sentence, canvas.drawn(name, partial(budget_chart, budget, sentence))


def budget_chart(budget: pd.DataFrame, description: str) -> str:
    """Shares of the squared error as bars, largest first, with their intervals."""
    shown = budget[(budget["share"].abs() >= LEAST_SHARE) | budget["term"].isin((FLOOR, TOGETHER))]
    names = [LABELS.get(str(term), str(term).replace("_", " ")) for term in shown["term"]]
    place = np.arange(len(shown))[::-1]
    share = 100.0 * shown["share"].to_numpy()
    with canvas.look():
        figure, (panel,) = canvas.panels([0.24 * len(shown) + 0.1], top_in=0.15)
        is_term = ~shown["term"].isin((FLOOR, TOGETHER)).to_numpy()
        panel.barh(place, share, height=0.62, color=np.where(is_term, "#0b7285", "#98a1af"), zorder=3)
        low, high = (100.0 * shown[name].to_numpy() for name in ("low95", "high95"))
        for y, left, right in zip(place, low, high, strict=True):
            panel.plot([left, right], [y, y], color=canvas.INK, lw=1.0, zorder=4)
        panel.axvline(0.0, color=canvas.INK, lw=0.7)
        panel.set_yticks(place, names, fontsize=8.0)
        panel.tick_params(axis="y", length=0)
        panel.grid(axis="y", visible=False)
        # Room for the longest name, of some 0.56 of the font's size a letter.
        left = (0.56 * 8.0 / 72.0 * max(map(len, names)) + 0.2) / canvas.width_in()
        right = 1.0 - 0.2 / canvas.width_in()
        panel.set_position((left, panel.get_position().y0, right - left, panel.get_position().height))
        panel.set_xlabel("share of the squared error, %")
        return canvas.to_svg(figure, description=description)


def groups_of(table: pd.DataFrame) -> Iterator[tuple[int, str, str, pd.DataFrame]]:
    """Number of a requirement, vehicle and mount, and the verdicts there."""
    if table.empty:
        return
    for names, rows in table.groupby(["number", "vehicle", "mount"], sort=False):
        number, vehicle, mount = (str(name) for name in names)
        yield int(number), vehicle, mount, rows


def _table_rows(rows: pd.DataFrame, styles: Sequence[MethodStyle]) -> Iterator[dict[str, Any]]:
    """An IMU's verdicts by method."""
    keys = [name for name in _case_columns(rows) if name == "imu" or len(rows[name].drop_duplicates()) > 1]
    for names, own in rows.groupby(keys, sort=False, dropna=False):
        by_method = own.set_index(own["estimator"].astype(str))
        names = names if isinstance(names, tuple) else (names,)
        yield {
            "name": " \u00b7 ".join(_word(key, value) for key, value in zip(keys, names, strict=True)),
            "cells": [
                _cell(by_method.loc[[style.name]].iloc[0]) if style.name in by_method.index else None
                for style in styles
            ],
        }


def _case_columns(rows: pd.DataFrame) -> list[str]:
    """What tells verdicts of a requirement apart, beside the method: IMU and, of each kind of ride, axes."""
    figures = {"verdict", "devices", "passed", "share", "low95", "high95", "tracks", "effective"}
    figures |= {"median", "at_share", "unit", "reason", "requirement", "number", "estimator", "tuning"}
    return [str(name) for name in rows.columns if name not in figures]


def _word(key: str, value: object) -> str:
    if key == "imu":
        return short_name(value)
    number = f"{value:g}" if isinstance(value, float) else str(value)
    return number if key in ("ride", "direction") else f"{key} {number}"


def _cell(row: pd.Series) -> dict[str, Any]:
    return {
        "mark": MARKS[row["verdict"]],
        "verdict": row["verdict"],
        "colour": f"var(--{TONES.get(row['verdict'], 'muted')})",
        "share": f"{row['passed']} of {row['devices']}" if row["devices"] else row["reason"],
        "interval": f"{100.0 * row['low95']:.0f} to {100.0 * row['high95']:.0f} %" if row["devices"] else "",
        "at_share": f"{row['at_share']:.3g}" if row["devices"] else "",
    }


def decision_chart(
    rows: pd.DataFrame, devices: pd.DataFrame, wanted: Requirement, styles: Sequence[MethodStyle]
) -> str:
    """A dot for each device over the grades, by method, with the limit as a line and verdicts above.

    Parameters
    ----------
    rows : pandas.DataFrame
        Verdicts of a requirement at a mount.
    devices : pandas.DataFrame
        Figures of the devices there (`simrail.scoring.verdicts.device_figures`).
    wanted : Requirement
        What is asked.
    styles : sequence of MethodStyle
        The scenario's.
    """
    methods = judged_methods(rows, styles)[:4]
    finite = devices[np.isfinite(devices["value"]) & (devices["value"] > 0.0)]
    if not methods or finite.empty:
        return ""
    imus = list(dict.fromkeys(rows["imu"].astype(str)))
    best = best_method(rows, styles)
    with canvas.look():
        figure, (panel,) = canvas.slots_panel(2.7, [short_name(imu) for imu in imus], top_in=0.75)
        for slot, style in enumerate(methods):
            for i, imu in enumerate(imus):
                own = finite[(finite["imu"] == imu) & (finite["estimator"] == style.name)]["value"]
                # Of few grades strokes would be long lines.
                wide = min(0.64 / len(methods), 0.016 * len(imus) + 0.06)
                left = i - 0.4 + (slot + 0.5) * 0.8 / len(methods) - 0.5 * wide
                _draw_devices(panel, own.to_numpy(), left, wide, style)
        panel.axhline(wanted.limit, color=canvas.INK, lw=1.2, ls=(0, (4, 2)), zorder=1)
        low, high = finite["value"].min(), finite["value"].max()
        panel.set_ylim(0.7 * min(low, 0.8 * wanted.limit), 1.6 * max(high, 1.25 * wanted.limit))
        canvas.log_scale(panel.yaxis)
        unit = "\u00b0" if wanted.unit == "deg" else wanted.unit
        panel.set_ylabel(f"{wanted.what}, {unit}")
        if best is not None:
            _write_shares(panel, rows[rows["estimator"] == best.name], imus)
        handles = [Line2D([], [], color=style.colour, lw=4.0) for style in methods]
        labels = [style.label for style in methods]
        limit = Line2D([], [], color=canvas.INK, lw=1.2, ls=(0, (4, 2)))
        canvas.figure_legend(figure, [*handles, limit], [*labels, "limit"])
        return canvas.to_svg(figure, description=verdict_sentence(rows, styles))


def _draw_devices(panel: Axes, values: FloatArray, left: float, wide: float, style: MethodStyle) -> None:
    """Draw devices as short strokes; of many so many by rank, the best and the worst among them."""
    if len(values) == 0:
        return
    ranked = np.sort(values)
    shown = ranked[np.unique(np.linspace(0, len(ranked) - 1, MOST_DOTS).round().astype(int))]
    x = np.tile([left, left + wide, np.nan], len(shown))
    y = np.repeat(shown, 3)
    panel.plot(x, y, color=style.colour, lw=1.6, alpha=0.75, solid_capstyle="butt", zorder=3)


def _write_shares(panel: Axes, rows: pd.DataFrame, imus: Sequence[str]) -> None:
    """Write the verdict and the share of devices above each grade, of the method that is best."""
    for i, imu in enumerate(imus):
        own = rows[rows["imu"] == imu]
        if own.empty or not own["devices"].iloc[0]:
            continue
        worst = own.sort_values("share").iloc[0]
        text = f"{MARKS[worst['verdict']]} {100.0 * worst['share']:.0f} %"
        colour = COLOURS.get(worst["verdict"], canvas.MUTED)
        panel.annotate(
            text,
            (i, 1.0),
            (0, 3),
            xycoords=panel.get_xaxis_transform(),
            textcoords="offset points",
            ha="center",
            fontsize=8.0,
            weight="bold",
            color=colour,
        )
