"""One contact table per static wheel load: shared where loads are alike, right where they are not."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba import typeof
from wheel_loads import wheel_loads_n

from simrail.core.toml_files import load
from simrail.track.design import Straight, TrackDesign
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.contact import contact_tables
from simrail.vehicle.contact.contact import static_height
from simrail.vehicle.contact.contact_geometry import ContactTable, build_contact
from simrail.vehicle.contact.contact_tables import contacts_of, rest_drops_m
from simrail.vehicle.contact.profiles import rail_60e1, s1002
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

pytestmark = pytest.mark.long

LEVEL = TrackDesign("level", 0.0, (Straight(60.0),))


def bogie(body_at_m=0.0):
    """The metro bogie, its carried body moved forward."""
    model = load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie")
    bodies = list(model.bodies)
    bodies[-1] = replace(bodies[-1], position_m=(body_at_m, 0.0, 1.45))
    # The secondary springs and the traction rod go with the body, so that the frame tips, not the body.
    springs = tuple(
        replace(s, position_m=(s.position_m[0] + body_at_m, *s.position_m[1:])) if s.outer == "body" else s
        for s in model.suspensions
    )
    return replace(model, bodies=tuple(bodies), suspensions=springs)


def at_rest(model):
    """Heights of the axles less their nominal ones, and wheel loads, after 8 s at rest."""
    laid = lay(LEVEL, Irregularity("none", fade_m=0.0), seed=0)
    engine = CompiledEngine(Setup(model, laid, SpeedProfile(20.0, 40.0, 5.0, rest_s=5.0), settle_s=8.0))
    segment = next(iter(engine.run(0.5)))
    nominal = [model.body(name).position_m[2] for name in model.axle_names]
    return segment.position[-1, : len(nominal), 2] - nominal, wheel_loads_n(engine)


def test_two_axle_loads_stand_at_their_own_heights_with_their_own_loads_to_1e_3():
    model = bogie(body_at_m=0.4)
    loads = model.wheel_load_n(9.81)
    assert loads[0] > 1.5 * loads[2]
    contacts = contacts_of(model)
    assert contacts.of_wheel == (1, 1, 0, 0)
    light, heavy = contacts.tables
    np.testing.assert_allclose([light.static_load_n, heavy.static_load_n], loads[[2, 0]])
    assert light.coef.shape == heavy.coef.shape
    for name in ("first_shift_m", "intervals_per_m", "derailed_shift_m"):
        assert light.const[name] == heavy.const[name]  # one grid
    heights, found = at_rest(model)
    np.testing.assert_allclose(found, loads, rtol=1e-3)
    # A table made alone for each axle's load, on a grid of its own.
    alone = [
        static_height(
            build_contact(
                s1002(), rail_60e1(), static_load_n=float(at), wheel_radius_m=0.29, rail_inclination=0.025
            )
        )
        for at in loads[[0, 2]]
    ]
    assert abs(alone[0] - alone[1]) > 10e-6
    np.testing.assert_allclose(heights, alone, rtol=1e-3)
    np.testing.assert_allclose(rest_drops_m(model, gravity_mps2=9.81)[:2], alone, rtol=1e-5)


def test_equal_loads_share_the_one_table_of_their_load_bit_by_bit():
    model = bogie()
    (table,) = contacts_of(model).tables
    alone = build_contact(
        s1002(), rail_60e1(), static_load_n=float(np.mean(model.wheel_load_n(9.81))), wheel_radius_m=0.29,
        rail_inclination=0.025,
    )  # fmt: skip
    np.testing.assert_array_equal(table.coef, alone.coef)
    assert table.const == alone.const


@pytest.mark.parametrize(("shift_m", "tables"), [(0.005, 1), (0.02, 2)])
def test_loads_within_2_percent_share_a_table(shift_m, tables):
    """Loads 0.8 % and 3.3 % apart."""
    model = bogie(body_at_m=shift_m)
    loads = model.wheel_load_n(9.81)
    assert (loads.max() / loads.min() - 1.0 < 0.02) == (tables == 1)
    assert len(contacts_of(model).tables) == tables


def test_a_table_is_built_once():
    assert contacts_of(bogie()).tables[0] is contacts_of(bogie()).tables[0]
    rough = replace(bogie(), wheel_rail=replace(bogie().wheel_rail, friction=0.2))
    assert contacts_of(rough).tables[0] is not contacts_of(bogie()).tables[0]


def test_a_table_from_the_disk_is_the_one_that_was_built(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To the bit; a flipped byte anywhere is no table, and it is built again."""
    monkeypatch.setattr(contact_tables, "cache_folder", lambda: tmp_path)
    model = load(VehicleFile, "vehicle", "two_axle_wagon").model("two_axle_wagon")

    def fresh() -> ContactTable:
        contact_tables._built.cache_clear()
        return contacts_of(model).tables[0]

    built = fresh()
    (file,) = (tmp_path / contact_tables.FOLDER).iterdir()
    whole = file.read_bytes()
    builds: list[int] = []
    build = contact_tables.build_contact

    def counted(*arguments: Any, **keywords: Any) -> ContactTable:
        builds.append(1)
        return build(*arguments, **keywords)

    monkeypatch.setattr(contact_tables, "build_contact", counted)
    read = fresh()
    assert not builds and read.coef.tobytes() == built.coef.tobytes()
    assert typeof(read.const) == typeof(built.const)  # or all kernels would be compiled once more
    assert read.const == built.const and (read.name, read.split_m) == (built.name, built.split_m)
    for at in np.random.default_rng(1).integers(0, len(whole), 40):
        damaged = bytearray(whole)
        damaged[at] ^= 0x10
        file.write_bytes(bytes(damaged))
        assert contact_tables._read(file) is None
    file.write_bytes(whole[: len(whole) // 2])
    assert fresh().coef.tobytes() == built.coef.tobytes() and builds == [1]
    contact_tables._built.cache_clear()
