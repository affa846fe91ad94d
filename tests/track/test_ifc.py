"""The line of the LandXML tests as an IFC 4.3 alignment: the same track, within 1 mm and 1e-7 1/m."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.track.foreign_file import design_from_file
from tests.track.test_foreign_file import (
    CANT,
    HEADING,
    LENGTH,
    MAIN_LINE,
    PVI,
    STA,
    START,
    VERTICAL_M,
    bend_of,
    by_quadrature,
    judge,
    landxml,
    written,
)

BASE_M = 1.5


class Step:
    """A STEP file that grows: entities by their numbers."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def add(self, text: str) -> str:
        """Write an entity; GUID stands for a new global id."""
        number = len(self.lines) + 1
        self.lines.append(f"#{number}={text.replace('GUID', repr(f'{number:0>22}'))};")
        return f"#{number}"

    @property
    def text(self) -> str:
        head = (
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n"
            "FILE_NAME('','',(''),(''),'','','');\nFILE_SCHEMA(('IFC4X3_ADD2'));\nENDSEC;\nDATA;\n"
        )
        return head + "\n".join(self.lines) + "\nENDSEC;\nEND-ISO-10303-21;\n"


def number(value: float) -> str:
    text = f"{value:.12f}"
    return text.rstrip("0") if "." in text else text


def nest(step: Step, whole: str, parts: list[str]) -> None:
    step.add(f"IFCRELNESTS(GUID,$,$,$,{whole},({','.join(parts)}))")


def segments(step: Step, whole: str, said: list[str]) -> None:
    nest(step, whole, [step.add(f"IFCALIGNMENTSEGMENT(GUID,$,$,$,$,$,$,{one})") for one in said])


def plan(step: Step, per_m: float) -> str:
    part = step.add("IFCALIGNMENTHORIZONTAL(GUID,$,$,$,$,$,$)")
    ends = np.cumsum([0.0, *(row[1] for row in MAIN_LINE)])
    points = START + by_quadrature(ends)[0]
    said, yaw = [], HEADING
    kinds = {"Line": "LINE", "Curve": "CIRCULARARC", "Spiral": "CLOTHOID"}
    for point, row in zip(points, [*MAIN_LINE, ("Line", 0.0, math.inf, math.inf)], strict=True):
        at = step.add(f"IFCCARTESIANPOINT(({number(point.real * per_m)},{number(point.imag * per_m)}))")
        radii = [0.0 if math.isinf(r) else r * per_m for r in row[2:]]
        said.append(
            step.add(
                f"IFCALIGNMENTHORIZONTALSEGMENT($,$,{at},{number(yaw)},{number(radii[0])},"
                f"{number(radii[1])},{number(row[1] * per_m)},$,.{kinds[row[0]]}.)"
            )
        )
        yaw += 0.5 * (bend_of(row, 0.0) + bend_of(row, row[1])) * row[1] if row[1] else 0.0
    segments(step, part, said)
    return part


def profile(step: Step, per_m: float) -> str:
    part = step.add("IFCALIGNMENTVERTICAL(GUID,$,$,$,$,$,$)")
    stations, heights = zip(*PVI, strict=True)
    slopes = np.diff(heights) / np.diff(stations)
    said, at, z = [], 0.0, heights[0]

    def one(length: float, first: float, last: float, kind: str) -> None:
        nonlocal at, z
        said.append(
            step.add(
                f"IFCALIGNMENTVERTICALSEGMENT($,$,{number(at * per_m)},{number(length * per_m)},"
                f"{number(z * per_m)},{number(first)},{number(last)},$,.{kind}.)"
            )
        )
        at, z = at + length, z + 0.5 * (first + last) * length

    for i in (1, 2):
        half = 0.5 * VERTICAL_M[stations[i]]
        one(stations[i] - half - at, slopes[i - 1], slopes[i - 1], "CONSTANTGRADIENT")
        one(2.0 * half, slopes[i - 1], slopes[i], "PARABOLICARC")
    one(LENGTH - at, slopes[2], slopes[2], "CONSTANTGRADIENT")
    segments(step, part, said)
    return part


