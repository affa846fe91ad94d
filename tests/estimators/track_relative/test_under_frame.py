"""Rails under a frame that follows them as its springs let it: they are found again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from simrail.estimators.track_relative.full_rate import Held
from simrail.estimators.track_relative.suspension import (
    UNCERTAIN,
    Bogie,
    alone,
    axles_under,
    bogie_of,
    changed,
)
from simrail.estimators.track_relative.under_frame import Ride, Under, _ground, draw_under, rails_under

from simrail.core.jit import FloatArray
from simrail.core.toml_files import load
from simrail.recording.recording import Recording
from simrail.sensors.drawing import drawing
from simrail.track.bands import BANDS, band_pass
from simrail.vehicle.file import VehicleFile

SPEED, LENGTH_M, STEP_M = 19.0, 1500.0, 0.25
AT = np.arange(80.0, LENGTH_M - 80.0, STEP_M)
INNER = slice(600, -600)
"""Places where a band-pass of 70 m does not see the ends."""


def bogie() -> Bogie:
    found = bogie_of(drawing(load(VehicleFile, "vehicle", "metro_irw_bogie").model("m")), "frame")
    assert found is not None
    return found


def laid(seed: int) -> tuple[CubicSpline, CubicSpline]:
    """Profile and cross-level, of waves of 2 m and more, about as large as on good rails."""
    step, rng = 0.05, np.random.default_rng(seed)
    n = round(LENGTH_M / step)
    k = 2.0 * np.pi * np.fft.rfftfreq(n, step)
    lines = []
    for size in (3e-3, 2e-3):
        spectrum = np.exp(-((k / 3.0) ** 4)) / (0.3**2 + k**2)
        line = np.fft.irfft(np.fft.rfft(rng.standard_normal(n)) * spectrum, n)
        lines.append(CubicSpline(np.arange(n) * step, size * line / line.std()))
    return lines[0], lines[1]


def forwards(b: Bogie, axles: FloatArray, forced: FloatArray, dt: float, up: float) -> FloatArray:
    """Roll, y, z, pitch (n, 4) of the mount over heights of the axles and their mean roll (n, 3).

    The formula is linear in the frame's motion, so three motions of unit size give the matrix that is
    inverted; the centre of gravity keeps to the middle of the track.
    """
    n = len(axles)
    s = 2j * np.pi * np.fft.rfftfreq(n, dt)
    none, one = np.zeros_like(s), np.ones_like(s)

    def under(z, roll, pitch, q, track_roll):
        return axles_under(b, alone(none, z, roll, pitch, q, track_roll), s, 9.81)

    columns = np.stack(
        [under(*unit, none, none) for unit in ((one, none, none), (none, one, none), (none, none, one))]
    )
    spectra = np.fft.rfft(axles, axis=0).T - under(none, none, none, *np.fft.rfft(forced, axis=0).T)
    z, roll, pitch = np.linalg.solve(columns.transpose(2, 1, 0), spectra.T[:, :, None])[:, :, 0].T
    moved = np.stack([roll, -up * roll, z, pitch])
    return np.fft.irfft(moved, n, axis=1).T


def ride(
    recording: Recording,
    drawn: Bogie,
    *,
    true: Bogie | None = None,
    sense: int = 1,
    seed: int = 1,
    curve: float = 0.0,
    nod: float = 1.0,
) -> tuple[Under, FloatArray]:
    """What is found of rails (g, 2), and those; the frame is of the ``true`` bogie, the drawing another."""
    dt = 1.0 / recording.imu_sheet.rate_hz
    n, b = round(LENGTH_M / SPEED / dt), drawn if true is None else true
    way = SPEED * dt * np.arange(n)
    place = way if sense > 0 else LENGTH_M - way
    profile, level = laid(seed)
    base, up = recording.track.rail_base_m, recording.mount_position_m[2] - b.height
    inside = [np.clip(place + x, 0.0, LENGTH_M - 0.1) for x in (b.front, b.rear)]
    roll = 0.5 * (level(inside[0]) + level(inside[1])) / base
    axles = np.column_stack([profile(inside[0]), profile(inside[1]), roll])
    # Curves of 150 m, with ramps.
    bent = np.clip(3.0 * np.sin(2.0 * np.pi * place / 300.0), -1.0, 1.0)
    forced = curve * np.column_stack([bent, -bent])
    motion, zero = forwards(b, axles, forced, dt, up), np.zeros(n)
    motion[:, 3] *= nod
    x, y, _ = recording.mount_position_m
    motion[:, 2] += y * motion[:, 0] - x * motion[:, 3]
    place = place + x
    held = Held(np.zeros((n, 4)), place, np.full(n, SPEED), zero, zero, zero, zero, *forced.T)
    found = rails_under(recording, held, motion, drawn, 0.2, AT)
    return found, np.column_stack([profile(AT), level(AT)])


def in_band(lines: FloatArray, band: str = "D1") -> float:
    """Rms, m, of a line in a band."""
    passed = band_pass(lines[None], BANDS[band].edges_m("cross_level"), step_m=STEP_M)[0]
    return float(np.sqrt(np.mean(passed[INNER] ** 2)))


@pytest.fixture
def recording(rough: Callable[..., Recording]) -> Recording:
    """Of which the mount and the IMU's rate are taken: in the middle of the frame."""
    return replace(rough(), mount_position_m=(0.0, 0.0, 0.6))


