"""Our versions of the paper's Figs. A1 to A3, from the rides that a page draws."""

from dataclasses import replace
from functools import partial

from simrail.campaign.cell import CellResult
from simrail.report.figures import canvas
from simrail.report.figures.geometry import has_rails, rails_figure, stretch_of, stretch_words
from simrail.report.papers.gonzalez_2023.parts import PAPER, Rows
from simrail.report.tables.methods import MethodStyle
from simrail.report.words.sentences import listed
from simrail.track.bands import Band

DRAWN_M = 300.0
"""Stretch that is drawn: of a model's ride, all."""


def tuning_figures(
    looks: dict[str, MethodStyle], example: CellResult, band: Band
) -> list[tuple[str, canvas.Drawing]]:
    """Our versions of Figs. A1 and A3, of parts whose methods say what the rails look like."""
    first = [looks[part] for part in ("cml", "kom", "hand") if part in looks]
    if not first:
        return []
    limits = stretch_of(example, first[0].name, band=band, length_m=DRAWN_M)
    has_draws = example.estimates[first[0].name].geometry_draws is not None
    how = "which follows from draws of its error" if has_draws else "that of unfiltered rails"
    texts = (
        f"As Fig. A1: rails over {stretch_words(example, limits)} {example.recording.name}, filtered, as "
        f"{listed([style.label for style in first])} find{'s' * (len(first) == 1)} them.",
        f"As Fig. A3: the same, with the 95 % interval of {first[0].label}, {how}.",
    )
    shown = zip(("a1", "a3"), texts, (first, first[:1]), (False, True), strict=True)
    return [
        (
            text,
            canvas.drawn(
                f"paper-{name}",
                partial(
                    rails_figure,
                    example,
                    drawn,
                    band=band,
                    limits=limits,
                    with_interval=with_interval,
                    what=text,
                ),
            ),
        )
        for name, text, drawn, with_interval in shown
    ]


def noise_figure(
    rows: Rows, looks: dict[str, MethodStyle], example: CellResult, noisy: CellResult, band: Band
) -> list[tuple[str, canvas.Drawing]]:
    """Our version of Fig. A2: CML without and with noise added to the IMU; [] where one is missing."""
    quiet, loud = looks.get("cml"), looks.get(rows.played_by("cml_noise"))
    if quiet is None or loud is None or not (has_rails(example, quiet) and has_rails(noisy, loud)):
        return []
    # The two are of two recordings: for one figure, the second goes beside the first under its own name.
    role = PAPER.parts["cml_noise"]
    added = replace(loud, name="noise added", label=role.label, colour=role.colour)
    estimates = {quiet.name: example.estimates[quiet.name], added.name: noisy.estimates[loud.name]}
    limits = stretch_of(example, quiet.name, band=band, length_m=DRAWN_M)
    text = (
        f"As Fig. A2: rails over {stretch_words(example, limits)} {example.recording.name}, filtered, by CML "
        "without and with noise added."
    )
    both = replace(example, estimates=estimates)
    make = partial(
        rails_figure, both, [quiet, added], band=band, limits=limits, with_interval=False, what=text
    )
    return [(text, canvas.drawn("paper-a2", make))]
