"""The terms that the paper neglects (its section 8), on our rides, beside its own figures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.core.jit import FloatArray
from simrail.report.papers.briales_2021.printed import PRINTED_TERMS, TERMS_RIDE
from simrail.report.papers.briales_2021.rides import is_fast
from simrail.report.tables.tables import Cell, Row, Table
from simrail.ride.relative_motion import acceleration_terms, below

SLOW_PART_HZ = 0.5
"""What of the relative acceleration lies below it disturbs a filter that averages over a second or more."""

FIRST_LIMIT, OTHERS_LIMIT = 0.1, 0.01
"""Shares of the track's acceleration below which the first hypothesis, and the others, hold."""

ROUNDING_MPS2 = 1e-12
"""Below it a term is zero, which the relative acceleration along the track is by definition."""


def _sd(signal: FloatArray) -> FloatArray:
    """Standard deviation of x, y, z, and of the vector as a whole: (n, 3) to (4,)."""
    variance = signal.var(axis=0)
    return np.sqrt(np.append(variance, variance.sum()))


def terms_table(examples: Sequence[CellResult]) -> tuple[Table, str]:
    """The terms of section 8: in each direction on the paper's ride, as a whole on the fast ones; a text."""
    rows_of = {
        "relative acceleration r\u2033": ("relative", "relative"),
        f"the same below {SLOW_PART_HZ:g} Hz": ("", "slow"),
        "Coriolis 2 \u03c9 \u00d7 r\u2032": ("coriolis", "coriolis"),
        "(\u03b1 + \u03c9\u03c9) r, r from the track to the IMU": ("", "angular"),
        "(\u03b1 + \u03c9\u03c9) r, r less the IMU's nominal place": ("angular", "deviation"),
        "track acceleration R\u2033": ("track", "track"),
    }
    found: dict[str, dict[str, FloatArray]] = {}
    for example in examples:
        recording = example.recording
        parts = acceleration_terms(
            example.motion,
            recording.track,
            nominal_m=recording.mount_position_m,
            gravity_mps2=recording.gravity_mps2,
        )
        slow = below(parts.relative, frequency_hz=SLOW_PART_HZ, rate_hz=recording.imu_sheet.rate_hz)
        found[recording.name] = {
            "relative": _sd(parts.relative),
            "slow": _sd(slow),
            "coriolis": _sd(parts.coriolis),
            "angular": _sd(parts.angular),
            "deviation": _sd(parts.angular_of_deviation),
            "track": _sd(parts.track),
        }
    main = TERMS_RIDE if TERMS_RIDE in found else next(iter(found), "")
    others = [e.recording.name for e in examples if is_fast(e.cell) and e.recording.name != main]
    rows = []
    for label, (printed, key) in rows_of.items():
        cells = [_size(PRINTED_TERMS[printed]) if printed else Cell("\u2013", mark="none")]
        if main:
            cells += [_size(value) for value in found[main][key]]
        cells += [_size(found[name][key][3]) for name in others]
        rows.append(Row(label, "", "", cells))
    groups = [("printed", 1), (f"ours, {main}", 4)] + [("ours, vector", len(others))] * bool(others)
    table = Table(groups, [TERMS_RIDE, "x", "y", "z", "vector", *others], rows)
    return table, _terms_text(found.get(main, {}))


def _size(value: float) -> Cell:
    if value < ROUNDING_MPS2:
        return Cell("0")
    exponent = int(np.floor(np.log10(value)))
    if exponent >= -3:
        return Cell(f"{value:.{2 - exponent if exponent < 2 else 0}f}")
    superscript = str(exponent).translate(
        str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")
    )
    return Cell(f"{value / 10.0**exponent:.2f}\u00b710{superscript}")


def _terms_text(sizes: dict[str, FloatArray]) -> str:
    if not sizes:
        return ""
    share = {key: sizes[key][3] / sizes["track"][3] for key in ("relative", "slow", "coriolis", "angular")}
    small = [key for key in ("coriolis", "angular") if share[key] < OTHERS_LIMIT]
    text = (
        "As a share of the track's acceleration on this ride: relative acceleration "
        f"{100 * share['relative']:.0f} % (the paper: "
        f"{100 * PRINTED_TERMS['relative'] / PRINTED_TERMS['track']:.0f} %), its part below "
        f"{SLOW_PART_HZ:g} Hz {100 * share['slow']:.1f} %, Coriolis {100 * share['coriolis']:.2g} %, "
        f"angular terms {100 * share['angular']:.2g} %. "
    )
    text += (
        f"The second and third hypotheses hold (each below {100 * OTHERS_LIMIT:g} %). "
        if len(small) == 2
        else f"Not below {100 * OTHERS_LIMIT:g} %: "
        + ", ".join(k for k in ("coriolis", "angular") if k not in small)
        + ". "
    )
    printed = PRINTED_TERMS["relative"] / PRINTED_TERMS["track"]
    moves = share["relative"] > FIRST_LIMIT
    text += (
        "The first, that the body does not accelerate in the track frame, "
        f"{'does not hold' if moves else 'holds'} (limit {100 * FIRST_LIMIT:g} %)"
    )
    text += ", as in the paper" if moves == (printed > FIRST_LIMIT) else ", unlike in the paper"
    if moves:
        less = share["relative"] / max(share["slow"], 1e-12)
        text += f"; but what of it is slow enough to pass a filter is {less:.0f} times smaller"
    text += "."
    ratio = sizes["angular"][3] / PRINTED_TERMS["angular"]
    return text + (
        f" The printed angular term is {ratio:.0f} times below ours with r = the IMU's place; with r as "
        "the small displacement that the paper integrates, ours is "
        f"{sizes['deviation'][3] / PRINTED_TERMS['angular']:.1f} times it."
    )
