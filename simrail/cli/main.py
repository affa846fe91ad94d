"""The command line: what runs scenarios and rides, and what shows or makes parts.

Exit codes: 0 done, 1 a cell failed, 2 bad input (one message, no traceback), 130 interrupted. Heavy
imports stand inside the commands, so that those that need little answer at once.
"""

import builtins
import io
import os
import sys
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer

from simrail.cli.estimate import estimate
from simrail.cli.examples import below
from simrail.cli.figure import figure
from simrail.cli.film import film
from simrail.cli.grade import grade
from simrail.cli.lesson import lesson
from simrail.cli.library import cache, imu, list_parts, new, open_page, vehicle
from simrail.cli.options import BAD_INPUT, CELL_FAILED, DONE, INTERRUPTED, say
from simrail.cli.rides import export
from simrail.cli.run import check, run
from simrail.cli.schema import schema
from simrail.cli.sensitivity import sensitivity
from simrail.cli.spectra import spectra
from simrail.cli.tune import tune
from simrail.core.errors import MOST_SHOWN, InputError, joined, one_line

app = typer.Typer(
    name="simrail",
    help="A testbed for inertial sensors on trains: simulate a ride, record it, estimate, score.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

# typer carries its own copy of click, or not, as its version has it: find the class that it raises.
UsageFault: type[Any] = next(kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException")


def main() -> None:
    """Entry point of the command ``simrail``."""
    if not sys.warnoptions:  # what numbers do on the way to a refusal is nothing that its reader can mend
        for kind in ("RuntimeWarning", "FutureWarning"):
            warnings.filterwarnings("ignore", category=getattr(builtins, kind))
        os.environ.setdefault("PYTHONWARNINGS", "ignore::RuntimeWarning,ignore::FutureWarning")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal that lacks a letter shows its code
            stream.reconfigure(errors="backslashreplace")
    sys.exit(call(sys.argv[1:]))


def call(arguments: list[str]) -> int:
    """Run the command line and return its exit code."""
    try:
        code = app(arguments, standalone_mode=False)
    except InputError as error:
        say(f"simrail: {error}")
        return BAD_INPUT
    except UsageFault as error:
        _say_usage(error, arguments)
        return BAD_INPUT
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED  # newer versions of typer return this code by themselves
    except OSError as error:
        place = f" ({Path(str(error.filename)).name})" if error.filename else ""
        words = one_line(f"{error.strerror or error}{place}", MOST_SHOWN)
        say(f"simrail: {words}; former results are as they were, and a run goes on from where it was")
        return CELL_FAILED
    if code == INTERRUPTED:
        say("simrail: interrupted; former results are as they were, and a run goes on from where it was")
    return int(code or DONE)


def _say_usage(error: Any, arguments: list[str]) -> None:
    """Tell of words that are no command line, in one line; without any word, the help."""
    context = getattr(error, "ctx", None)
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()
        return
    if context is not None:
        command = "simrail" if context.parent is None else f"simrail {context.info_name}"
    else:  # an option at the end of the line, without its value
        command = " ".join(["simrail", *arguments[:1]])
    remedy = f"see '{command} --help'"
    text = joined(error.format_message()).rstrip(".")
    parameter: Any = getattr(error, "param", None)
    given = None if parameter is None else _given(parameter, arguments)
    if given is not None:
        # As typer says it: "Invalid value for '--seed': Input should be a valid integer, unable to parse ..."
        limit = text.rpartition("': ")[2].removeprefix("Input should be ").partition(", unable")[0]
        option, problem = parameter.opts[0], "takes no such value"
        say(f"simrail: {InputError(problem, field=option, value=given, limit=limit, remedy=remedy)}")
        return
    say(f"simrail: {one_line(text, 2 * MOST_SHOWN)}; limit: what the help lists; remedy: {remedy}")


def _given(parameter: Any, arguments: list[str]) -> str | None:
    """What a command line has for an option, the last time; None if it has none."""
    given = None
    for place, word in enumerate(arguments):
        for name in (*parameter.opts, *parameter.secondary_opts):
            if word == name:
                given = " ".join(arguments[place + 1 : place + 1 + parameter.nargs])
            elif name.startswith("--") and word.startswith(f"{name}="):
                given = word.partition("=")[2]
    return given


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
    *(run, check, grade, export, estimate, tune, sensitivity, spectra),
    *(figure, film, lesson, vehicle, imu, new, schema, cache),
):
    app.command(epilog=below(_command.__name__))(_command)
app.command(name="list", epilog=below("list"))(list_parts)
app.command(name="open", epilog=below("open"))(open_page)