@pytest.mark.parametrize("sense", [1, -1])
def test_the_rails_are_found_again(recording: Recording, sense: int) -> None:
    """Profile to .04 of 1.4 mm, for what is interpolated between samples; cross-level as sure as is said.

    Wheels do nothing here between the rails, of which the filter knows nothing: what it leaves is of the
    waves near twice the wheelbase that a frame does not show, and of what a drawing may err by.
    """
    under, rails = ride(recording, bogie(), sense=sense)
    error = under.rails - rails
    assert in_band(rails[:, 0]) > 1e-3
    assert in_band(error[:, 0]) < 4e-5
    said = np.sqrt(under.variance[:, 1].mean())
    assert in_band(error[:, 1]) < min(said, 0.3 * in_band(rails[:, 1]))
    assert in_band(error[:, 1], "D2") < 0.2 * in_band(rails[:, 1], "D2")


FAULTS = {
    "wheelbase": lambda b: replace(b, front=1.2 * b.front, rear=1.2 * b.rear),
    "stiffness": lambda b: changed(b, ("front_stiffness", "rear_stiffness"), -0.4),
}


def test_the_mount_need_not_be_in_the_middle_of_the_frame(recording: Recording) -> None:
    """It moves with the frame's roll and pitch, and is farther along the track."""
    aside = replace(recording, mount_position_m=(0.7, -0.4, 0.6))
    (one, rails), (other, _) = ride(recording, bogie()), ride(aside, bogie())
    assert in_band((other.rails - rails)[:, 0]) < 4e-5
    assert in_band((other.rails - one.rails)[:, 1]) < 4e-5


def test_a_body_on_two_frames_stands_on_the_mean_of_both() -> None:
    """On a track that twists by c a metre, both frames level in it: the other rolls by c d more than this."""
    place, c, d = np.arange(0.0, 300.0, 0.1), 1e-3, -15.0
    at = np.arange(20.0, 280.0, STEP_M)
    there = Ride((0.0, 0.0, 0.6), 9.81, 1.5, 0.005, place, SPEED, at, STEP_M)
    roll, lead = np.full(len(place), 2e-3), np.full(len(place), 5e-3)
    values = np.column_stack([0.0 * place, roll, c * place + lead, c * place])
    ground = _ground(there, replace(bogie(), bearers=(0.0, d)), values)
    inner = (place > 40.0) & (place < 260.0)
    expected = np.column_stack([-bogie().height * c * d / 2 + 0 * place, roll + c * d / 2, *values.T[2:]])
    np.testing.assert_allclose(ground[inner], expected[inner], atol=1e-6)


