"""A battery that every estimator must pass: ours in the tests, a stranger's in his own.

    from simrail.estimation.conformance import check_estimator
    check_estimator(MyEstimator(), recording)

It tests the contract between an estimator and the rest of simrail, not how good the estimates are:
the right columns at the right times, finite, repeatable, no look-ahead, nothing of the recording
changed, running backwards and standing still.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import is_dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from simrail.core.columns import COLUMNS, INNOVATION, IRREGULARITY, IRREGULARITY_SD, RATE_INNOVATION
from simrail.estimation.estimate import Estimate, Estimator
from simrail.recording.recording import Recording
from simrail.recording.standstill import at_rest_initially, rest_periods

Check = Callable[[Estimator, Recording], None]


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
    failures = []
    for check in CHECKS:
        try:
            # Its own copy, so that an estimator that spoils one recording does not spoil the others.
            check(estimator, copy.deepcopy(recording))
        except Exception as error:
            failures.append(f"{check.__name__}: {type(error).__name__}: {error}")
    assert not failures, f"{type(estimator).__name__} breaks the contract:\n" + "\n".join(failures)


def frozen_dataclass(estimator: Estimator, recording: Recording) -> None:
    """Parameters are the fields of a frozen dataclass, so that a run can be repeated from them."""
    parameters = getattr(estimator, "__dataclass_params__", None)
    assert is_dataclass(estimator) and parameters is not None, "is no dataclass"
    assert parameters.frozen, "is a dataclass that is not frozen"


def says_whether_causal(estimator: Estimator, recording: Recording) -> None:
    """`causal` is there, and is a truth value."""
    assert isinstance(getattr(estimator, "causal", None), bool), "has no `causal` of True or False"


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
    for field in ("imu", "odometry", "encoder", "magnetometer", "rail_displacement"):
        before, after = getattr(recording, field), getattr(own, field)
        assert before is None or (before.equals(after) and list(before) == list(after)), f"changed {field}"
    for field in (
        "imu_sheet",
        "encoder_sheet",
        "magnetometer_sheet",
        "rail_sensor_sheet",
        "track",
        "mount_position_m",
        "start_position_m",
    ):
        assert getattr(recording, field) == getattr(own, field), f"changed {field}"


def is_deterministic(estimator: Estimator, recording: Recording) -> None:
    """The same recording gives the same bits, also after another one and from a copy of the estimator."""
    first = estimator.estimate(recording)
    estimator.estimate(standing(recording))
    require_same(first, estimator.estimate(recording), when="run again")
    require_same(first, copy.deepcopy(estimator).estimate(recording), when="run from a copy")


def sees_no_future(estimator: Estimator, recording: Recording) -> None:
    """If causal: the estimate of a prefix equals the prefix of the estimate, bit by bit.

    That goes for the states. Geometry lies over the track, is made after the ride, and is not compared.
    """
    if getattr(estimator, "causal", None) is not True:
        return
    whole = estimator.estimate(recording)
    for n in prefix_lengths(recording):
        part = replace(estimator.estimate(prefix(recording, n)), geometry=None, geometry_draws=None)
        require_same(first_samples(whole, n), part, when=f"cut after {n} of {len(recording.imu)} samples")


CHECKS: tuple[Check, ...] = (
    frozen_dataclass,
    says_whether_causal,
    estimate_is_well_formed,
    works_backwards,
    works_at_standstill,
    leaves_the_recording_alone,
    is_deterministic,
    sees_no_future,
)


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
        assert not unknown, (
            f"{what} has columns that simrail.core.columns does not know: {', '.join(unknown)}"
        )
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
    for what in ("states", "innovations", "geometry"):
        a, b = getattr(one, what), getattr(other, what)
        assert (a is None) == (b is None), f"{when}: {what} is there once and once not"
        if a is None:
            continue
        assert list(a) == list(b) and a.index.equals(b.index), f"{when}: {what} has another shape"
        for name in a:
            _require_bits(a[name].to_numpy(), b[name].to_numpy(), what=f"{when}: {name}")
    for what in ("covariance", "geometry_draws"):
        a, b = getattr(one, what), getattr(other, what)
        assert (a is None) == (b is None), f"{when}: {what} is there once and once not"
        if a is not None:
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


def prefix(recording: Recording, n: int) -> Recording:
    """What the logger had after n IMU samples."""
    encoder = recording.encoder
    return replace(
        recording,
        imu=recording.imu.iloc[:n].copy(),
        odometry=recording.odometry.iloc[:n].copy(),
        encoder=None if encoder is None else encoder.loc[: recording.imu.index[n - 1]].copy(),
        **_beside_imu(recording, lambda frame: frame.iloc[:n].copy()),
    )


def _beside_imu(recording: Recording, change: Callable[[pd.DataFrame], pd.DataFrame]) -> dict[str, Any]:
    """The other signals that are sampled at the IMU's times, changed; those that there are."""
    frames = {name: getattr(recording, name) for name in ("magnetometer", "rail_displacement")}
    return {name: change(frame) for name, frame in frames.items() if frame is not None}


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
    imu = _turned(recording.imu, negate="gyro_")
    odometry = _turned(recording.odometry, negate="speed_mps")
    encoder = recording.encoder
    if encoder is not None:
        # When an edge passed on the way back, the times of the way there do not say.
        encoder = _turned(encoder[["pulse_count"]], negate="")
        encoder["pulse_count"] -= encoder["pulse_count"].iloc[0]
    return replace(
        recording,
        name=f"{recording.name} backwards",
        imu=imu,
        odometry=odometry,
        encoder=encoder,
        **_beside_imu(recording, lambda frame: _turned(frame, negate="")),
        start_position_m=float(odometry["position_m"].iloc[0]),
    )


def _turned(frame: pd.DataFrame, *, negate: str) -> pd.DataFrame:
    turned = frame.iloc[::-1].set_index(frame.index)
    for name in turned:
        if negate and str(name).startswith(negate):
            turned[name] = -turned[name]
    return turned


def standing(recording: Recording) -> Recording:
    """A train that stands where the ride began: the first IMU sample, for ever."""

    def held(frame: pd.DataFrame) -> pd.DataFrame:
        values = np.repeat(frame.iloc[:1].to_numpy(), len(frame), axis=0)
        return pd.DataFrame(values, index=frame.index, columns=frame.columns).astype(frame.dtypes)

    odometry = held(recording.odometry)
    odometry["speed_mps"] = 0.0
    odometry["acceleration_mps2"] = 0.0
    return replace(
        recording,
        name=f"{recording.name} standing",
        imu=held(recording.imu),
        odometry=odometry,
        encoder=None if recording.encoder is None else held(recording.encoder),
        **_beside_imu(recording, held),
    )
