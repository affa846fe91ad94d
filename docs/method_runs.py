"""What each method makes of a short ride: the figures and numbers of its page, made when the guide is built.

`methods.toml` says for each method what is shown, what it is compared with, and what it is said to be good
and bad at; a sentence that the run does not bear out ends the build. Nothing is simulated: the ride is the
one that ships with the lessons. What was made is kept in ``docs/_figures`` until a source changes.
"""

import hashlib
import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from simrail import EncoderSpec, Irregularity, Mount, Parts, Recording, cells, lay, load_scenario, measure
from simrail.core.columns import ATTITUDE, IRREGULARITY, ODOMETRY
from simrail.core.jit import FloatArray
from simrail.core.source_hash import score_code_hash, source_hash
from simrail.core.toml_files import load
from simrail.estimation.choose_odometry import with_odometry
from simrail.estimation.estimate import Estimate, Estimator, estimator_class
from simrail.lessons.figures import Band, Line, Panel, svg_of
from simrail.lessons.rides import SHIPPED_SCENARIO, short_ride
from simrail.report.figures.canvas import drawn
from simrail.report.figures.decimate import Bins
from simrail.ride.kinematic import kinematic_truth, rail_following
from simrail.scoring.geometry import rail_error_of, score_geometry
from simrail.scoring.score import Reference, error_of, reference_of, score
from simrail.sensors.encoder import Slip
from simrail.sensors.second_imu import SecondImuSpec
from simrail.track.bands import BANDS, band_pass, sd_of_draws
from simrail.track.design import CURVE
from simrail.track.file import TrackFile
from simrail.track.laid_track import LaidTrack
from simrail.track.map_errors import MapErrors, draw_map
from simrail.vehicle.speed_profile import SpeedProfile

WIDTHS_IN = (8.6, 3.67)
"""Of a figure on a desk and on a phone: a page of the guide is narrower than a report."""

SEED = 1
"""Of device and map: the one that the lessons begin with."""

SLIP = Slip(start_s=24.0, duration_s=6.0, creepage=-0.3, ramp_s=0.5)
"""Of the ride ``slip``: the wheel slides through most of the curve."""

SPACING_M = 15.7
"""Between the two bodies of the ride ``bogies``, as between the bogies of a metro car."""

SHORTEST_M = 0.25
"""Shortest wave of its rails: 60 Hz at 54 km/h, where the band ends that is compared."""

NORMAL_95 = 1.96
POINTS = 320
NONE = "\N{EN DASH}"

WORDS = {
    "curve": """The ride is the one that ships with the lessons: a light-metro bogie by the multibody
engine over one curve of 300 m at 60 km/h, from rest to rest. The IMU (LORD 3DM-GX4-25, one device) sits
on the leading axle, the encoder on a trailing wheel, and the map errs as surveys do.""",
    "slip": """The ride is the one that ships with the lessons: a light-metro bogie over one curve of
300 m at 60 km/h. Here its wheel slides for 6 s on the way through the curve.""",
    "bogies": """The ride that ships with the lessons has one bogie only. Here two bodies keep exactly
to the rails of the same line, one behind the other, with an IMU (LORD 3DM-GX4-25) each: no suspension
and no wheel shakes them.""",
}
"""What each ride is; what is said of all of them stands in `method_pages.NOT_AN_AVERAGE`."""


@dataclass(frozen=True)
class Run:
    """A ride: what was recorded, what is true, and the rails."""

    recording: Recording
    reference: Reference
    rails: LaidTrack

    @property
    def time_s(self) -> FloatArray:
        """Times of the samples, from the first on."""
        times: FloatArray = self.recording.imu.index.to_numpy(dtype=np.float64)
        return times - times[0]


@lru_cache(maxsize=4)
def run_of(ride: str) -> Run:
    """The ride of a name in `WORDS`, recorded by one device with a map that errs."""
    return _two_bodies() if ride == "bogies" else _one_curve(slips=ride == "slip")


def _one_curve(*, slips: bool) -> Run:
    line, errors = short_ride(), MapErrors()
    scenario = load_scenario(SHIPPED_SCENARIO)
    cell = Parts(scenario).resolve(next(iter(cells(scenario))))
    encoder = cell.encoder
    assert encoder is not None
    if slips:
        encoder = replace(encoder, slip=(SLIP,))
    recording = measure(
        line.truth,
        name="short",
        mount=cell.mount,
        grade=cell.grade,
        encoder=encoder,
        seed=SEED,
        draw=0,
        track_map=draw_map(line.truth.track, errors, seed=SEED, draw=0),
        map_errors=errors,
        vehicle_sheet=cell.vehicle_sheet,
    )
    recording = with_odometry(recording, "curve_matched")
    return Run(recording, reference_of(line.truth, recording), line.rails)


