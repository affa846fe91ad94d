"""Long signals are drawn by few points that keep every peak."""

from __future__ import annotations

import numpy as np
import pytest

from simrail.report.figures.decimate import Bins


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_decimation_keeps_every_peak_and_stays_inside_the_signal(sign: float) -> None:
    rng = np.random.default_rng(4)
    x = sign * np.concatenate([np.zeros(5000), np.linspace(0.0, 100.0, 50000), np.full(3000, 100.0)])
    y = rng.normal(size=len(x))
    y[[77, 20000, 57000]] = 50.0, -60.0, 70.0
    bins = Bins(x, bins=500)
    line_x, line_y = bins.line(y)
    assert len(line_x) == len(line_y) <= 1000
    assert {50.0, -60.0, 70.0} <= set(line_y)
    assert line_y.min() == y.min() and line_y.max() == y.max()
    found = bins.envelope(y)
    assert (found.low <= found.mean).all() and (found.mean <= found.high).all()
    assert np.average(found.mean, weights=bins.count) == pytest.approx(y.mean(), abs=1e-12)
    assert bins.count.sum() == len(x)


def test_decimation_of_a_ramp_is_the_ramp() -> None:
    for slope in (1.0, -1.0):
        x = np.linspace(0.0, 1.0, 10001)
        line_x, line_y = Bins(x, bins=100).line(slope * x)
        assert np.all(np.diff(slope * line_y) > 0.0), "no saw teeth"
        np.testing.assert_allclose(line_y, slope * line_x, atol=0.006)


def test_decimation_of_a_short_or_standing_signal() -> None:
    x, y = np.zeros(20), np.arange(20.0)
    bins = Bins(x)
    assert bins.line(y)[1].tolist() == [0.0, 19.0]
    few = Bins(np.arange(5.0))
    assert few.envelope(np.arange(5.0)).mean.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_runs_of_a_ride_are_binned_each_by_itself() -> None:
    """To and fro: every peak is kept where it was, and no line joins the end of a run with the next."""
    rng = np.random.default_rng(5)
    ways = [np.linspace(0.0, 100.0, 20_000), np.full(4000, 100.0), np.linspace(100.0, 30.0, 15_000)]
    x = np.concatenate([*ways, np.full(500, 30.0), np.linspace(30.0, 80.0, 9000)])
    y = rng.normal(size=len(x))
    for sample, peak in ((10_000, 50.0), (30_000, -60.0), (45_000, 70.0)):
        y[sample] = peak
    bins = Bins(x, bins=600)
    line_x, line_y = bins.line(y)
    assert np.isfinite(line_y).all() and np.count_nonzero(np.isnan(line_x)) == 4
    for sample, peak in ((10_000, 50.0), (30_000, -60.0), (45_000, 70.0)):
        (at,) = np.flatnonzero(line_y == peak)
        assert line_x[at] == pytest.approx(x[sample], abs=0.6)
    steps = np.diff(line_x)
    assert np.nanmax(np.abs(steps)) < 1.0  # a joint of two runs would be longer
    way = np.sign([np.nanmean(part) for part in np.split(steps, np.flatnonzero(np.isnan(steps))[[0, 4]])])
    assert list(way) == [1.0, -1.0, 1.0]
    assert np.isfinite(bins.place).all() and len(bins.place) == len(bins.x) == len(bins.envelope(y).mean)
