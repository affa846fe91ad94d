"""CML and KOM: what a search finds in data whose noise is known, and what it must keep to.

The synthetic data are drawn from the smoother's own model: states from its prior and its process, signals
from its measurements. The virtual positions, constants and no draw, get a variance that says nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd
import pytest
import simrail.estimators.tuning.objectives
from scipy.stats import chi2
from simrail.estimators.trajectory.kernel import STATES, TERMS, Model
from simrail.estimators.trajectory.model import kinds_of, process_noise
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.trajectory.smoother import TrajectorySmoother, log_likelihood
from simrail.estimators.tuning import tune as generic
from simrail.estimators.tuning.cube import Cube
from simrail.estimators.tuning.file import Tuning
from simrail.estimators.tuning.identify import (
    CONSTRAINT,
    FLAT,
    HELD,
    IDENTIFIED,
    LOWER,
    UPPER,
    _from_log,
    _moved,
    _to_log,
    _width,
    identify,
)
from simrail.estimators.tuning.objectives import Likelihood, SmootherTuning, likelihoods
from simrail.estimators.tuning.search import least
from simrail.estimators.tuning.space import NAMES, SearchSpace
from twins.trajectory import measured, transition

from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.estimation.tunable import Objective, Parameter, tunables_of
from simrail.recording.recording import Recording
from simrail.track.bands import BANDS
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay

STEP_S, GRAVITY, RIDES, SAMPLES = 0.004, 9.81, 60, 500
NOTHING = 1e6
TRUE = Hyperparameters(
    roll_rad2ps3=2e-3,
    pitch_rad2ps3=1e-3,
    yaw_rad2ps3=5e-4,
    lateral_m2ps5=1.0,
    vertical_m2ps5=0.5,
    gyro_x_rad2ps2=3e-6,
    gyro_y_rad2ps2=1e-6,
    gyro_z_rad2ps2=2e-6,
    accel_x_m2ps4=1e-2,
    accel_y_m2ps4=3e-3,
    accel_z_m2ps4=1e-3,
    lateral_position_m2=NOTHING,
    vertical_position_m2=NOTHING,
)
START_SD = np.array([2e-3, 5e-3, 2e-3, 5e-3, 2e-3, 5e-3, 0.002, 0.005, 0.05, 0.002, 0.005, 0.05])
SYNTHETIC = SearchSpace(box=(1e-8, 1e4), constrained=(), position_m2=NOTHING)


def cube_of(space: SearchSpace) -> Cube:
    return Cube(space.parameters(Hyperparameters()))


def objective_of(
    recordings: Sequence[Recording],
    smoother: TrajectorySmoother,
    *,
    references: Sequence[pd.DataFrame] | None = None,
    **settings: Any,
) -> Objective:
    return generic.objective_of(SmootherTuning(smoother, **settings), recordings, references)


def at(goal: Objective, parameters: Hyperparameters) -> float:
    return goal.value(asdict(parameters))


def tune(recordings: Sequence[Recording], *, settings: dict[str, Any] | None = None, **more: Any) -> Tuning:
    """The smoother's tuning as it is read from the file of a search."""
    result = generic.tune(TrajectorySmoother().tunables(settings or {}), recordings, **more)
    with TemporaryDirectory() as folder:
        result.write(Path(folder) / "tuned.toml")
        return Tuning.from_file(Path(folder) / "tuned.toml")


@lru_cache
def drawn() -> tuple[Model, ...]:
    """Short rides along a straight line, so short that the model stays as good as linear."""
    rng = stream(7, "tuning synthetic")
    f, root = transition(STEP_S), np.linalg.cholesky(process_noise(TRUE, STEP_S))
    sd, row = np.sqrt(TRUE.vector()[5:11]), np.zeros(len(TERMS))
    models = []
    for _ in range(RIDES):
        x = START_SD * rng.standard_normal(STATES)
        signals = np.empty((SAMPLES, 6))
        for k in range(SAMPLES):
            if k > 0:
                x = f @ x + root @ rng.standard_normal(STATES)
            signals[k] = measured(x, row, GRAVITY)[0][:6] + sd * rng.standard_normal(6)
        models.append(
            Model(
                signals=signals,
                track=np.zeros((SAMPLES, len(TERMS))),
                slips=np.empty((0, 3)),
                kinds=np.zeros(SAMPLES, dtype=np.int64),
                process=process_noise(TRUE, STEP_S)[None],
                noise=TRUE.vector()[None, 5:],
                virtual=np.zeros(2),
                start=np.zeros(STATES),
                start_variance=START_SD**2,
                step_s=STEP_S,
                gravity=GRAVITY,
            )
        )
    return tuple(models)


