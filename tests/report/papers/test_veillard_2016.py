"""The section beside Veillard et al. 2016: its scenario, figures in closed form, every verdict both ways."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.cell import CellResult
from simrail.core.columns import ACCEL, ACCELERATION, ATTITUDE, IMU, ODOMETRY
from simrail.core.seeds import stream
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import ImuSheet, Recording
from simrail.report.pages.frame import page_text
from simrail.report.pages.section import PageData
from simrail.report.papers.claim import Claim, judged
from simrail.report.papers.veillard_2016 import judges
from simrail.report.papers.veillard_2016.figures import sharpest
from simrail.report.papers.veillard_2016.judges import OURS, Evidence, beside_ours, errata
from simrail.report.papers.veillard_2016.lines import (
    FIGURES,
    PAPER,
    PER_MG,
    Draws,
    Lines,
    lines_of,
    shares_of_chance,
)
from simrail.report.papers.veillard_2016.ride import (
    Distances,
    SpectrumOverSpeed,
    distances_of,
    spectrum_over_speed,
)
from simrail.report.papers.veillard_2016.section import section, table_of
from simrail.scenario.build import Parts
from simrail.scenario.cells import methods
from simrail.scenario.scenario import load_scenario
from simrail.track.design import Curve, Straight, TrackDesign, Transition

G = 9.81
MOUNTS = ("floor", "frame")

# ---- the scenario ------------------------------------------------------------------------------


def test_every_part_is_played_by_one_method_of_the_scenario() -> None:
    scenario = load_scenario("imu_only")
    ran = methods(scenario)
    names = PAPER.names(ran)
    assert sorted(names) == sorted(PAPER.parts) and len(names) == len(ran)
    spec = scenario.spec.monte_carlo
    assert spec.track_draws >= 10 and spec.sensor_draws >= 5
    assert tuple(imu.name for imu in scenario.spec.imu) == MOUNTS


def test_only_ablations_of_the_scenario_hear_the_encoder() -> None:
    scenario = load_scenario("imu_only")
    for name, estimator in Parts(scenario).estimators(0).items():
        hears = "encoder" in getattr(estimator, "needs", ())
        assert hears == (getattr(estimator, "calibration", "") == "encoder"), name
        assert not hears or estimator.role == "ablation", name
        assert getattr(estimator, "wheel", False) is False, name
    assert scenario.spec.odometry == "none"


# ---- verdicts, from planted scores -------------------------------------------------------------

SIZES = {  # of a world in which the paper is right, in the units of `FIGURES`
    "along": 4.0,
    "along_max": 25.0,
    "across": 4.0,
    "roll": 0.2,
    "pitch": 0.2,
    "roll_max": 1.0,
    "roll_curve": 0.2,
    "roll_straight": 0.2,
    "roll_still": 0.2,
    "speed": 2.5,
    "speed_max": 8.0,
    "speed_mean": 0.0,
    "distance": 0.0,
}
DISTANCE = {"average": -2.0, "smooth": 25.0, "rough": -20.0, "paper": -4.0, "standstill": 1.0}

Change = Callable[[str, str, str], float]
"""(part, mount, figure) to what is added, in units of the figure."""


def nothing(part: str, mount: str, figure: str) -> float:
    return 0.0


def planted(
    change: Change = nothing, *, without: tuple[str, ...] = (), lines: int = 4, devices: int = 3
) -> Lines:
    """Scores of every part; lines differ by one part in a hundred, devices by one in a thousand."""
    rows = []
    for part in PAPER.parts:
        for mount in MOUNTS:
            for figure, size in SIZES.items():
                look = FIGURES[figure]
                value = DISTANCE.get(part, 0.5) if figure == "distance" else size
                value += change(part, mount, figure)
                for line in range(lines):
                    for device in range(devices):
                        own = value * (1.0 + 0.01 * (line - 1.5) + 0.001 * (device - 1))
                        words = (part, mount, look.quantity, look.metric, look.window)
                        rows.append((*words, line, device, own / look.scale))
    columns = ["estimator", "mount", "quantity", "metric", "window", "track_draw", "sensor_draw", "value"]
    table = pd.DataFrame(rows, columns=columns).assign(
        reference="truth", band="full", status="ok", imu="lord_3dm_gx4_25", map="drawn", vibration="on"
    )
    ran = [
        SimpleNamespace(name=part, part=SimpleNamespace(stands_for=part))
        for part in PAPER.parts
        if part not in without
    ]
    return lines_of(table, ran)  # type: ignore[arg-type]


def spectrum(explained: float = 0.95, means: float = 0.99) -> SpectrumOverSpeed:
    none = np.zeros(0)
    return SpectrumOverSpeed(none, none, none, none, 1.0, -10.0, 2.0, explained, means, 0.5)


SPECTRA = {"floor": spectrum(0.4, 0.3), "frame": spectrum()}
FAR = {mount: Distances(-4.0, 300.0) for mount in MOUNTS}


def verdicts(lines: Lines, spectra: dict = SPECTRA, distances: dict = FAR) -> dict[str, Claim]:
    claims = judged(PAPER, Evidence(lines, spectra, distances), judges, has=lines.has)
    return {claim.key: claim for claim in claims}


def only(part: str, figure: str, added: float, *, mount: str = "") -> Change:
    """Change one figure of a part, at mounts whose name holds a word."""
    return lambda p, m, f: added if (p, f) == (part, figure) and mount in m else 0.0


def test_all_claims_hold_where_the_paper_is_right() -> None:
    assert {claim.verdict for claim in verdicts(planted()).values()} == {"reproduced"}


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("acceleration", only("paper", "along", 2.1)),
        ("acceleration", only("paper", "along", -1.5)),
        ("attitude", only("paper", "roll", 0.11)),
        ("attitude", only("paper", "pitch", 0.11)),
        ("speed", only("paper", "speed", 1.3)),
        ("centred", only("paper", "speed_mean", 0.6)),
        ("centred", only("paper", "speed_mean", -0.6)),
        ("distance", lambda p, m, f: -0.9 * DISTANCE.get(p, 0.0) if f == "distance" else 0.0),
        ("complementary", only("complementary", "roll_curve", 0.15, mount="floor")),
        ("complementary", only("complementary", "pitch", 0.15, mount="frame")),
    ],
)
def test_each_verdict_can_fall(key: str, change: Change) -> None:
    found = verdicts(planted(change))
    assert {name for name, claim in found.items() if claim.verdict != "reproduced"} == {key}


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("acceleration", only("paper", "along", 9.0, mount="floor")),
        ("attitude", only("paper", "pitch", 0.9, mount="floor")),
        ("speed", only("paper", "speed", 4.0, mount="floor")),
    ],
)
def test_sizes_hold_at_one_mount(key: str, change: Change) -> None:
    """The paper does not say where its IMU was."""
    assert verdicts(planted(change))[key].verdict == "reproduced"


def test_attitude_holds_at_one_and_the_same_mount() -> None:
    """Roll that is right on the floor and pitch that is right on the frame are no attitude."""

    def split(part: str, mount: str, figure: str) -> float:
        return 0.5 if part == "paper" and (mount, figure) in (("floor", "pitch"), ("frame", "roll")) else 0.0

    assert verdicts(planted(split))["attitude"].verdict == "not reproduced"


def test_claims_of_the_ride_that_is_drawn_can_fall() -> None:
    bent = {mount: spectrum(0.95, 0.8) for mount in MOUNTS}
    assert verdicts(planted(), spectra=bent)["linear"].verdict == "not reproduced"
    scattered = {mount: spectrum(0.8, 0.99) for mount in MOUNTS}
    assert verdicts(planted(), spectra=scattered)["linear"].verdict == "not reproduced"
    near = {"floor": Distances(-4.0, 300.0), "frame": Distances(-4.0, 3.0)}
    assert verdicts(planted(), distances=near)["double_integration"].verdict == "not reproduced"
    unasked = verdicts(planted(), spectra={}, distances={})
    assert {unasked[key].verdict for key in ("linear", "double_integration")} == {"not asked"}


def test_what_was_not_run_or_failed_somewhere_is_not_judged() -> None:
    found = verdicts(planted(without=("paper",)))
    asked = {key for key, claim in found.items() if claim.verdict != "not asked"}
    assert asked == {"complementary"}
    whole = planted()
    failed = (whole.table["estimator"] == "paper") & (whole.table["mount"] == "frame")
    first = failed & (whole.table["track_draw"] == 1) & (whole.table["sensor_draw"] == 1)
    broken = Lines(whole.table[~first], whole.names, whole.mounts)
    assert not broken.has("paper") and broken.has("average")


def test_the_figures_of_a_sentence_are_looked_up() -> None:
    found = verdicts(planted(only("paper", "speed", 0.5)))
    assert "3.00 m/s" in found["speed"].ours and found["speed"].printed == "2.5 m/s rms, 8 at most"
    # 6.4 km in an hour and a half.
    assert "1.19 m/s" in found["centred"].cause
    assert "25" in found["distance"].ours and "between calibrations" in found["distance"].cause


def test_chance_has_three_levels() -> None:
    """Calibrations 10 apart, lines 3 apart, devices 1 apart, each about its own mean."""
    rng = stream(1, "chance")
    lines, devices = np.repeat(np.arange(400.0), 5), rng.standard_normal(2000)
    of_line = 3.0 * np.repeat(rng.standard_normal(400), 5)
    by = {
        name: Draws(level + of_line + devices, lines)
        for name, level in (("a", -10.0), ("b", 0.0), ("c", 10.0))
    }
    found = shares_of_chance(by)
    assert found["calibrations"] == pytest.approx(10.0, rel=0.01)
    # Means over five devices have a fifth of their variance on top. Four standard errors of 400 lines.
    assert found["lines"] == pytest.approx(np.sqrt(9.0 + 0.2), rel=4.0 / np.sqrt(800.0))
    assert found["devices"] == pytest.approx(1.0, rel=4.0 / np.sqrt(3200.0))


def test_an_interval_has_lines_for_clusters() -> None:
    """Devices of one line say the same: they make no interval narrower."""
    line = np.repeat(np.arange(10.0), 5)
    one = Draws(np.arange(10.0), np.arange(10.0)).mean()
    assert Draws(line, line).mean() == pytest.approx(one)


def test_the_interval_of_an_rms_does_not_go_below_zero() -> None:
    line, values = np.array([0.0, 1.0]), np.array([0.1, 5.0])
    assert Draws(values, line).mean()[1] < 0.0 == Draws(values, line, is_size=True).mean()[1]


def test_an_ideal_imu_is_left_out() -> None:
    whole = planted()
    ideal = whole.table.assign(imu="ideal", value=99.0)
    ran = [SimpleNamespace(name=part, part=SimpleNamespace(stands_for=part)) for part in PAPER.parts]
    both = lines_of(pd.concat([ideal, whole.table]), ran)  # type: ignore[arg-type]
    assert both.draws("paper", "speed", "frame").values.max() < 3.0


def test_errata_tell_the_size_of_their_effect() -> None:
    notes = errata(Evidence(planted(only("spectral_printed", "speed", 1.0))))
    assert "3.50 m/s as printed, 2.50" in notes[0]
    # asin against atan of sin 8 degrees.
    assert any("0.0769\u00b0 too small" in note for note in notes)
    assert len(errata(Evidence(planted(without=("spectral_printed", "late"))))) == len(notes) - 2


def test_ours_is_said_to_lose_where_it_loses() -> None:
    lost = beside_ours(Evidence(planted(only("track_relative", "speed", 90.0))))
    assert len(lost) == len(OURS), "a sentence each"
    assert "track-relative smoother" in lost[0] and "92.5 m/s rms against 2.50" in lost[0]
    assert "loses in speed, wins in distance" in lost[0] and not any("loses" in one for one in lost[1:])
    won = beside_ours(Evidence(planted(only("track_relative", "speed", -2.0), without=("curve_matched",))))
    assert "wins in both" in won[0] and not any("loses" in sentence for sentence in won)
    assert beside_ours(Evidence(planted(without=OURS))) == []


def test_the_table_has_every_part_in_mg_and_the_range_of_the_distance() -> None:
    table = table_of(planted(), "frame")
    assert [row.label for row in table.rows[1:]] == [role.label for role in PAPER.parts.values()]
    assert table.rows[0].cells[0].text == "4" and table.rows[1].cells[0].text == "4.0"
    smooth = table.rows[1 + list(PAPER.parts).index("smooth")].cells[6].text
    assert smooth == "+24.6 to +25.4"
    near = next(i for i, part in enumerate(PAPER.parts, start=1) if part not in DISTANCE)
    assert table.rows[near].cells[6].text == "+0.492 to +0.508", "a tenth would say nothing of it"
    assert "\u22120.00" not in {cell.text for row in table.rows for cell in row.cells}
    assert pytest.approx(1e3 / G) == PER_MG


# ---- what a ride shows -------------------------------------------------------------------------

RATE = 250.0
TRACK = TrackDesign(
    name="line",
    start_m=0.0,
    elements=(
        Straight(800.0),
        Transition(50.0),
        Curve(400.0, 300.0, 0.131),  # at 16 m/s its cant leaves nothing
        Transition(50.0),
        Straight(300.0),
        Transition(50.0),
        Curve(200.0, -400.0, 0.0),
        Transition(50.0),
        Straight(2100.0),
    ),
    source="made up for this test",
    synthetic=True,
)


def example(exponent: float = 2.0, *, mount: str = "frame") -> CellResult:
    """A train that gains speed, runs and stops; white noise whose sd goes with a power of the speed."""
    t = np.arange(0.0, 240.0, 1.0 / RATE)
    v = 16.0 * np.clip(np.minimum((t - 20.0) / 80.0, (220.0 - t) / 80.0), 0.0, 1.0)
    a = np.gradient(v, t)
    s = 10.0 + np.cumsum(v) / RATE
    frame = TRACK.frame(s)
    columns = dict.fromkeys(ATTITUDE, 0.0 * t) | {"roll_rad": frame.roll_rad}
    columns |= dict(zip(ODOMETRY, (s, v, a), strict=True)) | dict(
        zip(ACCEL, (a, 0.0 * t, G + 0.0 * t), strict=True)
    )
    motion = pd.DataFrame(columns, index=pd.Index(t, name="time_s"))
    imu = pd.DataFrame(0.0, index=motion.index, columns=list(IMU))
    shaking = 1e-3 + 0.5 * (v / 16.0) ** exponent
    imu[ACCEL[2]] = G + shaking * stream(5, mount).standard_normal(len(t))
    recording = Recording(
        name="line",
        imu=imu,
        imu_sheet=ImuSheet("lord_3dm_gx4_25", RATE, 0.01, *([1e-3] * 6)),
        mount=mount,
        mount_body="body",
        mount_position_m=(0.0, 0.0, 0.6),
        track=TRACK,
        encoder=None,
        encoder_sheet=None,
        start_position_m=10.0,
    )
    states = motion[[*ATTITUDE, *ODOMETRY]].copy()
    states["speed_mps"] += 0.5
    states[ACCELERATION[0]] = a + 0.1
    estimates = {name: Estimate(states=states, mount=mount) for name in ("ekf_paper", "complementary")}
    return CellResult({"cell": 0}, recording, motion, estimates)


def test_a_square_law_of_the_vibration_is_a_line_of_the_spectrum() -> None:
    """sqrt(S) of white noise goes with the root of its sd: sd by v^2 makes it linear, from the origin."""
    found = spectrum_over_speed(example())
    assert found.explained > 0.98 and found.explained_of_means > 0.98
    assert found.exponent == pytest.approx(1.0, abs=0.1)
    assert found.rms < 1.0


def test_frames_are_dated_at_their_centre() -> None:
    one = example()
    centres = 511 + 128 * np.arange(len(spectrum_over_speed(one).speed))
    np.testing.assert_array_equal(spectrum_over_speed(one).speed, one.motion["speed_mps"].to_numpy()[centres])


def test_a_linear_law_of_the_vibration_is_a_root() -> None:
    assert spectrum_over_speed(example(1.0)).exponent == pytest.approx(0.5, abs=0.06)


def test_sums_of_speed_and_acceleration_lead_where_their_errors_do() -> None:
    one = example()
    way, long_s = one.motion["position_m"].iloc[-1] - 10.0, 240.0
    found = distances_of(one, "ekf_paper")
    assert found is not None
    assert found.by_speed == pytest.approx(100.0 * 0.5 * long_s / way, rel=1e-3)
    assert found.by_acceleration == pytest.approx(100.0 * 0.5 * 0.1 * long_s**2 / way, rel=1e-2)
    assert distances_of(one, "none") is None


def test_errors_are_shares_of_the_way_there_and_back() -> None:
    """100 m out and 60 m back at 10 Hz: 160 m of way; what is found says 40 m and 8 m more, or 16 m less."""
    true = np.concatenate([np.linspace(0.0, 100.0, 101), np.linspace(99.0, 40.0, 60)])
    speed = np.zeros(161)
    speed[0] = 480.0  # 0.1 s of it are 48 m
    acceleration = np.zeros(161)
    acceleration[-16] = 150.0  # felt by 16 sums of 0.1 s after one of 0.1 s: 24 m
    states = pd.DataFrame({"speed_mps": speed, ACCELERATION[0]: acceleration})
    one = SimpleNamespace(
        estimates={"found": SimpleNamespace(states=states)},
        recording=SimpleNamespace(imu_sheet=SimpleNamespace(rate_hz=10.0)),
        motion=pd.DataFrame({"position_m": true}),
    )
    found = distances_of(one, "found")  # type: ignore[arg-type]
    assert found == pytest.approx((5.0, -10.0))


def test_the_curve_that_is_drawn_is_that_which_leans() -> None:
    """Not the sharpest, whose cant carries all of it."""
    assert sharpest(example()) == (1650.0, 1850.0)


@pytest.mark.long
def test_the_section_is_written() -> None:
    scenario = load_scenario("imu_only")
    names = {part: name for name, part in ((m.name, m.part.stands_for) for m in methods(scenario))}
    whole = planted()
    table = whole.table.assign(estimator=[names[part] for part in whole.table["estimator"]])
    data = PageData(scenario, table, pd.DataFrame(), [example(mount=mount) for mount in MOUNTS], {})
    (made,) = section(data)
    text = page_text(made.template, **made.data)
    for words in (
        "mean over lines",
        "Eq. 4 gives the roll",
        "between calibrations",
        "frame: roll over the curve",
    ):
        assert words in text, words
    assert text.count("<svg") == 8 and "nan" not in text.lower().replace("nan%", "")
    assert section(PageData(scenario, table.iloc[:0], pd.DataFrame(), [], {})) == []
