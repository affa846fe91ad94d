"""What publications say, judged by our scores: the claims of every paper, in one form.

A paper is a folder beside this module, called by its authors and year. It holds

* ``paper.toml``, its data: what it printed, the parts that our methods play in it, the limits of its
  verdicts, and its claims in words (`Statement`);
* ``judges.py``, a short function per claim: numbers in; whether it holds, and what its sentence needs, out;
* ``section.py`` with ``section(data) -> list[Section]``, and its page ``section.html.j2``, which shows the
  claims by the macro ``claims`` of ``papers/claims.html.j2``.

To add one: write these files, name the section in `simrail.report.papers.SECTIONS`, and the paper in the key
``paper`` of `simrail.scenario.scenario`. Words are Jinja text: ``deg`` and ``mm`` write a number with three
digits, ``g`` as short as it is, ``listed`` joins words. They see what the judge returned, and ``limit``,
``printed``, ``figures``, ``words`` and ``label`` of the paper. A verdict is computed, never written down
beforehand.
"""

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from types import ModuleType
from typing import Any, Literal

from jinja2 import Environment, StrictUndefined

from simrail.core.errors import joined
from simrail.core.toml_files import Part
from simrail.report.words.ablations import WORDS as ABLATION_WORDS
from simrail.report.words.sentences import FILTERS
from simrail.scenario.cells import Method
from simrail.scoring.ablations import Ablation

Verdict = Literal["reproduced", "not reproduced", "not asked"]

WORDS: dict[Verdict, tuple[str, str]] = {
    "reproduced": ("good", "Reproduces."),
    "not reproduced": ("bad", "Does not reproduce."),
    "not asked": ("note", "Not asked."),
}
"""How the page marks a verdict, and says it."""

_ENVIRONMENT = Environment(undefined=StrictUndefined)
_ENVIRONMENT.filters |= FILTERS


class Role(Part):
    """What a method can stand for: its label, the row of printed figures beside it, and its colour."""

    label: str
    row: str = ""
    colour: str = ""


class Statement(Part):
    """A claim in words.

    Attributes
    ----------
    key : str
        Short name.
    judge : str
        Function that judges it; the key if not given.
    needs : tuple of str
        Parts that it speaks of: without them it is not asked.
    says, printed : str
        What the paper says, and where; its figures.
    ours, rule, cause : str
        Our figures, in the words of the judge (`Paper.words`) if not given; what the verdict follows from;
        why it falls, or what else the figures show.
    unasked : str
        Why it is not asked where the judge has nothing to go by.
    """

    key: str
    says: str
    rule: str
    ours: str = ""
    judge: str = ""
    needs: tuple[str, ...] = ()
    printed: str = ""
    cause: str = ""
    unasked: str = "Not run here."


class Paper(Part):
    """A publication: how it is called, the parts that methods play, its figures, limits and claims."""

    heading: str
    reference: str
    parts: dict[str, Role]
    printed: dict[str, tuple[tuple[float, ...], ...]]
    figures: dict[str, tuple[float, ...]]
    limits: dict[str, float]
    words: dict[str, str]
    claims: tuple[Statement, ...]

    def names(self, methods: Sequence[Method]) -> dict[str, str]:
        """By part, the first method that plays it, as the scenario says (``stands_for``)."""
        names: dict[str, str] = {}
        for method in methods:
            if method.part.stands_for in self.parts:
                names.setdefault(str(method.part.stands_for), method.name)
        return names

    def label(self, part: str) -> str:
        """How a part is called."""
        return self.parts[part].label

    def written(self, text: str, **values: Any) -> str:
        """Words of the paper, filled with its own data and with some values."""
        own = {"limit": self.limits, "printed": self.printed, "figures": self.figures, "words": self.words}
        label = {part: role.label for part, role in self.parts.items()}
        return joined(_ENVIRONMENT.from_string(text).render(own, label=label, **values))


def read_paper(name: str) -> Paper:
    """Read the data of a paper, ``papers/<name>/paper.toml``."""
    text = files("simrail.report.papers").joinpath(name, "paper.toml").read_text(encoding="utf-8")
    return Paper.model_validate(tomllib.loads(text), strict=False)


@dataclass(frozen=True)
class Claim:
    """A claim with its verdict: what the paper says and printed, our figures, the rule, and the cause.

    ``ablated`` is what became of it in ablations that were run, where that differs: begin of a sentence and
    figures of each.
    """

    key: str
    says: str
    printed: str
    ours: str
    rule: str
    verdict: Verdict
    cause: str = ""
    ablated: tuple[tuple[str, str], ...] = ()

    @property
    def tone(self) -> str:
        """How the page marks it."""
        return WORDS[self.verdict][0]

    @property
    def words(self) -> str:
        """The verdict as the page says it."""
        return WORDS[self.verdict][1]


Judgement = tuple[bool, Mapping[str, Any]]
"""Whether a claim holds, and the numbers that its words need."""


def judged(paper: Paper, evidence: object, judges: ModuleType, *, has: Callable[[str], bool]) -> list[Claim]:
    """Judge all claims of a paper, in its order.

    Parameters
    ----------
    paper : Paper
        Its data.
    evidence : object
        Our figures, as the judges of the paper take them.
    judges : module
        Functions of the evidence and of the parts that a claim needs, called as their claims or as
        `Statement.judge`, which return a `Judgement`, or None where there is nothing to judge by.
    has : callable
        Whether a part was run, and has figures throughout.
    """
    claims = []
    for one in paper.claims:
        says, printed, rule = (paper.written(text) for text in (one.says, one.printed, one.rule))
        missing = [paper.label(part) for part in one.needs if not has(part)]
        judge = one.judge or one.key
        judgement: Judgement | None = None if missing else getattr(judges, judge)(evidence, one.needs)
        if judgement is None:
            why = f"Not run: {', '.join(missing)}." if missing else one.unasked
            claims.append(Claim(one.key, says, printed, why, rule, "not asked"))
            continue
        holds, values = judgement
        verdict: Verdict = "reproduced" if holds else "not reproduced"
        ours, cause = (paper.written(text, **values) for text in (one.ours or paper.words[judge], one.cause))
        claims.append(Claim(one.key, says, printed, ours, rule, verdict, cause))
    return claims


def title_of(paper: Paper, claims: Sequence[Claim]) -> str:
    """Title of the section beside a paper, which is folded: it says how many claims were reproduced."""
    asked = [claim.verdict for claim in claims if claim.verdict != "not asked"]
    count = f": {asked.count('reproduced')} of {len(asked)} claims reproduced" if asked else ""
    return f"Beside {paper.heading}{count}"


def with_ablation(claims: Sequence[Claim], of_twins: Sequence[Claim], ablation: Ablation) -> list[Claim]:
    """Claims that say what became of them in an ablation: figures, and verdict if another.

    Parameters
    ----------
    claims : sequence of Claim
        Judged of what a train has.
    of_twins : sequence of Claim
        The same, judged of the ablation.
    ablation : Ablation
        What is taken away.
    """
    result = []
    for own, other in zip(claims, of_twins, strict=True):
        is_told = own.ours != other.ours and "not asked" not in (own.verdict, other.verdict)
        verdict = f"{other.words} " if other.verdict != own.verdict else ""
        told = (f"{ABLATION_WORDS[ablation].phrase} (ablation)", f"{verdict}{other.ours}")
        result.append(replace(own, ablated=(*own.ablated, told)) if is_told else own)
    return result
