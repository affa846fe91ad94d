"""What the track-relative smoother takes beside its IMU: a wheel, an odometer, fixes, or nothing at all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.aiding import (
    ODOMETRY_S,
    Fixes,
    MagneticHeading,
    Odometer,
    OdometryPlace,
    Received,
    Standstill,
    WheelWay,
    aiding_of,
)
from simrail.estimators.track_relative.measurement import duals
from simrail.estimators.track_relative.model import Steps, steps_of
from simrail.estimators.track_relative.smoother import TrackRelativeSmoother

from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.recording.recording import MagnetometerSheet, OdometerSheet, Recording, beginning
from simrail.sensors.gnss import GnssSpec, Outage, sample_gnss
from simrail.sensors.magnetometer import MagnetometerSpec, sample_magnetometer

NOWHERE: Any = None
"""The body in its track, of which these say nothing."""


def alone(recording: Recording) -> Recording:
    return replace(recording, encoder=None, encoder_sheet=None)


def with_odometer(recording: Recording, motion: pd.DataFrame, *, scale: float) -> Recording:
    """An odometer of 10 Hz whose readings are too large by a scale, with noise of 0.05 m/s."""
    time = np.arange(0.5, recording.imu.index[-1], 0.1)
    speed = np.interp(time, motion.index, motion["speed_mps"]) * (1.0 + scale)
    speed = speed + 0.05 * stream(7, "odometer").standard_normal(len(time))
    frame = pd.DataFrame({"speed_mps": speed}, index=pd.Index(time, name="time_s"))
    return replace(alone(recording), odometer=frame, odometer_sheet=OdometerSheet(0.05, 0.01))


def place_error(recording: Recording, motion: pd.DataFrame, **options: Any) -> tuple[pd.Series, pd.Series]:
    found = TrackRelativeSmoother(geometry_step_m=0.0, **options).estimate(recording).states
    return found["position_m"] - motion["position_m"].loc[found.index], found["position_sd_m"]


def fixes(motion: pd.DataFrame, *, sd_m: float, wrong_by_m: float = 0.0, every_s: float = 1.0) -> Fixes:
    time = np.arange(1.0, motion.index[-1] - 1.0, every_s) + 0.0137
    place = np.interp(time, motion.index, motion["position_m"])
    return Fixes(time, place + wrong_by_m + sd_m * stream(5, "fixes").standard_normal(len(time)), sd_m)


def test_a_recording_says_what_it_has(rough: Callable, rough_motion: Callable) -> None:
    recording = rough()
    assert aiding_of(recording, smoothed=True) == (WheelWay(),)
    assert aiding_of(alone(recording), smoothed=True) == (Standstill(),)
    assert aiding_of(alone(recording), smoothed=False) == (Standstill(), OdometryPlace())
    seen = with_odometer(recording, rough_motion(), scale=0.0)
    assert aiding_of(seen, smoothed=True) == (Standstill(), Odometer())


def test_every_class_shows_what_it_measures(rough: Callable) -> None:
    """One h for each column of z and R; at states drawn at random h is that of its docstring."""
    recording: Recording = rough()
    steps = steps_of(recording, 125.0)
    states = stream(3, "states").standard_normal((4, at.STATES))
    x = duals(states)
    wanted = {
        WheelWay(): states[:, at.WAY],
        Standstill(): states[:, at.V],
        OdometryPlace(): states[:, at.S],
        Odometer(): states[:, at.V] * (1.0 + states[:, at.SCALE]),
        Fixes(np.array([1.0]), np.array([5.0]), 1.0): states[:, at.S],
    }
    sheet = OdometerSheet(0.05, 0.01)
    frame = pd.DataFrame({"speed_mps": [1.0]}, index=pd.Index([2.0], name="time_s"))
    full = replace(recording, odometer=frame, odometer_sheet=sheet)
    for kind, values in wanted.items():
        (shown,) = kind.shown(x, NOWHERE)
        np.testing.assert_allclose(shown.value, values)
        rows = kind.rows(full, steps)
        assert rows.values.shape == rows.variances.shape == (len(steps.time_s), 1)
        assert (rows.variances > 0.0).all() and np.isfinite(rows.values).all()


def test_a_fix_is_of_the_first_step_that_ends_after_it(rough: Callable) -> None:
    """Brought forward by what was run since, so that a causal filter has nothing from later."""
    steps: Steps = steps_of(rough(), 25.0)
    time = np.array([8.013, 9.2, 1e6])
    rows = Fixes(time, np.array([100.0, 120.0, 0.0]), 2.0).rows(rough(), steps)
    (made,) = np.nonzero(np.isfinite(rows.variances[:, 0]))
    assert len(made) == 2
    for number, at_s, place in zip(made, time, (100.0, 120.0), strict=False):
        assert steps.end_s[number - 1] < at_s - 1e-9 <= steps.end_s[number]
        run = steps.odometry[number, 1] * (steps.time_s[number] - at_s)
        assert rows.values[number, 0] == pytest.approx(place + run)
        assert rows.variances[number, 0] == pytest.approx(4.0)


def test_a_planted_fix_moves_the_place_as_far_as_it_is_believed(
    rough: Callable, rough_motion: Callable
) -> None:
    """Fixes 3 m off with an sd of 1 cm win; with one of 100 m they are not heard."""
    recording, motion = rough(), rough_motion()
    for sd_m, wanted in ((0.01, 3.0), (100.0, 0.0)):
        error, _ = place_error(recording, motion, aiding=(fixes(motion, sd_m=sd_m, wrong_by_m=3.0),))
        middle = error[(error.index > 12.0) & (error.index < 40.0)]
        assert middle.median() == pytest.approx(wanted, abs=0.6)


def test_fixes_help_a_train_that_has_no_wheel(rough: Callable, rough_motion: Callable) -> None:
    """40 fixes of an sd of 0.3 m, against the place that the map's joints of 0.3 m give."""
    recording, motion = alone(rough()), rough_motion()
    without, sd_without = place_error(recording, motion)
    aided, sd = place_error(recording, motion, aiding=(fixes(motion, sd_m=0.3),))
    assert (sd <= sd_without + 1e-9).all()
    assert np.sqrt((aided**2).mean()) < 0.15
    assert np.sqrt((aided**2).mean()) < np.sqrt((without**2).mean())


