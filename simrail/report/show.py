"""One verb that draws any noun: `simrail.show(x)`.

What it returns is a matplotlib figure that belongs to whoever asked: it can be saved, or changed first. The
pictures of a page, which stand beside words and tables, are those of `simrail.report.figures`.
"""

from collections.abc import Sequence
from functools import singledispatch
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from simrail.core.columns import ACCEL, GYRO, IRREGULARITY
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.report.figures.canvas import (
    INK,
    MUTED,
    WIDE_IN,
    look,
    pad_limits,
    panels,
    places_of,
    shade_places,
)
from simrail.ride.ride import Ride
from simrail.ride.truth import Truth
from simrail.track.design import TrackDesign
from simrail.track.laid_track import LaidTrack
from simrail.vehicle.model import Body, SeriesDamper, Suspension, Tabled, VehicleModel

AXES = ("#0072B2", "#D55E00", "#009E73")
"""Colours of X, Y and Z."""

ANGLES = ("roll", "pitch", "yaw")

SMALL = 2000
"""Places at which a line is drawn; a screen shows no more."""


def show(x: object, **options: Any) -> Figure:
    """Draw a noun.

    Parameters
    ----------
    x : object
        A `TrackDesign`, `LaidTrack`, `VehicleModel`, `Ride`, `Truth`, `Recording`, `Estimate`, `Results`, or
        a table of scores.
    **options
        For an `Estimate`: ``recording``, over whose distance it is drawn, and ``truth``, the true motion of
        its mount (`Truth.motion`), drawn as a thin black line. For a `Truth`: ``bodies``, which of them. For
        scores: ``quantity``, one of the table, and ``metric``.

    Returns
    -------
    matplotlib.figure.Figure
        A notebook draws it; ``figure.savefig("name.svg")`` keeps it.

    Raises
    ------
    InputError
        If nothing is known of how to draw such an object, or an option names what it has not.
    """
    if hasattr(x, "scores") and isinstance(x.scores, pd.DataFrame):
        x = x.scores
    with look():
        figure: Figure = _draw(x, **options)
    return figure


@singledispatch
def _draw(x: object, **_: Any) -> Figure:
    known = ", ".join(kind.__name__ for kind in _draw.registry if kind is not object)
    raise InputError(
        "is nothing that can be drawn",
        field="x",
        value=type(x).__name__,
        limit=f"one of {known}, Results",
        remedy="draw its parts with matplotlib",
    )


@_draw.register
def _(x: TrackDesign) -> Figure:
    s = np.linspace(x.start_m, x.end_m, SMALL)
    frame = x.frame(s)
    cant = -1e3 * x.rail_base_m * np.sin(frame.roll_rad)
    figure, axes = panels([2.2, 1.2, 1.2, 1.2])
    plan, rest = axes[0], axes[1:]
    plan.remove()
    plan = figure.add_axes(plan.get_position().bounds, label="plan")
    plan.plot(*frame.position[:, :2].T, color=INK)
    plan.plot(*frame.position[0, :2], "o", color=INK, ms=5)
    plan.set(xlabel="east, m", ylabel="north, m", title=f"{x.name}: plan, begins at the dot")
    plan.set_aspect("equal", adjustable="datalim")
    for axis, line, label in zip(
        rest,
        (1e3 * x.curvature(s), cant, frame.position[:, 2]),
        ("curvature, 1/km", "cant, mm", "height, m"),
        strict=True,
    ):
        axis.plot(s, line, color=AXES[0])
        axis.set_ylabel(label)
        pad_limits(axis, float(line.min()), float(line.max()), top=0.3)
    shade_places(rest, places_of(x), limits=(x.start_m, x.end_m))
    rest[-1].set_xlabel("distance along the track, m")
    # The plan has an axis of its own: leave room between both.
    low, wide = plan.get_position().y0, plan.get_position().width
    plan.set_position((plan.get_position().x0, low + 0.05, wide, plan.get_position().height - 0.05))
    return figure


@_draw.register
def _(x: LaidTrack) -> Figure:
    s = np.linspace(x.design.start_m, x.design.end_m, 4 * SMALL)
    rails = x.irregularities(s)
    figure, axes = panels([1.2] * len(IRREGULARITY))
    for axis, name in zip(axes, IRREGULARITY, strict=True):
        axis.plot(s, 1e3 * rails[name], color=INK, lw=0.7)
        axis.set_ylabel(f"{_words(name)}, mm")
    axes[0].set_title(f"{x.design.name}: rails from {x.irregularity.spectrum}, seed {x.seed}", pad=14)
    shade_places(axes, places_of(x.design), limits=(x.design.start_m, x.design.end_m))
    axes[-1].set_xlabel("distance along the track, m")
    return figure