def cant(step: Step, per_m: float) -> str:
    part = step.add(f"IFCALIGNMENTCANT(GUID,$,$,$,$,$,$,{number(BASE_M * per_m)})")
    said = []
    for (a, first), (b, last) in zip([(0.0, 0), *CANT], CANT, strict=False):
        left, length = a < 560.0 and b < 560.0, b - a
        if length <= 0.0:
            continue
        raised = [number(1e-3 * mm * per_m) for mm in (first, last)]
        sides = [*raised, "0.", "0."] if left else ["0.", "0.", *raised]
        kind = "CONSTANTCANT" if first == last else "LINEARTRANSITION"
        said.append(
            step.add(
                f"IFCALIGNMENTCANTSEGMENT($,$,{number(a * per_m)},{number(length * per_m)},"
                f"{','.join(sides)},.{kind}.)"
            )
        )
    segments(step, part, said)
    return part


def ifc(per_m: float = 1.0) -> str:
    """The line, with so many units of length to a metre: 1 or 1000."""
    step = Step()
    prefix = "$" if per_m == 1.0 else ".MILLI."
    length = step.add(f"IFCSIUNIT(*,.LENGTHUNIT.,{prefix},.METRE.)")
    angle = step.add("IFCSIUNIT(*,.PLANEANGLEUNIT.,$,.RADIAN.)")
    units = step.add(f"IFCUNITASSIGNMENT(({length},{angle}))")
    step.add(f"IFCPROJECT(GUID,$,'p',$,$,$,$,$,{units})")
    alignment = step.add("IFCALIGNMENT(GUID,$,'main',$,$,$,$,$)")
    referent = step.add("IFCREFERENT(GUID,$,'start',$,$,$,$,.STATION.)")
    station = step.add(f"IFCPROPERTYSINGLEVALUE('Station',$,IFCLENGTHMEASURE({number(STA * per_m)}),$)")
    pset = step.add(f"IFCPROPERTYSET(GUID,$,'Pset_Stationing',$,({station}))")
    step.add(f"IFCRELDEFINESBYPROPERTIES(GUID,$,$,$,({referent}),{pset})")
    nest(step, alignment, [plan(step, per_m), profile(step, per_m), cant(step, per_m)])
    nest(step, alignment, [referent])
    return step.text


@pytest.mark.parametrize("per_m", [1.0, 1000.0])
def test_ifc_is_the_formula(tmp_path: Path, per_m: float) -> None:
    pytest.importorskip("ifcopenshell")
    design, _ = design_from_file(written(tmp_path, "line.ifc", ifc(per_m)))
    judge(design, heading=HEADING)
    assert design.start_m == pytest.approx(STA)
    assert design.frame(STA).position[2] == pytest.approx(400.0)


def test_ifc_and_landxml_give_one_track(tmp_path: Path) -> None:
    pytest.importorskip("ifcopenshell")
    one, _ = design_from_file(written(tmp_path, "line.ifc", ifc()))
    other, _ = design_from_file(written(tmp_path, "line.xml", landxml()))
    s = np.linspace(STA, STA + LENGTH - 1e-5, 500)
    a, b = one.frame(s), other.frame(s)
    assert np.abs(a.position - b.position).max() < 1e-3
    assert np.abs(one.curvature(s) - other.curvature(s)).max() < 1e-7
    assert np.abs(a.roll_rad - b.roll_rad).max() < 1e-6


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (".CLOTHOID.", ".BLOSSCURVE.", r"IfcAlignmentHorizontal\[1\].*BLOSSCURVE.*CSV of curvature"),
        (",-900.", ",900.", "kink, or a radius has the wrong sign"),
        ("IFC4X3_ADD2", "IFC4", "no alignments with segments.*IFC 4.3, or as LandXML"),
        ("IFCALIGNMENT(", "IFCRAILWAY(", "no IfcAlignment"),
    ],
)
def test_what_is_not_read_is_refused_by_name(tmp_path: Path, old: str, new: str, says: str) -> None:
    pytest.importorskip("ifcopenshell")
    text = ifc()
    assert old in text
    with pytest.raises(InputError, match=says) as refused:
        design_from_file(written(tmp_path, "line.ifc", text.replace(old, new)))
    assert "\n" not in str(refused.value)


def test_a_library_that_is_not_there_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ifcopenshell", None)
    with pytest.raises(InputError, match=r"ifcopenshell, which is not installed.*simrail\[ifc\].*LandXML"):
        design_from_file(written(tmp_path, "line.ifc", ifc()))
