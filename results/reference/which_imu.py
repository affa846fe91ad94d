"""Make ``which_imu.csv`` and ``which_imu.png`` of the results of ``simrail run which_imu``.

    simrail run which_imu --out DIR
    python results/reference/which_imu.py DIR

The table is that of the verdicts (`simrail.scoring.verdicts.verdict_table`). The picture, and the table that
is printed, are of the method under test alone: a row per grade, a column per requirement and mount; in each
the share of the devices that meet it, and whether that is enough.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from simrail.report.figures import canvas
from simrail.report.words.verdicts import MARKS

HERE = Path(__file__).parent
TABLE, PICTURE = HERE / "which_imu.csv", HERE / "which_imu.png"
METHOD = "track_relative"
KEPT = [
    *("requirement", "mount", "imu", "estimator", "verdict", "devices", "passed", "share", "low95", "high95"),
    *("tracks", "median", "at_share", "unit"),
]
COLOURS = {
    "enough": "#2f9e44",
    "not enough": "#e8590c",
    "not enough draws": "#ced4da",
    "not judged": "#f1f3f5",
}


def shares_of(table: pd.DataFrame, method: str = METHOD) -> pd.DataFrame:
    """Marks and shares by grade, in the order of the scenario, and by requirement and mount."""
    own = table[table["estimator"] == method]
    told = [
        f"{MARKS[verdict]} {100.0 * share:.0f}"
        for verdict, share in zip(own["verdict"], own["share"], strict=True)
    ]
    wide = own.assign(told=told).pivot_table(
        index="imu", columns=["requirement", "mount"], values="told", aggfunc="first", sort=False
    )
    return wide.reindex(list(dict.fromkeys(own["imu"])))


def draw(table: pd.DataFrame) -> None:
    """Draw the picture."""
    own = table[table["estimator"] == METHOD]
    wide = shares_of(table)
    with canvas.look():
        figure = Figure(figsize=(10.8, 0.36 * len(wide) + 1.25), dpi=110)
        panel = figure.add_axes((0.155, 0.02, 0.84, 0.98 - 0.98 / (0.36 * len(wide) + 1.25)))
        for x, (requirement, mount) in enumerate(wide.columns):
            for y, imu in enumerate(wide.index):
                cell = own[
                    (own["requirement"] == requirement) & (own["mount"] == mount) & (own["imu"] == imu)
                ]
                if cell.empty:
                    continue
                verdict = cell["verdict"].iloc[0]
                panel.add_patch(Rectangle((x, y), 0.96, 0.9, color=COLOURS[verdict], lw=0))
                ink = "white" if verdict in ("enough", "not enough") else canvas.INK
                panel.text(
                    x + 0.48,
                    y + 0.47,
                    f"{100.0 * cell['share'].iloc[0]:.0f} %",
                    ha="center",
                    va="center",
                    color=ink,
                    fontsize=8.5,
                )
        panel.set_xlim(0, len(wide.columns))
        panel.set_ylim(len(wide), 0)
        panel.set_xticks(
            [x + 0.48 for x in range(len(wide.columns))], [mount for _, mount in wide.columns], fontsize=8
        )
        panel.set_yticks([y + 0.47 for y in range(len(wide))], wide.index, fontsize=8.5)
        panel.xaxis.tick_top()
        panel.tick_params(length=0)
        panel.grid(visible=False)
        for side in ("left", "bottom"):
            panel.spines[side].set_visible(False)
        for requirement in dict.fromkeys(name for name, _ in wide.columns):
            places = [x for x, (name, _) in enumerate(wide.columns) if name == requirement]
            words = (
                requirement.partition(" for ")[0].replace(" rms", "").replace("cross level", "cross-level")
            )
            panel.text(
                sum(places) / len(places) + 0.48,
                -0.95,
                words,
                ha="center",
                va="bottom",
                fontsize=9.5,
                weight="bold",
            )
        figure.savefig(PICTURE)


def main() -> None:
    """Read the results named on the command line, write table and picture, print the table."""
    table = pd.read_csv(Path(sys.argv[1]) / "verdicts.csv")
    table[KEPT].to_csv(TABLE, index=False, float_format="%.4g")
    draw(table)
    print(shares_of(table).to_string())
    print(f"wrote {TABLE.name} and {PICTURE.name}: {len(table)} verdicts")


if __name__ == "__main__":
    main()
