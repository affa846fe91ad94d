"""Profiles from files and by name: what a header asks for, published files, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import load, shipped
from simrail.vehicle.contact.contact_geometry import build_contact
from simrail.vehicle.contact.contact_pair import incline
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.contact.profile_files import profiles_digest, rail_profile, wheel_profile
from simrail.vehicle.contact.profiles import conical_wheel, rail_60e1, s1002, scaled, wheel_depth
from simrail.vehicle.contact.wheelset import conicity
from simrail.vehicle.file import VehicleFile

# Profiles of the Manchester contact benchmark (CONTACT, Apache-2.0), read where they lie beside the
# checkout and not part of it.
SHARED = Path(__file__).parents[3] / "shared" / "data"
HEADER = """! made for a test
  header.begin
    version = 1 ! flag
    type = {type}
  header.end
  spline.begin
    comment        = 'a profile = with a mark'  ! said so
    shift.y        = {shift_y}   ! 2: y shift
    shift.z        = {shift_z}
    rotate         = {rotate}
    bound.y.min    = {low}
    bound.y.max    = {high}
    mirror.y       = {mirror_y}
    mirror.z       = {mirror_z}
!   units.len      = 'mm'
    units.len.f    = {unit}
    units.ang.f    = 1.0
    point.begin
{points}
    point.end
  spline.end
