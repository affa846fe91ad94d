"""What publications printed, and our scores beside it: one folder each, see `simrail.report.papers.claim`."""

from collections.abc import Callable

from simrail.report.pages.section import PageData, Section
from simrail.report.papers.briales_2021 import section as briales
from simrail.report.papers.gonzalez_2023 import section as gonzalez
from simrail.report.papers.hidalgo import section as hidalgo
from simrail.report.papers.veillard_2016 import section as veillard

SECTIONS: dict[str, Callable[[PageData], list[Section]]] = {
    "briales_2021": briales.section,
    "gonzalez_2023": gonzalez.section,
    "hidalgo": hidalgo.section,
    "veillard_2016": veillard.section,
}
"""By the scenario's key ``paper``, what makes the section beside it."""
