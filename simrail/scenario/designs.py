"""Designs of a sensitivity analysis: which values the samples of a scenario have, so that indices follow.

A design takes the place of the Latin hypercube (``[monte_carlo] method``). Its samples come in blocks, each
of which is worth nothing unless it is whole:

* ``morris``: trajectories of D + 1 samples over a grid of four levels, each step of which changes one value
  (Morris 1991): which of many values matter at all, for little.
* ``saltelli``: blocks of D + 2 samples, two independent points A and B, and A with one value of B in turn
  (Saltelli et al. 2010): by how much each value decides, alone and with others (Sobol's indices).

All samples of a design share their seeds, and so the rails, the device's own draws and its noise: two samples
differ by their values alone. With seeds of their own, chance would be part of each difference.

Sources: Morris, Technometrics 33 (1991), p. 161; Saltelli et al., Computer Physics Communications 181 (2010),
p. 259; by SALib (Iwanaga, Usher, Herman 2022).
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from types import ModuleType
from typing import Any

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.seeds import stream

DESIGNS = ("morris", "saltelli")

LEVELS = 4
"""Levels of the grid that Morris' trajectories run over, equal shares of a distribution from 0 to 1."""


def block_size(method: str, dimensions: int) -> int:
    """Samples of a trajectory of Morris, or of a block of Saltelli."""
    return dimensions + (1 if method == "morris" else 2)


def problem_of(names: Sequence[str]) -> dict[str, Any]:
    """What SALib calls a problem: names, and the unit cube."""
    return {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}


def design_seed(seed: int, *names: str) -> int:
    """Seed of 31 bits, as SALib takes them, of a part of an analysis."""
    return int(stream(seed, *names).integers(2**31))


def salib(part: str) -> ModuleType:
    """A module of SALib, which is slow to import, and needed by few scenarios.

    Raises
    ------
    InputError
        If it is not installed, naming the extra that has it.
    """
    try:
        return import_module(f"SALib.{part}")
    except ImportError:
        raise InputError(
            "a sensitivity analysis needs the library SALib, which is not installed",
            field="monte_carlo.method",
            value=" or ".join(DESIGNS),
            limit="SALib installed",
            remedy="pip install 'simrail[sensitivity]'",
        ) from None


def design_shares(method: str, blocks: int, names: Sequence[str], seed: int) -> FloatArray:
    """Points (blocks * block_size, dimensions) of a design in the unit cube.

    Parameters
    ----------
    method : {"morris", "saltelli"}
        The design.
    blocks : int
        Number of trajectories, or of Saltelli's blocks, a power of two.
    names : sequence of str
        Of the dimensions.
    seed : int
        Seed of the scenario.

    Raises
    ------
    InputError
        If SALib is not installed.
    """
    if method == "morris":
        points = salib("sample.morris").sample(
            problem_of(names), blocks, num_levels=LEVELS, seed=design_seed(seed, "morris")
        )
    else:
        points = salib("sample.sobol").sample(
            problem_of(names), blocks, calc_second_order=False, seed=design_seed(seed, "saltelli")
        )
    shares: FloatArray = points
    return shares
