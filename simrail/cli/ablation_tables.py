"""What a map that errs and vibration cost, and odometries over all rides, for the command line."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from simrail.report.campaign.odometry import COVERAGES, OdometryTable, odometry_tables, row_words
from simrail.report.tables.ablations import ATTITUDE, Cost, attitude_costs, pairs_of, rails_costs
from simrail.report.tables.geometry import JUDGED, QUANTITIES, judged_band
from simrail.report.tables.methods import MethodStyle, attitude_methods
from simrail.report.tables.pivot import Case
from simrail.report.words.ablations import WORDS
from simrail.scoring.ablations import ABLATIONS, Ablation

MOST_GROUPS = 1
"""Mounts, IMUs and odometries whose comparison is printed; the page has all."""

_SHORT = {"drawn": "errs", "both ways": "both", "all speeds": "all", "forward": "forth", "backward": "back"}
"""Words of a narrow table."""

_HEADS = {
    "position_rms_m": "posi-\ntion\nrms, m",
    "position_p95_m": "\n\np95, m",
    "speed_rms_mps": "speed\nrms,\nm/s",
    "position_coverage": "position\ninside\n95 %, %",
    "speed_coverage": "speed\ninside\n95 %, %",
}
"""Heads of the columns, by their names in the frames."""


def print_costs(console: Console, all_cases: Sequence[Case], styles: Sequence[MethodStyle]) -> None:
    """Print each method's errors as a train has it and with each ablation, mean over all rides."""
    for one in ABLATIONS:
        _print_cost(console, all_cases, styles, one)


def _print_cost(
    console: Console, all_cases: Sequence[Case], styles: Sequence[MethodStyle], ablation: Ablation
) -> None:
    words, groups = WORDS[ablation], pairs_of(all_cases, ablation)
    for group in groups[:MOST_GROUPS]:
        console.print(Text(f"{words.cost}: {group.title}", style="bold"))
        rails = rails_costs(group, styles)
        if rails:
            band = judged_band(group.pairs[0][0])
            console.print(Text(f"Rails: sd of the error, {band}, mm; mean over all rides"))
            heads = [QUANTITIES[quantity] for quantity in JUDGED]
            console.print(_comparison(rails, styles, heads, words.short))
        attitude = attitude_methods(styles)
        angles = attitude_costs(group, attitude)
        if angles:
            console.print(Text("Attitude: rms error over whole rides, deg; mean over all rides"))
            heads = [words.replace("\u00b9", " less\nits start") for _, words in ATTITUDE]
            console.print(_comparison(angles, attitude, heads, words.short))
    if groups:
        left = len(groups) - MOST_GROUPS
        more = f"; {left} more {'is' if left == 1 else 'are'} in the report" * (left > 0)
        console.print(Text(f"{words.note}; * baseline{more}", style="dim"))


def _comparison(
    costs: Mapping[str, Sequence[Cost]],
    styles: Sequence[MethodStyle],
    heads: Iterable[str],
    sides: tuple[str, str],
) -> Table:
    table = _table("method")
    for head in heads:
        for which in sides:
            table.add_column(f"{head}\n{which}", justify="right")
    for style in styles:
        if style.name in costs:
            figures = [number for cost in costs[style.name] for number in cost]
            name = f"{style.name}{' *' * bool(style.baseline)}"
            dim = "dim" if style.baseline else None
            table.add_row(name, *(_number(figure) for figure in figures), style=dim)
    return table


def print_odometries(console: Console, frames: Mapping[str, pd.DataFrame], *, by_class: bool = True) -> None:
    """Print the errors of each odometry, and what its 95 % intervals hold: over all rides, and by class."""
    tables = odometry_tables(frames if by_class else {n: f for n, f in frames.items() if n == "odometry"})
    for one in tables:
        console.print(Text(f"Odometry {one.odometry}, {one.what}", style="bold"))
        console.print(_odometry(one))
    if tables:
        exact = any("exact" in set(one.rows["map"]) for one in tables)
        text = "whole rides; rms over the recordings, mean of their 95th percentiles; inside: share of the "
        text += (
            "samples in the 95 % interval, %, and its own 95 % interval, clusters being the draws of track "
        )
        text += "and map, where there are several"
        console.print(Text(text + "; an exact map is an ablation" * exact, style="dim"))


def _odometry(one: OdometryTable) -> Table:
    """Rows of one odometry; what is as in the row above is left out."""
    heads = {"speed_kmh": "speed", "direction": "way", "imu": "IMU"}
    table = _table(*(heads.get(name, name) for name in one.names))
    for column in table.columns:
        column.no_wrap = True
    # A scenario says which metrics it keeps.
    kept = [name for name in _HEADS if one.rows[name].notna().any()]
    for head in (*(_HEADS[name] for name in kept), "re-\ncord-\nings"):
        table.add_column(head, justify="right", no_wrap=True)
    former: list[str] = []
    for row in one.rows.to_dict("records"):
        words = [str(row[name]) if name == "map" else row_words(name, row[name]) for name in one.names]
        words = [_SHORT.get(word, word) for word in words]
        same = next((i for i, (a, b) in enumerate(zip(words, former, strict=False)) if a != b), 0)
        shown = ["" if i < same else word for i, word in enumerate(words)]
        former = words
        figures = [_inside(row, name) if name in COVERAGES else _number(row[name]) for name in kept]
        dim = "dim" if row["map"] == "exact" else None
        table.add_row(*shown, *figures, str(row["recordings"]), style=dim)
    return table


def _inside(row: Mapping[Any, Any], name: str) -> str:
    if not np.isfinite(row[name]):
        return "-"
    low, high = row[f"{name}_low95"], row[f"{name}_high95"]
    own = f"{100.0 * row[name]:.0f}"
    return f"{own}, {100.0 * low:.0f}\u2013{100.0 * high:.0f}" if np.isfinite(low) else own


def _table(*names: str) -> Table:
    table = Table(box=box.SIMPLE_HEAD, padding=0)  # its columns have a space between them
    for name in names:
        table.add_column(name, overflow="fold")
    return table


def _number(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "-"
