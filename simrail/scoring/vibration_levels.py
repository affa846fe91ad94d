"""How a simulated vehicle shakes in octaves, against spectra that others have published.

The vertical acceleration of a mount while it runs at constant speed, or stands, as rms in octaves; beside it
every published spectrum of such a mount at such a speed, and the ratio of both. A mount counts as verified
if at least two operating spectra, each of a named vehicle at a told speed, have at most one octave each
outside a factor of three; test levels stand in the table, and verify nothing.
"""

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from simrail.core.columns import ACCEL
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.ride.truth import Mount, Truth
from simrail.scoring.published_spectra import (
    MOUNTS,
    OCTAVES_HZ,
    MountKind,
    PublishedSpectrum,
    octave_edges,
)
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.vibration.car_bodies import car_bodies

FACTOR = 3.0
"""Ratio, either way, within which a simulated level agrees with a published one."""

MOST_OUTSIDE = 1
"""Octaves of one spectrum that may lie outside."""

LEAST_SPECTRA = 2
"""Operating spectra that verify a mount."""

LEAST_RATE_HZ = 400.0
"""Lowest rate of a truth that holds the octave of 125 Hz."""

COLUMNS = (
    *("mount", "kind", "speed_mps", "octave_hz", "simulated_mps2", "published_mps2", "ratio", "within"),
    *("spectrum", "published_kind", "vehicle"),
)
"""Columns of the table of `compare`."""

_SAME_SPEED = 0.1
_STANDS_MPS = 1e-3
_STEADY = 0.01
_LEAST_S = 4.0
_EDGE_S = 0.5


def octave_levels(acceleration_mps2: FloatArray, rate_hz: float) -> FloatArray:
    """Rms (5,) in the octaves `OCTAVES_HZ` of an acceleration (n,), by one periodogram with a Hann window."""
    window = np.hanning(len(acceleration_mps2))
    lines = np.fft.rfft((acceleration_mps2 - acceleration_mps2.mean()) * window)
    power = 2.0 * np.abs(lines) ** 2 / (len(window) * np.sum(window**2))
    frequency = np.fft.rfftfreq(len(window), 1.0 / rate_hz)
    edges = [octave_edges(centre) for centre in OCTAVES_HZ]
    return np.sqrt([power[(frequency >= low) & (frequency < high)].sum() for low, high in edges])


def mount_kind(body: str, vehicle: VehicleModel) -> MountKind:
    """What a body of a vehicle is to one who mounts a sensor on it."""
    if body in vehicle.axle_names:
        return "axle"
    return "floor" if body in {car.name for car in car_bodies(vehicle)} else "frame"


