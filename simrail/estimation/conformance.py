"""A battery that every estimator must pass: ours in the tests, a stranger's in his own.

    from simrail.estimation.conformance import check_estimator, check_odometry
    check_estimator(MyEstimator(), recording)
    check_odometry(MyOdometry(), recording)

It tests the contract between an estimator and the rest of simrail, not how good the estimates are:
the right columns at the right times, finite, repeatable, no look-ahead, nothing of the recording
changed, running backwards and standing still, doing without what it does not say it needs.
"""

import copy
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pandas as pd

from simrail.core.columns import (
    COLUMNS,
    INNOVATION,
    IRREGULARITY,
    IRREGULARITY_SD,
    ODOMETRY,
    ODOMETRY_SD,
    RATE_INNOVATION,
)
from simrail.core.errors import InputError
from simrail.estimation.estimate import Estimate, Estimator, description_of
from simrail.recording.recording import AT_IMU_TIMES, AT_OWN_TIMES, Recording, beginning
from simrail.recording.standstill import at_rest_initially, rest_periods

Check = Callable[[Estimator, Recording], None]

EARLY_S = (0.05, 0.15, 0.2, 0.21, 0.3, 0.7, 1.2, 3.0)
"""Where a ride that begins at speed is cut: while it is found out how fast, and later."""


def check_estimator(estimator: Estimator, recording: Recording) -> None:
    """Run every check and report all that fail.

    Parameters
    ----------
    estimator : Estimator
        The estimator to judge.
    recording : Recording
        A short ride that begins at rest and moves, so that the checks have something to see; some
        10 s are enough. It is run about fifteen times.

    Raises
    ------
    AssertionError
        One line for each check that failed.
    """
    _run(CHECKS, estimator, recording)


def check_odometry(estimator: Estimator, recording: Recording) -> None:
    """Run every check of `check_estimator`, and those of an odometry; otherwise as that."""
    _run((*CHECKS, *ODOMETRY_CHECKS), estimator, recording)


def _run(checks: tuple[Check, ...], estimator: Estimator, recording: Recording) -> None:
    failures = []
    for check in checks:
        try:
            # Its own copy, so that an estimator that spoils one recording does not spoil the others.
            check(estimator, copy.deepcopy(recording))
        except Exception as error:
            failures.append(f"{check.__name__}: {type(error).__name__}: {error}")
    assert not failures, f"{type(estimator).__name__} breaks the contract:\n" + "\n".join(failures)


def frozen_dataclass(estimator: Estimator, recording: Recording) -> None:  # noqa: ARG001
    """Parameters are the fields of a frozen dataclass, so that a run can be repeated from them."""
    parameters = getattr(type(estimator), "__dataclass_params__", None)
    assert parameters is not None, "is no dataclass"
    assert parameters.frozen, "is a dataclass that is not frozen"


def says_whether_causal(estimator: Estimator, recording: Recording) -> None:  # noqa: ARG001
    """`causal` is there, and is a truth value."""
    assert isinstance(getattr(estimator, "causal", None), bool), "has no `causal` of True or False"


def says_what_it_is(estimator: Estimator, recording: Recording) -> None:  # noqa: ARG001
    """What it says of itself (`simrail.estimation.estimate.Description`) is such as others understand."""
    description_of(estimator)


def needs_what_it_says(estimator: Estimator, recording: Recording) -> None:
    """It does without those of an odometry, an encoder and other sensors that it does not say it needs."""
    needs = description_of(estimator).needs
    parts: dict[str, dict[str, Any]] = {
        "odometry": {"odometry": None, "odometry_source": ""},
        "encoder": {"encoder": None, "encoder_sheet": None, "odometer": None, "odometer_sheet": None},
        "magnetometer": {"magnetometer": None, "magnetometer_sheet": None},
        "rail_sensor": {"rail_displacement": None, "rail_sensor_sheet": None},
        "second_imu": {"second_imu": None, "second_imu_sheet": None},
        "gnss": {"gnss": None, "gnss_sheet": None},
    }
    spared = {name: value for need in parts if need not in needs for name, value in parts[need].items()}
    poor: Recording = replace(recording, **spared)
    require_well_formed(estimator.estimate(poor), poor)


def estimate_is_well_formed(estimator: Estimator, recording: Recording) -> None:
    """The estimate of the ride as it is."""
    require_well_formed(estimator.estimate(recording), recording)


