"""Fusing rails of several passes: against closed forms on synthetic rails, whose errors are known exactly."""

import numpy as np
import pandas as pd
import pytest
from scipy.interpolate import CubicSpline
from simrail.estimators.rails.fuse import Fused
from simrail.estimators.rails.octaves import octaves_of

from simrail import InputError, fuse
from simrail.core.columns import IRREGULARITY, IRREGULARITY_SD
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.track.bands import BANDS, band_pass, sd_of_draws

STEP_M = 0.25
COUNT = 4800
"""1.2 km."""

PLACE = STEP_M * np.arange(COUNT)
NONE: dict[str, float] = {}
"""Nothing in common."""

SD_M = 2e-4


def in_waves(rng: np.random.Generator, sd_m: float, waves_m: tuple[float, float]) -> FloatArray:
    """A normal line that is white between two wavelengths, with this sd."""
    bank = octaves_of(COUNT, STEP_M)
    line = bank.passed(rng.standard_normal(COUNT), bank.between(waves_m))
    return np.asarray(sd_m * line / line.std())


def rails(rng: np.random.Generator) -> FloatArray:
    """Alignment, vertical profile and cross-level (3, places) of waves of 2 to 80 m, a millimetre or so."""
    return np.stack([in_waves(rng, 1e-3, (2.0, 80.0)) for _ in range(3)])


def passed(
    lines: FloatArray,
    *,
    sd_m: float = SD_M,
    shift_m: FloatArray | float = 0.0,
    position_sd_m: float = 1e-3,
    backwards: bool = False,
    draws: FloatArray | None = None,
) -> Estimate:
    """A pass that has the rails of s at s + shift and states these sds."""
    at = np.clip(PLACE - shift_m, PLACE[0], PLACE[-1])
    moved = CubicSpline(PLACE, lines, axis=1)(at) if np.any(shift_m) else lines
    index = pd.Index(PLACE, name="position_m")
    geometry = pd.DataFrame(dict(zip(IRREGULARITY, moved, strict=False)), index=index)
    for name in IRREGULARITY_SD:
        geometry[name] = sd_m
    geometry[["gauge_m", "gauge_sd_m"]] = np.nan
    geometry = geometry[[*IRREGULARITY, *IRREGULARITY_SD]]
    states = pd.DataFrame({"position_m": PLACE, "position_sd_m": position_sd_m})
    if backwards:
        states = states.iloc[::-1].reset_index(drop=True)
    return Estimate(states.rename_axis("time_s"), "axle", geometry=geometry, geometry_draws=draws)


def errors(fused: Fused, truth: FloatArray) -> FloatArray:
    """Fused less true lines (3, places)."""
    return np.asarray(fused.geometry[list(IRREGULARITY[:3])].to_numpy().T - truth)


def inside(fused: Fused, error: FloatArray) -> float:
    """Share of places within 1.96 of the stated sd."""
    sd = fused.geometry[list(IRREGULARITY_SD[:3])].to_numpy().T
    return float((np.abs(error) <= 1.96 * sd).mean())


@pytest.mark.parametrize("n", [2, 4, 8, 16])
def test_errors_that_are_each_its_own_fall_by_the_root_of_n(n: int) -> None:
    """Waves of 3 to 25 m on 1.2 km: 2 x 1200 x (1/3 - 1/25) = 700 degrees of freedom, three lines 2100."""
    rng = np.random.default_rng(n)
    truth = rails(rng)
    own = np.stack([[in_waves(rng, SD_M, (3.0, 25.0)) for _ in truth] for _ in range(n)])
    fused = fuse([passed(truth + one) for one in own], common=NONE)
    error = errors(fused, truth)
    sd = SD_M / np.sqrt(n)
    # Four standard errors of a root mean square of 2100 degrees of freedom, and 1 % for what is moved.
    assert np.sqrt(np.square(error).mean()) == pytest.approx(sd, rel=4.0 * np.sqrt(0.5 / 2100.0) + 0.01)
    assert 0.93 <= inside(fused, error) <= 0.975
    for at, quantity in enumerate(("alignment", "vertical_profile", "cross_level")):
        edges = BANDS["D1"].edges_m(quantity)
        in_band = band_pass(error[at], edges, step_m=STEP_M)
        assert fused.geometry_draws is not None
        limit = 1.96 * sd_of_draws(band_pass(fused.geometry_draws[:, :, at], edges, step_m=STEP_M))
        known = np.isfinite(in_band)
        assert 0.90 <= (np.abs(in_band) <= limit)[known].mean() <= 0.99


