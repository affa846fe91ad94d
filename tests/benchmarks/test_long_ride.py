"""A ride of 90 minutes, from the rails to the page: processor time, memory and disk.

Run alone: memory is that of the process at its peak. It takes some minutes.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = """
import resource, sys, time
import simrail
simrail.run("metro_ride", out=sys.argv[1], workers=1)
print(time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3)
"""
RIDE_S = 90.0 * 60.0


def test_metro_ride_end_to_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """20 times real time on one core, 2 GB of memory and of cache; kernels are compiled on the way."""
    monkeypatch.setenv("SIMRAIL_RIDES", str(tmp_path / "rides"))
    command = [sys.executable, "-c", PROGRAM, str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    cpu_s, memory_mb = map(float, done.stdout.split()[-2:])
    cache_gb = sum(file.stat().st_size for file in (tmp_path / "rides").rglob("*.npy")) / 1e9
    page_mb = (tmp_path / "out" / "report.html").stat().st_size / 1e6
    print(
        f"\n{cpu_s:.0f} s of processor ({RIDE_S / cpu_s:.0f} times real time), {memory_mb:.0f} MB of memory, "
        f"{cache_gb:.2f} GB of cache, a page of {page_mb:.1f} MB"
    )
    assert cpu_s < RIDE_S / 20.0 and memory_mb < 2000.0 and cache_gb < 2.0 and page_mb < 5.0
