"""Mutated input of every kind, each answered in one line.

    python tests/bad_input/fuzz.py --seed 1 --count 1000

Scenarios, tracks, vehicles, IMUs, rides and recordings are changed at random, one or two places at a time:
numbers to extremes, NaN and infinity, other types, keys missing and too many, texts of other letters or far
too long, huge lists, cut and overwritten files. Each is handed to the command line in this process. It must
end with code 0 or 2 within 20 s, without an exception; what it refuses it tells in one line with limit and
remedy; and what is not a number, of another type, unknown or absurdly large is refused. Cases are numbered:
``--only N`` shows one.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import io
import os
import re
import shutil
import signal
import sys
import tempfile
import time
import tomllib
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import tomli_w

from simrail.cli.main import call
from simrail.cli.templates import write_template
from simrail.core.toml_files import shipped

sys.path.insert(0, str(Path(__file__).parents[1] / "shared"))
from shortest_ride import DESIGN, SHORTEST_RIDE

MOST_S = 20

SCENARIO = (
    SHORTEST_RIDE.replace("seed = 3", "seed = 3\nstep_s = 0.0005\nmonte_carlo = { sensor_draws = 2 }")
    + """
[imu.sheet]
gyro_turn_on_bias_degps = 0.1
[irregularity]
spectrum = "erri_b176_low"
wavelengths_m = [3.0, 100.0]
fade_m = 20.0
[score]
windows = ["whole"]
"""
    + DESIGN
    + """
[[estimator]]
name = "ekf"
method = "AttitudeEkf"
"""
)

ODD_TEXTS = [
    "",
    " ",
    "\u202egnp",
    "\x1b[31mred\x1b[0m",
    "a\nb",
    "=1+1",
    "线",
    "\u0000",
    "x" * 300,
    "x" * 200_000,
    "../..",
    "[red]",
]
EXTREMES = [1e12, -1e12, 1e300, -1e300, 10**30]
SMALL = [0, -1, 1e-12, 5e-324, -0.0]


@dataclass
class Case:
    """One mutated input: what was done to it, and the places for which it must be refused."""

    number: int
    kind: str
    deeds: list[str] = field(default_factory=list)
    wrong: list[tuple[Any, ...]] = field(default_factory=list)


@dataclass
class Answer:
    """What the command line said."""

    case: Case
    code: int | None
    said: str
    seconds: float
    fault: str = ""


def places(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place in nested data."""
    if path:
        yield path
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield from places(value, (*path, key))


def mutate(data: dict[str, Any], random: np.random.Generator, case: Case) -> dict[str, Any]:
    """Change one place of plain data."""
    data = copy.deepcopy(data)
    all_places = list(places(data))
    *way, last = all_places[int(random.integers(len(all_places)))]
    holder: Any = data
    for step in way:
        holder = holder[step]
    value = holder[last]
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    name = ".".join(map(str, (*way, last)))
    deeds = ["drop", "type", "text", "list", "unknown"] + [
        "extreme",
        "extreme",
        "not finite",
        "small",
    ] * is_number
    deed = str(random.choice(deeds))
    chosen: Any = None
    place = (*way, last)
    if deed != "unknown":  # what was wrong before is gone with what is put in its place
        case.wrong = [one for one in case.wrong if one[: len(place)] != place]
    if deed == "drop":
        del holder[last]
        case.wrong = []  # places of a list move up
    elif deed == "type":
        chosen = [{"a": 1}, "12 km/h", True, 3][int(random.integers(4))] if not is_number else "12 km/h"
        case.wrong += [place] * is_number
    elif deed == "text":
        chosen = str(ODD_TEXTS[int(random.integers(len(ODD_TEXTS)))])
    elif deed == "list":
        chosen = [[], [1.0] * 3000, ["a"] * 3000, [[1]]][int(random.integers(4))]
    elif deed == "extreme":
        chosen = EXTREMES[int(random.integers(len(EXTREMES)))]
        case.wrong += [place] * (last not in ("seed",))
    elif deed == "not finite":
        chosen = float(random.choice([np.nan, np.inf, -np.inf]))
        case.wrong.append(place)
    elif deed == "small":
        chosen = SMALL[int(random.integers(len(SMALL)))]
    else:
        target, within = (value, place) if isinstance(value, dict) else (data, ())
        target["unknown_key_of_a_fuzzer"] = 1
        case.wrong.append((*within, "unknown_key_of_a_fuzzer"))
    if chosen is not None:
        holder[last] = chosen
    case.deeds.append(f"{deed} {name}" + (f" = {chosen!r}"[:60] if chosen is not None else ""))
    return data


