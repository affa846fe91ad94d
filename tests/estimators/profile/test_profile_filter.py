"""The profile filter: against filterpy, a joint Gaussian and the printed delay line, and on planted waves."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.linalg import block_diag
from simrail.estimators.profile.kernel import OWN, SAME, Found, Model, profile_filter, room
from simrail.estimators.profile.model import Axles, Deviation, axles_under
from simrail.estimators.profile.profile_filter import ProfileFilter
from twins.profile import filterpy_profile, slope_weights

from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.estimation.conformance import standing
from simrail.estimation.estimate import description_of
from simrail.recording.recording import Recording
from simrail.recording.sheets.vehicle_sheet import SheetBody, Support, VehicleSheet
from simrail.ride.kinematic import along, kinematic_truth
from simrail.ride.truth import Mount
from simrail.track.design import Straight, TrackDesign
from simrail.vehicle.speed_profile import Run, SpeedProfile

L = 2.4
LINE = TrackDesign(name="line", start_m=0.0, elements=(Straight(400.0),))
WAVE_M, AMPLITUDE_M = 8.0, 2e-3

FIT_M = (150.0, 250.0)

LOOSE_M = 0.02
"""A virtual sensor believed so little takes over from the accelerometer at 0.03 Hz, 170 m at 5 m/s."""


def wave(s: np.ndarray, order: int) -> np.ndarray:
    """A sine in the rails, and its derivatives."""
    k = 2.0 * np.pi / WAVE_M
    return np.asarray(AMPLITUDE_M * k**order * np.sin(k * s + 0.5 * np.pi * order))


def chord(other_m: float) -> Callable[[np.ndarray, int], np.ndarray]:
    """Pitch, nose down, of a stiff body: the rear axle's height less the front one's, over L."""
    return lambda s, order: (wave(s, order) - wave(s + other_m, order)) / other_m


@pytest.fixture
def wavy(exactly: Callable) -> Callable[..., Recording]:
    """A stiff body on two axles over the sine, without any sensor; the IMU stands over one of them."""

    def record(profile: SpeedProfile, other_m: float = -L) -> Recording:
        channels = {"vertical": along(wave), "pitch": along(chord(other_m))}
        truth = kinematic_truth(LINE, profile, channels=channels)
        return exactly(truth, Mount("axle", "body", (0.0, 0.0, 0.0)))

    return record


FORWARD = SpeedProfile(20.0, 380.0, 5.0, acceleration_mps2=0.12, rest_s=2.0)
BACKWARD = SpeedProfile(380.0, 20.0, 5.0, acceleration_mps2=0.12, rest_s=2.0)
"""Gentle: a gain of speed times the pitch on the wave is felt along Z, 1 mm/s2 in a usual start."""

STOPPING = SpeedProfile(20.0, 380.0, 5.0, acceleration_mps2=0.12, rest_s=2.0, stops=((203.0, 15.0),))


def made(seed: int, path: np.ndarray, *, gyro: bool = True, nodes: int = 8, linear: bool = False) -> Model:
    """Arrays of chance along a path."""
    rng, dt = stream(seed, "made"), 0.02
    method = ProfileFilter(other_axle_m=-1.0, step_m=1.0 / nodes, gyro=gyro)
    index = pd.Index(dt * np.arange(len(path)), name="time_s")
    odometry = pd.DataFrame({"position_m": path, "speed_mps": np.gradient(path, dt)}, index=index)
    odometry["acceleration_mps2"] = np.gradient(odometry["speed_mps"], dt)
    imu = pd.DataFrame(0.0, index=index, columns=[f"gyro_{a}_radps" for a in "xyz"])
    imu[[f"accel_{a}_mps2" for a in "xyz"]] = [0.0, 0.0, 9.81]
    from conftest import SHEET

    recording = Recording(
        name="made",
        imu=imu,
        imu_sheet=replace(SHEET, rate_hz=1.0 / dt),
        mount="axle",
        mount_body="body",
        mount_position_m=(0.0, 0.0, 0.0),
        track=LINE,
        encoder=None,
        encoder_sheet=None,
        start_position_m=float(path[0]),
        odometry=odometry,
    )
    model = method.model(recording)
    return model._replace(
        vertical=0.3 * rng.standard_normal(len(path)),
        rate=5e-3 * rng.standard_normal(len(path)),
        rate_variance=25e-6,
        accel_variance=0.09,
        is_linear=linear,
    )


def there_and_back(samples: int = 500) -> np.ndarray:
    """Forwards, a rest, backwards beyond where it began, and forwards again."""
    t = np.linspace(0.0, 1.0, samples)
    way = np.interp(t, [0, 0.1, 0.4, 0.5, 0.8, 0.85, 1.0], [0, 0, 3.0, 3.0, -1.2, -1.2, 0.5])
    return np.asarray(50.03 + way)


@pytest.mark.parametrize("gyro", [True, False])
@pytest.mark.parametrize("linear", [pytest.param(True, marks=pytest.mark.long), False])
def test_kernel_equals_filterpy(gyro: bool, linear: bool) -> None:
    model = made(1, there_and_back(), gyro=gyro, linear=linear)
    ours, theirs = room(model), room(model)
    likelihoods = profile_filter(model, ours), filterpy_profile(model, theirs)
    assert likelihoods[0] == pytest.approx(likelihoods[1], rel=1e-9)
    for name in ("states", "variances", "oldest", "front"):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=1e-9, atol=1e-11)
    assert np.isfinite(ours.oldest[:, 0]).all()


def joint(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance of all nodes at the end of a ride forwards that forgets none, by one Gaussian.

    Each state is so much of the start and of the noise of each sample: a node is h at an earlier time, and
    nothing is copied or filtered. (n, 2): height and variance of the nodes from the first to the last.
    """
    dt, n, start = model.step_s, len(model.place), len(model.start)
    count = start - OWN
    covariance = block_diag(
        model.start_covariance,
        *[
            block_diag([[model.accel_variance]], np.diag(model.bias_walk), model.angle_process)
            for _ in range(n - 1)
        ],
    )
    own = np.eye(start, len(covariance))[:OWN]
    known = np.zeros(OWN)
    base, step = model.wheelbase_m, model.step_m
    low = math.floor((model.place[0] - base) / step) - 1
    last = math.floor(model.place[0] / step)
    nodes = {j: (np.eye(start, len(covariance))[OWN + j % count], 0.0) for j in range(low, last + 1)}
    f = np.eye(OWN)
    f[0, 1], f[0, 2], f[1, 2] = dt, -0.5 * dt * dt, -dt
    f[4:6, 4:6] = model.angle_step
    g = np.array([0.5 * dt * dt, dt, 0, 0, 0, 0])
    rows, values, variances = [], [], []
    for k in range(n):
        if k > 0:
            own, known = f @ own, f @ known + g * model.vertical[k]
            at = start + 5 * (k - 1)
            own[:, at] += g
            own[[2, 3, 4, 5], [at + 1, at + 2, at + 3, at + 4]] += 1.0
        for j in range(last + 1, math.floor(model.place[k] / step) + 1):
            late = (model.place[k] - j * step) / model.speed[k]
            nodes[j] = own[0] - late * own[1], known[0] - late * known[1]
            last = j
        row, value = (own[0], -known[0]) if model.moves[k] else (own[1], -known[1])
        rows.append(row), values.append(value)
        variances.append(model.zero_variance[k] if model.moves[k] else model.still_variance)
        if model.sees[k]:
            j = math.floor((model.place[k] - base) / step)
            weights = (
                -model.speed[k]
                / (base * step)
                * slope_weights((model.place[k] - base) / step - j, linear=False)
            )
            around = [nodes[j - 1 + i] for i in range(4)]
            rows.append(
                own[1] / base
                + own[3]
                + own[5]
                + sum(w * a for w, (a, _) in zip(weights, around, strict=True))
            )
            values.append(
                model.rate[k]
                - known[1] / base
                - sum(w * b for w, (_, b) in zip(weights, around, strict=True))
            )
            variances.append(model.rate_variance)
    h = np.array(rows)
    gain = covariance @ h.T @ np.linalg.inv(h @ covariance @ h.T + np.diag(variances))
    mean, spread = gain @ np.array(values), covariance - gain @ h @ covariance
    found = [(a @ mean + b, a @ spread @ a) for a, b in (nodes[j] for j in sorted(nodes))]
    return np.array(found), np.array(sorted(nodes))


