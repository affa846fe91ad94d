"""The kernel's springs against Exudyn's own: two codes that share only the description of the vehicle.

One `RigidBodySpringDamper` per spring and one `SpringDamper` per rod, taken out of the kernel. Rotations,
stops, series dampers and trailing arms stay in the kernel: Exudyn's rotational springs work on Tait-Bryan
angles, another definition, and the others are no item of its.
"""

from dataclasses import replace

import exudyn as exu
import numpy as np
import pytest
from exudyn.itemInterface import MarkerBodyPosition, MarkerBodyRigid, RigidBodySpringDamper, SpringDamper

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

ROUGH = Irregularity("erri_b176_low", (1.5, 100.0), 40.0)
PROFILE = SpeedProfile(150.0, 180.0, 12.0, rest_s=0.2, acceleration_mps2=4.0, jerk_mps3=16.0)


@pytest.fixture(scope="module")
def laid():
    return lay(load(TrackFile, "track", "smooth_curve").design("smooth_curve"), ROUGH, seed=1)


def vehicle(name):
    return load(VehicleFile, "vehicle", name).model(name)


class Springless(Setup):
    """A setup whose springs and rods the kernel does not see."""

    def pack(self):
        data = super().pack()
        return data._replace(springs=data.springs[:0], links=data.links[data.links["kind"] != ROD])


def natively_sprung(model, laid):
    """An engine with Exudyn's own springs and rods.

    Markers and axes are given in the axes of the nodes, from which half a turn leads to the body's. The
    bodies are the first objects of the system, in the vehicle's order.
    """
    engine = ExudynEngine(Springless(model, laid, PROFILE, settle_s=1.0))
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
    for spring in packed.springs:
        markers = [
            engine.mbs.AddMarker(
                MarkerBodyRigid(
                    bodyNumber=int(spring[end]),
                    localHT=exu.HT(rotation=np.diag(HALF_TURN), translation=spring[f"{end}_arm"] * HALF_TURN),
                )
            )
            for end in ("inner", "outer")
        ]
        engine.mbs.AddObject(
            RigidBodySpringDamper(
                markerNumbers=markers,
                stiffness=np.diag([*spring["stiffness"], 0.0, 0.0, 0.0]),
                damping=np.diag([*spring["damping"], 0.0, 0.0, 0.0]),
                offset=[0.0, 0.0, spring["sag_m"], 0.0, 0.0, 0.0],
            )
        )
    engine.mbs.Assemble()
    return engine


def motion(model, laid, suspension):
    """Accelerations (n, b, 3) across 3 s into the irregular curve, and angular ones."""
    if suspension == "native":
        engine = natively_sprung(model, laid)
    else:
        engine = ExudynEngine(Setup(model, laid, PROFILE, settle_s=1.0))
    parts = list(engine.run(3.0))
    return tuple(
        np.concatenate([getattr(p, name) for p in parts]) for name in ("acceleration", "angular_acceleration")
    )


def worst_rms(one, other):
    """Over rows and axes, the worst body."""
    return float(np.sqrt(np.mean((one - other) ** 2, axis=(0, 2))).max())


@pytest.mark.parametrize("name", ["metro_irw_bogie", "two_axle_wagon", "irw_car"])
def test_kernel_and_native_springs_agree(laid, name):
    """1e-6 m/s2 and rad/s2 rms at the same step of RK44 (measured 1e-9); it moves by 0.1 m/s2 and more."""
    hook, native = (motion(vehicle(name), laid, suspension) for suspension in ("hook", "native"))
    assert worst_rms(hook[0], 0.0) > 0.1
    assert worst_rms(hook[0], native[0]) < 1e-6
    assert worst_rms(hook[1], native[1]) < 1e-6


@pytest.mark.parametrize("fault", ["stiffness", "damping", "place"])
def test_small_faults_of_one_spring_would_be_seen(laid, fault):
    """One of 13 springs 1e-4 stiffer, or 1e-2 more damped, or 1 mm higher: beyond the tolerance."""
    model = vehicle("metro_irw_bogie")
    first = model.suspensions[0]
    changed = {
        "stiffness": replace(first, stiffness_npm=tuple(1.0001 * k for k in first.stiffness_npm)),
        "damping": replace(first, damping_nspm=tuple(1.01 * c for c in first.damping_nspm)),
        "place": replace(first, position_m=(*first.position_m[:2], first.position_m[2] + 1e-3)),
    }[fault]
    faulty = replace(model, suspensions=(changed, *model.suspensions[1:]))
    hook, native = motion(model, laid, "hook"), motion(faulty, laid, "native")
    assert worst_rms(hook[0], native[0]) > 2e-6 or worst_rms(hook[1], native[1]) > 2e-6
