"""What Briales et al. 2021 printed, each figure once.

E. Briales, P. Urda, J. L. Escalona: Track frame approach for heading and attitude estimation in operating
railways using on-board MEMS sensor and encoder. Called "the paper" in this package.
"""

from __future__ import annotations

from typing import NamedTuple

QUANTITIES = ("roll", "pitch", "yaw")


class Printed(NamedTuple):
    """A figure of the paper: mean and standard deviation over its rides, degrees."""

    mean: float
    sd: float

    def __str__(self) -> str:
        return f"{self.mean:g}\u00b0 \u00b1 {self.sd:g}\u00b0"


TABLE_3: dict[str, tuple[Printed, Printed, Printed]] = {
    "commercial": (Printed(0.331, 0.525), Printed(0.397, 0.52), Printed(52.4, 37.3)),
    "madgwick": (Printed(0.226, 0.208), Printed(0.284, 0.35), Printed(8.25, 5.43)),
    "ekf": (Printed(0.277, 0.215), Printed(0.608, 0.499), Printed(8.31, 5.45)),
}
"""Table 3: rms of the difference to the design angles (roll, pitch, yaw), by the paper's method."""

FINAL_Q, FINAL_R, STEP_S = 1e-3, 1.5**2 * 1e2, 4e-3
"""Section 6: the final settings of the EKF, and its sample interval."""

TIME_CONSTANTS_S = {
    "per_step": STEP_S / 9.81 * (FINAL_R / FINAL_Q) ** 0.5,
    "intensity": STEP_S / 9.81 * (FINAL_R / (FINAL_Q * STEP_S)) ** 0.5,
}
"""Time constants with which gravity corrects roll and pitch, by the reading of Q (EQUATIONS 2.3)."""

PRINTED_TERMS = {"relative": 2.81e-1, "coriolis": 1.96e-5, "angular": 1.11e-6, "track": 2.93e-1}
"""Section 8: standard deviation over ride go20A of the terms of its Eq. 14, m/s2."""

TERMS_RIDE = "go20A"
"""The ride that `PRINTED_TERMS` speak of."""