def test_the_nodes_are_those_of_a_joint_gaussian() -> None:
    """Over less than a wheelbase no node is forgotten: all are of one posterior."""
    t = np.linspace(0.0, 1.0, 40)
    model = made(2, 50.03 + np.interp(t, [0, 0.2, 1.0], [0.0, 0.0, 0.13]))
    found = room(model)
    profile_filter(model, found)
    expected, nodes = joint(model)
    np.testing.assert_allclose(found.oldest[nodes - found.first_node], expected, rtol=1e-7, atol=1e-10)
    assert len(nodes) > 10


def printed_filter(model: Model) -> np.ndarray:
    """Heights h^0 (n,) by the delay line as printed: one node a sample, h^(i+1) <- h^i, at one speed."""
    dt, lags = model.step_s, round(model.wheelbase_m / model.step_m)
    n = OWN + lags
    x, p = np.zeros(n), np.zeros((n, n))
    p[:OWN, :OWN] = model.start_covariance[:OWN, :OWN]
    correlation = model.start_covariance
    count = len(model.start) - OWN
    first = math.floor(model.place[0] / model.step_m)
    keep = [*range(OWN), *(OWN + (first - i) % count for i in range(1, lags + 1))]
    p = correlation[np.ix_(keep, keep)].copy()
    f = np.zeros((n, n))
    f[:OWN, :OWN] = np.eye(OWN)
    f[0, 1], f[0, 2], f[1, 2] = dt, -0.5 * dt * dt, -dt
    f[4:6, 4:6] = model.angle_step
    f[OWN, 0] = 1.0
    f[np.arange(OWN + 1, n), np.arange(OWN, n - 1)] = 1.0
    g = np.zeros(n)
    g[:2] = 0.5 * dt * dt, dt
    q = model.accel_variance * np.outer(g, g)
    q[2, 2], q[3, 3] = model.bias_walk
    q[4:6, 4:6] += model.angle_process
    heights = []
    for k in range(len(model.place)):
        if k > 0:
            x, p = f @ x + g * model.vertical[k], f @ p @ f.T + q
        zero, gyro = np.zeros(n), np.zeros(n)
        zero[0] = 1.0
        gyro[[1, 3, 5]] = 1.0 / model.wheelbase_m, 1.0, 1.0
        slope = model.speed[k] / (model.wheelbase_m * -model.step_m)
        gyro[n - 1], gyro[n - 2] = -slope, slope
        for row, value, variance in (
            (zero, 0.0, model.zero_variance[k]),
            (gyro, model.rate[k], model.rate_variance),
        ):
            gain = p @ row / (row @ p @ row + variance)
            x, p = x + gain * (value - row @ x), p - np.outer(gain, row @ p)
        heights.append(x[0])
    return np.array(heights)


