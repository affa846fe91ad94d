"""Which odometry the estimators of a recording work with: by name, from the encoder's to a stranger's own.

An odometry is an estimator like any other: it runs before those that need one and sees no more than they do.
Its states, position, speed and acceleration along the track with their standard deviations, are handed on in
the recording. The true odometry, an ablation, is no estimator's work: it comes with the recording
(`simrail.sensors.measure`), labelled, or not at all.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

from simrail.core.columns import ODOMETRY, ODOMETRY_SD, require
from simrail.core.errors import InputError, did_you_mean
from simrail.estimation.estimate import Estimator, description_of, registered
from simrail.estimation.user_modules import class_named
from simrail.recording.recording import Recording

SHIPPED: dict[str, tuple[str, dict[str, Any]]] = {
    "bogie_delay": ("BogieDelayOdometry", {"smoothed": False}),
    "bogie_delay_smoothed": ("BogieDelayOdometry", {"smoothed": True}),
    "curve_matched": ("CurveMatchedOdometry", {"smoothed": False}),
    "curve_matched_hindsight": ("CurveMatchedOdometry", {"hindsight": True}),
    "curve_smoothed": ("CurveMatchedOdometry", {"smoothed": True}),
    "encoder": ("EncoderOdometry", {}),
    "encoder_hindsight": ("EncoderOdometry", {"hindsight": True}),
    "zero_velocity": ("ZeroVelocityOdometry", {"smoothed": False}),
    "zero_velocity_smoothed": ("ZeroVelocityOdometry", {"smoothed": True}),
}
"""Short names: registered class and its options."""

TRUTH, NONE = "truth", "none"
"""Names of what no estimator makes: the true odometry of a simulated ride, and none at all."""


def odometry_named(name: str, folder: Path | None = None) -> Estimator:
    """An odometry by its short name, by that of a registered class, or by ``"file.py:Class"``.

    Parameters
    ----------
    name : str
        See `SHIPPED`; any other is looked for as every estimator is, and made with its own defaults.
    folder : Path, optional
        Where files are looked for first.

    Raises
    ------
    InputError
        If there is none, or it cannot be made without options.
    """
    method, options = SHIPPED.get(name, (name, {}))
    known = [*SHIPPED, TRUTH, NONE]
    if ":" not in name and method not in registered():
        raise InputError(
            "no such odometry",
            value=name,
            limit=f"one of {', '.join(known)}, a registered estimator, or FILE.py:CLASS",
            remedy=did_you_mean(name, [*known, *registered()]) or "see 'simrail new odometry NAME'",
        )
    try:
        return class_named(method, folder)(**options)
    except TypeError as error:
        raise InputError(
            f"cannot be made without options: {error}",
            value=name,
            limit="an odometry whose options have defaults",
            remedy="give its options defaults",
        ) from error


def with_odometry(recording: Recording, odometry: str | Estimator, *, source: str = "") -> Recording:
    """Return the recording with another odometry in place of the one that it came with, if any.

    Parameters
    ----------
    recording : Recording
        The recording.
    odometry : str or Estimator
        ``"encoder"``, ``"curve_matched"`` (causal), ``"curve_smoothed"``, ``"encoder_hindsight"`` and
        ``"curve_matched_hindsight"`` (for rides that begin at speed), any registered name or
        ``"file.py:Class"``; ``"none"`` for no odometry; ``"truth"`` for the true one that the recording was
        measured with; or an odometry itself.
    source : str, optional
        How tables call it; by default its name, or the label of the estimator.

    Raises
    ------
    InputError
        If there is no such odometry, it cannot work on this recording, or what it concludes is none.
    """
    if odometry == NONE:
        return replace(recording, odometry=None, odometry_source="")
    if odometry == TRUTH:
        if recording.odometry_source != TRUTH:
            raise InputError(
                "the recording does not hold the true odometry",
                field="odometry",
                value=recording.odometry_source or NONE,
                remedy='measure it with odometry="truth"',
                limit="a recording with the true odometry",
            )
        return recording
    estimator = odometry_named(odometry) if isinstance(odometry, str) else odometry
    name = source or (odometry if isinstance(odometry, str) else description_of(estimator).label)
    states = estimator.estimate(recording).states
    require(states, ODOMETRY + ODOMETRY_SD, what=f"odometry {name}")
    return recording.with_odometry(states[[*ODOMETRY, *ODOMETRY_SD]], name)