def _two_bodies() -> Run:
    """Two bodies that follow the rails, by closed form: a tenth of a second."""
    design = load(TrackFile, "track", "smooth_curve").design("smooth_curve")
    rails = lay(design, Irregularity("erri_b176_low", (SHORTEST_M, 100.0), 40.0), seed=1)
    profile = SpeedProfile(
        start_m=30.0,
        end_m=570.0,
        speed_mps=15.0,
        acceleration_mps2=1.0,
        jerk_mps3=0.8,
        rest_s=8.0,
        final_rest_s=12.0,
    )
    truths = [
        kinematic_truth(
            design,
            profile,
            channels=rail_following(rails, height_m=0.6),
            offset_m=at,
            height_m=0.6,
            rate_hz=1000.0,
        )
        for at in (0.0, -SPACING_M)
    ]
    truth = replace(truths[0], bodies={"front": truths[0].bodies["body"], "rear": truths[1].bodies["body"]})
    scenario = load_scenario(SHIPPED_SCENARIO)
    grade = Parts(scenario).resolve(next(iter(cells(scenario)))).grade
    recording = measure(
        truth,
        name="two bogies",
        mount=Mount("front", "front", (0.0, 0.0, 0.6)),
        grade=grade,
        encoder=EncoderSpec("wheel", radius_error_sd=0.001),
        second_imu=SecondImuSpec(Mount("rear", "rear", (0.0, 0.0, 0.6)), grade),
        seed=1,
        draw=0,
    )
    return Run(recording, reference_of(truth, recording), rails)


@dataclass(frozen=True)
class Method:
    """A method with its options on a ride, and what the page calls it."""

    label: str
    method: str
    options: tuple[tuple[str, object], ...]
    ride: str

    @property
    def estimator(self) -> Estimator:
        """The estimator with its options."""
        return estimator_class(self.method)(**dict(self.options))

    @cache  # noqa: B019 - as many as there are lines in methods.toml
    def estimate(self) -> Estimate:
        """What it makes of its ride."""
        return self.estimator.estimate(run_of(self.ride).recording)

    @cache  # noqa: B019
    def scores(self) -> pd.DataFrame:
        """What that is worth."""
        run, estimate = run_of(self.ride), self.estimate()
        tables = [score(estimate, run.reference, run.recording)]
        if estimate.geometry is not None:
            tables.append(score_geometry(estimate, run.rails, run.recording))
        return pd.concat(tables, ignore_index=True)

    def figure(self, quantity: str, metric: str = "rms", window: str = "whole", band: str = "full") -> float:
        """One figure; NaN where there is none."""
        scores = self.scores()
        wanted = {
            "quantity": quantity,
            "metric": metric,
            "window": window,
            "band": band,
            "reference": "truth",
        }
        there = np.logical_and.reduce([scores[column] == value for column, value in wanted.items()])
        return float(scores.loc[there, "value"].iloc[0]) if there.any() else float("nan")

    def error(self, quantity: str, band: str) -> tuple[FloatArray, FloatArray]:
        """Times, s, or places, m, and the error there; none where it estimates no such thing."""
        run, estimate = run_of(self.ride), self.estimate()
        if is_rails(quantity):
            error = rail_error_of(estimate, run.rails, quantity, BANDS.get(band))
            return (np.zeros(0), np.zeros(0)) if error is None else (error.index.to_numpy(), error.to_numpy())
        found = error_of(estimate, run.reference, quantity)
        return (np.zeros(0), np.zeros(0)) if found is None else (run.time_s, found)


def is_rails(quantity: str) -> bool:
    """Whether a quantity speaks of the rails, over places, and not of the vehicle, over time."""
    return f"{quantity}_m" in IRREGULARITY


UNITS = {"roll": "°", "pitch": "°", "yaw": "°", "position": "m", "speed": "m/s"}


def unit_of(quantity: str) -> str:
    """Unit in which a page shows a quantity."""
    return UNITS.get(quantity, "mm")


def number(value: float, unit: str = "") -> str:
    """A figure for readers: three digits that count."""
    if not np.isfinite(value):
        return NONE
    return f"{float(f'{value:.3g}'):g}{'' if unit in ('°', '') else ' '}{unit}"


