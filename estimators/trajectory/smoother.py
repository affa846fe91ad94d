"""Trajectory and attitude of a body on the track by a smoother over twelve states.

Gonzalez-Carbajal et al. 2023 (paper 001): gyro, accelerometer, odometry and the design track give the angles
of the body and its place (y, z) in the track frame; virtual measurements that say "where it belongs, more or
less" keep the place from drifting. Forwards it is an extended Kalman filter, backwards a fixed-interval
smoother, and the first alone is to be had as a causal filter. It works at standstill and backwards, since
speed enters the measurements only, with its sign. What the rails look like then follows from the trajectory
(`simrail.estimators.trajectory.track_geometry`).

The model has no sensor bias. An offset of the accelerometer is wholly taken for roll and pitch, and so is the
turn of the device in its package: their sds by the data sheet are added afterwards (`sensor_bias`). What an
offset of the gyro does to yaw is not in the standard deviations. Place is another matter: the virtual
measurements hold it.

What the model lacks is balanced from both sides within a ride, and from one side only at its two ends. A gyro
bias that no rest has told, a start attitude that is believed too firmly, or virtual positions that are too
soft show there as a peak of the alignment over some metres, such as paper 001 found and left open.

The model stands in `simrail.estimators.trajectory.model`, the noise in `simrail.estimators.trajectory.noise`.
"""

import math
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from simrail.estimators.odometry.consistent import with_consistent_acceleration
from simrail.estimators.trajectory.draws import geometry_draws, state_errors, stream_of
from simrail.estimators.trajectory.kernel import (
    PACKED,
    STATES,
    Model,
    Past,
    outputs,
    room_for_filtered,
    room_for_past,
    trajectory_back,
    trajectory_filter,
)
from simrail.estimators.trajectory.model import model_of
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.trajectory.track_geometry import geometry_of, sight_of
from simrail.estimators.tuning.file import Tuning

from simrail.core.columns import (
    ATTITUDE,
    ATTITUDE_SD,
    INNOVATION,
    RATE_INNOVATION,
    RELATIVE_POSITION,
    RELATIVE_POSITION_SD,
)
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray, IntArray
from simrail.estimation.estimate import Estimate
from simrail.estimation.tunable import Tunable
from simrail.recording.recording import Recording


class Trajectory(NamedTuple):
    """All that is estimated of n samples.

    Attributes
    ----------
    states : ndarray (n, 12)
        Smoothed or filtered.
    covariance : ndarray (n, m (m + 1)/2) or (0, m (m + 1)/2)
        Upper triangles of the covariances of the m states asked for, row by row; of no rows if not wanted.
    innovations : ndarray (n, 7)
        Measured minus predicted rates and forces, and their normalised innovation squared.
    log_likelihood : float
        Of all measurements, the virtual ones among them.
    errors : ndarray (m, n, 3), optional
        Draws of truth minus smoothed roll, y and z (`simrail.estimators.trajectory.draws`).
    """

    states: FloatArray
    covariance: FloatArray
    innovations: FloatArray
    log_likelihood: float
    errors: FloatArray | None = None


OUTPUT = (0, 2, 4, 6, 9)
"""States of the estimate among the twelve: roll, pitch, yaw, y, z."""

START_RATE_SD = 0.02
"""rad/s: the train starts from rest, or as steadily as the track turns."""

START_PLACE_SD = (0.01, 0.02, 0.2)
"""m, m/s, m/s2: place in the track frame and its derivatives."""

MOST_PASSES = 5
"""Each pass takes the error of the angles squared: two are enough, three change nothing."""


MOST_DRAWS = 1000
"""An interval by so many is 0.1 % wider than by any more; all of them are held at once."""