def test_rails_that_all_passes_agree_on_pass_unchanged() -> None:
    truth = rails(np.random.default_rng(3))
    fused = fuse([passed(truth), passed(truth), passed(truth)])
    assert np.abs(errors(fused, truth)).max() < 1e-9


def test_one_pass_stays_as_it_is() -> None:
    alone = passed(rails(np.random.default_rng(4)))
    fused = fuse([alone])
    pd.testing.assert_frame_equal(fused.geometry, alone.geometry)
    assert fused.geometry_draws is None and fused.mount == "axle"


def test_an_error_that_all_have_does_not_average_and_is_not_forgotten() -> None:
    """Of a stated variance of 2 a half is common: n passes leave 1 + 1/n, and say so."""
    rng = np.random.default_rng(5)
    truth = rails(rng)
    alike = np.stack([in_waves(rng, SD_M, (3.0, 25.0)) for _ in truth])
    own = [np.stack([in_waves(rng, SD_M, (3.0, 25.0)) for _ in truth]) for _ in range(16)]
    stated = SD_M * np.sqrt(2.0)
    for n in (2, 4, 16):
        fused = fuse([passed(truth + alike + one, sd_m=stated) for one in own[:n]], common=NONE)
        error = errors(fused, truth)
        assert np.sqrt(np.square(error).mean()) == pytest.approx(SD_M * np.sqrt(1.0 + 1.0 / n), rel=0.06)
        assert 0.93 <= inside(fused, error) <= 0.97
        told = fused.geometry["cross_level_sd_m"].mean()
        assert told == pytest.approx(SD_M * np.sqrt(1.0 + 1.0 / n), rel=0.06)


def test_what_is_common_at_least_counts_where_passes_state_too_little() -> None:
    rng = np.random.default_rng(6)
    truth = rails(rng)
    own = [np.stack([in_waves(rng, SD_M, (3.0, 25.0)) for _ in truth]) for _ in range(4)]
    fused = fuse([passed(truth + one, sd_m=0.1 * SD_M) for one in own], common={"cross_level_m": 2.0})
    sd = fused.geometry[["cross_level_sd_m", "alignment_sd_m"]].mean().to_numpy()
    assert sd == pytest.approx(SD_M * np.sqrt([2.0 + 0.25, 0.25]), rel=0.06)


def test_draws_say_in_which_waves_the_common_error_is() -> None:
    """Passes that agree but for long waves, and whose draws have an error of short ones."""
    rng = np.random.default_rng(7)
    truth = rails(rng)
    drawn = np.full((20, COUNT, 4), np.nan)
    lines = np.stack([[in_waves(rng, SD_M, (3.0, 6.0)) for _ in truth] for _ in range(20)])
    drawn[:, :, :3] = lines.swapaxes(1, 2)
    own = [np.stack([in_waves(rng, 0.1 * SD_M, (40.0, 70.0)) for _ in truth]) for _ in range(3)]
    fused = fuse([passed(truth + one, draws=drawn) for one in own], common=NONE)
    assert fused.geometry_draws is not None
    cross_level = fused.geometry_draws[:, :, 2]
    short = band_pass(cross_level, (1.5, 12.0), step_m=STEP_M)
    long = band_pass(cross_level, (20.0, 40.0), step_m=STEP_M)
    assert np.sqrt(np.nanmean(short**2)) == pytest.approx(SD_M, rel=0.1)
    assert np.sqrt(np.nanmean(long**2)) < 0.2 * SD_M


def shift_errors(seed: int, planted: FloatArray) -> tuple[FloatArray, float]:
    """Errors of the shift found of one of two passes, at places 100 m apart, and its sd.

    Both know their places alike, so that each is found half the planted shift from the mean of both.
    """
    rng = np.random.default_rng(seed)
    truth = rails(rng)
    seen = [truth + np.stack([in_waves(rng, SD_M, (3.0, 25.0)) for _ in truth]) for _ in range(2)]
    fused = fuse([passed(seen[0], shift_m=planted, position_sd_m=0.5), passed(seen[1], position_sd_m=0.5)])
    away = fused.shifts["0"].to_numpy() - 0.5 * planted
    return away[200:-200:400], float(fused.passes["shift_sd_m"][0])


