"""The few numbers that a reader sees first."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from simrail.report.tables.geometry import (
    JUDGED,
    QUANTITIES,
    band_words,
    baseline_of,
    is_zero,
    judged_band,
    mappers,
    sd_of,
)
from simrail.report.tables.methods import MethodStyle, attitude_methods
from simrail.report.tables.pivot import Case
from simrail.report.words.sentences import degrees, significant
from simrail.scoring.table import FULL
from simrail.track.bands import BANDS, Band

WITHOUT_IMU = "design angles only"
"""Title of the roll error of a method that uses no IMU."""


class Tile(NamedTuple):
    """A number with its meaning above and its context below."""

    title: str
    value: str
    note: str


def tiles(case: Case, styles: Sequence[MethodStyle], *, known: Mapping[str, Band] = BANDS) -> list[Tile]:
    """Errors of the rails where they are scored, of roll, and of the odometry, beside what no IMU gives.

    Parameters
    ----------
    case, styles : Case, sequence of MethodStyle
        The case and the scenario's methods.
    known : mapping of str to Band
        Bands whose wavelengths are told.
    """
    rails = _rails(case, styles, known)
    roll = _roll(case, attitude_methods(styles))
    if rails and len(roll) > 1:
        # Beside rails the attitude is a side matter: one tile of it.
        first, *rest = roll
        without = [f"; no IMU: {tile.value}" for tile in rest if tile.title == WITHOUT_IMU]
        roll = [Tile(first.title, first.value, first.note + "".join(without[:1]))]
    return [*rails, *roll, *_odometry(case)]


def _rails(case: Case, styles: Sequence[MethodStyle], known: Mapping[str, Band]) -> list[Tile]:
    """Per quantity, the method that errs least in the band that the case is judged in, beside no IMU."""
    band, floor = judged_band(case), baseline_of(case, styles)
    tested = [style for style in mappers(case, styles) if not is_zero(style)]
    where = f"sd in {band_words(band, known)}" if band != FULL else "sd, unfiltered"
    result = []
    for quantity in JUDGED:
        sds = {style.label: sd_of(case, style, quantity, band=band) for style in tested}
        sds = {label: sd for label, sd in sds.items() if sd > 0.0}
        if sds:
            best = min(sds, key=lambda label: sds[label])
            note = f"{where}; best: {best}" if len(sds) > 1 else f"{where}, {best}"
            if floor:
                note += f"; no IMU: {significant(sd_of(case, floor, quantity, band=band))} mm"
            result.append(Tile(f"{QUANTITIES[quantity]} error", f"{significant(sds[best])} mm", note))
    return result


def _roll(case: Case, styles: Sequence[MethodStyle]) -> list[Tile]:
    """Roll error in curves of the best method, of its uncompensated twin, of the design angles."""
    in_curves = any(case.get(style.name, "roll", "rms", window="curve").draws for style in styles)
    window, where = ("curve", "in curves") if in_curves else ("whole", "over the whole ride")

    def roll(name: str) -> float:
        return case.get(name, "roll", "rms", window=window).value

    result = []
    tested = [style for style in styles if not style.baseline and roll(style.name) > 0.0]
    if tested:
        best = min(tested, key=lambda style: roll(style.name))
        note = f"rms, {best.label}" + (", the best method" if len(tested) > 1 else "")
        result.append(Tile(f"roll error {where}", degrees(roll(best.name)), note))
        if roll(best.twin) > 0.0:
            times = f"{roll(best.twin) / roll(best.name):.1f} times as much"
            result.append(Tile("the same, uncompensated", degrees(roll(best.twin)), times))
    for style in styles:
        if not style.uses_imu and roll(style.name) > 0.0:
            note = f"rms roll error {where} without any IMU"
            result.append(Tile(WITHOUT_IMU, degrees(roll(style.name)), note))
    return result


def _odometry(case: Case) -> list[Tile]:
    """Position error of every odometry that was scored."""
    result = []
    for name in case.estimators():
        error = case.get(name, "position", "rms")
        if name.startswith("odometry:") and error.draws:
            note = f"rms, odometry '{name.removeprefix('odometry:')}'"
            result.append(Tile("position error", f"{significant(error.value)} m", note))
    return result
