"""From the words of data sheets to the keys of IMU files: what a person who copies a sheet is told to write.

A key of an IMU file says quantity and unit (``gyro_noise_degpsqrth``). Sheets use other words for the same
quantities ("angle random walk", "in-run bias stability"), and some of these come near the key of another one.
Of an unknown key, words are looked up in `ALIASES`, the unit of the key or the value is read
(`simrail.recording.sheets.units`), and only keys of that quantity whose dimension fits are named, with the
number converted. What the table does not explain altogether is not guessed at.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from simrail.recording.sheets.figures import FIGURES, MEANINGS, QUANTITIES, Figure
from simrail.recording.sheets.units import Dimension, Measured, Unit, read_measured, read_unit

_SPOKEN: tuple[tuple[str, str], ...] = (
    # Random walk of the angle is white noise of the rate: never a walk of the rate.
    ("gyro_noise", "angle random walk, angular random walk, arw"),
    ("accel_noise", "velocity random walk, vrw"),
    (
        "noise",
        "noise, white noise, noise density, spectral noise density, noise spectral density, nsd, rate "
        "noise density, rate noise, rms noise, noise rms, noise std, noise standard deviation, "
        "total noise, total rms noise, output noise, "
        "angular rate noise density, acceleration noise density, acceleration noise, power spectral "
        "density",
    ),
    ("noise random_walk", "random walk"),
    ("gyro_random_walk", "rate random walk, angular rate random walk, rrw"),
    ("accel_random_walk", "acceleration random walk"),
    ("random_walk", "bias random walk, bias walk"),
    (
        "bias_instability",
        "bias instability, in run bias stability, in run bias instability, in run stability, in run "
        "instability, in run bias, in run, bias stability in run, bias in run stability, flicker noise, "
        "bias instability coefficient",
    ),
    ("bias_instability turn_on_bias", "bias stability, stability"),
    ("bias_instability turn_on_bias bias_temperature", "bias drift, drift"),
    (
        "turn_on_bias",
        "turn on bias, turn on, turn on to turn on bias, turn on to turn on bias repeatability, turn on "
        "bias repeatability, bias turn on repeatability, bias repeatability, repeatability, run to run "
        "bias, run to run bias stability, run to run bias repeatability, initial bias, initial bias "
        "error, constant bias, fixed bias, bias, bias error, bias offset, zero rate offset, zero rate "
        "level, zero rate bias, zero rate output, zero g offset, zero g level, zero g bias, zero g output, "
        "offset, offset error, zero offset, offset repeatability, zrl, zro",
    ),
    (
        "scale_error",
        "scale error, scale factor error, scale factor, scale factor accuracy, scale factor "
        "repeatability, scale factor stability, scale factor tolerance, sensitivity error, sensitivity "
        "tolerance, sensitivity repeatability, gain error",
    ),
    (
        "nonlinearity",
        "nonlinearity, non linearity, linearity, linearity error, scale factor linearity, scale factor "
        "nonlinearity, scale factor non linearity, sensitivity nonlinearity, sensitivity non linearity",
    ),
    (
        "package_misalignment nonorthogonality",
        "misalignment, axis misalignment, alignment, alignment error",
    ),
    (
        "package_misalignment",
        "package misalignment, misalignment to package, axis to package misalignment, axis to frame "
        "misalignment, package alignment error, mounting misalignment",
    ),
    (
        "nonorthogonality",
        "nonorthogonality, non orthogonality, orthogonality, orthogonality error, axis to axis "
        "misalignment, cross axis, cross axis sensitivity, cross axis error, cross coupling, transverse "
        "sensitivity, cross axis misalignment",
    ),
    (
        "g_sensitivity",
        "g sensitivity, linear g sensitivity, g dependent bias, bias g sensitivity, acceleration "
        "sensitivity, linear acceleration effect, linear acceleration effect on bias, linear acceleration "
        "sensitivity",
    ),
    (
        "vibration_rectification",
        "vibration rectification, vibration rectification error, vibration rectification coefficient, "
        "vre, vrc",
    ),
    (
        "bias_temperature",
        "bias tempco, tempco, offset tempco, bias temperature, bias temperature coefficient, bias "
        "temperature sensitivity, bias over temperature, bias vs temperature, bias change over "
        "temperature, bias drift over temperature, offset temperature coefficient, offset over "
        "temperature, zero rate level over temperature, zero g level over temperature, tco",
    ),
    (
        "scale_temperature",
        "scale temperature, scale factor temperature, scale factor temperature coefficient, scale factor "
        "over temperature, scale factor vs temperature, sensitivity temperature coefficient, sensitivity "
        "over temperature, sensitivity vs temperature, tcs",
    ),
    ("scale_temperature scale_error resolution", "sensitivity"),
    (
        "range",
        "range, full scale, full scale range, measurement range, measuring range, dynamic range, input "
        "range, fsr",
    ),
    (
        "resolution",
        "resolution, quantisation, quantization, quantisation step, quantization step, lsb size",
    ),
    (
        "bandwidth",
        "bandwidth, sensor bandwidth, cutoff frequency, cut off frequency, corner frequency, filter "
        "bandwidth",
    ),
    (
        "rate",
        "sample rate, sampling rate, sampling frequency, sample frequency, output rate, output data rate, "
        "odr, data rate, update rate",
    ),
    ("bias_correlation", "bias correlation, correlation time, bias correlation time, bias time constant"),
    ("vibration_averaging", "vibration averaging"),
    ("clock_drift", "clock drift, clock error, clock accuracy, clock stability"),
    ("clock_jitter", "clock jitter, jitter, timing jitter, time stamp jitter"),
    ("dropped", "dropped, dropped samples, lost samples, packet loss"),
    ("dropped_burst", "dropped burst"),
)

ALIASES: dict[str, tuple[str, ...]] = {
    phrase: tuple(quantities.split()) for quantities, phrases in _SPOKEN for phrase in phrases.split(", ")
}
"""Quantities that words of a data sheet may mean: keys of `QUANTITIES`, or without triad where it is open."""

_TRIAD_WORDS = {
    "gyro": "gyro",
    "gyros": "gyro",
    "gyroscope": "gyro",
    "gyr": "gyro",
    "gyroscopes": "gyro",
    "angular": "gyro",
    "rate": "gyro",
    "accel": "accel",
    "accels": "accel",
    "acc": "accel",
    "accelerometer": "accel",
    "accelerometers": "accel",
    "acceleration": "accel",
}

_AXES = frozenset(("x", "y", "z", "xy"))
_FILLERS = _AXES | frozenset(
    ("typ", "typical", "max", "maximum", "nominal", "value", "error", "axis", "coefficient", "3db", "1sigma")
)
"""Words that change nothing of what is meant."""

_VOCABULARY = sorted({word for phrase in ALIASES for word in phrase.split()} | set(_TRIAD_WORDS))

_BY_SUFFIX = {
    name.removeprefix(f"{quantity}_"): Unit(figure.si, figure.dimension, name.endswith("hz"))
    for quantity, names in QUANTITIES.items()
    for name in names
    for figure in (FIGURES[name],)
}
"""Units as the keys of IMU files spell them."""

_ANGLE, _NUMBER = Dimension(radian=Fraction(1)), Dimension()
_ANGLE_PER_ROOT_HERTZ = Dimension(radian=Fraction(1), second=Fraction(1, 2))

_COUNTS_PER = re.compile(r"(?:lsbs?|counts?|digits?) *(?:/|p|per) *(.*)")
"""A sensitivity as counts per unit: one count is the inverse."""

_ANALOGUE = re.compile(r"(?:sensitivity|scale).*[\s_(0-9][mu]?v(?:olts?)?(?:/|p| *per |_per_)")

_TOOLS = {
    "gyroscope_noise_density": "rad/s/sqrt(Hz)",
    "gyroscope_random_walk": "rad/s^2/sqrt(Hz)",
    "accelerometer_noise_density": "m/s^2/sqrt(Hz)",
    "accelerometer_random_walk": "m/s^3/sqrt(Hz)",
}
"""Units of the keys of kalibr and of the Allan tools that write files for it: SI, by their definition
(github.com/ethz-asl/kalibr/wiki/IMU-Noise-Model, by memory)."""


class Spoken(NamedTuple):
    """What an unknown key means.

    Attributes
    ----------
    quantities : tuple of str
        Keys of `QUANTITIES`, or ``rate``.
    unit : str
        What its end says of the unit; "" for nothing.
    words : str
        The words that were found.
    misspelt : bool
        Whether a word had to be mended.
    of_axis : bool
        Whether it speaks of one axis.
    """

    quantities: tuple[str, ...]
    unit: str
    words: str
    misspelt: bool
    of_axis: bool


def explain(key: str, value: object) -> str | None:
    """What to write in the place of a key that IMU files do not have.

    Parameters
    ----------
    key : str
        As it was written, e.g. ``"angle_random_walk"``, ``"Gyro ARW (deg/sqrt(h))"``.
    value : object
        A number, or text with a number and its unit, e.g. ``"0.34 deg/sqrt(h)"``; a table of such.

    Returns
    -------
    str, optional
        A remedy that names keys of the same quantity only; None if the words are not known.
    """
    if isinstance(value, dict):
        remedies = [explain(f"{key}_{inner}", item) for inner, item in value.items()]
        return "; ".join(remedy for remedy in remedies if remedy) or None
    if key in _TOOLS and isinstance(value, int | float):
        value = f"{value} {_TOOLS[key]}"
    if _ANALOGUE.search(f"{key} {value if isinstance(value, str) else ''}".lower()):
        return (
            "remove it: volts per unit are the gain of an analogue output; of its digits the size of one is "
            "wanted, gyro_resolution_degps or accel_resolution_mg"
        )
    spoken = interpret(key)
    if spoken is None:
        return None
    spoken = spoken._replace(of_axis=spoken.of_axis or isinstance(value, list))
    measured = read_measured(value)
    if spoken.quantities == ("rate",):
        return _of_rate(spoken, measured)
    # What stands beside the number is meant more surely than what stands in the key.
    said = measured.unit if measured and _unit_of(measured.unit) else spoken.unit
    said = said or (measured.unit if measured else "")
    unit = _unit_of(said)
    fitting = _figures(spoken.quantities)
    if unit is None:
        # Words that are those of a key mean that key, where they come with what was to be its unit.
        own = [name for name in spoken.quantities if name.endswith(spoken.words.replace(" ", "_"))]
        return _choose(key, _figures(own) if own and said else fitting, spoken, said)
    same = {name: figure for name, figure in fitting.items() if _fits(figure, unit)}
    if not same:
        return _no_such_unit(spoken, said, unit, fitting, measured)
    plain = isinstance(value, int | float)
    lines = [_line(names, unit, measured, spoken, plain=plain) for names in _by_quantity(same)]
    guess = spoken.misspelt and plain
    return f"did you mean {' or '.join(lines)}?" if guess else f"write {' or '.join(lines)}"


def in_own_units(data: Mapping[str, Any]) -> dict[str, Any]:
    """Keys whose meaning is certain, with the keys and numbers of the table in their place.

    Certain is a key that names its quantity as IMU files do, with another unit behind it, e.g.
    ``gyro_noise_mdpspsqrthz``; and a noise that is given for each axis. All else stays as it is, to be
    refused and explained.

    Parameters
    ----------
    data : mapping
        What a file says.
    """
    found: dict[str, Any] = {}
    for key, value in data.items():
        name, number = key, value
        if key not in FIGURES:
            name, factor = _known(key)
            plain = value if isinstance(value, list | tuple) else [value]
            taken = any(other in data for other in _figures([name.rpartition("_")[0]])) if factor else True
            if taken or not all(_is_number(one) for one in plain):
                found[key] = value
                continue
            number = [one * factor for one in plain] if isinstance(value, list | tuple) else value * factor
        triad, _, term = name.rpartition("_")[0].partition("_")
        shares = f"{triad}_axis_noise"
        if term == "noise" and isinstance(number, list | tuple) and shares not in data and _are_axes(number):
            found[shares] = tuple(one / max(number) for one in number)
            number = max(number)
        found[name] = number
    return found


def _known(key: str) -> tuple[str, float]:
    """The key of the table that says the same in another unit, and the factor to it; 0 for none."""
    for quantity in sorted(QUANTITIES, key=len, reverse=True):
        unit = _unit_of(key.removeprefix(f"{quantity}_")) if key.startswith(f"{quantity}_") else None
        if unit is not None:
            names = [name for name in QUANTITIES[quantity] if _fits(FIGURES[name], unit)]
            if names:
                name = _best(names, unit, None)
                return name, unit.si / FIGURES[name].si
    return key, 0.0


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _are_axes(values: Sequence[object]) -> bool:
    numbers = [value for value in values if isinstance(value, int | float) and not isinstance(value, bool)]
    return len(numbers) == len(values) == 3 and min(numbers) >= 0.0 < max(numbers) < math.inf


def interpret(key: str) -> Spoken | None:
    """Read the words of a key; None where one of its words is not understood."""
    tokens = _tokens(key)
    for mended in (False, True):
        words = [_nearest(token) for token in tokens] if mended else tokens
        for last in range(len(words), 0, -1):
            unit = "_".join(tokens[last:])
            if unit and _unit_of(unit) is None and not _is_misspelt_unit(tokens[last:]):
                continue
            found = _quantities(words[:last])
            if found is not None:
                quantities, phrase = found
                return Spoken(quantities, unit, phrase, mended, bool(_AXES & set(tokens[:last])))
    return None


def _tokens(key: str) -> list[str]:
    """Words of a key, small; signs of units stay within them."""
    if not re.search(r"[\s_-]", key):
        key = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", key)
    return [token for token in re.split(r"[\s_\-.,;:()\[\]]+", key.lower()) if token]


def _nearest(token: str) -> str:
    """The word that was meant by a misspelt one; short words and those that are right stay."""
    if len(token) < 4 or token in _VOCABULARY or token in _FILLERS:
        return token
    words = [word for word in _VOCABULARY if abs(len(word) - len(token)) <= 2]
    near = difflib.get_close_matches(token, words, n=1, cutoff=0.8)
    return near[0] if near else token


def _is_misspelt_unit(tokens: list[str]) -> bool:
    """Whether the end of a key is near a unit as keys spell them, and no word of data sheets."""
    if len(tokens) != 1 or _nearest(tokens[0]) in _VOCABULARY:
        return False
    units = [unit for unit in _BY_SUFFIX if abs(len(unit) - len(tokens[0])) <= 2]
    return bool(difflib.get_close_matches(tokens[0], units, n=1, cutoff=0.6))


def _quantities(words: list[str]) -> tuple[tuple[str, ...], str] | None:
    """What words mean, all of which must be understood: quantities, with their triads, and the phrase."""
    for size in range(len(words), 0, -1):
        for first in range(len(words) - size + 1):
            phrase = " ".join(words[first : first + size])
            rest = [*words[:first], *words[first + size :]]
            if phrase not in ALIASES or not all(word in _TRIAD_WORDS or word in _FILLERS for word in rest):
                continue
            triads = {_TRIAD_WORDS[word] for word in rest if word in _TRIAD_WORDS}
            named = tuple(_with_triads(ALIASES[phrase], triads))
            return (named, phrase) if named else None
    return None


def _with_triads(quantities: Iterable[str], triads: set[str]) -> Iterator[str]:
    """Quantities of the triads that are spoken of, or of both; those of the device have none."""
    for quantity in quantities:
        # A device has a bandwidth, and each of its triads may have its own.
        if quantity in QUANTITIES and any(f"{triad}_{quantity}" in QUANTITIES for triad in triads):
            yield from (f"{triad}_{quantity}" for triad in sorted(triads))
            continue
        if quantity in QUANTITIES or quantity == "rate":
            own = quantity.split("_")[0]
            if own not in ("gyro", "accel") or not triads or own in triads:
                yield quantity
            continue
        for triad in ("gyro", "accel"):
            if f"{triad}_{quantity}" in QUANTITIES and (not triads or triad in triads):
                yield f"{triad}_{quantity}"


def _figures(quantities: Iterable[str]) -> dict[str, Figure]:
    return {name: FIGURES[name] for quantity in quantities for name in QUANTITIES[quantity]}


def _unit_of(text: str) -> Unit | None:
    unit = _BY_SUFFIX.get(text) or (read_unit(text) if text else None)
    if unit is not None and unit.per_root_hertz and unit.dimension == _ANGLE_PER_ROOT_HERTZ:
        # As keys of IMU files write deg/s/sqrt(Hz): degpsqrthz. No sheet prints an angle per root of hertz.
        second = unit.dimension.second - 1
        return unit._replace(dimension=unit.dimension._replace(second=second))
    return unit


def _fits(figure: Figure, unit: Unit) -> bool:
    """Whether a figure can be given in a unit; an angle between axes also as its sine (cross-axis)."""
    return figure.dimension == unit.dimension or _is_sine(figure, unit)


def _is_sine(figure: Figure, unit: Unit) -> bool:
    return "nonorthogonality" in figure.field and figure.dimension == _ANGLE and unit.dimension == _NUMBER


def _by_quantity(figures: dict[str, Figure]) -> list[list[str]]:
    fields = dict.fromkeys(figure.field for figure in figures.values())
    return [[name for name, figure in figures.items() if figure.field == field] for field in fields]


def _line(names: list[str], unit: Unit, measured: Measured | None, spoken: Spoken, *, plain: bool) -> str:
    """The line to write, of the keys of one quantity that fit a unit."""
    name = _best(names, unit, measured)
    if spoken.misspelt and plain and math.isclose(FIGURES[name].si, unit.si, rel_tol=1e-9):
        return name
    number = "..." if measured is None else _number(measured.number * unit.si / FIGURES[name].si)
    notes = [MEANINGS[name.rpartition("_")[0]]]
    if spoken.of_axis:
        notes.append("the axes have one figure: the largest of theirs")
    if _is_sine(FIGURES[name], unit):
        notes.append("where that holds the mounting of the package as well, package_misalignment_mrad too")
    return f"{name} = {number} ({'; '.join(notes)})"


def _best(names: list[str], unit: Unit, measured: Measured | None) -> str:
    """The key with the unit that was given, or else the one whose number is easiest to read."""
    exact = [name for name in names if math.isclose(FIGURES[name].si, unit.si, rel_tol=1e-9)]
    alike = [name for name in names if name.endswith("hz") == unit.per_root_hertz]
    chosen = exact or alike or names
    if measured is None or len(chosen) == 1:
        return chosen[0]
    size = {name: abs(measured.number) * unit.si / FIGURES[name].si or 1.0 for name in chosen}
    return min(chosen, key=lambda name: abs(math.log10(size[name]) - 0.5))


def _number(value: float) -> str:
    text = f"{value:.6g}"
    return text if set(text) & set(".en") else f"{text}.0"


def _choose(key: str, figures: dict[str, Figure], spoken: Spoken, said: str) -> str:
    """Name the keys of a quantity, where no unit was given or none was understood; the nearest first."""
    near = sorted(figures, key=lambda name: -difflib.SequenceMatcher(None, key, name).ratio())
    listed = " or ".join(f"{name} ({FIGURES[name].unit})" for name in near)
    if spoken.misspelt or (said and said == spoken.unit):
        return f"did you mean {listed}?"
    return f"write {listed}"


def _no_such_unit(
    spoken: Spoken, said: str, unit: Unit, figures: dict[str, Figure], measured: Measured | None
) -> str:
    """Say that a unit is of another quantity than the words, and what can be made of it."""
    counted = _COUNTS_PER.fullmatch(said.lower())
    one = _unit_of(counted[1].strip("() ")) if counted else None
    inverse = [name for name in figures if "resolution" in name and one and _fits(FIGURES[name], one)]
    if inverse and one is not None and measured is not None and measured.number > 0.0:
        name = inverse[0]
        number = _number(one.si / (measured.number * FIGURES[name].si))
        return f"write {name} = {number} ({MEANINGS[name.rpartition('_')[0]]}, one over counts per unit)"
    units = ", ".join(dict.fromkeys(figure.unit for figure in figures.values()))
    text = f"{spoken.words} has the unit {units}, and {said} is of another quantity"
    rms = [name for name in figures if name.endswith("sqrthz") and _is_over_root_hertz(FIGURES[name], unit)]
    if rms:
        figure = FIGURES[rms[0]]
        noise = "noise" if measured is None else _number(measured.number * unit.si / figure.si)
        text += f"; of a noise over a bandwidth of B Hz write {rms[0]} = {noise} / sqrt(1.57 B)"
        if measured is not None:
            over = measured.number * unit.si / figure.si / math.sqrt(1.57 * 100.0)
            text += f", which is {_number(over)} where B is 100 Hz"
    return text


def _is_over_root_hertz(figure: Figure, unit: Unit) -> bool:
    """Whether a figure is the density of a noise whose rms has a unit."""
    half = Fraction(1, 2)
    return figure.dimension == unit.dimension._replace(second=unit.dimension.second + half)


def _of_rate(spoken: Spoken, measured: Measured | None) -> str:
    unit = _unit_of(spoken.unit or (measured.unit if measured else "") or "hz")
    if measured is None or unit is None or unit.dimension != FIGURES["bandwidth_hz"].dimension:
        return "write rate_hz"
    return f"write rate_hz = {_number(measured.number * unit.si)}"
