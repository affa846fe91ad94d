"""Which odometry the estimators of a recording work with: by name, from the encoder's to the line's.

``encoder`` and ``truth`` are made where the recording is (`simrail.sensors.measure`). The two here know the
line as well; they are the work of an estimator, which runs before the others and sees no more than they do.
"""

from __future__ import annotations

from typing import Literal

from simrail.core.columns import ODOMETRY, ODOMETRY_SD
from simrail.estimation.estimate import Estimator, estimator_class
from simrail.recording.recording import Recording

OdometryName = Literal["curve_matched", "curve_smoothed", "encoder", "truth"]

METHOD = "CurveMatchedOdometry"
_SMOOTHED = {"curve_matched": False, "curve_smoothed": True}


def with_odometry(recording: Recording, name: OdometryName) -> Recording:
    """Return the recording with the odometry of a name in place of the one that it came with.

    Parameters
    ----------
    recording : Recording
        With the odometry of its encoder, or the true one.
    name : str
        ``"curve_matched"`` (causal) or ``"curve_smoothed"``; any other leaves the recording as it is.

    Raises
    ------
    InputError
        If it needs an encoder and there is none.
    """
    if name not in _SMOOTHED:
        return recording
    method: type[Estimator] = estimator_class(METHOD)
    states = method(smoothed=_SMOOTHED[name]).estimate(recording).states  # type: ignore[call-arg]
    return recording.with_odometry(states[[*ODOMETRY, *ODOMETRY_SD]], name)
