"""Scores of rail geometry: closed forms, windows, what is left open, and the way through a campaign."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.special import stdtr, stdtrit
from simrail.estimators.trajectory.track_geometry import track_geometry

from simrail.campaign.campaign import run_campaign
from simrail.core.columns import ATTITUDE, IRREGULARITY, ODOMETRY, ODOMETRY_SD, RELATIVE_POSITION
from simrail.core.errors import InputError
from simrail.core.toml_files import shipped
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import ImuSheet, Recording
from simrail.ride.ride import rails_of, simulate
from simrail.ride.truth import Mount
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.scenario import load_scenario, read_scenario
from simrail.scoring.aggregate import aggregate
from simrail.scoring.geometry import score_geometry
from simrail.scoring.table import FIGURE_COLUMNS, NO_TWIST, OK, UNOBSERVABLE
from simrail.track import bands as band_module
from simrail.track.bands import BANDS, TOO_SHORT, Band
from simrail.track.design import Curve, Straight, TrackDesign, Transition
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay

LINE = TrackDesign(
    "line",
    0.0,
    (Straight(300.0), Transition(40.0), Curve(100.0, 300.0, 0.05), Transition(40.0), Straight(520.0)),
)
LAID = lay(LINE, Irregularity("erri_b176_low", (1.5, 100.0), 40.0), seed=3)
S = np.arange(0.0, 1000.25, 0.25)

_TIME = pd.Index(np.arange(3) / 250.0, name="time_s")
RECORDING = Recording(
    name="any",
    imu=pd.DataFrame(index=_TIME),
    imu_sheet=ImuSheet("exact", 250.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    mount="axle",
    mount_body="front",
    mount_position_m=(0.0, 0.0, 0.6),
    track=LINE,
    encoder=None,
    encoder_sheet=None,
    start_position_m=0.0,
    odometry=pd.DataFrame(0.0, index=_TIME, columns=[*ODOMETRY, *ODOMETRY_SD]),
    odometry_source="truth",
)


def estimate(error=None, places=S, **sds):
    """The rails as they lie, plus errors by column."""
    geometry = LAID.irregularities(places)
    for name, values in (error or {}).items():
        geometry[name] += values
    return Estimate(pd.DataFrame(index=_TIME), "axle", geometry=geometry.assign(**sds))


def figure(table, quantity, metric, *, band="full", window="whole"):
    rows = table[
        (table["quantity"] == quantity)
        & (table["metric"] == metric)
        & (table["band"] == band)
        & (table["window"] == window)
    ]
    assert len(rows) == 1, (quantity, metric, band, window, len(rows))
    assert rows["status"].iloc[0] == OK
    return float(rows["value"].iloc[0])


def test_figures_of_known_errors_are_the_closed_forms():
    wave = 2e-3 * np.sin(2 * np.pi * S / 10.0)
    table = score_geometry(
        estimate({"alignment_m": 1e-3, "cross_level_m": wave, "vertical_profile_m": wave + 4e-3}),
        LAID,
        RECORDING,
    )
    assert list(table.columns) == list(FIGURE_COLUMNS)
    assert set(table["unit"]) == {"mm"} and set(table["reference"]) == {"truth"}
    for metric, value in (("mean", 1.0), ("rms", 1.0), ("sd", 0.0), ("max", 1.0), ("p95", 1.0)):
        assert figure(table, "alignment", metric) == pytest.approx(value, abs=1e-9)
    assert figure(table, "vertical_profile", "mean") == pytest.approx(4.0, rel=1e-3)
    for quantity in ("cross_level", "vertical_profile"):
        # In its band the wave is whole and the mean is gone; an octave above it is gone as well.
        assert figure(table, quantity, "rms", band="D1") == pytest.approx(np.sqrt(2.0), rel=0.01)
        assert figure(table, quantity, "rms", band="D2") < 0.01
    assert figure(table, "alignment", "rms", band="D1") < 1e-6
    turned = 2.0 * 2.0 * np.sin(np.pi * 3.0 / 10.0) / np.sqrt(2.0)
    for band in ("full", "D1"):
        assert figure(table, "twist", "rms", band=band) == pytest.approx(turned, rel=0.01)
    assert figure(table, "gauge", "max") == 0.0


def test_windows_are_those_of_the_track_and_bands_have_margins():
    table = score_geometry(estimate({"alignment_m": np.where(S < 300.0, 1e-3, 2e-3)}), LAID, RECORDING)
    assert figure(table, "alignment", "mean", window="curve") == pytest.approx(2.0)
    assert figure(table, "alignment", "mean", window="curve:curve 3 R300") == pytest.approx(2.0)
    whole = table[(table["metric"] == "rms") & (table["window"] == "whole") & (table["status"] == OK)]
    counts = whole.set_index(["quantity", "band"])["n_samples"]
    assert counts["alignment", "full"] == len(S) and counts["twist", "full"] == len(S) - 12
    assert counts["alignment", "D1"] == len(S) - 2 * 200 and counts["twist", "D1"] == len(S) - 2 * 200 - 12
    assert counts["alignment", "D2"] == len(S) - 2 * 560
    assert not {"standstill", "moving"} & set(table["window"].astype(str))
    assert not {"final", "nis"} & set(table["metric"].astype(str))


def test_consistency_is_that_of_the_unfiltered_irregularities():
    rng = np.random.default_rng(6)
    sd = 0.2e-3
    table = score_geometry(
        estimate({"cross_level_m": sd * rng.standard_normal(len(S))}, cross_level_sd_m=sd), LAID, RECORDING
    )
    spread = 4.0 * np.sqrt(2.0 / len(S))
    assert figure(table, "cross_level", "nees") == pytest.approx(1.0, abs=spread)
    assert figure(table, "cross_level", "coverage95") == pytest.approx(0.95, abs=0.015)
    told = table[table["metric"].isin(["nees", "coverage95"])]
    assert set(zip(told["quantity"], told["band"], strict=True)) == {("cross_level", "full")}


def rough(rng, count):
    """Errors (count, places), m: white, so that a band has a share of their variance and twist twice it."""
    return 1e-3 * rng.standard_normal((count, len(S)))


def test_twist_is_what_the_cross_level_gains_over_its_base():
    """An error that grows by 1 mm with each metre is a twist of +3 mm over 3 m, whatever the rails are."""
    table = score_geometry(estimate({"cross_level_m": 1e-3 * S}), LAID, RECORDING, windows=["whole"])
    assert figure(table, "twist", "mean") == pytest.approx(3.0, abs=1e-9)


def test_coverage_in_a_band_and_of_twist_is_by_draws_of_the_error():
    """Of draws as large as the error 95 % lie inside, within what 1000 m hold; of others Student's share."""
    rng = np.random.default_rng(4)
    error = rough(rng, 1)[0]
    found = estimate({"cross_level_m": error}, cross_level_sd_m=1e-3)
    for scale in (1.0, 0.5, 2.0):
        share = 2.0 * stdtr(60, scale * stdtrit(60, 0.975)) - 1.0
        # D0 over 980 m has some 1500 degrees of freedom; their squares, of which it is a matter, count half.
        spread = 4.0 * np.sqrt(share * (1.0 - share) / 700.0) + 1e-3
        draws = np.zeros((60, len(S), 4))
        draws[:, :, 2] = scale * rough(rng, 60)
        table = score_geometry(replace(found, geometry_draws=draws), LAID, RECORDING, windows=["whole"])
        assert figure(table, "cross_level", "coverage95", band="D0") == pytest.approx(share, abs=spread)
        for band in ("full", "D0"):
            assert figure(table, "twist", "coverage95", band=band) == pytest.approx(share, abs=spread)
        told = table[table["metric"] == "nees"]  # the mean square of a Student's t is no 1
        assert set(zip(told["quantity"], told["band"], strict=True)) == {("cross_level", "full")}
        # Unfiltered, the estimate's own standard deviation counts.
        assert figure(table, "cross_level", "coverage95") == pytest.approx(0.95, abs=0.015)
    for shape in ((60, len(S) - 1, 4), (60, len(S), 3)):
        with pytest.raises(InputError, match="geometry_draws"):
            score_geometry(replace(found, geometry_draws=np.zeros(shape)), LAID, RECORDING)


