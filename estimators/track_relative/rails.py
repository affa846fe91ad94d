"""The rails that the track-relative smoother finds, how sure they are, and draws of what they may be.

What the mount does at the full rate of its IMU (`simrail.estimators.track_relative.full_rate`) says where the
rails are:

* on an axle, whose wheels stand on them: at once;
* on a bogie frame of full size of which the drawing has springs and masses: under them
  (`simrail.estimators.track_relative.under_frame`);
* with a rail sensor: by what it sees from the body, on a body of a model too, whose two ends tell by its
  gyros where its accelerometers err (`simrail.estimators.track_relative.both_ends`);
* on a mount of any other kind: as by the body itself.

The map errs in its cant. What of that the smoother finds is no irregularity and is taken off, as is what a
body leans on cant deficiency; how sure it is of the rest is its sd of the roll by the rails.

The alignment is that of the mount, which a wheelset's play between the rails keeps from being theirs: white
motion to the side (`ASIDE_MPS2`) stands for it.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import ndimage, signal
from scipy.interpolate import CubicSpline
from simrail.estimators.odometry.scale import scale_of
from simrail.estimators.track_relative.both_ends import Ends, ends_of, missed, still_missed
from simrail.estimators.track_relative.full_rate import (
    Chain,
    Held,
    Waviness,
    beside_rails,
    error_of,
    found,
    found_before,
    heave_of,
    held_of,
    nod_of,
    side_of,
)
from simrail.estimators.track_relative.kernel import OUTPUTS
from simrail.estimators.track_relative.line import Lines
from simrail.estimators.track_relative.noise import AXLE, FRAME, class_of
from simrail.estimators.track_relative.output import Trace
from simrail.estimators.track_relative.states import ROLL, ROLL_SLOW
from simrail.estimators.track_relative.suspension import bogie_of
from simrail.estimators.track_relative.under_frame import Under, draw_under, rails_under
from simrail.estimators.trajectory.draws import stream_of
from simrail.estimators.trajectory.track_geometry import (
    Sight,
    displaced,
    geometry_of,
    over_space,
    sight_of,
    slopes,
)

from simrail.core.columns import (
    ATTITUDE,
    IRREGULARITY,
    IRREGULARITY_SD,
    RELATIVE_POSITION,
    RELATIVE_POSITION_SD,
)
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording

LEAST_STEPS = 8
"""Of the smoother, or places: on a shorter ride there is nothing of the rails to find."""

WHEELS_M3 = (1.2e-8, 1.5e-9, 1.4e-8, 0.0)
"""What the wheels of an axle do between the rails: white over the track, m2 per cycle per m, two-sided, in
the order of the irregularities; what simulated ones leave of waves of 3 to 25 m."""

ASIDE_MPS2 = {AXLE: 0.18, FRAME: 0.22}
"""Motion to the side that is none of the rails, as in `side_of`; synthetic, of a metro's simulated bogies."""

LEVEL = OUTPUTS - 1
"""Of the outputs, the roll that is the rails'."""

SLOW_LENGTH_M = 15.0
"""Of the two filters through which white noise becomes the error of a roll that is held."""


LONGEST_M = 48.0
"""Longest filter of `Waviness`."""

SETTLED = 10
"""Lengths after which a process has forgotten that it began with nothing."""


class Motions(NamedTuple):
    """Motion of a mount at its samples, by chains of coordinates, and their variances.

    Attributes
    ----------
    chains : dict of str to Chain
        ``"side"`` (roll, y), ``"across"`` (the same, with what a mount does beside the rails for noise),
        ``"heave"`` (z), and ``"nod"`` (pitch) where it is wanted.
    values, variances : dict of str to ndarray (n, w)
    """

    chains: dict[str, Chain]
    values: dict[str, FloatArray]
    variances: dict[str, FloatArray]


