"""Lines from LandXML and from a table of curvature: against quadrature of the clothoid's formula."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from simrail.cli.main import call
from simrail.cli.templates import write_track
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.toml_files import read_toml
from simrail.track.curvature_csv import read_curvature_csv
from simrail.track.design import Curve, TrackDesign, Transition
from simrail.track.file import track_by_name
from simrail.track.foreign_file import design_from_file

MAIN_LINE = [
    # kind, length, radius at the start and the end, positive to the left
    ("Line", 180.25, math.inf, math.inf),
    ("Spiral", 80.5, math.inf, -900.0),
    ("Curve", 210.4, -900.0, -900.0),
    ("Spiral", 80.5, -900.0, math.inf),
    ("Spiral", 65.3, math.inf, 700.0),
    ("Curve", 150.7, 700.0, 700.0),
    ("Spiral", 40.2, 700.0, 1500.0),
    ("Curve", 90.1, 1500.0, 1500.0),
    ("Spiral", 55.6, 1500.0, math.inf),
    ("Line", 160.45, math.inf, math.inf),
]
"""A straight, a curve with clothoids, reverse clothoids, an egg curve: 1114 m."""

START, HEADING, STA = 2.5e6 + 1.2e6j, 0.7, 1000.0
LENGTH = sum(row[1] for row in MAIN_LINE)
CANT = [(180.25, 0), (260.75, 90), (471.15, 90), (551.65, 0), (616.95, 110), (767.65, 110), (807.85, 50)]
CANT += [(897.95, 50), (953.55, 0), (1114.0, 0)]
"""Place along the line, cant in mm; the fifth to eighth in a left curve, those before in a right one."""
PVI = [(0.0, 400.0), (300.0, 403.0), (800.0, 397.0), (1114.0, 399.198)]
VERTICAL_M = {300.0: 110.0, 800.0: 95.0}


def bend_of(row: tuple[str, float, float, float], u: float) -> float:
    _, length, start, end = row
    return 1.0 / start + (1.0 / end - 1.0 / start) * u / length


def by_quadrature(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coordinates relative to the start (n, complex) and curvature, of the formula."""
    points, bends = [], []
    for place in places:
        z, yaw, left, k = 0j, HEADING, float(place), 0.0
        for row in MAIN_LINE:
            along = min(row[1], left)
            k0, rate = bend_of(row, 0.0), (bend_of(row, 1.0) - bend_of(row, 0.0))

            def angle(u: float, yaw: float = yaw, k0: float = k0, rate: float = rate) -> float:
                return yaw + k0 * u + 0.5 * rate * u * u

            parts = [
                quad(lambda u, f=f, a=angle: f(a(u)), 0.0, along, epsabs=1e-12)[0] for f in (np.cos, np.sin)
            ]
            z, yaw, left, k = z + complex(*parts), angle(along), left - along, k0 + rate * along
            if left <= 0.0:
                break
        points.append(z)
        bends.append(k)
    return np.array(points), np.array(bends)


def height(s: float) -> float:
    """Of the profile: tangents and parabolas by their textbook formula."""
    stations, heights = zip(*PVI, strict=True)
    slopes = np.diff(heights) / np.diff(stations)
    for i in (1, 2):
        at, length = stations[i], VERTICAL_M[stations[i]]
        if abs(s - at) <= 0.5 * length:
            u = s - (at - 0.5 * length)
            begin = heights[i] - 0.5 * length * slopes[i - 1]
            return float(begin + slopes[i - 1] * u + 0.5 * (slopes[i] - slopes[i - 1]) / length * u * u)
    return float(np.interp(s, stations, heights))


