"""A line from a table of curvature, cant and gradient over distance, for `simrail.track.drawn`.

Columns are known by their names, whose unit stands in brackets or behind the last ``_``: a place,
``curvature [1/m]`` (or ``[1/km]``) or ``radius [m]`` (0 or empty where it is straight), and if there are any
``cant [mm]`` and ``gradient [permil]``. All change linearly from row to row; two rows at one place are a
step.

Rows that lie on a straight line make one piece; where two pieces meet between two rows, the joint is where
their lines cross: a clothoid that begins between two samples begins at its true place.
"""

from __future__ import annotations

import csv
import itertools
import re
from pathlib import Path

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.track.design import CantStation
from simrail.track.drawn import Drawn, Piece, Turn
from simrail.track.read_figures import missing_rows

_NAMES = {
    "position": ("s", "x", "position", "distance", "chainage", "station", "km", "mileage", "location"),
    "curvature": ("curvature", "curv", "k", "kappa"),
    "radius": ("radius", "r"),
    "cant": ("cant", "superelevation", "applied cant"),
    "cross_level": ("cross level", "crosslevel", "cross slope"),
    "gradient": ("gradient", "grade", "slope"),
}
_UNITS = {
    "position": {"m": 1.0, "km": 1000.0, "ft": 0.3048},
    "curvature": {"1/m": 1.0, "1pm": 1.0, "rad/m": 1.0, "1/km": 1e-3, "1pkm": 1e-3, "rad/km": 1e-3},
    "radius": {"m": 1.0, "ft": 0.3048},
    "cant": {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "in": 0.0254},
    "cross_level": {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "in": 0.0254},
    "gradient": {"permil": 1e-3, "‰": 1e-3, "mm/m": 1e-3, "%": 1e-2, "percent": 1e-2, "m/m": 1.0, "1": 1.0},
}
_TOLERANCE = {"curvature": 1e-10, "cant": 1e-7, "gradient": 1e-9}
"""How far a row may lie off the line through its neighbours, beside half of its last decimal."""


def read_curvature_csv(path: Path) -> Drawn:
    """A line of a table.

    Raises
    ------
    InputError
        If the table has no place or no curvature, or its places fall.
    """
    table, rounding, words = _table(path)
    s = table["position"]
    if len(s) < 2:
        raise InputError("has less than two rows", value=len(s), limit=">= 2 rows")
    fallen = np.flatnonzero(np.diff(s) < 0.0)
    if fallen.size:
        raise InputError(
            "places fall",
            field=f"row {int(fallen[0]) + 3}",
            value=float(s[fallen[0] + 1]),
            limit="places that rise or stay",
            remedy="sort the rows by place; a line against its chainage wants places of its own, and "
            "curvature and cant of the other sign",
        )
    drawn = Drawn(path.stem, f"table {path.name}", float(s[0]), [])
    drawn.notes.append(f"columns known by name: {words}")
    drawn.notes += missing_rows(s)
    if "curvature" in table:
        bend = table["curvature"]
    elif "radius" in table:
        radius = table["radius"]
        straight = (radius == 0.0) | ~np.isfinite(radius)
        bend = np.where(straight, 0.0, 1.0 / np.where(straight, 1.0, radius))
        rounding["curvature"] = 0.0
    else:
        raise InputError(
            "has no curvature that is known by its name",
            field="columns",
            limit="curvature [1/m], or radius [m]",
            remedy="a degree of curve D (of a chord of 100 ft) is a radius of 15.24 m / sin(D / 2)",
        )
    joints = _joints(s, bend, _TOLERANCE["curvature"] + rounding["curvature"])
    drawn.pieces = [Piece(b - a, k0, k1) for (a, k0), (b, k1) in itertools.pairwise(joints) if b > a]
    _add_cant(drawn, table, s, bend, rounding)
    if "gradient" in table:
        _add_gradients(drawn, _joints(s, table["gradient"], _TOLERANCE["gradient"] + rounding["gradient"]))
    return drawn


