"""Time and memory of the track-relative smoother, beside filterpy's filter of the same model in one run.

    pytest -n 0 tests/benchmarks/test_track_relative.py --benchmark-only

Times are per sample of an IMU at 250 Hz, which the smoother takes eight at a time; the kernels get arrays
that are ready, filterpy its matrices. The limits are for one idle core of a machine of 2024.
"""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numba
import numpy as np
import twins.track_relative as twin
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.aiding import WheelWay
from simrail.estimators.track_relative.kernel import (
    OUTPUTS,
    SEGMENT,
    Model,
    room_for_segment,
    room_to_work,
    run_back,
    run_filter,
)
from simrail.estimators.track_relative.model import course_of, linearised, steps_of
from simrail.estimators.track_relative.noise import AXLE
from simrail.estimators.track_relative.smoother import TrackRelativeSmoother

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording, beginning
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.measure import measure
from simrail.track.file import track_by_name
from simrail.track.map_errors import MapErrors
from simrail.vehicle.speed_profile import SpeedProfile

BLOCK = 8
"""Samples in a step."""

FEW = 150
"""Steps for filterpy."""

LONG_S = 90.0 * 60.0
"""A ride of which the smoother is to keep less than `MOST_BYTES`."""

MOST_BYTES = 1.5e9


@lru_cache
def ride() -> Recording:
    """Some 100 s over the line at 70 km/h. Of its IMU nothing is exact: filterpy inverts covariances."""
    recording = measure(
        kinematic_truth(track_by_name("condequinto_olivar"), SpeedProfile(10.0, 1500.0, 70.0 / 3.6)),
        name="benchmark",
        mount=Mount("axle", "body", (0.0, 0.0, 0.6)),
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec("wheel"),
        map_errors=MapErrors(),
        seed=1,
        draw=0,
    )
    sheet = replace(
        recording.imu_sheet, gyro_scale_error=5e-3, accel_scale_error=5e-3, package_misalignment_rad=4e-3
    )
    return replace(recording, imu_sheet=sheet)


@lru_cache
def problem() -> tuple[Model, FloatArray, FloatArray]:
    """Model of the whole ride, start and its covariance."""
    steps = steps_of(ride(), TrackRelativeSmoother().rate_hz)
    course = course_of(ride(), steps, replace(AXLE, torsion_sd=0.15, tilt_rate_sd=0.05), (WheelWay(),), ())
    model = linearised(course, slice(0, len(steps.time_s)))
    return model, course.start, course.start_covariance