"""
PLAIN = {"shift_y": 0, "shift_z": 0, "rotate": 0, "low": 1, "high": 0, "mirror_y": 0, "mirror_z": 0}


def rows(y, z):
    return "\n".join(f"{a:.9e} {b:.9e}" for a, b in zip(y, z, strict=True))


def simpack(path, y, z, *, unit=1e3, **header):
    text = HEADER.format(
        **(PLAIN | {"type": int(path.suffix == ".prw")} | header), unit=unit, points=rows(y, z)
    )
    path.write_text(text)
    return path


def every_third(profile):
    return profile.lateral_m[::3], profile.depth_m[::3]


@pytest.mark.skipif(not SHARED.is_dir(), reason="benchmark profiles are not here")
def test_benchmark_wheel_file_is_the_formulas_to_2e_6_mm():
    wheel = wheel_profile(SHARED / "MBench_S1002_v3.prw")
    away_mm = np.abs(wheel.depth_m - wheel_depth(s1002())(wheel.lateral_m)) * 1e3
    # Three points stand at joints of the formula, which a spline of 0.05 mm rounds by 1e-5 mm.
    assert np.sort(away_mm)[-4] < 2e-6
    assert away_mm.max() < 1.5e-5
    assert wheel.lateral_m[0] == pytest.approx(-0.055, abs=2e-4)
    assert wheel.lateral_m[-1] == pytest.approx(0.060, abs=1e-9)


@pytest.mark.skipif(not SHARED.is_dir(), reason="benchmark profiles are not here")
def test_benchmark_rail_file_is_the_leaning_60e1_to_a_micrometre():
    read = incline(rail_profile(SHARED / "MBench_UIC60_v3.prr"), 0.0, gauge_depth_m=0.014)
    made = incline(rail_60e1(), 1.0 / 40.0, gauge_depth_m=0.014)
    e = np.linspace(-0.041, 0.018, 500)
    away = np.abs(read.depth(e) - made.depth(e)) / np.hypot(1.0, made.slope(e))
    assert away.max() < 1e-6
    assert read.gauge_abscissa_m == pytest.approx(made.gauge_abscissa_m, abs=1e-6)


def test_every_step_of_the_header_is_undone(tmp_path):
    new = s1002()
    y, z = every_third(new)
    cases = {
        "plain": (y * 1e3, z * 1e3, {}),
        "metres": (y, z, {"unit": 1.0}),
        "flange to the right": (-y * 1e3, z * 1e3, {}),
        "reversed": (y[::-1] * 1e3, z[::-1] * 1e3, {}),
        "mirrored": (y * 1e3, -z * 1e3, {"mirror_y": 1, "mirror_z": 1}),
        # In the header's order: shift, rotate, then mirror. What stands in the file is taken back.
        "shifted": (y * 1e3 - 3.0, z * 1e3 - 7.0, {"shift_y": 3.0, "shift_z": 7.0}),
        "rotated": (
            y * 1e3 * np.cos(0.1) + z * 1e3 * np.sin(0.1) - 3.0,
            -y * 1e3 * np.sin(0.1) + z * 1e3 * np.cos(0.1),
            {"shift_y": 3.0, "rotate": 0.1},
        ),
        "shifted, then mirrored": (-y * 1e3 - 3.0, z * 1e3, {"shift_y": 3.0, "mirror_y": 1}),
    }
    for name, (file_y, file_z, header) in cases.items():
        wheel = wheel_profile(simpack(tmp_path / "w.prw", file_y, file_z, **header))
        assert np.abs(wheel.depth_m - wheel_depth(new)(wheel.lateral_m)).max() < 2e-8, name
        assert wheel.lateral_m[0] == pytest.approx(-0.055, abs=2e-4), name
        assert wheel.lateral_m[-1] == pytest.approx(0.060, abs=2e-4), name
    bounded = wheel_profile(simpack(tmp_path / "w.prw", y * 1e3, z * 1e3, low=-70.0, high=40.0))
    assert bounded.lateral_m[-1] == pytest.approx(0.040, abs=2e-4)


def test_a_rail_keeps_its_sides_and_a_wheel_its_tape_circle(tmp_path):
    rail = rail_60e1()
    # The gauge side, lower by a wear of 1 mm, must stay the negative one.
    z = rail.depth_m * 1e3 + np.where(rail.lateral_m < -0.01, 1.0, 0.0) * (-rail.lateral_m - 0.01) / 0.026
    simpack(tmp_path / "r.prr", rail.lateral_m[::3] * 1e3, z[::3] + 5.0)
    read = rail_profile("r.prr", tmp_path)
    side = np.interp([-0.03, 0.03], read.lateral_m, read.depth_m)
    assert side[0] - side[1] == pytest.approx(0.77e-3, abs=1e-5)
    assert read.depth_m.min() == 0.0
    y, z = every_third(s1002())
    simpack(tmp_path / "w.prw", y * 1e3, z * 1e3 + 100.0)
    assert float(wheel_depth(wheel_profile("w.prw", tmp_path))(0.0)) == pytest.approx(0.0, abs=1e-12)


def test_a_miniprofs_rail_is_a_height_and_its_wheel_a_depth(tmp_path):
    rail, wheel = every_third(rail_60e1()), every_third(s1002())
    header = "ProgramName=own\nColumnDef=X,Y\n\n"
    (tmp_path / "r.ban").write_text(header + rows(1e3 * rail[0], 20.0 - 1e3 * rail[1]))
    (tmp_path / "r.txt").write_text(rows(1e3 * rail[0], 1e3 * rail[1]))
    (tmp_path / "w.whl").write_text(header + rows(1e3 * wheel[0] + 70.0, 1e3 * wheel[1]))
    (tmp_path / "w.txt").write_text(rows(1e3 * wheel[0], 1e3 * wheel[1]))
    told, text = (rail_profile(tmp_path / name) for name in ("r.ban", "r.txt"))
    np.testing.assert_allclose([told.lateral_m, told.depth_m], [text.lateral_m, text.depth_m], atol=1e-11)
    told, text = wheel_profile(tmp_path / "w.whl", tape_circle_m=0.07), wheel_profile(tmp_path / "w.txt")
    np.testing.assert_allclose([told.lateral_m, told.depth_m], [text.lateral_m, text.depth_m], atol=1e-11)


def test_two_columns_of_text_give_the_same_profile_and_the_same_contact(tmp_path):
    y, z = every_third(s1002())
    (tmp_path / "w.csv").write_text(
        "# unit = m\n# from nowhere\n\n" + rows(y, z).replace(" ", " , ") + "\n# end\n"
    )
    (tmp_path / "w.txt").write_text(rows(y * 1e3, z * 1e3))
    metres, millimetres = (wheel_profile(name, tmp_path / "vehicle.toml") for name in ("w.csv", "w.txt"))
    assert np.allclose(metres.depth_m, millimetres.depth_m, atol=1e-12)
    assert metres.source == "file w.csv"
    made = build_contact(s1002(), rail_60e1(), static_load_n=53e3)
    read = build_contact(metres, rail_60e1(), static_load_n=53e3)
    assert conicity(read, 3e-3) == pytest.approx(conicity(made, 3e-3), rel=1e-4)
    assert read.split_m == pytest.approx(made.split_m, abs=2e-4)


def test_names():
    assert wheel_profile("S1002").name == "S1002"
    assert rail_profile("60E1").name == "60E1"
    for name in ("cone_1_20", "cone_0.05"):
        assert np.array_equal(wheel_profile(name).depth_m, conical_wheel(0.05).depth_m)


def test_synthetic_wear_is_the_stated_hollow_and_raises_conicity():
    worn, new = wheel_profile("S1002_worn_0.3"), s1002()
    assert "synthetic" in worn.source
    h = np.exp(-0.5 * ((new.lateral_m + 0.002) / 0.015) ** 2)
    h0 = np.exp(-0.5 * (0.002 / 0.015) ** 2)
    assert np.abs(worn.depth_m - (new.depth_m - 3e-4 * (h - h0))).max() < 1e-15
    tables = [build_contact(w, rail_60e1(), static_load_n=53e3) for w in (new, worn)]
    found = [conicity(t, 3e-3) for t in tables]
    # Measured 0.177 and 0.217.
    assert found[1] - found[0] == pytest.approx(0.040, abs=0.005)


Y, Z = (a[::20] * 1e3 for a in (s1002().lateral_m, s1002().depth_m))
SWAPPED = np.arange(Y.size)
SWAPPED[[50, 51]] = 51, 50
NAN = np.where(np.arange(Y.size) == 7, np.nan, Z)


@pytest.mark.parametrize(
    "text, says",
    [
        (rows(Y[SWAPPED], Z[SWAPPED]), ["folds back or its points are out of order", "line 52", "line 51"]),
        (rows(Y, NAN), ["finite", "line 8"]),
        (rows(Y[:7], Z[:7]), ["too few points", "found 7", "at least 8"]),
        ("# unit = m\n" + rows(Y, Z), ["unit", "wide", "limit: 0.005 to 0.25 m", "# unit = m"]),
        (rows(Y * 1e-3, Z * 1e-3), ["unit", "wide", "remedy"]),
        ("# unit = cm\n" + rows(Y, Z), ["unknown unit", "cm", "m, mm or in"]),
        (rows(Y, -Z), ["no flange", "depth is positive downward"]),
        (rows(Y + 80.0, Z), ["tape circle"]),
        (rows(Y, Z).replace("\n", "\n1,5 2,5\n", 1), ["line 2", "2 numbers"]),
        (rows(Y, Z) + "\n70 abc\n", ["not a number", "abc", f"line {Y.size + 1}"]),
        ("", ["too few points", "found 0"]),
        ("\x00\xff\xfe", ["line 1"]),
    ],
)
def test_bad_text_is_refused_with_file_field_and_remedy(tmp_path, text, says):
    path = tmp_path / "mine.txt"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        wheel_profile(path)
    for part in ("mine.txt", *says):
        assert part in str(caught.value)


@pytest.mark.parametrize(
    "name, header, says",
    [
        ("w.prw", {"type": 0}, ["other kind", "header.type", "1 wheel"]),
        ("r.prr", {"type": 1}, ["other kind", "header.type", "0 rail"]),
        ("w.prw", {"unit": 1.0}, ["units.len.f", "wide"]),
        ("w.prw", {"unit": 0.0}, ["units.len.f", "not a unit"]),
        ("w.prw", {"low": 10.0, "high": 11.0}, ["bounds", "found 2"]),
        ("r.prr", {"mirror_z": 1, "type": 0}, ["no highest point"]),
    ],
)
def test_bad_headers_are_refused(tmp_path, name, header, says):
    path = simpack(tmp_path / name, Y, Z, **header)
    with pytest.raises(InputError) as caught:
        (wheel_profile if name == "w.prw" else rail_profile)(path)
    for part in (name, *says):
        assert part in str(caught.value)


def test_smoothing_and_names_that_do_not_exist_are_refused(tmp_path):
    path = simpack(tmp_path / "w.prw", Y, Z)
    path.write_text(path.read_text().replace("point.begin", "approx.smooth = 0.5\npoint.begin"))
    with pytest.raises(InputError, match=r"approx\.smooth.*0\.5"):
        wheel_profile(path)
    with pytest.raises(InputError, match=r"wheel_profile.*S1003.*S1002, cone_1_20"):
        wheel_profile("S1003")
    with pytest.raises(InputError, match=r"rail_profile.*60E1"):
        rail_profile("w.prw")
    with pytest.raises(InputError, match=r"no such profile file.*starts at the file"):
        wheel_profile("missing.prw", tmp_path)
    for name in ("cone_1_0", "cone_1_2", "cone_0.9"):
        with pytest.raises(InputError, match="conicity"):
            wheel_profile(name)
    with pytest.raises(InputError, match="wear_m"):
        wheel_profile("S1002_worn_3")


def test_points_that_nearly_coincide_do_not_bend_the_profile(tmp_path):
    y, z = every_third(s1002())
    close = np.arange(400, y.size, 25)
    y = np.insert(y * 1e3, close + 1, y[close] * 1e3 + 1e-4)
    z = np.insert(z * 1e3, close + 1, z[close] * 1e3 + 1e-4)
    wheel = wheel_profile(simpack(tmp_path / "w.prw", y, z))
    at = np.linspace(-0.030, 0.055, 20000)
    assert np.abs(wheel_depth(wheel)(at, 1) - wheel_depth(s1002())(at, 1)).max() < 1e-3


def test_a_vehicle_finds_its_profile_beside_its_file(tmp_path, monkeypatch):
    """Whatever folder is worked in; and a changed profile is another ride and another scenario."""
    wheel = s1002()
    lines = [f"{1e3 * y:.4f} {1e3 * z:.6f}" for y, z in zip(wheel.lateral_m, wheel.depth_m, strict=True)]
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "my.txt").write_text("\n".join(lines), encoding="utf-8")
    text = shipped("vehicle")["irw_axle"].read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(text.replace('"S1002"', '"./parts/my.txt"'), encoding="utf-8")
    monkeypatch.chdir(tmp_path.parent)
    model = load(VehicleFile, "vehicle", str(tmp_path / "mine.toml")).model("mine")
    plain = load(VehicleFile, "vehicle", "irw_axle").model("irw_axle")
    # The file's points are rounded to a nanometre.
    own, shipped_one = (contacts_of(each).tables[0].coef[0, :, 0, 3] for each in (model, plain))
    np.testing.assert_allclose(own, shipped_one, rtol=0.0, atol=2e-9)
    before = profiles_digest(model.wheel_rail)
    lines[600] = lines[600][:-1] + ("1" if lines[600][-1] != "1" else "2")
    (tmp_path / "parts" / "my.txt").write_text("\n".join(lines), encoding="utf-8")
    assert profiles_digest(model.wheel_rail) != before
    (tmp_path / "parts" / "my.txt").unlink()
    with pytest.raises(InputError, match=r"mine.toml|my.txt"):
        load(VehicleFile, "vehicle", str(tmp_path / "mine.toml"))


def test_profile_at_a_scale_is_the_same_shape():
    """Contact at 1:10 with everything else at 1:10 too: shifts, abscissae and radii ten times smaller."""
    wheel, rail = scaled(s1002(), 0.1), scaled(rail_60e1(), 0.1)
    assert wheel.name == "S1002 at 1:10" and scaled(wheel, 1.0) is wheel
    full = build_contact(s1002(), rail_60e1(), static_load_n=50e3)
    sizes = {"gauge_m": 0.1435, "wheel_radius_m": 0.046, "tape_circle_half_m": 0.075}
    small = build_contact(wheel, rail, static_load_n=500.0, **sizes)  # equal stress
    np.testing.assert_allclose(small.smoothing_m, 0.1 * full.smoothing_m, rtol=1e-9)
    np.testing.assert_allclose(small.coef[:, :, :6, 3], 0.1 * full.coef[:, :, :6, 3], rtol=1e-3, atol=2e-8)
