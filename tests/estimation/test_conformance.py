"""The battery passes what it should, and each of its checks fails on a fault planted for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from channels import harmonic
from simrail.estimators.ahrs import Imufusion, Vqf
from simrail.estimators.attitude.complementary import ComplementaryFilter
from simrail.estimators.attitude.ekf import AttitudeEkf
from simrail.estimators.attitude.gda import AttitudeGda
from simrail.estimators.attitude.veillard_ekf import VeillardEkf
from simrail.estimators.baselines import DesignAngles
from simrail.estimators.odometry.encoder import EncoderOdometry
from simrail.estimators.odometry.spectral import SpectralOdometry
from simrail.estimators.odometry.zero_velocity import ZeroVelocityOdometry
from simrail.estimators.profile.profile_filter import ProfileFilter
from simrail.estimators.track_relative.smoother import TrackRelativeSmoother
from simrail.estimators.trajectory.smoother import TrajectorySmoother

from simrail.cli.templates import write_template
from simrail.core.columns import ATTITUDE, IRREGULARITY
from simrail.estimation.choose_odometry import with_odometry
from simrail.estimation.conformance import (
    check_estimator,
    check_odometry,
    prefix_lengths,
    require_well_formed,
)
from simrail.estimation.estimate import Estimate, Estimator
from simrail.estimation.user_modules import class_named
from simrail.recording.recording import Recording
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.measure import measure
from simrail.track.file import track_by_name
from simrail.vehicle.speed_profile import SpeedProfile


@lru_cache
def ride(direction: int = 1, imu: str = "lord_3dm_gx4_25") -> Recording:
    """A short ride with a rest of 3 s, through a curve."""
    start, end = (430.0, 560.0) if direction > 0 else (560.0, 430.0)
    truth = kinematic_truth(
        track_by_name("condequinto_olivar"),
        SpeedProfile(start, end, 10.0, acceleration_mps2=1.0, jerk_mps3=1.0, rest_s=3.0),
        channels={"roll": harmonic(0.005, frequency_hz=1.1), "lateral": harmonic(0.003, frequency_hz=0.7)},
    )
    recording = measure(
        truth,
        name="short",
        mount=Mount("axle", "body", (0.0, 0.0, 0.6)),
        grade=load_grade(imu),
        encoder=EncoderSpec("wheel", radius_error_sd=0.001),
        seed=1,
        draw=0,
    )
    return with_odometry(recording, "encoder")


OURS = [
    AttitudeEkf(),
    AttitudeEkf(compensated=False),
    AttitudeEkf(tuning="paper_final"),
    AttitudeEkf(tuning="paper_initial", process_noise="per_step", rest_bias=False),
    AttitudeEkf(tuning="paper_final", process_noise="per_step", rest_bias=False),
    AttitudeEkf(printed=True),
    AttitudeEkf(compensated=False, doubt=100.0),
    AttitudeGda(),
    AttitudeGda(tuning="paper", rest_bias=False),
    AttitudeGda(printed=True),
    AttitudeGda(compensated=False, tuning="paper"),
    ComplementaryFilter(),
    ComplementaryFilter(compensated=True, rest_bias=False),
    ComplementaryFilter(printed=True),
    DesignAngles(),
    Vqf(),
    Vqf(compensated=True),
    Imufusion(),
    Imufusion(compensated=True, rest_bias=False),
    ProfileFilter(other_axle_m=-6.0),
    ProfileFilter(gyro=False),
    ProfileFilter(other_axle_m=2.0, printed=True),
    TrajectorySmoother(),
    TrajectorySmoother(with_covariance=False),
    TrajectorySmoother(smoothed=False),
    TrajectorySmoother(smoothed=False, printed=True, rest_bias=False),
    TrackRelativeSmoother(),
    TrackRelativeSmoother(smoothed=False),
]


@pytest.mark.parametrize("estimator", OURS, ids=lambda estimator: type(estimator).__name__)
def test_ours_pass(estimator: Estimator) -> None:
    check_estimator(estimator, ride())


BACKWARDS = {
    "ekf": AttitudeEkf(),
    "gda": AttitudeGda(),
    "complementary": ComplementaryFilter(compensated=True),
    "vqf": Vqf(),
    "imufusion": Imufusion(),
    "profile": ProfileFilter(other_axle_m=-2.0),
    "trajectory": TrajectorySmoother(draws=2),
    "trajectory_filter": TrajectorySmoother(smoothed=False),
    "track_relative": TrackRelativeSmoother(passes=1),
    "track_relative_filter": TrackRelativeSmoother(smoothed=False),
}


@pytest.mark.parametrize("estimator", BACKWARDS.values(), ids=list(BACKWARDS))
def test_ours_pass_backwards_and_with_a_perfect_imu(estimator: Estimator) -> None:
    check_estimator(estimator, ride(-1, "ideal"))


def test_a_smoother_that_says_it_is_causal_is_caught() -> None:
    """The trajectory smoother does look ahead."""

    @dataclass(frozen=True)
    class Liar(TrajectorySmoother):
        causal = True

    with pytest.raises(AssertionError, match="sees_no_future"):
        check_estimator(Liar(), ride())


def test_ours_pass_without_an_encoder() -> None:
    check_estimator(AttitudeEkf(), replace(ride(), encoder=None, encoder_sheet=None))


def angles(recording: Recording) -> pd.DataFrame:
    """A harmless estimate to put faults into."""
    gyro = recording.imu.to_numpy()[:, :3]
    return pd.DataFrame(np.cumsum(gyro, axis=0) * 0.004, index=recording.imu.index, columns=list(ATTITUDE))


@dataclass(frozen=True)
class Sound:
    """What the faulty ones would be without their fault."""

    causal = True

    def estimate(self, recording: Recording) -> Estimate:
        return Estimate(states=self.spoil(angles(recording), recording), mount=recording.mount)

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        return states


def test_the_sound_one_passes() -> None:
    check_estimator(Sound(), ride())


class LookAhead(Sound):
    """Uses the next sample."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        return states.shift(-1).ffill()


