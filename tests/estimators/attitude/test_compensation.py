"""Compensation on a real design track: what is left of an exact body's accelerometer is gravity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from simrail.estimators.attitude.compensation import (
    design_frame,
    gravity_and_curves,
    gravity_force,
    track_acceleration,
)

from simrail.core.errors import InputError
from simrail.ride.truth import Truth


def gravity_in_body(angles: np.ndarray) -> np.ndarray:
    roll, pitch, _ = angles.T
    return 9.81 * np.column_stack(
        [-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)]
    )


@pytest.mark.parametrize("direction", [1, -1])
def test_exact_body_leaves_gravity(
    direction: int, bend: Callable[..., Truth], exactly: Callable, true_angles: Callable
) -> None:
    truth = bend(direction=direction)
    recording = exactly(truth)
    left = gravity_force(recording, compensated=True) - gravity_in_body(true_angles(truth, recording))
    # The true odometry comes out of a Newton iteration on the global position (1e-9 m).
    np.testing.assert_allclose(left, 0.0, rtol=0, atol=1e-8)


def test_without_compensation_the_force_is_the_accelerometer(bend: Callable, exactly: Callable) -> None:
    recording = exactly(bend())
    force = gravity_force(recording, compensated=False)
    np.testing.assert_array_equal(force, recording.imu.to_numpy()[:, 3:])
    assert np.abs(track_acceleration(recording)[:, 1]).max() > 0.8  # 15 m/s through R 250: 0.9 m/s2


def test_printed_form_leaves_the_change_of_twist(
    bend: Callable, exactly: Callable, true_angles: Callable
) -> None:
    """-V^2 k1' r_z of lateral acceleration stays in cant ramps, cant times bend in vertical curves."""
    truth = bend()
    recording = exactly(truth)
    exact = gravity_in_body(true_angles(truth, recording))
    left = (gravity_force(recording, compensated=True, printed=True) - exact)[:, 1]
    speed = recording.odometry["speed_mps"].to_numpy()
    frame = design_frame(recording)
    ramp = -(speed**2) * frame.dk[:, 0] * recording.mount_position_m[2]
    coupling = speed**2 * (frame.k[:, 2] - frame.rates[:, 2])
    assert np.abs(ramp).max() > 0.02 and np.abs(coupling).max() > 0.005
    # Neglected: that coupling times the lever's turning, and 1/cos(pitch).
    np.testing.assert_allclose(left, ramp + coupling, rtol=0, atol=1e-3)


def test_positions_beyond_the_ends_are_taken_at_the_end(bend: Callable, exactly: Callable) -> None:
    recording = exactly(bend())
    recording.odometry["position_m"] += 30.0
    assert recording.odometry["position_m"].max() > recording.track.end_m
    frame = design_frame(recording)
    assert frame.s_m.max() == recording.track.end_m
    assert np.isfinite(track_acceleration(recording)).all()


def test_the_curves_are_those_of_the_design_where_the_odometry_is(bend: Callable, exactly: Callable) -> None:
    """Bit by bit, whatever pieces the design is made of; without compensation there are none."""
    recording = exactly(bend())
    frame, found = design_frame(recording), gravity_and_curves(recording, compensated=True)
    np.testing.assert_array_equal(
        found.curves, [frame.k[:, 2], frame.dk[:, 2], frame.k[:, 1], frame.dk[:, 1]]
    )
    assert gravity_and_curves(recording, compensated=False).curves.shape == (4, 0)
    place = recording.odometry.copy()
    place.iloc[7, 0] = np.nan
    with pytest.raises(InputError, match="is not on track"):
        gravity_and_curves(replace(recording, odometry=place), compensated=True)
