"""Measured rails: they come back out of the laid track; gaps are bridged; what cannot be is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrail.core.columns import IRREGULARITY
from simrail.core.errors import InputError
from simrail.track.bands import BANDS, band_pass
from simrail.track.defects import Defect
from simrail.track.design import Curve, Straight, TrackDesign, Transition
from simrail.track.irregularity import Irregularity, fade
from simrail.track.laid_track import LaidTrack, lay
from simrail.track.measured import FINEST_STEP_M, MeasuredRails, chord_offset, measured_rails

TRACK = TrackDesign("straight", 0.0, (Straight(600.0),))
GENERATOR = np.random.default_rng(7)
WAVES_M = np.concatenate([[3.0, 25.0], GENERATOR.uniform(2.0, 60.0, 38)])
SHIFTS = GENERATOR.uniform(0.0, 2.0 * np.pi, (40, 4))


def rails(s: np.ndarray) -> np.ndarray:
    """Waves of 2 to 60 m, each of 0.7 mm: some 3 mm rms; (n, 4)."""
    return 0.7e-3 * np.sin(2.0 * np.pi * s[:, None, None] / WAVES_M[:, None] + SHIFTS).sum(axis=1)


def columns(values: np.ndarray) -> dict[str, np.ndarray]:
    return dict(zip(IRREGULARITY, values.T, strict=True))


def measured(s: np.ndarray, values: np.ndarray | None = None, **options: object) -> MeasuredRails:
    return measured_rails("file", s, columns(rails(s) if values is None else values), **options)  # type: ignore[arg-type]


def laid(of_file: MeasuredRails, **options: object) -> LaidTrack:
    values: dict[str, object] = {"wavelengths_m": (1.5, 100.0), "fade_m": 20.0, **options}
    return lay(TRACK, Irregularity(measured=of_file, **values), seed=5)  # type: ignore[arg-type]


STEPS = {
    "0.25 m": np.arange(-5.0, 620.0, 0.25),
    "0.3 m": np.arange(-5.0, 620.0, 0.3),
    "0.1 m": np.arange(-5.0, 620.0, 0.1),
    "5 mm": np.arange(0.0, 600.001, 0.005),
    "uneven": np.sort(np.arange(-5.0, 620.0, 0.25) + GENERATOR.uniform(-0.06, 0.06, 2500)),
}


@pytest.mark.parametrize("name", STEPS)
def test_a_file_comes_back_out_within_a_twentieth_of_a_millimetre_in_d1(name: str) -> None:
    s = STEPS[name]
    # As a recording car prints it: to a hundredth of a millimetre.
    track = laid(measured(s, np.round(rails(s), 5)))
    places = np.arange(22.0, 578.0, 0.25)
    found, expected = track.irregularities(places).to_numpy(), rails(places)
    for i in range(4):
        in_band = [
            band_pass(np.ascontiguousarray(v[:, i]), BANDS["D1"].edges_m("gauge"), step_m=0.25)
            for v in (found, expected)
        ]
        inside = np.isfinite(in_band[1])
        assert np.sqrt(np.mean(in_band[1][inside] ** 2)) > 1e-3
        assert np.abs(in_band[0] - in_band[1])[inside].max() < 0.05e-3


def test_at_its_own_places_a_file_comes_back_as_it_is() -> None:
    s = STEPS["0.25 m"]
    noise = rails(s) + np.random.default_rng(1).normal(0.0, 1e-4, (len(s), 4))
    here = (s >= 20.0) & (s <= 580.0)
    assert np.abs(laid(measured(s, noise)).irregularities(s[here]).to_numpy() - noise[here]).max() < 1e-15


def test_short_waves_of_a_fine_file_are_laid() -> None:
    # 0.4 m with a sample every 0.05 m: knots as close carry them to 0.2 %, those of 0.125 m to a tenth.
    s = np.arange(0.0, 600.01, 0.05)
    wave = 1e-3 * np.sin(2.0 * np.pi * s / 0.4)
    track = laid(measured_rails("file", s, {"vertical_profile_m": wave}))
    assert track.table_step_m == 0.03125
    there = np.arange(100.0, 110.0, 0.0037)
    found = track.irregularities(there)["vertical_profile_m"].to_numpy()
    assert np.abs(found - 1e-3 * np.sin(2.0 * np.pi * there / 0.4)).max() < 3e-6


def test_a_start_moves_the_first_sample() -> None:
    s = STEPS["0.25 m"]
    moved = laid(measured(12_000.0 + s, rails(s), start_m=-5.0))
    there = np.arange(30.0, 570.0, 0.37)
    assert np.abs(moved.rails(there) - laid(measured(s)).rails(there)).max() < 1e-9


def test_beside_or_instead_of_a_spectrum() -> None:
    part = np.arange(200.0, 401.0, 0.25)
    inside, outside = (
        np.arange(221.0, 379.0, 0.5),
        np.concatenate([np.arange(0.0, 199.0), np.arange(402.0, 600.0)]),
    )
    drawn = lay(TRACK, Irregularity("erri_b176_low", (1.5, 100.0), fade_m=20.0), seed=5)
    alone, added, instead = (
        laid(measured(part, replaces_spectrum=instead), spectrum=spectrum)
        for spectrum, instead in (("none", False), ("erri_b176_low", False), ("erri_b176_low", True))
    )
    assert np.abs(added.rails(inside) - alone.rails(inside) - drawn.rails(inside)).max() < 1e-15
    # A spline remembers 0.27 per knot: a metre behind the fade it is 1e-4 of what is there.
    assert np.abs(instead.rails(inside) - alone.rails(inside)).max() < 1e-7
    for track in (added, instead):
        assert np.abs(track.rails(outside) - drawn.rails(outside)).max() < 1e-6
    assert np.abs(alone.rails(outside)).max() < 1e-6


def test_a_spectrum_passes_over_into_the_file_that_takes_its_place() -> None:
    part, where = np.arange(200.0, 401.0, 0.25), np.arange(195.0, 225.0, 0.125)
    drawn = lay(TRACK, Irregularity("erri_b176_low", (1.5, 100.0), fade_m=20.0), seed=5)
    alone = laid(measured(part))
    instead = laid(measured(part, replaces_spectrum=True), spectrum="erri_b176_low")
    left = 1.0 - fade(where, 200.0, end_m=400.75, length_m=20.0)[:, None]
    expected = left * drawn.rails(where) + alone.rails(where)
    np.testing.assert_allclose(instead.rails(where), expected, atol=1e-12)


def test_defects_add_to_a_file() -> None:
    s = STEPS["0.25 m"]
    dip = Defect("dip", 300.0, 6.0, 0.02)
    more = laid(measured(s), defects=(dip,)).rails([303.0]) - laid(measured(s)).rails([303.0])
    assert more == pytest.approx(np.array([[0.0, -0.02, 0.0, -0.02]]), abs=1e-6)


def test_the_cant_of_the_design_is_taken_off() -> None:
    design = TrackDesign(
        "curve",
        0.0,
        (Straight(200.0), Transition(60.0), Curve(100.0, 400.0, 0.12), Transition(60.0), Straight(180.0)),
    )
    s = STEPS["0.25 m"]
    # A left curve has its right rail raised: cross-level, left over right, of -120 mm, and linear in s.
    cant = np.interp(s, [200.0, 260.0, 360.0, 420.0], [0.0, -0.12, -0.12, 0.0])
    as_it_lies = rails(s) + np.array([0.0, 0.0, 1.0, 0.0]) * cant[:, None]
    of_file = measured(s, as_it_lies, has_cant=True)
    track = lay(
        replace(design, cant_ramp="linear"),
        Irregularity(wavelengths_m=(1.5, 100.0), fade_m=20.0, measured=of_file),
        seed=1,
    )
    here = np.arange(20.0, 580.0, 0.25)
    off = track.irregularities(here).to_numpy() - rails(here)
    assert np.abs(off[:, [0, 1, 3]]).max() < 1e-9
    # Asine of the cant over the base: the ramp is linear in the angle, off from one in height by 2e-5 m.
    assert np.abs(off[:, 2]).max() < 1e-4
    straight = lay(
        design, Irregularity(wavelengths_m=(1.5, 100.0), fade_m=20.0, measured=measured(s)), seed=1
    )
    assert np.array_equal(straight.rails(here[:600]), track.rails(here[:600]))
    with pytest.raises(InputError, match="larger than") as caught:
        lay(
            TRACK,
            Irregularity(
                wavelengths_m=(1.5, 100.0),
                fade_m=20.0,
                measured=measured(s, as_it_lies - np.array([0.0, 0.0, 0.1, 0.0]), has_cant=True),
            ),
            seed=1,
        )
    assert (caught.value.file, caught.value.field) == ("file", "cross_level")


def test_missing_columns_are_zero_and_a_scale_scales() -> None:
    s = STEPS["0.25 m"]
    level = rails(s)[:, 2]
    found = measured_rails("file", s, {"cross_level_m": level}, scale=2.0).values_m
    assert np.array_equal(found[:, 2], 2.0 * level)
    assert not found[:, [0, 1, 3]].any()


def test_gaps_are_bridged_on_request_by_smooth_steps() -> None:
    s = np.arange(0.0, 600.25, 0.25)
    kept = (s < 100.0) | (s > 102.0)
    values = rails(s)
    values[1000, 1] = np.nan  # at 250 m
    of_file = measured(s[kept], values[kept], bridge_gaps_m=3.0)
    assert of_file.position_m == pytest.approx(s, abs=1e-12)
    # The middle of a smooth step is the mean of its ends: 99.75 and 102.25 m, 249.75 and 250.25 m.
    for middle, before, after in ((404, 399, 409), (1000, 999, 1001)):
        assert of_file.values_m[middle] == pytest.approx((values[before] + values[after]) / 2.0, abs=1e-15)
    straight = of_file.values_m[399:410]
    assert (straight.max(axis=0) <= np.maximum(values[399], values[409]) + 1e-15).all()
    with pytest.raises(InputError, match="gap"):
        measured(s[kept], rails(s)[kept], bridge_gaps_m=2.4)


def test_what_a_gap_is_told_to_need_bridges_it() -> None:
    """From 99.75 to 102.5 m: the advice is rounded to what bridges it, not to what does not."""
    s = np.arange(0.0, 600.25, 0.25)
    kept = (s < 100.0) | (s > 102.25)
    with pytest.raises(InputError, match="has a gap") as caught:
        measured(s[kept], rails(s)[kept])
    assert "2.75 m after" in str(caught.value) and "bridge_gaps_m = 2.8" in str(caught.value)
    assert measured(s[kept], rails(s)[kept], bridge_gaps_m=2.8).position_m == pytest.approx(s, abs=1e-12)


def test_the_digest_covers_places_and_values_not_the_name() -> None:
    s = STEPS["0.25 m"]
    one = measured(s)
    assert measured_rails("other", s, columns(rails(s))) == one
    changed = rails(s)
    changed[77, 3] += 1e-12
    others = [measured(s, changed), measured(s, start_m=1.0), measured(s, scale=1.5)]
    assert len({of_file.digest for of_file in (one, *others)}) == 4
    described = [Irregularity(measured=of_file).describe() for of_file in (one, *others)]
    assert all(described[i] != described[0] for i in (1, 2, 3))
    assert described[0] != Irregularity(measured=replace(one, replaces_spectrum=True)).describe()
    assert len({hash(Irregularity(measured=of_file)) for of_file in (one, *others)}) == 4


def test_close_samples_are_averaged() -> None:
    s = np.arange(0.0, 10.0, FINEST_STEP_M / 4.0)
    thinned = measured(s)
    assert len(thinned.position_m) == 640
    assert thinned.values_m[3] == pytest.approx(rails(s)[12:16].mean(axis=0), abs=1e-15)


def test_chord_offset_of_a_wave() -> None:
    # Of sin(2 pi s / L), the offset from the middle of a chord C is (1 - cos(pi C / L)) times the wave.
    s = np.arange(0.0, 200.0, 0.05)
    for wave in (10.0, 18.8976, 60.0):
        offset = chord_offset(s, np.sin(2.0 * np.pi * s / wave))
        assert np.abs(offset).max() == pytest.approx(1.0 - np.cos(np.pi * 18.8976 / wave), rel=2e-3)


def spoilt(index: int, value: float) -> np.ndarray:
    s = np.arange(0.0, 600.25, 0.25)
    s[index] = value
    return s


HOLED = rails(STEPS["0.25 m"])
HOLED[10, 2] = np.nan
FAULTS = {
    "unsorted": (lambda: measured(spoilt(40, 9.0)), "position", "not sorted"),
    "twice": (lambda: measured(spoilt(40, 9.75)), "position", "not sorted"),
    "place is NaN": (lambda: measured(spoilt(40, np.nan)), "position", "no number"),
    "value is NaN": (lambda: measured(STEPS["0.25 m"], HOLED), "cross_level", "no number"),
    "gap": (lambda: measured(np.delete(STEPS["0.25 m"], [50, 51])), "position", "gap"),
    "too large": (
        lambda: measured(STEPS["0.25 m"], 1e3 * rails(STEPS["0.25 m"])),
        "alignment",
        "larger than",
    ),
    "too small": (
        lambda: measured(STEPS["0.25 m"], 1e-3 * rails(STEPS["0.25 m"])),
        "alignment",
        "smaller than",
    ),
    "too close": (lambda: measured(STEPS["0.25 m"] / 1e3), "position", "closer than any"),
    "whole gauge": (
        lambda: measured(STEPS["0.25 m"], rails(STEPS["0.25 m"]) + np.array([0.0, 0.0, 0.0, 1.435])),
        "gauge",
        "itself",
    ),
    "one sample": (lambda: measured(np.array([1.0])), None, "less than two"),
    "too coarse": (
        lambda: laid(measured(np.arange(0.0, 601.0, 0.5))),
        "irregularity.wavelengths_m",
        "too far apart",
    ),
    "elsewhere": (
        lambda: laid(measured(STEPS["0.25 m"], start_m=700.0)),
        "irregularity.measured.start_m",
        "not on the track",
    ),
    "short": (
        lambda: laid(measured(np.arange(100.0, 130.0, 0.25))),
        "irregularity.fade_m",
        "too short to fade",
    ),
    "no fade": (
        lambda: laid(measured(np.arange(100.0, 300.0, 0.25)), fade_m=0.0),
        "irregularity.fade_m",
        "a step",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_what_cannot_be_rails_is_refused(name: str) -> None:
    make, field, words = FAULTS[name]
    with pytest.raises(InputError, match=words) as caught:
        make()
    assert (caught.value.field or "").removeprefix("irregularity.") == (field or "").removeprefix(
        "irregularity."
    )


@pytest.mark.parametrize("column", range(4))
def test_each_amplitude_is_judged(column: int) -> None:
    s = np.arange(0.0, 100.0, 0.25)
    # Twice class 1: 5 in and 3 in over a chord of 62 ft, where such a wave counts twice; 3 in; 1.5 in.
    limit = 25.4e-3 * np.array([5.0, 3.0, 6.0, 3.0])[column]
    for factor in (0.97, 1.03):
        values = np.zeros((len(s), 4))
        values[:, column] = factor * limit * np.cos(2.0 * np.pi * s / 18.8976)
        if factor < 1.0:
            measured(s, values)
            continue
        with pytest.raises(InputError, match="larger than") as caught:
            measured(s, values)
        assert caught.value.field == IRREGULARITY[column].removesuffix("_m")


def test_a_ride_must_lie_within_unless_part_is_enough() -> None:
    s = np.arange(100.0, 300.0, 0.25)
    measured(s).check_covers(100.0, 299.75)
    for low, high in ((99.0, 200.0), (150.0, 300.0)):
        with pytest.raises(InputError, match="too short for the ride"):
            measured(s).check_covers(low, high)
        measured(s, partial=True).check_covers(low, high)