class MeanOfAll(Sound):
    """Takes off the mean of the whole ride: the commonest look-ahead."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        return states - states.mean()


class BiasFromTheWholeRest(Sound):
    """Subtracts the mean over the whole rest, also at the rest's start: shows in the rest only."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        speed = recording.odometry["speed_mps"].to_numpy()
        rest = int(np.argmax(speed != 0.0)) or len(speed)
        return states - recording.imu.to_numpy()[:rest, :3].mean(axis=0)


class Mutating(Sound):
    """Takes the bias off in place."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        recording.imu["gyro_x_radps"] -= 0.001
        return states


class AddsOdometryColumn(Sound):
    """Leaves something behind in the odometry."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        recording.odometry["curvature_1pm"] = 0.0
        return states


class WrongColumn(Sound):
    """Degrees, under a name of its own."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        return np.degrees(states).rename(columns={"roll_rad": "roll_deg"})


class NotANumber(Sound):
    """One NaN in the middle."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        states.iloc[len(states) // 2, 1] = np.nan
        return states


class Shorter(Sound):
    """Drops the first sample."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        return states.iloc[1:]


class NegativeSd(Sound):
    """States a negative standard deviation."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        return states.assign(roll_sd_rad=-1.0)


class Random(Sound):
    """Jitters by itself."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        return states + 1e-12 * np.random.default_rng().standard_normal(states.shape)


MEMORY: list[float] = [0.0]


class Remembers(Sound):
    """Carries the last ride's end into the next."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        states = states + MEMORY[0]
        MEMORY[0] = float(states.iloc[-1, 0])
        return states


