"""Shifts along the track: the smoother of a process of exponential covariance, by dense matrices."""

import numpy as np
import pytest
from simrail.estimators.rails.along_track import CORRELATION_M, alike_of, others_of, smoothed


def test_smoothing_is_that_of_the_joint_gaussian() -> None:
    """Posterior of N(0, sd^2 exp(-|s|/length)) at 40 nodes, of which some have a measurement."""
    rng = np.random.default_rng(1)
    step, sd, nodes = 10.0, 0.4, 40
    info = rng.uniform(0.0, 50.0, nodes) * (rng.random(nodes) < 0.7)
    measured = rng.standard_normal(nodes)
    places = step * np.arange(nodes)
    prior = sd**2 * np.exp(-np.abs(places[:, None] - places) / CORRELATION_M)
    covariance = np.linalg.inv(np.linalg.inv(prior) + np.diag(info))
    mean, variance = smoothed(info, info * measured, sd, step)
    assert mean == pytest.approx(covariance @ (info * measured), rel=1e-9, abs=1e-12)
    assert variance == pytest.approx(np.diag(covariance), rel=1e-9)


def test_without_measurements_the_process_is_as_it_was() -> None:
    mean, variance = smoothed(np.zeros(30), np.zeros(30), 0.3, 10.0)
    assert (mean == 0.0).all()
    assert variance == pytest.approx(0.09, rel=1e-9)


def test_others_leave_a_pass_itself_out() -> None:
    """Equal scatter, equal weights: the mean of the other two."""
    lines = np.array([1.0, -1.0])[None, None, :] * np.array([0.0, 1.0, 2.0])[:, None, None]
    others, scatter = others_of(lines)
    assert others[0, 0] == pytest.approx([1.5, -1.5], abs=0.6)
    assert scatter[0, 0, 0] == pytest.approx(1.5, abs=0.6)


def test_a_mirrored_pass_is_not_alike() -> None:
    line = np.sin(np.arange(400) / 7.0)
    alike = alike_of(np.stack([line, line, line, -line])[:, None, :])
    assert alike[:3] == pytest.approx(1.0) and alike[3] == pytest.approx(-1.0)
