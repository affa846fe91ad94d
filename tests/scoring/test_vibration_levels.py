"""Octave levels of a mount, and how they stand beside published ones."""

from dataclasses import replace

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import load
from simrail.ride.truth import BodyMotion, Mount, Truth
from simrail.scoring.published_spectra import OCTAVES_HZ, PublishedSpectrum, octave_edges
from simrail.scoring.vibration_levels import compare, mount_kind, octave_levels, steady_levels, verdicts
from simrail.track.file import TrackFile
from simrail.vehicle.file import VehicleFile

RATE_HZ = 1000.0
LEVELS = np.array([0.1, 0.4, 2.0, 1.0, 0.5])


def lines(seconds: float) -> np.ndarray:
    """A line of known rms in the middle of each octave: A sin has A / sqrt(2)."""
    t = np.arange(round(RATE_HZ * seconds)) / RATE_HZ
    return sum(
        np.sqrt(2.0) * level * np.sin(2.0 * np.pi * centre * t + centre)
        for level, centre in zip(LEVELS, OCTAVES_HZ, strict=True)
    )


def published(name: str, speed: float | None, factor: float, **other: object) -> PublishedSpectrum:
    levels = dict(zip(OCTAVES_HZ, (LEVELS / factor).tolist(), strict=True))
    kind = "test" if speed is None else "operating"
    return replace(PublishedSpectrum(name, name, "s", "v", kind, "axle", speed, levels), **other)


def judged(*spectra: PublishedSpectrum, levels: np.ndarray = LEVELS) -> str:
    return verdicts(compare({("box", "axle", 20.0): levels}, spectra))["axle"]


def test_lines_have_their_rms() -> None:
    """Hann's window spreads a line over three bins, 0.75 Hz here, within every octave."""
    np.testing.assert_allclose(octave_levels(lines(4.0) + 9.81, RATE_HZ), LEVELS, rtol=1e-3)


def test_even_noise_has_the_root_of_density_times_width() -> None:
    density, seconds = 0.02, 60.0
    noise = np.random.default_rng(1).standard_normal(round(RATE_HZ * seconds))
    found = octave_levels(noise * np.sqrt(density * RATE_HZ / 2.0), RATE_HZ)
    width = np.array([np.diff(octave_edges(centre))[0] for centre in OCTAVES_HZ])
    # The relative variance of a mean square is 1/(width T), and 1.94 times that under Hann's window; of the
    # root a quarter: 4 sd.
    off = np.abs(found / np.sqrt(density * width) - 1.0)
    assert np.all(off < 4.0 * np.sqrt(1.94 / (width * seconds)) / 2.0)


def test_a_planted_factor_of_ten_is_caught() -> None:
    assert judged(published("a", 20.0, 1.0), published("b", 20.0, 2.9)) == "verified by 2 spectra at 20 m/s"
    said = judged(published("a", 20.0, 1.0), published("b", 20.0, 1.0), levels=10.0 * LEVELS)
    assert said == "unverified: 2 of 2 spectra off by more than 3 at 20 m/s"
    assert judged(published("a", 20.0, 1.0), published("b", 20.0, 1.0), levels=0.1 * LEVELS) == said
    # One octave may lie outside, two may not.
    one, two = LEVELS.copy(), LEVELS.copy()
    one[2], two[2:4] = 10.0 * LEVELS[2], 0.1 * LEVELS[2:4]
    assert judged(published("a", 20.0, 1.0), published("b", 20.0, 1.0), levels=one).startswith("verified")
    assert judged(published("a", 20.0, 1.0), published("b", 20.0, 1.0), levels=two).startswith("unverified")


def test_what_verifies_nothing() -> None:
    """A test level, another mount, another speed; and one spectrum alone."""
    none = "unverified: no operating spectrum of a named vehicle at a told speed"
    assert judged(published("a", None, 1.0), published("b", None, 1.0)) == none
    assert judged(published("a", 20.0, 1.0, mount="floor"), published("b", 15.0, 1.0)) == none
    assert judged(published("a", 19.0, 1.0)).startswith("unverified: one spectrum alone")
    table = compare({("box", "axle", 0.0): LEVELS}, [published("a", None, 1.0)])
    assert (table["published_kind"] == "").all(), "a test level says nothing of a vehicle that stands"


def test_ratio_is_simulated_over_published() -> None:
    table = compare({("box", "axle", 20.0): LEVELS}, [published("a", 20.0, 4.0)])
    np.testing.assert_allclose(table["ratio"], 4.0)
    assert not table["within"].any()
    assert table["octave_hz"].tolist() == list(OCTAVES_HZ)


@pytest.fixture(scope="module")
def coach():
    return load(VehicleFile, "vehicle", "manchester_1").model("manchester_1")


def test_kinds_of_mounts(coach) -> None:
    kinds = {body: mount_kind(body, coach) for body in ("axle_f1", "frame_rear", "body")}
    assert kinds == {"axle_f1": "axle", "frame_rear": "frame", "body": "floor"}


def stop_and_go() -> Truth:
    """Six seconds of rest, then half a second to 10 m/s, and six seconds at that; shaken while it runs."""
    t = np.arange(round(12.5 * RATE_HZ) + 1) / RATE_HZ
    speed = np.clip((t - 6.0) * 20.0, 0.0, 10.0)
    place = 100.0 + np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / RATE_HZ
    zeros = np.zeros((len(t), 3))
    position, velocity, acceleration = zeros.copy(), zeros.copy(), zeros.copy()
    position[:, 0], position[:, 2], velocity[:, 0] = place, 0.46, speed
    acceleration[:, 2] = np.where(t > 6.4, np.resize(lines(4.0), len(t)), 0.0)
    body = BodyMotion(0.0, 0.46, position, velocity, acceleration, zeros, zeros, zeros)
    line = load(TrackFile, "track", "level_straight").design("level_straight")
    return Truth(t, line, place, {"axle": body}, {}, {}, {}, 9.81, {})


def test_rest_and_running_are_told_apart() -> None:
    levels = steady_levels(stop_and_go(), Mount("box", "axle", (0.0, 0.0, 0.46)))
    assert sorted(levels) == [0.0, 10.0]
    assert levels[0.0].max() < 1e-9
    np.testing.assert_allclose(levels[10.0], LEVELS, rtol=0.02)


def test_a_rate_that_cannot_hold_the_octave_is_refused() -> None:
    truth = stop_and_go()
    slow = replace(truth, time_s=truth.time_s * 4.0)
    with pytest.raises(InputError, match=r"truth_rate_hz.*400"):
        steady_levels(slow, Mount("box", "axle", (0.0, 0.0, 0.46)))