def synthetic() -> Likelihood:
    return Likelihood(drawn(), tuple(np.ones(SAMPLES, dtype=bool) for _ in drawn()))


def found_in(goal: Likelihood, seed: int = 1) -> Hyperparameters:
    """CML of a likelihood, from far off the truth."""
    cube = cube_of(SYNTHETIC)

    def evaluate(points: np.ndarray) -> np.ndarray:
        values = [goal.value(cube.named(point)) for point in points]
        return np.array(values)

    start = np.full(len(cube.searched), 0.5)
    found = least(evaluate, start=start, generator=stream(seed, "synthetic"), evaluations=320)
    return Hyperparameters(**cube.named(found.point))


@pytest.mark.slow
def test_cml_recovers_the_noise_of_its_own_model() -> None:
    """Each within its Cramer-Rao interval, and all together as chi-square of 11 has it, two-sided."""
    goal = synthetic()
    found = found_in(goal)
    known = identify(goal, asdict(found), cube_of(SYNTHETIC))
    assert list(known["status"][:11]) == [IDENTIFIED] * 11
    assert list(known["status"][11:]) == [HELD] * 2
    off = np.log(found.vector() / TRUE.vector())[:11]
    sd = np.log(10.0) * known["sd_decades"].to_numpy()[:11]
    assert (np.abs(off / sd) < 4.0).all()
    assert sd.max() < 0.25
    squares = goal.samples * off @ known.attrs["curvature"] @ off
    low, high = chi2.ppf([0.0005, 0.9995], 11)
    assert low < squares < high
    # The truth costs no more than the fit of 11 parameters to noise gains: half of that chi-square.
    gain = goal.samples * (at(goal, TRUE) - at(goal, found))
    assert 0.0 < gain == pytest.approx(0.5 * squares, rel=0.2)