def mutate_bytes(content: bytes, random: np.random.Generator, case: Case) -> bytes:
    """Cut a file, overwrite some bytes, or put something long into it."""
    deed = str(random.choice(["cut", "flip", "binary", "long line", "twice", "nothing"]))
    case.deeds.append(deed)
    at = int(random.integers(max(len(content), 1)))
    if deed == "cut":
        return content[:at]
    if deed == "flip":
        bad = bytearray(content)
        for place in random.integers(0, len(bad), 5):
            bad[place] ^= 1 << int(random.integers(8))
        return bytes(bad)
    if deed == "binary":
        return content[:at] + random.bytes(200) + content[at:]
    if deed == "long line":
        return b"x" * 200_000 + b"\n" + content
    return content * 2 if deed == "twice" else b""


class Fuzzer:
    """Makes cases in a folder and hands them to the command line."""

    estimate = ("estimate", "logged.toml", "--estimator", "Vqf", "--out", "out")

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.seed = folder, seed
        self.scenario = tomllib.loads(SCENARIO)
        self.track = tomllib.loads(shipped("track")["condequinto_olivar"].read_text(encoding="utf-8"))
        self.vehicle = tomllib.loads(shipped("vehicle")["metro_irw_bogie"].read_text(encoding="utf-8"))
        imus = shipped("imu")
        self.imus = [tomllib.loads(imus[name].read_text(encoding="utf-8")) for name in sorted(imus)[:4]]
        with contextlib.redirect_stdout(io.StringIO()):
            write_template("ride", "logged", folder=folder)
        self.ride = tomllib.loads((folder / "logged.toml").read_text(encoding="utf-8"))
        lines = (folder / "logged.csv").read_text(encoding="utf-8").splitlines(keepends=True)
        self.logged = "".join(lines[:1500]).encode()
        pd.read_csv(io.BytesIO(self.logged), comment="#").to_parquet(folder / "logged.parquet")
        self.parquet = (folder / "logged.parquet").read_bytes()
        self._warm()
        self.makers: dict[str, Callable[[np.random.Generator, Case], list[str]]] = {
            "scenario": self._scenario,
            "track": self._track,
            "vehicle": self._vehicle,
            "imu": self._imu,
            "ride": self._ride,
            "recording": self._recording,
        }

    def _warm(self) -> None:
        """Compile what a judgement needs: that is no property of an input."""
        usual = {key: value for key, value in self.scenario.items() if key != "engine"}
        (self.folder / "mine.toml").write_text(tomli_w.dumps(usual), encoding="utf-8")
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            for words in (["check", "mine.toml"], list(self.estimate)):
                if call(words) != 0:
                    raise RuntimeError(f"{words[0]} does not take what was not changed")

    def answer(self, number: int) -> Answer:
        """Make a case and see what becomes of it."""
        random = np.random.default_rng([self.seed, number])
        kind = list(self.makers)[number % len(self.makers)]
        case = Case(number, kind)
        shutil.rmtree(self.folder / "out", ignore_errors=True)
        return run(case, self.makers[kind](random, case))

    def _data(self, name: str, data: dict[str, Any], random: np.random.Generator, case: Case) -> None:
        if random.random() < 0.2:
            content = mutate_bytes(tomli_w.dumps(data).encode(), random, case)
        else:
            for _ in range(int(random.integers(1, 3))):
                data = mutate(data, random, case)
            content = tomli_w.dumps(data).encode("utf-8", "surrogatepass")
        (self.folder / name).write_bytes(content)

    def _scenario(self, random: np.random.Generator, case: Case) -> list[str]:
        self._data("mine.toml", self.scenario, random, case)
        return ["check", "mine.toml"]

    def _part(self, kind: str, random: np.random.Generator, case: Case) -> list[str]:
        self._data(f"{kind}.toml", getattr(self, kind), random, case)
        scenario = self.scenario | {kind: f"./{kind}.toml"}
        (self.folder / "mine.toml").write_text(tomli_w.dumps(scenario), encoding="utf-8")
        return ["check", "mine.toml"]

    def _track(self, random: np.random.Generator, case: Case) -> list[str]:
        return self._part("track", random, case)

    def _vehicle(self, random: np.random.Generator, case: Case) -> list[str]:
        return self._part("vehicle", random, case)

    def _imu(self, random: np.random.Generator, case: Case) -> list[str]:
        self._data("imu.toml", self.imus[int(random.integers(len(self.imus)))], random, case)
        return ["imu", "./imu.toml"]

    def _ride(self, random: np.random.Generator, case: Case) -> list[str]:
        (self.folder / "logged.csv").write_bytes(self.logged)
        self._data("logged.toml", self.ride, random, case)
        return list(self.estimate)

    def _recording(self, random: np.random.Generator, case: Case) -> list[str]:
        ride = copy.deepcopy(self.ride)
        suffix = str(random.choice(["csv", "csv", "parquet"]))
        content = self.logged if suffix == "csv" else self.parquet
        if suffix == "csv" and random.random() < 0.6:
            content = self._cells(random, case)
        else:
            content = mutate_bytes(content, random, case)
        text = tomli_w.dumps(ride).replace("logged.csv", f"logged.{suffix}")
        (self.folder / "logged.toml").write_text(text, encoding="utf-8")
        (self.folder / f"logged.{suffix}").write_bytes(content)
        return list(self.estimate)

    def _cells(self, random: np.random.Generator, case: Case) -> bytes:
        """Other words in the place of a cell, or of a whole column."""
        lines = self.logged.decode().splitlines()
        cells = [line.split(",") for line in lines]
        word = str(random.choice(["nan", "inf", "1e308", "-1e308", "", "abc", "=1+1", "0", "1,5", "9" * 400]))
        column = int(random.integers(len(cells[-1])))
        rows = [int(random.integers(1, len(cells)))] if random.random() < 0.5 else range(1, len(cells))
        for row in rows:
            if column < len(cells[row]):
                cells[row][column] = word
        case.deeds.append(f"cell {word[:20]!r} in column {column}, {len(rows)} rows")
        return "\n".join(",".join(row) for row in cells).encode()