def works_backwards(estimator: Estimator, recording: Recording) -> None:
    """The estimate of the ride run backwards in time, which is a ride in the other direction."""
    turned = time_reversed(recording)
    require_well_formed(estimator.estimate(turned), turned)


def works_at_standstill(estimator: Estimator, recording: Recording) -> None:
    """The estimate of a train that never leaves."""
    still = standing(recording)
    require_well_formed(estimator.estimate(still), still)


def leaves_the_recording_alone(estimator: Estimator, recording: Recording) -> None:
    """No signal, no odometry, no piece of knowledge is changed."""
    own = copy.deepcopy(recording)
    estimator.estimate(own)
    for entry in fields(Recording):
        before, after = getattr(recording, entry.name), getattr(own, entry.name)
        if isinstance(before, pd.DataFrame):
            is_same = before.equals(after) and list(before) == list(after)
        else:
            is_same = before == after
        assert is_same, f"changed {entry.name}"


def is_deterministic(estimator: Estimator, recording: Recording) -> None:
    """The same recording gives the same bits, also after another one and from a copy of the estimator."""
    first = estimator.estimate(recording)
    estimator.estimate(standing(recording))
    require_same(first, estimator.estimate(recording), when="run again")
    require_same(first, copy.deepcopy(estimator).estimate(recording), when="run from a copy")


def sees_no_future(estimator: Estimator, recording: Recording, lengths: Sequence[int] | None = None) -> None:
    """If causal: the estimate of a prefix equals the prefix of the estimate, bit by bit.

    That goes for the states. Geometry lies over the track, is made after the ride, and is not compared.
    """
    if getattr(estimator, "causal", None) is not True:
        return
    whole = estimator.estimate(recording)
    for n in prefix_lengths(recording) if lengths is None else lengths:
        if not 2 <= n < len(recording.imu):
            continue
        part = replace(
            estimator.estimate(beginning(recording, samples=n)), geometry=None, geometry_draws=None
        )
        require_same(first_samples(whole, n), part, when=f"cut after {n} of {len(recording.imu)} samples")


CHECKS: tuple[Check, ...] = (
    frozen_dataclass,
    says_whether_causal,
    says_what_it_is,
    needs_what_it_says,
    estimate_is_well_formed,
    works_backwards,
    works_at_standstill,
    leaves_the_recording_alone,
    is_deterministic,
    sees_no_future,
)


def gives_an_odometry(estimator: Estimator, recording: Recording) -> None:
    """Its states hold position, speed and acceleration along the track, and their standard deviations."""
    states = estimator.estimate(recording).states
    missing = [name for name in ODOMETRY + ODOMETRY_SD if name not in states]
    assert not missing, f"states lack {', '.join(missing)}"
    negative = [name for name in ODOMETRY_SD if (states[name] < 0.0).any()]
    assert not negative, f"negative standard deviations: {', '.join(negative)}"


def is_no_copy(estimator: Estimator, recording: Recording) -> None:
    """It says the same whatever odometry the recording came with, and needs none."""
    assert "odometry" not in description_of(estimator).needs, "an odometry needs an odometry"
    alone = replace(recording, odometry=None, odometry_source="")
    require_same(estimator.estimate(recording), estimator.estimate(alone), when="without another odometry")


def begins_at_speed(estimator: Estimator, recording: Recording) -> None:
    """The estimate of a ride that begins at speed, and of its prefixes, if causal; or a refusal."""
    late = begun_at_speed(recording)
    try:
        require_well_formed(estimator.estimate(late), late)
    except InputError:
        return  # it needs a rest, and says so
    rate = late.imu_sheet.rate_hz
    sees_no_future(estimator, late, [round(seconds * rate) for seconds in EARLY_S])


ODOMETRY_CHECKS: tuple[Check, ...] = (gives_an_odometry, is_no_copy, begins_at_speed)


