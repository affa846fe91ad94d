"""``[vibration]`` of a scenario: part of the ride, off beside it as an ablation, joined to the spectrum."""

from __future__ import annotations

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.ride.ride import Ride
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells, count
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, read_scenario
from simrail.track.laid_track import lay
from simrail.track.sections import section_gain
from simrail.track.spectra import SPECTRA

TEXT = """
title = "vibration"
seed = 1
track = "condequinto_olivar"
vehicle = "metro_irw_bogie"
engine = "kinematic"
odometry = "truth"
[irregularity]
spectrum = "erri_b176_low"
{table}
[[ride]]
name = "r"
start_m = 10.0
end_m = 60.0
speed_kmh = 20.0
rest_s = 1.0
[[imu]]
name = "axle"
grade = "lord_3dm_gx4_25"
body = "front"
position_m = [0.0, 0.0, 0.6]
[[estimator]]
name = "design"
method = "DesignAngles"
"""


def scenario(table: str) -> Scenario:
    return read_scenario(TEXT.replace("{table}", table), name="vibration")


def rides(table: str) -> list[Ride]:
    read = scenario(table)
    parts = Parts(read)
    return [parts.ride(cell) for cell in cells(read)]


def test_without_the_table_nothing_shakes_and_the_rails_are_as_they_were() -> None:
    (silent,) = rides("")
    assert silent.vibration is None and silent.irregularity.section_gain is None
    assert "vibration" not in silent.describe()


def test_off_is_the_same_ride_in_silence() -> None:
    loud, silent = rides("[vibration]\noff = [false, true]")
    assert loud.vibration is not None and silent.vibration is None
    assert loud.without_vibration == silent
    assert loud.describe() != silent.describe()
    assert count(scenario("[vibration]\noff = [false, true]")) == (2, 2)


def test_the_bare_table_has_every_source_but_joints() -> None:
    (ride,) = rides("[vibration]")
    assert ride.vibration is not None
    assert list(ride.vibration.named) == [
        *("roughness", "welds", "sleepers", "corrugation", "section_gain", "wheels", "flexible_track"),
        *("bending", "structure_borne", "equipment", "traction", "passengers"),
    ]


@pytest.mark.parametrize(
    ("table", "name"),
    [
        *((t, t) for t in ("roughness", "welds", "sleepers", "corrugation", "wheels", "bending")),
        *((t, t) for t in ("structure_borne", "equipment", "traction", "passengers")),
        ("track", "flexible_track"),
    ],
)
def test_each_source_has_its_switch(table: str, name: str) -> None:
    (with_all,), (without,) = rides("[vibration]"), rides(f"[vibration.{table}]\non = false")
    assert with_all.vibration is not None and without.vibration is not None
    gone = set(with_all.vibration.named) - set(without.vibration.named)
    # Roughness that is not there has no sections.
    assert gone == ({name, "section_gain"} if name == "roughness" else {name})


def test_roughness_begins_where_the_spectrum_ends() -> None:
    (ride,) = rides("wavelengths_m = [1.0, 100.0]\n[vibration]")
    assert ride.vibration is not None and ride.vibration.rails.roughness is not None
    assert ride.vibration.rails.roughness.longest_m == 1.0


def rail_density(scale: float = 1.0) -> float:
    """Density of a rail's height at 1.5 m: the profile's and a quarter of the cross-level's."""
    densities = SPECTRA["erri_b176_low"].densities
    return scale**2 * float(
        densities["vertical_profile_m"].density(1.0 / 1.5)
        + 0.25 * densities["cross_level_m"].density(1.0 / 1.5)
    )


@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_joined_roughness_meets_the_spectrum(scale: float) -> None:
    (ride,) = rides(f"scale = {scale}\n[vibration]\njoin = true")
    assert ride.vibration is not None and ride.vibration.rails.roughness is not None
    just_shorter = ride.vibration.rails.roughness.density(np.array([1.0001 / 1.5]))[0]
    assert just_shorter == pytest.approx(rail_density(scale), rel=1e-6)


def test_step_is_told() -> None:
    """Level 31 dB in the band of 1.6 m, 1/1.778 to 1/1.413 per m: r^2 over its width."""
    plan = judge_scenario(scenario("scale = 2.0\n[vibration]"))
    width = 10.0 ** (-1.5 / 10.0) - 10.0 ** (-2.5 / 10.0)
    step = 10.0 * np.log10(1e-12 * 10.0**3.1 / width / rail_density(2.0))
    (told,) = plan.notes
    assert f"at 1.5 m the roughness lies {abs(step):.1f} dB {'above' if step > 0 else 'below'}" in told
    (joined,) = judge_scenario(scenario("[vibration]\njoin = true")).notes
    assert "lies 0.0 dB" in joined
    assert abs(step) > 3.0
    assert any(told in line and "join = true" in line for line in plan.warnings)
    assert not any("vibration" in line for line in judge_scenario(scenario("[vibration]")).warnings)


def test_a_gap_between_table_and_spectrum_is_told() -> None:
    plan = judge_scenario(scenario("wavelengths_m = [3.0, 100.0]\n[vibration]"))
    assert any("no waves between 2.24 m" in line for line in plan.warnings)


