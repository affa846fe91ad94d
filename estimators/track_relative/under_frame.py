"""The rails under a bogie frame: places for what `simrail.estimators.track_relative.suspension` says in time.

The vertical profile is the mean of what the front axle says of a place and of what the rear one does. Of the
cross-level a frame shows the mean under its axles, M, which is blind to waves of twice the wheelbase; the
rails' own follows by Wiener's filter,

    C(k) = conj(G) S / (|G|^2 S + N) M(k),      G = mean of exp(i k x) over the axles' places x,

with S the spectrum of the rails, of two filters of first order, as large as M is, and N that of what wheels
do between the rails. Its error has the spectrum S N/(|G|^2 S + N).

A drawing errs. The share e by which each of its numbers does is normal; to first order M and the heights of
the axles follow it, by slopes D. The rails do not know where curves begin, and a body sways by them: so the
ride says what e is, where

    sum of |M + D e|^2/P + |e/sd|^2 - sum of log |H|^2

is least. P is the spectrum of M, and H, by which the roll of the frame becomes M, is there since it is the
motion of the frame that is measured, not the rails. The sums go over waves of `FITTED_M`.

Reference: N. Wiener, Extrapolation, Interpolation, and Smoothing of Stationary Time Series, 1949.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq
from simrail.estimators.track_relative.full_rate import Held, Waviness
from simrail.estimators.track_relative.suspension import (
    UNCERTAIN,
    Bogie,
    ComplexArray,
    alone,
    axles_under,
    changed,
)
from simrail.estimators.trajectory.track_geometry import over_space

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording

TOP_HZ = 40.0
"""Frequency up to which a frame tells of its axles; beyond, its springs let nothing through."""

BLEND_S = 40.0
"""Over which the end of a ride is led over to its start, so that it is periodic."""

BLEND_M = 200.0
"""The same of what lies along the track."""

AT_ONCE = 2
"""Drawings that are worked out at a time: all of a long ride would be most of its memory."""

CHANGE = 1e-3
"""Relative step of the slopes by a drawing's numbers."""

FITTED_M, SIZED_M = (20.0, 150.0), (3.5, 15.0)
"""Waves that say how a drawing errs, and those that say how large the rails' are."""

NEIGHBOURS = 0.15
"""Share of its number by which those of a spectrum's lines go that are averaged, to either side."""

SLOW_MPS, LEAST_SIZE = 1.0, 1e-3
"""Speed that counts as motion; least size of the rails' spectrum, of the one that is expected."""

MEAN_LEVEL_M3, PROFILE_M3 = 4e-9, 8e-9
"""What wheels do to the mean cross-level under a frame, and what the vertical profile errs: white over the
track, m2 per cycle per m, two-sided; what simulated frames leave of waves of 3 to 25 m."""


class Ride(NamedTuple):
    """A ride of n samples, for a frame.

    Attributes
    ----------
    mount : tuple of float
        Place of the IMU on the frame, m.
    gravity, base : float
        m/s2, rail base in m.
    dt : float
        s.
    place : ndarray (n,)
        Of the frame's reference point, m.
    speed : float
        Median of that in motion, m/s.
    at : ndarray (g,)
        Places of the geometry, m.
    step : float
        Their distance, m.
    """

    mount: tuple[float, float, float]
    gravity: float
    base: float
    dt: float
    place: FloatArray
    speed: float
    at: FloatArray
    step: float


class Under(NamedTuple):
    """Rails under a frame, at g places.

    Attributes
    ----------
    rails, variance : ndarray (g, 2)
        Vertical profile and cross-level, m; their variance but for that of the frame's motion.
    ride : Ride
    bogie : Bogie
    gain, spectrum : ndarray (f,)
        Wiener's filter, and the spectrum of its error, m2 per cycle per m.
    slopes : ndarray (p, g, 2)
        By the shares of error of the drawing's numbers.
    share : ndarray (p,)
        Shares that were found.
    share_root : ndarray (p, p)
        Root of their covariance.
    """

    rails: FloatArray
    variance: FloatArray
    ride: Ride
    bogie: Bogie
    gain: ComplexArray
    spectrum: FloatArray
    slopes: FloatArray
    share: FloatArray
    share_root: FloatArray