class DividesBySpeed(Sound):
    """Cannot stand: 0/0 at rest."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        speed = np.abs(recording.odometry["speed_mps"]).cummax()
        with np.errstate(invalid="ignore"):
            return states.mul(speed.iloc[-1] / speed.iloc[-1], axis=0)


class ForwardOnly(Sound):
    """Cannot run backwards: a square root of the way made."""

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        way = recording.odometry["position_m"].iloc[-1] - recording.start_position_m
        with np.errstate(invalid="ignore"):
            return states + 0.0 * np.sqrt(way + 1e-6)


class OtherMount(Sound):
    """Speaks of another IMU."""

    def estimate(self, recording: Recording) -> Estimate:
        return replace(super().estimate(recording), mount="roof")


class CrookedCovariance(Sound):
    """A covariance that is not symmetric."""

    def estimate(self, recording: Recording) -> Estimate:
        covariance = np.tile(np.eye(3), (len(recording.imu), 1, 1))
        covariance[:, 0, 1] = 0.1
        return replace(super().estimate(recording), covariance=covariance, covariance_of=ATTITUDE)


class IndefiniteCovariance(Sound):
    """A correlation of 2."""

    def estimate(self, recording: Recording) -> Estimate:
        covariance = np.tile(np.eye(3), (len(recording.imu), 1, 1))
        covariance[:, 0, 1] = covariance[:, 1, 0] = 2.0
        return replace(super().estimate(recording), covariance=covariance, covariance_of=ATTITUDE)


@dataclass(frozen=True)
class Rails(Sound):
    """Says something of the rails as well; gauge is left open."""

    fault: str = ""

    def estimate(self, recording: Recording) -> Estimate:
        places = pd.Index(0.25 * np.arange(40.0, 60.0), name="position_m")
        geometry = pd.DataFrame(0.0, index=places, columns=list(IRREGULARITY)).assign(gauge_m=np.nan)
        if self.fault == "hole":
            geometry.iloc[3, 0] = np.nan
        elif self.fault == "column":
            geometry = geometry.rename(columns={"gauge_m": "gauge_mm"})
        elif self.fault == "step":
            geometry = geometry.drop(index=12.0)
        return replace(super().estimate(recording), geometry=geometry)


def test_geometry_may_leave_a_quantity_open_but_not_in_places() -> None:
    check_estimator(Rails(), ride())
    for fault, words in (
        ("hole", "not finite in alignment_m, here and there"),
        ("column", "geometry lacks gauge_m"),
        ("step", "geometry is not uniform"),
    ):
        with pytest.raises(AssertionError, match=words):
            require_well_formed(Rails(fault).estimate(ride()), ride())


@dataclass(frozen=True)
class Draws(Rails):
    """Draws what the rails may be."""

    def estimate(self, recording: Recording) -> Estimate:
        rails = Rails().estimate(recording)
        assert rails.geometry is not None
        rng = np.random.default_rng(None if self.fault == "seed" else 1)
        draws = 1e-3 * rng.standard_normal((3, len(rails.geometry), 4))
        if self.fault != "gauge":
            draws[:, :, 3] = np.nan
        if self.fault == "hole":
            draws[1, 2, 0] = np.nan
        if self.fault == "places":
            draws = draws[:, 1:]
        return replace(
            rails, geometry=None if self.fault == "alone" else rails.geometry, geometry_draws=draws
        )


def test_draws_are_of_the_geometry_and_the_same_bits_again() -> None:
    check_estimator(Draws(), ride())
    for fault, words in (
        ("hole", "not finite where the geometry is"),
        ("gauge", "not finite where the geometry is"),
        ("places", "have the shape"),
        ("alone", "without a geometry"),
    ):
        with pytest.raises(AssertionError, match=words):
            require_well_formed(Draws(fault).estimate(ride()), ride())
    with pytest.raises(AssertionError, match="geometry_draws"):
        check_estimator(Draws("seed"), ride())


class SecretlyCompensated(Sound):
    """Takes the odometry's speed, and does not say so."""

    needs = ()

    def spoil(self, states: pd.DataFrame, recording: Recording) -> pd.DataFrame:
        return states.mul(recording.odometry["speed_mps"], axis=0)


class King(Sound):
    """Plays a role that nobody knows."""

    role = "king"


@dataclass(frozen=True)
class Wheel(EncoderOdometry):
    """The encoder's odometry, to put faults into."""

    fault: str = ""

    def __post_init__(self) -> None:
        """Judge nothing."""

    def estimate(self, recording: Recording) -> Estimate:
        estimate = super().estimate(recording)
        states = estimate.states
        if self.fault == "column":
            states = states.drop(columns="acceleration_sd_mps2")
        elif self.fault == "copy" and recording.odometry is not None:
            states = states.assign(speed_mps=recording.odometry["speed_mps"] + 1e-9)
        return replace(estimate, states=states)


def test_odometries_pass_and_their_faults_are_caught() -> None:
    check_odometry(EncoderOdometry(), ride())
    check_odometry(Wheel(), ride(-1, "ideal"))
    for fault, words in (
        ("column", "gives_an_odometry: AssertionError: states lack acceleration_sd_mps2"),
        ("copy", "is_no_copy: AssertionError: without another odometry: speed_mps differs"),
    ):
        with pytest.raises(AssertionError, match=words):
            check_odometry(Wheel(fault=fault), ride())
    with pytest.raises(AssertionError, match="an odometry needs an odometry"):
        check_odometry(AttitudeEkf(), ride())


SHAKEN: dict[str, Estimator] = {
    "spectral": SpectralOdometry(0.9, -16.0, "given"),
    "spectral_at_rest": SpectralOdometry(0.9, frame=128, hop=32),
    "spectral_own": SpectralOdometry(calibration="encoder", direction="encoder", printed=True),
    "veillard": VeillardEkf(0.9, -16.0, "given", direction="backwards"),
    "veillard_compensated": VeillardEkf(0.9, frame=128, hop=32, compensated=True, dated="end"),
    "veillard_own": VeillardEkf(calibration="encoder", start_bias=False),
    "zero_velocity": ZeroVelocityOdometry(),
    "zero_velocity_smoothed": ZeroVelocityOdometry(smoothed=True),
}