@pytest.mark.parametrize("planted_m", [0.6, -0.6])
def test_a_planted_shift_is_found_within_its_sd(planted_m: float) -> None:
    """By hand: waves of 3 to 25 m, .77 mm and slopes of .97 mm/m, against .28 mm of difference, .59 degrees
    of freedom a metre, three quantities: an information of 83 /m2 a metre for half of the shift. A place
    of .5 m over 100 m may change by .2 m from node to node: each stands by its own 10 m, sd .035 m.
    """
    found = [shift_errors(seed, np.full(COUNT, planted_m)) for seed in range(5)]
    sd = np.array([one[1] for one in found])
    assert ((sd > 0.025) & (sd < 0.045)).all()
    away = np.concatenate([one[0] / one[1] for one in found])
    # 55 places that are nearly independent: four standard errors of the rms.
    assert abs(np.sqrt(np.square(away).mean()) - 1.0) < 4.0 * np.sqrt(0.5 / 55.0)


def test_a_shift_that_changes_along_the_track_is_found() -> None:
    away, sd = shift_errors(11, 0.4 * np.sin(2.0 * np.pi * PLACE / 800.0))
    assert np.abs(away).max() < 4.0 * sd < 0.3


def test_shifts_are_taken_out_before_fusing() -> None:
    """Left as they are, passes .6 m apart would average to the rails moved half of it either way."""
    truth = rails(np.random.default_rng(12))
    shifted = [passed(truth, shift_m=d, position_sd_m=0.5) for d in (0.3, -0.3)]
    inner = slice(40, -40)
    error = errors(fuse(shifted), truth)[:, inner]
    seen = [one.geometry[list(IRREGULARITY[:3])].to_numpy().T for one in shifted if one.geometry is not None]
    unmoved = (np.mean(seen, axis=0) - truth)[:, inner]
    assert np.sqrt(np.square(error).mean()) < 0.05 * np.sqrt(np.square(unmoved).mean())


def test_rails_found_farther_off_by_a_pass_that_states_less_count_less_for_the_place() -> None:
    """Places are those of the passes' mean, by the inverse variance of their positions."""
    truth = rails(np.random.default_rng(13))
    fused = fuse([passed(truth, shift_m=0.5, position_sd_m=0.5), passed(truth, position_sd_m=0.25)])
    assert fused.passes["shift_m"].to_numpy() == pytest.approx([0.4, -0.1], abs=0.01)


def test_a_backward_pass_knows_its_place_as_well() -> None:
    truth = rails(np.random.default_rng(14))
    forth, back = (passed(truth, position_sd_m=0.2, backwards=way) for way in (False, True))
    known = forth.states.assign(position_sd_m=np.linspace(0.1, 0.5, COUNT))
    turned = known.iloc[::-1].reset_index(drop=True).rename_axis("time_s")
    pairs = ((forth, known), (back, turned))
    sure = [Estimate(states, "axle", geometry=one.geometry) for one, states in pairs]
    both, twice = fuse(sure), fuse([sure[0], sure[0]])
    pd.testing.assert_frame_equal(both.geometry, twice.geometry)


def test_a_pass_that_is_wrong_counts_less_and_is_told() -> None:
    rng = np.random.default_rng(15)
    truth = rails(rng)
    own = [np.stack([in_waves(rng, SD_M * k, (3.0, 25.0)) for _ in truth]) for k in (1.0, 1.0, 1.0, 10.0)]
    fused = fuse([passed(truth + one) for one in own], common=NONE)
    # With the variances known it would be .577 of one pass, and equal weights would leave 2.5.
    assert np.sqrt(np.square(errors(fused, truth)).mean()) < 0.75 * SD_M
    assert fused.passes["cross_level_weight"][3] < 0.03
    assert "times as much" in fused.passes["told"][3]
    assert list(fused.passes["told"][:3]) == ["", "", ""]


def test_a_pass_that_is_wrong_for_a_while_counts_less_there() -> None:
    rng = np.random.default_rng(16)
    truth = rails(rng)
    own = [np.stack([in_waves(rng, SD_M, (3.0, 25.0)) for _ in truth]) for _ in range(4)]
    bad = slice(2000, 2600)
    wild = [*own[:3], own[3].copy()]
    wild[3][:, bad] += np.stack([in_waves(rng, 10.0 * SD_M, (3.0, 25.0)) for _ in truth])[:, bad]
    fused = fuse([passed(truth + one) for one in wild], common=NONE)
    inner = slice(2150, 2450)
    # Equal weights would leave 2.5 of one pass, three good ones leave .58.
    assert np.sqrt(np.square(errors(fused, truth)[:, inner]).mean()) < 0.8 * SD_M
    assert fused.passes["told"][3] != "" and list(fused.passes["told"][:3]) == ["", "", ""]


