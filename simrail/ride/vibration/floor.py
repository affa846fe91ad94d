"""What shakes the floor of a car body besides its wheels: equipment, traction, passengers.

Vertical accelerations of the whole floor, made so that velocity and position are their integrals: lines in
closed form, noise as a record of harmonics that are integrated one by one, and where a gain follows the ride
the product rule. A record repeats itself; its length is no multiple of anything on the line.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from simrail.core.jit import FloatArray, IntArray
from simrail.core.seeds import stream
from simrail.ride.vibration.sources import Equipment, Vibration

_RECORD = 1 << 16
"""Samples of a record of noise."""
_KNOT_S = 0.5
"""Distance of the knots of a gain over time."""
_STANDS_MPS = 0.05


def band_noise(band_hz: tuple[float, float], rate_hz: float, generator: np.random.Generator) -> FloatArray:
    """A record (65536, 3) of even noise in a band, rms acceleration 1: position, velocity, acceleration."""
    frequency = np.fft.rfftfreq(_RECORD, 1.0 / rate_hz)
    inside = (frequency >= band_hz[0]) & (frequency < band_hz[1])
    phases = generator.uniform(0.0, 2.0 * np.pi, len(frequency))
    lines = np.zeros(len(frequency), dtype=complex)
    lines[inside] = 0.5 * _RECORD * np.sqrt(2.0 / np.sum(inside)) * np.exp(1j * phases[inside])
    omega = 2j * np.pi * np.where(frequency > 0.0, frequency, 1.0)
    return np.column_stack([np.fft.irfft(lines / omega**2), np.fft.irfft(lines / omega), np.fft.irfft(lines)])


def noise_bands(vibration: Vibration) -> list[tuple[str, tuple[float, float]]]:
    """Names and bands of what shakes the floor; of lines the band from the lowest to the highest."""
    equipment = vibration.equipment
    parts = {"equipment": equipment, "traction": vibration.traction, "passengers": vibration.passengers}
    bands = [(f"{name}.band_hz", part.band_hz) for name, part in parts.items() if part is not None]
    if equipment is not None and equipment.lines_hz:
        bands.append(("equipment.lines_hz", (min(equipment.lines_hz), max(equipment.lines_hz))))
    return bands


class Floor:
    """The floor of one car body over a ride.

    Parameters
    ----------
    vibration : Vibration
        What shakes.
    body : str
        Whose floor.
    time_s, speed_mps, acceleration_mps2 : ndarray (n,)
        Speed and acceleration along the track at coarse times, for what follows them.
    rate_hz : float
        Rate of the samples asked for.
    seed : int
        Root seed.
    """

    def __init__(
        self,
        vibration: Vibration,
        body: str,
        *,
        time_s: FloatArray,
        speed_mps: FloatArray,
        acceleration_mps2: FloatArray,
        rate_hz: float,
        seed: int,
    ) -> None:
        self._rate_hz = rate_hz
        self._lines: list[tuple[float, float, float]] = []
        self._noises: list[tuple[CubicSpline | None, float, FloatArray]] = []
        knots: FloatArray = np.arange(0.0, time_s[-1] + 2.0 * _KNOT_S, _KNOT_S)

        def gain(values: FloatArray) -> CubicSpline:
            """A smooth gain over time: means over two knots' distance, C2."""
            width = max(1, round(2.0 * _KNOT_S / (time_s[1] - time_s[0])))
            even = np.convolve(np.pad(values, width, mode="edge"), np.ones(width) / width, mode="same")
            return CubicSpline(knots, np.interp(knots, time_s, even[width:-width]))

        def noise(name: str, band_hz: tuple[float, float]) -> FloatArray:
            return band_noise(band_hz, rate_hz, stream(seed, "vibration", name, body))

        equipment, traction, passengers = vibration.equipment, vibration.traction, vibration.passengers
        if equipment is not None:
            self._add_equipment(equipment, noise("equipment", equipment.band_hz), seed, body)
        if traction is not None:
            curve = gain(np.abs(acceleration_mps2))
            self._noises.append((curve, traction.share, noise("traction", traction.band_hz)))
        if passengers is not None:
            curve = gain((np.abs(speed_mps) < _STANDS_MPS).astype(np.float64))
            self._noises.append((curve, passengers.rms_mps2, noise("passengers", passengers.band_hz)))

    def _add_equipment(self, part: Equipment, noise: FloatArray, seed: int, body: str) -> None:
        """Lines of half the power, noise of the other half; noise of all where there are no lines."""
        count = len(part.lines_hz)
        phases = stream(seed, "vibration", "lines", body).uniform(0.0, 2.0 * np.pi, count)
        share = 0.5 if count else 1.0
        for frequency, phase in zip(part.lines_hz, phases, strict=True):
            self._lines.append((part.rms_mps2 * np.sqrt(1.0 / count), frequency, phase))
        self._noises.append((None, part.rms_mps2 * np.sqrt(share), noise))

    def at(self, samples: IntArray) -> FloatArray:
        """Heave of the floor (n, 3) at numbers of samples: position, velocity, acceleration."""
        t = samples / self._rate_hz
        out = np.zeros((len(samples), 3))
        for amplitude, frequency, phase in self._lines:
            omega = 2.0 * np.pi * frequency
            wave = amplitude * np.exp(1j * (omega * t + phase))
            out += np.column_stack([wave / (1j * omega) ** 2, wave / (1j * omega), wave]).real
        for curve, size, record in self._noises:
            x, v, a = size * record[samples % _RECORD].T
            if curve is None:
                out += np.column_stack([x, v, a])
                continue
            g, g1, g2 = curve(t), curve(t, 1), curve(t, 2)
            out += np.column_stack([g * x, g * v + g1 * x, g * a + 2.0 * g1 * v + g2 * x])
        return out
