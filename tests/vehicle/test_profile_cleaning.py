"""Measured profiles: what a device writes is cut to what meets, told of, and equals the formula below it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.toml_files import load, shipped
from simrail.vehicle.contact.contact_geometry import build_contact
from simrail.vehicle.contact.contact_pair import incline
from simrail.vehicle.contact.profile_files import profile_notes, profiles_of, rail_profile, wheel_profile
from simrail.vehicle.contact.profiles import rail_60e1, s1002, wheel_depth
from simrail.vehicle.file import VehicleFile

HEADER = "ProgramName=MiniProf for Windows\nStock=%one\nColumnDef=X,Y\nXoffset=0.0000\n\n"
OLD_HEADER = '#MINIWHEELPROF\nCar Number..:\n" 32.58 37.11\n\n'


def traced_wheel() -> tuple[FloatArray, FloatArray]:
    """S1002 as a device traces it, mm: flange's back, tip, tread to 55 mm, chamfer and face of the rim."""
    new = s1002()
    inside = new.lateral_m <= 0.055
    y, z = new.lateral_m[inside][::8] * 1e3, new.depth_m[inside][::8] * 1e3
    angle = np.linspace(np.pi, 0.5 * np.pi, 30)[:-1]
    back_y, back_z = -55.0 + 15.0 * np.cos(angle), 28.0 - 12.0 + 12.0 * np.sin(angle)
    upright = np.linspace(-12.0, 15.5, 40)
    chamfer = np.linspace(0.4, 8.0, 20)
    face = np.linspace(0.5, 6.0, 12)
    rim_y = np.concatenate([y[-1] + chamfer, np.full(12, y[-1] + 8.0) - 0.01 * face])
    rim_z = np.concatenate([z[-1] - 1.2 * chamfer, z[-1] - 9.6 - face])
    return (
        np.concatenate([np.full(40, -70.0), back_y, y, rim_y]),
        np.concatenate([upright, back_z, z, rim_z]),
    )


