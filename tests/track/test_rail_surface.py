"""Short waves of rails: levels of bands, shapes of dips, sleepers, corrugation, sections."""

import numpy as np
import pytest
from scipy import signal

from simrail.core.seeds import stream
from simrail.core.toml_files import load
from simrail.track.file import TrackFile
from simrail.track.rail_surface import (
    STEP_M,
    Corrugation,
    Dips,
    RailSources,
    Roughness,
    SleeperPassing,
    lay_surface,
    realise_roughness,
)
from simrail.track.roughness import TABLES, THIRD_OCTAVE
from simrail.track.sections import SectionGain, section_gain, section_scores

M = TABLES["eu_2021_1226_m"]
BAND_EDGE = np.sqrt(THIRD_OCTAVE)


@pytest.fixture(scope="module")
def line():
    return load(TrackFile, "track", "level_straight").design("level_straight")


def band_level_db(heights, step_m, centre_m):
    """Level of a one-third octave band by an own periodogram, re 1 um."""
    spectrum = np.abs(np.fft.rfft(heights)) ** 2 * 2.0 / len(heights) ** 2
    frequency = np.fft.rfftfreq(len(heights), step_m)
    inside = (frequency >= 1.0 / (centre_m * BAND_EDGE)) & (frequency < BAND_EDGE / centre_m)
    return 10.0 * np.log10(spectrum[inside].sum() / 1e-12)


def test_bands_have_the_levels_of_the_table():
    """Amplitudes are fixed, so a period has each level but for lines at the edges of a band: below 10 %."""
    heights = realise_roughness(Roughness(M, longest_m=2.2, shortest_m=0.05), "left", seed=1)
    for wave, level in zip(M.wavelengths_m[1:-1], M.levels_db[1:-1], strict=True):
        centre = 10.0 ** (round(10.0 * np.log10(wave)) / 10.0)
        assert band_level_db(heights, STEP_M, centre) == pytest.approx(level, abs=10.0 * np.log10(1.1))


def test_published_levels_of_column_m():
    """Some points of table G-1b, column M, as the issue of this subject quotes them."""
    at = dict(zip(M.wavelengths_m, M.levels_db, strict=True))
    assert [at[w] for w in (2.0, 1.0, 0.5, 0.25, 0.1)] == [35.0, 25.0, 17.0, 9.0, 3.5]


def test_laid_density_within_ten_percent(line):
    """Welch over the line as it is laid, spline and all, in bands; 2 km hold 1300 waves of 1.5 m."""
    rough = Roughness(M, longest_m=1.5)
    surface = lay_surface(RailSources(roughness=rough), line, seed=4)
    s = np.arange(0.0, 2000.0, 0.01)
    for side in (0, 1):
        f, found = signal.welch(surface.height(side, s), 100.0, nperseg=1 << 14)
        for low, high in ((0.8, 1.6), (1.6, 3.2), (3.2, 6.4), (6.4, 12.0)):
            inside = (f >= low) & (f < high)
            expected = np.trapezoid(rough.density(f[inside]), f[inside])
            assert np.trapezoid(found[inside], f[inside]) == pytest.approx(expected, rel=0.10)


def test_offset_and_limits():
    rough = Roughness(M, offset_db=6.0, longest_m=1.5, shortest_m=0.2)
    f = np.array([0.5, 0.66, 0.67, 1.0, 4.9, 5.1])
    ratio = rough.density(f) / M.density(f)
    np.testing.assert_allclose(ratio, np.array([0.0, 0.0, 1.0, 1.0, 1.0, 0.0]) * 10.0**0.6, rtol=1e-12)


def test_rails_differ_and_draws_do(line):
    sources = RailSources(roughness=Roughness(M))
    s = np.arange(0.0, 500.0, 0.02)
    one, other = lay_surface(sources, line, seed=1), lay_surface(sources, line, seed=2)
    kept = [one.height(0, s), one.height(1, s), other.height(0, s)]
    # 500 m hold some 400 independent values of the longest waves, which carry the most.
    correlation = np.corrcoef(kept)[np.triu_indices(3, 1)]
    assert np.abs(correlation).max() < 4.0 / np.sqrt(400)
    np.testing.assert_array_equal(one.height(0, s), lay_surface(sources, line, seed=1).height(0, s))


