"""Tables of a recorded ride, for the terminal and the page alike: rails, limits, methods beside each other.

Rows of text, of which the first cell says what a row is of. There is no truth beside a recording; what is
compared with is another method, or a reference that somebody measured.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from simrail.core.columns import ATTITUDE
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.report.tables.geometry import QUANTITIES, band_words
from simrail.scoring.score import wrap
from simrail.track.bands import BANDS
from simrail.track.rail_limits import OPEN_CHANCE, TWIST, UNFILTERED, RailLimits, RailLine

NO_DRAWS = "the method has no draws of its error (on an axle or a frame, [vehicle_sheet] makes them possible)"

LIKELY, UNLIKELY = 0.95, 0.5
"""Chances from which on an exceedance is called sure, and below which it may be none."""

DIFFERENCES = (
    "method",
    "beside",
    "quantity",
    "band",
    "unit",
    "rms",
    "greatest",
    "joint_sd",
    "within_95",
    "samples",
)
"""Columns of `differences`."""


@dataclass(frozen=True)
class MethodResult:
    """What one method concluded from a recording, as terminal and page speak of it.

    Attributes
    ----------
    name, label : str
        Name in tables and files, and what a reader calls it.
    method : str
        The method with all its options.
    recording : Recording
        The ride, with the odometry that places what this method says.
    estimate : Estimate
        What it concluded.
    lines : tuple of RailLine
        Its rails in bands.
    seconds : float
        Time that it took, with what had to be compiled.
    cites : tuple of str
        Where its equations come from.
    """

    name: str
    label: str
    method: str
    recording: Recording
    estimate: Estimate
    lines: tuple[RailLine, ...]
    seconds: float
    cites: tuple[str, ...] = ()


@dataclass(frozen=True)
class TextTable:
    """Rows of text under a line of names."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def rail_words(quantity: str, band: str) -> str:
    """A quantity in a band: ``"vertical profile D1"``."""
    words = QUANTITIES.get(quantity, quantity)
    return words if quantity == TWIST else f"{words} {'unfiltered' if band == UNFILTERED else band}"


def millimetres(value: float, decimals: int = 2) -> str:
    """A length in mm; a dash where there is none."""
    if not math.isfinite(value):
        return "\u2013"
    return f"{round(1e3 * value, decimals) + 0.0:.{decimals}f}".replace("-", "\u2212")


def chance_words(chance: float) -> str:
    """A chance in per cent; a dash where it is not known."""
    if not math.isfinite(chance):
        return "\u2013"
    return "> 99 %" if chance > 0.99 else "< 1 %" if chance < 0.01 else f"{100.0 * chance:.0f} %"


def rails_table(summary: pd.DataFrame) -> TextTable:
    """The rails of one method over the whole ride, a row for each quantity and band that can be judged."""
    rows = []
    for row in summary.to_dict("records"):
        if row["band"] == UNFILTERED and row["quantity"] != TWIST and math.isnan(row["limit_m"]):
            continue  # of what no filter has cut the longest waves decide, which nobody has set a limit to
        limit, beyond = row["limit_m"], row["exceedances"]
        rows.append(
            (
                rail_words(row["quantity"], row["band"]),
                millimetres(row["sd_m"]),
                millimetres(row["error_sd_m"]),
                millimetres(row["peak_m"]),
                f"{row['peak_position_m']:.0f}",
                millimetres(row["worst_sd_m"]),
                "\u2013" if math.isnan(row["worst_start_m"]) else f"{row['worst_start_m']:.0f}",
                "\u2013" if math.isnan(limit) else f"{1e3 * limit:g}",
                "\u2013" if math.isnan(limit) else str(beyond),
                "\u2013" if math.isnan(row["open_m"]) else f"{row['open_m']:.0f}",
            )
        )
    heads = ("rails, mm", "sd", "own error", "largest", "at, m", "worst section", "from, m", "limit")
    return TextTable((*heads, "beyond", "open, m"), tuple(rows))


def exceedance_table(exceedances: pd.DataFrame, *, most: int = 25) -> TextTable:
    """Places beyond a limit, the surest and largest first."""
    by = exceedances.assign(
        over=exceedances["peak_m"].abs() / exceedances["limit_m"], sure=exceedances["chance"].fillna(-1.0)
    )
    by = by.sort_values(["sure", "over"], ascending=False).head(most)
    rows = [
        (
            rail_words(row["quantity"], row["band"]),
            f"{row['start_m']:.1f} to {row['end_m']:.1f}",
            millimetres(row["peak_m"]),
            millimetres(row["sd_m"]),
            f"{1e3 * row['limit_m']:g}",
            chance_words(row["chance"]),
        )
        for row in by.to_dict("records")
    ]
    heads = ("rails, mm", "s, m", "largest", "its sd", "limit", "chance of that")
    return TextTable(heads, tuple(rows))


