"""What a page shows of a ride over distance: panels of series, made short without losing their peaks.

The page draws them in the browser (``pages/page.js``), figures on paper draw the same numbers
(`simrail.report.figures.panels`), and `simrail figure` reads them back from the page: a ride is decimated
once, by its extremes, and never read again.
"""

import math
from base64 import b64decode, b64encode
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.core.columns import ACCEL, ATTITUDE, GYRO
from simrail.core.jit import FloatArray
from simrail.estimation.choose_odometry import TRUTH as TRUE_ODOMETRY
from simrail.recording.recording import Recording, odometry_of
from simrail.report.figures.attitude import angle_error
from simrail.report.figures.canvas import Place, places_of
from simrail.report.figures.contact import POSITION, leading_axle, wheel_forces
from simrail.report.figures.decimate import Bins
from simrail.report.figures.geometry import has_rails, lines_of
from simrail.report.figures.ride import direction_of, runs_of
from simrail.report.tables.geometry import JUDGED, QUANTITIES, is_zero
from simrail.report.tables.methods import MethodStyle
from simrail.track.bands import Band

MOST_NUMBERS = 130_000
"""In all views of a page: as base64 of 16 bits, 0.35 MB."""

LEAST_BINS, MOST_BINS = 60, 1500
"""Of one view."""

_TINTS = ("#0072B2", "#009E73", "#D55E00")
ERRORS, ATTITUDES, RAILS = "errors", "attitude", "rails"
"""Groups of panels that figures on paper ask for."""


@dataclass(frozen=True)
class Look:
    """How a series is called and drawn; its kind is "test", "baseline", "truth", "design" or "signal"."""

    label: str
    kind: str
    colour: str = ""
    dash: tuple[float, ...] = ()


FIXED = {
    "truth": Look("truth", "truth"),
    "design": Look("design", "design", "", (5.0, 3.0)),
    "measured": Look("measured, range and mean", "signal", _TINTS[0]),
    "odometry": Look("odometry, with its 95 % band", "signal", _TINTS[1]),
    "left": Look("left wheel", "signal", _TINTS[0]),
    "right": Look("right wheel", "signal", _TINTS[2]),
}
"""Looks of what is no method; a colour of "" is that of the text, and of methods without an IMU "muted"."""


@dataclass(frozen=True)
class Series:
    """One line, or one range, of a panel.

    Attributes
    ----------
    key : str
        Of its `Look`.
    y : ndarray (2 n,), optional
        Extremes of the bins, in the order in which they are met.
    low, high, mean : ndarray (n,), optional
        Range of the bins, and their mean.
    """

    key: str
    y: FloatArray | None = None
    low: FloatArray | None = None
    high: FloatArray | None = None
    mean: FloatArray | None = None


@dataclass(frozen=True)
class Panel:
    """Series over one axis of a view, in one unit."""

    group: str
    title: str
    unit: str
    axis: str
    series: tuple[Series, ...]


@dataclass(frozen=True)
class View:
    """What is drawn of one recording.

    Attributes
    ----------
    picks : dict of str to str
        What it is chosen by: ride, IMU, draw.
    facts : sequence of str
        What there is to know of it, a line each.
    travel : int
        Direction of travel: 1, -1, or 0 of a ride in several runs.
    along : str
        What its panels are drawn over, with the unit last.
    places : tuple of Place
        The line.
    axes : dict of str to (ndarray (n,), ndarray (2 n,))
        By name, means and extremes' places of the bins.
    panels : tuple of Panel
        What is drawn.
    """

    picks: dict[str, str]
    facts: Sequence[str]
    travel: int
    along: str
    places: tuple[Place, ...]
    axes: dict[str, tuple[FloatArray, FloatArray]]
    panels: tuple[Panel, ...]

    @property
    def title(self) -> str:
        """Its picks in a line."""
        return " \u00b7 ".join(self.picks.values())


def looks_of(styles: Sequence[MethodStyle]) -> dict[str, Look]:
    """Looks of all series: those of the methods, and `FIXED`."""
    methods = {}
    for style in styles:
        dash = () if isinstance(style.stroke, str) else tuple(style.stroke[1])
        methods[style.name] = Look(
            style.label,
            "baseline" if style.baseline else "test",
            style.colour if style.uses_imu else "muted",
            tuple(1.5 * d for d in dash),
        )
    return FIXED | methods


