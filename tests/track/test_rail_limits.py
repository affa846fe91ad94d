"""Rails against limits: where they are exceeded, how sure that is, and what a section's indicators say."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import IRREGULARITY
from simrail.track.bands import BANDS
from simrail.track.rail_limits import (
    OPEN_CHANCE,
    RailLimits,
    RailLine,
    chance_beyond,
    exceedances,
    rail_lines,
    rail_sections,
    rail_summary,
)

S = np.arange(0.0, 800.0, 0.25)


def geometry(**lines: np.ndarray) -> pd.DataFrame:
    frame = pd.DataFrame(0.0, index=pd.Index(S, name="position_m"), columns=list(IRREGULARITY))
    return frame.assign(**lines)


def test_a_wave_lies_in_its_band_and_its_crests_beyond_the_limit():
    wave = 5e-3 * np.sin(2.0 * np.pi * S / 10.0)
    lines = rail_lines(geometry(alignment_m=wave))
    by_name = {(line.quantity, line.band): line for line in lines}
    # 800 m are too short for D3 in alignment (five times 200 m), and long enough in profile (five of 150 m).
    assert ("alignment", "D3") not in by_name and ("vertical_profile", "D3") in by_name
    inside = by_name["alignment", "D1"].value
    assert np.nanmax(inside) == pytest.approx(5e-3, rel=5e-3)
    assert np.nanmax(np.abs(by_name["alignment", "D2"].value)) < 0.05e-3

    limits = RailLimits(peaks={("alignment", "D1"): 4e-3}, sds={("alignment", "D1"): 3e-3})
    places = exceedances(lines, limits)
    # Two crests to a wave, over 800 m less a margin of 50 m at either end.
    assert len(places) == 2 * 700 // 10 and set(places["band"]) == {"D1"}
    # A sine of 5 is beyond 4 for (pi - 2 asin 0.8) / 2 pi of its wave.
    width = 10.0 * (np.pi - 2.0 * np.arcsin(0.8)) / (2.0 * np.pi)
    np.testing.assert_allclose(places["end_m"] - places["start_m"], width, atol=0.5)
    assert places["peak_m"].abs().between(4.95e-3, 5.05e-3).all() and places["chance"].isna().all()

    sections = rail_sections(lines, limits)
    rows = sections[(sections["quantity"] == "alignment") & (sections["band"] == "D1")]
    np.testing.assert_allclose(rows["sd_m"], 5e-3 / np.sqrt(2.0), rtol=0.01)
    assert rows["sd_exceeded"].all()
    row = rail_summary(lines, limits).set_index(["quantity", "band"]).loc[("alignment", "D1")]
    assert (row["exceedances"], row["sd_exceedances"]) == (140, 4) and np.isnan(row["open_m"])


def test_the_chance_is_how_often_it_is_true():
    """Of many places with the same estimate and sd, so many lie beyond the limit."""
    generator = np.random.default_rng(1)
    for value, sd, limit in ((4.2e-3, 0.5e-3, 4e-3), (-3.5e-3, 1e-3, 4e-3), (0.0, 3e-3, 4e-3)):
        true = value + sd * generator.standard_normal(200_000)
        share = np.mean(np.abs(true) > limit)
        # Four standard deviations of a share of 200,000.
        assert chance_beyond(np.array(value), np.array(sd), limit) == pytest.approx(share, abs=0.0045)


def test_draws_give_the_sd_of_a_band_and_what_is_left_open():
    generator = np.random.default_rng(2)
    draws = np.zeros((40, len(S), 4))
    draws[:, :, 1] = (
        0.5e-3 * np.sqrt(2.0) * np.sin(2.0 * np.pi * S / 10.0 + generator.uniform(0.0, 2.0 * np.pi, (40, 1)))
    )
    wave = 3.5e-3 * np.sin(2.0 * np.pi * S / 12.0)
    lines = rail_lines(geometry(vertical_profile_m=wave), draws)
    line = next(one for one in lines if (one.quantity, one.band) == ("vertical_profile", "D1"))
    assert line.sd is not None
    # Widened by what forty draws know: t of forty at 95 % over 1.96.
    assert np.nanmean(line.sd**2) ** 0.5 == pytest.approx(0.5e-3 * 2.0211 / 1.96, rel=0.05)
    row = rail_summary([line], RailLimits(peaks={("vertical_profile", "D1"): 4e-3})).iloc[0]
    assert row["exceedances"] == 0
    known = np.isfinite(line.value)
    open_places = chance_beyond(line.value[known], line.sd[known], 4e-3) > OPEN_CHANCE
    assert row["open_m"] == pytest.approx(0.25 * open_places.sum()) and 100.0 < row["open_m"] < 350.0


def test_what_is_beyond_is_not_left_open_and_a_section_has_its_root_mean_square():
    """A way that is surely, perhaps and surely not beyond 4 mm; what is told of a peak is of its place."""
    place = 0.25 * np.arange(400)
    value = np.repeat([5e-3, 3.9e-3, 1e-3], [120, 80, 200])
    sd = np.repeat([0.1e-3, 0.3e-3, 0.1e-3], [120, 80, 200])
    value[60], sd[60] = 6e-3, 0.2e-3
    line = RailLine("alignment", "D1", place, value, sd)
    limits = RailLimits(peaks={("alignment", "D1"): 4e-3}, section_m=100.0)
    row = rail_summary([line], limits).iloc[0]
    assert (row["exceedances"], row["open_m"]) == (1, 80 * 0.25)
    mean_square = (119 * 0.1**2 + 0.2**2 + 80 * 0.3**2 + 200 * 0.1**2) / 400.0
    assert rail_sections([line], limits)["error_sd_m"].tolist() == pytest.approx([1e-3 * mean_square**0.5])
    assert exceedances([line], limits)[["peak_position_m", "sd_m"]].iloc[0].tolist() == [15.0, 0.2e-3]


def test_twist_is_unfiltered_and_needs_a_base_of_whole_steps():
    ramp = np.clip(S - 400.0, 0.0, 3.0) * 2e-3
    lines = rail_lines(geometry(cross_level_m=ramp), bands=[BANDS["D1"]])
    twist = next(line for line in lines if line.quantity == "twist")
    places = exceedances([twist], RailLimits(peaks={("twist", "full"): 5e-3}))
    assert len(places) == 1 and places["peak_m"].iloc[0] == pytest.approx(6e-3)
    assert places["peak_position_m"].iloc[0] == 403.0
    assert not [line for line in rail_lines(geometry(), twist_base_m=3.1) if line.quantity == "twist"]


def test_nothing_is_found_of_what_is_not_known():
    assert rail_lines(geometry().iloc[:1]) == []
    lines = rail_lines(geometry(gauge_m=np.full(len(S), np.nan)))
    assert "gauge" not in {line.quantity for line in lines}
    empty = RailLine("alignment", "D1", S, np.full(len(S), np.nan))
    assert not len(rail_summary([empty], RailLimits())) and not len(exceedances([empty], RailLimits()))