def exceedance_words(exceedances: pd.DataFrame, limits: RailLimits, lines: Sequence[RailLine] = ()) -> str:
    """How many places lie beyond the limits, and how sure that is, in a line; `lines` are those judged."""
    whose = "the example limits (set your own in [limits])" if limits.is_example else "the limits"
    if not len(exceedances):
        judged = [line for line in lines if (line.quantity, line.band) in limits.peaks]
        unsure = bool(judged) and all(line.sd is None for line in judged)
        more = f"; how sure that is, is not known: {NO_DRAWS}" if unsure else ""
        return f"the rails as found lie within {whose}{more}"
    count, chance = len(exceedances), exceedances["chance"]
    places = f"{count} place{'s' if count > 1 else ''}"
    if chance.isna().all():
        return f"{places} beyond {whose}; how sure that is, is not known: {NO_DRAWS}"
    sure, maybe = int((chance >= LIKELY).sum()), int((chance < UNLIKELY).sum())
    return (
        f"{places} beyond {whose}: {sure} surely ({100 * LIKELY:.0f} % and more, by the method's own sd), "
        f"{maybe} with a chance below {100 * UNLIKELY:.0f} %"
    )


def sections_table(sections: pd.DataFrame) -> TextTable:
    """Standard deviation and largest distance from the mean of each section, by quantity and band, mm."""
    lines = [
        pair
        for pair in dict.fromkeys(zip(sections["quantity"], sections["band"], strict=True))
        if pair[1] != UNFILTERED or pair[0] == TWIST
    ]
    by_place = {(row["start_m"], row["quantity"], row["band"]): row for row in sections.to_dict("records")}
    rows = []
    for start, end in dict.fromkeys(zip(sections["start_m"], sections["end_m"], strict=True)):
        cells = []
        for pair in lines:
            row = by_place.get((start, *pair))
            if row is None:
                cells.append("\u2013")
                continue
            mark = " \u25be" if row["sd_exceeded"] or row["defects"] else ""
            cells.append(f"{millimetres(row['sd_m'])} / {millimetres(row['peak_m'])}{mark}")
        if any(cell != "\u2013" for cell in cells):
            rows.append((f"{start:.0f} to {end:.0f} m", *cells))
    return TextTable(("section", *(rail_words(*pair) for pair in lines)), tuple(rows))


def differences(results: Sequence[MethodResult]) -> pd.DataFrame:
    """What methods say differently from the first, over the whole ride.

    Returns
    -------
    pandas.DataFrame
        Columns `DIFFERENCES`: root mean square and greatest size of the difference; ``joint_sd``, the root of
        the mean of both variances where both methods have one, and ``within_95``, the share of the samples
        that differ by less than 1.96 of it. Methods on one recording share its errors: where each is
        honest they differ by less than that, and a share well below 0.95 says that one of them is not.
    """
    rows: list[tuple[object, ...]] = []
    first = results[0]
    for other in results[1:]:
        names = (other.name, first.name)
        for column, unit, scale in (
            *((name, "deg", 180.0 / math.pi) for name in ATTITUDE),
            ("position_m", "m", 1.0),
            ("speed_mps", "m/s", 1.0),
        ):
            pair = [_states(one, column) for one in (other, first)]
            if pair[0] is None or pair[1] is None:
                continue
            difference = pair[0][0] - pair[1][0]
            difference = wrap(difference) if column in ATTITUDE else difference
            quantity = column.rpartition("_")[0]
            rows.append(
                (*names, quantity, UNFILTERED, unit, *_compared(scale, difference, pair[0][1], pair[1][1]))
            )
        by_line = {(line.quantity, line.band): line for line in first.lines}
        for line in other.lines:
            same = by_line.get((line.quantity, line.band))
            if same is None:
                continue
            value = np.interp(line.place, same.place, same.value, left=np.nan, right=np.nan)
            sd = None
            if same.sd is not None:
                sd = np.interp(line.place, same.place, same.sd, left=np.nan, right=np.nan)
            compared = _compared(1e3, line.value - value, line.sd, sd)
            rows.append((*names, line.quantity, line.band, "mm", *compared))
    return pd.DataFrame(rows, columns=list(DIFFERENCES))


def _states(result: MethodResult, column: str) -> tuple[FloatArray, FloatArray | None] | None:
    states = result.estimate.states
    if column not in states.columns:
        return None
    quantity, _, unit = column.rpartition("_")
    sd = f"{quantity}_sd_{unit}"
    values = states[column].to_numpy(dtype=np.float64)
    return values, states[sd].to_numpy(dtype=np.float64) if sd in states.columns else None


def _compared(
    scale: float, difference: FloatArray, one: FloatArray | None, other: FloatArray | None
) -> tuple[float, float, float, float, int]:
    """Rms, greatest size, joint sd, share within 1.96 of it, and how many samples."""
    known = np.isfinite(difference)
    away = difference[known]
    if not len(away):
        return math.nan, math.nan, math.nan, math.nan, 0
    rms, greatest = float(np.sqrt(np.mean(away**2))), float(np.abs(away).max())
    joint = within = math.nan
    if one is not None and other is not None:
        variance = one[known] ** 2 + other[known] ** 2
        joint = scale * float(np.sqrt(np.nanmean(variance)))
        within = float(np.mean(np.abs(away) <= 1.96 * np.sqrt(variance)))
    return scale * rms, scale * greatest, joint, within, len(away)