def test_a_source_does_not_change_another(line):
    s = np.arange(0.0, 100.0, 0.013)
    rough = lay_surface(RailSources(roughness=Roughness(M)), line, seed=1).height(0, s)
    welds = lay_surface(RailSources(welds=Dips(18.0, 1.5e-4, 1e-4)), line, seed=1).height(0, s)
    both = lay_surface(RailSources(Roughness(M), Dips(18.0, 1.5e-4, 1e-4)), line, seed=1).height(0, s)
    np.testing.assert_allclose(both, rough + welds, atol=1e-15)


def test_weld_has_its_shape(line):
    """A cusp ``-d exp(-|x|/l)``; the spline rounds its tip off over its step of 8 mm."""
    surface = lay_surface(RailSources(welds=Dips(18.0, 1.5e-4, 0.0, 0.12, 0.8)), line, seed=1)
    for middle in (9.0, 27.0, 9.0 + 18.0 * 40):
        x = np.array([-0.5, -0.2, -0.06, 0.06, 0.2, 0.5])
        expected = -1.5e-4 * np.exp(-np.abs(x) / 0.12)
        np.testing.assert_allclose(surface.height(0, middle + x), expected, rtol=1e-4)
        assert surface.height(0, np.array([middle]))[0] == pytest.approx(-1.5e-4, rel=0.05)
        np.testing.assert_allclose(surface.height(0, middle + np.array([-0.9, 0.9, 4.0])), 0.0, atol=1e-12)


def test_depths_of_welds(line):
    surface = lay_surface(RailSources(welds=Dips(2.0, 1.5e-4, 1e-4, 0.12, 0.8)), line, seed=1)
    depths = -surface.height(1, 1.0 + 0.06 + 2.0 * np.arange(999)) * np.exp(0.06 / 0.12)
    assert depths.mean() == pytest.approx(1.5e-4, abs=4.0 * 1e-4 / np.sqrt(999))
    assert depths.std() == pytest.approx(1e-4, rel=4.0 / np.sqrt(2 * 999))


def test_welds_of_both_rails_are_drawn_apart(line):
    surface = lay_surface(RailSources(welds=Dips(2.0, 0.0, 1e-4, 0.12, 0.8)), line, seed=1)
    left, right = (surface.height(side, 1.0 + 2.0 * np.arange(999)) for side in (0, 1))
    assert abs(np.corrcoef(left, right)[0, 1]) < 4.0 / np.sqrt(999)


def test_even_sleepers_are_one_wave(line):
    surface = lay_surface(RailSources(sleepers=SleeperPassing(0.6, 0.0, 10e-6, 0.0)), line, seed=1)
    s = np.arange(0.0, 1200.0, 0.01)
    left, right = surface.height(0, s), surface.height(1, s)
    np.testing.assert_array_equal(left, right)
    lines = np.abs(np.fft.rfft(left)) * 2.0 / len(s)
    at = int(np.argmax(lines))
    assert np.fft.rfftfreq(len(s), 0.01)[at] == pytest.approx(1.0 / 0.6, rel=1e-9)
    assert lines[at] == pytest.approx(10e-6, rel=1e-4)


def test_corrugation_is_on_the_inner_rail_of_sharp_curves():
    line = load(TrackFile, "track", "condequinto_olivar").design("condequinto_olivar")
    wave = Corrugation(0.08, 15e-6, 450.0)
    surface = lay_surface(RailSources(corrugation=wave), line, seed=1)
    s = np.arange(line.start_m + 1.0, line.end_m - 1.0, 0.01)
    curvature = line.frame(s).rates[:, 2]
    for side, inner in ((0, curvature > 0.0), (1, curvature < 0.0)):
        height = surface.height(side, s)
        sharp = inner & (np.abs(curvature) > 1.1 / 450.0)
        wide = ~inner | (np.abs(curvature) < 0.9 / 450.0)
        # One metre from where it begins: the limits are read off metre by metre.
        wide = np.convolve(~wide, np.ones(301), mode="same") < 0.5
        assert np.abs(height[wide]).max() < 1e-12
        if sharp.any():
            # A wave of 10.24 knots: a cubic spline carries it to (2 pi/10.24)^4/720.
            assert height[sharp].std() == pytest.approx(15e-6 / np.sqrt(2.0), rel=0.02)


