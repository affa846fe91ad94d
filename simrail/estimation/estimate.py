"""What an estimator concludes, and what an estimator is.

An `Estimate` holds numbers only: it neither plots nor saves itself. Scores against the truth are
made in `simrail.scoring.score`, the only place where truth and estimate meet.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Protocol, runtime_checkable

import pandas as pd

from simrail.core.errors import InputError, one_of
from simrail.core.jit import FloatArray
from simrail.core.shown import Facts, Shown, names
from simrail.recording.recording import Recording


@dataclass(frozen=True, repr=False)
class Estimate(Shown):
    """States over time that an estimator found.

    Attributes
    ----------
    states : pandas.DataFrame
        Indexed by ``time_s`` (the recording's IMU times), columns from `simrail.core.columns`; standard
        deviations (``roll_sd_rad`` ...) where the method has them.
    mount : str
        Name of the IMU that the states speak of.
    innovations : pandas.DataFrame, optional
        Indexed by ``time_s``; columns ``simrail.core.columns.INNOVATION``, and ``RATE_INNOVATION`` where the
        method predicts the gyro as well.
    covariance : ndarray (n, m, m), optional
        Covariance of the states named in `covariance_of`.
    covariance_of : tuple of str
        Names of the m states, in the order of `covariance`.
    geometry : pandas.DataFrame, optional
        Rail irregularities over a uniform ``position_m``, columns `simrail.core.columns.IRREGULARITY`, with
        `IRREGULARITY_SD` where the method has them. A column that is NaN throughout is one that the method
        cannot observe; any other is finite.
    geometry_draws : ndarray (m, places, 4), optional
        m independent draws of true minus estimated irregularities, of equal probability, m: columns
        `simrail.core.columns.IRREGULARITY` over the places of `geometry`, NaN where that is. What is linear
        in the rails, such as a band of wavelengths, has the standard deviation of its draws.
    """

    states: pd.DataFrame
    mount: str
    innovations: pd.DataFrame | None = None
    covariance: FloatArray | None = None
    covariance_of: tuple[str, ...] = ()
    geometry: pd.DataFrame | None = None
    geometry_draws: FloatArray | None = None

    def _facts(self) -> Facts:
        columns = [str(name) for name in self.states]
        rails = "none"
        if self.geometry is not None and len(self.geometry):
            places = self.geometry.index
            rails = f"s = {places[0]:g} to {places[-1]:g} m, {len(places):,} places"
        drawn = 0 if self.geometry_draws is None else len(self.geometry_draws)
        facts = {
            "samples": f"{len(self.states):,}",
            "states": names((name for name in columns if "_sd_" not in name), most=9),
            "with sd": names((name for name in columns if "_sd_" in name), most=4),
            "covariance": names(self.covariance_of),
            "rails": rails + (f", {drawn} draws" if drawn else ""),
        }
        return f"of IMU {self.mount}", facts


def states_only(recording: Recording, states: FloatArray, columns: Sequence[str]) -> Estimate:
    """The estimate that is nothing but states (n, m), one row per sample of the IMU."""
    frame = pd.DataFrame(states, index=recording.imu.index, columns=list(columns))
    return Estimate(states=frame, mount=recording.mount)


NEEDS = ("odometry", "encoder", "magnetometer", "rail_sensor", "second_imu", "gnss")
"""What an estimator may need beside the IMU, by the keys of a scenario."""

ROLES = ("method", "baseline", "general_purpose", "ablation")
"""What an estimator is in a comparison: under test; what every method has to beat; a filter that knows
nothing of trains; a method with what no train has, or without a part of its own, which shows its worth."""


@runtime_checkable
class Estimator(Protocol):
    """One method. Parameters are fields of a frozen dataclass; `estimate` is its only verb.

    What else it says of itself, as attributes that may be left out, is listed in `Description`.
    An *odometry* is an estimator whose states hold `simrail.core.columns.ODOMETRY` and `ODOMETRY_SD`.
    """

    causal: bool
    """True if the states at a time use nothing recorded later; `simrail.estimation.conformance` checks it."""

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate from a recording and nothing else."""
        ...


@dataclass(frozen=True)
class Description:
    """What an estimator says of itself: attributes of its class, or properties that follow its options.

    Attributes
    ----------
    needs : tuple of str
        Those of `NEEDS` that it cannot do without: a scenario that lacks one is refused before anything runs.
    uses_imu : bool
        False for what is concluded without any inertial sensor.
    role : str
        One of `ROLES`.
    label : str
        What a reader calls it; the name of its class if it does not say.
    cites : tuple of str
        Where its equations come from.
    """

    needs: tuple[str, ...]
    uses_imu: bool
    role: str
    label: str
    cites: tuple[str, ...]


def description_of(estimator: Estimator) -> Description:
    """What an estimator says of itself, defaults in place of what it does not say.

    Raises
    ------
    InputError
        If it says what nobody understands; the field is the attribute.
    """
    defaults: dict[str, Any] = {
        "needs": (),
        "uses_imu": True,
        "role": "method",
        "label": type(estimator).__name__,
        "cites": (),
    }
    told = {name: getattr(estimator, name, default) for name, default in defaults.items()}
    has_texts = {name: _is_texts(told[name]) for name in ("needs", "cites")}
    for name, is_good, limit in (
        ("needs", has_texts["needs"], "a tuple of str"),
        ("cites", has_texts["cites"], "a tuple of str"),
        ("needs", has_texts["needs"] and set(told["needs"]) <= set(NEEDS), "some of " + ", ".join(NEEDS)),
        ("uses_imu", isinstance(told["uses_imu"], bool), "True or False"),
        ("role", told["role"] in ROLES, "one of " + ", ".join(ROLES)),
        ("label", isinstance(told["label"], str) and bool(told["label"]), "a text"),
    ):
        if not is_good:
            raise InputError(
                f"{type(estimator).__name__} says of itself what nobody understands",
                field=name,
                value=told[name],
                limit=limit,
                remedy=f"mend '{name}' of the estimator",
            )
    return Description(**told)


def _is_texts(value: object) -> bool:
    return isinstance(value, tuple) and all(isinstance(text, str) for text in value)


@cache
def estimator_class(method: str) -> type[Estimator]:
    """Find an estimator by the name it is registered under.

    Parameters
    ----------
    method : str
        Name in the entry-point group ``simrail.estimators``, e.g. ``"AttitudeEkf"``.

    Raises
    ------
    InputError
        If no installed package registers that name; the message lists those that are there.
    """
    one_of(
        method,
        registered(),
        "no such estimator",
        remedy="choose one of them, write FILE.py:CLASS for one of your own, or install the package that "
        "registers it under the entry-point group simrail.estimators",
    )
    loaded: type[Estimator] = registered()[method].load()
    return loaded


@cache
def registered() -> dict[str, EntryPoint]:
    """Estimators that installed packages register, by name, sorted; looked up once: it takes some ms."""
    entries: dict[str, EntryPoint] = {}
    for entry in entry_points(group="simrail.estimators"):
        entries.setdefault(entry.name, entry)
    return dict(sorted(entries.items()))


def estimate_many(estimator: Estimator, recordings: Sequence[Recording]) -> list[Estimate]:
    """Run an estimator on many recordings, in its own batch verb where it has one."""
    batch = getattr(estimator, "estimate_many", None)
    if batch is not None:
        results: list[Estimate] = batch(recordings)
        return results
    return [estimator.estimate(recording) for recording in recordings]