def test_at_one_speed_it_is_the_printed_delay_line() -> None:
    """Where the nodes lie a sample's way apart, places and times are the same."""
    model = made(3, 50.0 + 0.125 * (np.arange(200) + 1e-9), linear=True)
    found = room(model)
    profile_filter(model, found)
    expected = printed_filter(model)
    # The two differ in the nodes before the start, of which the grid has one at the IMU.
    np.testing.assert_allclose(found.states[:, 0], expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def fitted(estimate: pd.DataFrame, *, first_m: float, last_m: float) -> tuple[float, float]:
    """Amplitude over the planted one, and phase ahead of it along s, degrees."""
    inside = estimate.loc[first_m:last_m]
    s = inside.index.to_numpy()
    k = 2.0 * np.pi / WAVE_M
    drift = np.vander((s - s.mean()) / np.ptp(s), 7)  # waves as long as the ride, which nothing tells
    basis = np.column_stack([np.sin(k * s), np.cos(k * s), drift])
    sine, cosine, *_ = np.linalg.lstsq(basis, inside["vertical_profile_m"].to_numpy(), rcond=None)[0]
    return math.hypot(sine, cosine) / AMPLITUDE_M, math.degrees(math.atan2(cosine, sine))


@pytest.mark.parametrize("profile", [FORWARD, BACKWARD, STOPPING], ids=["forward", "backward", "stopping"])
@pytest.mark.parametrize("other_m", [-L, L], ids=["front", "rear"])
def test_a_planted_wave_is_found(profile: SpeedProfile, other_m: float, wavy: Callable) -> None:
    recording = wavy(profile, other_m)
    method = ProfileFilter(other_axle_m=other_m, deviation_rad=0.0, profile_sd_m=LOOSE_M)
    gain, phase = fitted(method.estimate(recording).geometry, first_m=FIT_M[0], last_m=FIT_M[1])
    # By so much the virtual sensor turns the newest node (see the Butterworth filter below), rad: the more,
    # the slower the train is on the stretch.
    motion = recording.odometry[recording.odometry["position_m"].between(*FIT_M)]
    speed = float(motion["speed_mps"].abs()[motion["speed_mps"] != 0.0].mean())
    density = 2.0 * LOOSE_M**2 * method.profile_length_m / speed
    cut = (recording.imu_sheet.accel_noise_mpsqrts**2 / density) ** 0.25
    most = math.sqrt(2.0) * cut / (2.0 * math.pi * speed / WAVE_M)
    assert most < 0.15
    assert gain == pytest.approx(1.0, abs=most)
    assert abs(math.radians(phase)) < most


def test_a_stop_keeps_what_was_known(wavy: Callable) -> None:
    """Fifteen seconds on a slope of the wave: the height stays, though the virtual sensor says zero."""
    recording = wavy(STOPPING)
    method = ProfileFilter(other_axle_m=-L, profile_sd_m=LOOSE_M)
    states = method.estimate(recording).states["vertical_m"]
    speed = recording.odometry["speed_mps"]
    stop = speed.index[(speed == 0.0) & (speed.index > 5.0)]
    stop = stop[stop < stop[0] + 14.9]
    truth = wave(np.array([203.0]), 0)[0]
    assert abs(truth) > 0.5 * AMPLITUDE_M
    assert abs(states.loc[stop].iloc[-1] - states.loc[stop].iloc[250]) < 0.05 * AMPLITUDE_M


def test_it_runs_to_and_fro(wavy: Callable) -> None:
    """What is passed again, either way, is found again."""
    profile = replace(FORWARD, end_m=250.0, runs=(Run(120.0, 5.0), Run(300.0, 5.0)))
    method = ProfileFilter(other_axle_m=-L, deviation_rad=0.0, profile_sd_m=LOOSE_M)
    geometry = method.estimate(wavy(profile)).geometry
    for first_m, last_m in ((150.0, 230.0),):
        gain, phase = fitted(geometry, first_m=first_m, last_m=last_m)
        assert gain == pytest.approx(1.0, abs=0.1) and abs(phase) < 6.0


@pytest.mark.parametrize("profile", [FORWARD, BACKWARD], ids=["forward", "backward"])
@pytest.mark.parametrize("other_m", [-L, L], ids=["front", "rear"])
def test_the_gyros_sign(profile: SpeedProfile, other_m: float, wavy: Callable) -> None:
    """A wave that a deaf accelerometer cannot tell is told by the gyro, and turned by a wrong sign."""
    recording = wavy(profile, other_m)
    recording.imu["accel_z_mps2"] = 9.81 + 1e-6 * np.arange(len(recording.imu)) % 2
    deaf = replace(recording, imu_sheet=replace(recording.imu_sheet, accel_noise_mpsqrts=0.05))
    method = ProfileFilter(other_axle_m=other_m, deviation_rad=0.0)
    right = fitted(method.estimate(deaf).geometry, first_m=FIT_M[0], last_m=FIT_M[1])
    wrong_imu = deaf.imu.assign(gyro_y_radps=-deaf.imu["gyro_y_radps"])
    wrong = fitted(method.estimate(replace(deaf, imu=wrong_imu)).geometry, first_m=FIT_M[0], last_m=FIT_M[1])
    assert right[0] > 0.5 and abs(right[1]) < 40.0
    assert abs(wrong[1]) > 140.0


def test_without_a_gyro_it_is_a_butterworth_filter(wavy: Callable) -> None:
    """H = p^2 / (p^2 + sqrt 2 wc p + wc^2) at p = i w, with wc = (q / r)^(1/4) of the intensities q and r.

    That is the stationary Kalman filter of a double integrator that is measured: as the IMU passes a place.
    """
    recording = wavy(FORWARD)
    sheet = replace(
        recording.imu_sheet,
        accel_turn_on_bias_mps2=0.0,
        accel_bias_instability_mps2=0.0,
        accel_noise_mpsqrts=0.02,
    )
    method = ProfileFilter(gyro=False, oldest=False, other_axle_m=-L)
    recording = replace(recording, imu_sheet=sheet)
    gain, phase = fitted(method.estimate(recording).geometry, first_m=FIT_M[0], last_m=FIT_M[1])
    speed = 5.0
    q, r = sheet.accel_noise_mpsqrts**2, 2.0 * method.profile_sd_m**2 * method.profile_length_m / speed
    cut, p = (q / r) ** 0.25, 2j * math.pi * speed / WAVE_M
    expected = p**2 / (p**2 + math.sqrt(2.0) * cut * p + cut**2)
    assert gain == pytest.approx(abs(expected), rel=0.03)
    assert phase == pytest.approx(math.degrees(np.angle(expected)), abs=2.5)
    assert abs(math.degrees(np.angle(expected))) > 20.0


def test_the_oldest_node_is_surer_than_the_newest(wavy: Callable) -> None:
    recording = wavy(FORWARD)
    oldest, newest = (
        ProfileFilter(other_axle_m=-L, oldest=oldest).estimate(recording).geometry for oldest in (True, False)
    )
    sds = [geometry["vertical_profile_sd_m"].loc[FIT_M[0] : FIT_M[1]].mean() for geometry in (oldest, newest)]
    assert sds[0] < 0.95 * sds[1]


def test_independent_zeros_take_long_waves_away(wavy: Callable) -> None:
    recording = wavy(FORWARD)
    method = ProfileFilter(other_axle_m=-L, deviation_rad=0.0)
    gains = [
        fitted(
            replace(method, independent_zeros=white).estimate(recording).geometry,
            first_m=FIT_M[0],
            last_m=FIT_M[1],
        )
        for white in (False, True)
    ]
    assert gains[1][0] < 0.92 * gains[0][0]


def test_a_delay_line_over_time_is_blind_below_its_speed() -> None:
    """n samples are enough for 5 m/s: at 4 m/s they do not reach back to the other axle."""
    k = np.arange(400)
    fast, slow = (made(1, 50.0 + v * 0.02 * k) for v in (6.0, 4.0))
    from simrail.estimators.profile.model import _reaches

    assert _reaches(fast.place, 1.0, 0.02)[-1] and not _reaches(slow.place, 1.0, 0.02).any()


def test_the_oscillator_of_the_deviation() -> None:
    """Its step keeps the stationary covariance; slow turns pass, those at its frequency do not."""
    f, q = Deviation(1e-3, 5.0, 0.4).over(0.004)
    stationary = Deviation(1e-3, 5.0, 0.4).stationary
    np.testing.assert_allclose(f @ stationary @ f.T + q, stationary, rtol=1e-12)
    assert np.linalg.eigvalsh(q).min() > 0.0
    eigenvalues = np.log(np.linalg.eigvals(f).astype(complex)) / 0.004
    assert np.abs(eigenvalues) == pytest.approx(2.0 * math.pi * 5.0)
    assert -eigenvalues.real / np.abs(eigenvalues) == pytest.approx(0.4)


# ---- the drawing, and what it says of itself -----------------------------------------------------

WAGON = VehicleSheet(
    (
        SheetBody("front", 3.0),
        SheetBody("rear", -3.0),
        SheetBody("body", 0.0, (Support("front", 3.0), Support("rear", -3.0))),
        SheetBody("load", 0.5, (Support("body", 0.5),)),
    )
)


@pytest.mark.parametrize(
    ("body", "x_m", "axles"),
    [
        ("front", 0.0, Axles(0.0, -6.0)),
        ("rear", 0.0, Axles(0.0, 6.0)),
        ("body", 3.1, Axles(-0.1, -6.1)),
        ("body", -3.0, Axles(0.0, 6.0)),
        ("load", 0.0, None),
        ("nothing", 0.0, None),
    ],
)
def test_the_drawing_says_where_the_other_axle_is(
    body: str, x_m: float, axles: Axles | None, wavy: Callable
) -> None:
    recording = replace(wavy(FORWARD), vehicle_sheet=WAGON, mount_body=body, mount_position_m=(x_m, 0.0, 0.6))
    found = axles_under(recording)
    assert found == (None if axles is None else pytest.approx(axles))


def test_the_drawing_is_used(wavy: Callable) -> None:
    sheet = VehicleSheet(
        (
            SheetBody("front", L / 2),
            SheetBody("rear", -L / 2),
            SheetBody("body", 0.0, (Support("front", L / 2), Support("rear", -L / 2))),
        )
    )
    recording = replace(wavy(FORWARD), vehicle_sheet=sheet, mount_body="front")
    pd.testing.assert_frame_equal(
        ProfileFilter().estimate(recording).geometry,
        ProfileFilter(other_axle_m=-L).estimate(recording).geometry,
    )


def test_what_it_says_it_is() -> None:
    told = description_of(ProfileFilter())
    assert (told.role, told.needs, ProfileFilter().causal) == ("method", ("odometry",), True)
    for options in ({"gyro": False}, {"printed": True}, {"oldest": False}, {"independent_zeros": True}):
        assert description_of(ProfileFilter(**options)).role == "ablation"


# ---- wrong use -----------------------------------------------------------------------------------


def refused(method: ProfileFilter, recording: Recording, words: str) -> None:
    with pytest.raises(InputError, match=words):
        method.estimate(recording)


def test_wrong_use_is_told(wavy: Callable) -> None:
    recording = wavy(FORWARD)
    method = ProfileFilter(other_axle_m=-L)
    flat = recording.imu.assign(accel_z_mps2=9.81)
    refused(method, replace(recording, imu=flat), r"accel_z_mps2.*never changes|never changes.*accel_z")
    still_gyro = replace(recording, imu=recording.imu.assign(gyro_y_radps=0.0))
    refused(method, still_gyro, "gyro_y_radps")
    replace(method, gyro=False).estimate(still_gyro)
    refused(ProfileFilter(other_axle_m=-365.0), recording, "shorter than the wheelbase")
    refused(replace(method, slowest_mps=6.0), recording, "never faster")
    refused(replace(method, step_m=1.0), recording, "nodes do not fit")
    refused(replace(method, step_m=0.001), recording, "nodes do not fit")
    refused(method, replace(recording, odometry=None), "no odometry")
    refused(ProfileFilter(), recording, "where the other axle is")
    ProfileFilter(gyro=False).estimate(recording)
    middle = replace(recording, vehicle_sheet=WAGON, mount_body="body")
    refused(ProfileFilter(), middle, "stands over no axle")
    ProfileFilter(gyro=False).estimate(middle)


def test_a_train_that_stands_says_nothing_of_the_rails(wavy: Callable) -> None:
    estimate = ProfileFilter(other_axle_m=-L).estimate(standing(wavy(FORWARD)))
    assert len(estimate.geometry) <= 1


@pytest.mark.parametrize(
    "options",
    [
        {"deviation_rad": -1.0},
        {"step_m": -0.1},
        {"profile_sd_m": 0.0},
        {"profile_length_m": 0.0},
        {"slowest_mps": 0.0},
        {"other_axle_m": math.nan},
    ],
)
def test_options_are_judged(options: dict) -> None:
    with pytest.raises(InputError):
        ProfileFilter(**options)


def test_passed_again_is_the_same(wavy: Callable) -> None:
    assert math.sqrt(SAME) < 0.01 * AMPLITUDE_M


def test_found_has_room_for_all(wavy: Callable) -> None:
    model = made(5, there_and_back())
    found: Found = room(model)
    low = (found.first_node) * model.step_m
    assert low <= model.place.min() - model.wheelbase_m
    assert low + len(found.oldest) * model.step_m >= model.place.max()


def test_rails_of_a_train_that_runs_towards_smaller_s_have_their_own_sds() -> None:
    """Nodes lie along the way of the train; the geometry along the track."""
    nodes = np.column_stack([[1e-3, 2e-3, np.nan, 4e-3], np.square([1e-4, 2e-4, 3e-4, 4e-4])])
    found = SimpleNamespace(first_node=-40, oldest=nodes, front=nodes)
    model = SimpleNamespace(side=-1.0, step_m=0.5, place=np.array([-20.0, -18.0]))
    geometry = ProfileFilter()._geometry(model, found)  # type: ignore[arg-type]
    assert geometry.index.tolist() == [18.5, 19.5, 20.0]
    assert geometry["vertical_profile_m"].tolist() == [4e-3, 2e-3, 1e-3]
    assert geometry["vertical_profile_sd_m"].tolist() == pytest.approx([4e-4, 2e-4, 1e-4])
