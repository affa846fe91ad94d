"""A spectrum of one's own: a table of one-sided densities over frequency or wavelength.

Columns are known by their names with the unit in brackets: ``frequency [1/m]``, ``wavenumber [rad/m]`` or
``wavelength [m]``, and densities such as ``vertical profile [mm2/(1/m)]``, ``alignment [m2/(rad/m)]``.
Between the rows a density is a straight line in logarithms; outside of them, and of quantities without a
column, it is nothing, which is told.
"""

import csv
import hashlib
import re
from pathlib import Path

import numpy as np

from simrail.core.columns import IRREGULARITY
from simrail.core.errors import InputError, joined
from simrail.core.toml_files import label
from simrail.track.spectra import OwnSpectrum, Spectrum, TabledPsd

_AXES = {"frequency [1/m]": 1.0, "wavenumber [rad/m]": 0.5 / np.pi, "wavelength [m]": 1.0}
_QUANTITIES = {
    "vertical profile": "vertical_profile_m",
    "longitudinal level": "vertical_profile_m",
    "alignment": "alignment_m",
    "cross level": "cross_level_m",
    "gauge": "gauge_m",
}
_LENGTHS_2 = {"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6}
_PER = {"(1/m)": 1.0, "(rad/m)": 2.0 * np.pi}


def is_spectrum(path: Path) -> bool:
    """Whether a file's first column is a frequency or a wavelength."""
    names, _ = _rows(path)
    return _plain(names[0]) in _AXES


def read_spectrum(path: Path) -> OwnSpectrum:
    """The spectrum of a table.

    Raises
    ------
    InputError
        If a column is not known, or a value is not positive, or the frequencies do not go one way.
    """
    names, rows = _rows(path)
    try:
        values = np.array(rows, dtype=np.float64)
    except ValueError:
        raise InputError(
            "holds what is no number, or rows of several lengths",
            file=label(path),
            limit="numbers, as many in each row",
        ) from None
    if len(values) < 2 or not (np.isfinite(values) & (values > 0.0)).all():
        raise InputError(
            "needs two rows of positive numbers or more", file=label(path), value=len(values), limit=">= 2"
        )
    axis = values[:, 0] * _AXES[_plain(names[0])]
    frequency = 1.0 / axis if "wavelength" in _plain(names[0]) else axis
    order = np.argsort(frequency)
    if not (np.diff(frequency[order]) > 0.0).all():
        raise InputError(
            "has a frequency twice", file=label(path), field=names[0], limit="each frequency once"
        )
    none = TabledPsd((), ())
    densities = dict.fromkeys(IRREGULARITY, none)
    for i, name in enumerate(names[1:], start=1):
        column, scale = _density(name, path)
        density = tuple(float(v) for v in scale * values[order, i])
        densities[column] = TabledPsd(tuple(float(f) for f in frequency[order]), density)
    unsaid = [
        column.removesuffix("_m").replace("_", " ") for column in IRREGULARITY if densities[column] == none
    ]
    low, high = 1.0 / frequency[order][-1], 1.0 / frequency[order][0]
    notes = [f"a one-sided spectrum of {low:.4g} to {high:.4g} m: other waves are not in the rails"]
    notes += [f"it has no {', '.join(unsaid)}: none is laid"] if unsaid else []
    digest = hashlib.sha256(values.tobytes() + repr(names).encode()).hexdigest()
    spectrum = Spectrum(label(path), f"file {path.name}", densities)
    return OwnSpectrum(label(path), digest, spectrum, tuple(notes))


def _rows(path: Path) -> tuple[list[str], list[list[str]]]:
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"cannot be read ({error})", file=label(path), limit="a text file in UTF-8"
        ) from None
    lines = [line for line in lines if line.strip() and not line.startswith("#")] or [""]
    mark = max(";\t,", key=lines[0].count)
    names, *rows = csv.reader(lines, delimiter=mark)
    return names or [""], rows


def _plain(name: str) -> str:
    return joined(name.casefold().replace("_", " "))


def _density(name: str, path: Path) -> tuple[str, float]:
    """Quantity of a column, and its unit in m2/(1/m)."""
    found = re.fullmatch(r"(.*?) ?\[(\S+?)/(\(1/m\)|\(rad/m\))\]", _plain(name))
    if found is None or found[1] not in _QUANTITIES or found[2] not in _LENGTHS_2:
        raise InputError(
            "is no density that is known",
            file=label(path),
            field=name,
            limit=f"{', '.join(_QUANTITIES)}, each with [mm2/(1/m)], [m2/(rad/m)] or the like",
        )
    return _QUANTITIES[found[1]], _LENGTHS_2[found[2]] * _PER[found[3]]
