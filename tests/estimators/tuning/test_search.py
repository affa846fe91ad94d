"""The search: finds floors, keeps to the cube, leaves plateaus, is deterministic, and resumes bit by bit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from simrail.estimators.tuning.search import (
    STEP,
    Least,
    Record,
    _cma,
    _descend,
    along_axes,
    differences,
    least,
)

from simrail.core.jit import FloatArray
from simrail.core.seeds import stream

FLOOR = np.array([0.3, 0.8, 0.55, 0.1])


def bowl(points: FloatArray) -> FloatArray:
    """A narrow, curved valley."""
    x = points - FLOOR
    x[:, 1] += 2.0 * x[:, 0] ** 2
    return (np.array([1.0, 300.0, 3.0, 30.0]) * x**2).sum(axis=1) - 7.0


def search(evaluate: Callable, seed: int = 1, record: Record | None = None, **more: object) -> Least:
    start = np.full(4, 0.5)
    return least(evaluate, start=start, generator=stream(seed, "search"), record=record, **more)  # type: ignore[arg-type]


def test_finds_the_floor() -> None:
    found = search(bowl)
    np.testing.assert_allclose(found.point, FLOOR, atol=1e-3)
    assert found.value == pytest.approx(-7.0, abs=1e-6)


def test_keeps_to_the_cube_and_finds_its_edge() -> None:
    def evaluate(points: FloatArray) -> FloatArray:
        assert points.min() >= 0.0 and points.max() <= 1.0
        return ((points - np.array([-0.2, 0.5, 1.3, 0.5])) ** 2).sum(axis=1)

    np.testing.assert_allclose(search(evaluate).point, [0.0, 0.5, 1.0, 0.5], atol=1e-4)


def test_leaves_a_plateau() -> None:
    """Twelve decades of a variance of which those far below the data's show nothing; its floor lies above."""

    def evaluate(points: FloatArray) -> FloatArray:
        u = 10.0 ** (12.0 * points - 8.0)
        return np.log(u[:, 0] + 1.0) + 1.5 / (u[:, 0] + 1.0) + ((points[:, 1:] - 0.5) ** 2).sum(axis=1)

    start = np.array([0.0, 0.5, 0.5, 0.5])
    found = least(evaluate, start=start, generator=stream(1, "plateau"), evaluations=0)
    assert 10.0 ** (12.0 * found.point[0] - 8.0) == pytest.approx(0.5, rel=0.01)


def test_a_value_that_is_not_finite_is_never_the_best() -> None:
    def evaluate(points: FloatArray) -> FloatArray:
        values = bowl(points)
        values[points[:, 2] < 0.5] = np.nan
        values[points[:, 3] > 0.7] = -np.inf
        return values

    found = search(evaluate)
    assert -7.0 - 1e-9 < found.value < -6.9


def test_same_seed_same_bits_whatever_numpy_was_doing() -> None:
    first = search(bowl)
    np.random.seed(5)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # type: ignore[union-attr, call-overload]  # noqa: NPY002
    second = search(bowl)
    assert np.array_equal(before, np.random.get_state()[1])  # type: ignore[call-overload]  # noqa: NPY002
    assert np.array_equal(first.point, second.point) and first.value == second.value
    assert first.evaluations == second.evaluations
    assert not np.array_equal(first.point, search(bowl, seed=2).point)


@pytest.mark.parametrize("at_most", [1, 100, 700])
def test_a_limit_ends_the_search_and_without_it_the_search_goes_on(tmp_path: Path, at_most: int) -> None:
    """It ends with the batch that reaches the limit, at the best so far; lifted, the same bits as without."""
    whole = search(bowl)
    batch = 4 * 17  # the largest: along all axes
    assert whole.evaluations > 700 + batch
    record = Record(tmp_path / "best.npz", "key")
    short = search(bowl, record=record, at_most=at_most)
    assert at_most <= short.evaluations < at_most + batch
    assert bowl(short.point[None])[0] == short.value >= whole.value
    again = search(bowl, record=Record(tmp_path / "best.npz", "key"))
    assert np.array_equal(again.point, whole.point) and again.evaluations == whole.evaluations


@pytest.mark.parametrize("batches", [1, 7, 33])
def test_resumed_is_uninterrupted(tmp_path: Path, batches: int) -> None:
    """Interrupted in CMA-ES or in the descent: the same bits, and nothing is evaluated twice."""
    whole = search(bowl)
    path, evaluated = tmp_path / "record.npz", 0

    def failing(points: FloatArray) -> FloatArray:
        nonlocal evaluated, batches
        if batches == 0:
            raise KeyboardInterrupt
        batches -= 1
        evaluated += len(points)
        return bowl(points)

    with pytest.raises(KeyboardInterrupt):
        search(failing, record=Record(path, "key"))
    assert Record(path, "key").count == evaluated
    batches = -1
    resumed = search(failing, record=Record(path, "key"))
    assert np.array_equal(resumed.point, whole.point) and resumed.value == whole.value
    assert resumed.evaluations == whole.evaluations == evaluated


def test_a_record_of_something_else_or_a_broken_one_is_begun_anew(tmp_path: Path) -> None:
    path = tmp_path / "record.npz"
    search(bowl, record=Record(path, "key"), evaluations=32)
    assert Record(path, "key").count > 0
    assert Record(path, "another key").count == 0
    content = path.read_bytes()
    for broken in (content[: len(content) // 2], b"", b"nonsense"):
        path.write_bytes(broken)
        assert Record(path, "key").count == 0


def test_reports_the_best_so_far() -> None:
    told: list[tuple[int, float]] = []
    found = search(bowl, report=lambda count, point, value: told.append((count, value)))
    counts, values = np.array(told).T
    assert (np.diff(counts) > 0).all() and (np.diff(values) <= 0.0).all()
    assert told[-1] == (found.evaluations, found.value)


def test_no_worse_than_its_start() -> None:
    def needle(points: FloatArray) -> FloatArray:
        return np.where(np.all(np.abs(points - 0.5) < 1e-6, axis=1), -1.0, 1.0)

    assert search(needle, evaluations=16).value == -1.0


def test_each_stage_goes_down_by_itself() -> None:
    """What one of the two leaves undone the other mends: alone, each has to find the valley."""
    far, record = np.array([0.9, 0.1, 0.2, 0.8]), Record()

    def ask(points: FloatArray) -> FloatArray:
        return record.values(points, bowl)

    _cma(ask, far, stream(1, "alone"), 1000)
    assert record.best()[1] < -6.99
    record = Record()
    _descend(ask, far)
    assert record.best()[1] == pytest.approx(-7.0, abs=1e-5)
    assert record.asked < 1000


def test_differences() -> None:
    point = np.array([0.0, 0.5, 1.0, STEP / 2])
    points, width = differences(point)
    assert np.array_equal(points[0], point)
    np.testing.assert_allclose(width, [STEP, 2 * STEP, STEP, 1.5 * STEP])
    assert points.min() >= 0.0 and points.max() <= 1.0
    slopes = (3.0 * points[2::2].sum(axis=1) - 3.0 * points[1::2].sum(axis=1)) / width
    np.testing.assert_allclose(slopes, 3.0)
    assert len(along_axes(point)) == 4 * 17