def test_what_is_left_open_is_told_once_and_is_no_failure():
    known = estimate(places=S[:3601], gauge_m=np.nan)
    table = score_geometry(known, LAID, RECORDING, metrics=["rms"], twist_base_m=3.1)
    empty = table[table["status"] != OK].set_index(["quantity", "band"])["status"]
    assert empty["gauge", "full"] == UNOBSERVABLE
    assert empty["alignment", "D3"] == TOO_SHORT
    assert {empty["twist", band] for band in ("full", "D1")} == {NO_TWIST}
    # 900 m hold waves of 150 m, and not those of 200 m that D3 has for alignment.
    assert ("vertical_profile", "D3") not in empty and ("gauge", "D3") not in empty
    assert empty.index.is_unique
    labels = dict.fromkeys(
        ("scenario", "ride", "vehicle", "mount", "imu", "odometry", "map", "vibration", "tuning"), "x"
    )
    labels |= {"estimator": "e", "cell": 0, "track_draw": 0, "sensor_draw": 0}
    assert aggregate(table.assign(**labels))["failed"].sum() == 0


def test_a_hole_in_the_middle_is_a_failure_that_is_told():
    holed = estimate()
    holed.geometry.iloc[2000:2010, 0] = np.nan
    table = score_geometry(holed, LAID, RECORDING, metrics=["rms"], windows=["whole"])
    status = table[table["quantity"] == "alignment"]["status"].astype(str)
    assert (status == "estimate not finite in 10 of 4001 samples").all()


def test_a_train_that_stood_has_rows_without_samples():
    none = estimate(places=S[:0])
    table = score_geometry(none, LAID, RECORDING, metrics=["rms"], windows=["whole"])
    assert set(table["status"].astype(str)) == {"no samples", TOO_SHORT}


