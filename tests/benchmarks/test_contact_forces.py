"""What it costs to tell of the contact and to keep it: paired, interleaved, processor time.

`pytest -n 0 tests/benchmarks/test_contact_forces.py`. Machines are shared, so the best of some rounds of each
is compared, of rounds that took turns.
"""

import time

import pytest

from simrail.core.toml_files import load
from simrail.ride import cache as ride_cache
from simrail.ride.contact_extremes import ContactExtremes
from simrail.ride.ride import Ride, simulate
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.engines import compiled_engine
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

ROUNDS = 9
ROUGH = Irregularity("erri_b176_low", (1.5, 100.0), 40.0)
PROFILE = SpeedProfile(330.0, 600.0, 40.0 / 3.6, rest_s=1.0, final_rest_s=2.0, acceleration_mps2=1.0)


def parts(vehicle):
    design = load(TrackFile, "track", "condequinto_olivar").design("condequinto_olivar")
    return design, load(VehicleFile, "vehicle", vehicle).model(vehicle)


def best_of_turns(ways):
    """Least processor time of each way, s, of rounds in which each has its turn; the first does not count."""
    times = {name: [] for name in ways}
    for _ in range(ROUNDS + 1):
        for name, way in ways.items():
            begun = time.process_time()
            way()
            times[name].append(time.process_time() - begun)
    return {name: min(took[1:]) for name, took in times.items()}


@pytest.mark.parametrize("vehicle", ["metro_irw_bogie", "irw_car"])
def test_telling_and_the_extremes_cost_one_percent_of_the_engine(benchmark, vehicle, monkeypatch):
    """Against the same kernel that never tells. Allowed: 1 %, and 2 % for the scatter of the pair."""
    design, model = parts(vehicle)
    laid = lay(design, ROUGH, seed=1)
    march = compiled_engine.march

    def silent(*arguments):
        return march(*arguments[:-2], 10**9, arguments[-1])

    def run(kernel, *, extremes):
        monkeypatch.setattr(compiled_engine, "march", kernel)
        gathered = ContactExtremes(model, rate_hz=1000.0, gravity_mps2=9.81)
        for segment in CompiledEngine(Setup(model, laid, PROFILE, settle_s=0.5)).run(20.0):
            if extremes:
                gathered.add(segment.time_s, segment.contacts)

    ways = {"silent": lambda: run(silent, extremes=False), "told": lambda: run(march, extremes=True)}
    took = benchmark.pedantic(best_of_turns, args=(ways,), rounds=1)
    benchmark.extra_info["ratio"] = took["told"] / took["silent"]
    assert took["told"] / took["silent"] < 1.03


@pytest.mark.parametrize("rate_hz", [200.0, 1000.0])
def test_keeping_costs_ten_percent_at_most(benchmark, rate_hz, tmp_path, monkeypatch):
    """The whole simulation, files included, beside the one that keeps nothing."""
    monkeypatch.setattr(ride_cache, "cache_folder", lambda: tmp_path)
    design, model = parts("irw_car")
    bare = Ride("bench", design, ROUGH, 1, model, PROFILE, engine="compiled")
    kept = Ride("bench", design, ROUGH, 1, model, PROFILE, engine="compiled", contact_rate_hz=rate_hz)

    def made(ride):
        ride_cache.clear()
        simulate(ride)

    ways = {"bare": lambda: made(bare), "kept": lambda: made(kept)}
    took = benchmark.pedantic(best_of_turns, args=(ways,), rounds=1)
    benchmark.extra_info["ratio"] = took["kept"] / took["bare"]
    assert took["kept"] / took["bare"] < 1.10