@pytest.mark.parametrize("direction", [1, -1])
def test_an_imu_alone_knows_its_place_on_a_map(
    rough: Callable, rough_motion: Callable, direction: int
) -> None:
    """One curve, known to 0.3 m at each of its joints: the place is, and so it says."""
    error, sd = place_error(alone(rough(0, direction)), rough_motion(0, direction))
    assert np.sqrt((error**2).mean()) < 1.0
    assert (error.abs() < 1.96 * sd).mean() > 0.85
    assert sd.max() < 5.0


def with_receiver(recording: Recording, motion: pd.DataFrame, **options: Any) -> Recording:
    spec = GnssSpec(**options)
    return replace(recording, gnss=sample_gnss(motion, spec, seed=4, draw=0), gnss_sheet=spec.sheet)


def test_a_receiver_is_of_the_step_after_it_came(rough: Callable, rough_motion: Callable) -> None:
    """Place and speed brought forward by the latency, the antenna brought to the IMU; none in the tunnel."""
    recording, motion = rough(), rough_motion()
    tunnel = Outage(200.0, 300.0)
    options = {"rate_hz": 5.0, "position_sd_m": 0.0, "position_noise_m": 1e-6, "speed_sd_mps": 1e-6}
    seen = with_receiver(recording, motion, latency_s=0.24, ahead_m=9.0, outages=(tunnel,), **options)
    steps, kind = steps_of(recording, 25.0), Received()
    rows = kind.rows(seen, steps)
    for column, name, close in ((0, "position_m", 0.05), (1, "speed_mps", 0.05)):
        (made,) = np.nonzero(np.isfinite(rows.variances[:, column]))
        true = np.interp(steps.time_s[made], motion.index, motion[name])
        np.testing.assert_allclose(rows.values[made, column], true, atol=close)
        assert len(made) > 100
        place = np.interp(steps.time_s[made], motion.index, motion["position_m"])
        assert not ((place + 9.0 > 206.0) & (place + 9.0 < 300.0)).any()
    assert seen.gnss is not None
    came = seen.gnss.index.to_numpy()[10]
    first = int(np.searchsorted(steps.end_s, came - 1e-9))
    assert np.isfinite(rows.variances[first, 0]) and np.isinf(rows.variances[first - 1, 0])
    states = stream(3, "states").standard_normal((4, at.STATES))
    place, speed = kind.shown(duals(states), NOWHERE)
    np.testing.assert_allclose(place.value, states[:, at.S])
    np.testing.assert_allclose(speed.value, states[:, at.V])