def test_sections_have_the_gain_that_is_told():
    s = np.arange(0.0, 60000.0, 5.0)
    gain = section_gain(s, SectionGain(0.4), start_m=0.0, seed=7)
    score = section_scores(s, (100.0, 400.0), start_m=0.0, seed=7)
    # 60 km are 240 sections of 250 m, longer ones weighing more: some 200 independent values.
    assert np.abs(score.mean()) < 4.0 / np.sqrt(200)
    assert np.log(gain).std() == pytest.approx(0.4, rel=4.0 / np.sqrt(2 * 200))
    # Over 20 lines: g^2 = exp(2 sd n - 2 sd^2) has the mean 1 and the variance exp(4 sd^2) - 1.
    lines = [section_gain(s, SectionGain(0.4), start_m=0.0, seed=k) ** 2 for k in range(20)]
    assert np.mean(lines) == pytest.approx(1.0, abs=4.0 * np.sqrt(np.expm1(4 * 0.4**2) / (20 * 200)))
    lengths = np.diff(s[1:][(np.diff(score) != 0.0) & (np.diff(score, prepend=0.0)[:-1] == 0.0)])
    assert lengths.min() >= 75.0
    assert lengths.max() <= 405.0


def test_a_section_passes_into_the_next_about_where_they_meet():
    """Sections of just 100 m: their own scores in the middle, a quintic step over 20 m about the meeting."""
    drawn = stream(7, "track", "sections")
    own = np.array([(drawn.uniform(100.0, 100.0), drawn.standard_normal())[1] for _ in range(4)])
    s = 50.0 + np.array([0.0, 89.9, 95.0, 100.0, 105.0, 110.1, 189.9, 200.0, 295.0, 350.0])
    # u = 1/4: u^3 (10 - 15 u + 6 u^2) = (10 - 3.75 + 0.375) / 64
    quarter = 6.625 / 64.0
    u = np.array([0.0, 0.0, quarter, 0.5, 1.0 - quarter, 1.0, 0.0, 0.5, quarter, 0.0])
    first = np.array([0, 0, 0, 0, 0, 0, 1, 1, 2, 3])
    beyond = np.append(own[1:], 0.0)
    expected = own[first] + (beyond[first] - own[first]) * u
    scores = section_scores(s, (100.0, 100.0), start_m=50.0, seed=7)
    np.testing.assert_allclose(scores, expected, atol=1e-12)


def test_sections_do_not_depend_on_the_length_of_the_line():
    s = np.arange(0.0, 1000.0, 1.0)
    short = section_scores(s, (100.0, 400.0), start_m=0.0, seed=7)
    longer = section_scores(np.arange(0.0, 5000.0, 1.0), (100.0, 400.0), start_m=0.0, seed=7)
    np.testing.assert_array_equal(short, longer[:1000])


def test_roughness_follows_its_sections(line):
    plain = RailSources(roughness=Roughness(M))
    gained = RailSources(roughness=Roughness(M), section_gain=SectionGain(0.4))
    s = np.arange(0.0, 2000.0, 0.05)
    surfaces = [lay_surface(one, line, seed=3) for one in (plain, gained)]
    bare, full = (surface.height(0, s) for surface in surfaces)
    ratio = full / bare
    expected = section_gain(s, SectionGain(0.4), start_m=line.start_m, seed=3)
    assert np.median(np.abs(ratio / expected - 1.0)) < 1e-3
    # Where heights are given, between sections too, it is the gain to rounding: an eighth of a metre shows.
    s = STEP_M * np.arange(0, 256_000, 7)
    bare, full = (surface.height(0, s) for surface in surfaces)
    expected = section_gain(s, SectionGain(0.4), start_m=line.start_m, seed=3)
    np.testing.assert_allclose(full, expected * bare, rtol=0.0, atol=1e-9 * np.abs(bare).max())
    assert np.abs(np.diff(expected)).max() > 1e-4