def landxml(unit: float = 1.0) -> str:
    """The line as LandXML, lengths in a unit."""
    ends = np.cumsum([0.0, *(row[1] for row in MAIN_LINE)])
    points, _ = by_quadrature(ends)
    points = START + points

    def at(tag: str, z: complex) -> str:
        return f"<{tag}>{z.imag / unit:.9f} {z.real / unit:.9f}</{tag}>"

    parts, yaw = [], HEADING
    for i, row in enumerate(MAIN_LINE):
        kind, length, start, end = row
        a, b = points[i], points[i + 1]
        side = "cw" if min(start, end) < 0.0 else "ccw"
        turn = 0.5 * (bend_of(row, 0.0) + bend_of(row, length)) * length
        own = f'length="{length / unit:.10f}"'
        inner = at("Start", a) + at("End", b)
        if kind == "Curve":
            own += f' rot="{side}" radius="{abs(start) / unit:.10f}" crvType="arc"'
            inner += at("Center", a + start * 1j * np.exp(1j * yaw))
        elif kind == "Spiral":
            radii = [("INF" if math.isinf(r) else f"{abs(r) / unit:.10f}") for r in (start, end)]
            own += f' rot="{side}" spiType="clothoid" radiusStart="{radii[0]}" radiusEnd="{radii[1]}"'
            # Where the tangents meet.
            d0, d1 = np.exp(1j * yaw), np.exp(1j * (yaw + turn))
            t = ((b - a) * np.conj(d1)).imag / (d0 * np.conj(d1)).imag
            inner += at("PI", a + t * d0)
        parts.append(f"<{kind} {own}>{inner}</{kind}>")
        yaw += turn
    cant = [
        f'<CantStation station="{(STA + s) / unit:.9f}" appliedCant="{mm}" '
        f'curvature="{"ccw" if s > 560.0 else "cw"}"/>'
        for s, mm in CANT
    ]
    profile = []
    for s, z in PVI:
        length = VERTICAL_M.get(s)
        tag = "PVI" if length is None else "ParaCurve"
        own = "" if length is None else f' length="{length / unit:.10f}"'
        profile.append(f"<{tag}{own}>{(STA + s) / unit:.9f} {z / unit:.9f}</{tag}>")
    return (
        '<?xml version="1.0"?><LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2" version="1.2">'
        '<Units><Metric linearUnit="meter"/></Units>'
        f'<Alignments><Alignment name="main" staStart="{STA / unit:.9f}"><CoordGeom>{"".join(parts)}'
        f"</CoordGeom><Profile><ProfAlign>{''.join(profile)}</ProfAlign></Profile>"
        f'<Cant gauge="{1.435 / unit:.6f}" rotationPoint="center">{"".join(cant)}</Cant>'
        "</Alignment></Alignments></LandXML>"
    )


def changed(old: str, new: str) -> str:
    text = landxml()
    assert old in text
    return text.replace(old, new)


def table(step: float) -> str:
    """The line as a table, rows a step apart whatever its joints."""
    s = np.append(np.arange(0.0, LENGTH, step), LENGTH)
    ends = np.cumsum([0.0, *(row[1] for row in MAIN_LINE)])
    at = np.minimum(np.searchsorted(ends, s, side="right") - 1, len(MAIN_LINE) - 1)
    bends = [bend_of(MAIN_LINE[i], place - ends[i]) for i, place in zip(at, s, strict=True)]
    cant = np.interp(s, *zip(*CANT, strict=True))
    stations, heights = (np.array(part) for part in zip(*PVI, strict=True))
    slopes = np.diff(heights) / np.diff(stations)
    places, values = [0.0], [slopes[0]]
    for i in (1, 2):
        half = 0.5 * VERTICAL_M[stations[i]]
        places += [stations[i] - half, stations[i] + half]
        values += [slopes[i - 1], slopes[i]]
    grade = 1e3 * np.interp(s, places, values)
    rows = [
        f"{STA + p:.4f},{k:.12f},{c:.6f},{g:.9f}" for p, k, c, g in zip(s, bends, cant, grade, strict=True)
    ]
    return "\n".join(["s [m],curvature [1/m],cant [mm],gradient [permil]", *rows]) + "\n"


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def judge(design: TrackDesign, *, heading: float) -> None:
    """Within 1 mm and 1e-7 1/m of the formulas: plan, curvature, cant, height."""
    assert design.length_m == pytest.approx(LENGTH, abs=1e-6)
    s = np.linspace(0.0, LENGTH, 38)
    points, bends = by_quadrature(s)
    on_track = np.clip(STA + s, design.start_m, design.end_m)
    frame = design.frame(on_track)
    found = frame.position[:, 0] + 1j * frame.position[:, 1]
    assert np.abs(found - points * np.exp(1j * (heading - HEADING))).max() < 1e-3
    assert np.abs(design.curvature(on_track) - bends).max() < 1e-7
    # In the right curve the left rail is raised.
    level = np.interp(s, *zip(*CANT, strict=True)) * np.where(s < 560.0, 1.0, -1.0)
    assert np.abs(1500.0 * np.sin(frame.roll_rad) - level).max() < 1e-3
    z = np.array([height(float(place)) for place in s])
    assert np.abs(frame.position[:, 2] - frame.position[0, 2] - (z - z[0])).max() < 1e-3


