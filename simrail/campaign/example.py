"""One ride looked at closely: what the report draws, handed over by the campaign.

It is a plain bundle. It lies below the campaign, which makes it, and the report, which draws it.
"""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.scoring.geometry import HasRails


@dataclass(frozen=True)
class CellResult:
    """Recording, truth and estimates of one cell.

    Attributes
    ----------
    cell : dict
        The labels of the cell, as in the score table (``ride``, ``vehicle``, ``imu``, ...), and the
        values of the scenario's axes.
    recording : Recording
        What the train recorded.
    motion : pandas.DataFrame
        True motion of the mount at the IMU times (`simrail.scoring.score.truth_at_imu`).
    estimates : dict of str to Estimate
        By the estimator's name in the scenario, in the scenario's order; failed ones are left out.
    rails : LaidTrack, optional
        The rails that the ride was run on, if an estimate speaks of rails.
    """

    cell: dict[str, object]
    recording: Recording
    motion: pd.DataFrame
    estimates: dict[str, Estimate]
    rails: HasRails | None = None
