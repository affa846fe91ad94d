"""What a fit to a rest says, as the text of an IMU file and as lines for a person."""

import json
import math
from collections.abc import Iterator, Mapping

from simrail.recording.sheets.figures import FIGURES
from simrail.recording.sheets.rest_fit import TERMS, Fitted, TriadFit

ALIKE = 1.05
"""Noise of axes within this ratio is given as one figure."""

_KEYS = {
    ("gyro", "noise"): "gyro_noise_degpsqrthz",
    ("gyro", "bias_instability"): "gyro_bias_instability_degph",
    ("gyro", "random_walk"): "gyro_random_walk_degphpsqrth",
    ("accel", "noise"): "accel_noise_ugpsqrthz",
    ("accel", "bias_instability"): "accel_bias_instability_ug",
    ("accel", "random_walk"): "accel_random_walk_mgpsqrth",
}
_COUNTS = {"gyro": "gyro_resolution_degps", "accel": "accel_resolution_mg"}
_WORDS = {
    "noise": "noise N",
    "bias_instability": "bias instability B",
    "random_walk": "random walk K",
    "quantisation": "quantisation Q",
}
_NAMES = {"gyro": "gyro", "accel": "accelerometer"}
_Q_UNITS = {"gyro": (math.pi / 180.0 / 3600.0, "arcsec"), "accel": (1e-6, "um/s")}


def fitted_lines(fits: Mapping[str, TriadFit], seconds: float) -> Iterator[str]:
    """Every coefficient of every axis with its 95 % interval, and what the recording is too short to show."""
    for kind, fit in fits.items():
        for term in TERMS:
            si, unit = _unit(kind, term)
            axes = ", ".join(
                f"{axis} {_shown(one[term], si)}" for axis, one in zip("xyz", fit.axes, strict=True)
            )
            if any(one[term].seen for one in fit.axes) or term != "quantisation":
                yield f"{_NAMES[kind]} {_WORDS[term]}: {axes} {unit}"
        if fit.correlation_s is not None:
            yield f"{_NAMES[kind]} bias wanders with a correlation time of {fit.correlation_s:.3g} s"
    for sentence in not_shown(fits, seconds):
        yield f"not shown: {sentence}"


def not_shown(fits: Mapping[str, TriadFit], seconds: float) -> list[str]:
    """What the length of a recording cannot show, a sentence each."""
    longest = max(fit.flat_s[1] for fit in fits.values())
    told = [
        f"{seconds:.4g} s show averaging times up to {longest:.3g} s; what is slower is not known.",
        "Turn-on bias, scale factor, misalignment and temperature do not show at rest: take them from the "
        "sheet.",
    ]
    for kind, fit in fits.items():
        for term in ("noise", "bias_instability", "random_walk"):
            if not any(axis[term].seen for axis in fit.axes):
                si, unit = _unit(kind, term)
                bound = max(axis[term].high for axis in fit.axes) / si
                told.append(f"No {_WORDS[term]} of the {_NAMES[kind]} is seen: below {bound:.3g} {unit}.")
    return told


def sheet_text(
    fits: Mapping[str, TriadFit], *, title: str, source: str, rate_hz: float, seconds: float
) -> str:
    """Text of an IMU file with what was found; what was not seen is left out and said."""
    gyro, accel = fits["gyro"], fits["accel"]
    searched = [fit for fit in (gyro, accel) if fit.correlation_s is not None]
    counted = any(axis["quantisation"].seen for fit in fits.values() for axis in fit.axes)
    lines = [
        f"title = {json.dumps(title, ensure_ascii=False)}",
        f"source = {json.dumps(source, ensure_ascii=False)}",
        f"assumed = {json.dumps(' '.join(not_shown(fits, seconds)), ensure_ascii=False)}",
        f"rate_hz = {_number(rate_hz)}",
    ]
    if searched:
        lines.append('bias_process = "gauss_markov"')
    elif any(axis["bias_instability"].seen for fit in fits.values() for axis in fit.axes):
        low = max(1.0, 10.0 / rate_hz)
        longest = max(gyro.flat_s[1], accel.flat_s[1], 10.0 * low)
        lines += ['bias_process = "flicker"', f"flicker_range_s = [{_number(low)}, {_number(longest)}]"]
    if counted:
        lines.append('output = "increments"')
    for kind, fit in fits.items():
        lines += ["", *_triad_lines(kind, fit, rate_hz, counted=counted)]
    return "\n".join(lines) + "\n"


def _triad_lines(kind: str, fit: TriadFit, rate_hz: float, *, counted: bool) -> Iterator[str]:
    for term in ("noise", "bias_instability", "random_walk"):
        key = _KEYS[kind, term]
        si = FIGURES[key].si
        shown = ", ".join(_shown(axis[term], si) for axis in fit.axes)
        yield f"# {_WORDS[term]} of x, y, z with 95 % intervals: {shown} {FIGURES[key].unit}"
        values = [axis[term].value / si for axis in fit.axes]
        if term == "noise" and max(values) > ALIKE * min(values):
            yield f"{key} = [{', '.join(_number(value) for value in values)}]"
        elif any(values):
            yield f"{key} = {_number(fit.mean(term) / si)}"
    if fit.correlation_s is not None:
        yield f"{kind}_bias_correlation_s = {_number(fit.correlation_s)}"
    key = _COUNTS[kind]
    step = fit.count
    if counted and fit.mean("quantisation") > 0.0:
        # A count q of an angle is Q = q / sqrt(12), and as a rate q times the rate of the samples.
        step = math.sqrt(12.0) * fit.mean("quantisation") * rate_hz
    if step > 0.0:
        yield f"{key} = {_number(step / FIGURES[key].si)}"


def _unit(kind: str, term: str) -> tuple[float, str]:
    if term == "quantisation":
        return _Q_UNITS[kind]
    figure = FIGURES[_KEYS[kind, term]]
    return figure.si, figure.unit


def _shown(one: Fitted, si: float) -> str:
    if not one.seen:
        return f"below {one.high / si:.3g}"
    return f"{one.value / si:.4g} ({one.low / si:.4g} to {one.high / si:.4g})"


def _number(value: float) -> str:
    text = f"{value:.5g}"
    return text if set(text) & set(".en") else f"{text}.0"
