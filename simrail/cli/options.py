"""What commands share: exit codes, options and words."""

import sys
from typing import Annotated

import typer

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


def say(message: str) -> None:
    """Tell the user, beside what a command prints."""
    print(message, file=sys.stderr)


def number(count: int, noun: str) -> str:
    """A count with its noun, in the plural where it belongs."""
    return f"{count} {noun}{'' if count == 1 else 's'}"
