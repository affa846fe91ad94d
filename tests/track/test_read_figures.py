"""Lines of other programs come with their figures, and a unit that is wrong shows in them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from simrail.core.errors import InputError
from simrail.track.foreign_file import design_from_file


def curvature(s: float) -> float:
    """Straight, clothoid, 300 m to the left, clothoid, straight."""
    return min(max(min((s - 150.0) / 60.0, (450.0 - s) / 60.0), 0.0), 1.0) / 300.0


def written(
    folder: Path,
    head: str = "s_m,curvature_1pm,cant_mm,gradient_permil",
    *,
    place: Callable[[float], float] = lambda s: s,
    bend: float = 1.0,
    cant: float = 76.0,
    gradient: float = 4.0,
) -> list[str]:
    rows = [
        f"{place(s):.8g},{bend * curvature(s):.8g},{300.0 * cant * curvature(s):.8g},{gradient:g}"
        for s in range(0, 601, 5)
    ]
    path = folder / "line.csv"
    path.write_text("\n".join([head, *rows]) + "\n")
    return design_from_file(path)[1]


def test_what_was_read_is_told_in_figures_and_nothing_of_a_sound_line_is_doubtful(tmp_path: Path) -> None:
    notes = written(tmp_path)
    assert notes[-1] == "600 m, radii down to 300 m, cant up to 76 mm, gradients up to 4 permil"
    assert not [note for note in notes if note.startswith("doubtful")]


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"cant": 76.0 / 25.4}, "a cant of 2.99 mm at a radius of 300 m balances 8.7 km/h: is it in inches"),
        ({"gradient": 400.0}, "a gradient of 400 permil is steeper"),
        ({"gradient": 0.004}, "no gradient is above 0.004 permil"),
        ({"bend": 1e-3, "cant": 0.0}, "no radius is below 300 km"),
        ({"bend": 25.0}, "a radius of 12 m is tighter"),
        ({"place": lambda s: s + 1000.0 * (s > 300.0)}, "row 63 is 1005 m behind the row before"),
    ],
)
def test_what_no_railway_has_is_doubtful(changed: dict[str, object], said: str, tmp_path: Path) -> None:
    doubts = [note for note in written(tmp_path, **changed) if note.startswith("doubtful")]  # type: ignore[arg-type]
    assert len(doubts) == 1 and said in doubts[0]


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"cant": 0.076}, "cant: has a cant that is next to none.*0.076 mm at most.*'cant .m.'"),
        ({"place": lambda s: s / 1000.0}, "shorter than any line; found '0.6 m'.*km"),
        ({"head": "s_m,degree,cant_mm,gradient_permil"}, "sin"),
    ],
)
def test_what_is_surely_no_line_is_refused(changed: dict[str, object], said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        written(tmp_path, **changed)  # type: ignore[arg-type]


def test_stations_with_a_plus_are_told_in_metres(tmp_path: Path) -> None:
    path = tmp_path / "line.csv"
    path.write_text("s_m,curvature_1pm\n12+345.5,0\n12+400,0\n")
    with pytest.raises(InputError, match=r"write metres: 12\+345\.5 is 12345\.5"):
        design_from_file(path)


def test_an_arc_around_its_own_end_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "line.xml"
    path.write_text(
        '<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2"><Units>'
        '<Metric linearUnit="meter"/></Units>'
        '<Alignments><Alignment name="A"><CoordGeom><Curve rot="ccw" radius="300" length="100">'
        "<Start>0 0</Start>"
        "<Center>0 0</Center><End>16 98</End></Curve></CoordGeom></Alignment></Alignments></LandXML>"
    )
    with pytest.raises(InputError, match="has its centre at an end"):
        design_from_file(path)
