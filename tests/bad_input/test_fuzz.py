"""A sample of the fuzzer's inputs; all of them by command: ``python tests/bad_input/fuzz.py``."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest


@pytest.fixture(scope="module")
def fuzzer() -> ModuleType:
    spec = importlib.util.spec_from_file_location("fuzz", Path(__file__).with_name("fuzz.py"))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["fuzz"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "count", [pytest.param(30, marks=pytest.mark.long), pytest.param(1000, marks=pytest.mark.slow)]
)
def test_every_mutated_input_is_answered_in_one_line(count: int, fuzzer: ModuleType, tmp_path: Path) -> None:
    answers = fuzzer.fuzz(7, range(count), tmp_path, told=lambda answer: None)
    assert len(answers) == count
    assert [(answer.case, answer.fault, answer.said) for answer in answers if answer.fault] == []
    assert sum(answer.code == 2 for answer in answers) > 0.5 * count


def test_the_fuzzer_sees_what_is_wrong(fuzzer: ModuleType) -> None:
    """Planted answers of every wrong kind."""
    case = fuzzer.Case(0, "scenario", wrong=[("seed",)])
    good = "simrail: a.toml: key: is wrong; found 3; limit: 4; remedy: mend it\n"
    for code, said, words in (
        (0, "", "silently accepted"),
        (1, good, "exit code 1"),
        (2, "", "something else"),
        (2, "RuntimeWarning: overflow\n" + good, "something else"),
        (2, good.replace("; limit: 4", ""), "lacks limit"),
        (2, good.replace("; remedy: mend it", ""), "lacks remedy"),
        (2, good.replace("; found 3", ""), "lacks what was found"),
        (2, good.replace("wrong", "\x1b[31m"), "control character"),
        (2, good.replace("wrong", "x" * 5000), "more than 4000"),
        (2, good, ""),
    ):
        told = fuzzer.judge(fuzzer.Answer(case, code, said, 0.0))
        assert words in told and bool(words) == bool(told)


def test_what_is_put_in_the_place_of_a_wrong_value_need_not_be_refused(fuzzer: ModuleType) -> None:
    """A number of 1e300 that a later deed makes 0 is gone; one beside it, or within a table, is not."""
    for wrong, left in ((("a",), []), (("a", "b"), []), (("c",), [("c",)])):
        judged = 0
        for seed in range(200):
            case = fuzzer.Case(0, "imu", wrong=[wrong])
            data = {"a": 1.0} if wrong == ("a",) else {"a": 1.0, "c": 1.0}
            fuzzer.mutate(data, np.random.default_rng(seed), case)
            ((deed, name, *_),) = (done.split() for done in case.deeds)
            if name == "a" and deed == "small":
                assert case.wrong == left
                judged += 1
        assert judged