def test_draws_of_what_a_frame_does_not_show_have_its_spectrum(recording: Recording) -> None:
    """Variance of 40 draws over 1.3 km: some 5,000 waves, so within 5 sd by a tenth."""
    under, _ = ride(recording, bogie())
    bare = under._replace(slopes=0.0 * under.slopes)
    rng, still = np.random.default_rng(9), np.zeros((len(under.ride.place), 4))
    level = np.array([draw_under(bare, still, rng)[:, 1] for _ in range(40)])
    length = len(under.spectrum) * 2 - 2
    said = 2.0 * under.spectrum.sum() / (length * STEP_M)
    assert np.square(level).mean() == pytest.approx(said, rel=0.1)


def test_pitch_the_wrong_way_round_shows_in_the_profile(recording: Recording) -> None:
    under, rails = ride(recording, bogie(), nod=-1.0)
    assert in_band((under.rails - rails)[:, 0]) > 4e-5


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_drawing_shows_in_the_profile(recording: Recording, fault: str) -> None:
    """What the test above would not pass."""
    under, rails = ride(recording, FAULTS[fault](bogie()), true=bogie())
    assert in_band((under.rails - rails)[:, 0]) > 4e-5


def test_the_ride_tells_how_the_drawing_errs(recording: Recording) -> None:
    """A load 20 % heavier than drawn, on a line with curves: its cross-level is found as sure as said."""
    true = bogie()
    light = changed(true, ("load",), -1.0 / 6.0)
    under, rails = ride(recording, light, true=true, curve=0.08)
    sure, _ = ride(recording, true, curve=0.08)
    number = UNCERTAIN.index(("load",))
    sd = np.sqrt(np.square(under.share_root).sum(axis=1))
    assert abs(under.share[number] - 0.2) < 3.0 * sd[number] and sd[number] < 0.15
    held = under.rails - np.einsum("pgq,p->gq", under.slopes, under.share)
    wrong, mended = in_band((held - rails)[:, 1], "D2"), in_band((under.rails - rails)[:, 1], "D2")
    assert mended < 0.5 * wrong
    assert mended < 3.0 * np.sqrt(under.variance[:, 1].mean())
    assert np.abs(sure.share / 0.2).max() < 1.5  # and a right drawing is left alone


def test_draws_are_as_large_as_the_variance_says(recording: Recording) -> None:
    """Mean square of 60 draws without an error of the motion, over 5,000 places each."""
    under, _ = ride(recording, bogie(), curve=0.05)
    rng, still = np.random.default_rng(6), np.zeros((len(under.ride.place), 4))
    drawn = np.array([draw_under(under, still, rng) for _ in range(60)])
    ratio = np.square(drawn).mean(axis=(0, 1)) / under.variance.mean(axis=0)
    # Most of it is the drawing's shares, of which a draw has one: sqrt(2/60).
    np.testing.assert_allclose(ratio, 1.0, atol=4.0 * np.sqrt(2.0 / 60.0))
    assert np.corrcoef(drawn[0, :, 1], drawn[1, :, 1])[0, 1] ** 2 < 0.999


def test_the_error_of_the_motion_goes_through_the_springs(recording: Recording) -> None:
    """A draw of the motion's error moves the rails as the motion itself does."""
    under, _ = ride(recording, bogie())
    quiet = under._replace(
        share_root=0.0 * under.share_root, slopes=0.0 * under.slopes, spectrum=0.0 * under.spectrum
    )
    n, rng = len(under.ride.place), np.random.default_rng(7)
    wave = np.sin(2.0 * np.pi * under.ride.place / 12.0)
    motion = np.column_stack([1e-3 * wave, 0.0 * wave, 1e-2 * wave, 0.0 * wave])
    both = draw_under(quiet, motion, np.random.default_rng(7)) - draw_under(quiet, 0.0 * motion, rng)
    s = np.array([2j * np.pi * SPEED / 12.0])
    one, none = np.ones(1), np.zeros(1)
    lift = axles_under(bogie(), alone(none, one, none, none, none, none), s, 9.81)[:2, 0]
    # Both axles give one height, each for a place half a wheelbase from where the frame is.
    shifted = np.abs(lift.mean() * np.cos(2.0 * np.pi * 0.9 / 12.0))
    inner = slice(400, -400)
    assert np.sqrt(2.0) * both[inner, 0].std() == pytest.approx(1e-2 * shifted, rel=0.02)
    assert n == len(motion)
