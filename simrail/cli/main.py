"""The command line: what runs scenarios and rides, and what shows or makes parts.

Exit codes: 0 done, 1 a cell failed, 2 bad input (one message, no traceback), 130 interrupted. Heavy
imports stand inside the commands, so that those that need little answer at once.
"""

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from simrail.cli.figure import figure
from simrail.cli.grade import grade
from simrail.cli.library import cache, imu, list_parts, new, vehicle
from simrail.cli.options import BAD_INPUT, CELL_FAILED, DONE, INTERRUPTED, say
from simrail.cli.rides import estimate, export
from simrail.cli.run import check, run
from simrail.cli.sensitivity import sensitivity
from simrail.cli.spectra import spectra
from simrail.cli.tune import tune
from simrail.core.errors import InputError

app = typer.Typer(
    name="simrail",
    help="A testbed for inertial sensors on trains: simulate a ride, record it, estimate, score.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

# typer carries its own copy of click, or not, as its version has it: find the class that it raises.
UsageFault: type[Any] = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")


def main() -> None:
    """Entry point of the command ``simrail``."""
    sys.exit(call(sys.argv[1:]))


def call(arguments: list[str]) -> int:
    """Run the command line and return its exit code."""
    try:
        code = app(arguments, standalone_mode=False)
    except InputError as error:
        say(f"simrail: {error}")
        return BAD_INPUT
    except UsageFault as error:
        error.show()
        return BAD_INPUT
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED  # newer versions of typer return this code by themselves
    except OSError as error:
        place = f" ({Path(str(error.filename)).name})" if error.filename else ""
        say(
            f"simrail: {error.strerror or error}{place}; former results are as they were, "
            "and a run goes on from where it was"
        )
        return CELL_FAILED
    if code == INTERRUPTED:
        say("simrail: interrupted; former results are as they were, and a run goes on from where it was")
    return int(code or DONE)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"simrail {version('simrail')}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


for _command in (
    run,
    check,
    figure,
    grade,
    export,
    estimate,
    tune,
    sensitivity,
    spectra,
    vehicle,
    imu,
    new,
    cache,
):
    app.command()(_command)
app.command(name="list")(list_parts)