@_draw.register
def _(x: VehicleModel) -> Figure:
    joints: list[Suspension | SeriesDamper | Tabled] = [*x.suspensions, *x.series, *x.tabled]
    half = x.wheel_rail.tape_circle_half_m
    parts = {
        body.name: [joint.position_m for joint in joints if body.name in (joint.inner, joint.outer)]
        for body in x.bodies
    }
    points = np.array([place for body in x.bodies for place in (body.position_m, *parts[body.name])])
    radius = max(wheel.radius_m for wheel in x.wheels)
    (low, right, _), (high, left, top) = points.min(axis=0), points.max(axis=0)
    low, high, left = low - radius - 0.2, high + radius + 0.2, max(left, -right, half) + 0.3
    tall = 10.21 / (high - low)  # inches for a metre, the same in both views
    figure, (side, above) = panels([tall * (top + 0.5), tall * 2.0 * left])
    for number, body in enumerate(x.bodies):
        _draw_body(side, above, body, parts[body.name])
        place, beside = (body.position_m[0], body.position_m[2]), (4, 4 + 9 * (number % 2))
        side.annotate(body.name, place, beside, textcoords="offset points", fontsize=7.5)
    for along, across, height in (joint.position_m for joint in joints):
        side.plot(along, height, "x", color=AXES[1], ms=5)
        above.plot(along, across, "x", color=AXES[1], ms=5)
    for wheel in x.wheels:
        along = x.body(wheel.axle).position_m[0]
        side.add_patch(Circle((along, wheel.radius_m), wheel.radius_m, fill=False, ec=INK, lw=1.2))
        place = (along - wheel.radius_m, wheel.side * half - 0.06)
        above.add_patch(Rectangle(place, 2.0 * wheel.radius_m, 0.12, fc="#d5dae1", ec=INK, lw=0.8))
    side.axhline(0.0, color=MUTED, lw=1.5)
    side.set(xlim=(low, high), ylim=(-0.1, top + 0.4), ylabel="above rails, m")
    side.set_title(f"{x.title}: side and top; x marks springs and dampers")
    above.set(ylim=(-left, left), xlabel="ahead of the reference point, m", ylabel="to the left, m")
    return figure


def _draw_body(side: Axes, above: Axes, body: Body, joints: Sequence[tuple[float, float, float]]) -> None:
    """A box around the centre of gravity and what is fastened to the body, which has no other shape."""
    points = np.array([body.position_m, *joints])
    low, high = points.min(axis=0) - 0.08, points.max(axis=0) + 0.08
    for axis, column in ((side, 2), (above, 1)):
        box = (low[0], low[column]), high[0] - low[0], high[column] - low[column]
        axis.add_patch(Rectangle(*box, fc="#0072B2", alpha=0.10, ec="#0072B2", lw=0.8))
        axis.plot(body.position_m[0], body.position_m[column], "o", color=AXES[0], ms=4)


@_draw.register
def _(x: Ride) -> Figure:
    time = np.linspace(0.0, x.profile.duration_s, SMALL)
    place, speed, acceleration = x.profile.motion(time)
    figure, axes = panels([1.4, 1.4, 1.2])
    lines = ((place, "s, m"), (3.6 * speed, "speed, km/h"), (acceleration, "acceleration, m/s²"))
    for axis, (line, label) in zip(axes, lines, strict=True):
        axis.plot(time, line, color=AXES[0])
        axis.set_ylabel(label)
    axes[0].set_title(f"{x.name}: {x.vehicle.name} on {x.track.name}, as the driver wants it")
    axes[-1].set_xlabel("time, s")
    return figure


