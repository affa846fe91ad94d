"""What publications printed, and our scores beside it: one folder each, see `simrail.report.papers.claim`."""

from __future__ import annotations

from collections.abc import Callable

from simrail.report.pages.section import PageData, Section
from simrail.report.papers.briales_2021.section import section as briales_2021
from simrail.report.papers.gonzalez_2023.section import section as gonzalez_2023

SECTIONS: dict[str, Callable[[PageData], list[Section]]] = {
    "briales_2021": briales_2021,
    "gonzalez_2023": gonzalez_2023,
}
"""By the scenario's key ``paper``, what makes the section beside it."""