def _table(path: Path) -> tuple[dict[str, FloatArray], dict[str, float], str]:
    """Columns in SI, half of the last decimal of each, and words for what was taken for what."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot be read ({error})", limit="a text file in UTF-8") from None
    lines = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise InputError("is empty", limit="a line of column names, then >= 2 rows")
    mark = max(";\t,", key=lines[0].count)
    names, *rows = csv.reader(lines, delimiter=mark)
    table, rounding, words = {}, {}, []
    for i, name in enumerate(names):
        quantity, scale = _meaning(name)
        if quantity is None or quantity in table:
            continue
        cells = [row[i].strip() if i < len(row) else "" for row in rows]
        cells = [cell.replace(",", ".") if mark != "," else cell for cell in cells]
        table[quantity] = scale * np.array([_number(cell, k, name, quantity) for k, cell in enumerate(cells)])
        rounding[quantity] = 0.5 * scale * 10.0 ** -max(_decimals(cell) for cell in cells)
        words.append(f"{name.strip()} is {quantity.replace('_', ' ')}")
    if "position" not in table:
        raise InputError(
            "has no place that is known by its name",
            field="columns",
            value=", ".join(names)[:100],
            limit="e.g. s [m], curvature [1/m], cant [mm], gradient [permil]",
        )
    return table, rounding, ", ".join(words)


def _meaning(name: str) -> tuple[str | None, float]:
    """Quantity and unit of a column; a known name without a known unit is refused."""
    said = re.search(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$", name)
    words = (name[: said.start()] if said else name).strip().casefold()
    unit = said[1].casefold() if said else None
    if unit is None and "_" in words:
        words, unit = words.rsplit("_", 1)
    words = words.replace("_", " ").replace("-", " ").strip()
    for quantity, known in _NAMES.items():
        if words in known:
            unit = "km" if words == "km" and unit is None else unit
            if unit not in _UNITS[quantity]:
                raise InputError(
                    "has no unit that is known",
                    field=name.strip(),
                    value=unit,
                    limit="one of " + ", ".join(_UNITS[quantity]),
                    remedy=f"write it in brackets: {words} [{next(iter(_UNITS[quantity]))}]",
                )
            return quantity, _UNITS[quantity][unit]
    return None, 1.0


def _number(cell: str, row: int, name: str, quantity: str) -> float:
    if quantity == "radius" and cell.casefold() in ("", "inf", "straight"):
        return 0.0
    try:
        value = float(cell)
    except ValueError:
        value = np.nan
    if not np.isfinite(value) and quantity != "radius":
        station = re.fullmatch(r"(\d+)\+(\d{3}(?:\.\d*)?)", cell)
        raise InputError(
            "is no number",
            field=f"{name.strip()}, row {row + 2}",
            value=cell,
            limit="a finite number",
            remedy=f"write metres: {cell} is {1000 * int(station[1]) + float(station[2]):g}"
            if station
            else "",
        )
    return value


def _decimals(cell: str) -> int:
    """Decimals that a number was written with: 4 of 0.0012, 7 of 1.2e-6."""
    digits, _, power = cell.casefold().partition("e")
    return len(digits.partition(".")[2]) - (int(power) if power.lstrip("+-").isdigit() else 0)


def _joints(s: FloatArray, values: FloatArray, tolerance: float) -> list[tuple[float, float]]:
    """Corners (place, value) of the line through the rows; two at one place are a step."""
    found: list[tuple[float, float]] = []
    stops = [0, *(np.flatnonzero(np.diff(s) == 0.0) + 1), len(s)]
    for first, last in itertools.pairwise(stops):
        if last - first == 1:
            found.append((float(s[first]), float(values[first])))
        else:
            found += _corners(s[first:last], values[first:last], tolerance)
    return found


def _corners(s: FloatArray, values: FloatArray, tolerance: float) -> list[tuple[float, float]]:
    """Corners of a continuous line."""
    runs: list[tuple[int, int]] = []
    i = 0
    while i < len(s) - 1:
        # The longest run of rows on the line through its first two; doubled, then halved.
        j = _run(s, values, i, tolerance)
        runs.append((i, j))
        i = j
    lines = [_line(s[a : b + 1], values[a : b + 1]) for a, b in runs]
    kept = [
        k for k, (a, b) in enumerate(runs) if not (b - a == 1 and _crossing(k, runs, lines, s) is not None)
    ]
    corners = [(float(s[0]), float(values[0]))]
    for before, after in itertools.pairwise(kept):
        if after - before == 2:
            place = _crossing(before + 1, runs, lines, s)
            assert place is not None
            slope, level = lines[before]
            corners.append((place, float(slope * place + level)))
        else:
            corner = runs[after][0]
            corners.append((float(s[corner]), float(values[corner])))
    corners.append((float(s[-1]), float(values[-1])))
    return corners


def _run(s: FloatArray, values: FloatArray, i: int, tolerance: float) -> int:
    """Last row of the run that begins at row i: all rows between lie on the chord, within the tolerance."""

    def fits(j: int) -> bool:
        chord = values[i] + (values[j] - values[i]) * (s[i : j + 1] - s[i]) / (s[j] - s[i])
        return bool(np.all(np.abs(values[i : j + 1] - chord) <= 2.0 * tolerance))

    step = 1
    while i + 2 * step < len(s) and fits(i + 2 * step):
        step *= 2
    low, high = i + step, min(i + 2 * step, len(s) - 1)
    if fits(high):
        return high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def _line(s: FloatArray, values: FloatArray) -> tuple[float, float]:
    """Slope and level at s = 0 of the line through the first and the last row of a run."""
    slope = (values[-1] - values[0]) / (s[-1] - s[0])
    return float(slope), float(values[0] - slope * s[0])


def _crossing(
    k: int, runs: list[tuple[int, int]], lines: list[tuple[float, float]], s: FloatArray
) -> float | None:
    """Where the lines before and after a run of one interval cross, if in that interval; else None."""
    if not 0 < k < len(runs) - 1:
        return None
    if min(runs[k - 1][1] - runs[k - 1][0], runs[k + 1][1] - runs[k + 1][0]) < 2:
        return None
    (m0, c0), (m1, c1) = lines[k - 1], lines[k + 1]
    if m0 == m1:
        return None
    place = (c0 - c1) / (m1 - m0)
    low, high = s[runs[k][0]], s[runs[k][1]]
    return float(place) if low < place < high else None


def _add_cant(
    drawn: Drawn, table: dict[str, FloatArray], s: FloatArray, bend: FloatArray, rounding: dict[str, float]
) -> None:
    """Stations of cant, with the side that the table's signs mean."""
    if "cross_level" in table:
        level, digits = table["cross_level"], rounding["cross_level"]
        drawn.notes.append("cross level is taken positive with the left rail above the right one")
    elif "cant" in table:
        cant, digits = table["cant"], rounding["cant"]
        level = _level(drawn, s, cant, bend)
    else:
        drawn.notes.append("the table has no cant")
        return
    corners = _joints(s, level, _TOLERANCE["cant"] + digits)
    for at, value in corners:
        if drawn.cant and at <= drawn.cant[-1].at_m:
            if value != drawn.cant[-1].cross_slope_m:
                drawn.notes.append(f"cant steps at {at:.3f} m: the second value is laid 1 m behind")
                drawn.cant.append(CantStation(drawn.cant[-1].at_m + 1.0, value))
            continue
        drawn.cant.append(CantStation(at, value))


