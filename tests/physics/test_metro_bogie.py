"""The bogie's ride obeys mechanics: loads, rest, steady running, and truths that integrate to themselves.

Long rides are driven by the compiled engine; that Exudyn makes the same motion is what
`test_engines_agree` shows.
"""

import numpy as np
import pytest
from dead_reckoning import dead_reckon
from wheel_loads import wheel_loads_n

from simrail.core.columns import ACCEL, ATTITUDE, POSITION
from simrail.core.toml_files import load
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.ride import Ride, simulate
from simrail.ride.truth import Mount
from simrail.sensors.imu import sample_imu
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.engines.derailment import DerailedError
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.engines.exudyn_engine import ExudynEngine
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

pytestmark = pytest.mark.long

SMOOTH = Irregularity("none", (1.5, 100.0), 0.0)
ROUGH = Irregularity("erri_b176_low", (1.5, 100.0), 20.0)
MOUNTS = [
    Mount("axle", "front", (0.0, 0.0, 0.6)),
    Mount("frame", "frame", (0.4, -0.3, 0.5)),
    Mount("body", "body", (1.5, 0.6, 1.2)),
]


def vehicle():
    return load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie")


def track(name):
    return load(TrackFile, "track", name).design(name)


@pytest.fixture(scope="module")
def rough_ride():
    """75 s on the irregular line at 40 km/h: a transition, the sharp curve, the smooth one, a stop."""
    profile = SpeedProfile(330.0, 930.0, 40.0 / 3.6, rest_s=3.0, final_rest_s=5.0, acceleration_mps2=0.9)
    return simulate(
        Ride("closure", track("condequinto_olivar"), ROUGH, 5, vehicle(), profile, engine="compiled")
    )


@pytest.fixture(scope="module")
def smooth_curve_ride():
    profile = SpeedProfile(100.0, 400.0, 15.0, rest_s=1.0, final_rest_s=0.5, acceleration_mps2=1.5)
    return simulate(Ride("smooth curve", track("smooth_curve"), SMOOTH, 0, vehicle(), profile))


@pytest.mark.parametrize("mount", MOUNTS, ids=lambda mount: mount.name)
def test_truth_integrates_to_itself_over_60_s(rough_ride, mount):
    """0.001 deg and 20 mm after 60 s of dead reckoning."""
    motion = rough_ride.motion(mount).loc[2.0:62.0]
    reckoned = dead_reckon(motion, motion.iloc[0])
    error = reckoned - motion.loc[reckoned.index, reckoned.columns]
    assert np.rad2deg(error[list(ATTITUDE)].abs().to_numpy().max()) < 1e-3
    assert error[list(POSITION)].abs().to_numpy().max() < 20e-3


@pytest.mark.parametrize("mount", MOUNTS, ids=lambda mount: mount.name)
def test_truth_integrates_to_itself_restarted_every_second(rough_ride, mount):
    """0.05 mm after each second."""
    motion = rough_ride.motion(mount)
    for start in range(0, len(motion) - 1001, 1000):
        second = motion.iloc[start : start + 1001]
        reckoned = dead_reckon(second, second.iloc[0])
        error = reckoned - second.loc[reckoned.index, reckoned.columns]
        assert error[list(POSITION)].abs().to_numpy().max() < 0.05e-3


@pytest.mark.parametrize("mount", MOUNTS, ids=lambda mount: mount.name)
def test_sampled_ideal_imu_keeps_the_attitude_over_60_s(rough_ride, mount):
    """0.01 deg from the 250 Hz samples of an IMU without errors, filter and decimation included."""
    motion = rough_ride.motion(mount)
    samples, _ = sample_imu(motion, load_grade("ideal"), seed=0, draw=0, name=mount.name)
    samples = samples.loc[2.0:62.0]
    reckoned = dead_reckon(samples, motion.loc[samples.index[0]])
    error = reckoned[list(ATTITUDE)] - motion.loc[reckoned.index, list(ATTITUDE)]
    assert len(samples) == 15001
    assert np.rad2deg(error.abs().to_numpy().max()) < 0.01


