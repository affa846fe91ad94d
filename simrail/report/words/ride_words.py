"""What the page says of a ride in words, beside its figures."""

from __future__ import annotations

import numpy as np

from simrail.campaign.cell import CellResult
from simrail.recording.recording import Recording
from simrail.report.figures.ride import direction_of

_UNITS = {"kmh": "km/h", "mps2": "m/s\u00b2", "mps3": "m/s\u00b3", "m": "m", "s": "s", "hz": "Hz"}


def axis_words(name: str, value: object) -> str:
    """A value of an axis as people say it: ``ride.speed_kmh``, 20.0 becomes ``speed 20 km/h``."""
    *words, last = name.rpartition(".")[2].split("_")
    shown = f"{value:g}" if isinstance(value, float) else str(value)
    if words and last in _UNITS:
        return f"{' '.join(words)} {shown} {_UNITS[last]}"
    return f"{' '.join([*words, last])} {shown}"


def ride_title(example: CellResult) -> str:
    """Name of a ride, and the values of its axes."""
    axes = [
        axis_words(name, value) for name, value in example.cell.items() if "." in name and name != "imu.grade"
    ]
    return " \u00b7 ".join([example.recording.name, *axes])


def ride_facts(example: CellResult) -> list[str]:
    """Length, speed, IMU and odometry of a ride, a line each."""
    motion, recording = example.motion, example.recording
    position, speed = motion["position_m"].to_numpy(), np.abs(motion["speed_mps"].to_numpy())
    moving = speed > 0.01
    way = "increasing" if direction_of(example) > 0 else "decreasing"
    mean = 3.6 * float(speed[moving].mean()) if moving.any() else 0.0
    duration = float(motion.index[-1] - motion.index[0])
    x, y, z = recording.mount_position_m
    return [
        f"{abs(position[-1] - position[0]):.0f} m towards {way} distance, {duration:.0f} s",
        f"mean {mean:.1f} km/h while moving, at most {3.6 * float(speed.max()):.1f} km/h",
        f"IMU {recording.imu_sheet.grade} at {recording.imu_sheet.rate_hz:g} Hz on '{recording.mount_body}', "
        f"{x:g}, {y:g}, {z:g} m (forward, left, up)",
        odometry_words(recording),
    ]


def odometry_words(recording: Recording) -> str:
    """Where position and speed come from."""
    if recording.odometry is None:
        return "no odometry: where the train is, no method knows"
    ablation = " (an ablation: a train has no such thing)" if recording.odometry_source == "truth" else ""
    return f"position and speed from the odometry '{recording.odometry_source}'{ablation}"
