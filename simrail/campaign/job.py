"""A scenario that has been judged and packed: what a campaign runs, and the key that it is found again by."""

from __future__ import annotations

import hashlib
import inspect
import json
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from simrail.campaign.worker import Order, order_of
from simrail.core.source_hash import score_code_hash
from simrail.scenario.build import Parts
from simrail.scenario.check import Plan, judge_scenario
from simrail.scenario.scenario import Scenario

_PACKAGES = ("numpy", "scipy", "pandas", "numba", "exudyn")
"""Whose versions a score depends on."""


@dataclass(frozen=True)
class Job:
    """A scenario that has been judged and packed.

    Attributes
    ----------
    scenario, plan, parts : Scenario, Plan, Parts
        What is run.
    order : Order
        The same for the workers.
    key : str
        Hash of all that decides the scores: scenario, parts, estimators, code and versions.
    """

    scenario: Scenario
    plan: Plan
    parts: Parts
    order: Order
    key: str


def prepare(scenario: Scenario, *, many: bool = False) -> Job:
    """Judge a scenario and pack it for the workers.

    Parameters
    ----------
    scenario : Scenario
        As read.
    many : bool
        Accept more cells than `simrail.scenario.check.MOST_CELLS`.

    Raises
    ------
    InputError
        If the scenario cannot be run.
    """
    parts = Parts(scenario)
    plan = judge_scenario(scenario, parts, many=many)
    files = {inspect.getsourcefile(type(estimator)) for estimator in plan.estimators.values()}
    decides = {
        "name": scenario.name,
        "plan": plan.content_hash,
        "code": score_code_hash(),
        "estimators": sorted(hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in files if file),
        "versions": {package: version(package) for package in _PACKAGES},
    }
    key = hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()
    return Job(scenario, plan, parts, order_of(parts), key)