@dataclass(frozen=True)
class TrajectorySmoother:
    """Extended Kalman smoother of paper 001, section 3 and appendix 1.

    Attributes
    ----------
    smoothed : bool
        False stops after the filter, which is causal.
    hyperparameters : Hyperparameters
        Noise.
    curve_hyperparameters : Hyperparameters, optional
        Noise in the transitions and curves of the design track; the same as on straights if not given.
    tuning : Tuning, optional
        Hyper-parameters from a file (`simrail.estimators.tuning.file`) to use instead; in a scenario, its
        path.
    rest_bias : bool
        Subtract the gyro's mean over the rests so far.
    second_order : bool
        Take what the paper's equations, of first order in cant and slope, leave out off the signals, for a
        body that keeps to the design (`simrail.estimators.trajectory.model.beyond_first_order`). False for
        the paper's.
    passes : int
        How often to smooth. After the first pass, what is beyond first order is taken at the angles of the
        pass before, in place of the design's: on rails so narrow or so rough that bodies roll by 10 mrad and
        more, g roll^2/2 would else pass for a motion along Z.
    printed : bool
        The equations as paper 001 prints them (EQUATIONS 1.3), to show what it costs.
    with_covariance : bool
        False leaves out covariances and standard deviations, which take more than half of the time.
    sensor_bias : bool
        Add what the accelerometer's turn-on bias and the misalignment of the package, by the data sheet, do
        to roll and pitch to their variances. False leaves the paper's, of a model in which sensors have none.
    geometry_step_m : float
        Distance of the places of the rail geometry; 0 leaves the geometry out. It lies over the track and is
        made after the ride, also of the filter's states, which are causal.
    rail_sensor : bool
        False makes the geometry without a rail sensor, though the recording has one: to show what it gives.
    draws : int
        How often to draw what the rails may be from the posterior (`simrail.estimators.trajectory.draws`):
        their standard deviation in a band of wavelengths follows from that alone. 0 for none; only smoothed
        and with a geometry.
    start_sd_rad, start_yaw_sd_rad : float
        Standard deviation of roll and pitch, and of yaw, about the design track's at the start.
    """

    smoothed: bool = True
    hyperparameters: Hyperparameters = field(default_factory=Hyperparameters)
    curve_hyperparameters: Hyperparameters | None = None
    tuning: Tuning | None = None
    rest_bias: bool = True
    second_order: bool = True
    passes: int = 1
    printed: bool = False
    with_covariance: bool = True
    sensor_bias: bool = True
    geometry_step_m: float = 0.25
    rail_sensor: bool = True
    draws: int = 0
    start_sd_rad: float = math.radians(1.0)
    start_yaw_sd_rad: float = math.radians(0.3)

    def __post_init__(self) -> None:
        for name, kinds in (
            ("hyperparameters", Hyperparameters),
            ("curve_hyperparameters", Hyperparameters | None),
            ("tuning", Tuning | None),
        ):
            if not isinstance(getattr(self, name), kinds):
                raise InputError(
                    "are no hyper-parameters",
                    field=name,
                    value=getattr(self, name),
                    remedy="in a scenario, name a file of them in the option tuning",
                    limit="Hyperparameters",
                )
        again = self.smoothed and self.second_order and not self.printed
        is_whole = isinstance(self.draws, int) and not isinstance(self.draws, bool)
        has_rails = self.smoothed and self.geometry_step_m > 0.0
        passes = f"1 to {MOST_PASSES}; 1 unless smoothed, of second order and not as printed"
        draws = f"0 to {MOST_DRAWS}"
        out = "is out of range"
        for name, is_good, problem, limit in (
            ("start_sd_rad", 0.0 < self.start_sd_rad < math.inf, out, "> 0"),
            ("start_yaw_sd_rad", 0.0 < self.start_yaw_sd_rad < math.inf, out, "> 0"),
            ("passes", self.passes in range(1, MOST_PASSES + 1 if again else 2), "cannot be", passes),
            ("geometry_step_m", 0.0 <= self.geometry_step_m < math.inf, out, "0 (none) or more, m"),
            ("draws", is_whole and self.draws in range(MOST_DRAWS + 1), "is no number of draws", draws),
            ("draws", not self.draws or has_rails, "cannot be", "0 unless smoothed and with a geometry"),
        ):
            if not is_good:
                raise InputError(problem, field=name, value=getattr(self, name), limit=limit)
        given = self.hyperparameters != Hyperparameters() or self.curve_hyperparameters is not None
        if self.tuning is not None and given:
            raise InputError(
                "a file and values cannot both be given",
                field="tuning",
                limit="one of them",
                remedy="leave one out",
            )

    needs = ("odometry",)
    label = "trajectory smoother"
    cites = ("gonzalez_2023",)

    @property
    def causal(self) -> bool:
        """The filter is causal, the smoother is not."""
        return not self.smoothed

    @property
    def noise(self) -> tuple[Hyperparameters, ...]:
        """The set of hyper-parameters, or those of straights and of transitions and curves."""
        chosen = self if self.tuning is None else self.tuning
        both = (chosen.hyperparameters, chosen.curve_hyperparameters)
        return tuple(values for values in both if values is not None)

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate attitude and place in the track frame at every IMU sample, and the rails below.

        The smoother replaces an acceleration that is not the slope of the odometry's speed
        (`simrail.estimators.odometry.consistent`).
        """
        if self.smoothed:
            recording = with_consistent_acceleration(recording)
        estimate, errors = self._trajectory(recording)
        if not self.geometry_step_m:
            return estimate
        if not self.rail_sensor:
            recording = replace(recording, rail_displacement=None, rail_sensor_sheet=None)
        sight, step = sight_of(estimate, recording), self.geometry_step_m
        geometry, drawn = geometry_of(sight, step_m=step), None
        if errors is not None:
            tilts = self._tilts(recording)
            drawn = geometry_draws(sight, geometry, errors, recording, tilts_rad=tilts, step_m=step)
        return replace(estimate, geometry=geometry, geometry_draws=drawn)

    def _tilts(self, recording: Recording) -> tuple[float, ...]:
        """Bounds of the roll or pitch that the accelerometer's turn-on bias and the package cause, rad."""
        sheet = recording.imu_sheet
        if not self.sensor_bias:
            return ()
        return sheet.accel_turn_on_bias_mps2 / recording.gravity_mps2, sheet.package_misalignment_rad

    def _trajectory(self, recording: Recording) -> tuple[Estimate, FloatArray | None]:
        """Without the geometry; the trace is let go before that is made, since it is large."""
        trace = self._run(recording, OUTPUT)
        n, index, names = len(trace.states), recording.imu.index, [*ATTITUDE, *RELATIVE_POSITION]
        wide = len(OUTPUT) if self.with_covariance else 0
        found, covariance = np.empty((n, len(OUTPUT) + wide)), np.empty((n if wide else 0, wide, wide))
        # Uniform within their bounds.
        beside = np.zeros(len(OUTPUT))
        beside[:2] = sum(bound**2 for bound in self._tilts(recording)) / 3.0
        outputs(trace.states, trace.covariance, np.array(OUTPUT), beside, found, covariance)
        if self.with_covariance:
            names += [*ATTITUDE_SD, *RELATIVE_POSITION_SD]
        estimate = Estimate(
            states=pd.DataFrame(found, index=index, columns=names),
            mount=recording.mount,
            innovations=pd.DataFrame(trace.innovations, index=index, columns=[*RATE_INNOVATION, *INNOVATION]),
            covariance=covariance if self.with_covariance else None,
            covariance_of=(*ATTITUDE, *RELATIVE_POSITION) if self.with_covariance else (),
        )
        return estimate, trace.errors

    def trace(self, recording: Recording) -> Trajectory:
        """All twelve states with their covariances, the innovations, and the log-likelihood."""
        return self._run(recording, tuple(range(STATES)))

    def _run(self, recording: Recording, states: tuple[int, ...]) -> Trajectory:
        """The same, with the covariance of some of the states."""
        around = None
        for _ in range(self.passes - 1):
            model = self.model(recording, around=around)
            around = run_model(model, smoothed=True, covariance_of=()).states
        model = self.model(recording, around=around)
        streams = [stream_of(recording, draw, "trajectory") for draw in range(self.draws)]
        wanted = states if self.with_covariance else ()
        return run_model(model, smoothed=self.smoothed, covariance_of=wanted, streams=streams)

    def tunables(self, settings: Mapping[str, Any]) -> Mapping[str, Tunable]:
        """What `simrail tune` searches; see `simrail.estimators.tuning.objectives`."""
        from simrail.estimators.tuning.objectives import tunables_of_smoother  # which is made of this module

        return tunables_of_smoother(self, settings)

    def model(self, recording: Recording, *, around: FloatArray | None = None) -> Model:
        """What the kernels take of a recording; `around` is the states (n, 12) of a pass before."""
        rates, place = [START_RATE_SD] * 3, START_PLACE_SD
        angles = [self.start_sd_rad, self.start_sd_rad, self.start_yaw_sd_rad]
        pairs = [sd for pair in zip(angles, rates, strict=True) for sd in pair]
        return model_of(
            recording,
            self.noise,
            use_rest_bias=self.rest_bias,
            second_order=self.second_order,
            printed=self.printed,
            start_sd=np.array([*pairs, *place, *place]),
            around=around,
        )


