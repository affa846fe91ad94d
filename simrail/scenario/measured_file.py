"""Measured rails from a file: ``[irregularity.measured]`` names it, its columns, their units and its place.

CSV or Parquet, as a recording car or a trolley wrote it: alignment, vertical profile, cross-level and gauge,
or levels and alignments of both rails, over a distance in one or more columns that are added up (kilometre
and metre). Columns that are not said are known by their names (`simrail.scenario.measured_header`). What the
values may be is judged by `simrail.track.measured`.
"""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from simrail.core.columns import IRREGULARITY
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.toml_files import blame, existing_file, label
from simrail.recording.files.data_file import DataPart, near, open_data, read_columns
from simrail.recording.files.signal_part import Names
from simrail.scenario.axes import Listed
from simrail.scenario.measured_header import recognise
from simrail.track.bands import BANDS
from simrail.track.measured import MeasuredRails, measured_rails

LENGTHS_M = {"m": 1.0, "km": 1000.0, "cm": 0.01, "mm": 0.001, "um": 1e-6, "in": 0.0254, "ft": 0.3048}

NORMAL_GAUGE_M = 1.435

BOTH_RAILS = {
    "vertical_profile": ("left_level", "right_level"),
    "cross_level": ("left_level", "right_level"),
    "alignment": ("left_alignment", "right_alignment"),
    "gauge": ("left_alignment", "right_alignment"),
}
"""What each quantity is made of where it has no column: the mean of both rails, or left minus right."""

QUANTITIES = (
    *(column.removesuffix("_m") for column in IRREGULARITY),
    *("left_level", "right_level", "left_alignment", "right_alignment"),
)


class MeasuredPart(DataPart):
    """``[irregularity.measured]``: rails from a file, in place of a spectrum or beside it.

    Attributes
    ----------
    columns : dict
        Quantity (`QUANTITIES`) or ``position`` -> column name; of ``position`` also several, to be added.
        Left out, with ``units``, what the file's names say.
    units : dict
        Quantity -> unit (`LENGTHS_M`), for each that has a column; ``"-mm"`` for a file of the other sign.
    band : str or pair of float, optional
        The wavelengths that the file was filtered to: a name (``"D1"``) or the shortest and the longest, m.
        It changes nothing in the rails; of other wavelengths nothing is claimed, which is told.
    start_m : float, optional
        Where the first sample lies, s along the track; if not given, positions are places on the track.
    scale : float
        Factor on the values.
    nominal_gauge_mm : float, optional
        To be taken from a file that holds the gauge itself.
    bridge_gaps_m : float
        Up to which length gaps and missing values are bridged; 0 refuses them.
    instead_of_spectrum : bool
        Whether the spectrum is left out where the file lies; otherwise they add.
    partial : bool
        Whether the file may cover less than a ride.
    cross_level_has_cant : bool
        Whether the file's cross-level is that of the rails as they lie; the design's cant is then taken off.
    """

    columns: dict[str, Names] = Field(default_factory=dict)
    units: dict[str, Names] = Field(default_factory=dict)
    band: Literal["D0", "D1", "D2", "D3"] | tuple[Annotated[float, Field(gt=0.0)], float] | None = None
    start_m: Listed[float] | None = None
    scale: Listed[Annotated[float, Field(ge=0.0, le=10.0)]] = 1.0
    nominal_gauge_mm: Annotated[float, Field(gt=0.0)] | None = None
    bridge_gaps_m: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    instead_of_spectrum: bool = False
    partial: bool = False
    cross_level_has_cant: bool = False

    @model_validator(mode="after")
    def _known_quantities(self) -> Self:
        if isinstance(self.band, tuple) and not self.band[0] < self.band[1]:
            raise InputError(
                "is not (shortest, longest), m",
                field="band",
                value=self.band,
                limit="0 m < shortest < longest",
            )
        if not self.columns and not self.units:
            return self
        for table, given in (("columns", self.columns), ("units", self.units)):
            for key in given:
                if key not in ("position", *QUANTITIES):
                    raise InputError(
                        "unknown key",
                        field=f"{table}.{key}",
                        limit="one of " + ", ".join(("position", *QUANTITIES)),
                        remedy=near(key, ("position", *QUANTITIES)) or "remove it",
                    )
        for key in ("position", *self.columns):
            self._judge(key)
        for pair in (("left_level", "right_level"), ("left_alignment", "right_alignment")):
            given_of_pair = [key for key in pair if key in self.columns]
            if len(given_of_pair) == 1:
                missing = next(key for key in pair if key not in self.columns)
                raise InputError(
                    "both rails are needed",
                    field=f"columns.{missing}",
                    remedy="add it",
                    limit="left and right",
                )
        if not set(self.columns) - {"position"}:
            raise InputError(
                "names no quantity", field="columns", limit="one or more of " + ", ".join(QUANTITIES)
            )
        return self

    def _judge(self, key: str) -> None:
        """Refuse a quantity without column or unit, or with one that is none."""
        columns, units = self.columns.get(key, ()), self.units.get(key, ())
        many = len(columns) if key == "position" else 1
        if not columns:
            raise InputError(
                "is required", field=f"columns.{key}", remedy="add it", limit="this key, with a value"
            )
        if len(columns) != many or len(units) != many:
            raise InputError(
                "has no unit" if not units else "has not one unit for each column",
                field=f"units.{key}" if len(columns) == many else f"columns.{key}",
                value=list(units) if len(columns) == many else list(columns),
                limit="one of " + ", ".join(LENGTHS_M),
                remedy=f'e.g. units.{key} = "{"m" if key == "position" else "mm"}"',
            )
        for unit in units:
            known = list(LENGTHS_M)
            if (unit if key == "position" else unit.removeprefix("-")) not in known:
                raise InputError(
                    "is no unit of length",
                    field=f"units.{key}",
                    value=unit,
                    limit="one of " + ", ".join(known),
                    remedy=near(unit, known),
                )


