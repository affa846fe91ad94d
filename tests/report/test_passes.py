"""The section of several passes: figures whose every value is known beforehand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd

from simrail.report.campaign.passes import (
    groups_of,
    passes_figure,
    passes_of,
    passes_section,
    passes_table,
)
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case, Mean
from simrail.track.bands import BANDS

STYLE = MethodStyle(
    name="smoother",
    label="the smoother",
    baseline="",
    uses_imu=True,
    twin="",
    compensated=None,
    colour="#000000",
    stroke="-",
    kind="smoother",
    ablation=False,
)


def case(n: str, *, mount: str = "axle", falls: bool = True) -> Case:
    """Errors of 0.8 mm that fall by the root of the passes, or do not; coverage 0.9."""
    scores = {}
    rows = []
    for quantity in ("vertical_profile", "cross_level", "alignment"):
        for band in ("full", *BANDS):
            value = 0.8 / np.sqrt(float(n)) if falls and n != "nan" else 0.8
            for metric, figure in (("rms", value), ("sd", value), ("coverage95", 0.9)):
                scores["smoother", quantity, band, "truth", "whole", metric] = Mean(figure, float("nan"), 1)
            rows.append({"quantity": quantity, "band": band, "draws": 1, "estimator": "smoother"})
    labels = {"ride": "r", "vehicle": "v", "mount": mount, "imu": "lord", "odometry": "o", "map": "drawn"}
    labels |= {"vibration": "on", "passes": n, "case": n, "speed_kmh": n, "direction": n}
    return Case(labels, pd.DataFrame(rows), scores)


def test_cases_that_differ_in_their_passes_only_are_a_group() -> None:
    cases = [
        case("4"),
        case("1"),
        case("16"),
        case("2", mount="frame"),
        case("1", mount="frame"),
        case("nan"),
    ]
    groups = list(groups_of(cases))
    assert [[passes_of(one) for one in group] for group in groups] == [[1, 4, 16], [1, 2]]
    assert list(groups_of([case("1"), case("4", mount="frame")])) == []


def test_the_table_sets_the_error_beside_what_the_root_would_leave() -> None:
    table = passes_table([case("1", falls=False), case("4", falls=False)], STYLE)
    assert table.columns == ["1", "4", "4", "1", "4"]
    row = next(row for row in table.rows if row.label == "cross-level, D1")
    assert [cell.text for cell in row.cells] == ["0.800", "0.800", "0.400", "0.90", "0.90"]
    falling = passes_table([case("1"), case("4")], STYLE)
    assert [cell.text for cell in falling.rows[0].cells][:3] == ["0.800", "0.400", "0.400"]


def test_what_is_not_there_is_a_dash() -> None:
    one, four = case("1"), case("4")
    four.scores.clear()
    row = passes_table([one, four], STYLE).rows[0]
    assert row.cells[0].text == "0.800" and row.cells[1].text == "\u2013"


def test_the_figure_has_a_line_for_each_band_and_number() -> None:
    svg = passes_figure([case("1"), case("2"), case("16")], STYLE, what="smoother")
    assert svg.startswith("<svg") and all(
        f">{word}<" in svg for word in ("D0", "D1", "D2", "D3", "passes", "16")
    )


def test_each_group_says_which_imu_it_is_of() -> None:
    cases = [case(n, mount=mount) for mount in ("axle", "frame") for n in ("1", "4")]
    (section,) = passes_section(SimpleNamespace(cases=cases, styles=(STYLE,)))  # type: ignore[arg-type]
    titles = [title for title, _, _ in section.data["shown"]]
    assert [title.split(",")[0] for title in titles] == [
        f"the smoother: IMU {mount} (lord)" for mount in ("axle", "frame")
    ]
    assert passes_section(SimpleNamespace(cases=cases[:1], styles=(STYLE,))) == []  # type: ignore[arg-type]
