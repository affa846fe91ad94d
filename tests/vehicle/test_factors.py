"""Factors on a vehicle's figures: what each of them changes, and what it leaves."""

from dataclasses import asdict, fields

import numpy as np
import pytest

from simrail.core.toml_files import load
from simrail.vehicle.factors import VehicleFactors
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.model import VehicleModel

VEHICLES = ("metro_irw_bogie", "metro_car_gz18", "manchester_1")


def drawn_vehicle(name: str) -> VehicleModel:
    """A shipped vehicle."""
    return load(VehicleFile, "vehicle", name).model(name)


@pytest.mark.parametrize("name", VEHICLES)
def test_each_factor_changes_its_own_figures_and_no_other(name: str) -> None:
    drawn = drawn_vehicle(name)
    assert VehicleFactors().of(drawn) is drawn
    stiff, weak, laden = (
        VehicleFactors(**{word: 2.0}).of(drawn) for word in ("stiffness", "damping", "load")
    )
    assert laden.suspensions == drawn.suspensions and laden.rotations == drawn.rotations
    assert stiff.bodies == weak.bodies == drawn.bodies
    axles = {wheel.axle for wheel in drawn.wheels}
    for one, other in zip(laden.bodies, drawn.bodies, strict=True):
        factor = 1.0 if one.name in axles else 2.0
        assert one.mass_kg == factor * other.mass_kg and one.position_m == other.position_m
        np.testing.assert_array_equal(one.inertia_kgm2, factor * np.array(other.inertia_kgm2))
    for part in ("suspensions", "series", "rotations", "rods", "arms"):
        for a, b, c in zip(getattr(drawn, part), getattr(stiff, part), getattr(weak, part), strict=True):
            for field, value in asdict(a).items():
                told = [2.0 if field.startswith(word) else 1.0 for word in ("stiffness", "damping")]
                if isinstance(value, str) or max(told) == 1.0:
                    assert getattr(b, field) == getattr(c, field) == getattr(a, field)
                    continue
                np.testing.assert_array_equal(getattr(b, field), told[0] * np.array(value))
                np.testing.assert_array_equal(getattr(c, field), told[1] * np.array(value))
    # What is neither: the guide, wheels, contact.
    for field in fields(drawn):
        if field.name not in ("bodies", "suspensions", "series", "rotations", "rods", "arms", "tabled"):
            assert getattr(stiff, field.name) == getattr(weak, field.name) == getattr(drawn, field.name)


def test_tabled_laws_go_with_what_they_are_of() -> None:
    drawn = drawn_vehicle("metro_car_gz18")
    if not drawn.tabled:
        pytest.skip("no tabled law")
    stiff, weak = VehicleFactors(stiffness=2.0).of(drawn), VehicleFactors(damping=3.0).of(drawn)
    for a, b, c in zip(drawn.tabled, stiff.tabled, weak.tabled, strict=True):
        of_rate = a.over == "speed_mps"
        points = np.array(a.points)
        np.testing.assert_array_equal(b.points, points * [1.0, 1.0 if of_rate else 2.0])
        np.testing.assert_array_equal(c.points, points * [1.0, 3.0 if of_rate else 1.0])


@pytest.mark.parametrize("name", VEHICLES)
def test_a_vehicle_with_factors_stands_on_its_springs(name: str) -> None:
    """Its weight is carried: wheels carry all of it, and springs what lies above them."""
    laden = VehicleFactors(load=1.5, stiffness=0.7).of(drawn_vehicle(name))
    carried = laden.wheel_load_n(9.81)
    assert (carried > drawn_vehicle(name).wheel_load_n(9.81)).all()
    guided = laden.guide_load_n(9.81)
    assert carried.sum() + guided == pytest.approx(
        9.81 * sum(body.mass_kg for body in laden.bodies), rel=1e-9
    )
