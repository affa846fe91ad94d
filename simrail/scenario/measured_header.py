"""What the columns of a measuring car's export are, by their names.

Exports name a quantity, often the rail and the band, and the unit in brackets: ``LL_L_D1 [mm]``, ``Alignment
right (mm)``, ``Gauge [mm]``, ``Km``. What is recognised is told (`Recognised.notes`); a column whose name or
unit is not known is left alone and named; nothing is guessed from the numbers but the separator and the
decimal sign.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from simrail.core.errors import InputError, joined
from simrail.core.toml_files import label
from simrail.recording.files.data_file import TABLES, DataPart, open_data

_RAILS = (
    ("level", r"ll|longitudinal ?level|(vertical )?profile|level|top"),
    ("alignment", r"al|alignment|versine|line"),
)
_SIDES = (("left", r"l|left|lt"), ("right", r"r|right|rt"))
_WHOLE = (
    ("cross_level", r"cross ?level|xl|xlevel|cl|cant|superelevation"),
    ("gauge", r"gauge|ga|gage|track ?gauge"),
    ("vertical_profile", r"vertical ?profile|ll|longitudinal ?level|profile"),
    ("alignment", r"alignment|al"),
)
_BAND = re.compile(r"\bd([0-3])\b")
_UNIT = re.compile(r"[\[(]\s*([^\])]*?)\s*[\])]\s*$")
_UNITS = ("km", "m", "cm", "mm", "um", "in", "ft")


@dataclass(frozen=True)
class Recognised:
    """Layout and columns of an export.

    Attributes
    ----------
    separator, decimal : str
        As in `DataPart`.
    columns, units : dict of str to tuple of str
        As in `simrail.scenario.measured_file.MeasuredPart`.
    band : str, optional
        The band that the names tell, if all of them tell the same.
    notes : tuple of str
        What was taken for what.
    """

    separator: str
    decimal: str
    columns: dict[str, tuple[str, ...]]
    units: dict[str, tuple[str, ...]]
    band: str | None
    notes: tuple[str, ...]


def recognise(path: Path) -> Recognised:
    """The columns of an export, by their names.

    Raises
    ------
    InputError
        If the file is unreadable, or has no place or no quantity that is known.
    """
    separator, decimal = _layout(path)
    part = DataPart(file=path.name, separator=separator, decimal=decimal)
    names = open_data(part, path.parent, table="irregularity.measured").names
    columns: dict[str, tuple[str, ...]] = {}
    units: dict[str, tuple[str, ...]] = {}
    bands, unused = set(), []
    for name in names:
        quantity, unit, band = _meaning(name)
        if quantity is None or unit is None or (quantity != "position" and quantity in columns):
            unused.append(name)
            continue
        columns[quantity] = (*columns.get(quantity, ()), name)
        units[quantity] = (*units.get(quantity, ()), unit)
        bands |= {band} if band else set()
    for pair in (("left_level", "right_level"), ("left_alignment", "right_alignment")):
        if len(set(pair) & set(columns)) == 1:
            for key in set(pair) & set(columns):
                unused += columns.pop(key)
                units.pop(key)
    if "position" not in columns or len(columns) < 2:
        raise InputError(
            "no place or no quantity is known by its name",
            file=label(path),
            field="irregularity.measured.columns",
            value=", ".join(names)[:120],
            limit="e.g. Km, LL_L [mm], LL_R [mm], AL_L [mm], AL_R [mm], CrossLevel [mm], Gauge [mm]",
            remedy="say which column is what in columns, and its unit in units",
        )
    taken = ", ".join(f"{' + '.join(columns[key])} is {key.replace('_', ' ')}" for key in columns)
    notes = [f"columns known by name: {taken}; up, to the left, left over right and wide are positive"]
    if unused:
        notes.append("columns not used: " + ", ".join(unused))
    return Recognised(
        separator, decimal, columns, units, bands.pop() if len(bands) == 1 else None, tuple(notes)
    )


def _layout(path: Path) -> tuple[str, str]:
    """Separator and decimal sign of a text, from its first lines."""
    if path.suffix.lower() in TABLES:
        return ",", "."
    try:
        with path.open(encoding="utf-8-sig", errors="replace") as text:
            head, *lines = [text.readline() for _ in range(5)]
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror})", file=label(path), limit="a file that can be read"
        ) from None
    separator = max(";\t|,", key=lambda mark: (head.count(mark), mark != ","))
    comma = separator != "," and any(re.search(r"\d,\d", line) for line in lines)
    return separator, "," if comma else "."


def _meaning(name: str) -> tuple[str | None, str | None, str | None]:
    """Quantity, unit and band of a column, by its name; None for what is not known."""
    said = _UNIT.search(name)
    words = (name[: said.start()] if said else name).casefold().replace("_", " ").replace("-", " ").strip()
    unit = said[1].casefold().replace("µm", "um") if said else None
    if unit is None and words.rsplit(" ", 1)[-1] in _UNITS and " " in words:
        words, unit = words.rsplit(" ", 1)
    if unit is not None and unit not in _UNITS:
        return None, None, None
    if words in ("km", "kilometer", "kilometre", "kilometers", "kilometres"):
        return "position", unit or "km", None
    if words in ("meter", "metre", "meters", "metres", "m"):
        return "position", unit or "m", None
    if words in ("position", "chainage", "distance", "station", "location", "s", "x", "mileage"):
        return "position", unit, None
    told = _BAND.search(words)
    band = f"D{told[1]}" if told else None
    words = joined(_BAND.sub(" ", words))
    for key, pattern in _RAILS:
        for side, letters in _SIDES:
            if re.fullmatch(rf"({pattern}) ({letters})( rail)?|({letters})( rail)? ({pattern})", words):
                return f"{side}_{key}", unit, band
    for quantity, pattern in _WHOLE:
        if re.fullmatch(pattern, words):
            return quantity, unit, band if quantity != "gauge" else None
    return None, None, None
