"""Tables of a scenario about what is asked of whom: ``[[estimator]]``, ``[monte_carlo]``, ``[[require]]``."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part
from simrail.scenario.designs import DESIGNS
from simrail.scenario.fields import Draws, Name
from simrail.scoring.requirement import Requirement, limit_of

TimeLimit = Annotated[float, Field(ge=0.01, le=86400.0)]


MemoryLimit = Annotated[float, Field(ge=64.0, le=1e6)]


class EstimatorPart(Part):
    """``[[estimator]]``: a method under a name, with the keyword arguments of its class.

    ``stands_for`` says which row of the paper's table it is set beside, by the words of the page of that
    paper (`simrail.report.papers`). ``time_limit_s`` is how long it may take for a recording; it is then
    ended, and its row says so. Without one, nothing ends it. ``memory_limit_mb`` is how much memory it may
    take beside that of the process that it is a copy of; what it compiles counts.
    """

    name: Name
    """Name of the method in tables."""
    method: str
    """Its class by name, or FILE.py:CLASS for one of your own."""
    time_limit_s: TimeLimit | None = None
    """Longest time for a recording, s, in place of the scenario's."""
    memory_limit_mb: MemoryLimit | None = None
    """Most memory that it may take, MB, in place of the scenario's; on Linux."""
    stands_for: Name | None = None
    """The row of the paper's table that it is set beside."""
    options: dict[str, Any] = Field(default_factory=dict)
    """Arguments of the class; a list of one makes an axis."""


class MonteCarloPart(Part):
    """``[monte_carlo]``: how often chance is asked.

    Each of the ``samples`` draws a value from every distribution of the scenario, jointly by ``method``,
    and has draws of its own: ``track_draws`` lay the rails anew, each ride over them is made with
    ``map_draws`` draws of the map, and recorded with ``sensor_draws`` draws of the sensors.
    Without a distribution there is one sample.

    ``"morris"`` and ``"saltelli"`` are the designs of a sensitivity analysis (`simrail.scenario.designs`),
    whose samples come in blocks: ``samples`` is then the number of trajectories, or of blocks, and all of
    them share their draws.
    """

    samples: Draws = 1
    """How many values each distribution of the scenario draws, all of them jointly."""
    method: Literal["latin_hypercube", "sobol", "morris", "saltelli"] = "latin_hypercube"
    """How they fill the space: Latin hypercube, Sobol points, or the design of a sensitivity analysis."""
    track_draws: Draws = 1
    """How often the rails are laid anew, for each sample."""
    map_draws: Draws = 1
    """How many maps are drawn for each laying of the rails."""
    sensor_draws: Draws = 1
    """How many devices record each ride."""

    @model_validator(mode="after")
    def _fills_the_space(self) -> MonteCarloPart:
        if self.method in ("sobol", "saltelli") and self.samples & (self.samples - 1):
            raise InputError(
                "Sobol points are balanced in powers of two only",
                field="samples",
                value=self.samples,
                limit="1, 2, 4, 8, ...",
                remedy=f"take {1 << self.samples.bit_length()}"
                + (", or the method latin_hypercube" if self.method == "sobol" else ""),
            )
        if self.method in DESIGNS and self.samples < 2:
            raise InputError(
                "is too few for indices with intervals",
                field="samples",
                value=self.samples,
                limit=">= 2 trajectories, or blocks",
                remedy="take some 10 trajectories of morris, or 256 blocks of saltelli",
            )
        return self


class RequirePart(Part):
    """``[[require]]``: what is asked of an IMU: a figure below a limit, on a share of the devices.

    A device is one draw of the errors that stay with a sensor. ``limit`` has a unit (``"0.1 deg"``; a bare
    number is in that of the score table). With ``over = "all"`` a device must meet it on every ride of the
    scenario, with ``"each"`` every kind of ride has a verdict of its own. ``chance`` is that of a false
    verdict. See `simrail.scoring.verdicts`. ``budget_draws`` is over how many draws it is found out which
    terms of the sheets the error is made of (`simrail.campaign.budget`); 0 for not at all. That is found out
    at ``"each"`` mount, or for each IMU at the one where it is ``"worst"``.
    """

    quantity: str
    """What is asked for, e.g. roll or alignment."""
    limit: float | str
    """The figure that it must stay below, with its unit, e.g. 0.1 deg."""
    metric: Literal["rms", "sd", "p95", "p9985", "max"] = "rms"
    """Which figure of the error: rms, p95 or max."""
    band: str = "full"
    """Wavelength band, for rails."""
    window: str = "whole"
    """Stretch of the line that counts."""
    reference: Literal["truth", "design"] = "truth"
    """What the error is held against; the truth if left out."""
    share: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95
    """Share of devices that must meet it."""
    over: Literal["all", "each"] = "all"
    """all: a device must meet it on every ride; each: every kind of ride has a verdict of its own."""
    chance: Annotated[float, Field(ge=1e-4, le=0.2)] = 0.05
    """Chance of a false verdict that is accepted."""
    budget_draws: Annotated[int, Field(ge=0, le=1000)] = 0
    """Over how many draws it is found out what the error is made of; 0 for not at all."""
    budget_at: Literal["each", "worst"] = "each"
    """Of each IMU at each mount, or at the one where its devices are worst."""

    def requirement(self) -> Requirement:
        """The requirement, in the unit of the score table."""
        own = self.model_dump(exclude={"budget_draws", "budget_at"})
        return Requirement(**own | {"limit": limit_of(self.limit, self.quantity)})


class StopRulePart(Part):
    """``[stop]``: draw no more once chance would change little.

    Either ``verdicts = true``: once every ``[[require]]`` is settled for every IMU and method; what is
    settled before is drawn no more (`simrail.scenario.requirements`). Or once the 95 % interval of a mean is
    narrower than ``width``, in every case: the mean over the draws of one figure of the score table, in its
    unit there (`simrail.scenario.stop_rule`).
    """

    estimator: str = ""
    """Method whose mean is waited for."""
    quantity: str = ""
    """Its quantity."""
    metric: str = ""
    """Its figure."""
    width: Annotated[float, Field(gt=0.0)] = math.inf
    """Width of the 95 % interval of the mean that is narrow enough, in the unit of the score table."""
    window: str = "whole"
    """Stretch of the line that counts."""
    reference: Literal["truth", "design"] = "truth"
    """What the error is held against."""
    band: str = "full"
    """Wavelength band, for rails."""
    least_draws: Annotated[int, Field(ge=2, le=1_000_000)] = 10
    """Draws that are made in any case."""
    verdicts: bool = False
    """True: draw until every [[require]] is settled."""

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        for name in ("estimator", "quantity", "metric", "width"):
            given = name in self.model_fields_set
            if given == self.verdicts:
                raise InputError(
                    "goes with an interval, verdicts have none" if given else "is missing",
                    field=name,
                    value=getattr(self, name) if given else None,
                    limit="estimator, quantity, metric and width; or verdicts = true alone",
                    remedy=f"take out {name}, or verdicts" if given else f"add {name}, or verdicts = true",
                )
        return self
