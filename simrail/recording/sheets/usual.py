"""What sensors do: figures that no gyro or accelerometer has are slips of a unit, and told before they act.

A recording is judged by what trains do (`simrail.recording.check_physics`), a sheet by what the sensors on
the market do. The bounds are wide: from the best of navigation grade to the worst that is sold, by order of
magnitude. They are from memory of data sheets (ring lasers and fibre gyros below, toys and shock sensors
above), not from a survey.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from simrail.core.errors import InputError
from simrail.recording.sheets.figures import FIGURES, QUANTITIES
from simrail.recording.sheets.grades import ImuGrade, silent_noise

SURELY = 10.0
"""A figure so many times beyond what is sold is refused; up to there, it is warned of."""

OF_RANGE = 0.02
"""Share of its range that the noise of a sample, or one count, does not reach in any device."""


class Usual(NamedTuple):
    """Least and largest figure on the market, in the unit of a key, and keys that may have been meant."""

    key: str
    least: float
    most: float
    meant: tuple[str, ...] = ()


_USUAL = (
    Usual(
        "gyro_noise_degpsqrthz",
        1e-7,
        0.1,
        ("gyro_noise_mdpspsqrthz", "gyro_noise_degphpsqrthz", "gyro_noise_degpsqrth"),
    ),
    Usual("accel_noise_ugpsqrthz", 1e-3, 1e4, ("accel_noise_ugpsqrthz", "accel_noise_ngpsqrthz")),
    Usual("gyro_bias_instability_degph", 1e-5, 2e3, ("gyro_bias_instability_mdegph",)),
    Usual("accel_bias_instability_mg", 1e-5, 50.0, ("accel_bias_instability_ug",)),
    Usual("gyro_random_walk_degphpsqrth", 1e-6, 1e4),
    Usual("accel_random_walk_mgpsqrth", 1e-7, 1e3, ("accel_random_walk_ugpsqrth",)),
    Usual("gyro_turn_on_bias_degps", 1e-8, 50.0, ("gyro_turn_on_bias_mdps", "gyro_turn_on_bias_degph")),
    Usual("accel_turn_on_bias_mg", 1e-4, 5e3, ("accel_turn_on_bias_ug",)),
    Usual("gyro_bias_temperature_degpspk", 1e-9, 1.0, ("gyro_bias_temperature_mdpspk",)),
    Usual("accel_bias_temperature_mgpk", 1e-5, 20.0, ("accel_bias_temperature_ugpk",)),
    Usual("gyro_scale_temperature_ppmpk", 1e-3, 5e3),
    Usual("accel_scale_temperature_ppmpk", 1e-3, 5e3),
    Usual("gyro_g_sensitivity_degpspg", 1e-7, 1.0, ("gyro_g_sensitivity_degphpg",)),
    Usual("gyro_range_degps", 5.0, 1e5, ("gyro_range_radps",)),
    Usual("accel_range_g", 0.05, 1e5, ("accel_range_mg",)),
    Usual("gyro_resolution_degps", 1e-10, 2.0, ("gyro_resolution_mdps",)),
    Usual("accel_resolution_mg", 1e-7, 500.0, ("accel_resolution_ug",)),
)

USUAL = {FIGURES[usual.key].field: usual for usual in _USUAL}
"""By the field of a grade."""

LEAST_RATE_HZ = 4.0
"""No inertial sensor is sold that gives fewer samples than this a second: a rate of 1 was meant in kHz."""

_NAMES = {"gyro": "gyro", "accel": "accelerometer"}


def refuse_unusual(figures: Mapping[str, object]) -> None:
    """Refuse figures of a file that are ten times beyond those of any sensor.

    Parameters
    ----------
    figures : mapping
        Values by the keys of `FIGURES`; others, and those that are None, are left alone.

    Raises
    ------
    InputError
        With what is sold, and the unit in which the number would be usual, where there is one.
    """
    for key, value in figures.items():
        usual = USUAL.get(FIGURES[key].field) if key in FIGURES else None
        if usual is None or isinstance(value, bool) or not isinstance(value, int | float):
            continue
        if value * FIGURES[key].si > SURELY * usual.most * FIGURES[usual.key].si:
            triad = _NAMES[key.partition("_")[0]]
            own = usual.most * FIGURES[usual.key].si / FIGURES[key].si
            raise InputError(
                f"is more than any {triad} has",
                field=key,
                value=value,
                limit=f"about {own:.4g} {FIGURES[key].unit}, the most that is sold",
                remedy=_meant(value, usual) or f"mind the unit: {FIGURES[key].unit}",
            )


def _meant(value: float, usual: Usual) -> str | None:
    """The line with the unit in which a number would be usual."""
    from simrail.recording.sheets.sheet_words import in_own_units

    for key in usual.meant:
        ((name, number),) = in_own_units({key: value}).items()
        figure = FIGURES[name]
        size = number * figure.si / FIGURES[usual.key].si
        if usual.least <= size <= usual.most:
            return f"is it in another unit? then write {key} = {value:g}"
    return None


def sheet_warnings(grade: ImuGrade) -> tuple[str, ...]:
    """Warnings, a line each, of what a sheet lacks (`silent_noise`) and of `unusual_figures`."""
    return (*silent_noise(grade), *unusual_figures(grade))


def unusual_figures(grade: ImuGrade) -> tuple[str, ...]:
    """Warnings, a line each, of figures and a rate of a grade that no sensor on the market has.

    Of the noise of a sample and the size of a count also those that are too large a share of the range.
    """
    told = []
    if grade.rate_hz < LEAST_RATE_HZ:
        told.append(
            f"IMU {grade.name}: a rate of {grade.rate_hz:g} Hz is that of no IMU that is sold: mind the unit "
            f"({grade.rate_hz:g} kHz is rate_hz = {1e3 * grade.rate_hz:g})"
        )
    for field, usual in USUAL.items():
        value = getattr(grade, field) / FIGURES[usual.key].si
        if value > 0.0 and not math.isinf(value) and not usual.least <= value <= usual.most:
            unit, name = FIGURES[usual.key].unit, _NAMES[usual.key.partition("_")[0]]
            told.append(
                f"IMU {grade.name}: {_quantity(usual.key)} of {value:.4g} {unit} is that "
                f"of no {name} that is sold ({usual.least:g} to {usual.most:g}): "
                "mind the unit"
            )
    for kind, name in _NAMES.items():
        terms = grade.triad(kind)
        rms = terms.noise * math.sqrt(grade.rate_hz)
        for what, size in (("noise of a sample", rms), ("resolution", terms.resolution)):
            if size > OF_RANGE * terms.range:
                told.append(
                    f"IMU {grade.name}: the {what} of the {name} is {100.0 * size / terms.range:.3g} % of "
                    "its range: mind the units of both"
                )
    return tuple(told)


def _quantity(key: str) -> str:
    quantity = next(name for name, keys in QUANTITIES.items() if key in keys)
    return quantity.partition("_")[2].replace("_", " ")