def rails_under(
    recording: Recording, held: Held, motion: FloatArray, bogie: Bogie, relative_sd: float, at: FloatArray
) -> Under:
    """The rails under a frame, at uniform places (g,).

    Parameters
    ----------
    recording : Recording
    held : Held
    motion : ndarray (n, 4)
        Roll, y, z and pitch at the mount, beside what is held.
    bogie : Bogie
    relative_sd : float
        Of each number of `UNCERTAIN`.
    at : ndarray (g,)
        Places.
    """
    ride = Ride(
        mount=recording.mount_position_m,
        gravity=recording.gravity_mps2,
        base=recording.track.rail_base_m,
        dt=1.0 / recording.imu_sheet.rate_hz,
        place=held.place - recording.mount_position_m[0],
        speed=float(np.median(held.speed[held.speed > SLOW_MPS])),
        at=at,
        step=float(at[-1] - at[0]) / (len(at) - 1),
    )
    whole = motion + np.column_stack(
        [held.roll, held.y - ride.mount[0] * held.yaw, np.zeros((len(motion), 2))]
    )
    forced = np.column_stack([held.deficiency, held.track_roll])
    others = [changed(bogie, names, CHANGE) for names in UNCERTAIN]
    table = _axles(ride, [bogie, *others], whole, forced)
    slopes = (table[1:] - table[0]) / CHANGE
    mean = table[0, :, 2]
    k = 2.0 * np.pi * rfftfreq(_periodic_length(ride), ride.step)
    passed, rails = _passed(bogie, k), _spectrum_of_rails(ride, bogie, mean)
    seen = np.abs(passed) ** 2 * rails + MEAN_LEVEL_M3
    share, covariance = _fitted(ride, bogie, others, mean, slopes[:, :, 2], relative_sd)
    gain = np.asarray(np.conj(passed) * rails / seen, dtype=np.complex128)
    root = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    levels = _filtered(ride, gain, np.column_stack([mean, slopes[:, :, 2].T]))
    by_share = np.stack([slopes[:, :, :2].mean(axis=2), levels[:, 1:].T], axis=-1)
    found = np.column_stack([table[0, :, :2].mean(axis=1), levels[:, 0]])
    spectrum = rails * MEAN_LEVEL_M3 / seen
    white = np.array([PROFILE_M3 / ride.step, _variance_of(ride, spectrum)])
    return Under(
        rails=found + np.einsum("pgq,p->gq", by_share, share),
        variance=np.square(np.einsum("pgq,pr->rgq", by_share, root)).sum(axis=0) + white,
        ride=ride,
        bogie=bogie,
        gain=gain,
        spectrum=spectrum,
        slopes=by_share,
        share=share,
        share_root=root,
    )


def draw_under(under: Under, motion: FloatArray, rng: np.random.Generator) -> FloatArray:
    """A draw (g, 2) of true minus found rails; ``motion`` (n, 4) is a draw of the motion's error."""
    ride = under.ride
    table = _axles(ride, [under.bogie], motion, np.zeros((len(motion), 2)))[0]
    level = _filtered(ride, under.gain, table[:, 2:])[:, 0]
    shares = under.share_root @ rng.standard_normal(len(under.share))
    length = _periodic_length(ride)
    scale = np.sqrt(under.spectrum / ride.step)
    missed = irfft(rfft(rng.standard_normal(length)) * scale, length)[: len(ride.at)]
    white = np.sqrt(PROFILE_M3 / ride.step) * rng.standard_normal(len(ride.at))
    error = np.column_stack([table[:, :2].mean(axis=1) + white, level + missed])
    return np.asarray(error + np.einsum("pgq,p->gq", under.slopes, shares))


