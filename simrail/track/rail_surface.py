"""The running surfaces of both rails at short waves: what a multibody ride does not see.

Heights over the track, to be added to the laid track's rails, of named sources: roughness by a table, with
a gain by sections; welds; joints; what passing over sleepers is equivalent to; corrugation in sharp curves.
The sum lies on a uniform grid as coefficients of a cubic B-spline, C2 along the track.

Roughness repeats itself after `PERIOD_M`; of its random phases each rail has its own stream. A value
depends on the place, the seed and the source, never on what else is switched on.

Sources of figures are named at each class; those called synthetic are this project's own.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import spline_filter1d

from simrail.core.jit import FloatArray, njit
from simrail.core.seeds import stream
from simrail.track.design import TrackDesign
from simrail.track.roughness import RoughnessTable
from simrail.track.sections import SectionGain, section_gain

STEP_M = 1.0 / 128.0
"""Distance of the grid: 6.4 points on the shortest wave of the tables, 0.05 m."""
PERIOD_M = 8192.0
SIDES = ("left", "right")


@dataclass(frozen=True)
class Roughness:
    """Roughness of each rail by a table of levels.

    Attributes
    ----------
    table : RoughnessTable
        Levels by wavelength.
    offset_db : float
        Added to every level.
    longest_m : float
        No longer waves are drawn: those are in the laid track.
    shortest_m : float
        No shorter ones either.
    """

    table: RoughnessTable
    offset_db: float = 0.0
    longest_m: float = 1.5
    shortest_m: float = 0.05

    def density(self, frequency_1pm: FloatArray) -> FloatArray:
        """One-sided density of one rail in m^2/(1/m) at spatial frequencies (n,); 0 beyond its limits."""
        inside = (frequency_1pm > 1.0 / self.longest_m) & (frequency_1pm <= 1.0 / self.shortest_m)
        level = 10.0 ** (0.1 * self.offset_db)
        return np.where(inside, level * self.table.density(frequency_1pm), 0.0)


@dataclass(frozen=True)
class Dips:
    """Welds or joints: dips at even distances, each rail's by itself.

    A dip is a cusp ``-d exp(-|x| / l)`` that ends in a quintic step between 0.75 ``reach_m`` and ``reach_m``.
    Depths are normal, negative ones (a raised weld) included.

    Attributes
    ----------
    spacing_m : float
        From one to the next; both rails' lie opposite each other.
    depth_m, depth_sd_m : float
        Mean depth and its standard deviation.
    decay_m, reach_m : float
        Length l, and half the length of the dip.
    """

    spacing_m: float
    depth_m: float
    depth_sd_m: float
    decay_m: float = 0.12
    reach_m: float = 0.8


@dataclass(frozen=True)
class SleeperPassing:
    """Sleepers hold the rail more stiffly than the span between them: an equivalent height of both rails.

    ``-a g_i cos(2 pi u)``, with u running from 0 to 1 from one sleeper to the next and g_i a normal gain.

    Attributes
    ----------
    spacing_m, spacing_sd : float
        Mean spacing and its relative standard deviation.
    amplitude_m, amplitude_sd : float
        Mean amplitude a and its relative standard deviation.
    """

    spacing_m: float = 0.6
    spacing_sd: float = 0.01
    amplitude_m: float = 10e-6
    amplitude_sd: float = 0.25


@dataclass(frozen=True)
class Corrugation:
    """Short-pitch corrugation of the inner rail of sharp curves: one wave.

    Attributes
    ----------
    wavelength_m, amplitude_m : float
        The wave.
    radius_m : float
        Curves below this radius have it.
    """

    wavelength_m: float = 0.08
    amplitude_m: float = 15e-6
    radius_m: float = 450.0


@dataclass(frozen=True)
class RailSources:
    """What makes short waves of the rails; None for what is not there.

    Attributes
    ----------
    roughness, welds, joints, sleepers, corrugation
        The sources.
    section_gain : SectionGain, optional
        Gain of the roughness by sections.
    """

    roughness: Roughness | None = None
    welds: Dips | None = None
    joints: Dips | None = None
    sleepers: SleeperPassing | None = None
    corrugation: Corrugation | None = None
    section_gain: SectionGain | None = None


@dataclass(frozen=True, eq=False)
class RailSurface:
    """Short-wave heights of both rails.

    Attributes
    ----------
    start_m : float
        Place of the first coefficient.
    coefficients : ndarray (2, n)
        Of the cubic B-spline with knots `STEP_M` apart, left and right rail.
    """

    start_m: float
    coefficients: FloatArray

    def height(self, side: int, s_m: FloatArray) -> FloatArray:
        """Height (n,), m, of the left (0) or right (1) rail at places s."""
        out = np.empty(len(s_m))
        spline_at(self.coefficients[side], self.start_m, STEP_M, np.ascontiguousarray(s_m), out)
        return out


@njit
def spline_at(coefficients: FloatArray, start: float, step: float, x: FloatArray, out: FloatArray) -> None:
    """Values of a uniform cubic B-spline at places x (n,), into ``out``; beyond its ends the ends'."""
    last = coefficients.shape[0] - 3
    for i in range(x.shape[0]):
        u = (x[i] - start) / step
        k = min(max(int(np.floor(u)), 1), last)
        t = min(max(u - k, 0.0), 1.0)
        w = 1.0 - t
        a, b = w * w * w, t * t * t
        c = 4.0 - 6.0 * t * t + 3.0 * b
        d = 4.0 - 6.0 * w * w + 3.0 * a
        out[i] = (
            a * coefficients[k - 1] + c * coefficients[k] + d * coefficients[k + 1] + b * coefficients[k + 2]
        ) / 6.0


