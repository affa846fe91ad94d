"""A satellite receiver: its noise is that of its sheet, it comes late, and tunnels hide it by place."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from simrail.core.errors import InputError
from simrail.sensors.gnss import GnssSpec, Outage, sample_gnss


def line(seconds: float, speed_mps: float) -> pd.DataFrame:
    time = np.arange(0.0, seconds + 1e-9, 0.01)
    columns = {"position_m": 5.0 + speed_mps * time, "speed_mps": np.full(len(time), speed_mps)}
    return pd.DataFrame(columns, index=pd.Index(time, name="time_s"))


def test_noise_is_that_of_the_sheet() -> None:
    """sd of 20 000 s within 4 of its own sds: 2 tau / T of a process that wanders, n of white noise."""
    spec = GnssSpec(correlation_s=10.0, latency_s=0.0)
    seen = sample_gnss(line(20000.0, 10.0), spec, seed=1, draw=0)
    time = seen.index.to_numpy()
    error = seen["position_m"].to_numpy() - 5.0 - 10.0 * time
    n = len(error)
    assert n == 20001
    assert (seen["speed_mps"] - 10.0).std() == pytest.approx(0.05, rel=4.0 / np.sqrt(2.0 * n))
    total = spec.position_sd_m**2 + spec.position_noise_m**2
    assert error.var() == pytest.approx(total, rel=4.0 * np.sqrt(2.0 * 10.0 / 20000.0))
    lagged = np.mean(error[10:] * error[:-10])
    assert lagged == pytest.approx(
        spec.position_sd_m**2 / np.e, abs=4.0 * 2.25 * np.sqrt(2.0 * 10.0 / 20000.0)
    )
    again = sample_gnss(line(20000.0, 10.0), spec, seed=1, draw=1)
    assert abs(np.corrcoef(seen["speed_mps"], again["speed_mps"])[0, 1]) < 4.0 / np.sqrt(n)


def test_no_two_of_its_errors_share_a_draw() -> None:
    """White noise and wander of the place, and the speed: each alone, a wander too quick to hang together."""
    nothing, motion = 1e-12, line(5000.0, 10.0)
    white = sample_gnss(motion, GnssSpec(position_sd_m=0.0, latency_s=0.0), seed=1, draw=0)
    quick = GnssSpec(position_noise_m=nothing, correlation_s=0.05, latency_s=0.0)
    wander = sample_gnss(motion, quick, seed=1, draw=0)
    way = 5.0 + 10.0 * white.index.to_numpy()
    errors = [white["position_m"] - way, wander["position_m"] - way, white["speed_mps"]]
    shared = np.corrcoef(errors) - np.eye(3)
    assert np.abs(shared).max() < 4.0 / np.sqrt(len(white))


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_it_comes_late_and_a_tunnel_hides_the_antenna(way: float) -> None:
    tunnel = Outage(min(105.0 * way, 155.0 * way), max(105.0 * way, 155.0 * way))
    spec = GnssSpec(
        rate_hz=10.0,
        position_sd_m=0.0,
        position_noise_m=1e-9,
        speed_sd_mps=1e-9,
        latency_s=0.25,
        ahead_m=3.0,
        outages=(tunnel,),
        reacquire_s=1.0,
    )
    motion = line(30.0, 10.0 * way)
    seen = sample_gnss(motion, spec, seed=1, draw=0)
    epoch = seen.index.to_numpy() - 0.25
    assert epoch[0] == pytest.approx(0.0) and seen.index[-1] <= 30.0
    place = 8.0 + 10.0 * way * epoch
    hidden = seen["position_m"].isna().to_numpy()
    np.testing.assert_array_equal(hidden, seen["speed_mps"].isna())
    np.testing.assert_allclose(seen["position_m"][~hidden], place[~hidden], atol=1e-6)
    inside = (place >= tunnel.from_m) & (place <= tunnel.to_m)
    assert hidden[inside].all() and inside.sum() in (50, 51)
    # For a second more than it is inside.
    assert hidden.sum() == inside.sum() + 10


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"rate_hz": 0.0}, "rate_hz"),
        ({"latency_s": -1.0}, "latency_s"),
        ({"speed_sd_mps": 0.0}, "speed_sd_mps"),
        ({"outages": (Outage(5.0, 5.0),)}, "outage[0].to_m"),
    ],
)
def test_what_cannot_be_is_refused(options: dict[str, object], field: str) -> None:
    with pytest.raises(InputError) as caught:
        sample_gnss(line(5.0, 1.0), GnssSpec(**options), seed=1, draw=0)  # type: ignore[arg-type]
    assert caught.value.field == field
