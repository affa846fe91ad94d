"""How fast the engines are: `pytest tests/benchmarks --benchmark-only`.

``real_time_factor`` is simulated over wall time of the engine alone. These machines are shared: what
counts is ``ratio_to_calibration_loop``, the time of a fixed compiled loop beside it in the same run.
"""

import time

import numpy as np
import pytest

from simrail.core.jit import njit
from simrail.core.toml_files import load
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.engines.exudyn_engine import ExudynEngine
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

ENGINES = {"compiled": CompiledEngine, "exudyn": ExudynEngine}
VEHICLES = {"axle": "irw_axle", "bogie": "metro_irw_bogie", "car": "irw_car"}
DURATION_S = 40.0


@njit
def calibration_loop(n: int) -> float:
    """A second or so of dependent floating-point work that never changes."""
    x = 0.5
    for _ in range(n):
        x = 3.7 * x * (1.0 - x)
    return x


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("engine", ENGINES)
def test_engine(benchmark, engine, vehicle):
    """A start, a transition and the sharp curve at 40 km/h with flange contact, and a stop."""
    model = load(VehicleFile, "vehicle", VEHICLES[vehicle]).model(vehicle)
    track = load(TrackFile, "track", "condequinto_olivar").design("condequinto_olivar")
    laid = lay(track, Irregularity("erri_b176_low", (1.5, 100.0), 40.0), seed=1)
    profile = SpeedProfile(330.0, 600.0, 40.0 / 3.6, rest_s=1.0, final_rest_s=2.0, acceleration_mps2=1.0)

    def setup():
        return (ENGINES[engine](Setup(model, laid, profile, settle_s=0.5)),), {}

    def drive(engine):
        return sum(len(segment.time_s) for segment in engine.run(DURATION_S))

    calibration_loop(10)
    started = time.perf_counter()
    calibration_loop(200_000_000)
    loop_s = time.perf_counter() - started
    rows = benchmark.pedantic(drive, setup=setup, rounds=5, warmup_rounds=1)
    assert rows == round(DURATION_S * 1000) + 1
    best = benchmark.stats.stats.min
    benchmark.extra_info["real_time_factor"] = DURATION_S / best
    benchmark.extra_info["ratio_to_calibration_loop"] = best / loop_s
    benchmark.extra_info["rounds_s"] = np.round(benchmark.stats.stats.data, 3).tolist()
