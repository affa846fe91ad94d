"""What commands share: exit codes, options and words."""

import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from simrail.core.atomic_files import can_be_made
from simrail.core.errors import InputError, one_of

if TYPE_CHECKING:
    from simrail.recording.files.frame_file import Format

DONE, CELL_FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130

Scenario = Annotated[
    str, typer.Argument(metavar="NAME|FILE", help="A shipped scenario, or the path of a TOML file.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Replace a value, e.g. --set ride.speed_kmh=70. Repeatable."
    ),
]
Seed = Annotated[int | None, typer.Option("--seed", min=0, help="Replace the scenario's seed.")]
Form = Annotated[str, typer.Option("--format", metavar="csv|parquet", help="Form of the data files.")]


def finite(param: typer.CallbackParam, value: float | None) -> float | None:
    """Refuse an option that is no finite number; a range takes NaN for one within it.

    Raises
    ------
    typer.BadParameter
        If it is none.
    """
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"{value} is no finite number", param_hint=f"'{param.opts[0]}'")
    return value


def form_of(word: str) -> "Format":
    """The form of data files that a word stands for.

    Raises
    ------
    InputError
        If it stands for none.
    """
    one_of(word, ("csv", "parquet"), "no such format", field="--format")
    return cast("Format", word)


def say(message: str) -> None:
    """Tell the user, beside what a command prints."""
    print(message, file=sys.stderr)


def judge_out(out: Path | None) -> None:
    """Refuse a folder that cannot be made, before minutes are spent on what is to be written there.

    Raises
    ------
    InputError
        If it is a file, or cannot be written.
    """
    if out is None:
        return
    # Where one is already, files are written into it; else it has to be made.
    is_good = can_be_made(out) and (os.access(out, os.W_OK) if out.is_dir() else not out.exists())
    if not is_good:
        raise InputError(
            "the folder cannot be written",
            field="--out",
            value=str(out),
            limit="a folder that may be written to, by a name of at most 255 bytes",
            remedy="choose another folder with --out",
        )


def number(count: int, noun: str) -> str:
    """A count with its noun, in the plural where it belongs."""
    return f"{count} {noun}{'' if count == 1 else 's'}"