def _level(drawn: Drawn, s: FloatArray, cant: FloatArray, bend: FloatArray) -> FloatArray:
    """Height of the left above the right rail, of cant that is signed or that is that of the outer rail."""
    if (cant >= 0.0).all():
        drawn.notes.append("cant is never negative: it is taken to raise the outer rail")
        curved = np.flatnonzero(np.abs(bend) > 1e-8)
        if not curved.size:
            return -cant
        # On a straight the outer rail is that of the nearest curve.
        after = np.clip(np.searchsorted(s[curved], s), 1, len(curved) - 1) if len(curved) > 1 else 0 * s
        after = after.astype(np.int64)
        before = np.maximum(after - 1, 0)
        closer = np.abs(s - s[curved[before]]) <= np.abs(s - s[curved[after]])
        nearest = curved[np.where(closer, before, after)]
        return -np.sign(bend[nearest]) * cant
    together = float(np.sum(cant * bend))
    if together == 0.0:
        raise InputError(
            "has both signs, and the curvature does not say which rail they raise",
            field="cant",
            limit="cant whose side the curvature tells, or cross level",
            remedy="name the column 'cross level [mm]': the left rail above the right one",
        )
    drawn.notes.append(
        "cant has both signs, "
        + ("that of the curvature" if together > 0.0 else "the other one than the curvature")
        + " in curves: there it raises the outer rail"
    )
    return -cant if together > 0.0 else cant


def _add_gradients(drawn: Drawn, corners: list[tuple[float, float]]) -> None:
    """Slope at the start, and a change with a parabola for each stretch over which the gradient changes."""
    drawn.slope = corners[0][1]
    slope = drawn.slope
    for (a, g0), (b, g1) in itertools.pairwise(corners):
        if abs(g1 - g0) > 1e-9:
            drawn.turns.append(Turn(0.5 * (a + b), g1, b - a))
        slope = g1
    if slope == drawn.slope and not drawn.turns and not slope:
        drawn.notes.append("the line is level")
