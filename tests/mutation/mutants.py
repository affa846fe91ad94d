"""Which faults a mutation run plants: a seeded sample of those that cosmic-ray's operators make.

Places are drawn first, each with the same chance, then one fault of each: a sum has eleven faults in
cosmic-ray, a comparison seven, a number two, and sums would be nearly all of a sample. What no test can tell
is left out beforehand: type annotations, which nothing evaluates; decorators, which compile; operators of
bits in place of those of numbers (a TypeError on floats, found by anything).
"""

from __future__ import annotations

import ast
import random
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path

from cosmic_ray.commands.init import _all_work_items as all_work_items
from cosmic_ray.work_item import MutationSpec, WorkItem

ROOMS = (
    "simrail/scoring",
    "simrail/sensors/measure.py",
    "simrail/estimators/odometry",
    "simrail/estimators/kalman.py",
    "simrail/campaign",
)
"""What is mutated, in the layout of a wheel."""

_LEFT_OUT = ("Decorator", "LShift", "RShift", "BitAnd", "BitOr", "BitXor", "Invert", "_Is", "Variable")


def modules(root: Path) -> list[Path]:
    """The modules of `ROOMS` under a root, relative to it."""
    found = [
        path
        for room in ROOMS
        for path in ([root / room] if room.endswith(".py") else (root / room).rglob("*.py"))
    ]
    return sorted(path.relative_to(root) for path in found)


def sample(root: Path, *, seed: int, count: int) -> list[WorkItem]:
    """Draw faults; one with fewer is the beginning of one with more.

    Parameters
    ----------
    root : Path
        The folder of the sources; the working folder, as paths are relative to it.
    seed, count : int
        Of the sample.
    """
    places: list[list[MutationSpec]] = []
    for path in modules(root):
        silent = _silent_lines(root / path)
        kept = [
            item.mutations[0]
            for item in all_work_items([path], {})
            if not any(word in item.mutations[0].operator_name for word in _LEFT_OUT)
            and not _within(item.mutations[0], silent)
        ]
        kept.sort(key=lambda one: (one.start_pos, one.end_pos, one.operator_name, one.occurrence))
        places.extend(list(group) for _, group in groupby(kept, key=lambda one: (one.start_pos, one.end_pos)))
    chance = random.Random(seed)
    chance.shuffle(places)
    chosen = [chance.choice(place) for place in places[:count]]
    return [WorkItem.single(name_of(mutation), mutation) for mutation in chosen]


def count_places(root: Path) -> int:
    """How many places there are to draw from."""
    return len(sample(root, seed=0, count=10**9))


def name_of(mutation: MutationSpec) -> str:
    """The name of a fault: where it is and what it does, the same in each run."""
    module = mutation.module_path.as_posix().removesuffix(".py").removeprefix("simrail/")
    line, column = mutation.start_pos
    return f"{module}:{line}:{column}:{mutation.operator_name.removeprefix('core/')}:{mutation.occurrence}"


def _silent_lines(path: Path) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Parts of a source that nothing evaluates: annotations, and what is for type checkers only."""
    parts: list[ast.AST] = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            arguments = (
                *node.args.posonlyargs,
                *node.args.args,
                *node.args.kwonlyargs,
                node.args.vararg,
                node.args.kwarg,
            )
            parts.extend(
                one.annotation for one in arguments if one is not None and one.annotation is not None
            )
            parts.extend([node.returns] if node.returns is not None else [])
        elif isinstance(node, ast.AnnAssign):
            parts.append(node.annotation)
        elif isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            parts.append(node)
    return [_span(part) for part in parts]


def _span(node: ast.AST) -> tuple[tuple[int, int], tuple[int, int]]:
    begin, end = (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)  # type: ignore[attr-defined]
    return begin, end


def _within(mutation: MutationSpec, spans: Iterable[tuple[tuple[int, int], tuple[int, int]]]) -> bool:
    return any(begin <= mutation.start_pos and mutation.end_pos <= end for begin, end in spans)
