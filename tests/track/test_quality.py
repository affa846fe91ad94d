"""Indicators per section against closed forms."""

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import IRREGULARITY
from simrail.core.errors import InputError
from simrail.track.bands import BANDS
from simrail.track.quality import Limits, section_indicators

S = np.arange(0.0, 1000.0, 0.25)


def geometry(**lines: np.ndarray) -> pd.DataFrame:
    frame = pd.DataFrame(0.0, index=pd.Index(S, name="position_m"), columns=list(IRREGULARITY))
    return frame.assign(**lines)


def test_sections_of_a_sine_have_its_standard_deviation_and_peak():
    # 20 waves of 10 m in every section of 200 m, on a mean that no deviation sees.
    wave = 3e-3 * np.sin(2 * np.pi * S / 10.0) + 0.05
    found = section_indicators(geometry(vertical_profile_m=wave))
    rows = found[found["quantity"] == "vertical_profile"]
    np.testing.assert_allclose(rows["sd_m"], 3e-3 / np.sqrt(2.0), rtol=1e-9)
    np.testing.assert_allclose(rows["peak_m"].abs(), 3e-3, rtol=1e-9)
    assert list(rows["start_m"]) == [0.0, 200.0, 400.0, 600.0, 800.0]
    assert not rows["sd_exceeded"].any() and not rows["defects"].any()


def test_isolated_defects_are_counted_once_each_and_placed():
    bumps = np.zeros_like(S)
    for place, height in ((250.0, 8e-3), (300.0, -9e-3), (350.0, 6e-3)):
        bumps += height * np.exp(-0.5 * ((S - place) / 1.0) ** 2)
    found = section_indicators(geometry(alignment_m=bumps), limits={"alignment": Limits(1.4e-3, 7e-3)})
    row = found[(found["quantity"] == "alignment") & (found["start_m"] == 200.0)].iloc[0]
    assert row["defects"] == 2
    assert row["peak_position_m"] == 300.0 and row["peak_m"] == pytest.approx(-9e-3, abs=2e-4)
    # A bell of 1 m has the integral sqrt(2 pi), and its square sqrt(pi).
    mean = 5e-3 * np.sqrt(2 * np.pi) / 200.0
    expected = np.sqrt((64e-6 + 81e-6 + 36e-6) * np.sqrt(np.pi) / 200.0 - mean**2)
    assert row["sd_m"] == pytest.approx(expected, rel=1e-3) and not row["sd_exceeded"]
    strict = section_indicators(geometry(alignment_m=bumps), limits={"alignment": Limits(1.1e-3, 5e-3)})
    row = strict[(strict["quantity"] == "alignment") & (strict["start_m"] == 200.0)].iloc[0]
    assert row["defects"] == 3 and row["sd_exceeded"]


def test_band_and_twist_and_what_is_not_known():
    levels = 2e-3 * np.sin(2 * np.pi * S / 10.0)
    long_wave = levels + 20e-3 * np.sin(2 * np.pi * S / 200.0)
    frame = geometry(cross_level_m=long_wave, gauge_m=np.full(len(S), np.nan))
    found = section_indicators(frame, band=BANDS["D1"], twist_base_m=3.0)
    assert set(found["quantity"]) == {"alignment", "vertical_profile", "cross_level", "twist"}
    middle = found[found["start_m"] == 400.0].set_index("quantity")
    assert middle.loc["cross_level", "sd_m"] == pytest.approx(2e-3 / np.sqrt(2.0), rel=0.01)
    # A sine of wavelength L has the twist 2 sin(pi base / L) times its amplitude.
    short, long = 2e-3 * 2 * np.sin(np.pi * 3 / 10), 20e-3 * 2 * np.sin(np.pi * 3 / 200)
    assert middle.loc["twist", "sd_m"] == pytest.approx(np.hypot(short, long) / np.sqrt(2.0), rel=0.01)


def test_a_section_counts_once_half_of_it_is_known_and_a_stretch_over_a_border_in_both():
    wave = geometry(alignment_m=3e-3 * np.sin(2 * np.pi * S / 10.0))
    for length_m, last_m in ((690.0, 400.0), (710.0, 600.0)):
        found = section_indicators(wave.iloc[: round(length_m / 0.25)])
        assert found[found["quantity"] == "alignment"]["start_m"].max() == last_m
    bump = geometry(alignment_m=np.where(np.abs(S - 400.0) < 5.0, 8e-3, 0.0))
    found = section_indicators(bump, limits={"alignment": Limits(None, 5e-3)})
    rows = found[found["quantity"] == "alignment"].set_index("start_m")
    assert rows["defects"].to_dict() == {0.0: 0, 200.0: 1, 400.0: 1, 600.0: 0, 800.0: 0}


def test_a_place_at_a_border_but_for_rounding_is_of_the_section_that_begins_there():
    place = S.copy()
    place[800] = np.nextafter(200.0, 0.0)
    frame = geometry(alignment_m=np.where(np.arange(len(S)) == 800, 5e-3, 0.0))
    found = section_indicators(frame.set_index(pd.Index(place, name="position_m")))
    peaks = found[found["quantity"] == "alignment"].set_index("start_m")["peak_m"]
    assert peaks[200.0] > 4e-3 and peaks[0.0] == 0.0


def test_too_short_a_line_or_a_wrong_name_is_told():
    with pytest.raises(InputError, match="line too short for the band"):
        section_indicators(geometry().iloc[:400], band=BANDS["D2"])
    with pytest.raises(InputError, match="no such quantity"):
        section_indicators(geometry(), limits={"level": Limits()})
    with pytest.raises(InputError, match="twist_base_m"):
        section_indicators(geometry(), twist_base_m=1.1)
    assert section_indicators(geometry().iloc[:0]).empty