def run(*, smoothed: bool) -> Callable[[], None]:
    """The filter with states and covariances of its outputs; or filter and smoother with those."""
    model, start, covariance = problem()
    n, work = len(model.measured), room_to_work()
    count = -(-n // SEGMENT) if smoothed else 0
    starts, squares = np.empty((count, at.STATES)), np.empty((count, at.STATES, at.WIDTH))
    states, said = np.empty((n, at.STATES)), np.empty((n, OUTPUTS, OUTPUTS))
    surprises, none, none3 = (
        np.empty((n, model.measured.shape[1])),
        np.empty((0, at.STATES)),
        np.empty((0, OUTPUTS, OUTPUTS)),
    )
    segment, lines = room_for_segment(SEGMENT, model.measured.shape[1]), np.zeros((2, OUTPUTS, at.WIDTH))

    def once() -> None:
        x, p = start.copy(), covariance.copy()
        kept = (none, none3) if smoothed else (states, said)
        run_filter(model, starts, squares, *kept, surprises, work, x, p)
        if smoothed:
            lam, info = np.zeros(at.STATES), np.zeros((at.STATES, at.WIDTH))
            run_back(model, starts, squares, states, said, segment, work, x, p, lam, info, lines[0], lines[1])

    return once


@lru_cache
def filterpy_us(smoothed: bool) -> float:
    """Microseconds per IMU sample of filterpy's filter, or filter and smoother, with all matrices ready."""
    model, start, covariance = problem()
    first = len(model.measured) // 2
    cut = {
        name: getattr(model, name)[first : first + FEW]
        for name in ("coefficients", "measured", "variances", "flows", "said")
    }
    few = model._replace(**cut)
    steps, best = twin.steps_of(few), np.inf
    for _ in range(3):
        begin = time.perf_counter()
        found = twin.filterpy_filter(few, steps, start, covariance)
        if smoothed:
            twin.filterpy_smoother(steps, found)
        best = min(best, time.perf_counter() - begin)
    return 1e6 * best / (BLOCK * FEW)


def report(benchmark: Callable, function: Callable[[], object], *, smoothed: bool) -> float:
    """Run it, and keep microseconds per IMU sample and how often as long filterpy takes."""
    theirs = filterpy_us(smoothed)
    function()
    benchmark.pedantic(function, rounds=5, iterations=1, warmup_rounds=1)
    us = 1e6 * benchmark.stats.stats.min / len(ride().imu)
    benchmark.extra_info["us_per_sample"] = us
    benchmark.extra_info["ratio_to_filterpy"] = theirs / us
    return us


def test_filter(benchmark: Callable) -> None:
    us = report(benchmark, run(smoothed=False), smoothed=False)
    assert us <= 2.0
    assert benchmark.extra_info["ratio_to_filterpy"] >= 10.0


def test_smoother_with_covariances(benchmark: Callable) -> None:
    us = report(benchmark, run(smoothed=True), smoothed=True)
    assert us <= 6.0
    assert benchmark.extra_info["ratio_to_filterpy"] >= 4.5


def test_whole_filter(benchmark: Callable) -> None:
    report(benchmark, lambda: TrackRelativeSmoother(smoothed=False).estimate(ride()), smoothed=False)


def test_whole_smoother(benchmark: Callable) -> None:
    """Two passes, and the rails."""
    report(benchmark, lambda: TrackRelativeSmoother().estimate(ride()), smoothed=True)


def test_memory_of_a_long_ride() -> None:
    """What a sample adds to the peak, times the samples of 90 minutes: below 1.5 GB."""
    peaks, counts = [], (12000, 24000)
    TrackRelativeSmoother().estimate(beginning(ride(), samples=6000))  # what is made once is made
    for count in counts:
        part = beginning(ride(), samples=count)
        tracemalloc.start()
        TrackRelativeSmoother().estimate(part)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    a_sample = (peaks[1] - peaks[0]) / (counts[1] - counts[0])
    assert peaks[0] + a_sample * LONG_S * 250.0 < MOST_BYTES


@numba.njit(error_model="numpy")
def _less_square(p: FloatArray, gain: FloatArray, v: FloatArray, times: int) -> None:
    """P (n, w) <- P - K v', so many times; in lanes the n columns of each lie side by side, K is (n, w) and w
    is n times the lanes."""
    for _ in range(times):
        for i in range(p.shape[0]):
            row, k = p[i], gain[i]
            for c in range(p.shape[1]):
                row[c] -= k[c] * v[c]


def test_covariances_as_lanes(benchmark: Callable) -> None:
    """The update of one covariance after the other beside that of eight of them in one loop.

    A covariance of 52 states takes 22 kB and stays in the first cache; eight of them do not, and each takes
    longer. So the draws of a ride are no lanes here: this is most of what the filter does.
    """
    lanes, times, rng = 8, 500, np.random.default_rng(1)
    arrays = []
    for count in (1, lanes):
        width = at.STATES * count
        arrays.append(
            (
                np.zeros((at.STATES, width)),
                1e-6 * rng.normal(size=(at.STATES, width)),
                1e-3 * rng.normal(size=width),
                times,
            )
        )
    seconds = []
    for one in arrays:
        _less_square(*one)
        seconds.append(min(_seconds(lambda one=one: _less_square(*one)) for _ in range(15)))
    benchmark.extra_info["ratio_to_alone"] = lanes * seconds[0] / seconds[1]
    benchmark.pedantic(lambda: _less_square(*arrays[1]), rounds=5, iterations=1)


def _seconds(function: Callable[[], object]) -> float:
    begin = time.perf_counter()
    function()
    return time.perf_counter() - begin