@pytest.mark.parametrize(
    ("unit", "word"), [(1.0, "meter"), (1200.0 / 3937.0, "USSurveyFoot"), (0.3048, "foot")]
)
def test_landxml_is_the_formula(tmp_path: Path, unit: float, word: str) -> None:
    text = landxml(unit).replace('Metric linearUnit="meter"', f'Metric linearUnit="{word}"')
    design, notes = design_from_file(written(tmp_path, "line.xml", text))
    judge(design, heading=HEADING)
    assert design.start_m == pytest.approx(STA)
    assert design.frame(STA).position[2] == pytest.approx(400.0)
    assert any("begins at east 2500000.000 m, north 1200000.000 m" in note for note in notes)
    assert not any("beside the coordinates" in note for note in notes)
    egg = design.elements[6]
    assert isinstance(egg, Transition)


@pytest.mark.parametrize("step", [1.0, 5.0])
def test_a_table_is_the_formula_though_its_rows_miss_the_joints(tmp_path: Path, step: float) -> None:
    design, _ = design_from_file(written(tmp_path, "line.csv", table(step)))
    judge(design, heading=0.0)
    assert len(design.elements) == len(MAIN_LINE)


def test_both_files_give_one_track(tmp_path: Path) -> None:
    one, _ = design_from_file(written(tmp_path, "line.xml", landxml()))
    other, _ = design_from_file(written(tmp_path, "line.csv", table(2.0)))
    s = np.linspace(STA, STA + LENGTH - 1e-5, 500)
    a, b = one.frame(s), other.frame(s)
    turned = (b.position[:, 0] + 1j * b.position[:, 1]) * np.exp(1j * HEADING)
    assert np.abs(a.position[:, 0] + 1j * a.position[:, 1] - turned).max() < 1e-3
    assert np.abs(one.curvature(s) - other.curvature(s)).max() < 1e-7
    assert np.abs(a.roll_rad - b.roll_rad).max() < 1e-6


def test_the_other_side_and_the_other_curvature_word_make_the_mirrored_line(tmp_path: Path) -> None:
    plain, _ = design_from_file(written(tmp_path, "line.csv", table(2.0)))
    rows = [line.split(",") for line in table(2.0).splitlines()]
    turned = [[a, f"{-float(k):.12f}", c, g] for a, k, c, g in rows[1:]]
    text = "\n".join([",".join(rows[0]), *(",".join(row) for row in turned)])
    mirror, _ = design_from_file(written(tmp_path, "mirror.csv", text))
    s = np.linspace(STA, STA + LENGTH - 1e-5, 50)
    np.testing.assert_allclose(mirror.frame(s).position[:, 1], -plain.frame(s).position[:, 1], atol=1e-6)
    np.testing.assert_allclose(mirror.frame(s).roll_rad, -plain.frame(s).roll_rad, atol=1e-9)


def test_straights_and_arcs_may_be_told_by_their_points_alone(tmp_path: Path) -> None:
    """An arc to the right turns clockwise from its start to its end, by less than a whole turn."""
    text = re.sub(r'(<(?:Line|Curve)) length="[^"]*"', r"\1", landxml())
    bare = re.sub(r'(<Curve rot="\w+") radius="[^"]*"', r"\1", text)
    assert bare.count("<Curve rot=") == 3 and "<Line>" in bare
    told, found = (design_from_file(written(tmp_path, "line.xml", one))[0] for one in (landxml(), bare))
    lengths = [[element.length_m for element in design.elements] for design in (told, found)]
    assert lengths[1] == pytest.approx(lengths[0], abs=1e-5)
    radii = [[e.radius_m for e in design.elements if isinstance(e, Curve)] for design in (told, found)]
    assert radii[1] == pytest.approx(radii[0], rel=1e-6)


