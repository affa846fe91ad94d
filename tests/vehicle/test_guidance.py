"""How axles turn frames and bodies, against closed forms of springs."""

from dataclasses import replace

import numpy as np
import pytest

from simrail.core.toml_files import load
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.guidance import heading_weights
from simrail.vehicle.model import Rod, Rotation, Suspension, VehicleModel

HALF, BASE = 9.5, 1.28
"""Half the distance of the pivots, and of the axles of a bogie, of `manchester_1`."""


def springs(primary_npm: float, yaw_nmprad: float) -> VehicleModel:
    """The vehicle on one lateral spring over each axle, one in each pivot, and yaw springs at the pivots."""
    model = load(VehicleFile, "vehicle", "manchester_1").model("m")
    lateral = (0.0, primary_npm, 0.0)
    none = (0.0, 0.0, 0.0)
    primary = tuple(
        Suspension(f"p{axle}", axle, frame, (model.body(axle).position_m[0], 0.0, 0.5), lateral, none)
        for axle, frame in zip(model.axle_names, ["frame_front"] * 2 + ["frame_rear"] * 2, strict=True)
    )
    pivots = tuple(
        Suspension(f"s{side}", frame, "body", (side * HALF, 0.0, 0.8), (0.0, 1e9, 0.0), none)
        for frame, side in (("frame_front", 1.0), ("frame_rear", -1.0))
    )
    yaw = tuple(
        Rotation(f"y{frame}", frame, "body", (0.0, 0.0, yaw_nmprad), none)
        for frame in ("frame_front", "frame_rear")
    )
    return replace(model, suspensions=primary + pivots, rotations=yaw, rods=(), arms=(), series=(), tabled=())


@pytest.mark.parametrize("yaw_nmprad", [0.0, 1e5, 1e7])
def test_a_frame_between_its_axles_and_the_body(yaw_nmprad: float) -> None:
    """On an arc the frame's chord is turned by L/R and the body by 0; springs k at +-a and a yaw spring c
    part them: 2 k a^2 (psi - L/R) + c psi = 0, so that the frame's tangent is c L / (c + 2 k a^2) behind."""
    k = 2e6
    model = springs(k, yaw_nmprad)
    weights = heading_weights(model)
    x = np.array([model.body(axle).position_m[0] for axle in model.axle_names])

    def centre(body: str) -> float:
        return 0.5 * float(np.array(list(weights[body].values())) @ (x * x)) - model.body(body).position_m[0]

    behind = yaw_nmprad * HALF / (yaw_nmprad + 2.0 * k * BASE**2)
    assert centre("frame_front") == pytest.approx(-behind, abs=1e-6)
    assert centre("frame_rear") == pytest.approx(behind, abs=1e-6)
    assert centre("body") == pytest.approx(0.0, abs=1e-6)
    if yaw_nmprad == 0.0:
        assert list(weights["frame_front"].values()) == pytest.approx(
            [0.5 / BASE, -0.5 / BASE, 0, 0], abs=1e-9
        )
    # Springs in the middle of an axle do not turn it.
    assert not set(model.axle_names) & set(weights)


def test_rods_that_meet_guide_an_axle_about_the_point_where_they_meet() -> None:
    """Two rods whose lines meet in the middle of the axle guide the frame as a pivot there would."""
    model = springs(2e6, 0.0)
    rods = []
    for axle, frame in zip(model.axle_names, ["frame_front"] * 2 + ["frame_rear"] * 2, strict=True):
        place = model.body(axle).position_m[0]
        for side in (1.0, -1.0):  # lines that meet in the middle of the axle
            inner, outer = (place - 0.5, side * 0.25, 0.4), (place - 1.0, side * 0.5, 0.4)
            rods.append(Rod(f"{axle}{side}", axle, frame, inner, outer, 1e8, 0.0))
    pivots = tuple(spring for spring in model.suspensions if spring.outer == "body")
    weights = heading_weights(replace(model, suspensions=pivots, rods=tuple(rods)))
    assert list(weights["frame_front"].values()) == pytest.approx([0.5 / BASE, -0.5 / BASE, 0, 0], abs=1e-6)


def test_what_nothing_turns_is_left_out() -> None:
    assert heading_weights(load(VehicleFile, "vehicle", "irw_axle").model("m")) == {}
