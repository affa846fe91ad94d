"""Tuning of a body's motion: the likelihood finds the sizes of its own world, and bad words are told.

The world is the filter's own with two sizes planted: states and measurements are drawn by the twin's
transitions about the course of a ride. The sds of what is found are those of Cramer and Rao.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import twins.track_relative as twin
from scipy.optimize import minimize
from simrail.estimators.track_relative.model import linearised
from simrail.estimators.track_relative.noise import AXLE, WAGON, motion_of
from simrail.estimators.track_relative.smoother import TrackRelativeSmoother
from simrail.estimators.track_relative.tuning import MotionLikelihood, MotionTuning, tuned
from simrail.estimators.tuning.cube import Cube
from simrail.estimators.tuning.identify import IDENTIFIED, identify

from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.estimation.tunable import TunedValues, tunables_of
from simrail.recording.recording import Recording, beginning
from simrail.recording.sheets.vehicle_sheet import SheetBody, VehicleSheet

RIDES, SAMPLES = 3, 4400
PLANTED = {"axle_yaw_sd": 2.0 * AXLE.yaw_sd, "axle_pitch_length": 1.6 * AXLE.pitch_length}
OURS = TrackRelativeSmoother(rate_hz=31.25)


def on_axle(recording: Recording) -> Recording:
    return replace(recording, vehicle_sheet=VehicleSheet((SheetBody(recording.mount_body),)))


@lru_cache(maxsize=1)
def world(rough: Callable) -> MotionLikelihood:
    """Rides over a straight and into the bend, drawn of the model with what is planted."""
    course = tuned(OURS, PLANTED).course(on_axle(beginning(rough(), samples=SAMPLES)))
    steps = course.steps
    model = linearised(course, slice(0, len(steps.time_s)))
    rng = stream(5, "track-relative tuning")
    _, measured = twin.draw(model, course.start, course.start_covariance, rng, draws=RIDES)
    # What is measured comes into the model by itself, less what does not depend on it.
    moved = measured - model.measured
    rides = [steps._replace(signals=steps.signals + off[:, :6], way=steps.way + off[:, 6]) for off in moved]
    return MotionLikelihood(OURS, tuple((course.recording, ride) for ride in rides))


def tuning() -> MotionTuning:
    return MotionTuning(OURS, tuple(PLANTED))


def off_by_sds(goal: MotionLikelihood) -> tuple[np.ndarray, float]:
    """How far what is found lies from what is planted, in sds, and the largest sd of a logarithm."""
    cube = Cube(tuning().parameters())
    found = minimize(lambda point: goal.value(cube.named(point)), cube.start(), method="L-BFGS-B")
    values = cube.named(found.x)
    known = identify(goal, values, cube)
    assert list(known["status"]) == [IDENTIFIED] * len(PLANTED)
    sd = np.log(10.0) * known["sd_decades"].to_numpy()
    off = np.array([np.log(values[name] / planted) for name, planted in PLANTED.items()])
    return off / sd, float(sd.max())


@pytest.mark.long
def test_the_likelihood_finds_what_is_planted(rough: Callable) -> None:
    """Each within 99.9 % of its Cramer-Rao sd, all from the class's own sizes, which are far off."""
    off, sd = off_by_sds(world(rough))
    assert (np.abs(off) < 3.3).all()
    assert np.log(1.6) > 4.0 * sd  # else the class's own would pass too


def test_the_likelihood_is_that_of_all_rides_together(rough: Callable) -> None:
    """Of each the filter's own, per step."""
    recordings = [on_axle(beginning(rough(draw), samples=n)) for draw, n in ((0, 3000), (1, 2400))]
    causal = TrackRelativeSmoother(smoothed=False, tuning=TunedValues(PLANTED))
    alone = [causal.trace(recording).log_likelihood for recording in recordings]
    goal = MotionTuning(TrackRelativeSmoother(), tuple(PLANTED)).likelihood(recordings)
    assert goal.samples == 3000 // 8 + 2400 // 8
    assert goal.value(PLANTED) == pytest.approx(-sum(alone) / goal.samples, rel=1e-12)
    assert goal.value({}) != pytest.approx(goal.value(PLANTED), rel=1e-6)


