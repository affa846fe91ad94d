"""What a coned wheel does to an encoder in a balanced curve: the way of its rail, and the radius it rolls on.

Nobody tells the encoder of either: the simulated contact turns the wheel. A wheel b left of the track's
centre goes (1 - b kappa) of its way in a curve of curvature kappa, and rolls on the radius r + dr that the
contact table has for the place where it runs; its encoder, which takes it for r, reads
r / (r + dr) (1 - b kappa).
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pytest

from simrail.core.toml_files import judge, load
from simrail.recording.recording import EncoderSheet
from simrail.ride.ride import Ride, simulate
from simrail.ride.truth import Mount
from simrail.sensors.encoder import EncoderSpec, sample_encoder
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.contact.wheelset import contact_state
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

FROM_M, TO_M = 190.0, 222.0
"""In the curve, well behind the transition and before the brakes."""


class Wheel(NamedTuple):
    """Relative errors of one wheel's reading: as measured, if it rolled without creep, of its way alone."""

    read: float
    rolling: float
    way: float


@lru_cache
def wheels_in_curve(name: str, radius_m: float, speed_mps: float) -> dict[str, Wheel]:
    model = load(VehicleFile, "vehicle", name).model(name)
    cant_m = 1.5 * speed_mps**2 / abs(radius_m) / 9.81  # balanced
    segments = [
        {"kind": "straight", "length_m": 60.0},
        {"kind": "transition", "length_m": 60.0},
        {"kind": "curve", "length_m": 140.0, "radius_m": radius_m, "cant_mm": round(1000.0 * cant_m, 3)},
    ]
    text = {"title": "curve", "source": "made up for a test", "synthetic": True, "segment": segments}
    track = judge(TrackFile, text, file="test").design("curve")
    profile = SpeedProfile(
        20.0, 245.0, speed_mps, acceleration_mps2=4.0, jerk_mps3=10.0, rest_s=0.2, final_rest_s=0.0
    )
    irregularity = Irregularity("none", (1.5, 100.0), 0.0)
    truth = simulate(Ride("curve", track, irregularity, 1, model, profile, engine="compiled"))
    table = contacts_of(model).tables[0]
    found = {}
    for wheel in model.wheels:
        body = truth.bodies[wheel.axle]
        motion = truth.motion(Mount("axle", wheel.axle, (0.0, 0.0, body.height_m)))
        s = motion["position_m"].to_numpy()
        inside = np.flatnonzero((s > FROM_M) & (s < TO_M))
        first, last = inside[[0, -1]]
        spec = EncoderSpec(wheel.name, pulses_per_revolution=20_000, rate_hz=1000.0, quadrature=True)
        counts = sample_encoder(truth.wheel_angle(wheel.name), truth.time_s, spec, seed=1, draw=0)
        sheet = EncoderSheet(wheel.name, spec.counts_per_revolution, wheel.radius_m, 1000.0)
        way = (counts["pulse_count"] - counts["pulse_count"].iloc[0]).to_numpy() * sheet.pulse_m
        read = (way[last] - way[first]) / (s[last] - s[first]) - 1.0
        pose = motion.iloc[inside].mean()
        state = contact_state(
            table,
            wheel.side,
            y_m=pose["lateral_m"],
            z_m=pose["vertical_m"] - body.height_m,
            roll_rad=pose["relative_roll_rad"],
            yaw_rad=pose["relative_yaw_rad"],
        ).values()
        load_n = sum(patch["normal_n"] for patch in state)
        rolls_on = sum(patch["normal_n"] * patch["radius_m"] for patch in state) / load_n
        outward = 0.75 + sum(patch["normal_n"] * patch["abscissa_m"] for patch in state) / load_n
        path = 1.0 - (pose["lateral_m"] + wheel.side * outward) / radius_m
        found[wheel.name] = Wheel(read, wheel.radius_m / rolls_on * path - 1.0, path - 1.0)
    return found


@pytest.mark.parametrize("radius_m", (300.0, -300.0))
def test_independent_wheels_each_read_their_own_way_and_radius(radius_m):
    """Wheels that turn freely have nothing to creep for: 1e-5 on the trailing axle, as FACTS' undriven IRW.

    The leading axle runs against its outer rail under an angle, and the spin of that contact drags the
    wheel along: a per cent of the effect.
    """
    found = wheels_in_curve("metro_irw_bogie", radius_m, 12.0)
    inner, outer = ("left", "right") if radius_m > 0.0 else ("right", "left")
    for side in (inner, outer):
        trailing, leading = found[f"rear.{side}"], found[f"front.{side}"]
        assert trailing.read == pytest.approx(trailing.rolling, abs=1e-5)
        assert leading.read == pytest.approx(leading.rolling, rel=0.02)
        # Both parts are seen: the way alone would miss by the taper, hundreds of times the tolerance.
        assert abs(trailing.read - trailing.way) > 5e-4
    # b kappa = 0.75 m / 300 m, each way; the outer leading wheel climbs towards its flange: r + 5 mm.
    assert found[f"rear.{inner}"].way == pytest.approx(-2.5e-3, rel=0.05)
    assert found[f"rear.{outer}"].way == pytest.approx(2.5e-3, rel=0.05)
    assert found[f"front.{outer}"].read < -0.01
    assert found[f"rear.{outer}"].read - found[f"rear.{inner}"].read > 4e-3
    # The mean of both trailing wheels is free of b kappa; what is left is the taper.
    mean = 0.5 * (found[f"rear.{inner}"].read + found[f"rear.{outer}"].read)
    assert abs(mean) < 2.5e-3


def test_a_rigid_wheelset_reads_one_way_between_those_of_its_wheels():
    """Both wheels turn alike, so one creeps forward and the other back, and the forces of it cancel.

    With equal creep coefficients the reading is the mean of the two that roll freely. The contact
    patches differ a little between the wheels (load, curvature of the profile): 10 % of the creep.
    """
    found = wheels_in_curve("two_axle_wagon", 3000.0, 12.0)
    for axle in ("front", "rear"):
        left, right = found[f"{axle}.left"], found[f"{axle}.right"]
        assert left.read == pytest.approx(right.read, abs=3e-6)  # of counts
        low, high = sorted((left.rolling, right.rolling))
        assert low < left.read < high
        creep = 0.5 * (high - low)
        assert creep > 1e-4
        assert left.read == pytest.approx(0.5 * (left.rolling + right.rolling), abs=0.1 * creep)
    assert abs(found["front.left"].read) > 1e-3  # 2 m in 2 km, from a curve that looks straight