def said(words: Mapping[str, Any], own: Method, others: Mapping[str, Method], *, good: bool) -> str:
    """A sentence of ``methods.toml`` with its numbers.

    Raises
    ------
    ValueError
        If the run does not bear it out.
    """
    where = {key: words[key] for key in ("metric", "window", "band") if key in words}
    value = own.figure(words["quantity"], **where)
    is_share = where.get("metric", "rms").startswith("coverage")
    shown = partial(lambda v: f"{100.0 * v:.0f} %" if is_share else number(v, unit_of(words["quantity"])))
    against, told = words.get("limit"), {"own": shown(value)}
    if "than" in words:
        against = others[words["than"]].figure(words.get("their", words["quantity"]), **where)
        told["other"] = shown(against)
    better = value > against if is_share else value < against
    if better is not good:
        raise ValueError(f"methods.toml, {own.method}: not borne out by the ride: {words['says']} {told}")
    return str(words["says"]).format(**told)


def shape(own: Method, quantity: str, band: str) -> Sequence[Panel]:
    """Estimate beside truth, and below it the error with the interval that the method claims for it."""
    run, estimate = run_of(own.ride), own.estimate()
    x, error = own.error(quantity, band)
    if is_rails(quantity):
        nothing = replace(estimate, geometry=0.0 * estimate.geometry, geometry_draws=None)
        lies = rail_error_of(nothing, run.rails, quantity, BANDS.get(band))
        assert lies is not None
        true = -lies.to_numpy()
        sd = _rails_sd(estimate, quantity, band, x)
        words = f"{quantity.replace('_', ' ')}" + (f", {band}" if band in BANDS else "")
        spans = _curves(run, x)
    else:
        column = f"{quantity}_rad" if f"{quantity}_rad" in ATTITUDE else f"{quantity}_mps"
        scale = np.rad2deg(1.0) if column in ATTITUDE else 1.0
        if quantity == "position":
            column = ODOMETRY[0]
        true = scale * run.reference.motion[column].to_numpy()
        name = column.replace(quantity, f"{quantity}_sd")
        sd = scale * estimate.states[name].to_numpy() if name in estimate.states else None
        words, spans = quantity, _curves(run)
    bins = Bins(x, bins=POINTS)
    unit = unit_of(quantity)
    x_line, found = bins.line(true + error)
    bands: list[Band] = []
    if sd is not None:
        half = NORMAL_95 * bins.envelope(sd).mean
        middle = bins.envelope(true + error).mean
        bands = [
            Band(bins.x, middle - half, middle + half, "second"),
            Band(bins.x, -half, half, "second", name="95 % interval of the method"),
        ]
    beside = Panel(
        f"{words}, {unit}",
        [
            Line("true", *bins.line(true), "true", width=2.6),
            Line("estimated", x_line, found, "second", width=1.2),
        ],
        bands=bands[:1],
        spans=spans,
    )
    wrong = Panel(f"error, {unit}", [Line("", *bins.line(error), "ink")], bands=bands[1:], spans=spans)
    return [beside, wrong]


def _rails_sd(estimate: Estimate, quantity: str, band: str, x: FloatArray) -> FloatArray | None:
    """Standard deviation of the rails, mm: of all waves by itself, of a band by the draws."""
    geometry = estimate.geometry
    assert geometry is not None
    name = f"{quantity}_sd_m"
    if band in BANDS:
        if estimate.geometry_draws is None:
            return None
        at = IRREGULARITY.index(f"{quantity}_m")
        place = geometry.index.to_numpy()
        lines = 1e3 * estimate.geometry_draws[:, :, at]
        inside = band_pass(lines, BANDS[band].edges_m(quantity), step_m=place[1] - place[0])
        return np.interp(x, place, sd_of_draws(inside))
    if name not in geometry:
        return None
    return np.interp(x, geometry.index.to_numpy(), 1e3 * geometry[name].to_numpy())