def rails_of(
    recording: Recording, trace: Trace, estimate: Estimate, *, step_m: float, draws: int
) -> Estimate:
    """An estimate with the geometry of the rails, and draws of its error if wanted.

    Parameters
    ----------
    recording : Recording
    trace : Trace
        Of the smoother, not of the filter.
    estimate : Estimate
        The states that were found.
    step_m : float
        Distance of the places.
    draws : int
        How many (`Estimate.geometry_draws`).

    Returns
    -------
    Estimate
        On a mount that is neither an axle nor a frame by the drawing, with the geometry as the smoother's
        own states have it, and no draws; unless it is of a model and sees its rails.
    """
    kind, scale = class_of(recording), scale_of(recording)
    if len(trace.states) < LEAST_STEPS:
        return replace(estimate, geometry=geometry_of(sight_of(estimate, recording), step_m=step_m))
    sees_as_a_model = scale != 1.0 and recording.rail_displacement is not None
    if kind not in (AXLE, FRAME) and not sees_as_a_model:
        seen = sight_of(replace(estimate, states=_on_springs(recording, trace, estimate)), recording)
        return replace(estimate, geometry=geometry_of(seen, step_m=step_m))
    sheet, bogie = recording.vehicle_sheet, None
    if kind is FRAME and scale == 1.0 and sheet is not None and recording.rail_displacement is None:
        bogie = bogie_of(sheet, recording.mount_body)
    motions, held = _motions(
        recording, trace, ASIDE_MPS2.get(kind, 0.0), borne=bogie is not None, drawn=draws > 0
    )
    sight, slow = _seen_from(recording, trace, estimate, motions)
    geometry, under = geometry_of(sight, step_m=step_m), None
    wheels = scale**3 * np.array(WHEELS_M3) / step_m
    if not draws:
        sight = sight._replace(arms=sight.arms[:1].copy(), rails=sight.rails[:0], covariance=None)
    if bogie is not None and sheet is not None and held is not None and len(geometry) >= LEAST_STEPS:
        motion = _frame_motion(motions.values)
        at = geometry.index.to_numpy(dtype=np.float64)
        under = rails_under(recording, held, motion, bogie, sheet.stiffness_relative_sd, at)
        geometry = _with_rails(geometry, under, sight, slow, motions, step_m)
        wheels[1:] = 0.0
    for sd, variance in zip(IRREGULARITY_SD, wheels, strict=True):
        geometry[sd] = np.hypot(geometry[sd], np.sqrt(variance))
    ends = ends_of(recording, trace) if sees_as_a_model and len(geometry) >= LEAST_STEPS else None
    if ends is not None:
        moved = np.column_stack([motions.values["across"][:, 1], motions.values["heave"][:, 0]])
        geometry[list(IRREGULARITY[:2])] -= missed(ends, sight, moved[sight.use], step_m)
    drawn = None
    if draws:
        drawn = _draws(
            recording, trace.course.lines, geometry, sight, slow, motions, under, ends, wheels, step_m, draws
        )
    return replace(estimate, geometry=geometry, geometry_draws=drawn)


def _motions(
    recording: Recording, trace: Trace, aside: float, *, borne: bool, drawn: bool
) -> tuple[Motions, Held | None]:
    """The motion, and what is held of a frame that is borne; chains only for draws: they are large."""
    waviness, held = Waviness().at_scale(scale_of(recording)), held_of(recording, trace)
    sensor, motion = recording.rail_displacement is not None, trace.course.motion
    if motion.sway_hz > 0.0:
        # A body on springs: what it does on them is not the rails', which it only has to look at.
        waviness = replace(waviness, roll_sd=motion.roll_sd, y_sd=motion.y_sd, z_sd=motion.z_sd)
    chains = {
        "side": side_of(recording, held, waviness),
        "heave": heave_of(recording, held, waviness),
    }
    if not sensor:
        chains["across"] = side_of(recording, held, waviness, aside)
    if borne:
        chains["nod"] = nod_of(recording, held, waviness)
    values, variances = {}, {}
    for name, one in chains.items():
        values[name], covariance = found(one, held.rest)
        variances[name] = np.diagonal(covariance, axis1=1, axis2=2).copy()
    if sensor:
        chains["across"] = chains["side"]
        values["across"], variances["across"] = values["side"], variances["side"]
    return Motions(chains if drawn else {}, values, variances), held if borne else None


