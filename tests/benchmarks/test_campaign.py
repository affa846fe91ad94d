"""What a campaign costs beyond its cells: processor time, memory, and the reading of its table.

Ratios of one run, so that they hold on any machine that has nothing else to do; the speed-up of two
processes is told, and judged only where two cores are free.
"""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.campaign import run_campaign
from simrail.campaign.progress import Watcher
from simrail.campaign.result import CampaignResult
from simrail.scenario.scenario import load_scenario
from simrail.scoring.aggregate import aggregate
from simrail.scoring.table import concat_scores

SMALL = [
    *("ride.end_m=60.0", "ride.rest_s=1.0", "ride.final_rest_s=1.0", "imu.grade='lord_3dm_gx4_25'"),
    *("score.windows=['whole']", "score.metrics=['rms']"),
]


@pytest.fixture(scope="module", autouse=True)
def rides(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIMRAIL_RIDES", str(tmp_path_factory.mktemp("rides")))
        yield


def cpu_s() -> float:
    """Processor time of this process and of those that it has ended."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in used)


def campaign(cells: int, workers: int) -> tuple[CampaignResult, float, float]:
    """A campaign of the shipped quick scenario; its wall and processor time."""
    settings = ["ride.speed_kmh=[30, 50]", f"monte_carlo.sensor_draws={cells // 4}"]
    before, begun = cpu_s(), time.perf_counter()
    found = run_campaign(load_scenario("quick_kinematic", overrides=settings), workers=workers)
    assert len(found.cells) == cells and not found.failures
    return found, time.perf_counter() - begun, cpu_s() - before


def test_most_of_the_processor_time_is_spent_in_the_cells() -> None:
    found, wall, cpu = campaign(int(os.environ.get("SIMRAIL_BENCH_CELLS", "2000")), 2)
    share = sum(found.cpu_s.values()) / cpu
    print(f"\n{len(found.cells)} cells, {wall:.0f} s, {cpu:.0f} s of processor, {100 * share:.1f} % in cells")
    print({stage: f"{100 * seconds / cpu:.1f} %" for stage, seconds in found.cpu_s.items()})
    assert share >= 0.85


def test_two_processes_are_nearly_twice_as_fast_as_one() -> None:
    free = os.cpu_count() or 1
    campaign(4, 1)  # rides are there, kernels compiled
    cells = 1200  # so many that starting the processes counts for little
    _, one, _ = campaign(cells, 1)
    _, two, _ = campaign(cells, 2)
    print(f"\n1 process {one:.1f} s, 2 processes {two:.1f} s: {one / two:.2f} times")
    if os.getloadavg()[0] > 0.3 + 1.2 * 2 or free < 2:
        pytest.skip(f"the machine is busy: {one / two:.2f} times")
    assert one / two >= 1.8


class Memory(Watcher):
    """Notes the resident memory of this process, MB, as cells are done."""

    def __init__(self) -> None:
        self.noted: list[tuple[int, float]] = []

    def cells_done(self, done: int, count: int, failed: int, worker: str) -> None:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        self.noted.append((done, pages * os.sysconf("SC_PAGE_SIZE") / 1e6))


def test_memory_is_flat_over_ten_thousand_cells() -> None:
    memory = Memory()
    settings = [*SMALL, "monte_carlo.sensor_draws=1000", "monte_carlo.track_draws=10"]
    run_campaign(load_scenario("quick_kinematic", overrides=settings), workers=1, watcher=memory)
    done, used = np.array(memory.noted).T
    early, late = used[(done > 500) & (done < 1500)].max(), used[done > 9000].max()
    print(f"\n{early:.0f} MB after 1000 cells, {late:.0f} MB after 10000")
    assert late < early + 30.0


def test_a_table_of_a_million_rows_is_read_and_averaged_in_half_a_minute(tmp_path: Path) -> None:
    found = run_campaign(load_scenario("quick_kinematic", overrides=["monte_carlo.sensor_draws=20"]))
    times = -(-1_000_000 // len(found.scores))
    parts, cells = [], []
    for copy in range(times):
        parts.append(found.scores.assign(cell=found.scores["cell"] + copy * len(found.cells)))
        cells.append(found.cells.assign(cell=found.cells["cell"] + copy * len(found.cells)))
        parts[-1]["sensor_draw"] += 20 * copy
        cells[-1]["sensor_draw"] += 20 * copy
    concat_scores(parts).to_parquet(tmp_path / "scores.parquet", index=False)
    pd.concat(cells).to_parquet(tmp_path / "cells.parquet", index=False)
    begun = time.process_time()
    scores, table = pd.read_parquet(tmp_path / "scores.parquet"), pd.read_parquet(tmp_path / "cells.parquet")
    averages = aggregate(scores, table)
    took = time.process_time() - begun
    print(
        f"\n{len(scores)} rows of {len(table)} cells read and averaged into {len(averages)} in {took:.1f} s"
    )
    assert len(scores) >= 1_000_000 and averages["draws"].max() == 20 * times
    assert took < 30.0