def steady_levels(truth: Truth, mount: Mount) -> dict[float, FloatArray]:
    """Octave levels of a mount while the vehicle stands, and while it runs at its greatest speed.

    Returns
    -------
    dict of float to ndarray (5,)
        Rms, m/s2, by the speed; a state that lasts for less than 4 s is left out.

    Raises
    ------
    InputError
        If the truth's rate is too low.
    """
    if truth.rate_hz < LEAST_RATE_HZ:
        raise InputError(
            "is too low for the octave of 125 Hz",
            field="truth_rate_hz",
            value=truth.rate_hz,
            limit=f">= {LEAST_RATE_HZ:g}",
            remedy="take a whole multiple of the IMU's rate above it",
        )
    speed = np.abs(np.gradient(np.asarray(truth.reference_position_m), 1.0 / truth.rate_hz))
    # Shaking of the guided point is no change of speed: what lasts for less than a second does not count.
    width = round(truth.rate_hz)
    speed = np.convolve(np.pad(speed, width // 2, mode="edge"), np.ones(width) / width, mode="same")
    speed = speed[width // 2 : width // 2 + len(truth.time_s)]
    greatest = float(speed.max())
    acceleration = truth.motion(mount, columns=(ACCEL[2],))[ACCEL[2]].to_numpy()
    levels = {}
    for state, name in ((speed < _STANDS_MPS, 0.0), (speed > (1.0 - _STEADY) * greatest, greatest)):
        here = _longest(state, round(_EDGE_S * truth.rate_hz))
        if here.stop - here.start >= _LEAST_S * truth.rate_hz and (name == 0.0 or greatest > _STANDS_MPS):
            levels[round(name, 2)] = octave_levels(acceleration[here], truth.rate_hz)
    return levels


def _longest(state: np.ndarray, edge: int) -> slice:
    """The longest run of True, less some samples at either end."""
    change = np.flatnonzero(np.diff(np.concatenate([[0], state.astype(np.int8), [0]])))
    begins, ends = change[::2], change[1::2]
    if not len(begins):
        return slice(0, 0)
    at = int(np.argmax(ends - begins))
    return slice(int(begins[at]) + edge, max(int(ends[at]) - edge, int(begins[at]) + edge))


def compare(
    levels: Mapping[tuple[str, MountKind, float], FloatArray], spectra: Iterable[PublishedSpectrum]
) -> pd.DataFrame:
    """Lay simulated levels beside published ones.

    Parameters
    ----------
    levels : mapping of (str, str, float) to ndarray (5,)
        Rms in the octaves by name of the mount, its kind, and the speed in m/s.
    spectra : iterable of PublishedSpectrum
        An operating one counts for speeds within 10 % of its own, a test level for all but 0.

    Returns
    -------
    DataFrame
        Columns `COLUMNS`; one row per mount, speed, spectrum and octave. Where nothing was published,
        ``spectrum`` is empty and the ratio NaN.
    """
    known = list(spectra)
    rows: list[tuple[object, ...]] = []
    for (mount, kind, speed), simulated in levels.items():
        there = [one for one in known if one.mount == kind and _is_of(one, speed)]
        for octave, level in zip(OCTAVES_HZ, simulated, strict=True):
            own = (mount, kind, speed, octave, float(level))
            of_octave = [one for one in there if octave in one.rms_mps2]
            for one in of_octave:
                ratio = float(level) / one.rms_mps2[octave]
                within = 1.0 / FACTOR <= ratio <= FACTOR
                published = (one.rms_mps2[octave], ratio, within, one.name, one.kind, one.vehicle)
                rows.append((*own, *published))
            if not of_octave:
                rows.append((*own, np.nan, np.nan, None, "", "", ""))
    return pd.DataFrame.from_records(rows, columns=list(COLUMNS))


def _is_of(spectrum: PublishedSpectrum, speed_mps: float) -> bool:
    if spectrum.speed_mps is None:
        return speed_mps > 0.0
    return abs(speed_mps - spectrum.speed_mps) <= _SAME_SPEED * spectrum.speed_mps


def verdicts(table: pd.DataFrame) -> dict[MountKind, str]:
    """What a table of `compare` says of each kind of mount: "verified", or "unverified" and why."""
    said: dict[MountKind, str] = {}
    for kind in MOUNTS:
        rows = table[(table["kind"] == kind) & (table["published_kind"] == "operating")]
        if not len(rows):
            said[kind] = "unverified: no operating spectrum of a named vehicle at a told speed"
            continue
        outside = (~rows["within"].astype(bool)).groupby([rows["spectrum"], rows["mount"], rows["speed_mps"]])
        off = int((outside.sum() > MOST_OUTSIDE).groupby("spectrum").any().sum())
        spectra = rows["spectrum"].nunique()
        at = ", ".join(f"{speed:g}" for speed in sorted(rows["speed_mps"].unique()))
        if off:
            said[kind] = f"unverified: {off} of {spectra} spectra off by more than {FACTOR:g} at {at} m/s"
        elif spectra < LEAST_SPECTRA:
            said[kind] = f"unverified: one spectrum alone, at {at} m/s, which it agrees with"
        else:
            said[kind] = f"verified by {spectra} spectra at {at} m/s"
    return said