def lay_surface(sources: RailSources, design: TrackDesign, *, seed: int) -> RailSurface:
    """Draw the short waves of a track's rails.

    Parameters
    ----------
    sources : RailSources
        What makes them.
    design : TrackDesign
        The line: where it lies, and where its curves are.
    seed : int
        Root seed; that of the laid track.
    """
    # Some points beyond both ends, so that no spline ends on the track.
    first, last = np.floor(design.start_m / STEP_M) - 16, np.ceil(design.end_m / STEP_M) + 16
    s: FloatArray = np.arange(first, last + 1) * STEP_M
    height = np.zeros((2, len(s)))
    if sources.roughness is not None:
        gain: FloatArray | float = 1.0
        if sources.section_gain is not None:
            gain = section_gain(s, sources.section_gain, start_m=design.start_m, seed=seed)
        at = np.arange(int(first), int(last) + 1) % round(PERIOD_M / STEP_M)
        for k, side in enumerate(SIDES):
            height[k] += gain * realise_roughness(sources.roughness, side, seed=seed)[at]
    for name, dips in (("welds", sources.welds), ("joints", sources.joints)):
        if dips is not None:
            for k, side in enumerate(SIDES):
                height[k] += _dip_heights(s, dips, design, stream(seed, "track", name, side))
    if sources.sleepers is not None:
        height += _sleeper_heights(s, sources.sleepers, design, stream(seed, "track", "sleepers"))
    if sources.corrugation is not None:
        height += _corrugation_heights(s, sources.corrugation, design, stream(seed, "track", "corrugation"))
    return RailSurface(float(s[0]), np.ascontiguousarray(spline_filter1d(height, 3, axis=1, mode="nearest")))


def realise_roughness(roughness: Roughness, side: str, *, seed: int) -> FloatArray:
    """One period of a rail's roughness, heights (`PERIOD_M` / `STEP_M`,), m.

    A sum of harmonics with fixed amplitudes ``sqrt(2 S df)`` and random phases, df = 1 / `PERIOD_M`: each
    band has its power in every realisation.
    """
    n = round(PERIOD_M / STEP_M)
    harmonics = np.arange(n // 2 + 1)
    phases = stream(seed, "track", "roughness", side).uniform(0.0, 2.0 * np.pi, n // 2 + 1)
    density = np.zeros(n // 2 + 1)
    density[1:] = roughness.density(harmonics[1:] / PERIOD_M)
    amplitudes = np.sqrt(2.0 * density / PERIOD_M)
    return np.fft.irfft(0.5 * n * amplitudes * np.exp(1j * phases), n)


def dip_shape(x_m: FloatArray, decay_m: float, reach_m: float) -> FloatArray:
    """Shape (n,) of a dip of depth 1 at distances from its middle; see `Dips`."""
    away = np.abs(x_m)
    u = np.clip((reach_m - away) / (0.25 * reach_m), 0.0, 1.0)
    return -np.exp(-away / decay_m) * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


def _dip_heights(
    s: FloatArray, dips: Dips, design: TrackDesign, generator: np.random.Generator
) -> FloatArray:
    count = int((design.end_m - design.start_m) / dips.spacing_m) + 1
    begin = design.start_m + 0.5 * dips.spacing_m
    depths = dips.depth_m + dips.depth_sd_m * generator.standard_normal(count)
    height = np.zeros(len(s))
    reach = int(np.ceil(dips.reach_m / STEP_M))
    for i, depth in enumerate(depths):
        middle = round((begin + i * dips.spacing_m - s[0]) / STEP_M)
        here = slice(max(middle - reach, 0), min(middle + reach + 1, len(s)))
        x = s[here] - (begin + i * dips.spacing_m)
        height[here] += depth * dip_shape(x, dips.decay_m, dips.reach_m)
    return height


def _sleeper_heights(
    s: FloatArray, sleepers: SleeperPassing, design: TrackDesign, generator: np.random.Generator
) -> FloatArray:
    count = int(1.5 * (s[-1] - s[0]) / sleepers.spacing_m) + 4
    drawn = generator.standard_normal((count, 2))
    spacing = sleepers.spacing_m * np.clip(1.0 + sleepers.spacing_sd * drawn[:, 0], 0.5, 1.5)
    places = min(design.start_m, float(s[0])) + np.concatenate([[0.0], np.cumsum(spacing)[:-1]])
    gains = 1.0 + sleepers.amplitude_sd * drawn[:, 1]
    turn = np.interp(s, places, np.arange(count))
    # Between two sleepers the gain passes from one's to the next one's.
    height: FloatArray = -sleepers.amplitude_m * np.interp(s, places, gains) * np.cos(2.0 * np.pi * turn)
    return height


def _corrugation_heights(
    s: FloatArray, corrugation: Corrugation, design: TrackDesign, generator: np.random.Generator
) -> FloatArray:
    coarse: FloatArray = np.clip(np.arange(s[0], s[-1] + 1.0, 1.0), design.start_m, design.end_m)
    curvature = design.frame(coarse).rates[:, 2]
    # It comes and goes over the ten per cent of curvature around the limit.
    sharp = np.clip((np.abs(curvature) * corrugation.radius_m - 0.95) / 0.1, 0.0, 1.0)
    wave = corrugation.amplitude_m * np.sin(
        2.0 * np.pi * (s / corrugation.wavelength_m + generator.uniform())
    )
    height: FloatArray = np.zeros((2, len(s)))
    for k, sign in enumerate((1.0, -1.0)):  # a curve to the left has its inner rail on the left
        height[k] = wave * np.interp(s, coarse, sharp * (curvature * sign > 0.0))
    return height
