"""Whatever a scenario holds, reading and judging it ends well or with an `InputError`."""

from __future__ import annotations

import copy
import tomllib
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from simrail.core.errors import InputError
from simrail.core.toml_files import judge, shipped
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, ScenarioFile, load_scenario

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
SHORT = GOOD.replace("end_m = 590.0", "end_m = 60.0").replace("rest_s = 10.0", "rest_s = 1.0")

odd_values = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**30), 10**30),
    st.floats(allow_nan=True, allow_infinity=True),
    st.text(max_size=8),
    st.sampled_from(
        ["ideal", "front", "exudyn", "smooth_curve", "none", "truth", "../..", "", "a.toml", "x.py:Y", "\0"]
    ),
    st.lists(st.one_of(st.integers(-3, 3), st.floats(), st.text(max_size=3)), max_size=3),
    st.builds(
        lambda kind, given, bounds: {kind: given} | ({"bounds": bounds} if bounds else {}),
        st.sampled_from(["uniform", "log_uniform", "normal", "choice"]),
        st.lists(
            st.one_of(st.integers(-3, 10**400), st.floats(), st.sampled_from([1, 2.0, "a"])), max_size=3
        ),
        st.lists(st.one_of(st.floats(), st.integers(-3, 3)), max_size=2),
    ),
    st.dictionaries(st.text(max_size=5), st.integers(-3, 3), max_size=2),
)


def _paths(data: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = [path] if path else []
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        found += _paths(value, (*path, key))
    return found


@settings(max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_any_scenario_is_judged(data: st.DataObject) -> None:
    content = copy.deepcopy(tomllib.loads(SHORT))
    for _ in range(data.draw(st.integers(1, 3))):
        paths = _paths(content)
        if not paths:
            break
        *way, last = data.draw(st.sampled_from(paths))
        holder = content
        for step in way:
            holder = holder[step]
        action = data.draw(st.sampled_from(["delete", "replace", "swap", "add"]))
        if action == "delete":
            del holder[last]
        elif action == "replace":
            holder[last] = data.draw(odd_values)
        elif action == "swap":
            holder[last] = copy.deepcopy(_at(content, data.draw(st.sampled_from(paths))))
        elif isinstance(holder[last], dict):
            holder[last][data.draw(st.text(max_size=6))] = data.draw(odd_values)
    try:
        spec = judge(ScenarioFile, content, file="mine.toml")
        judge_scenario(Scenario("mine", "mine.toml", None, "", (), spec))
    except InputError as error:
        assert "mine.toml" in str(error) or "scenarios/" in str(error)


def _at(content: Any, path: tuple[Any, ...]) -> Any:
    for step in path:
        content = content[step]
    return content


def test_no_cell_of_a_good_scenario_holds_a_list() -> None:
    scenario = load_scenario(
        "quick_kinematic", overrides=["ride.speed_kmh=[20, 50]", "odometry=['encoder','truth']"]
    )
    for cell in cells(scenario):
        for value in (*cell.ride.model_dump().values(), cell.imu.grade, cell.spec.odometry, cell.spec.track):
            assert not isinstance(value, list)
            assert value is None or isinstance(value, (str, int, float, bool, tuple))