def _curves(run: Run, places: FloatArray | None = None) -> list[tuple[float, float]]:
    """Where, or when, the train is in the full curves."""
    at = run.reference.motion["position_m"].to_numpy() if places is None else places
    x = run.time_s if places is None else places
    inside = run.rails.design.kind(at) == CURVE
    edges = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
    return [(float(x[a]), float(x[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def beside(own: Method, others: Sequence[Method], quantity: str, band: str) -> Sequence[Panel]:
    """Errors of a method and of what it is compared with, on one scale."""
    lines = []
    for method, colour in zip((own, *others), ("second", "first", "third", "fourth"), strict=False):
        x, error = method.error(quantity, band)
        if len(x):
            bins = Bins(x, bins=POINTS)
            lines.append(Line(method.label, *bins.line(error), colour, width=1.5 if method is own else 1.2))
    run = run_of(own.ride)
    spans = _curves(run, own.error(quantity, band)[0]) if is_rails(quantity) else _curves(run)
    return [Panel(f"error, {unit_of(quantity)}", lines, spans=spans)]


def svg(name: str, panels: Sequence[Panel], *, quantity: str, description: str, tall_in: float) -> str:
    """Panels as inline SVG, for a desk and for a phone."""
    axis = "place along the line, m" if is_rails(quantity) else "time, s"

    def make() -> str:
        return svg_of(panels, x_label=axis, description=description, tall_in=tall_in)

    return str(drawn(name, make, widths_in=WIDTHS_IN))


SCORED = ("roll", "pitch", "yaw", "position", "speed")
RAILS_SCORED = (("vertical_profile", "D1"), ("alignment", "D1"), ("cross_level", "D1"))


def scores_of(own: Method, others: Sequence[Method]) -> str:
    """Its figures beside those of the others, as a table in Markdown."""
    names = ["it", *(other.label for other in others)]
    lines = [
        "| rms of the error | " + " | ".join(names) + " | it, in the curve | its 95 % holds |",
        "|:--|" + "--:|" * (len(names) + 2),
    ]
    for quantity, band in (*((name, "full") for name in SCORED), *RAILS_SCORED):
        values = [method.figure(quantity, band=band) for method in (own, *others)]
        if not np.isfinite(values[0]):
            continue
        held = own.figure(quantity, "coverage95", band=band)
        words = (
            quantity.replace("_", " ") + ("" if band == "full" else f" in {band}") + f", {unit_of(quantity)}"
        )
        curve = own.figure(quantity, window="curve", band=band)
        share = f"{100.0 * held:.0f} %" if np.isfinite(held) else NONE
        lines.append(f"| {words} | " + " | ".join(map(number, values)) + f" | {number(curve)} | {share} |")
    return "\n".join(lines)


def made(name: str, case: Mapping[str, Any]) -> dict[str, Any]:
    """What the page of a method shows."""
    ride, quantity, band = case.get("ride", "curve"), case["shows"], case.get("band", "full")

    def method(label: str, told: Mapping[str, Any]) -> Method:
        return Method(
            label, told.get("method", name), tuple(told.get("options", {}).items()), told.get("ride", ride)
        )

    own = method(case.get("label", name), case)
    others = {one["label"]: method(one["label"], one) for one in case.get("beside", [])}
    states = own.estimate().states
    geometry = own.estimate().geometry
    second = case.get("compares", quantity)
    return {
        "ride": WORDS[ride],
        "options": dict(case.get("options", {})),
        "columns": list(states),
        "rails": [] if geometry is None else [c for c in geometry if geometry[c].notna().any()],
        "shape": svg(
            f"{name}-shape",
            shape(own, quantity, band),
            quantity=quantity,
            description=f"{name}: {quantity} estimated and true, and the error with its interval",
            tall_in=1.45,
        ),
        "beside": svg(
            f"{name}-beside",
            beside(own, list(others.values()), second, band),
            quantity=second,
            description=f"{name}: error of {second}, beside others",
            tall_in=2.0,
        )
        if others
        else "",
        "quantity": quantity.replace("_", " "),
        "compares": second.replace("_", " "),
        "has_interval": f"{quantity}_sd" in " ".join([*states, *([] if geometry is None else geometry)]),
        "scores": scores_of(own, list(others.values())),
        "good": [said(words, own, others, good=True) for words in case.get("good", [])],
        "bad": [said(words, own, others, good=False) for words in case.get("bad", [])],
    }


def shown(here: Path) -> dict[str, dict[str, Any]]:
    """What all pages show, from the store where no source has changed."""
    told = (here / "methods.toml").read_bytes()
    code = Path(__file__).read_bytes() + score_code_hash().encode() + source_hash("report/figures").encode()
    store = here / "_figures"
    pages = {}
    for name, case in tomllib.loads(told.decode()).items():
        key = hashlib.sha256(code + json.dumps(case, sort_keys=True).encode()).hexdigest()[:16]
        file = store / f"{name}-{key}.json"
        if not file.is_file():
            page = made(name, case)
            store.mkdir(exist_ok=True)
            for old in store.glob(f"{name}-*.json"):
                old.unlink()
            file.write_text(json.dumps(page))
        pages[name] = json.loads(file.read_text())
    return pages
