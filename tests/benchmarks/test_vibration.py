"""What short waves cost: `pytest tests/benchmarks/test_vibration.py --benchmark-only -n 0`.

``cpu_s_per_hour`` is process time per simulated hour of one vehicle; at most 40 are asked for.
"""

import time
from pathlib import Path

import numpy as np
import pytest

from simrail.core.toml_files import load
from simrail.ride.truth import BodyMotion, Truth
from simrail.ride.vibration.files import write_short_waves
from simrail.scenario.vibration_tables import VibrationPart
from simrail.track.file import TrackFile
from simrail.vehicle.file import VehicleFile

MOST_CPU_S_PER_HOUR = 40.0
DURATION_S = 240.0


@pytest.mark.parametrize("rate_hz", [1000.0, 2000.0])
@pytest.mark.parametrize("vehicle", ["manchester_1", "metro_car_gz18", "irw_car"])
def test_vibration(benchmark, tmp_path: Path, vehicle: str, rate_hz: float) -> None:
    """Four minutes at 8 m/s with every source, written to disk; the surface of the rails included."""
    model = load(VehicleFile, "vehicle", vehicle).model(vehicle)
    line = load(TrackFile, "track", "level_straight").design("level_straight")
    t = np.arange(round(DURATION_S * rate_hz) + 1) / rate_hz
    place = 30.0 + 8.0 * t
    none = np.zeros((0, 3))
    bodies = {b.name: BodyMotion(b.position_m[0], b.position_m[2], *(none,) * 6) for b in model.bodies}
    wheels = {w.name: 8.0 * t / w.radius_m for w in model.wheels}
    truth = Truth(t, line, place, bodies, wheels, {}, dict.fromkeys(wheels, 0.46), 9.81, {})
    vibration = VibrationPart().vibration(1.5, 0.0)
    assert vibration is not None
    cpu_s = []

    def work() -> None:
        started = time.process_time()
        write_short_waves(vibration, truth, model, tmp_path, seed=1, manifest={})
        cpu_s.append(time.process_time() - started)

    benchmark.pedantic(work, rounds=3, warmup_rounds=1)
    per_hour = min(cpu_s) * 3600.0 / DURATION_S
    benchmark.extra_info["cpu_s_per_hour"] = per_hour
    assert per_hour < MOST_CPU_S_PER_HOUR
