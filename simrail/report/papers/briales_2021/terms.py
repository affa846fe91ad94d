"""The terms that the paper neglects (its section 8), on our rides, beside its own figures."""

from collections.abc import Mapping, Sequence

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.core.jit import FloatArray
from simrail.report.papers.briales_2021.rides import PAPER, is_fast
from simrail.report.tables.tables import NONE, Cell, Row, Table
from simrail.ride.relative_motion import acceleration_terms, below

TERMS_RIDE = "go20A"
"""The ride that the printed terms speak of."""

SLOW_PART_HZ = 0.5
"""What of the relative acceleration lies below it disturbs a filter that averages over a second or more."""

ROUNDING_MPS2 = 1e-12
"""Below it a term is zero, which the relative acceleration along the track is by definition."""

_ROWS = (
    ("relative acceleration r\u2033", "relative", "relative"),
    (f"the same below {SLOW_PART_HZ:g} Hz", "", "slow"),
    ("Coriolis 2 \u03c9 \u00d7 r\u2032", "coriolis", "coriolis"),
    ("(\u03b1 + \u03c9\u03c9) r, r from the track to the IMU", "", "angular"),
    ("(\u03b1 + \u03c9\u03c9) r, r less the IMU's nominal place", "angular", "deviation"),
    ("track acceleration R\u2033", "track", "track"),
)
"""Label of a row, its printed figure, and ours."""


def _sizes(example: CellResult) -> dict[str, FloatArray]:
    """Standard deviation over a ride of each term: in x, y and z, and of the vector as a whole (4,), m/s2."""
    recording = example.recording
    terms = acceleration_terms(
        example.motion,
        example.line,
        nominal_m=recording.mount_position_m,
        gravity_mps2=recording.gravity_mps2,
    )
    rate_hz = recording.imu_sheet.rate_hz
    signals = {
        "relative": terms.relative,
        "slow": below(terms.relative, frequency_hz=SLOW_PART_HZ, rate_hz=rate_hz),
        "coriolis": terms.coriolis,
        "angular": terms.angular,
        "deviation": terms.angular_of_deviation,
        "track": terms.track,
    }
    variances = {name: signal.var(axis=0) for name, signal in signals.items()}
    return {name: np.sqrt(np.append(variance, variance.sum())) for name, variance in variances.items()}


def terms_table(examples: Sequence[CellResult]) -> tuple[Table, Mapping[str, float]]:
    """The terms of section 8: in each direction on the paper's ride, as a whole on the fast ones.

    Beside the table, the vectors of the paper's ride by term, m/s2; empty without a ride.
    """
    sizes = {example.recording.name: _sizes(example) for example in examples}
    main = TERMS_RIDE if TERMS_RIDE in sizes else next(iter(sizes), "")
    others = [e.recording.name for e in examples if is_fast(e.cell) and e.recording.name != main]
    rows = []
    for label, printed, term in _ROWS:
        cells = [_size(PAPER.figures[printed][0]) if printed else NONE]
        cells += [_size(value) for value in (sizes[main][term] if main else ())]
        cells += [_size(sizes[name][term][3]) for name in others]
        rows.append(Row(label, "", "", cells))
    groups = [("printed", 1), (f"ours, {main}", 4)] + [("ours, vector", len(others))] * bool(others)
    table = Table(groups, [TERMS_RIDE, "x", "y", "z", "vector", *others], rows)
    return table, {term: float(size[3]) for term, size in sizes.get(main, {}).items()}


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