def test_sections_scale_the_long_waves() -> None:
    (plain,), (gained,) = rides(""), rides("[vibration]")
    gain = gained.irregularity.section_gain
    assert gain is not None and gain.sd == 0.35
    s = np.arange(100.0, 900.0, 0.125 * 8)
    tracks = [lay(ride.track, ride.irregularity, seed=5).irregularities(s) for ride in (plain, gained)]
    expected = section_gain(s, gain, start_m=plain.track.start_m, seed=5)
    for column in ("alignment_m", "vertical_profile_m", "cross_level_m"):
        np.testing.assert_allclose(
            tracks[1][column], expected * tracks[0][column], atol=1e-9
        )  # splines through products
    np.testing.assert_allclose(tracks[1]["gauge_m"], tracks[0]["gauge_m"], atol=1e-15)


def test_own_table() -> None:
    own = '[vibration.roughness]\ntable = "own"\nwavelengths_m = [1.25, 1.0]\nlevels_db = [20.0, 10.0]'
    (ride,) = rides(own)
    assert ride.vibration is not None and ride.vibration.rails.roughness is not None
    width = 10.0**0.05 - 10.0**-0.05
    assert ride.vibration.rails.roughness.density(np.array([1.0]))[0] == pytest.approx(1e-11 / width)


FAULTS = {
    "an unknown source": ("[vibration.wind]\non = true", ["vibration.wind"]),
    "a negative level of no sense": (
        "[vibration.roughness]\noffset_db = 400.0",
        ["vibration.roughness.offset_db", "400", "40"],
    ),
    "an unknown table": ('[vibration.roughness]\ntable = "iso"', ["vibration.roughness.table", "iso_3095"]),
    "own levels that nothing uses": (
        "[vibration.roughness]\nwavelengths_m = [1.0]\nlevels_db = [1.0]",
        ["vibration.roughness.table", "own"],
    ),
    "own table without levels": ('[vibration.roughness]\ntable = "own"', ["vibration.roughness", "levels"]),
    "levels that are too few": (
        '[vibration.roughness]\ntable = "own"\nwavelengths_m = [1.25, 1.0]\nlevels_db = [1.0]',
        ["vibration.roughness.levels_db", "1 levels", "2"],
    ),
    "bands with a gap": (
        '[vibration.roughness]\ntable = "own"\nwavelengths_m = [1.25, 0.8]\nlevels_db = [1.0, 1.0]',
        ["vibration.roughness.wavelengths_m", "1.25, 0.8", "one-third octave"],
    ),
    "sections turned round": (
        "[vibration.section_gain]\nlengths_m = [400.0, 100.0]",
        ["vibration.section_gain.lengths_m", "shortest <= longest"],
    ),
    "a track without mass": ("[vibration.track]\nmass_kg = 0.0", ["vibration.track.mass_kg", "0.0"]),
    "a band turned round": (
        "[vibration.equipment]\nband_hz = [180.0, 15.0]",
        ["vibration.equipment.band_hz", "lowest < highest"],
    ),
    "a share above one": ("[vibration.structure_borne]\nshare = 2.0", ["share", "2.0", "<= 1"]),
    "undamped bending": ("[vibration.bending]\ndamping_ratio = 0.0", ["damping_ratio", "0.0", "> 0"]),
    "a rate that is no multiple": (
        "[vibration]\nrate_hz = 1500.0",
        ["vibration.rate_hz", "1500", "truth_rate_hz = 1000", "2000"],
    ),
    "noise beyond the truth": (
        "[vibration.traction]\nband_hz = [30.0, 480.0]",
        ["vibration.traction.band_hz", "480", "450"],
    ),
    "text for a number": ('[vibration.wheels]\namplitude_um = "60 um"', ["vibration.wheels.amplitude_um"]),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_one_line(fault: str) -> None:
    table, words = FAULTS[fault]
    with pytest.raises(InputError) as caught:
        judge_scenario(scenario(table))
    line = str(caught.value)
    assert "\n" not in line and "vibration.toml" in line
    for word in words:
        assert word in line, line


def test_fast_short_waves_need_a_higher_rate() -> None:
    text = TEXT.replace("speed_kmh = 20.0", "speed_kmh = 180.0\nacceleration_mps2 = 2.5\njerk_mps3 = 5.0")
    fast = text.replace("end_m = 60.0", "end_m = 1000.0").replace('"condequinto_olivar"', '"level_straight"')
    with pytest.raises(InputError, match="passes too fast") as caught:
        judge_scenario(read_scenario(fast.replace("{table}", "[vibration]"), name="fast"))
    assert "rate_hz = 4000" in str(caught.value)


def test_low_rate_of_the_truth_is_refused() -> None:
    low = TEXT.replace("seed = 1", "seed = 1\ntruth_rate_hz = 200.0").replace("{table}", "[vibration]")
    with pytest.raises(InputError, match="truth_rate_hz") as caught:
        judge_scenario(read_scenario(low, name="low"))
    assert "1000.0" in str(caught.value)


def test_step_must_divide_the_output_interval() -> None:
    text = TEXT.replace("seed = 1", "seed = 1\ntruth_rate_hz = 2000.0\nstep_s = 0.001")
    text = text.replace('"kinematic"', '"compiled"').replace("{table}", "")
    with pytest.raises(InputError, match="step_s") as caught:
        judge_scenario(read_scenario(text, name="step"))
    assert "0.0005" in str(caught.value)