def test_a_receiver_helps_when_it_is_asked_for(rough: Callable, rough_motion: Callable) -> None:
    """Not otherwise: the same bits with it and without; and by the causal filter nothing later is used."""
    recording, motion = alone(rough()), rough_motion()
    seen = with_receiver(recording, motion, position_sd_m=0.2, position_noise_m=0.1)
    plain, _ = place_error(recording, motion)
    unheard, _ = place_error(seen, motion)
    pd.testing.assert_series_equal(plain, unheard, check_exact=True)
    aided, sd = place_error(seen, motion, gnss=True)
    assert np.sqrt((aided**2).mean()) < np.sqrt((plain**2).mean())
    assert (aided.abs() < 1.96 * sd).mean() > 0.85
    causal = TrackRelativeSmoother(smoothed=False, gnss=True, geometry_step_m=0.0)
    assert causal.needs == ("gnss",) and TrackRelativeSmoother().needs == ()
    whole = causal.estimate(seen).states
    part = causal.estimate(beginning(seen, samples=5003)).states
    pd.testing.assert_frame_equal(whole.iloc[:5003], part, check_exact=True)
    with pytest.raises(InputError, match="no satellite receiver"):
        causal.estimate(recording)


def with_magnetometer(recording: Recording, motion: pd.DataFrame, *, turning_rad: float = 0.0) -> Recording:
    """A field that iron turns by 0.3 rad all along, and by more from half of the ride on; no noise."""
    spec = MagnetometerSpec(noise_tpsqrthz=0.0, bias_t=0.0)
    turned, half = motion.copy(), 0.5 * motion.index[-1]
    turned["yaw_rad"] += 0.3 + turning_rad * (motion.index > half)
    field = sample_magnetometer(turned, recording.imu.index, spec, seed=4, draw=0, name="planted")
    earth = spec.field
    sheet = MagnetometerSheet(1e-8, earth.intensity_t, earth.inclination_rad, earth.north_rad)
    return replace(recording, magnetometer=field, magnetometer_sheet=sheet)


def test_a_magnetic_heading_is_of_how_far_it_left_the_map(rough: Callable, rough_motion: Callable) -> None:
    """What iron turns all along is gone, what is planted later is in the rows; none at the start."""
    recording, motion = rough(), rough_motion()
    steps, kind = steps_of(recording, 25.0), MagneticHeading()
    plain = kind.rows(with_magnetometer(recording, motion), steps)
    (made,) = np.nonzero(np.isfinite(plain.variances[:, 0]))
    assert steps.resting[: made[0]].all() and made[0] > 50
    track = recording.track
    true = (
        np.interp(steps.time_s, motion.index, motion["yaw_rad"]) - track.frame(steps.odometry[:, 0]).yaw_rad
    )
    true -= true[: made[0]].mean()
    # The body rolls by up to 5 mrad in the map's track, of which the dip makes up to twice as much.
    np.testing.assert_allclose(plain.values[made, 0], true[made], atol=1e-2)
    planted = kind.rows(with_magnetometer(recording, motion, turning_rad=0.1), steps)
    late = steps.time_s > 0.5 * motion.index[-1] + 1.0
    np.testing.assert_allclose((planted.values - plain.values)[late], 0.1, atol=1e-3)
    states = stream(3, "states").standard_normal((4, at.STATES))
    (heading,) = kind.shown(duals(states), NOWHERE)
    np.testing.assert_allclose(heading.value, states[:, at.HEADING] + states[:, at.YAW])