class Hang(BaseException):
    """It took too long."""


def run(case: Case, words: list[str]) -> Answer:
    """Hand words to the command line."""

    def late(*_: object) -> None:
        raise Hang

    out, err = io.StringIO(), io.StringIO()
    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(MOST_S)
    begun, code, fault = time.perf_counter(), None, ""
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = call(words)
    except Hang:
        fault = f"hangs for more than {MOST_S} s"
    except BaseException as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        fault = f"{type(error).__name__} in {Path(frame.filename).name}:{frame.lineno}: {error}"[:200]
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    answer = Answer(case, code, err.getvalue(), time.perf_counter() - begun, fault)
    answer.fault = fault or judge(answer)
    return answer


def judge(answer: Answer) -> str:
    """What is wrong with an answer; nothing if nothing is."""
    lines = answer.said.splitlines()
    if answer.code not in (0, 2):
        return f"exit code {answer.code}"
    if answer.code == 0:
        return "is silently accepted" if answer.case.wrong else ""
    if not lines or not lines[0].startswith("simrail: "):
        return "says something else first"
    if any(len(line) > 4000 for line in lines):
        return "has a line of more than 4000 characters"
    if not all(letter.isprintable() for line in lines for letter in line):
        return "shows a control character"
    for line in lines:
        if line.startswith("and ") and "more faults" in line:
            continue
        for part in ("; limit: ", "; remedy: "):
            if part not in line:
                return f"lacks{part.rstrip(': ').removeprefix(';')}"
        if "; found " not in line and not re.search(
            "is required|missing|is empty|has no|there is no|needs its|joins two|nothing says", line
        ):
            return "lacks what was found"
    return ""


def fuzz(seed: int, numbers: range, folder: Path, *, told: Callable[[Answer], None]) -> list[Answer]:
    """Run cases in a folder; `told` is called with each."""
    here = Path.cwd()
    os.chdir(folder)
    try:
        fuzzer = Fuzzer(folder, seed)
        answers = []
        for number in numbers:
            answers.append(fuzzer.answer(number))
            told(answers[-1])
    finally:
        os.chdir(here)
    return answers


def main() -> int:
    """Fuzz by command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--only", type=int, default=None)
    chosen = parser.parse_args()
    begun = time.perf_counter()

    def tell(answer: Answer) -> None:
        if answer.fault or chosen.only is not None:
            case = answer.case
            print(f"{case.number} {case.kind}: {answer.fault}  <- {'; '.join(case.deeds)}", flush=True)
            print(f"    {answer.said.splitlines()[0][:300] if answer.said else ''}", flush=True)

    numbers = range(chosen.count) if chosen.only is None else range(chosen.only, chosen.only + 1)
    with tempfile.TemporaryDirectory() as folder:
        answers = fuzz(chosen.seed, numbers, Path(folder), told=tell)
    kinds = Counter(re.sub(r"[\d.]+", "#", answer.fault)[:60] for answer in answers if answer.fault)
    for fault, count in kinds.most_common():
        print(f"{count:5d}  {fault}")
    codes = Counter(answer.code for answer in answers)
    slowest = max(answer.seconds for answer in answers)
    print(
        f"{len(answers)} inputs, seed {chosen.seed}: {codes[2]} refused, {codes[0]} accepted, "
        f"{sum(kinds.values())} faults; slowest {slowest:.1f} s, {time.perf_counter() - begun:.0f} s in all"
    )
    return int(bool(kinds))


if __name__ == "__main__":
    sys.exit(main())
