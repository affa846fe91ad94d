"""Power spectral densities of track irregularities: ERRI B176 low and high, FRA classes 1 to 6.

All of them are rational in the square of the spatial frequency, so that the variance in a band has a
closed form too. Densities are one-sided, in m^2/(1/m), over the spatial frequency f = 1/wavelength.
This module draws no random numbers: see `simrail.track.irregularity`.

Sources: ORE/ERRI B176 ("German low and high disturbance") with alignment, vertical, cross-level (an
angle over the half base b = 0.75 m, taken here as a height over 2 b) and gauge; the amplitude of gauge
is the least certain, +-30 %. FRA (AAR form) with k = 0.25.

The FRA form gives gauge the density of cross-level. As a Gaussian process that goes far below what the law
allows (class 1: -52 mm in 65 km, where 1422 mm, -13 mm, is the least gauge of every class), and no wheelset
fits between such rails. So ``fra_1`` to ``fra_6`` name limits of the gauge, within which
`simrail.track.irregularity` keeps the realisation; ``fra_1_formula`` to ``fra_6_formula`` are the form as it
is published. Limits: U.S. Code of Federal Regulations, title 49, section 213.53 (b), read at
law.lawstack.com: at least 4 ft 8 in in every class; at most 4 ft 10 in in class 1, 4 ft 9 3/4 in in classes 2
and 3, 4 ft 9 1/2 in in classes 4 and 5. Class 6 has a table of its own (section 213.323), which could not be
had; it is given the limits of class 5, which it must keep too.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from simrail.core.columns import IRREGULARITY
from simrail.core.jit import FloatArray

TWO_PI = 2.0 * np.pi


@dataclass(frozen=True)
class RationalPsd:
    """S(W) = gain W^(2 order) / product of (W^2 + corner^2), one-sided, W = 2 pi f in rad/m.

    Attributes
    ----------
    gain : float
        In the unit that makes S m^2/(rad/m).
    order : int
        0 or 1; less than the number of corners.
    corners_radpm : tuple of float
        Corner frequencies, all different; a corner of 0 gives a factor 1/W^2 (`order` 0 only).
    """

    gain: float
    order: int
    corners_radpm: tuple[float, ...]

    def density(self, frequency_1pm: npt.ArrayLike) -> FloatArray:
        """One-sided density in m^2/(1/m) at spatial frequencies > 0 (S_f(f) = 2 pi S(2 pi f))."""
        squared = (TWO_PI * np.asarray(frequency_1pm, dtype=float)) ** 2
        result = TWO_PI * self.gain * squared**self.order
        for corner in self.corners_radpm:
            result = result / (squared + corner**2)
        return np.asarray(result)

    def variance(self, wavelengths_m: tuple[float, float]) -> float:
        """Closed-form variance, m^2, of the wavelengths from the shorter to the longer one.

        Partial fractions in W^2: each corner c contributes r/(W^2 + c^2), whose integral is
        r atan(W/c)/c, or -r/W for a corner at 0.
        """
        shortest, longest = wavelengths_m
        low, high = TWO_PI / longest, TWO_PI / shortest
        total = 0.0
        for corner in self.corners_radpm:
            residue = (-(corner**2)) ** self.order
            for other in self.corners_radpm:
                if other != corner:
                    residue /= other**2 - corner**2
            if corner == 0.0:
                total += residue * (1.0 / low - 1.0 / high)
            else:
                total += residue * (np.arctan(high / corner) - np.arctan(low / corner)) / corner
        return self.gain * total


@dataclass(frozen=True)
class TabledPsd:
    """A density between points of a table, straight in logarithms; nothing outside of them.

    Attributes
    ----------
    frequency_1pm : tuple of float
        Spatial frequencies, rising; none for a density that is nothing.
    density_m3 : tuple of float
        One-sided densities there, m^2/(1/m), positive.
    """

    frequency_1pm: tuple[float, ...]
    density_m3: tuple[float, ...]

    def density(self, frequency_1pm: npt.ArrayLike) -> FloatArray:
        """One-sided density in m^2/(1/m) at spatial frequencies > 0."""
        frequency = np.asarray(frequency_1pm, dtype=float)
        if not self.frequency_1pm:
            return np.zeros_like(frequency)
        logs = np.interp(np.log(frequency), np.log(self.frequency_1pm), np.log(self.density_m3))
        inside = (frequency >= self.frequency_1pm[0]) & (frequency <= self.frequency_1pm[-1])
        return np.asarray(np.where(inside, np.exp(logs), 0.0))


Psd = RationalPsd | TabledPsd


@dataclass(frozen=True)
class Spectrum:
    """The four densities of one track quality.

    Attributes
    ----------
    name, source : str
        Its name in a scenario, and where it comes from.
    densities : mapping of str to RationalPsd or TabledPsd
        One for each of `simrail.core.columns.IRREGULARITY`: alignment and vertical profile (mean of the
        rails), cross-level (left minus right height), gauge (left minus right lateral).
    gauge_limits_m : tuple of float, optional
        Least and greatest deviation of the gauge from the nominal one that a realisation may have; None
        for a gauge that is Gaussian, as the density says.
    """

    name: str
    source: str
    densities: Mapping[str, Psd]
    gauge_limits_m: tuple[float, float] | None = None


@dataclass(frozen=True)
class OwnSpectrum:
    """A person's spectrum, from a file.

    Attributes
    ----------
    name : str
        What to call it: the file.
    digest : str
        SHA-256 of its table: equal spectra have equal ones, whatever their file is called.
    spectrum : Spectrum
        The densities.
    notes : tuple of str
        What it does not hold.
    """

    name: str = field(compare=False)
    digest: str
    spectrum: Spectrum = field(compare=False, repr=False)
    notes: tuple[str, ...] = field(default=(), compare=False, repr=False)


def _spectrum(
    name: str,
    source: str,
    alignment: RationalPsd,
    vertical: RationalPsd,
    *,
    level: RationalPsd,
    gauge: RationalPsd,
    gauge_limits_m: tuple[float, float] | None = None,
) -> Spectrum:
    densities = dict(zip(IRREGULARITY, (alignment, vertical, level, gauge), strict=True))
    return Spectrum(name, source, densities, gauge_limits_m)


def _erri(name: str, alignment: float, vertical: float, *, gauge: float) -> Spectrum:
    """ERRI B176; amplitudes in m rad."""
    corner, rise, level = 0.8246, 0.0206, 0.4380  # rad/m
    return _spectrum(
        name,
        "ORE/ERRI B176",
        RationalPsd(alignment * corner**2, 0, (rise, corner)),
        RationalPsd(vertical * corner**2, 0, (rise, corner)),
        # An angle of density A_v/b^2 (...), as a height over the base 2 b.
        level=RationalPsd(4.0 * vertical * corner**2, 1, (rise, corner, level)),
        gauge=RationalPsd(gauge * corner**2, 1, (rise, corner, level)),
    )


INCH_M, NOMINAL_GAUGE_M = 0.0254, 1.435

LEAST_GAUGE_IN = 56.0
GREATEST_GAUGE_IN = {1: 58.0, 2: 57.75, 3: 57.75, 4: 57.5, 5: 57.5, 6: 57.5}
"""49 CFR 213.53 (b), inches, by FRA class; that of class 6 is class 5's."""