def _seen_from(
    recording: Recording, trace: Trace, estimate: Estimate, motions: Motions
) -> tuple[Sight, FloatArray]:
    """Rails by the body as it moves at full rate, and the variance (n,) of the roll that is held."""
    states, before = _by_rails(recording, trace, estimate), found_before(recording, trace)
    for name, values, old in (
        ("roll_rad", motions.values["side"][:, 0], before[:, 0]),
        ("lateral_m", motions.values["across"][:, 1], before[:, 1]),
        ("vertical_m", motions.values["heave"][:, 0], before[:, 2]),
    ):
        states[name] += values - old
    fast = motions.variances["side"][:, 0]
    slow = states["roll_sd_rad"].to_numpy(dtype=np.float64) ** 2
    variances = [motions.variances["across"][:, 1], motions.variances["heave"][:, 0]]
    states["roll_sd_rad"] = np.sqrt(fast + slow)
    states[list(RELATIVE_POSITION_SD)] = np.sqrt(np.column_stack(variances))
    return sight_of(replace(estimate, states=states), recording), slow


def _by_rails(recording: Recording, trace: Trace, estimate: Estimate) -> pd.DataFrame:
    """States of which the roll is that of the rails, and its sd."""
    names = [*ATTITUDE, *RELATIVE_POSITION, *RELATIVE_POSITION_SD, "position_m", "position_sd_m"]
    states = estimate.states[names].copy()
    states["roll_rad"] -= beside_rails(recording, trace)
    time, at_s = recording.imu.index.to_numpy(dtype=np.float64), trace.course.steps.time_s
    states["roll_sd_rad"] = np.sqrt(np.interp(time, at_s, np.maximum(trace.covariance[:, LEVEL, LEVEL], 0.0)))
    return states


def _on_springs(recording: Recording, trace: Trace, estimate: Estimate) -> pd.DataFrame:
    """States of a body that passes for its rails.

    How it rolls on its springs is all that it shows, and the rails under it may do something else.
    """
    states = _by_rails(recording, trace, estimate)
    if recording.rail_displacement is None:
        sways = float(np.square(trace.states[:, ROLL] - trace.states[:, ROLL_SLOW]).mean())
        states["roll_sd_rad"] = np.sqrt(np.square(states["roll_sd_rad"]) + sways + AXLE.roll_sd**2)
    return states


def _frame_motion(values: dict[str, FloatArray]) -> FloatArray:
    """Roll, y, z and pitch (n, 4)."""
    return np.column_stack([values["side"], values["heave"], values["nod"]])


def _with_rails(
    geometry: pd.DataFrame, under: Under, sight: Sight, slow: FloatArray, motions: Motions, step_m: float
) -> pd.DataFrame:
    """The geometry with profile and cross-level of the rails under a frame, and their sds."""
    base = float(sight.arms[0, 0, 1] - sight.arms[0, 1, 1])
    variances = [
        motions.variances["heave"][:, 0],
        base**2 * (motions.variances["side"][:, 0] + slow),
        sight.place_sd**2,
    ]
    spread = _spread(sight, np.column_stack(variances), step_m)
    at = geometry.index.to_numpy(dtype=np.float64)
    moved = displaced(at, under.rails, np.sqrt(spread[:, 2]))
    out = geometry.copy()
    for i, name in enumerate(("vertical_profile", "cross_level")):
        out[f"{name}_m"] = under.rails[:, i]
        out[f"{name}_sd_m"] = np.sqrt(spread[:, i] + under.variance[:, i] + moved[:, i])
    return out


def _spread(sight: Sight, variances: FloatArray, step_m: float) -> FloatArray:
    """Variances (n, m) at the samples, at the places (g, m) of the geometry."""
    used = variances[sight.use]
    found_there = over_space(sight.place[sight.use], used, step_m=step_m, variance=used).variance
    assert found_there is not None
    return found_there