def test_acceleration_is_the_second_difference_of_position(smooth_curve_ride):
    """On a smooth curve, to 1e-4 m/s2 rms, axle body."""
    axle = smooth_curve_ride.bodies["front"]
    position, h = np.asarray(axle.position), 1e-3
    # Fourth-order second difference: its own truncation must not hide an error.
    second = (
        -position[:-4] + 16 * position[1:-3] - 30 * position[2:-2] + 16 * position[3:-1] - position[4:]
    ) / (12 * h**2)
    rms = np.sqrt(np.mean((second - axle.acceleration[2:-2]) ** 2, axis=0))
    assert np.all(rms < 1e-4)


def test_static_wheel_loads_carry_the_weight():
    """To 0.1 % after settling, and each wheel its share."""
    model = vehicle()
    laid = lay(track("level_straight"), SMOOTH, seed=0)
    engine = ExudynEngine(Setup(model, laid, SpeedProfile(100.0, 101.0, 1.0)))
    for _ in engine.run(0.1):
        pass
    weight = sum(body.mass_kg for body in model.bodies) * 9.81
    vertical = wheel_loads_n(engine)
    assert np.sum(vertical) == pytest.approx(weight, rel=1e-3)
    np.testing.assert_allclose(vertical, model.wheel_load_n(9.81), rtol=1e-3)


def test_level_smooth_straight_is_silent():
    """After 10 s at constant speed the axle feels less than 1e-6 m/s2; at standstill less than 1e-4."""
    profile = SpeedProfile(20.0, 620.0, 15.0, rest_s=3.0, final_rest_s=1.0, acceleration_mps2=1.0)
    truth = simulate(
        Ride("silent", track("level_straight"), SMOOTH, 0, vehicle(), profile, engine="compiled")
    )
    motion = truth.motion(MOUNTS[0])
    felt = motion[list(ACCEL)].to_numpy() - [0.0, 0.0, 9.81]
    tilt = motion["pitch_rad"].to_numpy()
    felt[:, 0] += 9.81 * tilt  # what gravity alone gives on the pitched bridge
    commanded = profile.motion(truth.time_s)[2]
    moving = np.abs(profile.motion(truth.time_s)[1]) > 14.9
    started = truth.time_s[np.argmax(moving)]
    cruise = moving & (commanded == 0.0) & (truth.time_s > started + 10.0)
    assert np.count_nonzero(cruise) > 5000
    assert np.abs(felt[cruise]).max() < 1e-6
    resting = truth.time_s < 2.9
    assert np.abs(felt[resting]).max() < 1e-4


def test_halving_the_step_changes_little():
    """Acceleration of the axle changes by less than 1e-3 m/s2 rms, on the tread."""
    profile = SpeedProfile(640.0, 840.0, 50.0 / 3.6, rest_s=1.0, final_rest_s=1.0, acceleration_mps2=1.0)
    line = track("condequinto_olivar")
    coarse, fine = (
        simulate(Ride("step", line, ROUGH, 5, vehicle(), profile, engine="compiled", step_s=step))
        for step in (0.5e-3, 0.25e-3)
    )
    motion = coarse.motion(Mount("axle", "front", (0.0, 0.0, 0.29)))
    rails = lay(line, ROUGH, seed=5).irregularities(motion["position_m"].to_numpy())
    shift = motion["lateral_m"].to_numpy() - rails["alignment_m"].to_numpy()
    assert np.abs(shift).max() < 5.5e-3, "the ride was meant to keep off flange and flange root"
    difference = coarse.bodies["front"].acceleration - fine.bodies["front"].acceleration
    assert np.sqrt(np.mean(difference**2, axis=0)).max() < 1e-3


def test_derailment_is_said():
    """A curve far too fast for its cant throws the bogie out: one clear error, not a wrong ride."""
    profile = SpeedProfile(20.0, 560.0, 75.0, rest_s=0.5, acceleration_mps2=30.0, jerk_mps3=200.0)
    with pytest.raises(DerailedError, match=r"axle (front|rear) left the rail at s = "):
        simulate(Ride("derailed", track("smooth_curve"), SMOOTH, 0, vehicle(), profile, engine="compiled"))
