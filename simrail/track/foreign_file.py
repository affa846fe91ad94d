"""A design from a file of another program: by its ending LandXML, IFC 4.3 or a table of curvature."""

from __future__ import annotations

from pathlib import Path

from simrail.core.errors import InputError
from simrail.core.toml_files import blame, label
from simrail.track.curvature_csv import read_curvature_csv
from simrail.track.design import TrackDesign
from simrail.track.drawn import drawn_design
from simrail.track.ifc import read_ifc
from simrail.track.landxml import read_landxml
from simrail.track.read_figures import figures_of

LANDXML, IFC, TABLES = (".xml", ".landxml"), (".ifc",), (".csv", ".txt", ".tsv")


def design_from_file(
    path: Path, *, alignment: str | None = None, step_smoothing_m: float | None = None
) -> tuple[TrackDesign, list[str]]:
    """The design that a file describes, and what is to be told of it.

    Parameters
    ----------
    path : Path
        LandXML, IFC 4.3 or a table, by its ending.
    alignment : str, optional
        Name of the alignment, for a file with several.
    step_smoothing_m : float, optional
        As in `simrail.track.drawn.drawn_design`.

    Raises
    ------
    InputError
        If there is no such file, or it describes no line, or one that no railway has.
    """
    ending = path.suffix.lower()
    if ending not in LANDXML + IFC + TABLES:
        raise InputError(
            "is of no kind that is read",
            field="--from",
            value=str(path),
            limit="LandXML (.xml), IFC 4.3 (.ifc) or a table of curvature over distance (.csv)",
            remedy="export it as one of these",
        )
    if not path.is_file():
        raise InputError("there is no such file", field="--from", value=str(path), limit="a file that exists")
    if alignment is not None and ending in TABLES:
        raise InputError(
            "belongs to LandXML and IFC: a table has one line",
            field="--alignment",
            value=alignment,
            limit="only with a LandXML or IFC file",
        )
    with blame(label(path)):
        if ending in TABLES:
            drawn = read_curvature_csv(path)
        else:
            drawn = (read_landxml if ending in LANDXML else read_ifc)(path, alignment=alignment)
        figures = figures_of(drawn)
        return drawn_design(drawn, step_smoothing_m=step_smoothing_m), [*drawn.notes, *figures]
