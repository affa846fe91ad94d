"""An estimator of a person's own, in a file, whose link is down at times."""

FLAKY = """
from dataclasses import dataclass
from pathlib import Path

from simrail.estimators.baselines import DesignAngles


@dataclass(frozen=True)
class Noting:
    "Fails on some recordings as long as a file is there."
    sleep_s: float = 0.0
    causal = True

    def estimate(self, recording):
        if len(recording.imu) > 64 and recording.imu.iloc[0, 0] > 0.0 and Path("broken").exists():
            raise RuntimeError("the link was down")
        return DesignAngles().estimate(recording)
"""
