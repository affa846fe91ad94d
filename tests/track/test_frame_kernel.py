"""The merged pieces of a design against its own polynomials, one by one."""

import numpy as np
import pytest

from simrail.track.alignment import build_cant
from simrail.track.design import TrackDesign
from simrail.track.file import track_by_name
from simrail.track.frame_kernel import (
    BLOCK,
    HEIGHT_TERMS,
    PITCH1,
    RISE,
    ROLL1,
    SINE,
    SLOPE,
    YAW1,
    YAW_ANGLE,
    evaluate,
    polynomial_terms,
)
from simrail.track.map_errors import MapErrors, draw_map

DRAWN = track_by_name("condequinto_olivar")
SURVEYED = draw_map(DRAWN, MapErrors(), seed=1, draw=0)


def places_of(design: TrackDesign) -> np.ndarray:
    """Joints, both their neighbours, places beyond both ends, and some in no order."""
    joints = design._shape.pieces.starts
    around = np.concatenate([joints, np.nextafter(joints, -np.inf), np.nextafter(joints, np.inf)])
    ends = np.linspace(design.start_m - 30.0, design.end_m + 30.0, 10 * BLOCK + 1)
    anywhere = np.random.default_rng(3).uniform(design.start_m, design.end_m, 500)
    places = np.concatenate([around, ends, anywhere])
    # At the last value of a survey its curvature steps: here what begins there holds, as at every joint.
    beside = design.deviation
    return places if beside is None else places[places != beside.joints_m[-1]]


@pytest.mark.parametrize("design", [DRAWN, SURVEYED], ids=["drawn", "surveyed"])
def test_pieces_are_the_polynomials_that_they_come_from(design: TrackDesign) -> None:
    s, shape = places_of(design), design._shape
    rows = evaluate(shape.pieces, s)
    cant = [shape.cant(s, order) for order in range(2)]
    height = [shape.height(s, order) for order in range(3)]
    if design.deviation is not None:
        cant = [a + b for a, b in zip(cant, design.deviation.cant(s, derivatives=1), strict=True)]
        height = [a + b for a, b in zip(height, design.deviation.height(s, derivatives=2), strict=True)]
    yaw, curvature, _ = shape.plan.state(s)
    sine, slope = cant[0] / design.rail_base_m, height[1]
    # Rounding of sums of some ten terms, each of the size of the whole, and of places of a kilometre.
    near = {"rtol": 1e-12, "atol": 1e-14}
    np.testing.assert_allclose(rows[SINE], sine, **near)
    np.testing.assert_allclose(rows[RISE], height[0], **near)
    np.testing.assert_allclose(rows[SLOPE], slope, **near)
    np.testing.assert_allclose(rows[YAW_ANGLE], yaw, **near)
    np.testing.assert_allclose(rows[YAW1], curvature, **near)
    np.testing.assert_allclose(rows[ROLL1], cant[1] / design.rail_base_m / np.sqrt(1.0 - sine**2), **near)
    np.testing.assert_allclose(rows[PITCH1], -height[2] / (1.0 + slope**2), **near)


def test_a_sample_does_not_depend_on_those_beside_it() -> None:
    s = places_of(SURVEYED)
    pieces = SURVEYED._shape.pieces
    whole = evaluate(pieces, s)
    for part in (slice(0, 1), slice(5, 5 + BLOCK + 3), slice(7, None, 11)):
        assert (evaluate(pieces, s[part]) == whole[:, part]).all()


def test_without_coordinates_a_frame_has_no_rows_of_them() -> None:
    s = np.linspace(10.0, 600.0, 50)
    whole, without = DRAWN.frame(s), DRAWN.frame(s, places=False)
    assert without.position.shape == (0, 3)
    assert (without.k == whole.k).all() and (without.roll_rad == whole.roll_rad).all()


def test_a_polynomial_of_too_many_terms_is_refused() -> None:
    cant = build_cant(DRAWN.elements, DRAWN.start_m, ramp="smooth")
    with pytest.raises(ValueError, match="6 terms"):
        polynomial_terms(cant, cant.x[:1], 5)
    assert polynomial_terms(cant, cant.x[:1], HEIGHT_TERMS).shape == (1, HEIGHT_TERMS)