@dataclass
class Axes:
    """Bins of a view by the name of their axis, made as they are asked for, at most `count` each."""

    count: int
    bins: dict[str, Bins] = field(default_factory=dict)

    def of(self, name: str, x: FloatArray) -> Bins:
        """Bins of an axis over places or times (n,)."""
        if name not in self.bins:
            self.bins[name] = Bins(x, bins=self.count)
        return self.bins[name]

    @property
    def arrays(self) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Means of the bins, and places of their extremes."""
        return {
            name: (bins.x, bins.line(np.zeros(int(bins.count.sum())))[0]) for name, bins in self.bins.items()
        }


def ride_view(
    example: CellResult,
    styles: Sequence[MethodStyle],
    *,
    picks: dict[str, str],
    facts: Sequence[str],
    bins: int,
    band: Band | None = None,
) -> View:
    """The view of a ride that has a truth.

    Parameters
    ----------
    example : CellResult
        The ride.
    styles : sequence of MethodStyle
        Methods to draw.
    picks, facts
        See `View`.
    bins : int
        Bins of each series.
    band : Band, optional
        Wavelengths in which rails are shown beside the unfiltered ones.
    """
    axes = Axes(bins)
    motion = axes.of("motion", example.motion["position_m"].to_numpy())
    speed = 3.6 * np.abs(example.motion["speed_mps"].to_numpy())
    panels = [
        *_angles(example, styles, motion),
        *_rails(example, styles, axes, band),
        Panel("ride", "speed", "km/h", "motion", (line("truth", motion, speed),)),
        *_odometry(example, motion),
        *_forces(example, axes),
        *imu_panels(example.recording, motion),
    ]
    runs = runs_of(example)[0]
    travel = direction_of(example) if runs == 1 else 0
    along = "distance along the track, m"
    return View(picks, facts, travel, along, places_of(example.line), axes.arrays, tuple(panels))


def imu_panels(recording: Recording, bins: Bins) -> Iterator[Panel]:
    """The six signals of an IMU: range of the samples, and their mean."""
    for name in (*GYRO, *ACCEL):
        is_rate = name in GYRO
        signal = (180.0 / math.pi if is_rate else 1.0) * recording.imu[name].to_numpy()
        axis = name.split("_")[1].upper()
        title, unit = (f"rate {axis}", "\u00b0/s") if is_rate else (f"acceleration {axis}", "m/s\u00b2")
        yield Panel("IMU", title, unit, "motion", (ranged("measured", bins, signal),))


def line(key: str, bins: Bins, values: FloatArray) -> Series:
    """A signal (n,) as a line through the extremes of its bins."""
    return Series(key, y=bins.line(values)[1])


def ranged(key: str, bins: Bins, values: FloatArray) -> Series:
    """A signal (n,) as the range of its bins, and their mean."""
    low, mean, high = bins.envelope(values)
    return Series(key, low=low, high=high, mean=mean)


def _angles(example: CellResult, styles: Sequence[MethodStyle], bins: Bins) -> Iterator[Panel]:
    """Errors of roll, pitch and yaw; and roll and pitch themselves: yaw is the way of the line."""
    drawn = [style for style in styles if has_attitude(example, style.name)]
    if not drawn:
        return
    errors = {
        (style.name, column): np.rad2deg(angle_error(example, style.name, column))
        for style in drawn
        for column in range(3)
    }
    for column, title in enumerate(("roll error", "pitch error", "yaw drift")):
        series = []
        for style in drawn:
            error = errors[style.name, column]
            shown = error - error[0] if column == 2 else error
            # What uses no IMU errs by the track's irregularities: a range, or it would hide the others.
            series.append((line if style.uses_imu else ranged)(style.name, bins, shown))
        yield Panel(ERRORS, title, "\u00b0", "motion", tuple(series))
    frame = example.line.frame(bins.place)
    for column, (title, design) in enumerate((("roll", frame.roll_rad), ("pitch", frame.pitch_rad))):
        true = np.rad2deg(example.motion[ATTITUDE[column]].to_numpy())
        lines = [Series("design", y=np.repeat(np.rad2deg(design), 2)), line("truth", bins, true)]
        lines += [line(s.name, bins, true + errors[s.name, column]) for s in drawn if s.uses_imu]
        yield Panel(ATTITUDES, title, "\u00b0", "motion", tuple(lines))


def _rails(
    example: CellResult, styles: Sequence[MethodStyle], axes: Axes, band: Band | None
) -> Iterator[Panel]:
    """Rails as they lie and as methods find them, in a band that counts first, and unfiltered."""
    drawn = [style for style in styles if not is_zero(style) and has_rails(example, style)]
    if not drawn:
        return
    for part in [*([band] if band is not None else []), None]:
        group = RAILS if part is band and band is not None else f"{RAILS}, unfiltered"
        title = f" in {part.name}" if part is not None else ""
        for quantity in JUDGED:
            series: list[Series] = []
            for order, style in enumerate(drawn):
                by_draws = example.estimates[style.name].geometry_draws is not None
                place, true, found, sd = lines_of(example, style.name, quantity, part, by_draws=by_draws)
                if order == 0:
                    first = place
                    bins = axes.of(RAILS, place)
                    known = np.isfinite(true)
                    if known.any():
                        series.append(line("truth", bins, true))
                found, sd = (_at(first, place, values) for values in (found, sd))
                if not np.isfinite(found).any():
                    continue
                if order == 0 and np.isfinite(sd).any() and (part is None or by_draws):
                    low, high = (bins.envelope(found + k * sd).mean for k in (-1.96, 1.96))
                    series.append(Series(style.name, low=low, high=high))
                series.append(line(style.name, bins, found))
            if series:
                yield Panel(group, f"{QUANTITIES[quantity]}{title}", "mm", RAILS, tuple(series))


def _at(wanted: FloatArray, place: FloatArray, values: FloatArray) -> FloatArray:
    """Values at other places; NaN beyond the last."""
    if len(wanted) == len(place) and np.array_equal(wanted, place):
        return values
    return np.asarray(np.interp(wanted, place, values, left=np.nan, right=np.nan))


def _odometry(example: CellResult, bins: Bins) -> Iterator[Panel]:
    recording = example.recording
    if recording.odometry is None or recording.odometry_source == TRUE_ODOMETRY:
        return
    odometry = odometry_of(recording)
    error = odometry["position_m"].to_numpy() - example.motion["position_m"].to_numpy()
    wide = bins.envelope(1.96 * odometry["position_sd_m"].to_numpy()).mean
    series = (Series("odometry", low=-wide, high=wide), line("odometry", bins, error))
    yield Panel("ride", "position error of the odometry", "m", "motion", series)


def _forces(example: CellResult, axes: Axes) -> Iterator[Panel]:
    """Vertical and lateral forces of the leading axle, and their quotient."""
    sides = leading_axle(example) if example.contacts else {}
    if len({len(rows) for rows in sides.values()}) != 1:
        return
    # Both wheels of an axle pass a place together: the axis of one is that of the other.
    bins = axes.of("forces", next(iter(sides.values()))[:, POSITION])
    forces = {side: wheel_forces(side, rows) for side, rows in sides.items()}
    for title, unit in (("Q", "kN"), ("Y, positive to the left", "kN"), ("Y/Q", "1")):
        name = title.partition(",")[0]
        series = tuple(ranged(side, bins, own[name]) for side, own in forces.items())
        yield Panel("forces", title, unit, "forces", series)


def has_attitude(example: CellResult, name: str) -> bool:
    """Whether a method estimated roll, pitch and yaw; one that is an odometry and nothing else did not."""
    found = example.estimates.get(name)
    return found is not None and all(angle in found.states for angle in ATTITUDE)


def bins_for(recordings: int, methods: int, mappers: int) -> int:
    """Bins of each series, so that all views of a page hold at most `MOST_NUMBERS`: the first, twice as many.

    Parameters
    ----------
    recordings, methods, mappers : int
        Views, methods in each, and how many of those say what the rails look like.
    """
    # A line has two numbers to a bin: 5 of attitude, 6 of rails and their intervals; 6 ranges of the IMU.
    each = 10 * methods + 20 * mappers + 50
    return int(np.clip(MOST_NUMBERS // ((recordings + 1) * each), LEAST_BINS, MOST_BINS // 2))


# ---- as text, for the page

_NOTHING = 65_535
"""Where a series has no value."""


def as_data(view: View) -> dict[str, Any]:
    """A view as plain values, arrays as `_packed` has them."""
    return {
        "picks": view.picks,
        "facts": list(view.facts),
        "travel": view.travel,
        "along": view.along,
        "places": [vars(place) for place in view.places],
        "axes": {name: {"x": _packed(x), "x2": _packed(x2)} for name, (x, x2) in view.axes.items()},
        "panels": [
            {
                "group": panel.group,
                "title": panel.title,
                "unit": panel.unit,
                "axis": panel.axis,
                "series": [
                    {
                        k: v if isinstance(v, str) else _packed(v)
                        for k, v in vars(one).items()
                        if v is not None
                    }
                    for one in panel.series
                ],
            }
            for panel in view.panels
        ],
    }


def from_data(data: Mapping[str, Any]) -> View:
    """The view that `as_data` wrote."""

    def series(one: Mapping[str, Any]) -> Series:
        return Series(one["key"], **{name: _numbers(held) for name, held in one.items() if name != "key"})

    panels = (
        Panel(**{**panel, "series": tuple(series(one) for one in panel["series"])})
        for panel in data["panels"]
    )
    axes = {name: (_numbers(one["x"]), _numbers(one["x2"])) for name, one in data["axes"].items()}
    places = tuple(Place(**place) for place in data["places"])
    named = {name: data[name] for name in ("picks", "facts", "travel", "along")}
    return View(**named, places=places, axes=axes, panels=tuple(panels))


def _packed(values: FloatArray) -> list[Any]:
    """Numbers as their least, a step, and base64 of 16 bits each: how many steps above it, or `_NOTHING`.

    A panel has a few hundred pixels; its range has 65,534 steps.
    """
    real = np.isfinite(values)
    low, high = (float(values[real].min()), float(values[real].max())) if real.any() else (0.0, 0.0)
    step = (high - low) / (_NOTHING - 1)
    steps = np.full(len(values), _NOTHING, dtype="<u2")
    steps[real] = np.round((values[real] - low) / (step or 1.0))
    return [low, step, b64encode(steps.tobytes()).decode("ascii")]


def _numbers(held: list[Any] | str) -> FloatArray:
    """What `_packed` wrote; pages that version 0.2.0 or one before wrote have float32."""
    if isinstance(held, str):
        return np.frombuffer(b64decode(held), dtype="<f4").astype(np.float64)
    low, step, text = held
    steps = np.frombuffer(b64decode(text), dtype="<u2")
    return np.where(steps == _NOTHING, np.nan, low + step * steps)
