"""What a page is made of: the campaign that it shows, and sections, each a title, a template and its data."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from simrail.campaign.cell import CellResult
from simrail.campaign.stored_results import StoredResults
from simrail.report.figures.views import Look, View, looks_of
from simrail.report.pages.rides import shown_styles, views_of
from simrail.report.tables.geometry import band_of_all
from simrail.report.tables.methods import MethodStyle, attitude_methods, method_styles
from simrail.report.tables.pivot import Case, cases, first_cases
from simrail.report.tables.question import Question, question_of
from simrail.scenario.build import bands_by_name
from simrail.scenario.cells import Method, methods
from simrail.scenario.scenario import Scenario
from simrail.scoring.ablations import ablation_count
from simrail.scoring.ride_figures import RIDE
from simrail.scoring.running_safety import DERAILMENT_LIMIT
from simrail.track.bands import Band


@dataclass(frozen=True)
class PageData:
    """A campaign as its page shows it.

    Attributes
    ----------
    scenario : Scenario
        What was run.
    scores : pandas.DataFrame
        The score table.
    cells : pandas.DataFrame
        One row per cell: labels and values of the axes.
    examples : sequence of CellResult
        Rides to draw, first draw of each.
    manifest : mapping
        What the campaign noted of itself: command, versions, times; plain values.
    beside : StoredResults, optional
        Results of another scenario of the same publication.
    budgets : pandas.DataFrame, optional
        What errors are made of (`simrail.campaign.budget.budgets_of`).
    stored_views : sequence of View, optional
        Rides as a page that was written has them, in place of examples.
    """

    scenario: Scenario
    scores: pd.DataFrame
    cells: pd.DataFrame
    examples: Sequence[CellResult]
    manifest: Mapping[str, Any]
    beside: StoredResults | None = None
    budgets: pd.DataFrame | None = None
    stored_views: Sequence[View] | None = None

    @cached_property
    def cases(self) -> list[Case]:
        """Scores by case, averaged over the draws; those of ablations last."""
        return sorted(cases(self.scores, self.cells), key=lambda case: ablation_count(case.labels))

    @cached_property
    def shown_cases(self) -> list[Case]:
        """Cases that have tables and figures of their own: of what a train has, if any is of that."""
        return first_cases(self.cases)

    @cached_property
    def methods(self) -> list[Method]:
        """Methods of the scenario."""
        return methods(self.scenario)

    @cached_property
    def styles(self) -> list[MethodStyle]:
        """How they look."""
        return list(method_styles(self.scenario).values())

    @cached_property
    def attitude_styles(self) -> list[MethodStyle]:
        """How those look that are told apart by their attitude."""
        found = {
            str(name) for name in self.scores.loc[self.scores["quantity"] == "roll", "estimator"].unique()
        }
        return [style for style in attitude_methods(self.styles) if style.name in found]

    @cached_property
    def question(self) -> Question | None:
        """The figure that the scenario asks for."""
        return question_of(
            self.scores, self.styles, attitude=self.attitude_styles, band=self.judged_band, known=self.bands
        )

    @property
    def asks_of_rails(self) -> bool:
        """Whether rails are what is asked for."""
        return self.question is not None and self.question.of_rails

    @cached_property
    def looks(self) -> dict[str, Look]:
        """Looks of all series over distance."""
        return looks_of(self.styles) | looks_of(self.kept_styles)

    @cached_property
    def kept_styles(self) -> list[MethodStyle]:
        """Methods that are kept of each ride."""
        case = next(iter(self.shown_cases), None)
        return shown_styles(self.styles, attitude=self.attitude_styles, question=self.question, case=case)

    @cached_property
    def views(self) -> list[View]:
        """Rides as the page shows them, the worst recording first."""
        if self.stored_views is not None:
            return list(self.stored_views)
        return views_of(
            self.examples,
            self.kept_styles,
            question=self.question,
            cells=self.cells,
            band=self.bands.get(self.judged_band),
        )

    @cached_property
    def leading(self) -> list[MethodStyle]:
        """The two best methods at what the scenario asks for, and the one without an IMU."""
        ranked = [style.name for style in self.question.ranked] if self.question else []
        tested = [style for style in self.kept_styles if not style.baseline]
        tested.sort(key=lambda style: ranked.index(style.name) if style.name in ranked else len(ranked))
        return tested[:2] + [style for style in self.attitude_styles if not style.uses_imu][:1]

    @cached_property
    def asks_of_ride(self) -> bool:
        """Whether the ride itself is what is asked for: it is scored, and no method under test is."""
        is_scored = bool((self.scores["estimator"] == RIDE).any())
        return is_scored and all(style.baseline for style in self.styles)

    @property
    def derailment_limit(self) -> float:
        """What Y/Q is held against."""
        safety = self.scenario.spec.running_safety
        return DERAILMENT_LIMIT if safety is None else safety.derailment_limit

    @cached_property
    def bands(self) -> dict[str, Band]:
        """Bands of the scenario by name."""
        return bands_by_name(self.scenario.spec)

    @cached_property
    def judged_band(self) -> str:
        """Band that most cases with rail geometry are judged in."""
        return band_of_all(self.cases)


@dataclass(frozen=True)
class Section:
    """A part of a page.

    Attributes
    ----------
    anchor, title : str
        How it is found and called.
    template : str
        What shows it.
    data : dict
        What the template shows.
    folded : bool
        Whether it is opened by a click.
    write_beside : callable, optional
        Writes files into the folder of the page.
    """

    anchor: str
    title: str
    template: str
    data: dict[str, Any]
    folded: bool = False
    write_beside: Callable[[Path], None] | None = None