def require_well_formed(estimate: Estimate, recording: Recording) -> None:
    """Assert that an estimate has the shape and the vocabulary that scores and reports rely on."""
    index = recording.imu.index
    assert estimate.mount == recording.mount, f"speaks of mount {estimate.mount!r}, not {recording.mount!r}"
    frames = {"states": estimate.states, "innovations": estimate.innovations}
    for what, frame in frames.items():
        if frame is None:
            continue
        assert frame.index.equals(index), f"{what} are not at the IMU's times"
        unknown = [str(name) for name in frame if name not in COLUMNS]
        assert not unknown, f"{what} has columns that simrail does not know: {', '.join(unknown)}"
        assert frame.columns.is_unique, f"{what} has a column twice"
        bad = [str(name) for name in frame if not np.isfinite(frame[name].to_numpy(dtype=np.float64)).all()]
        assert not bad, f"{what} is not finite in {', '.join(bad)}"
    assert len(estimate.states.columns) > 0, "states has no columns"
    sds = [name for name in estimate.states if "_sd_" in str(name)]
    assert (estimate.states[sds].to_numpy() >= 0.0).all(), "a standard deviation is negative"
    if estimate.innovations is not None:
        known = {*INNOVATION, *RATE_INNOVATION}
        assert set(estimate.innovations) <= known, "innovations has other columns than INNOVATION"
    if estimate.covariance is not None:
        _require_covariance(estimate, len(index))
    if estimate.geometry is not None:
        _require_geometry(estimate.geometry)
    if estimate.geometry_draws is not None:
        _require_draws(estimate)


def _require_geometry(geometry: pd.DataFrame) -> None:
    assert geometry.index.name == "position_m", "geometry is not indexed by position_m"
    missing = [name for name in IRREGULARITY if name not in geometry]
    assert not missing, f"geometry lacks {', '.join(missing)} (NaN throughout says: not observable)"
    unknown = [str(name) for name in geometry if name not in (*IRREGULARITY, *IRREGULARITY_SD)]
    assert not unknown, f"geometry has other columns than irregularities: {', '.join(unknown)}"
    step = np.diff(geometry.index.to_numpy(dtype=np.float64))
    assert len(step) == 0 or (step[0] > 0.0 and np.ptp(step) < 1e-6 * step[0]), "geometry is not uniform"
    for name in geometry:
        known = np.isfinite(geometry[name].to_numpy(dtype=np.float64))
        assert known.all() or not known.any(), f"geometry is not finite in {name}, here and there"


def _require_draws(estimate: Estimate) -> None:
    geometry, draws = estimate.geometry, estimate.geometry_draws
    assert geometry is not None and draws is not None, "geometry_draws are there without a geometry"
    assert draws.ndim == 3 and draws.shape[1:] == (len(geometry), len(IRREGULARITY)), (
        f"geometry_draws have the shape {draws.shape}, not (draws, {len(geometry)}, {len(IRREGULARITY)})"
    )
    known = geometry[list(IRREGULARITY)].notna().to_numpy()
    assert (np.isfinite(draws) == known).all(), "geometry_draws are not finite where the geometry is"


def _require_covariance(estimate: Estimate, n: int) -> None:
    covariance, names = estimate.covariance, estimate.covariance_of
    assert covariance is not None
    m = len(names)
    assert covariance.shape == (n, m, m) and m > 0, (
        f"covariance has the shape {covariance.shape}, not {(n, m, m)} of covariance_of"
    )
    missing = [name for name in names if name not in estimate.states]
    assert not missing, f"covariance_of names no state: {', '.join(missing)}"
    assert np.isfinite(covariance).all(), "covariance is not finite"
    assert np.array_equal(covariance, np.swapaxes(covariance, 1, 2)), "covariance is not symmetric"
    scale = np.maximum(np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)), 1e-300)
    lowest = np.linalg.eigvalsh(covariance / (scale[:, :, None] * scale[:, None, :])).min()
    assert lowest > -1e-9, (
        f"covariance is not positive semidefinite: eigenvalue {lowest:.1e} of its correlation"
    )


def require_same(one: Estimate, other: Estimate, *, when: str) -> None:
    """Assert that two estimates are equal bit by bit."""
    for what in ("states", "innovations", "geometry", "covariance", "geometry_draws"):
        a, b = getattr(one, what), getattr(other, what)
        assert (a is None) == (b is None), f"{when}: {what} is there once and once not"
        if isinstance(a, pd.DataFrame):
            assert list(a) == list(b) and a.index.equals(b.index), f"{when}: {what} has another shape"
            for name in a:
                _require_bits(a[name].to_numpy(), b[name].to_numpy(), what=f"{when}: {name}")
        elif a is not None:
            _require_bits(a, b, what=f"{when}: {what}")