def _fra(number: int, vertical: float, alignment: float, *, level: float, limited: bool = True) -> Spectrum:
    """FRA class in the AAR form; amplitudes in cm^2 rad/m, `level` the corner of cross-level in rad/m."""
    corner, k = 0.8245, 0.25
    scale = k * 1e-4 * corner**2
    across = RationalPsd(4.0 * scale * vertical, 0, (corner, level))
    limits = tuple(
        inches * INCH_M - NOMINAL_GAUGE_M for inches in (LEAST_GAUGE_IN, GREATEST_GAUGE_IN[number])
    )
    return _spectrum(
        f"fra_{number}" if limited else f"fra_{number}_formula",
        f"FRA track class {number}, AAR form" + (", gauge within 49 CFR 213.53" if limited else ""),
        RationalPsd(scale * alignment, 0, (0.0, corner)),
        RationalPsd(scale * vertical, 0, (0.0, corner)),
        level=across,
        gauge=across,
        gauge_limits_m=(limits[0], limits[1]) if limited else None,
    )


_FRA: tuple[tuple[int, float, float, float], ...] = (
    (1, 1.2107, 3.3634, 0.6046),
    (2, 1.0181, 1.2107, 0.9308),
    (3, 0.6816, 0.4128, 0.8520),
    (4, 0.5376, 0.3027, 1.1312),
    (5, 0.2095, 0.0762, 0.8209),
    (6, 0.0339, 0.0339, 0.4380),
)
"""Class, amplitudes of vertical profile and alignment in cm^2 rad/m, corner of cross-level in rad/m."""


_SMOOTH = RationalPsd(0.0, 0, (1.0, 2.0))

SPECTRA: dict[str, Spectrum] = {
    spectrum.name: spectrum
    for spectrum in (
        _spectrum("none", "no irregularity", _SMOOTH, _SMOOTH, level=_SMOOTH, gauge=_SMOOTH),
        _erri("erri_b176_low", 2.119e-7, 4.032e-7, gauge=5.32e-8),
        _erri("erri_b176_high", 6.125e-7, 1.08e-6, gauge=1.032e-7),
        *(_fra(number, up, across, level=corner) for number, up, across, corner in _FRA),
        *(_fra(number, up, across, level=corner, limited=False) for number, up, across, corner in _FRA),
    )
}
"""Every spectrum by name."""
