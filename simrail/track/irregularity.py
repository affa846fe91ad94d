"""Draws track irregularities: what the rails deviate from the design, as a function of s and a seed.

The realisation is a sum of harmonics with fixed amplitudes and random phases,

    r(s) = sum over k of sqrt(2 S(f_k) df) cos(2 pi f_k s + p_k),   f_k = k df,   df = 1/65536 m,

on a frequency grid that never changes. So the value at s depends on s, the seed and the spectrum, never on
the length of the track or on what was sampled before; another band keeps the phases of the waves that
remain. The four irregularities have independent streams.

Where a spectrum names limits [low, high] of the gauge, the sum r is bent into them,

    g = c + h tanh(r / h),   c = (high + low)/2,   h = (high - low)/2,

the middle of the limits being where a Gaussian process of its width fits best: the gauge is then wider than
nominal in the mean, by c, and what lies well within the limits keeps the density of the spectrum.

This module knows nothing of rails or splines: see `simrail.track.laid_track`.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from simrail.core.columns import IRREGULARITY
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.track.defects import Defect
from simrail.track.elements import require_number
from simrail.track.measured import MeasuredRails
from simrail.track.sections import SectionGain
from simrail.track.spectra import SPECTRA, OwnSpectrum, Spectrum

PERIOD_M = 65536.0
"""Length after which a realisation repeats itself."""

SHORTEST_WAVELENGTH_M = 0.25
"""Shortest wavelength that has a phase."""

SAMPLES_PER_WAVE = 8
"""Knots that the shortest wave needs to be carried by a cubic spline (to 0.2 % of its amplitude)."""


OWN = "own"
"""Name of the spectrum of a file."""

SCALES = ("scale", *(f"{column.removesuffix('_m')}_scale" for column in IRREGULARITY))
"""Names of the factors on the amplitudes."""


@dataclass(frozen=True)
class Irregularity:
    """What the rails deviate from the design, before a seed draws it.

    Attributes
    ----------
    spectrum : str
        A key of `simrail.track.spectra.SPECTRA`, or `OWN` with ``own_spectrum``.
    wavelengths_m : tuple of float
        Shortest and longest wavelength.
    fade_m : float
        Length over which the irregularities rise from zero where they begin and fall where they end.
    scale : float
        Factor on the amplitudes of all four.
    alignment_scale, vertical_profile_scale, cross_level_scale, gauge_scale : float
        Factor on the amplitudes of one, beside `scale`.
    start_m, end_m : float, optional
        Where what the spectrum gives begins and ends, s along the track; with the track if not given.
    defects : tuple of Defect
        Discrete defects, added to it.
    measured : MeasuredRails, optional
        Rails from a file, added to what the spectrum gives or in its place; they fade as it does.
    own_spectrum : OwnSpectrum, optional
        A spectrum from a file.
    section_gain : SectionGain, optional
        Gain by sections on alignment, vertical profile and cross-level that the spectrum gives; the gauge
        keeps its limits.
    """

    spectrum: str = "none"
    wavelengths_m: tuple[float, float] = (3.0, 100.0)
    fade_m: float = 40.0
    scale: float = 1.0
    alignment_scale: float = 1.0
    vertical_profile_scale: float = 1.0
    cross_level_scale: float = 1.0
    gauge_scale: float = 1.0
    start_m: float | None = None
    end_m: float | None = None
    defects: tuple[Defect, ...] = ()
    measured: MeasuredRails | None = None
    section_gain: SectionGain | None = None
    own_spectrum: OwnSpectrum | None = None

    def describe(self) -> dict[str, Any]:
        """Plain data that tells this irregularity from every other; of measured rails their digest."""
        plain = asdict(replace(self, measured=None, own_spectrum=None))
        del plain["own_spectrum"]
        if self.own_spectrum is not None:
            plain["own_spectrum"] = self.own_spectrum.digest
        if self.measured is not None:
            of_file = self.measured
            plain["measured"] = [of_file.digest, of_file.replaces_spectrum, of_file.has_cant]
        return plain

    @property
    def drawn_from(self) -> Spectrum:
        """The spectrum that its name or its file means."""
        return SPECTRA[self.spectrum] if self.own_spectrum is None else self.own_spectrum.spectrum

    def scale_of(self, column: str) -> float:
        """Factor on the amplitudes of one of `simrail.core.columns.IRREGULARITY`."""
        own: float = getattr(self, f"{column.removesuffix('_m')}_scale")
        return self.scale * own

    def check(self) -> None:
        """Refuse what cannot be drawn.

        Raises
        ------
        InputError
            Naming the field and its limit.
        """
        if self.spectrum not in SPECTRA and not (self.spectrum == OWN and self.own_spectrum is not None):
            raise InputError(
                "is unknown", field="spectrum", value=self.spectrum, limit="one of " + ", ".join(SPECTRA)
            )
        require_number(self.fade_m, "fade_m", least=0.0)
        for name in SCALES:
            require_number(getattr(self, name), name, least=0.0)
        if not SHORTEST_WAVELENGTH_M <= self.wavelengths_m[0] < self.wavelengths_m[1] <= PERIOD_M / 16:
            raise InputError(
                "is not a band",
                field="wavelengths_m",
                value=self.wavelengths_m,
                limit=f"{SHORTEST_WAVELENGTH_M:g} <= shortest < longest <= {PERIOD_M / 16:g} m",
            )
        if self.measured is not None:
            self.measured.check_carries(self.wavelengths_m[0])


def realise(irregularity: Irregularity, column: str, *, seed: int, step_m: float) -> FloatArray:
    """One period of one irregularity, without fade.

    Parameters
    ----------
    irregularity : Irregularity
        Spectrum, band and scale.
    column : str
        One of `simrail.core.columns.IRREGULARITY`.
    seed : int
        Root seed.
    step_m : float
        Sample distance; the period must be a multiple of it.

    Returns
    -------
    ndarray (PERIOD_M / step_m,)
        Values in m at s = 0, step, 2 step, ...; s < 0 wraps around.

    Raises
    ------
    InputError
        If the step does not divide the period or is too coarse for the shortest wave.
    """
    irregularity.check()
    n = round(PERIOD_M / step_m)
    if n * step_m != PERIOD_M or n % 2 or step_m * SAMPLES_PER_WAVE > irregularity.wavelengths_m[0]:
        raise InputError(
            "does not carry these wavelengths",
            field="step_m",
            value=step_m,
            limit=f"a divisor of {PERIOD_M:g} m, <= shortest wavelength / {SAMPLES_PER_WAVE}",
            remedy="take 0.125 m or a half or a quarter of it, or longer waves",
        )
    generator = stream(seed, "track", "irregularity", column.removesuffix("_m"))
    phases = generator.uniform(0.0, 2.0 * np.pi, int(PERIOD_M / SHORTEST_WAVELENGTH_M))
    shortest, longest = irregularity.wavelengths_m
    first, last = int(np.ceil(PERIOD_M / longest)), int(np.floor(PERIOD_M / shortest))
    harmonics = np.arange(first, last + 1)
    spectrum, scale = irregularity.drawn_from, irregularity.scale_of(column)
    limits = spectrum.gauge_limits_m if column == "gauge_m" else None
    # Within limits a factor above 1 must not lead out of them: it widens what is bent into them.
    before = scale if limits is None else max(scale, 1.0)
    density = spectrum.densities[column].density(harmonics / PERIOD_M)
    amplitudes = before * np.sqrt(2.0 * density / PERIOD_M)
    lines = np.zeros(n // 2 + 1, dtype=complex)
    lines[harmonics] = 0.5 * n * amplitudes * np.exp(1j * phases[harmonics - 1])
    drawn = np.fft.irfft(lines, n)
    return drawn if limits is None else min(scale, 1.0) * within_limits(drawn, limits)


def within_limits(values: FloatArray, limits: tuple[float, float]) -> FloatArray:
    """Values (n,) bent into limits: c + h tanh(value / h), c the middle of the limits, h half their width."""
    low, high = limits
    middle, half = 0.5 * (high + low), 0.5 * (high - low)
    return middle + half * np.tanh(values / half)


def realise_all(irregularity: Irregularity, *, seed: int, step_m: float) -> FloatArray:
    """One period of all four irregularities in the order of `simrail.core.columns.IRREGULARITY`, (n, 4)."""
    return np.stack([realise(irregularity, name, seed=seed, step_m=step_m) for name in IRREGULARITY], axis=-1)


def fade(s_m: FloatArray, start_m: float, *, end_m: float, length_m: float) -> FloatArray:
    """Factor that rises from 0 at the start and falls to 0 at the end, as quintic smooth steps, (n,)."""
    if length_m == 0.0:
        return np.ones_like(s_m)
    u = np.clip(np.minimum(s_m - start_m, end_m - s_m) / length_m, 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
