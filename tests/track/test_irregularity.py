"""Realisations of irregularities: spectrum, RMS, independence, and what is refused."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.signal import welch

from simrail.core.columns import IRREGULARITY
from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.track.irregularity import PERIOD_M, Irregularity, fade, realise, realise_all
from simrail.track.spectra import SPECTRA

STEP = 0.125
REAL = [name for name in SPECTRA if name != "none"]
GAUSSIAN = [name for name in REAL if SPECTRA[name].gauge_limits_m is None]
LIMITED = [name for name in REAL if name not in GAUSSIAN]
D1 = Irregularity("erri_b176_low", (3.0, 25.0), fade_m=0.0)


def by_definition(irregularity: Irregularity, column: str, seed: int, s: np.ndarray) -> np.ndarray:
    """The sum of harmonics, term by term."""
    density = SPECTRA[irregularity.spectrum].densities[column]
    phases = stream(seed, "track", "irregularity", column.removesuffix("_m")).uniform(0, 2 * np.pi, 131072)
    shortest, longest = irregularity.wavelengths_m
    total = np.zeros_like(s)
    for k in range(1, 131073):
        if PERIOD_M / longest <= k <= PERIOD_M / shortest:
            f = k / PERIOD_M
            total += np.sqrt(2.0 * density.density(f) / PERIOD_M) * np.cos(2 * np.pi * f * s + phases[k - 1])
    return irregularity.scale * total


def test_it_is_the_sum_that_it_says_it_is() -> None:
    narrow = Irregularity("fra_4", (8.0, 8.5), scale=0.7)
    drawn = realise(narrow, "cross_level_m", seed=5, step_m=STEP)
    knots = np.arange(-400, 400)
    expected = by_definition(narrow, "cross_level_m", 5, knots * STEP)
    assert np.abs(drawn[knots % drawn.size] - expected).max() < 1e-12 * np.sqrt(drawn.size)


@pytest.mark.parametrize("name", GAUSSIAN)
@pytest.mark.parametrize("band", [(3.0, 25.0), (25.0, 70.0), (70.0, 150.0)])
def test_band_rms_of_a_whole_period(name: str, band: tuple[float, float]) -> None:
    # All harmonics are there once: only the two ends of the band are uncertain by one harmonic.
    for column in IRREGULARITY:
        density = SPECTRA[name].densities[column]
        drawn = realise(Irregularity(name, band), column, seed=3, step_m=STEP)
        one_line = density.density(np.array(1.0 / band[1])) / PERIOD_M
        assert np.mean(drawn**2) == pytest.approx(density.variance(band), abs=2 * float(one_line))
        assert abs(drawn.mean()) < 1e-15


@pytest.mark.parametrize("name", GAUSSIAN)
def test_band_rms_of_20_km_within_statistics(name: str) -> None:
    n, band = int(20_000 / STEP), (3.0, 25.0)
    for seed, column in itertools.product(range(3), IRREGULARITY):
        drawn = realise(Irregularity(name, band), column, seed=seed, step_m=STEP)[:n]
        density = SPECTRA[name].densities[column]
        f = np.linspace(1.0 / band[1], 1.0 / band[0], 4001)
        # Variance of the mean square of a Gaussian process over the length T: integral of S^2 over T.
        sd = np.sqrt(np.trapezoid(density.density(f) ** 2, f) / (n * STEP))
        assert np.mean(drawn**2) == pytest.approx(density.variance(band), abs=4 * sd)


@pytest.mark.parametrize("column", IRREGULARITY)
@pytest.mark.parametrize("name", ["erri_b176_low", "erri_b176_high", "fra_4_formula", "fra_6_formula"])
def test_psd_of_20_km_within_ten_percent(name: str, column: str) -> None:
    # Octave by octave from 3 to 25 m; the narrowest one holds 900 independent waves: 10 % are 3 sd.
    drawn = realise(Irregularity(name, (1.5, 100.0)), column, seed=1, step_m=STEP)[: int(20_000 / STEP)]
    frequency, measured = welch(drawn, fs=1 / STEP, nperseg=4096, window="hann", detrend=False)
    expected = SPECTRA[name].densities[column].density(np.maximum(frequency, 1e-9))
    for longest in (24.0, 12.0, 6.0):
        octave = (frequency >= 1 / longest) & (frequency < 2 / longest)
        assert measured[octave].mean() == pytest.approx(expected[octave].mean(), rel=0.10)


def test_seeds_and_irregularities_are_uncorrelated() -> None:
    wide = Irregularity("erri_b176_low", (1.5, 100.0))
    drawn = np.concatenate([realise_all(wide, seed=seed, step_m=STEP) for seed in (1, 2)], axis=1)
    correlation = np.corrcoef(drawn.T)
    k = np.arange(np.ceil(PERIOD_M / 100.0), np.floor(PERIOD_M / 1.5) + 1)
    powers = [SPECTRA["erri_b176_low"].densities[column].density(k / PERIOD_M) for column in IRREGULARITY] * 2
    for i, j in itertools.combinations(range(8), 2):
        # Independent phases: the correlation is a sum of cosines, weighted by the product of amplitudes.
        sd = np.sqrt(np.sum(powers[i] * powers[j]) / 2.0 / powers[i].sum() / powers[j].sum())
        assert abs(correlation[i, j]) < 4.0 * sd


def test_a_seed_is_a_realisation() -> None:
    assert np.array_equal(realise_all(D1, seed=7, step_m=STEP), realise_all(D1, seed=7, step_m=STEP))
    alone = realise(D1, "gauge_m", seed=7, step_m=STEP)
    assert np.array_equal(alone, realise_all(D1, seed=7, step_m=STEP)[:, 3])
    assert not np.allclose(alone, realise(D1, "gauge_m", seed=8, step_m=STEP))


def test_waves_keep_their_phases_in_another_band() -> None:
    parts = [
        realise(Irregularity("fra_5", band), "alignment_m", seed=2, step_m=STEP)
        for band in ((2.0, 25.0), (25.0, 90.0), (2.0, 90.0))
    ]
    assert np.abs(parts[0] + parts[1] - parts[2]).max() < 1e-14


def test_a_finer_grid_samples_the_same_waves() -> None:
    coarse = realise(D1, "alignment_m", seed=4, step_m=STEP)
    assert np.abs(realise(D1, "alignment_m", seed=4, step_m=STEP / 2)[::2] - coarse).max() < 1e-15


def test_scale_scales() -> None:
    twice = Irregularity("erri_b176_low", (3.0, 25.0), scale=2.0)
    single, double = (realise(i, "alignment_m", seed=4, step_m=STEP) for i in (D1, twice))
    assert np.abs(double - 2.0 * single).max() < 1e-17


@pytest.mark.parametrize("column", IRREGULARITY)
def test_each_irregularity_has_a_scale_of_its_own(column: str) -> None:
    own = {f"{column.removesuffix('_m')}_scale": 3.0}
    scaled = realise_all(Irregularity("erri_b176_low", (3.0, 25.0), scale=0.5, **own), seed=4, step_m=STEP)
    plain = realise_all(D1, seed=4, step_m=STEP)
    for i, name in enumerate(IRREGULARITY):
        factor = 1.5 if name == column else 0.5
        assert np.abs(scaled[:, i] - factor * plain[:, i]).max() < 1e-16


def gauge(name: str, **scales: float) -> np.ndarray:
    return realise(Irregularity(name, (1.5, 100.0), **scales), "gauge_m", seed=1, step_m=STEP)


# 49 CFR 213.53 (b): feet and inches by class; class 6 keeps what class 5 keeps.
FEET_INCHES = {1: (4, 10), 2: (4, 9.75), 3: (4, 9.75), 4: (4, 9.5), 5: (4, 9.5), 6: (4, 9.5)}


@pytest.mark.parametrize("number", FEET_INCHES)
@pytest.mark.parametrize("scale", [0.3, 1.0, 5.0])
def test_gauge_of_an_fra_class_is_within_its_safety_limits(number: int, scale: float) -> None:
    feet, inches = FEET_INCHES[number]
    millimetres = 1435.0 + 1e3 * gauge(f"fra_{number}", gauge_scale=scale)
    assert millimetres.min() > 1422.4 and millimetres.max() < 25.4 * (12.0 * feet + inches)


def test_gauge_of_the_published_form_is_far_outside() -> None:
    for number in FEET_INCHES:
        drawn = gauge(f"fra_{number}_formula")
        # 65 km of a Gaussian process: some 4.3 sd at its greatest.
        variance = SPECTRA[f"fra_{number}"].densities["gauge_m"].variance((1.5, 100.0))
        assert -drawn.min() == pytest.approx(4.3 * np.sqrt(variance), rel=0.1)
    assert gauge("fra_1_formula").min() < -0.04


@pytest.mark.parametrize("name", LIMITED)
def test_gauge_within_limits_is_the_published_form_bent_into_them(name: str) -> None:
    low, high = SPECTRA[name].gauge_limits_m or (np.nan, np.nan)
    free, bent = gauge(f"{name}_formula"), gauge(name)
    half = (high - low) / 2.0
    expected = (high + low) / 2.0 + half * (1.0 - 2.0 / (np.exp(2.0 * free / half) + 1.0))
    assert np.abs(bent - expected).max() < 1e-15
    # A factor up to 1 counts afterwards, the rest of it before: 0 is a gauge without any deviation.
    assert np.abs(gauge(name, scale=0.4, gauge_scale=0.5) - 0.2 * bent).max() < 1e-17
    assert not gauge(name, gauge_scale=0.0).any()
    assert gauge(name, gauge_scale=3.0).std() > 1.2 * bent.std()
    # The other three are as published.
    limited, formula = (
        realise_all(Irregularity(which, (1.5, 100.0)), seed=1, step_m=STEP)
        for which in (name, f"{name}_formula")
    )
    assert np.array_equal(limited[:, :3], formula[:, :3])


def test_fade_is_a_quintic_at_both_ends() -> None:
    s = np.linspace(-10.0, 210.0, 22001)
    factor = fade(s, 0.0, end_m=200.0, length_m=40.0)
    assert not factor[(s <= 0.0) | (s >= 200.0)].any()
    assert np.array_equal(factor[(s >= 40.0) & (s <= 160.0)], np.ones(12001))
    assert factor == pytest.approx(factor[::-1], abs=1e-13)
    assert factor[np.argmin(abs(s - 20.0))] == pytest.approx(0.5, abs=1e-12)
    second = np.diff(factor, 2) / 0.01**2
    assert np.abs(second).max() == pytest.approx(10.0 / np.sqrt(3.0) / 40.0**2, rel=1e-4)
    # Continuous: from sample to sample it changes by its slope, at most 60/length^3, and no more.
    assert np.abs(np.diff(second)).max() < 1.001 * 60.0 / 40.0**3 * 0.01
    assert np.array_equal(fade(s, 0.0, end_m=200.0, length_m=0.0), np.ones_like(s))


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"spectrum": "fra_7"}, "spectrum"),
        ({"wavelengths_m": (25.0, 3.0)}, "wavelengths_m"),
        ({"wavelengths_m": (0.1, 3.0)}, "wavelengths_m"),
        ({"wavelengths_m": (3.0, 1e5)}, "wavelengths_m"),
        ({"wavelengths_m": (3.0, float("nan"))}, "wavelengths_m"),
        ({"fade_m": -1.0}, "fade_m"),
        ({"scale": float("inf")}, "scale"),
        ({"gauge_scale": -0.1}, "gauge_scale"),
        ({"alignment_scale": float("nan")}, "alignment_scale"),
    ],
)
def test_what_cannot_be_drawn_is_refused(options: dict[str, object], field: str) -> None:
    values: dict[str, object] = {"spectrum": "fra_6", "wavelengths_m": (3.0, 25.0), "fade_m": 40.0, **options}
    with pytest.raises(InputError) as caught:
        Irregularity(**values).check()  # type: ignore[arg-type]
    assert caught.value.field == field


@pytest.mark.parametrize("step", [0.5, 0.3])
def test_a_grid_that_does_not_carry_the_waves_is_refused(step: float) -> None:
    with pytest.raises(InputError, match="does not carry"):
        realise(D1, "alignment_m", seed=1, step_m=step)