def test_a_circular_vertical_curve_is_as_long_as_its_radius_turns(tmp_path: Path) -> None:
    """Its length is its radius times the change of the slope."""
    text = landxml()
    slopes = [(b[1] - a[1]) / (b[0] - a[0]) for a, b in itertools.pairwise(PVI)]
    for (s, length), before, after in zip(VERTICAL_M.items(), slopes, slopes[1:], strict=False):
        old, new = (
            f'<ParaCurve length="{length:.10f}">',
            f'<CircCurve radius="{length / abs(after - before):.10f}">',
        )
        assert text.count(old) == 1, s
        text = text.replace(old, new)
    text = text.replace("</ParaCurve>", "</CircCurve>")
    parabolas, circles = (
        design_from_file(written(tmp_path, "line.xml", one))[0] for one in (landxml(), text)
    )
    assert circles.vertical_radius_m == pytest.approx(parabolas.vertical_radius_m, rel=1e-9)


def test_a_profile_that_begins_before_the_plan_has_its_height_where_the_plan_begins(tmp_path: Path) -> None:
    before = f"<ProfAlign><PVI>{STA - 100.0} 390</PVI><PVI>{STA - 50.0} 396</PVI>"
    design, _ = design_from_file(written(tmp_path, "line.xml", changed("<ProfAlign>", before)))
    plain, _ = design_from_file(written(tmp_path, "plain.xml", landxml()))
    s = design.start_m + np.array([0.0, 100.0, 300.0, 900.0])
    np.testing.assert_allclose(design.frame(s).position[:, 2], plain.frame(s).position[:, 2], atol=1e-6)


def test_chainage_breaks_are_mapped(tmp_path: Path) -> None:
    text = changed(
        "</CoordGeom>", '</CoordGeom><StaEquation staInternal="1500" staBack="1500" staAhead="2000"/>'
    )
    design, notes = design_from_file(written(tmp_path, "line.xml", text))
    assert design.chainage_m([1499.0, 1500.0, 1600.0]).tolist() == [1499.0, 2000.0, 2100.0]
    assert "chainage break: at s = 1500.000 m, 1500.000 becomes 2000.000 m" in notes


def test_steps_are_smoothed_and_told(tmp_path: Path) -> None:
    text = "s_m,radius_m\n0,0\n100,0\n100,300\n150,300\n150,0\n300,0\n"
    design, notes = design_from_file(written(tmp_path, "tram.csv", text), step_smoothing_m=6.0)
    assert design.frame(300.0).yaw_rad == pytest.approx(50.0 / 300.0, rel=1e-9)
    assert any("steps at 2 places, by 1/300 m at most" in note and "6 m" in note for note in notes)


def test_a_negative_radius_in_a_table_is_a_curve_to_the_right(tmp_path: Path) -> None:
    text = "s_m,radius_m\n0,0\n100,0\n100,-300\n150,-300\n150,0\n300,0\n"
    design, _ = design_from_file(written(tmp_path, "tram.csv", text), step_smoothing_m=6.0)
    assert design.frame(300.0).yaw_rad == pytest.approx(-50.0 / 300.0, rel=1e-9)