def test_what_is_tuned_is_taken_on_mounts_of_its_class_alone(rough: Callable) -> None:
    smoother = TrackRelativeSmoother(smoothed=False, tuning=TunedValues(PLANTED))
    axle, body = (beginning(on(rough()), samples=2400) for on in (on_axle, lambda recording: recording))
    yaw, length = PLANTED.values()
    motion = replace(AXLE, yaw_sd=yaw, pitch_length=length)
    ours, same = smoother.trace(axle), TrackRelativeSmoother(smoothed=False, motion=motion).trace(axle)
    np.testing.assert_array_equal(ours.states, same.states)
    assert motion_of(body, smoother.motions()) is WAGON
    # On a model track of a tenth, lengths are a tenth, and angles as they are.
    track = replace(axle.track, rail_base_m=0.15)
    small = motion_of(replace(axle, track=track), smoother.motions())
    assert small.yaw_sd == yaw and small.pitch_length == pytest.approx(0.1 * length, rel=0.05)


def test_the_search_keeps_to_its_box_and_begins_at_what_is() -> None:
    smoother = TrackRelativeSmoother(tuning=TunedValues({"body_roll_sd": 4e-3}))
    settings = {"parameters": ("body_roll_sd", "body_damping", "body_roll_sd"), "box": (0.5, 4.0)}
    (searched,) = tunables_of(smoother, settings, method="cml").values()
    roll, damping = searched.parameters()
    assert (roll.name, roll.lower, roll.start, roll.upper) == ("body_roll_sd", 2e-3, 4e-3, 1.6e-2)
    assert damping.upper < 1.0 and damping.scale == roll.scale == "log"


# --- Wrong use --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "parts"),
    [
        ({"axle_yaw_sd": -1.0}, ["tuning.axle_yaw_sd: ", "-1.0", ">= 0"]),
        ({"axle_yaw_length": 0.0}, ["tuning.axle_yaw_length: ", "0.0", "> 0"]),
        ({"body_damping": 1.0}, ["tuning.body_damping: ", "1.0", "< 1"]),
        ({"axle_yaw_sd": float("nan")}, ["tuning.axle_yaw_sd: ", "nan"]),
        (
            {"axel_yaw_sd": 1.0},
            ["tuning.axel_yaw_sd: ", "axle_, frame_, body_, wagon_, jointed_", "did you mean axle_yaw_sd?"],
        ),
        ({"yaw_sd": 1.0}, ["tuning.yaw_sd: ", "yaw_length"]),
        ({"roll_rad2ps3": 1.0}, ["tuning.roll_rad2ps3: ", "remedy: "]),
    ],
    ids=str,
)
def test_a_bad_value_is_told_in_one_line(values: dict[str, float], parts: list[str], tmp_path: Path) -> None:
    path = tmp_path / "tuned.toml"
    path.write_text("[hyperparameters]\n" + "".join(f"{name} = {value}\n" for name, value in values.items()))
    with pytest.raises(InputError) as caught:
        TrackRelativeSmoother(tuning=TunedValues.from_file(path))
    assert "\n" not in str(caught.value)
    for part in parts:
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "parts"),
    [
        ({}, ["parameters: nothing is to be searched", "axle_roll_sd, "]),
        ({"parameters": ("axle_sway_hz",)}, ["parameters", "axle_sway_hz", "body_sway_hz"]),
        ({"parameters": ("yaw_sd",)}, ["parameters", "'yaw_sd'"]),
        ({"parameters": ("axle_yaw_sd",), "box": (2.0, 4.0)}, ["box: is no box", "[2.0, 4.0]", "least < 1"]),
        ({"parameters": ("axle_yaw_sd",), "by_kind": True}, ["by_kind: ", "no such setting", "leave it out"]),
    ],
    ids=str,
)
def test_a_search_of_nothing_is_told(settings: dict[str, Any], parts: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        tunables_of(TrackRelativeSmoother(), settings, method="cml")
    for part in parts:
        assert part in str(caught.value)


def test_rides_from_other_mounts_and_two_motions_are_told(rough: Callable) -> None:
    with pytest.raises(InputError, match=r"none of the rides.*'axle_yaw_sd'.*sizes of wagon"):
        MotionTuning(OURS, ("axle_yaw_sd",)).likelihood([beginning(rough(), samples=800)])
    with pytest.raises(InputError, match="tuning: a file and a motion"):
        TrackRelativeSmoother(motion=AXLE, tuning=TunedValues())
    with pytest.raises(InputError, match=r"--method.*'kom'; limit: cml"):
        tunables_of(TrackRelativeSmoother(), {"parameters": ("axle_yaw_sd",)}, method="kom")