def written(path: Path, y: FloatArray, z: FloatArray, *, header: str = "", more: str = "") -> Path:
    lines = [f" {a:.4f} {b:.4f}{more}" for a, b in zip(y, z, strict=True)]
    path.write_text(header + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def away_m(path: Path, **options: float) -> float:
    """Largest distance in depth from the formula, outward of the flange's steep part and tip."""
    read = wheel_profile(path, **options)
    assert read.lateral_m[0] == pytest.approx(-0.055, abs=5e-4)
    assert 0.053 < read.lateral_m[-1] < 0.0565
    at = np.linspace(-0.030, 0.052, 500)
    return float(np.abs(wheel_depth(read)(at) - wheel_depth(s1002())(at)).max())


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("backward", [False, True])
def test_a_traced_wheel_is_the_formula_below_it(tmp_path: Path, mirrored: bool, backward: bool) -> None:
    y, z = traced_wheel()
    y = y + 70.0
    if backward:
        y, z = y[::-1], z[::-1]
    path = written(tmp_path / "w.whl", -y if mirrored else y, z, header=HEADER)
    # Rounded to 0.1 um in the file; splines through points 0.4 mm apart are good to less.
    assert away_m(path) < 2e-6
    notes = "; ".join(wheel_profile(path).notes)
    assert "behind the flange's tip" in notes and "of the rim" in notes
    assert f"tape circle is taken at {-70 if mirrored else 70} mm" in notes
    assert ("mirrored" in notes) == mirrored


def test_forms_of_one_wheel_are_one_profile(tmp_path: Path) -> None:
    y, z = traced_wheel()
    base = wheel_profile(written(tmp_path / "a.whl", y + 70.0, z, header=HEADER))
    others = [
        wheel_profile(written(tmp_path / "b.txt", y + 70.0, z, header=HEADER)),
        wheel_profile(written(tmp_path / "c.txt", y + 70.0, z), tape_circle_m=0.07),
        wheel_profile(written(tmp_path / "d.txt", y, z, more=" 0.000 1.5")),
        wheel_profile(
            written(tmp_path / "e.whl", y + 70.0, z, header='#MINIWHEELPROF\nCar No..:\n" 3 4\n\n')
        ),
        wheel_profile(written(tmp_path / "f.whl", y + 66.0, z, header=HEADER), tape_circle_m=0.066),
    ]
    for other in others:
        np.testing.assert_allclose(other.depth_m, base.depth_m, atol=1e-12)
    assert "2 columns beside the first two are not used" in others[2].notes
    inches = wheel_profile(written(tmp_path / "g.txt", y / 25.4, z / 25.4, header="# unit = in\n"))
    at = np.linspace(-0.030, 0.052, 100)
    assert np.abs(wheel_depth(inches)(at) - wheel_depth(base)(at)).max() < 5e-6


@pytest.mark.parametrize(
    ("file", "header", "shift", "factor", "says"),
    [
        ("w.txt", "", 70.0, 1.0, ["tape circle", "flange tip at 15", "tape_circle_mm = 70.0"]),
        ("w.whl", HEADER, 60.0, 1.0, ["back of the flange is not at 0", "-10.0 mm", "tape_circle_mm"]),
        ("w.whl", HEADER.replace("=X,Y", "=Y,X"), 70.0, 1.0, ["ColumnDef", "Y,X"]),
        ("w.whl", HEADER.replace("0.0000", "1.5"), 70.0, 1.0, ["xoffset", "1.5", "add it to the points"]),
        ("w.txt", "", 0.0, 1.0 / 25.4, ["narrow", "# unit = in"]),
        ("w.ban", HEADER, 70.0, 1.0, ["no such profile", ".whl"]),
    ],
)
def test_wheels_that_cannot_be_placed(
    tmp_path: Path, file: str, header: str, shift: float, factor: float, says: list[str]
) -> None:
    y, z = traced_wheel()
    path = written(tmp_path / file, (y + shift) * factor, z * factor, header=header)
    with pytest.raises(InputError) as caught:
        wheel_profile(path)
    for words in says:
        assert words in str(caught.value)


def test_a_named_profile_has_its_own_tape_circle() -> None:
    with pytest.raises(InputError, match="tape_circle_mm: belongs to a profile from a file"):
        wheel_profile("S1002", tape_circle_m=0.07)


def traced_rail() -> tuple[FloatArray, FloatArray]:
    """The 60E1 head with the underside that a device reaches, mm, depth positive."""
    rail = rail_60e1()
    y, z = rail.lateral_m[::6] * 1e3, rail.depth_m[::6] * 1e3
    under = np.linspace(0.5, 8.0, 12)
    y = np.concatenate([(y[0] + 1.5 * under)[::-1], y, y[-1] - 1.5 * under])
    z = np.concatenate([(z[0] + 0.5 * under)[::-1], z, z[-1] + 0.5 * under])
    return y, z


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("file", ["r.ban", "r.txt"])
def test_a_traced_head_is_the_formula_below_it(tmp_path: Path, file: str, backward: bool) -> None:
    y, z = traced_rail()
    if backward:
        y, z = y[::-1], z[::-1]
    ban = file == "r.ban"
    read = rail_profile(written(tmp_path / file, y, -z if ban else z, header=HEADER if ban else ""))
    new = rail_60e1()
    head = np.abs(read.lateral_m) < 0.035
    away = read.depth_m - np.interp(read.lateral_m, new.lateral_m, new.depth_m)
    slope = np.gradient(read.depth_m, read.lateral_m)
    # Rounding of either coordinate to 0.1 um, and 0.03 um of the chords of the formula's points.
    assert (np.abs(away)[head] < 1e-7 * (1.0 + np.abs(slope[head]))).all()
    gauges = [incline(rail, 1.0 / 40.0, gauge_depth_m=0.014).gauge_abscissa_m for rail in (read, new)]
    # The top of a crown of 300 mm moves by 300 mm times the slope that rounding over a step of 0.3 mm makes.
    assert gauges[0] == pytest.approx(gauges[1], abs=0.3 * 0.05e-6 / 0.3e-3)
    notes = "; ".join(read.notes)
    assert "under the head on the gauge side" in notes and "under the head on the field side" in notes


def test_the_gauge_side_is_the_one_that_was_measured(tmp_path: Path) -> None:
    y, z = rail_60e1().lateral_m[::6] * 1e3, rail_60e1().depth_m[::6] * 1e3
    part = y < 20.0
    right = rail_profile(written(tmp_path / "r.txt", y[part], z[part]))
    turned = rail_profile(written(tmp_path / "l.txt", -y[part], z[part]))
    np.testing.assert_allclose(turned.lateral_m, right.lateral_m, atol=1e-12)
    assert not any("mirrored" in note for note in right.notes)
    assert any("right side only" in note and "mirrored" in note for note in turned.notes)


def test_kinds_are_told_apart_by_their_shape(tmp_path: Path) -> None:
    rail = rail_60e1()
    with pytest.raises(InputError, match=r"goes down on both sides.*rail_profile"):
        wheel_profile(written(tmp_path / "r.txt", rail.lateral_m[::6] * 1e3, rail.depth_m[::6] * 1e3))
    y, z = traced_wheel()
    with pytest.raises(InputError, match=r"folds back|no highest point"):
        rail_profile(written(tmp_path / "w.txt", y, z))


@pytest.mark.parametrize(("scatter_mm", "told"), [(0.0, False), (0.0002, False), (0.005, True)])
def test_scatter_is_warned_of_with_its_size(tmp_path: Path, scatter_mm: float, told: bool) -> None:
    y, z = traced_wheel()
    noisy = z + scatter_mm * np.random.default_rng(1).standard_normal(z.size)
    notes = [n for n in wheel_profile(written(tmp_path / "w.txt", y, noisy)).notes if "scatter by" in n]
    assert bool(notes) == told
    if told:
        assert float(notes[0].split("scatter by ")[1].split()[0]) == pytest.approx(5.0, rel=0.3)


def test_contact_of_a_traced_pair_is_that_of_the_formulas(tmp_path: Path) -> None:
    y, z = traced_wheel()
    wheel = wheel_profile(written(tmp_path / "w.whl", y + 70.0, z, header=HEADER))
    y, z = traced_rail()
    rail = rail_profile(written(tmp_path / "r.ban", y, -z, header=HEADER))
    made = build_contact(s1002(), rail_60e1(), static_load_n=53e3)
    read = build_contact(wheel, rail, static_load_n=53e3)
    assert read.split_m == pytest.approx(made.split_m, abs=2e-4)


def test_a_vehicle_file_says_where_the_tape_circle_lies(tmp_path: Path) -> None:
    y, z = traced_wheel()
    written(tmp_path / "w.txt", y + 70.0, z)
    text = shipped("vehicle")["irw_axle"].read_text(encoding="utf-8")
    text = text.replace('wheel_profile = "S1002"', 'wheel_profile = "./w.txt"\ntape_circle_mm = 70.0')
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    pair = load(VehicleFile, "vehicle", str(tmp_path / "mine.toml")).model("mine").wheel_rail
    assert profiles_of(pair)[0].lateral_m[0] == pytest.approx(-0.055, abs=1e-9)
    assert all(note.startswith("w.txt: ") for note in profile_notes(pair))