def test_a_magnetometer_is_heard_when_it_is_asked_for(rough: Callable, rough_motion: Callable) -> None:
    """Not otherwise, to the bit; a field that turns turns the heading; a filter looks at nothing later."""
    recording, motion = rough(), rough_motion()
    seen = with_magnetometer(recording, motion, turning_rad=0.5)
    plain, _ = place_error(recording, motion)
    unheard, _ = place_error(seen, motion)
    pd.testing.assert_series_equal(plain, unheard, check_exact=True)
    causal = TrackRelativeSmoother(smoothed=False, magnetometer=True, geometry_step_m=0.0)
    assert causal.needs == ("magnetometer",)
    whole = causal.estimate(seen).states
    part = causal.estimate(beginning(seen, samples=5003)).states
    pd.testing.assert_frame_equal(whole.iloc[:5003], part, check_exact=True)
    still = causal.estimate(with_magnetometer(recording, motion)).states
    assert whole["yaw_rad"].iloc[-1] - still["yaw_rad"].iloc[-1] > 2e-5
    with pytest.raises(InputError, match="no magnetometer"):
        causal.estimate(recording)


def test_an_odometer_measures_the_speed(rough: Callable, rough_motion: Callable) -> None:
    """Its scale of 1 % is found; a reading of another vehicle shows in the innovations."""
    recording, motion = rough(), rough_motion()
    seen = with_odometer(recording, motion, scale=0.008)
    trace = TrackRelativeSmoother().trace(seen)
    assert trace.states[-1, at.SCALE] == pytest.approx(0.008, abs=0.004)
    assert trace.surprises.shape[1] == 8
    wrong = with_odometer(recording, motion, scale=0.3)
    good, bad = (np.nanmean(TrackRelativeSmoother().trace(r).surprises[:, 7] ** 2) for r in (seen, wrong))
    assert good < 1.3 < 1.9 < bad  # 630 readings: 0.06 is a standard deviation


@pytest.mark.parametrize(
    ("field", "values"),
    [
        ("sd_m", {"sd_m": 0.0}),
        ("sd_m", {"sd_m": np.array([1.0, np.nan])}),
        ("position_m", {"position_m": np.array([1.0])}),
        ("position_m", {"position_m": np.array([1.0, np.inf])}),
        ("time_s", {"time_s": np.array([2.0, 1.0])}),
    ],
)
def test_bad_fixes_are_named(field: str, values: dict[str, Any]) -> None:
    good = {"time_s": np.array([1.0, 2.0]), "position_m": np.array([5.0, 9.0]), "sd_m": 1.0}
    with pytest.raises(InputError) as caught:
        Fixes(**(good | values))
    assert caught.value.field == field


def test_a_way_is_as_sure_as_a_count_and_a_place_as_its_odometry() -> None:
    """A count of 6 cm: 36 cm2 / 12. A place of 2 m, new every `ODOMETRY_S`, at each of its 4 ms: by hand."""
    steps = SimpleNamespace(
        way=np.array([0.0, 1.0, 2.0]),
        slipping=np.array([False, True, False]),
        resting=np.array([True, False, False]),
        odometry=np.array([[10.0, 5.0, 0.0, 2.0], [11.0, 5.0, 0.0, 2.0], [12.0, 5.0, 0.0, 1.0]]),
        dt=0.004,
    )
    recording = SimpleNamespace(encoder_sheet=SimpleNamespace(pulse_m=0.06))
    wheel = WheelWay().rows(recording, steps)  # type: ignore[arg-type]
    np.testing.assert_array_equal(wheel.values[:, 0], steps.way)
    np.testing.assert_allclose(wheel.variances[:, 0], [3e-4, np.inf, 3e-4])
    place = OdometryPlace().rows(recording, steps)  # type: ignore[arg-type]
    np.testing.assert_array_equal(place.values[:, 0], [10.0, 11.0, 12.0])
    np.testing.assert_allclose(place.variances[:, 0], np.array([np.inf, 4.0, 1.0]) * ODOMETRY_S / 0.004)
