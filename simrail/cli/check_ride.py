"""``simrail check ride.toml``: what a recorded ride says of itself, as a table, and set right on request."""

from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from simrail.cli.options import DONE, number
from simrail.core.errors import InputError
from simrail.core.toml_files import label, read_toml
from simrail.estimation.recorded_ride import judged_ride
from simrail.recording.doubts import doubts
from simrail.recording.evidence.devices import weigh_all
from simrail.recording.evidence.judge import Evidence
from simrail.recording.files.mend import write_mended
from simrail.recording.files.ride_reader import RIDE_FILE, read_signals, ride_file

MOST_LETTERS = 200
"""Of a name; a longer one is no file that there is."""

WIDEST = 110
"""Characters of a line that the table keeps to."""


def is_ride(name: str) -> bool:
    """Whether a name means a ride file, or the folder of one, and no scenario."""
    path = Path(name)
    if len(name) > MOST_LETTERS or not path.exists():
        return False  # a scenario by its name, or one that there is not
    if path.is_dir():
        return (path / RIDE_FILE).is_file()
    if path.suffix != ".toml" or not path.is_file():
        return False
    # A scenario has any number of [[imu]]; a ride has the one that was recorded.
    return isinstance(read_toml(path).get("imu"), dict)


def check_ride(path: Path, write: Path | None) -> int:
    """Print what a ride says of itself; refuse it for what is surely wrong, or write it set right.

    Raises
    ------
    InputError
        If the ride cannot be read, or something is surely wrong and it is not to be written.
    """
    console = Console(width=WIDEST)
    recording = read_signals(path)
    evidence = weigh_all(recording)
    print_evidence(console, evidence, title=f"{label(ride_file(path))}: {recording.name}")
    for note in recording.notes:
        console.print(f"note: {note}", markup=False, soft_wrap=True)
    told = doubts(recording)
    for warning in told:
        console.print(f"warning: {warning}", markup=False, soft_wrap=True)
    if write is None:
        judged_ride(path)
        fine = "fine, but for the warnings" if told else "fine"
        console.print(f"{recording.name}: {fine if not evidence.wrong else 'likely wrong in part'}")
        return DONE
    if not evidence.wrong:
        judged_ride(path)
        console.print(f"{recording.name}: fine; nothing is to be mended, and {write} was not written")
        console.print(f"next: simrail estimate {path}")
        return DONE
    changes = write_mended(path, evidence, write)
    console.print(f"wrote {write}, with {number(len(changes), 'setting')} changed; comments are not kept:")
    for change in changes:
        console.print(f"  {change}")
    _, again = judged_ride(write)
    left = ", ".join(finding.name for finding in again.wrong)
    console.print(f"as mended: {f'still likely wrong: {left}' if left else 'nothing wrong'}")
    console.print(f"next: simrail estimate {write}")
    return DONE


def print_evidence(console: Console, evidence: Evidence, *, title: str) -> None:
    """Print the findings as a table."""
    table = Table(title=title, box=box.SIMPLE_HEAD, title_justify="left")
    for heading in ("quantity", "found", "should be", "rests on", "verdict"):
        table.add_column(heading, overflow="fold")
    for finding in evidence.findings:
        judged = finding.verdict != "could not be judged"
        unit = "" if finding.unit == "1" else f" {finding.unit}"
        table.add_row(
            finding.name,
            finding.shown if judged else "",
            f"{finding.nominal:g}{unit}" if judged else "",
            finding.rests_on,
            finding.verdict if judged else f"{finding.verdict}: {finding.why}",
        )
    console.print(table)
    for finding in evidence.wrong:
        mended = (
            f" ({finding.setting} mends it)"
            if finding.setting
            else f" ({finding.remedy})" * bool(finding.remedy)
        )
        console.print(f"{finding.verdict}: {finding.why}{mended}", soft_wrap=True)


def refuse_ride_option(option: str) -> None:
    """Refuse an option that says nothing to a recorded ride."""
    raise InputError(
        "is for scenarios, not for recorded rides",
        field=option,
        limit="only for scenarios",
        remedy="leave it out",
    )