def test_bad_geometry_is_named():
    with pytest.raises(InputError, match="says nothing of the rails"):
        score_geometry(replace(estimate(), geometry=None), LAID, RECORDING)
    with pytest.raises(InputError, match="gauge_m"):
        score_geometry(replace(estimate(), geometry=estimate().geometry.iloc[:, :3]), LAID, RECORDING)
    with pytest.raises(InputError, match="not over uniform places"):
        score_geometry(replace(estimate(), geometry=estimate().geometry.drop(index=5.0)), LAID, RECORDING)
    with pytest.raises(InputError, match="paper: is not a band"):
        score_geometry(estimate(), LAID, RECORDING, bands=[Band("paper", 7.0, 0.3)])


def test_exchanged_bands_would_be_seen():
    wave = 2e-3 * np.sin(2 * np.pi * S / 10.0)
    swapped = [replace(BANDS["D2"], name="D1"), replace(BANDS["D1"], name="D2")]
    table = score_geometry(estimate({"cross_level_m": wave}), LAID, RECORDING, bands=swapped)
    assert figure(table, "cross_level", "rms", band="D1") < 0.1


KNOWING = """
from dataclasses import dataclass, replace
from simrail.estimators.baselines import ZeroTrack
from simrail.estimators.trajectory.track_geometry import track_geometry


@dataclass(frozen=True)
class Known:
    causal = False

    def estimate(self, recording):
        made = ZeroTrack().estimate(recording)
        return replace(made, geometry=track_geometry(made, recording))
"""


@pytest.fixture(scope="module", autouse=True)
def own_cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setattr("simrail.ride.cache.cache_folder", lambda: folder)
        yield


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    own = tmp_path_factory.mktemp("own") / "known.py"
    own.write_text(KNOWING, encoding="utf-8")
    text = (
        f"estimator=[{{name='zero',method='{own}:ZeroTrack'}},{{name='known',method='{own}:Known'}}]",
        "monte_carlo.sensor_draws=1",
        "ride.rest_s=2.0",
        "ride.speed_kmh=70.0",
        "odometry='truth'",
        "imu.grade='ideal'",
    )
    plain = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
    tables = '[rail_sensor]\n[geometry]\nbands = ["D1"]\nown_bands = { paper = [2.0, 6.0] }\n'
    return read_scenario(f"{plain}\n{tables}", name="rails", overrides=text)


def test_rows_of_every_quantity_and_band(scenario):
    result = run_campaign(scenario)
    assert result.failures == []
    rows = result.scores.query("window == 'whole' and metric == 'sd'")
    value = rows.set_index(["estimator", "quantity", "band"])["value"]
    assert set(rows["band"].astype(str)) == {"full", "D1", "paper"}
    cell = next(iter(cells(scenario)))
    true = rails_of(Parts(scenario).ride(cell)).irregularities(np.arange(10.0, 590.1, 0.25))
    for name in IRREGULARITY[:3]:
        quantity = name.removesuffix("_m")
        # The baseline errs by the rails themselves.
        rails = 1e3 * band_module.band_pass(true[name].to_numpy(), (3.0, 25.0), step_m=0.25)
        assert value["zero", quantity, "D1"] == pytest.approx(np.nanstd(rails), rel=0.02)
    # The sensor alone, on a body of which only the design is known, gives the gauge, and no more.
    assert value["known", "gauge", "D1"] < 0.06 < value["zero", "alignment", "D1"]
    assert result.scores["n_samples"].min() >= 0


def test_bands_of_a_scenario(scenario):
    assert Parts(scenario).resolve(next(cells(scenario))).bands == (BANDS["D1"], Band("paper", 2.0, 6.0))
    quick = load_scenario("quick_kinematic")
    plain = Parts(quick).resolve(next(cells(quick)))
    assert plain.bands == tuple(BANDS.values()) and quick.spec.geometry.twist_base_m == 3.0


def test_rails_are_laid_once_and_are_those_of_the_ride(scenario):
    parts, cell = Parts(scenario), next(iter(cells(scenario)))
    first = parts.rails(cell)
    assert parts.rails(cell) is first
    np.testing.assert_array_equal(first.table, rails_of(parts.ride(cell)).table)


def test_a_kinematic_ride_of_a_vehicle_gives_its_rails_back(scenario):
    """Every body leans over the middle of the rails, at whatever height it has its centre of gravity."""
    parts, cell = Parts(scenario), next(iter(cells(scenario)))
    truth = simulate(parts.ride(cell))
    mount = Mount("axle", "front", (0.0, 0.0, 0.6))
    motion = truth.motion(mount).iloc[::4]
    odometry = motion[list(ODOMETRY)].assign(**dict.fromkeys(ODOMETRY_SD, 0.0))
    recording = replace(RECORDING, track=truth.track, imu=motion, odometry=odometry)
    known = Estimate(motion[[*ATTITUDE, *RELATIVE_POSITION]], "axle")
    known = replace(known, geometry=track_geometry(known, recording))
    rows = score_geometry(known, parts.rails(cell), recording, bands=[BANDS["D1"]], windows=["whole"])
    worst = rows[(rows["metric"] == "max") & (rows["status"] == OK)]
    assert set(worst["quantity"]) == {"alignment", "vertical_profile", "cross_level", "twist"}
    assert worst["value"].max() < 0.05
