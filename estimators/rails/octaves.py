"""Lines along the track, cut into octaves of wavelength that add up to them again."""

from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray

LONGEST_M = 128.0
"""Centre of the last octave, which holds all longer waves as well."""


class Octaves(NamedTuple):
    """A bank of filters without shift, by Fourier's transform of the line turned about both its ends.

    In log2 of the wavelength each filter is a raised cosine from the centre of the octave before to that of
    the next one, so that the gains add up to 1 at every wavelength.

    Attributes
    ----------
    wavelengths_m : ndarray (k,)
        Centres, each twice the one before.
    gains : ndarray (k, frequencies)
    frequencies_1pm : ndarray (frequencies,)
    places : int
        Of a line.
    """

    wavelengths_m: FloatArray
    gains: FloatArray
    frequencies_1pm: FloatArray
    places: int

    def cut(self, lines: FloatArray) -> FloatArray:
        """Octaves (k, ..., n) of lines (..., n)."""
        spectrum = np.fft.rfft(turned(lines), axis=-1)
        parts = [np.fft.irfft(spectrum * gain, 3 * self.places, axis=-1) for gain in self.gains]
        middle: FloatArray = np.stack(parts)[..., self.places : 2 * self.places]
        return middle

    def passed(self, lines: FloatArray, gain: FloatArray) -> FloatArray:
        """Lines (..., n) by a gain over `frequencies_1pm`."""
        spectrum = np.fft.rfft(turned(lines), axis=-1) * gain
        middle: FloatArray = np.fft.irfft(spectrum, 3 * self.places, axis=-1)[
            ..., self.places : 2 * self.places
        ]
        return middle

    def between(self, waves_m: tuple[float, float]) -> FloatArray:
        """Gain that passes waves between two lengths, with flanks of half an octave on either side."""
        with np.errstate(divide="ignore"):
            at = -np.log2(self.frequencies_1pm)
        inside = np.clip(2.0 * np.minimum(at - np.log2(waves_m[0]), np.log2(waves_m[1]) - at), -1.0, 1.0)
        gain: FloatArray = 0.5 + 0.5 * np.sin(0.5 * np.pi * inside)
        return gain

    def density(self, variance: FloatArray) -> FloatArray:
        """Spectral density over `frequencies_1pm`, m2/(1/m), of a line with these variances (k,) in octaves.

        Straight from centre to centre where both have logarithms; level beyond the outer ones.
        """
        at = np.log(np.maximum(self.frequencies_1pm, 1.0 / LONGEST_M))
        level = np.log(np.maximum(variance / self.bandwidths_1pm, 1e-300))
        density: FloatArray = np.exp(np.interp(at, -np.log(self.wavelengths_m[::-1]), level[::-1]))
        return density

    def total(self, variance: FloatArray) -> float:
        """Variance of a line with these variances (k,) in octaves, which overlap."""
        return self.sum_of(self.density(variance))

    def sum_of(self, density: FloatArray) -> float:
        """Variance of a line with this spectral density."""
        return float(density.sum() * self.frequencies_1pm[1])

    @property
    def bandwidths_1pm(self) -> FloatArray:
        """Of white noise each octave lets this much of its (one-sided) spectral density pass, (k,)."""
        widths: FloatArray = np.square(self.gains).sum(axis=1) * self.frequencies_1pm[1]
        return widths

    @property
    def freedoms(self) -> FloatArray:
        """Degrees of freedom of a mean square over the line, (k,): two for each wave that fits in."""
        length = self.places / (2.0 * self.frequencies_1pm[-1])  # of steps of half the shortest wave
        return np.asarray(np.maximum(2.0 * length * self.bandwidths_1pm, 1.0))


def octaves_of(count: int, step_m: float) -> Octaves:
    """Octaves for lines of so many places, a step apart; the first begins at or below two steps."""
    frequencies = np.asarray(np.fft.rfftfreq(3 * count, step_m), dtype=np.float64)
    first = np.floor(np.log2(2.0 * step_m))
    centres: FloatArray = np.arange(first, np.log2(LONGEST_M) + 0.5, dtype=np.float64)
    with np.errstate(divide="ignore"):
        at = -np.log2(frequencies)  # log2 of the wavelength
    inside = np.clip(at, centres[0], centres[-1])
    away = np.abs(inside[None, :] - centres[:, None])
    gains = np.where(away < 1.0, 0.5 + 0.5 * np.cos(np.pi * np.minimum(away, 1.0)), 0.0)
    return Octaves(np.exp2(centres), gains, frequencies, count)


def turned(lines: FloatArray) -> FloatArray:
    """Lines (..., n) with themselves, turned about their ends, before and behind, (..., 3 n)."""
    before = 2.0 * lines[..., :1] - lines[..., :0:-1]
    behind = 2.0 * lines[..., -1:] - lines[..., -2::-1]
    # A turned line has n - 1 places besides its end: the outermost is repeated.
    return np.concatenate([before[..., :1], before, lines, behind, behind[..., -1:]], axis=-1)