def difference_table(table: pd.DataFrame) -> TextTable:
    """`differences` in words."""
    rows = []
    for row in table.to_dict("records"):
        of_rails = row["unit"] == "mm"
        unfiltered = of_rails and row["band"] == UNFILTERED and row["quantity"] != TWIST
        if row["samples"] == 0 or unfiltered:
            continue
        what = rail_words(row["quantity"], row["band"]) if of_rails else row["quantity"]
        decimals = 2 if of_rails else 3
        figures = [
            "\u2013" if math.isnan(row[name]) else f"{row[name]:.{decimals}f}"
            for name in ("rms", "greatest", "joint_sd")
        ]
        share = "\u2013" if math.isnan(row["within_95"]) else f"{100.0 * row['within_95']:.0f} %"
        rows.append((f"{row['method']}: {what}, {row['unit']}", *figures, share))
    beside = table["beside"].iloc[0] if len(table) else ""
    return TextTable((f"less {beside}", "rms", "greatest", "joint sd", "within 95 %"), tuple(rows))


def reference_table(scores: pd.DataFrame) -> TextTable:
    """Scores against a reference over the whole ride, a row for each method and quantity."""
    rows = []
    chosen = scores[(scores["window"].astype(str) == "whole") & (scores["status"].astype(str) == "ok")]
    for key, group in chosen.groupby(["estimator", "quantity", "band", "unit"], observed=True, sort=False):
        figure_of = {
            str(metric): value for metric, value in zip(group["metric"], group["value"], strict=True)
        }
        method, quantity, band, _ = map(str, key)
        if "rms" not in figure_of:
            continue
        unit = str(group.loc[group["metric"].astype(str) == "rms", "unit"].iloc[0])
        what = rail_words(quantity, band) if unit == "mm" else quantity.replace("_", " ")
        decimals = 2 if unit == "mm" else 3
        figures = [
            f"{figure_of[name]:.{decimals}f}".replace("-", "\u2212") if name in figure_of else "\u2013"
            for name in ("rms", "mean", "max")
        ]
        count = int(group["n_samples"].iloc[0])
        rows.append(
            (f"{method}: {what}, {unit}", *figures, _share(chosen, method, quantity, band), f"{count}")
        )
    heads = ("less the reference", "rms", "mean", "greatest", "inside 95 %", "samples")
    return TextTable(heads, tuple(rows))


def _share(scores: pd.DataFrame, method: str, quantity: str, band: str) -> str:
    found = scores[
        (scores["estimator"].astype(str) == method)
        & (scores["quantity"].astype(str) == quantity)
        & (scores["band"].astype(str) == band)
        & (scores["metric"].astype(str) == "coverage95")
    ]
    return f"{100.0 * float(found['value'].iloc[0]):.0f} %" if len(found) else "\u2013"


def beside_each_other(results: Sequence[MethodResult]) -> TextTable:
    """What each method gives, a row for each: states, the mean of its own sd, rails, time."""
    rows = []
    for result in results:
        states = result.estimate.states
        cells = []
        for column, scale, decimals in (
            ("roll_sd_rad", 180.0 / math.pi, 3),
            ("pitch_sd_rad", 180.0 / math.pi, 3),
            ("yaw_sd_rad", 180.0 / math.pi, 3),
            ("position_sd_m", 1.0, 2),
        ):
            known = column.replace("_sd", "") in states.columns
            value = (
                scale * float(np.sqrt(np.mean(states[column] ** 2))) if column in states.columns else math.nan
            )
            cells.append(f"{value:.{decimals}f}" if math.isfinite(value) else "no sd" if known else "\u2013")
        has_rails = "yes" if result.lines else "\u2013"
        rows.append((f"{result.name} ({result.label})", *cells, has_rails, f"{result.seconds:.1f}"))
    heads = ("method, its own sd", "roll, \u00b0", "pitch, \u00b0", "yaw, \u00b0", "position, m", "rails")
    return TextTable((*heads, "time, s"), tuple(rows))


OPEN_WORDS = (
    "own error: the method's own sd; worst section: the largest sd of one; open: metres below the limit that "
    f"are beyond it with a chance above {100 * OPEN_CHANCE:.0f} %"
)

BAND_WORDS = "bands of wavelengths: " + ", ".join(map(band_words, BANDS))


def rails_over_distance(lines: Sequence[RailLine]) -> pd.DataFrame:
    """All lines of one method over its places: a column for each quantity and band, and for its sd, m."""
    columns: dict[str, FloatArray] = {}
    for line in lines:
        stem = line.quantity if line.band == UNFILTERED else f"{line.quantity}_{line.band}"
        columns[f"{stem}_m"] = line.value
        if line.sd is not None:
            columns[f"{stem}_sd_m"] = line.sd
    return pd.DataFrame(columns, index=pd.Index(lines[0].place, name="position_m"))
