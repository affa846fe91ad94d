"""The kernel's rods against Exudyn's own: two codes that share only the description of the vehicle.

One `SpringDamper` per rod, taken out of the kernel. Everything else stays in the kernel: Exudyn's rigid-body
spring-damper pushes each body at its own point and leaves a couple over, its rotational springs work on
Tait-Bryan angles, and trailing arms, stops and series dampers are no item of its. The springs are held
against their energy in `tests/vehicle/test_suspension_forces.py`.
"""

from dataclasses import replace

import numpy as np
import pytest
from exudyn.itemInterface import MarkerBodyPosition, SpringDamper

from simrail.core.toml_files import load
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.engines.exudyn_engine import ExudynEngine
from simrail.vehicle.engines.exudyn_forces import HALF_TURN
from simrail.vehicle.engines.records import ROD
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

pytestmark = pytest.mark.long

ROUGH = Irregularity("erri_b176_low", (1.5, 100.0), 40.0)
PROFILE = SpeedProfile(150.0, 180.0, 12.0, rest_s=0.2, acceleration_mps2=4.0, jerk_mps3=16.0)


@pytest.fixture(scope="module")
def laid():
    return lay(load(TrackFile, "track", "smooth_curve").design("smooth_curve"), ROUGH, seed=1)


def vehicle(name):
    return load(VehicleFile, "vehicle", name).model(name)


class Rodless(Setup):
    """A setup whose rods the kernel does not see."""

    def pack(self):
        data = super().pack()
        return data._replace(links=data.links[data.links["kind"] != ROD])


def with_native_rods(model, laid):
    """An engine with Exudyn's own rods.

    Markers and axes are given in the axes of the nodes, from which half a turn leads to the body's. The
    bodies are the first objects of the system, in the vehicle's order.
    """
    engine = ExudynEngine(Rodless(model, laid, PROFILE, settle_s=1.0))
    packed = Setup(model, laid, PROFILE).pack()
    for rod in packed.links[packed.links["kind"] == ROD]:
        markers = [
            engine.mbs.AddMarker(
                MarkerBodyPosition(bodyNumber=int(rod[end]), localPosition=rod[f"{end}_arm"][0] * HALF_TURN)
            )
            for end in ("inner", "outer")
        ]
        engine.mbs.AddObject(
            SpringDamper(
                markerNumbers=markers,
                stiffness=rod["stiffness"][0],
                damping=rod["damping"][0],
                referenceLength=rod["length_m"],
            )
        )
    engine.mbs.Assemble()
    return engine


def motion(model, laid, suspension):
    """Accelerations (n, b, 3) across 3 s into the irregular curve, and angular ones."""
    if suspension == "native":
        engine = with_native_rods(model, laid)
    else:
        engine = ExudynEngine(Setup(model, laid, PROFILE, settle_s=1.0))
    parts = list(engine.run(3.0))
    return tuple(
        np.concatenate([getattr(p, name) for p in parts]) for name in ("acceleration", "angular_acceleration")
    )


def worst_rms(one, other):
    """Over rows and axes, the worst body."""
    return float(np.sqrt(np.mean((one - other) ** 2, axis=(0, 2))).max())


def test_kernel_and_native_rods_agree(laid):
    """1e-6 m/s2 and rad/s2 rms at the same step of RK44 (measured 1e-9); it moves by 0.1 m/s2 and more."""
    hook, native = (motion(vehicle("irw_car"), laid, suspension) for suspension in ("hook", "native"))
    assert worst_rms(hook[0], 0.0) > 0.1
    assert worst_rms(hook[0], native[0]) < 1e-6
    assert worst_rms(hook[1], native[1]) < 1e-6


@pytest.mark.parametrize("fault", ["stiffness_npm", pytest.param("outer_position_m", marks=pytest.mark.slow)])
def test_small_faults_of_one_rod_would_be_seen(laid, fault):
    """One of the rods 1e-3 stiffer, or 1 mm aside: beyond the tolerance."""
    model = vehicle("irw_car")
    first = model.rods[0]
    values = {"stiffness_npm": 1.001 * first.stiffness_npm}
    if fault == "outer_position_m":
        x, y, z = first.outer_position_m
        values = {fault: (x, y + 1e-3, z)}
    faulty = replace(model, rods=(replace(first, **values), *model.rods[1:]))
    hook, native = motion(model, laid, "hook"), motion(faulty, laid, "native")
    assert worst_rms(hook[0], native[0]) > 2e-6 or worst_rms(hook[1], native[1]) > 2e-6