def _axles(ride: Ride, bogies: list[Bogie], motion: FloatArray, forced: FloatArray) -> FloatArray:
    """Heights of front and rear axle and mean cross-level, at the places, for each of b bogies, (b, g, 3).

    ``motion`` (n, 4) is roll, y, z and pitch of the mount, ``forced`` (n, 2) cant deficiency and track roll.
    """
    x, y, height = ride.mount
    roll, pitch, up = motion[:, 0], motion[:, 3], height - bogies[0].height
    at_centre = [motion[:, 1] + up * roll, motion[:, 2] + x * pitch - y * roll, roll, pitch, *forced.T]
    extra, n = round(BLEND_S / ride.dt), len(motion)
    length = next_fast_len(n + extra, real=True)
    top = min(int(TOP_HZ * length * ride.dt), length // 2)
    spectra = [rfft(_blended(column, length))[:top] for column in at_centre]
    frame = alone(*spectra)
    if len(bogies[0].bearers) > 1:
        ground = _ground(ride, bogies[0], np.column_stack([at_centre[0], roll, forced]))
        frame = frame._replace(ground=np.array([rfft(_blended(each, length))[:top] for each in ground.T]))
    del at_centre
    s = np.asarray(2j * np.pi * rfftfreq(length, ride.dt)[:top], dtype=np.complex128)
    count = next_fast_len(4 * top, real=True)
    time = np.arange(count) * (length * ride.dt / count)
    time = time[time <= (n - 1) * ride.dt]
    place = np.interp(time, np.arange(n) * ride.dt, ride.place)
    scale = np.array([1.0, 1.0, ride.base]) * count / length
    shifts = (bogies[0].front, bogies[0].rear, 0.0)
    out = np.empty((len(bogies), len(ride.at), 3))
    for first in range(0, len(bogies), AT_ONCE):
        some = bogies[first : first + AT_ONCE]
        table = np.empty((3, len(time), len(some)))
        for number, bogie in enumerate(some):
            found = axles_under(bogie, frame, s, ride.gravity)
            for i in range(3):
                table[i, :, number] = irfft(scale[i] * found[i], count)[: len(time)]
        for i in range(3):
            out[first : first + AT_ONCE, :, i] = _over_places(ride, place + shifts[i], table[i]).T
    return out


def _ground(ride: Ride, bogie: Bogie, values: FloatArray) -> FloatArray:
    """Mean over all frames that bear the load, in the axes of the track under this one.

    ``values`` (n, 4) are y, roll, cant deficiency and track roll of this frame; farther along the track
    another frame does what this one does there, on a track that may roll by another angle.
    """
    found = []
    for shift in bogie.bearers:
        y, roll, deficiency, track_roll = _elsewhere(ride, values, shift).T
        more = track_roll - values[:, 3]
        found.append([y - bogie.height * more, roll + more, deficiency - more, values[:, 3]])
    return np.asarray(np.mean(found, axis=0).T)


def _elsewhere(ride: Ride, values: FloatArray, shift: float) -> FloatArray:
    """Values (n, m) of the ride as they are farther along the track."""
    if shift == 0.0:
        return values
    over = over_space(ride.place, values, step_m=ride.step)
    place = ride.place + shift
    return np.column_stack([np.interp(place, over.position_m, column) for column in over.values.T])


def _over_places(ride: Ride, place: FloatArray, values: FloatArray) -> FloatArray:
    """Samples (n, m) taken at places, brought to those of the geometry (g, m); beyond its ends as there."""
    brought = over_space(place, values, step_m=ride.step)
    return np.column_stack([np.interp(ride.at, brought.position_m, column) for column in brought.values.T])


def _blended(values: FloatArray, length: int) -> FloatArray:
    """Values (n,) made as long as asked for, led from their end over to their start."""
    ahead = length - len(values)
    share = 0.5 - 0.5 * np.cos(np.pi * (np.arange(ahead) + 0.5) / ahead)
    return np.concatenate([values, values[-1] + share * (values[0] - values[-1])])


def _periodic_length(ride: Ride) -> int:
    return int(next_fast_len(len(ride.at) + round(BLEND_M / ride.step), real=True))


def _spectra(ride: Ride, lines: FloatArray) -> ComplexArray:
    """Of lines (g, m) over the places, (m, f)."""
    length = _periodic_length(ride)
    return np.array([rfft(_blended(line, length)) for line in lines.T])


def _filtered(ride: Ride, gain: ComplexArray, lines: FloatArray) -> FloatArray:
    """Lines (g, m) through a filter."""
    passed = irfft(gain * _spectra(ride, lines), _periodic_length(ride), axis=1)
    return np.ascontiguousarray(passed[:, : len(ride.at)].T)


def _passed(bogie: Bogie, k: FloatArray) -> ComplexArray:
    """G (f,): what the mean under the axles has of a wave of the rails."""
    places = np.array([bogie.front, bogie.rear])
    return np.asarray(np.exp(1j * k[:, None] * places).mean(axis=1))


def _spectrum_of_rails(ride: Ride, bogie: Bogie, mean: FloatArray) -> FloatArray:
    """S (f,), two-sided, m2 per cycle per m: its shape that of the roll of `Waviness`, its size that of M."""
    length, waviness = _periodic_length(ride), Waviness()
    frequency = rfftfreq(length, ride.step)
    k, rate = 2.0 * np.pi * frequency, 1.0 / waviness.roll_lengths[0]
    shape = (ride.base * waviness.roll_sd) ** 2 * 4.0 * rate**3 / (rate**2 + k**2) ** 2
    fits = _within(frequency, SIZED_M)
    power = np.abs(_spectra(ride, mean[:, None])[0]) ** 2 * ride.step / len(mean)
    expected = np.abs(_passed(bogie, k)) ** 2 * shape
    size = (power[fits] - MEAN_LEVEL_M3).sum() / max(expected[fits].sum(), 1e-30)
    return np.asarray(max(size, LEAST_SIZE) * shape)


def _within(frequency: FloatArray, waves: tuple[float, float]) -> npt.NDArray[np.bool_]:
    """Which frequencies (f,), 1/m, are those of the waves, m."""
    return (frequency >= 1.0 / waves[1]) & (frequency <= 1.0 / waves[0])


def _averaged(power: FloatArray) -> FloatArray:
    """A spectrum (f,), each line the mean of its neighbours', without the first."""
    number, n = np.arange(len(power)), len(power)
    reach = np.maximum(3, (number * NEIGHBOURS).astype(np.int64))
    low, high = np.maximum(number - reach, 1), np.minimum(number + reach + 1, n)
    total = np.concatenate([[0.0], np.cumsum(power)])
    return np.asarray((total[high] - total[low]) / (high - low))


def _variance_of(ride: Ride, spectrum: FloatArray) -> float:
    """Variance of a line of a two-sided spectrum (f,)."""
    return float(2.0 * spectrum.sum() / (_periodic_length(ride) * ride.step))


def _fitted(
    ride: Ride,
    bogie: Bogie,
    others: list[Bogie],
    mean: FloatArray,
    slopes: FloatArray,
    relative_sd: float,
) -> tuple[FloatArray, FloatArray]:
    """Shares (p,) by which the drawing's numbers err, and their covariance (p, p); ``slopes`` is (p, g)."""
    length = _periodic_length(ride)
    frequency, longer = rfftfreq(length, ride.step), length / len(ride.at)
    fits = _within(frequency, FITTED_M)
    spectra = _spectra(ride, np.column_stack([mean, slopes.T]))
    power = _averaged(np.abs(spectra[0]) ** 2)[fits]
    # A line that was made longer has more neighbours in its spectrum, but no more to say.
    seen, by_share = spectra[0, fits], spectra[1:, fits] / power
    information = (by_share @ np.conj(spectra[1:, fits]).T).real * 2.0 / longer
    pull = _log_slopes(ride, bogie, others, frequency[fits]) - 2.0 * (by_share @ np.conj(seen)).real
    covariance = np.linalg.inv(information + np.eye(len(others)) / relative_sd**2)
    covariance = 0.5 * (covariance + covariance.T)
    return covariance @ pull / longer, covariance


def _log_slopes(ride: Ride, bogie: Bogie, others: list[Bogie], frequency: FloatArray) -> FloatArray:
    """Sum over frequencies of the slopes of log |H|^2 by each number, (p,)."""
    s = np.asarray(2j * np.pi * frequency * ride.speed, dtype=np.complex128)
    none, one = np.zeros_like(s), np.ones_like(s)
    up = complex(ride.mount[2] - bogie.height)
    turned = alone(up * one, none, one, none, none, none)
    share = np.mean([np.exp(2j * np.pi * frequency * shift) for shift in bogie.bearers], axis=0)
    turned = turned._replace(ground=share * turned.ground)
    logs = [np.log(np.abs(axles_under(each, turned, s, ride.gravity)[2])) for each in (bogie, *others)]
    return np.array([2.0 * (other - logs[0]).sum() / CHANGE for other in logs[1:]])