@_draw.register
def _(x: Truth, *, bodies: Sequence[str] | None = None) -> Figure:
    drawn = list(bodies or x.body_names)
    every = max(1, len(x.time_s) // (4 * SMALL))
    rows, time = slice(None, None, every), x.time_s[::every]
    motion = {name: x.body(name, rows=rows) for name in drawn}
    speed = np.gradient(x.reference_position_m, x.time_s)[rows]
    figure, axes = panels([1.1, 1.5, 1.5, 1.5])
    axes[0].plot(time, 3.6 * speed, color=INK)
    axes[0].set_ylabel("speed, km/h")
    for name, body in motion.items():
        for axis, angle, label in zip(axes[1:], body.angles.T, ANGLES, strict=True):
            axis.plot(time, np.degrees(angle), lw=0.9, label=name)
            axis.set_ylabel(f"{label}, deg")
    axes[1].legend(ncols=min(6, len(drawn)), loc="upper right")
    axes[0].set_title(f"{x.manifest.get('vehicle', 'a vehicle')} on {x.track.name}: true motion")
    axes[-1].set_xlabel("time, s")
    return figure


@_draw.register
def _(x: Recording) -> Figure:
    every = max(1, len(x.imu) // (8 * SMALL))
    imu = x.imu.iloc[::every]
    time = imu.index.to_numpy()
    figure, axes = panels([1.5, 1.5, *([1.1] if x.odometry is not None else [])])
    for axis, columns, factor, label in (
        (axes[0], GYRO, np.degrees(1.0), "rate, deg/s"),
        (axes[1], ACCEL, 1.0, "specific force, m/s²"),
    ):
        for name, colour, side in zip(columns, AXES, "XYZ", strict=True):
            axis.plot(time, factor * imu[name], color=colour, lw=0.7, label=side)
        axis.set_ylabel(label)
        axis.legend(ncols=3, loc="upper right", frameon=True)
    if x.odometry is not None:
        axes[2].plot(time, 3.6 * x.odometry["speed_mps"].iloc[::every], color=INK)
        axes[2].set_ylabel("speed, km/h")
    axes[0].set_title(f"{x.name}: IMU {x.mount} on {x.mount_body}")
    axes[-1].set_xlabel("time, s")
    return figure


@_draw.register
def _(x: Estimate, *, recording: Recording | None = None, truth: pd.DataFrame | None = None) -> Figure:
    drawn = [f"{name}_rad" for name in ANGLES] + ["position_m", "speed_mps", "lateral_m", "vertical_m"]
    drawn = [name for name in drawn if name in x.states]
    if not drawn:
        raise InputError(
            "has no state that can be drawn",
            field="states",
            value=", ".join(map(str, x.states)),
            limit="an angle, position or speed among the states",
        )
    across, label = _across(x, recording)
    every = max(1, len(x.states) // (4 * SMALL))
    figure, axes = panels([1.3] * len(drawn))
    for axis, name in zip(axes, drawn, strict=True):
        factor = np.degrees(1.0) if name.endswith("_rad") else 1.0
        value = factor * x.states[name].to_numpy()
        sd = f"{name.rpartition('_')[0]}_sd_{name.rpartition('_')[2]}"
        if sd in x.states:
            band = 1.96 * factor * x.states[sd].to_numpy()
            low, high = (value - band)[::every], (value + band)[::every]
            axis.fill_between(across[::every], low, high, color=AXES[0], alpha=0.2, lw=0, label="95 %")
        axis.plot(across[::every], value[::every], color=AXES[0], label="estimate")
        if truth is not None and name in truth:
            axis.plot(
                across[::every],
                factor * truth[name].to_numpy()[::every],
                color="black",
                lw=0.7,
                label="truth",
            )
        axis.set_ylabel(f"{_words(name)}, {'deg' if name.endswith('_rad') else _unit(name)}")
    axes[0].legend(ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    axes[-1].set_xlabel(label)
    return figure


def _across(x: Estimate, recording: Recording | None) -> tuple[FloatArray, str]:
    """What an estimate is drawn over: distance where it is known, and else time."""
    for states in (x.states, recording.odometry if recording is not None else None):
        if states is not None and "position_m" in states and np.ptp(states["position_m"]) > 1.0:
            return states["position_m"].to_numpy(), "distance along the track, m"
    return x.states.index.to_numpy(), "time, s"


@_draw.register
def _(x: pd.DataFrame, *, quantity: str = "", metric: str = "rms") -> Figure:
    """Scores: a dot for each draw, in the rows of the methods."""
    missing = [name for name in ("quantity", "metric", "estimator", "value", "window") if name not in x]
    if missing:
        limit = "a table of scores"
        raise InputError("lacks columns", field="x", value=", ".join(missing), limit=limit)
    rows = x[(x["metric"] == metric) & (x["window"] == "whole") & x["value"].notna()]
    known = list(rows["quantity"].unique())
    chosen = quantity or next((name for name in ("roll", "position", *known) if name in known), "")
    if chosen not in known:
        limit = ", ".join(known) or "no value at all"
        raise InputError("is not in the scores", field="quantity", value=chosen, limit=limit)
    rows = rows[rows["quantity"] == chosen]
    if "reference" in rows:
        rows = rows[rows["reference"] == rows["reference"].iloc[0]]
    methods = list(rows["estimator"].unique())
    figure, (axis,) = panels([max(1.2, 0.32 * len(methods))])
    for number, method in enumerate(methods):
        values = rows.loc[rows["estimator"] == method, "value"].to_numpy()
        spread = np.linspace(-0.22, 0.22, len(values)) if len(values) > 1 else np.zeros(1)
        axis.plot(values, number + spread, "o", ms=3.5, color=AXES[0], alpha=0.55)
        axis.plot([np.mean(values)] * 2, [number - 0.35, number + 0.35], color=INK, lw=2.0)
    axis.set_yticks(range(len(methods)), methods)
    axis.invert_yaxis()
    unit = f", {rows['unit'].iloc[0]}" if "unit" in rows else ""
    axis.set_xlabel(f"{chosen}, {metric}{unit}: a dot for each draw, the mean as a bar")
    axis.set_xlim(left=0.0)
    left, low, wide, tall = axis.get_position().bounds
    words = 0.075 * max(len(method) for method in methods) / WIDE_IN  # what the names take of the figure
    axis.set_position((left + words - 0.05, low, wide - words + 0.05, tall))
    return figure


def _words(column: str) -> str:
    return column.rpartition("_")[0].replace("_", " ")


def _unit(column: str) -> str:
    return {"m": "m", "mps": "m/s"}[column.rpartition("_")[2]]
