"""Roughness of rails: levels by wavelength, as acoustics gives them, and a density from them.

A level is ``10 lg(r^2 / (1 um)^2)`` with r^2 the mean square height in a one-third octave band of wavelength.
Within a band the density over the spatial frequency f = 1/wavelength is taken as even,
``S = r^2 / (f_high - f_low)``, so that a realisation has the level of every band.

Sources: column M ("average network") of table G-1b of Commission Delegated Directive (EU) 2021/1226, annex,
and column E there ("EN ISO 3095:2013, well maintained and very smooth"), both read in the public
implementation NoiseModelling (Universite-Gustave-Eiffel/NoiseModelling, RailwayCnossosEU_2020.json). Column E
is flat above 0.4 m, where the standard sets no limit: it is no model of rails there.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from simrail.core.jit import FloatArray

THIRD_OCTAVE = 10.0 ** (1.0 / 10.0)
"""Ratio of the centres of neighbouring bands (base 10, IEC 61260-1)."""


@dataclass(frozen=True)
class RoughnessTable:
    """Levels of one-third octave bands of wavelength, from the longest on, without a gap.

    Attributes
    ----------
    name, source : str
        What it is, and where it comes from.
    wavelengths_m : tuple of float
        Nominal centres, falling.
    levels_db : tuple of float
        Levels re 1 um.
    """

    name: str
    source: str
    wavelengths_m: tuple[float, ...]
    levels_db: tuple[float, ...]

    @property
    def longest_m(self) -> float:
        """Long edge of the longest band."""
        return float(_centre(self.wavelengths_m[0]) * np.sqrt(THIRD_OCTAVE))

    @property
    def shortest_m(self) -> float:
        """Short edge of the shortest band."""
        return float(_centre(self.wavelengths_m[-1]) / np.sqrt(THIRD_OCTAVE))

    def density(self, frequency_1pm: FloatArray) -> FloatArray:
        """One-sided density in m^2/(1/m) at spatial frequencies (n,); 0 beyond the table."""
        centres = 1.0 / np.array([_centre(wave) for wave in self.wavelengths_m])
        edges = np.append(centres / np.sqrt(THIRD_OCTAVE), centres[-1] * np.sqrt(THIRD_OCTAVE))
        squares = 1e-12 * 10.0 ** (0.1 * np.array(self.levels_db))
        band = np.searchsorted(edges, frequency_1pm, side="right") - 1
        inside = (band >= 0) & (band < len(centres))
        at = np.clip(band, 0, len(centres) - 1)
        return np.where(inside, (squares / np.diff(edges))[at], 0.0)


def _centre(nominal_m: float) -> float:
    """Exact centre of the band of a nominal one: a whole power of the ratio."""
    return float(THIRD_OCTAVE ** np.round(np.log(nominal_m) / np.log(THIRD_OCTAVE)))


_WAVES = (2.0, 1.6, 1.25, 1.0, 0.8, 0.63, 0.5, 0.4, 0.315, 0.25, 0.2, 0.16, 0.125, 0.1, 0.08, 0.063, 0.05)

_EU = "Commission Delegated Directive (EU) 2021/1226, annex, table G-1b, column {}"

TABLES: Mapping[str, RoughnessTable] = {
    table.name: table
    for table in (
        RoughnessTable(
            "eu_2021_1226_m",
            _EU.format("M, average network"),
            _WAVES,
            (
                *(35.0, 31.0, 28.0, 25.0, 23.0, 20.0, 17.0, 13.5, 10.5, 9.0, 6.5, 5.5, 5.0, 3.5),
                *(2.0, 0.1, -0.2),
            ),
        ),
        RoughnessTable(
            "iso_3095",
            _EU.format("E, EN ISO 3095:2013 well maintained and very smooth"),
            _WAVES,
            (
                *(17.1, 17.1, 17.1, 17.1, 17.1, 17.1, 17.1, 17.1, 15.0, 13.0, 11.0, 9.0, 7.0, 4.9),
                *(2.9, 0.9, -1.1),
            ),
        ),
    )
}
"""Tables by the names that a scenario gives them."""