def test_signs_of_cant_in_a_table(tmp_path: Path) -> None:
    head = "s_m,curvature_1pm,{}\n"
    rows = [(0, 0.002, 50), (50, 0.002, 50), (100, -0.002, -50), (150, -0.002, -50)]
    for name, sign in (("cant_mm", 1), ("cross_level_mm", -1)):
        body = "".join(f"{s},{k},{sign * c}\n" for s, k, c in rows)
        design = design_from_file(written(tmp_path, "a.csv", head.format(name) + body))[0]
        assert 1500.0 * np.sin(design.frame(20.0).roll_rad) == pytest.approx(-50.0)
        assert 1500.0 * np.sin(design.frame(130.0).roll_rad) == pytest.approx(50.0)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (
            'spiType="clothoid"',
            'spiType="bloss"',
            ["CoordGeom[1].Spiral.spiType", "bloss", "CSV of curvature"],
        ),
        ('rot="cw"', 'rot="left"', ["rot", "left", "cw, ccw"]),
        ("<Line ", "<IrregularLine ", ["CoordGeom[0]", "IrregularLine"]),
        ('linearUnit="meter"', 'linearUnit="furlong"', ["Units.linearUnit", "furlong"]),
        ('rot="cw" radius', 'rot="ccw" radius', ["kink", "mrad"]),
        ('radius="900.0', 'radius="800.0', ["another line than the coordinates"]),
        ("<ParaCurve", "<UnsymParaCurve", ["ProfAlign[1]", "UnsymParaCurve"]),
        ("<LandXML ", "<KML ", ["is no LandXML", "KML"]),
        ("</CoordGeom>", "", ["not readable XML"]),
        ('length="80.5000000000"', 'length="long"', ["CoordGeom[1].Spiral.length", "long"]),
    ],
)
def test_what_is_not_read_is_refused_by_name(tmp_path: Path, old: str, new: str, says: list[str]) -> None:
    text = changed(old, new)
    for tag in ("IrregularLine", "UnsymParaCurve", "KML"):
        if f"<{tag}" in text:
            text = text.replace({"I": "</Line>", "U": "</ParaCurve>", "K": "</LandXML>"}[tag[0]], f"</{tag}>")
    with pytest.raises(InputError) as caught:
        design_from_file(written(tmp_path, "line.xml", text))
    for words in ("line.xml", *says):
        assert words in str(caught.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("s_m,curvature_1pm\n0,0\n10,0\n5,0\n", ["row 4: places fall"]),
        ("s,curvature_1pm\n0,0\n10,0\n", ["s: has no unit", "s [m]"]),
        ("s_m,cant_mm\n0,0\n10,0\n", ["no curvature"]),
        ("a,b\n0,0\n", ["no place"]),
        ("s_m,curvature_1pm\n0,0\n10,x\n", ["curvature_1pm, row 3", "'x'"]),
        ("s_m,curvature_furlong\n0,0\n", ["no unit that is known", "1/m"]),
    ],
)
def test_tables_that_are_none(tmp_path: Path, text: str, says: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        design_from_file(written(tmp_path, "t.csv", text))
    for words in ("t.csv", *says):
        assert words in str(caught.value)


def test_the_command_writes_a_track_that_reads_back(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    two = landxml().replace("</Alignments>", '<Alignment name="siding"><CoordGeom/></Alignment></Alignments>')
    source = written(tmp_path, "two.xml", two)
    command = ["new", "track", "line", "--from", str(source), "--in", str(tmp_path)]
    assert call(command) == 2
    assert "--alignment 'main'" in capsys.readouterr().err
    assert call([*command, "--alignment", "main"]) == 0
    assert "cant is taken in mm: 110.0 mm at most" in capsys.readouterr().out
    judge(track_by_name(str(tmp_path / "line.toml")), heading=HEADING)
    assert call(["new", "vehicle", "v", "--from", str(source), "--in", str(tmp_path)]) == 2
    assert "belongs to a track" in capsys.readouterr().err


def test_a_track_has_the_name_that_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not that of the line it comes from, or two of one export were one; what is asked is handed on."""
    asked: dict[str, object] = {}

    def read(path: Path, **more: object) -> tuple[TrackDesign, list[str]]:
        asked.update(more, path=path)
        return TrackDesign("of the export", 0.0, (Curve(90.0, 300.0),)), ["a note"]

    monkeypatch.setattr("simrail.track.foreign_file.design_from_file", read)
    source = tmp_path / "export.xml"
    path, notes = write_track("siding", source, folder=tmp_path, alignment="two", step_smoothing_m=6.0)
    assert asked == {"path": source, "alignment": "two", "step_smoothing_m": 6.0}
    assert path == tmp_path / "siding.toml" and notes == ["a note"]
    head = read_toml(path)
    assert (head["name"], head["title"]) == ("siding", "Track siding")
    assert path.read_text(encoding="utf-8").startswith("# a note\n")


def test_rows_on_a_line_make_one_piece(tmp_path: Path) -> None:
    s = np.arange(0.0, 20001.0)
    text = "s_m,curvature_1pm\n" + "".join(f"{p},{1e-7 * min(p, 10000.0):.9f}\n" for p in s)
    drawn = read_curvature_csv(written(tmp_path, "long.csv", text))
    assert [round(piece.length_m) for piece in drawn.pieces] == [10000, 10000]