def read_measured(part: MeasuredPart, folder: Path | None) -> MeasuredRails:
    """Read and place measured rails.

    Parameters
    ----------
    part : MeasuredPart
        Which file, and what stands in it; nothing in it is a list.
    folder : Path, optional
        Folder of the scenario, which a relative path is seen from first.

    Raises
    ------
    InputError
        If the file is missing or faulty; it names the file, the quantity, the line, the limit.
    """
    with blame(None, "irregularity.measured.file"):
        path = existing_file(part.file, folder)
    notes: list[str] = []
    if not part.columns:
        part = _by_name(part, path, notes)
    here = part.model_copy(update={"file": path.name})
    names = [name for column in part.columns.values() for name in column]
    data = open_data(here, path.parent, table="irregularity.measured")
    columns = read_columns(data, names, table="irregularity.measured")
    read = {name: np.asarray(column, dtype=np.float64) for name, column in columns.items()}
    with blame(label(path)):
        if not len(read[names[0]]):
            raise InputError(
                "holds no samples", remedy="write one line per place", limit="two samples or more"
            )
        part = _less_nominal(part, read, notes)
        rails = measured_rails(
            label(path),
            _metres(part, "position", read),
            _channels(part, read),
            start_m=part.start_m,
            scale=part.scale,
            bridge_gaps_m=part.bridge_gaps_m,
            replaces_spectrum=part.instead_of_spectrum,
            partial=part.partial,
            has_cant=part.cross_level_has_cant,
            where=data.place,
        )
    return replace(rails, notes=(*notes, *_band_notes(part, rails)))


def _by_name(part: MeasuredPart, path: Path, notes: list[str]) -> MeasuredPart:
    """The part with what the names of the file's columns say."""
    known = recognise(path)
    notes += known.notes
    found: dict[str, object] = {"columns": known.columns, "units": known.units}
    layout = {"separator": known.separator, "decimal": known.decimal, "band": known.band}
    found |= {key: value for key, value in layout.items() if key not in part.model_fields_set}
    return part.model_copy(update=found)


def _less_nominal(part: MeasuredPart, read: dict[str, FloatArray], notes: list[str]) -> MeasuredPart:
    """The part with the nominal gauge of a file that holds the gauge itself, where nothing says it."""
    if (
        "gauge" not in part.columns
        or part.nominal_gauge_mm is not None
        or "nominal_gauge_mm" in (part.model_fields_set)
    ):
        return part
    values = _metres(part, "gauge", read)
    finite = values[np.isfinite(values)]
    if not (notes and finite.size) or abs(float(np.median(finite)) - NORMAL_GAUGE_M) > 0.03:
        return part
    notes.append(f"the file holds the gauge itself: {1e3 * NORMAL_GAUGE_M:g} mm are taken off")
    return part.model_copy(update={"nominal_gauge_mm": 1e3 * NORMAL_GAUGE_M})


def _band_notes(part: MeasuredPart, rails: MeasuredRails) -> list[str]:
    """What the rails do not have: wavelengths outside of their band."""
    words = f"lies from {rails.start_m:g} to {rails.end_m:g} m, samples {rails.step_m:g} m apart"
    if part.band is None:
        return [words + "; nothing says to which wavelengths it was filtered"]
    if isinstance(part.band, str):
        low, high = BANDS[part.band].shortest_m, BANDS[part.band].longest_m
        name = f"{part.band}, {low:g} to {high:g} m"
    else:
        low, high = part.band
        name = f"{low:g} to {high:g} m"
    return [
        f"{words}; it holds waves of {name}: others are not in these rails, and nothing is claimed of them"
    ]


def _metres(part: MeasuredPart, key: str, read: dict[str, FloatArray]) -> FloatArray:
    """Values of a quantity, m: the sum of its columns."""
    total = np.zeros(len(read[part.columns[key][0]]))
    for column, unit in zip(part.columns[key], part.units[key], strict=True):
        sign = -1.0 if unit.startswith("-") else 1.0
        total += sign * LENGTHS_M[unit.removeprefix("-")] * read[column]
    if key == "gauge" and part.nominal_gauge_mm is not None:
        total -= part.nominal_gauge_mm / 1000.0
    return total


def _channels(part: MeasuredPart, read: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """The irregularities that a file holds, each from its own column or else from both rails, m."""
    channels = {}
    for quantity, (left, right) in BOTH_RAILS.items():
        if quantity in part.columns:
            channels[f"{quantity}_m"] = _metres(part, quantity, read)
        elif left in part.columns:
            one, other = _metres(part, left, read), _metres(part, right, read)
            mean = quantity in ("vertical_profile", "alignment")
            channels[f"{quantity}_m"] = 0.5 * (one + other) if mean else one - other
    return channels
