"""Make ``which_imu.csv`` and ``which_imu.png`` of the results of ``simrail run which_imu``.

    simrail run which_imu --out DIR
    python results/reference/which_imu.py DIR
    python results/reference/which_imu.py --cells

The second makes ``which_imu_cells.csv`` anew: the figures of some recordings of the first ride, each run by
itself. A test runs them again, and so tells when the table has grown old.

The table is that of the verdicts (`simrail.scoring.verdicts.verdict_table`). The picture, and the table that
is printed, have a row per grade and a column per mount: of roll by the EKF, which cannot see the bias of its
accelerometer, and of each requirement by the track-relative smoother; in each the share of the devices that
meet it, and whether that is enough.
"""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from simrail.report.figures import canvas
from simrail.report.words.verdicts import MARKS
from simrail.results import run_cell
from simrail.scenario.cells import cells
from simrail.scenario.requirements import requirements_of
from simrail.scenario.scenario import load_scenario

HERE = Path(__file__).parent
TABLE, PICTURE, CELLS = HERE / "which_imu.csv", HERE / "which_imu.png", HERE / "which_imu_cells.csv"
SAMPLE = (("axle", "lord_3dm_gx4_25"), ("frame", "consumer"), ("body", "hg1700"))
"""Mount and grade of the recordings that are run again, of the first rails, map and device."""
OURS, OTHER = "track_relative", "ekf"
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


def columns_of(table: pd.DataFrame) -> pd.DataFrame:
    """The verdicts that are shown, with a title: of roll by both methods, of the rest by ours."""
    roll = table["requirement"].str.startswith("roll")
    shown = table[(roll & (table["estimator"] == OTHER)) | (table["estimator"] == OURS)]
    short = (
        shown["requirement"]
        .str.partition(" for ")[0]
        .str.replace(" rms", "")
        .str.replace("cross level", "level")
    )
    by = shown["estimator"].map({OTHER: "\nEKF", OURS: "\ntrack-relative"})
    order = (shown["estimator"] != OTHER).astype(int)
    return shown.assign(title=short + by, order=order).sort_values("order", kind="stable")


def shares_of(table: pd.DataFrame) -> pd.DataFrame:
    """Marks and shares by grade, in the order of the scenario, and by title and mount."""
    shown = columns_of(table)
    marks = shown["verdict"].map(MARKS) + " " + (100.0 * shown["share"]).round().astype(int).astype(str)
    wide = shown.assign(told=marks).pivot_table(
        index="imu", columns=["title", "mount"], values="told", aggfunc="first", sort=False
    )
    return wide.reindex(list(dict.fromkeys(shown["imu"])))


def draw(table: pd.DataFrame) -> None:
    """Draw the picture."""
    shown, wide = columns_of(table), shares_of(table)
    cells = shown.set_index(["title", "mount", "imu"])
    with canvas.look():
        tall = 0.36 * len(wide) + 1.2
        figure = Figure(figsize=(11.2, tall), dpi=110)
        panel = figure.add_axes((0.135, 0.01, 0.86, 1.0 - 1.1 / tall))
        for x, (title, mount) in enumerate(wide.columns):
            for y, imu in enumerate(wide.index):
                cell = cells.loc[(title, mount, imu)]
                panel.add_patch(Rectangle((x, y), 0.96, 0.9, color=COLOURS[cell["verdict"]], lw=0))
                ink = "white" if cell["verdict"] in ("enough", "not enough") else canvas.INK
                share = f"{100.0 * cell['share']:.0f}"
                panel.text(x + 0.48, y + 0.47, share, ha="center", va="center", color=ink, fontsize=8.5)
        panel.set_xlim(0, len(wide.columns))
        panel.set_ylim(len(wide), 0)
        places = [x + 0.48 for x in range(len(wide.columns))]
        panel.set_xticks(places, [mount for _, mount in wide.columns], fontsize=8)
        panel.set_yticks([y + 0.47 for y in range(len(wide))], wide.index, fontsize=8.5)
        panel.xaxis.tick_top()
        panel.tick_params(length=0)
        panel.grid(visible=False)
        for side in ("left", "bottom"):
            panel.spines[side].set_visible(False)
        for title in dict.fromkeys(name for name, _ in wide.columns):
            own = [x for x, (name, _) in enumerate(wide.columns) if name == title]
            panel.text(sum(own) / len(own) + 0.48, -0.8, title, ha="center", va="bottom", fontsize=8.6)
        figure.savefig(PICTURE)


def sample_figures() -> pd.DataFrame:
    """Figures of the recordings of `SAMPLE` that are held against requirements, each run by itself."""
    read = load_scenario("which_imu")
    asked = requirements_of(read.spec)
    first = {
        (cell.imu.name, str(cell.imu.grade)): cell.number
        for cell in cells(read)
        if cell.track_draw == 0 and (cell.imu.name, str(cell.imu.grade)) in SAMPLE
    }
    tables = []
    for mount, grade in SAMPLE:
        scores = run_cell("which_imu", first[mount, grade]).scores
        for wanted in asked:
            chosen = scores
            for name in ("quantity", "band", "reference", "window", "metric"):
                chosen = chosen[(chosen[name] == getattr(wanted, name)).to_numpy()]
            tables.append(chosen[["cell", "mount", "imu", "estimator", "quantity", "value", "unit"]])
    return pd.concat(tables, ignore_index=True)


def main() -> None:
    """Read the results named on the command line, write table and picture, print the table."""
    if sys.argv[1] == "--cells":
        figures = sample_figures()
        figures.to_csv(CELLS, index=False, float_format="%.9g")
        print(figures.to_string())
        return
    table = pd.read_csv(Path(sys.argv[1]) / "verdicts.csv")
    table[KEPT].to_csv(TABLE, index=False, float_format="%.4g")
    draw(table)
    print(shares_of(table).to_string())
    print(f"wrote {TABLE.name} and {PICTURE.name}: {len(table)} verdicts")


if __name__ == "__main__":
    main()
