"""The trajectory smoother: its kernels against filterpy, its equations against sympy, its promises against draws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimators.trajectory_model import Found
from estimators.trajectory_smoother import TrajectorySmoother, log_likelihood
from simrail.recording import Recording
from simrail.testing import standing, time_reversed

DIAGONAL = np.concatenate([[0], np.cumsum(np.arange(12, 1, -1))])


def part(recording: Recording, first: int, count: int) -> Recording:
    """Some of the samples."""
    rows = slice(first, first + count)
    return replace(recording, imu=recording.imu.iloc[rows], odometry=recording.odometry.iloc[rows])


WHERE = {
    "straight": lambda ride: part(ride(70.0, 1, 0), 6000, 1500),
    "curve": lambda ride: part(ride(70.0, 1, 0), 16000, 1500),
    "standstill": lambda ride: standing(part(ride(70.0, 1, 0), 0, 1500)),
    "leaving": lambda ride: part(ride(70.0, 1, 0), 4500, 1500),
    "reverse": lambda ride: part(ride(70.0, -1, 0), 16000, 1500),
    "turned": lambda ride: time_reversed(part(ride(70.0, 1, 0), 16000, 1500)),
}


def compare(ours: Found, theirs: Found) -> None:
    sd = np.sqrt(theirs.covariance[:, DIAGONAL])
    np.testing.assert_allclose(ours.states / sd, theirs.states / sd, rtol=0, atol=1e-7)
    np.testing.assert_allclose(ours.states, theirs.states, rtol=0, atol=1e-7)
    row, column = np.triu_indices(12)
    scale = sd[:, row] * sd[:, column]
    np.testing.assert_allclose(ours.covariance / scale, theirs.covariance / scale, rtol=0, atol=1e-7)
    np.testing.assert_allclose(ours.innovations, theirs.innovations, rtol=1e-7, atol=1e-9)
    assert ours.log_likelihood == pytest.approx(theirs.log_likelihood, rel=1e-9)


@pytest.mark.parametrize("where", WHERE)
@pytest.mark.parametrize("printed", [False, True], ids=["corrected", "printed"])
def test_kernels_equal_filterpy(line_recording: Callable, where: str, printed: bool) -> None:
    """States to 1e-7 of their own sd and to 1e-7 in SI, correlations to 1e-7, likelihood to 1e-9."""
    recording = WHERE[where](line_recording)
    for smoothed in (False, True):
        ours = TrajectorySmoother(printed=printed, smoothed=smoothed)
        theirs = replace(ours, backend="filterpy")
        compare(ours.trace(recording), theirs.trace(recording))


def test_the_likelihood_alone_and_the_means_alone_are_the_same(line_recording: Callable) -> None:
    recording = WHERE["curve"](line_recording)
    smoother = TrajectorySmoother()
    found = smoother.trace(recording)
    assert log_likelihood(smoother.model(recording)) == found.log_likelihood
    assert smoother.log_likelihood(recording) == found.log_likelihood
    means = replace(smoother, with_covariance=False).trace(recording)
    assert np.array_equal(means.states, found.states)
    assert len(means.covariance) == 0