@pytest.mark.parametrize("method", SHAKEN.values(), ids=list(SHAKEN))
def test_odometries_of_an_imu_pass(method: Estimator) -> None:
    check_odometry(method, ride())


def test_odometries_of_an_imu_pass_backwards_and_with_a_perfect_imu() -> None:
    for method in (SHAKEN["spectral"], SHAKEN["veillard_compensated"], SHAKEN["zero_velocity"]):
        check_odometry(method, ride(-1, "ideal"))


def test_the_template_of_an_odometry_passes(tmp_path: Path) -> None:
    write_template("odometry", "my_odometry", folder=tmp_path)
    made = class_named("my_odometry.py:MyOdometry", tmp_path)()
    check_odometry(made, ride())

    states, other = made.estimate(ride()).states, EncoderOdometry().estimate(ride()).states
    assert states["position_m"].iloc[-1] == pytest.approx(other["position_m"].iloc[-1], abs=0.01)


class UnsaidCausal(Sound):
    """Does not say whether it is causal."""

    causal = None


class NoDataclass:
    """Has no parameters that could be written down."""

    causal = True

    def estimate(self, recording: Recording) -> Estimate:
        return Sound().estimate(recording)


@dataclass
class Thawed:
    """Parameters that can be changed behind one's back."""

    causal = True

    def estimate(self, recording: Recording) -> Estimate:
        return Sound().estimate(recording)


class SmootherThatSaysSo(MeanOfAll):
    """Looks ahead, and says so: allowed."""

    causal = False


@pytest.mark.parametrize(
    ("faulty", "check", "words"),
    [
        (LookAhead, "sees_no_future", "differs from sample"),
        (MeanOfAll, "sees_no_future", "differs from sample"),
        (BiasFromTheWholeRest, "sees_no_future", "differs from sample 0"),
        (Mutating, "leaves_the_recording_alone", "changed imu"),
        (AddsOdometryColumn, "leaves_the_recording_alone", "changed odometry"),
        (WrongColumn, "estimate_is_well_formed", "roll_deg"),
        (NotANumber, "estimate_is_well_formed", "not finite in pitch_rad"),
        (Shorter, "estimate_is_well_formed", "not at the IMU's times"),
        (NegativeSd, "estimate_is_well_formed", "negative"),
        (Random, "is_deterministic", "run again"),
        (Remembers, "is_deterministic", "run again"),
        (DividesBySpeed, "works_at_standstill", "not finite"),
        (ForwardOnly, "works_backwards", "not finite"),
        (OtherMount, "estimate_is_well_formed", "roof"),
        (CrookedCovariance, "estimate_is_well_formed", "not symmetric"),
        (IndefiniteCovariance, "estimate_is_well_formed", "positive semidefinite"),
        (SecretlyCompensated, "needs_what_it_says", "NoneType"),
        (King, "says_what_it_is", "role"),
        (UnsaidCausal, "says_whether_causal", "causal"),
        (NoDataclass, "frozen_dataclass", "no dataclass"),
        (Thawed, "frozen_dataclass", "not frozen"),
    ],
)
def test_a_planted_fault_is_caught_by_its_check(faulty: Callable, check: str, words: str) -> None:
    with pytest.raises(AssertionError) as caught:
        check_estimator(faulty(), ride())
    lines = [line for line in str(caught.value).splitlines() if line.startswith(check)]
    assert lines and words in lines[0]


def test_a_smoother_may_look_ahead() -> None:
    check_estimator(SmootherThatSaysSo(), ride())


def test_prefixes_end_at_the_start_about_rests_and_at_the_end() -> None:
    """Of 3 s of rest at first and a rest at last, at the rate of the ride."""
    recording = ride()
    n, rate = len(recording.imu), recording.imu_sheet.rate_hz
    lengths = prefix_lengths(recording)
    assert lengths == sorted(set(lengths)) and lengths[0] == 2 and lengths[-1] == n - 1
    assert {n // 3, n // 2 + 1} <= set(lengths)
    assert sum(0.8 * rate < length < 1.2 * rate for length in lengths) == 1  # within the first rest
    assert sum(2.4 * rate < length < 3.2 * rate for length in lengths) == 2  # at its end
    assert sum(n - 6.0 * rate < length < n - 1 for length in lengths) >= 1  # within the last
