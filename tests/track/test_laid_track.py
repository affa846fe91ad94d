"""The laid track: C2 splines, one realisation for all, and agreement of the table with its readers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import PPoly
from scipy.signal import welch

from simrail.core.columns import IRREGULARITY
from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.track.design import Curve, Gradient, Straight, TrackDesign, Transition
from simrail.track.irregularity import PERIOD_M, Irregularity, fade, realise_all
from simrail.track.laid_track import CHANNELS, LaidTrack, lay
from simrail.track.rail_condition import RailCondition
from simrail.track.sections import SectionGain, section_gain
from simrail.track.spectra import SPECTRA

ROUGH = Irregularity("erri_b176_high", (1.5, 100.0), fade_m=40.0)
CURVED = TrackDesign(
    "curved",
    -50.3,
    (
        Straight(100.0),
        Transition(40.0),
        Curve(60.0, 300.0, 0.08),
        Transition(50.0),
        Curve(70.0, -250.0, 0.1),
        Transition(30.0),
        Straight(200.0),
    ),
    gradients=(Gradient(-60.0, 0.01), Gradient(100.0, -0.02)),
)


@pytest.fixture(scope="module")
def laid() -> LaidTrack:
    # Leaves on both rails, wet on one, so that no column of the table is a constant.
    conditions = (RailCondition(100.0, 140.0, 0.2), RailCondition(150.0, 170.0, 0.5, "left"))
    return lay(CURVED, ROUGH, seed=11, conditions=conditions)


def test_table_has_the_agreed_form(laid: LaidTrack) -> None:
    assert laid.table.shape[1:] == (12, 4)
    assert laid.table.dtype == np.float64
    assert laid.table.flags.c_contiguous
    assert not laid.table.flags.writeable
    assert laid.table_step_m == 0.125
    assert laid.table_start_m % 0.125 == 0.0
    assert 0.0 <= CURVED.start_m - laid.table_start_m < 0.125
    assert 0.0 <= laid.table_start_m + 0.125 * laid.table.shape[0] - CURVED.end_m < 0.125


def test_splines_are_c2(laid: LaidTrack) -> None:
    h = laid.table_step_m
    c0, c1, c2, c3 = np.moveaxis(laid.table, -1, 0)
    ends = (((c0 * h + c1) * h + c2) * h + c3, (3 * c0 * h + 2 * c1) * h + c2, 6 * c0 * h + 2 * c1)
    for end, start, derivative in zip(ends, (c3, c2, 2 * c1), range(3), strict=True):
        size = np.abs(laid.table[..., 3]).max(axis=0) / h**derivative
        assert (np.abs(end[:-1] - start[1:]) < 1e-13 * size).all()
    # A spline has jumps in its third derivative, or it would be one polynomial: the test can see.
    assert (np.abs(np.diff(c0, axis=0)).max(axis=0) > 0.0).all()


def test_readers_equal_the_table(laid: LaidTrack) -> None:
    knots = laid.table_start_m + laid.table_step_m * np.arange(laid.table.shape[0] + 1)
    s = np.random.default_rng(1).uniform(CURVED.start_m, CURVED.end_m, (50, 20))
    reference = PPoly(laid.table.transpose(2, 0, 1), knots)
    for derivative in range(4):
        values = laid.channels(s, derivative=derivative)
        assert values.shape == (50, 20, len(CHANNELS))
        expected = reference(s, derivative)
        assert np.abs(values - expected).max() <= 1e-12 * np.abs(expected).max()
        assert np.array_equal(laid.rails(s, derivative=derivative), values[..., 6:10])
    assert laid.rails(0.0).shape == (4,)
    assert np.array_equal(laid.rails(s[0, 0]), laid.rails(s)[0, 0])
    y_left, z_left, y_right, z_right = laid.rails(s[0]).T
    frame = laid.irregularities(s[0])
    assert frame.index.name == "position_m"
    assert tuple(frame.columns) == IRREGULARITY
    assert np.array_equal(frame.index, s[0])
    expected = [(y_left + y_right) / 2, (z_left + z_right) / 2, z_left - z_right, y_left - y_right]
    assert np.array_equal(frame.to_numpy().T, expected)


def test_knots_carry_the_faded_realisation(laid: LaidTrack) -> None:
    knots = np.arange(np.ceil(CURVED.start_m / 0.125), np.floor(CURVED.end_m / 0.125)).astype(int)
    s = knots * 0.125
    drawn = realise_all(ROUGH, seed=11, step_m=0.125)[knots % 524288]
    factor = fade(s, CURVED.start_m, end_m=CURVED.end_m, length_m=40.0)
    assert np.abs(laid.irregularities(s).to_numpy() - factor[:, None] * drawn).max() < 1e-16


def test_between_knots_the_waves_are_true() -> None:
    # The shortest wave of the shipped rides, 1.5 m, against its sum of harmonics.
    track = TrackDesign("short", -20.0, (Straight(60.0),))
    narrow = Irregularity("fra_5", (1.5, 1.6), fade_m=0.0)
    s = np.random.default_rng(2).uniform(-10.0, 30.0, 100)
    k = np.arange(np.ceil(PERIOD_M / 1.6), np.floor(PERIOD_M / 1.5) + 1).astype(int)
    amplitude = np.sqrt(2.0 * SPECTRA["fra_5"].densities["alignment_m"].density(k / PERIOD_M) / PERIOD_M)
    phases = stream(9, "track", "irregularity", "alignment").uniform(0.0, 2.0 * np.pi, 131072)[k - 1]
    exact = (amplitude * np.cos(2.0 * np.pi * np.outer(s, k) / PERIOD_M + phases)).sum(axis=1)
    splined = lay(track, narrow, seed=9).irregularities(s)["alignment_m"].to_numpy()
    assert np.sqrt(np.mean((splined - exact) ** 2)) < 5e-4 * np.sqrt(np.mean(exact**2))


def test_design_channels_follow_the_design(laid: LaidTrack) -> None:
    s = np.linspace(CURVED.start_m, CURVED.end_m, 20011)
    frame, table = CURVED.frame(s), laid.channels(s)
    # Curvature bends at the ends of a transition. A spline rounds that off, by less than a tenth of
    # the step of its derivative times h^2 in yaw and h^3 in position.
    bend, h = 1.0 / 250.0 / 30.0, 0.125
    assert np.abs(table[:, :3] - frame.position).max() < 0.1 * bend * h**3
    assert np.abs(table[:, 3] - frame.yaw_rad).max() < 0.1 * bend * h**2
    assert np.abs(table[:, 4] - frame.pitch_rad).max() < 1e-9
    assert np.abs(table[:, 5] - frame.roll_rad).max() < 1e-8
    slopes = laid.channels(s, derivative=1)
    assert np.abs(slopes[:, 5:2:-1] - frame.rates).max() < 1e-6


def test_a_track_may_end_in_a_curve() -> None:
    helix = TrackDesign("helix", 0.05, (Curve(90.0, 100.0, 0.1),), gradients=(Gradient(0.0, 0.02),))
    track = lay(helix, Irregularity("none", fade_m=0.0), seed=0)
    s = np.linspace(0.05, 90.05, 1001)
    frame, table = helix.frame(s), track.channels(s)
    assert np.abs(table[:, :3] - frame.position).max() < 0.125**4 / 384.0 / 100.0**3 + 1e-13
    assert np.abs(table[:, 3] - frame.yaw_rad).max() < 1e-13
    assert np.abs(track.channels(s, derivative=2)[:, 3:6]).max() < 1e-10


def test_place_and_seed_alone_decide() -> None:
    short = lay(TrackDesign("short", -50.0, (Straight(1000.0),)), ROUGH, seed=4)
    long = lay(TrackDesign("long", 120.7, (Straight(3000.0),)), ROUGH, seed=4)
    # Inside of both fades, and a spline's memory (0.27 per knot) away from them.
    s = np.random.default_rng(3).uniform(170.0, 900.0, 500)
    assert np.abs(short.rails(s) - long.rails(s)).max() < 1e-15
    assert np.abs(short.rails(s)).max() > 1e-3
    other = lay(short.design, ROUGH, seed=5)
    assert np.abs(other.rails(s) - short.rails(s)).max() > 1e-3
    # Front and rear wheel, forwards and backwards: the same rail, bit by bit.
    assert np.array_equal(short.rails(s[::-1])[::-1], short.rails(s))


def test_sides_and_signs() -> None:
    straight = TrackDesign("straight", 0.0, (Straight(500.0),))
    track = lay(straight, ROUGH, seed=6)
    s = np.linspace(0.0, 500.0, 101)
    rails, values = track.rails(s), track.irregularities(s)
    wide = values["gauge_m"].idxmax()
    y_left, _, y_right, _ = track.rails(wide)
    assert y_left - y_right > 0.0  # left is +Y: a positive gauge is a wider one
    assert np.abs(rails[[0, -1]]).max() < 1e-20
    assert np.abs(track.rails(s[[0, -1]], derivative=1)).max() < 1e-7


def test_smooth_track_has_smooth_rails() -> None:
    assert not lay(CURVED, Irregularity("none"), seed=1).rails([0.0, 33.3, 400.0]).any()


def test_psd_of_the_rails_within_ten_percent() -> None:
    track = lay(TrackDesign("long", 0.0, (Straight(20_100.0),)), ROUGH, seed=2)
    values = track.irregularities(50.0 + 0.1 * np.arange(200_000))
    for column in IRREGULARITY:
        frequency, measured = welch(
            values[column].to_numpy(), fs=10.0, nperseg=5000, window="hann", detrend=False
        )
        expected = SPECTRA["erri_b176_high"].densities[column].density(np.maximum(frequency, 1e-9))
        for longest in (24.0, 12.0, 6.0):
            octave = (frequency >= 1 / longest) & (frequency < 2 / longest)
            assert measured[octave].mean() == pytest.approx(expected[octave].mean(), rel=0.10)


def test_off_the_track_is_refused(laid: LaidTrack) -> None:
    for read in (laid.rails, laid.channels, laid.irregularities):
        with pytest.raises(InputError, match=r"-50\.4 m is not on track 'curved'"):
            read(np.array([0.0, -50.4]))


@pytest.mark.parametrize("length", [79.0, 70_000.0])
def test_tracks_that_the_irregularity_does_not_fit_are_refused(length: float) -> None:
    with pytest.raises(InputError, match="do not fit"):
        lay(TrackDesign("odd", 0.0, (Straight(length),)), ROUGH, seed=1)


def test_an_irregularity_may_have_a_stretch_of_the_track() -> None:
    track = TrackDesign("straight", -50.0, (Straight(500.0),))
    part = lay(track, replace(ROUGH, start_m=100.0, end_m=300.0), seed=4)
    whole = lay(track, ROUGH, seed=4)
    s = np.arange(-50.0, 450.0, 0.125)
    inside, outside = (s >= 140.0) & (s <= 260.0), (s <= 99.0) | (s >= 301.0)
    # The same waves at the same places; a spline remembers 0.27 per knot of what is beyond the fade.
    assert np.abs(part.rails(s) - whole.rails(s))[inside].max() < 1e-15
    assert np.abs(part.rails(s))[outside].max() < 1e-7
    assert np.abs(part.rails(200.0)).max() > 1e-4


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"start_m": -60.0}, "start_m"),
        ({"end_m": 460.0}, "end_m"),
        ({"start_m": float("nan")}, "start_m"),
        ({"start_m": 100.0, "end_m": 150.0}, "fade_m"),
        ({"start_m": 100.0, "fade_m": 0.0}, "fade_m"),
    ],
)
def test_stretches_that_cannot_be_are_refused(changes: dict[str, float], field: str) -> None:
    track = TrackDesign("straight", -50.0, (Straight(500.0),))
    with pytest.raises(InputError) as caught:
        lay(track, replace(ROUGH, **changes), seed=4)  # type: ignore[arg-type]
    assert caught.value.field == f"irregularity.{field}"


def test_sections_count_from_the_start_of_the_track_wherever_irregularities_begin() -> None:
    within = replace(ROUGH, start_m=0.0, end_m=400.0)
    gain = SectionGain(0.35, (50.0, 80.0))
    plain, gained = (lay(CURVED, one, seed=11) for one in (within, replace(within, section_gain=gain)))
    s = np.arange(60.0, 340.0, 0.125)  # knots, which the splines go through
    expected = section_gain(s, gain, start_m=CURVED.start_m, seed=11)
    for column in ("alignment_m", "vertical_profile_m", "cross_level_m"):
        ours, before = (track.irregularities(s)[column].to_numpy() for track in (gained, plain))
        np.testing.assert_allclose(ours, expected * before, atol=1e-12)
