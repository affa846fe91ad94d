"""Recordings as lanes of one loop: the bits of each by itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from simrail.estimators.attitude.ekf import AttitudeEkf
from simrail.estimators.attitude.gda import AttitudeGda
from simrail.estimators.attitude.lanes import LANES, LEAST, by_lanes

from simrail.recording.recording import Recording, beginning

METHODS = [
    AttitudeEkf(),
    AttitudeEkf(compensated=False, tuning="paper_final", doubt=0.5),
    AttitudeGda(),
    AttitudeGda(compensated=False, gyro_error_radps=0.01, rest_bias=False),
]


@pytest.fixture
def noisy(bend: Callable, exactly: Callable) -> Recording:
    """An exact ride; its noise is that of `drawn`."""
    recording = exactly(bend())
    recording.odometry[["position_sd_m", "speed_sd_mps", "acceleration_sd_mps2"]] = 1.5, 0.02, 0.04
    return recording


@pytest.fixture
def drawn() -> Callable[[Recording, int], list[Recording]]:
    """As many draws of a recording: its signals with noise, each with its own."""

    def draw(recording: Recording, count: int) -> list[Recording]:
        rng = np.random.default_rng(7)
        noise = 1e-2 * rng.standard_normal((count, *recording.imu.shape))
        return [replace(recording, imu=recording.imu + one) for one in noise]

    return draw


@pytest.mark.long
@pytest.mark.parametrize("method", METHODS, ids=["ekf", "ekf_printed_noise", "gda", "gda_uncompensated"])
@pytest.mark.parametrize("count", [1, LEAST, LANES, LANES + 1])
def test_each_has_the_bits_that_it_has_by_itself(
    method: AttitudeEkf | AttitudeGda, count: int, noisy: Recording, drawn: Callable
) -> None:
    recordings = drawn(beginning(noisy, samples=1000), count)
    # Others in between that fit into no loop: of another length, and of another rate.
    recordings.insert(1, beginning(recordings[0], samples=777))
    other = replace(recordings[0].imu_sheet, rate_hz=125.0)
    recordings.append(replace(recordings[0], imu_sheet=other))
    for one, many in zip(recordings, method.estimate_many(recordings), strict=True):
        alone = method.estimate(one)
        assert (many.states.index == one.imu.index).all()
        np.testing.assert_array_equal(many.states.to_numpy(), alone.states.to_numpy())
        if alone.covariance is not None:
            np.testing.assert_array_equal(many.covariance, alone.covariance)
            np.testing.assert_array_equal(many.innovations.to_numpy(), alone.innovations.to_numpy())


@pytest.mark.long
def test_what_has_no_number_stays_in_its_lane(noisy: Recording, drawn: Callable) -> None:
    method, recordings = AttitudeEkf(), drawn(beginning(noisy, samples=600), LEAST)
    recordings[2].imu.iloc[300, 4] = np.nan
    found = method.estimate_many(recordings)
    finite = [bool(np.isfinite(one.states.to_numpy()).all()) for one in found]
    assert finite == [i != 2 for i in range(LEAST)]


@pytest.mark.long
def test_loops_are_shared_by_those_that_are_alike(noisy: Recording) -> None:
    short, long = beginning(noisy, samples=10), beginning(noisy, samples=20)
    heavy = replace(long, gravity_mps2=9.83)
    recordings = [*[short] * 3, *[long] * (LANES + LEAST), *[heavy] * LEAST]
    shared, alone = by_lanes(recordings)
    assert alone == [0, 1, 2]
    assert [len(part) for part in shared] == [LANES, LEAST, LEAST]
    assert sorted(i for part in shared for i in part) == list(range(3, len(recordings)))


class HandedOn(Exception):
    """What a method hands the loop, without the loop."""


@pytest.mark.parametrize(
    ("method", "module"),
    [(AttitudeEkf(), "ekf"), (AttitudeEkf(doubt=0.5), "ekf"), (AttitudeGda(), "gda")],
    ids=["ekf", "ekf_doubt", "gda"],
)
def test_each_lane_is_handed_what_is_its_own(
    method: AttitudeEkf | AttitudeGda,
    module: str,
    noisy: Recording,
    drawn: Callable,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Signals and noises in the order of the recordings, each those of the method alone."""
    recordings = drawn(beginning(noisy, samples=600), LEAST)
    recordings = [replace(one, imu=one.imu * (1.0 + 0.1 * i)) for i, one in enumerate(recordings)]

    def through(_block: object, _lanes: object, given: list, _rooms: object) -> None:
        raise HandedOn(given)

    place = f"simrail.estimators.attitude.{module}"
    monkeypatch.setattr(f"{place}.through", through)
    monkeypatch.setattr("simrail.estimators.attitude.ekf.begin_ekf", lambda *_: None)
    with pytest.raises(HandedOn) as caught:
        method.estimate_many(recordings)
    (given,) = caught.value.args
    assert len(given) == len(recordings)
    for one, handed in zip(recordings, given, strict=True):
        own = method._arrays(one)
        if isinstance(method, AttitudeEkf):
            arrays = own[0]
            expected = (arrays.rate, arrays.force, arrays.noise, arrays.process[:, None])
        else:
            expected = own[:2]
        assert len(handed) == len(expected)
        for array, alone in zip(handed, expected, strict=True):
            np.testing.assert_array_equal(array, alone)
