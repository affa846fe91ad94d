"""``simrail imu --from-rest``: the sheet of a device from a recording of it at rest."""

from pathlib import Path

from rich.console import Console

from simrail.cli.options import DONE
from simrail.core.atomic_files import write_whole
from simrail.core.toml_files import blame, judge, label, parse_toml
from simrail.recording.files.rest_file import read_rest
from simrail.recording.sheets.imu_file import ImuFile
from simrail.recording.sheets.rest_fit import fit_rest
from simrail.recording.sheets.rest_sheet import fitted_lines, sheet_text
from simrail.report.pages.imu_page import write_imu_page
from simrail.report.tables.imu_text import print_imu


def imu_from_rest(path: Path, out: Path | None) -> int:
    """Fit, print, and write ``<out>/<name>.toml`` and its page.

    Raises
    ------
    InputError
        If the recording cannot be read, is too short or is not at rest; nothing is written then.
    """
    imu, rate_hz = read_rest(path)
    seconds = len(imu) / rate_hz
    with blame(label(path)):
        fits = fit_rest(imu, rate_hz)
    name = path.stem if path.stem != "ride" else path.absolute().parent.name
    name = f"{name}_fitted"
    text = sheet_text(
        fits,
        title=f"Fitted to {path.name} at rest",
        source=f"Allan deviation of {path.name}, {seconds:.5g} s at {rate_hz:g} Hz, by simrail imu "
        "--from-rest",
        rate_hz=rate_hz,
        seconds=seconds,
    )
    file = judge(ImuFile, parse_toml(text, file=f"{name}.toml"), file=f"{name}.toml")
    grade = file.grade(name)
    print_imu(Console(), file, grade)
    for line in fitted_lines(fits, seconds):
        print(line)
    if out is not None:
        page = write_imu_page(out, file, grade, rest=imu)
        sheet = write_whole(out / f"{name}.toml", text.encode(), what="sheet")
        print(f"wrote {sheet} and {page}")
    return DONE