class _Rooms(threading.local):
    """Room for what a filter leaves behind, of one thread, kept from one run to the next.

    It is 1.6 kB a sample. The system clears what it hands out, page by page, which took a seventh of an
    estimate; of a long ride the room is given back all the same.
    """

    most = 80_000
    """Samples of the longest ride whose room is kept: 130 MB, five minutes at 250 Hz."""

    kept: Past | None = None

    def past(self, n: int) -> Past:
        """Room for n samples; what the run before left there is lost."""
        if n > self.most:
            return room_for_past(n)
        if self.kept is None or len(self.kept.states) < n:
            self.kept = room_for_past(n)
        return Past(*(array[:n] for array in self.kept))


_ROOMS = _Rooms()


def packed_at(states: tuple[int, ...]) -> IntArray:
    """Columns of an upper triangle of all twelve, row by row, that hold the one of some of them, in order."""
    rows, columns = (np.array(states, dtype=np.int64)[i] for i in np.triu_indices(len(states)))
    return np.asarray(rows * (2 * STATES - rows - 1) // 2 + columns)


def log_likelihood(model: Model) -> float:
    """Log-likelihood alone: nothing is kept."""
    return trajectory_filter(model, room_for_past(0), room_for_filtered())


def likelihoods(model: Model) -> FloatArray:
    """Log-likelihood (n,) of each sample given those before it."""
    out = room_for_filtered(likelihoods=len(model.signals))
    trajectory_filter(model, room_for_past(0), out)
    return out.likelihoods


def run_model(
    model: Model,
    *,
    smoothed: bool,
    covariance_of: tuple[int, ...] = tuple(range(STATES)),
    streams: Sequence[np.random.Generator] = (),
) -> Trajectory:
    """Filter and smoother by the kernels; one draw of the smoother's error for each of the streams.

    ``covariance_of`` are the states whose covariance is wanted, in increasing order: fewer take less time.
    """
    n = len(model.signals)
    is_kept = n <= _ROOMS.most
    past = _ROOMS.past(n) if smoothed else room_for_past(0)
    out = room_for_filtered(states=0 if smoothed else n, innovations=n)
    likelihood, errors = trajectory_filter(model, past, out), None
    if smoothed and streams:
        errors = state_errors(model, past, streams)
    at = packed_at(covariance_of)
    if smoothed:
        # What is not kept is replaced in place: a ride of an hour needs no second copy of its covariances.
        states = np.empty((n, STATES)) if is_kept else past.states
        is_whole = len(at) == PACKED and not is_kept
        covariance = past.covariance if is_whole else np.empty((n, len(at)))
        trajectory_back(model, past, np.array(covariance_of, dtype=np.int64), states, covariance)
    else:
        states, covariance = out.states, out.covariance[:, at] if len(at) < PACKED else out.covariance
    return Trajectory(states, covariance if len(at) else covariance[:0], out.innovations, likelihood, errors)
