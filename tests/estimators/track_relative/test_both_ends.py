"""A body both ends of which follow the same line: its gyros tell by what its accelerometers err."""

from __future__ import annotations

import numpy as np
import pytest
from simrail.estimators.track_relative.both_ends import ENDS_M3, Ends, missed, still_missed
from simrail.estimators.trajectory.track_geometry import Sight

from simrail.core.jit import FloatArray
from simrail.track.bands import Band, band_pass

pytestmark = pytest.mark.long  # Bringing samples over places takes some seconds to compile.

STEP_M, RATE_HZ, HALF_M = 0.05, 250.0, 0.5
PLACE = np.arange(0.0, 60.0, 1.0 / RATE_HZ)
"""At 1 m/s."""

LONG = Band("as long as the body and longer", 1.2, 2.5)
NOISE = 1e-3
"""Of an accelerometer, m/s2 per root of Hz, one-sided as of a sheet."""


def followed(ahead_m: float = 0.0, rear: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """Mount (n, 2) and slopes (n, 2) of a body whose rear end follows `rear` times the line of its front."""
    rng, lines = np.random.default_rng(1), []
    for _ in range(2):
        waves = 1.0 / rng.uniform(0.4, 6.0, 40)
        phases, sizes = rng.uniform(0.0, 6.28, 40), 2e-4 / waves
        front, behind = (
            (sizes * np.sin(2.0 * np.pi * np.outer(PLACE + shift, waves) + phases)).sum(axis=1)
            for shift in (HALF_M, -HALF_M)
        )
        lines.append((front, rear * behind))
    slopes = np.column_stack([(front - behind) / (2.0 * HALF_M) for front, behind in lines])
    middle = np.column_stack([0.5 * (front + behind) for front, behind in lines])
    return middle + ahead_m * slopes, slopes


def body(slopes: FloatArray, ahead_m: float = 0.0) -> Ends:
    own = 1e-3 * np.array(ENDS_M3)
    return Ends(HALF_M, ahead_m, slopes, 1.0, NOISE**2, 1e-9, 9.81, own)


def seen() -> Sight:
    n = len(PLACE)
    use = np.ones(n, dtype=bool)
    return Sight(PLACE, np.zeros(n), np.zeros((n, 2, 3)), np.zeros((n, 2, 2)), use, 0.0, True, None)


def drifted(seed: int) -> FloatArray:
    """Errors (n, 2) of what an accelerometer's noise is integrated to, without the waves that none tells."""
    white = NOISE * np.sqrt(RATE_HZ) * np.random.default_rng(seed).standard_normal((len(PLACE), 2))
    per_m = np.fft.rfftfreq(len(PLACE), 1.0 / RATE_HZ)[:, None]
    gain = np.where(per_m > 0.15, 1.0 / (2.0 * np.pi * np.maximum(per_m, 0.15)) ** 2, 0.0)
    return np.asarray(np.fft.irfft(np.fft.rfft(white, axis=0) * -gain, len(PLACE), axis=0))


def rms(lines: FloatArray) -> FloatArray:
    """In waves as long as the body and longer, away from the ends."""
    filtered = band_pass(lines.T, (LONG.shortest_m, LONG.longest_m), step_m=STEP_M)
    return np.asarray(np.sqrt(np.nanmean(filtered[:, 100:-100] ** 2, axis=1)))


def at_places(values: FloatArray, places: int) -> FloatArray:
    grid = STEP_M * np.arange(places)
    return np.column_stack([np.interp(grid, PLACE, column) for column in values.T])


@pytest.mark.parametrize("ahead_m", [0.0, 0.3])
def test_what_accelerometers_err_by_is_found(ahead_m: float) -> None:
    """A third is left, wherever the mount is; with slopes the other way round, or of another place, more."""
    mount, slopes = followed(ahead_m)
    error = drifted(2)
    found = missed(body(slopes, ahead_m), seen(), mount + error, STEP_M)
    true = at_places(error, len(found))
    assert (rms(true - found) < 0.34 * rms(true)).all()
    for wrong in (body(-slopes, ahead_m), body(slopes, ahead_m - 0.6)):
        assert (rms(true - missed(wrong, seen(), mount + error, STEP_M)) > rms(true)).all()


def test_a_body_that_errs_in_nothing_keeps_its_line() -> None:
    mount, slopes = followed()
    assert (rms(missed(body(slopes), seen(), mount, STEP_M)) < 2e-6).all()


def test_ends_on_other_lines_are_what_the_size_of_it_speaks_of() -> None:
    """A rear end that follows a tenth less: that passes for an error of the height."""
    mount, slopes = followed(rear=0.9)
    assert (rms(missed(body(slopes), seen(), mount, STEP_M)) > 5e-6).all()


def test_a_draw_misses_as_much_as_an_error() -> None:
    """Error less what is found of it, of six bodies and six draws: alike within a third."""
    mount, slopes = followed()
    ends, left, drawn = body(slopes), [], []
    for i in range(6):
        rng, error = np.random.default_rng(10 + i), drifted(3 + i)
        true = at_places(error, len(missed(ends, seen(), mount, STEP_M)))
        drawn.append(rms(true - still_missed(ends, seen(), error, STEP_M, rng)))
        # Gyros and ends that err as they are said to: the walk of an angle, and white ends.
        walk = np.cumsum(np.sqrt(ends.gyro / RATE_HZ) * rng.standard_normal(slopes.shape), axis=0)
        apart = np.sqrt(ends.own_m3 * RATE_HZ) * rng.standard_normal(mount.shape) / np.sqrt(2.0)
        found = missed(ends._replace(slopes=slopes + walk), seen(), mount + error + apart, STEP_M)
        left.append(rms(true - found))
    ratio = np.sqrt(np.mean(np.square(left), axis=0) / np.mean(np.square(drawn), axis=0))
    np.testing.assert_allclose(ratio, 1.0, atol=0.34)