def _require_bits(a: np.ndarray, b: np.ndarray, *, what: str) -> None:
    differs = (a != b) & ~(np.isnan(a) & np.isnan(b))
    if differs.any():
        first = int(np.flatnonzero(differs.reshape(len(a), -1).any(axis=1))[0])
        largest = float(np.nanmax(np.abs(a - b)))
        raise AssertionError(f"{what} differs from sample {first} on, by up to {largest:.3g}")


def prefix_lengths(recording: Recording) -> list[int]:
    """Where `sees_no_future` cuts: at the very start, inside and after rests, odd places, the end."""
    n, rest = len(recording.imu), at_rest_initially(recording)
    wanted = {2, rest // 3, rest - 1, rest + 1, n // 3, n // 2 + 1, n - 1}
    # Within the last rest, since a stop may refresh what the initial rest has found.
    middle = rest_periods(recording).iloc[-1:].mean(axis=1)
    wanted.update(int(i) for i in np.searchsorted(recording.imu.index.to_numpy(), middle))
    return sorted(length for length in wanted if 2 <= length < n)


def first_samples(estimate: Estimate, n: int) -> Estimate:
    """The first n samples of an estimate, without its geometry."""
    return replace(
        estimate,
        states=estimate.states.iloc[:n],
        innovations=None if estimate.innovations is None else estimate.innovations.iloc[:n],
        covariance=None if estimate.covariance is None else estimate.covariance[:n],
        geometry=None,
        geometry_draws=None,
    )


def time_reversed(recording: Recording) -> Recording:
    """The ride run backwards in time: poses and specific force as they were, rates and speed negated.

    It is what a train would record that made the same way in the other direction.
    """
    negated = {
        "imu": "gyro_",
        "second_imu": "gyro_",
        "odometry": "speed_mps",
        "odometer": "speed_mps",
        "gnss": "speed_mps",
    }
    turned = _changed(recording, lambda name, frame: _turned(frame, negate=negated.get(name, "")))
    counts, sheet, start_m = turned.encoder, recording.encoder_sheet, recording.start_position_m
    if sheet is not None and counts is not None:
        # When an edge passed on the way back, the times of the way there do not say.
        counts = counts[["pulse_count"]] - counts["pulse_count"].iloc[0]
        start_m -= float(counts["pulse_count"].iloc[-1]) * sheet.pulse_m
    if turned.odometry is not None:
        start_m = float(turned.odometry["position_m"].iloc[0])
    return replace(turned, name=f"{recording.name} backwards", encoder=counts, start_position_m=start_m)


def _changed(recording: Recording, change: Callable[[str, pd.DataFrame], pd.DataFrame]) -> Recording:
    """A recording with every signal that there is changed, and the odometry; by name and frame."""
    frames = {name: getattr(recording, name) for name in (*AT_IMU_TIMES, *AT_OWN_TIMES)}
    there = {name: frame for name, frame in frames.items() if frame is not None}
    changed: dict[str, Any] = {name: change(name, frame) for name, frame in there.items()}
    return replace(recording, **changed)


def _turned(frame: pd.DataFrame, *, negate: str) -> pd.DataFrame:
    turned = frame.iloc[::-1].set_index(frame.index)
    for name in turned:
        if negate and str(name).startswith(negate):
            turned[name] = -turned[name]
    return turned


def begun_at_speed(recording: Recording) -> Recording:
    """The ride from where it has reached nine tenths of its greatest speed, by its odometry."""
    odometry = recording.odometry
    if odometry is None:
        return recording
    speed = np.abs(odometry["speed_mps"].to_numpy())
    sample = int(np.argmax(speed >= 0.9 * speed.max()))
    began = recording.imu.index[sample]
    later = _changed(
        recording, lambda name, frame: frame.iloc[sample:] if name in AT_IMU_TIMES else frame.loc[began:]
    )
    place = float(odometry["position_m"].iloc[sample])
    return replace(later, name=f"{recording.name} at speed", start_position_m=place)


def standing(recording: Recording) -> Recording:
    """A train that stands where the ride began: the first IMU sample, for ever."""

    def held(name: str, frame: pd.DataFrame) -> pd.DataFrame:
        values = np.repeat(frame.iloc[:1].to_numpy(), len(frame), axis=0)
        still = pd.DataFrame(values, index=frame.index, columns=frame.columns).astype(frame.dtypes)
        if name in ("odometry", "odometer", "gnss"):
            still[[c for c in ("speed_mps", "acceleration_mps2") if c in still]] = 0.0
        return still

    return replace(_changed(recording, held), name=f"{recording.name} standing")
