"""What an ablation is called: in titles, along an axis, in the heads of a comparison, and in sentences."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from simrail.scoring.ablations import ABLATIONS, MAP, VIBRATION, Ablation


class AblationWords(NamedTuple):
    """Words of one ablation.

    Attributes
    ----------
    title : (str, str)
        In a title: what a train has, and the ablation.
    value : (str, str)
        The same as values of an axis.
    heads : (str, str)
        The same as columns of a comparison.
    short : (str, str)
        The same as columns of a narrow table.
    cost : str
        Title of the comparison.
    legend : str
        What is compared, for the page.
    note : str
        What the columns of the narrow table are.
    phrase : str
        Begin of a sentence about the ablation.
    """

    title: tuple[str, str]
    value: tuple[str, str]
    heads: tuple[str, str]
    short: tuple[str, str]
    cost: str
    legend: str
    note: str
    phrase: str


WORDS = {
    MAP: AblationWords(
        title=("a map with errors", "an exact map (ablation)"),
        value=("the map errs", "exact (ablation)"),
        heads=("the map errs", "exact"),
        short=("errs", "exact"),
        cost="What the map costs",
        legend="Estimators get a map of the line, never the rails. Here it errs as drawn by the scenario's "
        "[map], in cant, radii, joints and gradients; beside it stands an exact one, an ablation that no "
        "train has.",
        note="errs: the map differs from what was laid; exact: it does not, an ablation",
        phrase="With an exact map",
    ),
    VIBRATION: AblationWords(
        title=("with vibration", "without vibration (ablation)"),
        value=("on", "off (ablation)"),
        heads=("with vibration", "without"),
        short=("with", "without"),
        cost="What vibration costs",
        legend="The vehicle is shaken by what the scenario's [vibration] says, beside the long waves of the "
        "rails; beside it stands the same ride over the same rails without, an ablation that no train has.",
        note="with: shaken by [vibration] as well; without: by the long waves of the rails only, an ablation",
        phrase="Without vibration",
    ),
}


def state_words(labels: Mapping[Any, object], *, comma: str = " \u00b7 ") -> str:
    """What a train has of a cell or a case, and what is taken away from it, for titles."""
    return comma.join(value_words(one, labels[one.column], title=True) for one in ABLATIONS)


def value_words(ablation: Ablation, value: object, *, title: bool = False) -> str:
    """One value of an ablation's column, for an axis or for a title."""
    words = WORDS[ablation]
    return (words.title if title else words.value)[value == ablation.ablated]