def _draws(
    recording: Recording,
    lines_of_map: Lines,
    geometry: pd.DataFrame,
    sight: Sight,
    slow: FloatArray,
    motions: Motions,
    under: Under | None,
    ends: Ends | None,
    wheels: FloatArray,
    step_m: float,
    count: int,
) -> FloatArray:
    """Draws (m, g, 4) of true minus estimated irregularities.

    Of one cause each, and independent: the motion, what wheels do between the rails, the roll that is held,
    the map's gradients, a displacement along the track (one normal number for a draw, as in
    `simrail.estimators.trajectory.draws`), and under a frame the numbers of the drawing.
    """
    at = geometry.index.to_numpy(dtype=np.float64)
    lines = geometry[list(IRREGULARITY)].to_numpy(dtype=np.float64)
    unknown, known = np.isnan(lines), np.nan_to_num(lines)
    drawn = np.zeros((count, *lines.shape))
    if len(at) == 0:
        return drawn
    slope, place = slopes(sight.arms)[sight.use], sight.place[sight.use]
    spread = np.sqrt(_spread(sight, np.column_stack([slow, sight.place_sd**2]), step_m))
    along, base = CubicSpline(at, known), float(slope[0, 2, 0])
    for draw in range(count):
        rng = stream_of(recording, draw, "track_relative")
        errors: dict[str, FloatArray] = {}
        for name, one in motions.chains.items():
            shared = name == "across" and one is motions.chains["side"]
            errors[name] = errors["side"] if shared else error_of(one, rng)
        felt = np.column_stack([errors["side"][:, 0], errors["across"][:, 1], errors["heave"][:, 0]])
        rails = np.einsum("nij,nj->ni", slope, felt[sight.use])
        if sight.noise_sd > 0.0:
            rails += sight.noise_sd * np.sqrt([0.5, 0.5, 2.0, 2.0]) * rng.standard_normal(rails.shape)
        drawn[draw] = over_space(place, rails, step_m=step_m).values
        if ends is not None:
            drawn[draw][:, :2] -= still_missed(ends, sight, felt[sight.use][:, 1:], step_m, rng)
        if under is not None:
            drawn[draw][:, 1:3] = draw_under(under, _frame_motion(errors), rng)
        drawn[draw] += np.sqrt(wheels) * rng.standard_normal(lines.shape)
        drawn[draw][:, 1] += _by_gradients(recording, lines_of_map, at, rng)
        drawn[draw][:, 2] += base * spread[:, 0] * _slowly(len(at), step_m, rng)
        moved = at + stream_of(recording, draw, "position").standard_normal() * spread[:, 1]
        drawn[draw] += along(np.clip(moved, at[0], at[-1])) - known
        drawn[draw][unknown] = np.nan
    return drawn


def _by_gradients(recording: Recording, lines: Lines, at: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Heights (g,) by which a map passes for an irregularity whose gradients err: by a kink where they meet.

    Without waves that the smoother does not follow (`LONGEST_M`).
    """
    edges = np.flatnonzero(np.diff(lines.vertical, prepend=0.0, append=0.0) != 0.0)
    if len(edges) == 0 or len(at) < LEAST_STEPS:
        return np.zeros(len(at))
    ends = lines.places[np.minimum(edges, len(lines.places) - 1)]
    slopes_of = recording.map_errors.gradient_sd * rng.standard_normal(len(edges) // 2 + 1)
    slope = np.interp(at, ends, np.repeat(slopes_of, 2)[1:-1])
    step = (at[-1] - at[0]) / (len(at) - 1)
    height = np.cumsum(slope - slope.mean()) * step
    return np.asarray(height - ndimage.gaussian_filter1d(height, LONGEST_M / step, mode="nearest"))


def _slowly(n: int, step_m: float, rng: np.random.Generator) -> FloatArray:
    """A stationary process (n,) of variance 1, of white noise through two filters of `SLOW_LENGTH_M`."""
    kept, before = np.exp(-step_m / SLOW_LENGTH_M), round(SETTLED * SLOW_LENGTH_M / step_m)
    line = signal.lfilter([1.0], [1.0, -2.0 * kept, kept**2], rng.standard_normal(before + n))[before:]
    # The variance of an autoregressive process of second order with a double root.
    return np.asarray(line * np.sqrt((1.0 - kept**2) ** 3 / (1.0 + kept**2)))
