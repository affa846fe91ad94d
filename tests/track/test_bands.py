"""Wavelength bands: closed forms of the filters and of the twist."""

import numpy as np
import pytest
from scipy import signal

from simrail.core.errors import InputError
from simrail.scoring import table as score_table
from simrail.track import bands
from simrail.track.bands import BANDS, Band, band_pass, margin_m, twist

CASES = [(band, quantity) for band in BANDS.values() for quantity in ("alignment", "cross_level")]
CASES.append((Band("paper", 0.3, 7.0), "cross_level"))


def step_for(edges):
    return 0.025 if edges[0] < 1.0 else 0.25


def passed(wavelength, edges, *, phase=0.4):
    """A sine of this wavelength and what the band leaves of it, away from the ends."""
    step = step_for(edges)
    s = np.arange(0.0, 12.0 * edges[1], step)
    wave = np.sin(2 * np.pi * s / wavelength + phase)
    left = band_pass(wave, edges, step_m=step)
    inside = np.flatnonzero(np.isfinite(left))[len(s) // 4 : -len(s) // 4]
    basis = np.column_stack([wave[inside], np.cos(2 * np.pi * s[inside] / wavelength + phase)])
    return np.linalg.lstsq(basis, left[inside], rcond=None)[0]


@pytest.mark.parametrize(("band", "quantity"), CASES)
def test_the_middle_passes_the_edges_halve_the_power_and_nothing_shifts(band, quantity):
    edges = band.edges_m(quantity)
    in_phase, shifted = passed(np.sqrt(edges[0] * edges[1]), edges)
    assert in_phase == pytest.approx(1.0, abs=0.01) and abs(shifted) < 0.003
    for edge in edges:
        in_phase, shifted = passed(edge, edges)
        assert in_phase == pytest.approx(np.sqrt(0.5), abs=0.01) and abs(shifted) < 0.01
    # An octave outside, two passes of fourth order take off 48 dB against the low-pass asymptote.
    assert abs(passed(2.0 * edges[1], edges)[0]) < 0.01
    if edges[0] > 4.0 * step_for(edges):
        assert abs(passed(0.5 * edges[0], edges)[0]) < 0.01


def test_two_passes_have_half_power_at_the_edges_exactly():
    for band in BANDS.values():
        edges = band.edges_m("alignment")
        at = [1.0 / edges[0], 1.0 / edges[1]]
        gain = np.abs(signal.sosfreqz(bands._sections(edges, 0.25), at, fs=4.0)[1]) ** 2
        np.testing.assert_allclose(gain, np.sqrt(0.5), rtol=1e-6)


def test_a_mirrored_line_is_filtered_to_the_mirrored_answer():
    line = np.random.default_rng(3).standard_normal(4000).cumsum()
    one = band_pass(line, (3.0, 25.0), step_m=0.25)
    other = band_pass(line[::-1], (3.0, 25.0), step_m=0.25)[::-1]
    # Where the passes begin, at the ends, is all that tells them apart.
    np.testing.assert_allclose(one[1000:-1000], other[1000:-1000], atol=1e-6 * np.nanstd(one))
    np.testing.assert_allclose(one, other, atol=1e-3 * np.nanstd(one))


@pytest.mark.parametrize(("band", "bound"), [("D0", 0.02), ("D1", 0.01), ("D2", 0.04), ("D3", 0.04)])
def test_a_wave_that_is_cut_off_leaves_little_behind_the_margin(band, bound):
    edges = BANDS[band].edges_m("alignment")
    s = np.arange(0.0, 12.0 * edges[1], 0.25)
    for wavelength in (np.sqrt(edges[0] * edges[1]), edges[1] / 1.5):
        for phase in np.arange(0.0, 3.1, 0.5):
            wave = np.sin(2 * np.pi * s / wavelength + phase)
            gain = np.abs(signal.sosfreqz(bands._sections(edges, 0.25), [1 / wavelength], fs=4.0)[1]) ** 2
            error = band_pass(wave, edges, step_m=0.25) - gain * wave
            assert np.nanmax(np.abs(error)) < bound


def test_the_margins_are_two_longest_waves():
    line = band_pass(np.ones(801), (3.0, 25.0), step_m=0.25)
    assert margin_m((3.0, 25.0)) == 50.0
    assert np.isnan(line[:200]).all() and np.isnan(line[-200:]).all() and np.isfinite(line[200:-200]).all()


def test_only_alignment_and_gauge_reach_farther_in_d3():
    assert BANDS["D3"].edges_m("alignment") == BANDS["D3"].edges_m("gauge") == (70.0, 200.0)
    assert BANDS["D3"].edges_m("vertical_profile") == BANDS["D3"].edges_m("cross_level") == (70.0, 150.0)
    assert BANDS["D1"].edges_m("alignment") == (3.0, 25.0)
    assert score_table.BANDS == ("full", "D0", "D1", "D2", "D3")


def test_twist_is_the_difference_over_the_base():
    s = np.arange(0.0, 50.0, 0.25)
    levels = 4e-3 * np.sin(2 * np.pi * s / 12.0) + 1e-4 * s
    found = twist(levels, base_m=3.0, step_m=0.25)
    assert np.isnan(found[:12]).all()
    middle = s[12:] - 1.5
    expected = 2 * 4e-3 * np.sin(np.pi * 3 / 12.0) * np.cos(2 * np.pi * middle / 12.0) + 3e-4
    np.testing.assert_allclose(found[12:], expected, atol=1e-15)


def test_what_does_not_fit_is_named():
    with pytest.raises(InputError, match=r"line too short.*25 to 70 m.*350 m"):
        band_pass(np.zeros(1000), (25.0, 70.0), step_m=0.25)
    with pytest.raises(InputError, match=r"step too coarse.*1 to 5 m.*0\.4 m"):
        band_pass(np.zeros(1000), (1.0, 5.0), step_m=0.5)
    with pytest.raises(InputError, match=r"twist_base_m.*3\.1"):
        twist(np.zeros(100), base_m=3.1, step_m=0.25)
    with pytest.raises(InputError, match="paper: is not a band"):
        Band("paper", 7.0, 0.3).check()