@pytest.mark.long
@pytest.mark.parametrize("fault", ["no_log", "sign", "no_rows"])
def test_recovery_would_notice_a_wrong_likelihood(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without ln s, with its sign turned, or of the errors' number only, the optimum runs away."""

    def spoilt(model: Model) -> np.ndarray:
        right = likelihoods(model)
        # Of each sample, sum of e^2/s over the IMU's rows; those of the virtual positions are negligible.
        from simrail.estimators.trajectory.smoother import run_model

        nis = run_model(model, smoothed=False, covariance_of=()).innovations[:, 6]
        return {"no_log": -0.5 * nis, "sign": -right, "no_rows": 0.0 * right}[fault]

    monkeypatch.setattr(simrail.estimators.tuning.objectives, "likelihoods", spoilt)
    goal = Likelihood(drawn()[:4], synthetic().counts[:4])
    slope = [
        at(goal, Hyperparameters(*(TRUE.vector() * factor).tolist())) - at(goal, TRUE)
        for factor in (0.5, 2.0)
    ]
    assert min(slope) <= 0.0


@pytest.mark.long
def test_the_true_noise_is_a_minimum_along_every_axis() -> None:
    """Twice and half of each value are less likely, by more than chance lets a true value lose."""
    goal = synthetic()
    at_truth = at(goal, TRUE)
    for name in NAMES[:11]:
        for factor in (0.5, 2.0):
            other = replace(TRUE, **{name: factor * getattr(TRUE, name)})
            assert goal.samples * (at(goal, other) - at_truth) > 0.5 * chi2.ppf(0.999, 1), name


@pytest.mark.long
def test_likelihoods_add_up(line_recording: Callable[..., Recording]) -> None:
    recording = line_recording(70.0, 1, 0)
    smoother = TrajectorySmoother()
    terms = likelihoods(smoother.model(recording))
    assert terms.sum() == pytest.approx(log_likelihood(smoother.model(recording)), rel=1e-12)
    kinds = kinds_of(recording)
    parts = [at(objective_of([recording], smoother, kind=kind), Hyperparameters()) for kind in (0, 1)]
    counts = np.bincount(kinds)
    whole = at(objective_of([recording], smoother), Hyperparameters())
    assert (counts * parts).sum() == pytest.approx(whole * len(kinds), rel=1e-12)
    twice = at(objective_of([recording, recording], smoother), Hyperparameters())
    assert twice == pytest.approx(whole, rel=1e-12)


def piece(recording: Recording, first: int, count: int) -> Recording:
    rows = slice(first, first + count)
    return replace(recording, imu=recording.imu.iloc[rows], odometry=recording.odometry.iloc[rows])


@pytest.fixture
def ride(metro_recording: Callable[..., Recording]) -> Recording:
    """16 s of the bogie's axle at 70 km/h, into and out of a curve."""
    return piece(metro_recording(70.0, 1, "axle", 0), 14000, 4000)


SPACES: dict[str, dict[str, Any]] = {
    "paper": {},
    "both": {"constrained": ("y", "z")},
    "held": {"box": (1e-8, 1e4), "constrained": (), "position_m2": 2e-3},
}


@pytest.fixture(scope="module")
def searched() -> Callable[[Recording, str], Tuning]:
    """CML of a ride in one of `SPACES`; searched once."""
    tunings: dict[str, Tuning] = {}

    def search(ride: Recording, name: str) -> Tuning:
        if name not in tunings:
            # Only of the paper's space is the least asked for; the others must keep to theirs on the way.
            at_most = None if name == "paper" else 64
            tunings[name] = tune([ride], settings=SPACES[name], evaluations=160, at_most=at_most)
        return tunings[name]

    return search


@pytest.mark.long
def test_the_constraint_holds_and_does_what_it_is_for(ride: Recording, searched: Callable) -> None:
    """On y only, the likelihood pins z; on both, neither; held, the position is what was said."""
    found = {name: searched(ride, name) for name in SPACES}
    paper, both, held = (found[name].hyperparameters for name in ("paper", "both", "held"))
    assert paper.accel_y_m2ps4 <= paper.lateral_position_m2 / 10.0
    assert paper.vertical_position_m2 == pytest.approx(1e-4, rel=1e-6)
    for accel, place in (("accel_y_m2ps4", "lateral_position_m2"), ("accel_z_m2ps4", "vertical_position_m2")):
        assert getattr(both, accel) <= getattr(both, place) / 10.0
    assert held.lateral_position_m2 == held.vertical_position_m2 == 2e-3
    for tuning in found.values():
        assert tuning.search is not None
        tuning.search.space.check(tuning.hyperparameters)


@pytest.mark.long
def test_what_the_likelihood_does_not_identify(ride: Recording, searched: Callable) -> None:
    """The virtual positions are constants: ten times the confidence gains ln(10)/2 a sample, for nothing."""
    values = asdict(searched(ride, "paper").hyperparameters)
    known = identify(objective_of([ride], TrajectorySmoother()), values, cube_of(SearchSpace()))
    for name in ("lateral_position_m2", "vertical_position_m2"):
        assert known.loc[name, "status"] == LOWER
        assert known.loc[name, "tenth"] == pytest.approx(-0.5 * np.log(10.0), rel=0.1)
    assert set(known["status"][5:8]) == {LOWER}  # the true gyro's variance lies below the paper's box
    assert list(known["status"][3:5]) == [IDENTIFIED] * 2


def test_ends_flats_and_constraints_are_told_apart() -> None:
    class Bowl:
        unit = "of a test"

        def value(self, values: Mapping[str, float]) -> float:
            logs = np.log(list(values.values()))
            weight = np.array([1.0, 1e-6, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1])
            floor = np.log([1e-2] * 5 + [1e-6, 1e6] + [1e-2] * 2 + [1e4] + [1e-2] * 3)
            together = (logs[3] + logs[4] - 2 * floor[3]) ** 2  # only their product is known
            weight[3] = weight[4] = 0.0
            return float((weight * (logs - floor) ** 2).sum() + together)

    low, high = 1e-4, 1e4
    values = np.full(13, 1e-2)
    values[[5, 6, 9]] = low, high, 1e-3  # 9 is y's accelerometer, at a tenth of its position
    at_edges = dict(zip(NAMES, values, strict=True))
    known = identify(Bowl(), at_edges, cube_of(SearchSpace(box=(low, high))))
    status = known["status"]
    assert list(status.iloc[[0, 1, 2, 3, 4, 5, 6, 9]]) == [
        IDENTIFIED, FLAT, FLAT, FLAT, FLAT, LOWER, UPPER, CONSTRAINT,
    ]  # fmt: skip
    assert known.loc[NAMES[0], "curvature"] == pytest.approx(2.0, rel=1e-6)
    assert known.loc[NAMES[0], "span_decades"] == pytest.approx(np.sqrt(1e-3) / np.log(10.0), rel=1e-6)
    assert known.loc[NAMES[3], "curvature"] == pytest.approx(2.0, rel=1e-6)
    # Two share a direction without end, which counts as ending at the box: half of each in it.
    least = 2e-3 / np.log(high / low) ** 2
    assert known.loc[NAMES[3], "profile_curvature"] == pytest.approx(2.0 * least, rel=1e-2)


def rails_of(recording: Recording) -> pd.DataFrame:
    """The rails that the tests' rides were run on (`conftest.metro_truth`)."""
    laid = lay(recording.track, Irregularity("erri_b176_low", (1.5, 100.0), 40.0), seed=1)
    place = recording.odometry["position_m"].to_numpy()
    return laid.irregularities(np.arange(place.min() + 5.0, place.max() - 5.0, 0.25))


@pytest.mark.slow
def test_kom_does_better_on_sensors_that_it_has_not_seen(
    metro_recording: Callable[..., Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tuned on one draw of the sensors, the rails of others come out better than from hand-set values.

    CMA-ES alone does it; the descent after it takes long.
    """
    monkeypatch.setattr("simrail.estimators.tuning.search.ROUNDS", 0)
    first, count = 13000, 2500
    ride = piece(metro_recording(70.0, 1, "axle", 0), first, count)
    smoother = TrajectorySmoother()
    settings = {"box": (1e-8, 1e4), "constrained": (), "position_m2": 3e-3, "band": BANDS["D0"]}
    tuning = tune([ride], settings=settings, references=[rails_of(ride)], evaluations=320)
    assert tuning.search is not None and tuning.search.method == "kom"
    by_hand = replace(Hyperparameters(), lateral_position_m2=3e-3, vertical_position_m2=3e-3)
    for draw in (0, 1, 2):
        other = piece(metro_recording(70.0, 1, "axle", draw), first, count)
        goal = objective_of([other], smoother, references=[rails_of(other)], band=BANDS["D0"])
        reached, before = at(goal, tuning.hyperparameters), at(goal, by_hand)
        assert reached < 0.9 * before
        if draw == 0:
            assert reached == pytest.approx(tuning.search.objective[0], rel=1e-9)


@pytest.mark.long
def test_kom_counts_the_places_that_the_reference_knows(ride: Recording) -> None:
    """An error of the reference where no place is counted changes nothing, elsewhere it does."""
    rails, smoother = rails_of(ride), TrajectorySmoother()
    half = rails.iloc[: len(rails) // 2]
    values = {
        name: at(objective_of([ride], smoother, references=[reference]), Hyperparameters())
        for name, reference in {"whole": rails, "half": half, "spoilt": half + 1e-3}.items()
    }
    assert values["whole"] != values["half"]
    # Three irregularities that are off by 1 mm more: each rms moves by 1 mm at most.
    assert 0.0 < abs(values["spoilt"] - values["half"]) < 3.0
    kinds = [
        at(objective_of([ride], smoother, references=[rails], kind=kind), Hyperparameters())
        for kind in (0, 1)
    ]
    assert min(kinds) < values["whole"] < max(kinds)


@pytest.mark.long
def test_straights_and_curves_by_themselves(ride: Recording) -> None:
    """Each set is that of a search on its own kind, and the smoother uses it there."""
    settings = {"box": (1e-8, 1e4), "constrained": (), "position_m2": 3e-3, "by_kind": True}
    both = tune([ride], settings=settings, evaluations=32, at_most=400)
    assert both.curve_hyperparameters is not None and both.search is not None
    assert both.hyperparameters != both.curve_hyperparameters
    for kind, parameters in enumerate([both.hyperparameters, both.curve_hyperparameters]):
        goal = objective_of([ride], TrajectorySmoother(), kind=kind)
        assert at(goal, parameters) == pytest.approx(both.search.objective[kind], rel=1e-12)
        other = (both.curve_hyperparameters, both.hyperparameters)[kind]
        assert at(goal, parameters) < at(goal, other)
    smoother = TrajectorySmoother(tuning=both)
    explicit = TrajectorySmoother(
        hyperparameters=both.hyperparameters, curve_hyperparameters=both.curve_hyperparameters
    )
    assert log_likelihood(smoother.model(ride)) == log_likelihood(explicit.model(ride))
    single = TrajectorySmoother(hyperparameters=both.hyperparameters)
    assert log_likelihood(smoother.model(ride)) > log_likelihood(single.model(ride))


@pytest.mark.long
def test_threads_do_not_matter_and_interrupted_is_resumed(ride: Recording, tmp_path: Path) -> None:
    short = piece(ride, 0, 800)
    keep = tmp_path / "mine.unfinished.toml"

    def run(threads: int, stop_at: int | None = None, unfinished: Path | None = None) -> Tuning:
        counts = []

        def progress(name: str, count: int, value: float) -> None:
            counts.append(count)
            if stop_at is not None and count >= stop_at:
                raise KeyboardInterrupt

        return tune(
            [short], evaluations=48, at_most=220, threads=threads, unfinished=unfinished, progress=progress
        )

    whole = run(1)
    assert run(3) == whole
    with pytest.raises(KeyboardInterrupt):
        run(2, stop_at=40, unfinished=keep)
    best = Tuning.from_file(keep)
    assert best.search is not None and whole.search is not None and not best.search.finished
    goal = objective_of([short], TrajectorySmoother())
    assert at(goal, best.hyperparameters) == best.search.objective[0] > whole.search.objective[0]
    with pytest.raises(KeyboardInterrupt):
        run(2, stop_at=whole.search.evaluations - 30, unfinished=keep)
    assert run(2, unfinished=keep) == whole
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda rails: rails.drop(columns="alignment_m"), ["reference", "alignment_m [m]"]),
        (lambda rails: rails.iloc[::-1], ["reference", "rising"]),
        (lambda rails: rails.assign(cross_level_m=np.nan), ["reference", "finite"]),
        (lambda rails: rails.iloc[:1], ["reference", "two places"]),
        (lambda rails: rails.set_axis(rails.index + 1e5), ["reference", "none of the places"]),
    ],
)
def test_bad_references(spoil: Callable, words: Sequence[str], ride: Recording) -> None:
    with pytest.raises(InputError) as caught:
        objective_of([ride], TrajectorySmoother(), references=[spoil(rails_of(ride))])
    for word in words:
        assert word in str(caught.value)


@pytest.mark.long
def test_requests_that_mean_nothing(ride: Recording) -> None:
    smoother, straight = TrajectorySmoother(), piece(ride, 0, 100)
    with pytest.raises(InputError, match="nothing to tune on"):
        objective_of([], smoother)
    with pytest.raises(InputError, match="one per recording"):
        objective_of([ride], smoother, references=[])
    kind = int(kinds_of(straight)[0])
    with pytest.raises(InputError, match="no sample is of this kind"):
        objective_of([straight], smoother, kind=1 - kind)
    with pytest.raises(InputError, match="D3"):
        objective_of([ride], smoother, references=[rails_of(ride)], band=BANDS["D3"])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", "held"])
def test_one_search_is_as_good_as_ten(name: str, metro_recording: Callable[..., Recording]) -> None:
    """CML of the 2.1 km ride at 70 km/h: within 1e-3 of likelihood per sample of the best of ten seeds."""
    recording = metro_recording(70.0, 1, "axle", 0)
    reached = []
    for seed in range(1, 11):
        tuning = tune([recording], settings=SPACES[name], seed=seed)
        assert tuning.search is not None
        reached.append(tuning.search.objective[0])
    assert reached[0] < min(reached) + 1e-3
    assert max(reached) < min(reached) + 1e-3


class Scale:
    """A stranger's: the white noise's standard deviation of one gyro, by likelihood alone."""

    def parameters(self) -> Sequence[Parameter]:
        return (
            Parameter("sd_radps", "rad/s", 1e-6, 1.0, 0.1),
            Parameter("mean_radps", "rad/s", -1.0, 1.0, 0.5, scale="linear"),
        )

    def likelihood(self, recordings: Sequence[Recording]) -> Objective:
        gyro = np.concatenate([recording.imu["gyro_x_radps"].to_numpy() for recording in recordings])

        class Gauss:
            unit = "negative log-likelihood per sample"
            samples = len(gyro)

            def value(self, values: Mapping[str, float]) -> float:
                e = (gyro - values["mean_radps"]) / values["sd_radps"]
                return float(0.5 * (e**2).mean() + np.log(values["sd_radps"]))

        return Gauss()


@pytest.mark.long
def test_any_tunable_is_searched_and_judged(ride: Recording) -> None:
    """The maximum likelihood of a Gaussian is known: mean and standard deviation, and how well."""
    gyro, tunables = ride.imu["gyro_x_radps"], tunables_of(Scale(), {}, method="cml")
    result = generic.tune(tunables, [ride], evaluations=160)
    (values,) = result.values
    assert values["mean_radps"] == pytest.approx(gyro.mean(), rel=1e-3)
    assert values["sd_radps"] == pytest.approx(gyro.std(ddof=0), rel=1e-3)
    cube = Cube(tuple(Scale().parameters()))
    judged = identify(Scale().likelihood([ride]), values, cube)
    assert list(judged["status"]) == [IDENTIFIED] * 2
    known_to = judged["sd_decades"] * np.log(10.0)
    assert known_to["sd_radps"] == pytest.approx(1.0 / np.sqrt(2 * len(gyro)), rel=0.02)
    # A tenth of the box of two rad/s stands for a decade.
    by_mean = gyro.std(ddof=0) / np.sqrt(len(gyro)) / 0.2
    assert judged["sd_decades"]["mean_radps"] == pytest.approx(by_mean, rel=0.02)


def test_what_cannot_be_tuned_is_refused() -> None:
    with pytest.raises(InputError, match=r"--method: Scale cannot be tuned .*'kom'; limit: cml"):
        tunables_of(Scale(), {}, method="kom")
    with pytest.raises(InputError, match=r"by_kind: Scale has no such setting"):
        tunables_of(Scale(), {"by_kind": True}, method="cml")
    with pytest.raises(InputError, match="nothing to tune"):
        tunables_of(object(), {}, method="cml")


def test_a_decade_of_a_linear_scale_is_a_tenth_of_its_box() -> None:
    line, log = Parameter("a", "1", -2.0, 3.0, 0.0, scale="linear"), Parameter("b", "1", 1e-3, 1e4, 1.0)
    assert [_moved(line, 1.0, decades=n) for n in (-1, 1, 2)] == pytest.approx([0.5, 1.5, 2.0])
    assert [_moved(log, 0.2, decades=n) for n in (-1, 1, 2)] == pytest.approx([0.02, 2.0, 20.0])
    # In logarithms a tenth of the box is ln 10; and there and back again.
    for parameter, more in ((line, 0.5), (log, 9.0 * 0.2)):
        there = [_to_log(parameter, value) for value in (0.2, 0.2 + more)]
        assert there[1] - there[0] == pytest.approx(np.log(10.0))
        assert _from_log(parameter, there[0]) == pytest.approx(0.2)
    assert (_width(line), _width(log)) == pytest.approx((10.0 * np.log(10.0), 7.0 * np.log(10.0)))