def test_a_short_fault_counts_less_where_it_is() -> None:
    """Seven times the error over 24 of 1200 m doubles the variance of a pass: by its weight alone, a third of
    that of the others, it would leave 7 x .14 = 1.0 there beside the .58 of three good ones.
    """
    left = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        truth = rails(rng)
        own = [np.stack([in_waves(rng, SD_M, (3.0, 25.0)) for _ in truth]) for _ in range(4)]
        own[3][:, 2400:2496] *= 7.0
        error = errors(fuse([passed(truth + one) for one in own], common=NONE), truth)
        left.append(np.square(error[:, 2400:2496]).mean())
    assert np.sqrt(np.mean(left)) < 0.8 * SD_M


def test_what_is_unsure_of_the_place_is_in_the_interval() -> None:
    """Two passes .2 m to either side of the rails, stated sd .3 m: the scatter is .08 m2, a half of what is
    stated is common at least, .045 + .08/2 m2 are left. A wave moved by d changes by a^2 (1 - cos k d) in the
    mean square, a^2 (1 - exp(-k^2 var/2)) in the mean over normal d.
    """
    amplitude, wave = 1e-3, 2.0 * np.pi / 20.0
    truth = np.stack([amplitude * np.sin(wave * PLACE)] * 3)
    fused = fuse([passed(truth, sd_m=1e-7, shift_m=d, position_sd_m=0.3) for d in (0.2, -0.2)], common=NONE)
    told = np.square(fused.geometry["cross_level_sd_m"].to_numpy()[400:-400]).mean()
    expected = amplitude**2 * (1.0 - np.exp(-0.5 * wave**2 * (0.045 + 0.04)))
    assert told == pytest.approx(expected, rel=0.1)


def test_other_rails_are_told() -> None:
    rng = np.random.default_rng(17)
    truth, others = rails(rng), rails(rng)
    noise = [np.stack([in_waves(rng, SD_M, (3.0, 25.0)) for _ in truth]) for _ in range(3)]
    told = fuse([passed(truth + noise[0]), passed(truth + noise[1]), passed(others)]).passes["told"]
    assert "other rails" in told[2] and "other rails" not in told[0] + told[1]


def test_a_place_far_from_what_is_stated_is_told() -> None:
    truth = rails(np.random.default_rng(18))
    told = fuse(
        [passed(truth, shift_m=3.0, position_sd_m=0.2), *[passed(truth, position_sd_m=0.2)] * 4]
    ).passes
    assert "along the track" in told["told"][0] and told["told"][1] == ""
    assert told["shift_m"][0] == pytest.approx(2.4, abs=0.02)


def test_a_baseline_that_answers_zero_has_no_interval() -> None:
    zero = passed(np.zeros((3, COUNT)), sd_m=float("nan"))
    fused = fuse([zero, zero, zero])
    assert list(fused.geometry) == list(IRREGULARITY) and fused.geometry_draws is None
    assert (fused.geometry[list(IRREGULARITY[:3])] == 0.0).all(axis=None)


def test_only_the_stretch_that_all_share_is_fused() -> None:
    truth = rails(np.random.default_rng(19))
    whole = passed(truth)
    assert whole.geometry is not None
    part = Estimate(whole.states, "frame", geometry=whole.geometry.iloc[400:-800])
    fused = fuse([whole, part])
    assert fused.geometry.index[[0, -1]].tolist() == [100.0, PLACE[-801]]
    assert fused.mount == "several"
    assert fused.geometry["gauge_m"].isna().all()


def without_rails() -> list[Estimate]:
    return [Estimate(passed(np.zeros((3, COUNT))).states, "axle")]


def apart() -> list[Estimate]:
    one = passed(np.zeros((3, COUNT)))
    assert one.geometry is not None
    return [one, Estimate(one.states, "axle", geometry=one.geometry.iloc[-300:])]


def coarser() -> list[Estimate]:
    one = passed(np.zeros((3, COUNT)))
    assert one.geometry is not None
    return [one, Estimate(one.states, "axle", geometry=one.geometry.iloc[::2])]


@pytest.mark.parametrize(
    ("estimates", "words"),
    [
        ([], ["estimates", "found 0", "1 or more"]),
        (without_rails(), ["estimates[0].geometry", "nothing of the rails", "geometry_step_m"]),
        (apart(), ["74.75 m", "100 m", "same stretch"]),
        (coarser(), ["estimates[1].geometry", "0.5 m", "0.25 m"]),
    ],
)
def test_what_cannot_be_fused_is_refused(estimates: list[Estimate], words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        fuse(estimates)
    assert all(word in str(caught.value) for word in words), str(caught.value)
