"""First section of a page without requirements: its answer in a sentence, a chart and three tiles."""

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from simrail.report.figures import canvas
from simrail.report.pages.section import PageData, Section
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.question import Question
from simrail.report.tables.running import running_tiles
from simrail.report.tables.tiles import Tile
from simrail.report.words.sentences import listed, significant

MOST_SLOTS = 12
"""IMUs and mounts that are drawn, and named in the sentence; ``scores.csv`` holds all."""

MOST_METHODS = 6
"""Methods that are drawn: the best of those under test, then baselines, in the scenario's order."""

MOST_DOTS = 60
"""Recordings that are drawn of a method at an IMU, evenly by rank."""

FEW = 12
"""So many dots are drawn as marks, hollow for a baseline; more are small, and smaller for a baseline."""

DOT = 0.003
"""Half the length of the stroke that a dot is, in slots: what has no length would not be drawn."""

MOST_NAMED = 4

_WINDOWS = ("straight", "transition", "curve", "whole")


def answer_section(data: PageData) -> list[Section]:
    """Make the section; none where requirements have their own, or nothing was scored."""
    if data.asks_of_ride:
        tiles = running_tiles(data.shown_cases[0], derailment_limit=data.derailment_limit)
        sentence = "; ".join(f"{tile.title} {tile.value} ({tile.note})" for tile in tiles[:3])
        if not tiles:
            return []
        if len(data.shown_cases) > 1:
            sentence = f"{data.shown_cases[0].labels['ride']}: {sentence}"
        return [_section(f"{sentence}.", tiles[:3], canvas.Drawing(), "")]
    question = data.question
    if question is None or not question.ranked:
        return []
    sentence = answer_sentence(question)
    chart = canvas.drawn("answer", lambda: answer_chart(question, what=sentence))
    recordings = question.judged["cell"].nunique()
    many = f"A dot for each of {recordings:,} recordings" if recordings > 1 else "One recording"
    ranked = ", at most 60 of a method by rank" if recordings > MOST_DOTS else ""
    caption = f"{question.words[:1].upper()}{question.words[1:]}. {many}{ranked}"
    methods = drawn_methods(question)
    if len(methods) < len(question.ranked):
        caption += f", by the best {len(methods)} of {len(question.ranked)} methods under test"
    if any(style.baseline for style in methods):
        caption += "; hollow or small: baselines"
    caption += "; dashed: no IMU at all." if question.without else "."
    return [_section(sentence, answer_tiles(question), chart, caption)]


def _section(sentence: str, tiles: Sequence[Tile], chart: canvas.Drawing, caption: str) -> Section:
    shown = {"sentence": sentence, "tiles": tiles, "chart": chart, "caption": caption}
    return Section("answer", "Answer", "pages/sections/answer.html.j2", shown)


def answer_sentence(question: Question) -> str:
    """What is best with an IMU, and whether no IMU at all beats it."""
    best, floor = question.ranked[0], question.without
    medians = {slot: v for slot, v in question.medians(best).items() if slot in question.real}
    zero = question.medians(floor) if floor else {}
    lowest, highest = min(medians, key=lambda s: medians[s]), max(medians, key=lambda s: medians[s])
    head = f"{question.words[:1].upper()}{question.words[1:]}: best with an IMU is {best.label}, "
    if len(medians) == 1:
        head += f"{question.said(medians[lowest])} ({lowest})"
    else:
        head += f"from {question.said(medians[lowest])} ({lowest}) "
        head += f"to {question.said(medians[highest])} ({highest})"
    known = {slot: v for slot, v in medians.items() if slot in zero}
    if not known:
        return f"{head}; no method without an IMU was run beside it."
    beaten = [slot for slot, value in known.items() if zero[slot] < value]
    least, most = min(zero[s] for s in known), max(zero[s] for s in known)
    sizes = question.said(least)
    if significant(least) != significant(most):
        sizes = f"{question.said(least)} to {question.said(most)}"
    if len(beaten) == len(known):
        return f"{head}; beaten by no IMU at all, {sizes}."
    if not beaten:
        return f"{head}; no IMU at all has {sizes}."
    names = listed(beaten[:MOST_NAMED]) + (
        f" and {len(beaten) - MOST_NAMED} more" * (len(beaten) > MOST_NAMED)
    )
    return f"{head}; no IMU at all has {sizes}, which beats {names}."


def answer_tiles(question: Question) -> list[Tile]:
    """The best with an IMU, no IMU at all, and the worst recording of the best."""
    best, floor = question.ranked[0], question.without
    medians = {slot: v for slot, v in question.medians(best).items() if slot in question.real}
    slot = min(medians, key=lambda s: medians[s])
    judged = question.judged
    own = judged[(judged["estimator"] == best.name) & (judged["slot"] == slot)]
    count = len(own)
    middle = f", median of {count:,}" if count > 1 else ""
    tiles = [Tile("best with an IMU", question.said(medians[slot]), f"{best.label}, {slot}{middle}")]
    zero = question.medians(floor).get(slot) if floor else None
    if floor is not None and zero is not None:
        beats = zero < medians[slot]
        note = "beats it" if beats else f"{zero / max(medians[slot], 1e-12):.1f} times as much"
        tiles.append(Tile("no IMU at all", question.said(zero), f"{floor.label}: {note}"))
    if count > 1:
        worst = own.iloc[int(own["value"].to_numpy().argmax())]
        note = f"of {count:,} of the same, cell {worst['cell']}"
        tiles.append(Tile("worst recording", question.said(float(worst["value"])), note))
    else:
        other = next((s for s in question.methods if s.name == best.twin), None)
        others = question.ranked[1:2]
        second = other or (others[0] if others else None)
        value = question.medians(second).get(slot) if second else None
        if second is not None and value is not None:
            title = "the same, uncompensated" if second is other else "the next best"
            tiles.append(Tile(title, question.said(value), second.label))
    return tiles


def drawn_methods(question: Question) -> list[MethodStyle]:
    """Methods of the chart, in the scenario's order: the one that the sentence names is always among them."""
    there = set(question.judged["estimator"].unique())
    users = [style for style in question.methods if style.uses_imu and style.name in there]
    first = question.ranked
    chosen = [*first, *(style for style in users if style not in first)][:MOST_METHODS]
    return [style for style in users if style in chosen]


def answer_chart(question: Question, *, what: str) -> str:
    """A dot for each recording by IMU and method; of one IMU, by the kind of track.

    Parameters
    ----------
    question : Question
        What is asked.
    what : str
        Description for those who cannot see it.
    """
    draws = question.draws[question.draws["value"] > 0.0]
    judged = draws[draws["window"] == question.window]
    slots = {str(slot): own for slot, own in judged.groupby("slot", sort=False)}
    if len(slots) == 1:
        found = [window for window in _WINDOWS if (draws["window"] == window).any()]
        slots = {window: draws[draws["window"] == window] for window in found}
    slots = dict(list(slots.items())[:MOST_SLOTS])
    drawn = pd.concat(list(slots.values()))
    styles = [style for style in drawn_methods(question) if (drawn["estimator"] == style.name).any()]
    floor = question.without
    if not styles:
        return ""
    with canvas.look():
        figure, (panel,) = canvas.slots_panel(2.6, list(slots))
        for place, own in enumerate(slots.values()):
            for number, style in enumerate(styles):
                _draw_dots(panel, own, style, place - 0.4 + (number + 0.5) * 0.8 / len(styles), len(styles))
            if floor is not None:
                zero = own.loc[own["estimator"] == floor.name, "value"]
                if len(zero):
                    ends = [place - 0.46, place + 0.46]
                    panel.plot(ends, [zero.median()] * 2, color=canvas.INK, lw=1.2, ls=(0, (4, 2)), zorder=2)
        names = [style.name for style in (*styles, *([floor] if floor else []))]
        values = drawn.loc[drawn["estimator"].isin(names), "value"]
        panel.set_ylim(0.75 * values.min(), 1.35 * values.max())
        canvas.log_scale(panel.yaxis)
        words = question.words.replace(" in curves", "") if len(slots) > 1 else question.words
        label = textwrap.fill(f"{words}, {question.unit.strip()}", 34)
        canvas.label_upright(panel, label, fontsize=8.4)
        handles = [
            Line2D([], [], color=s.colour, marker="o", mfc="none" if s.baseline else s.colour, lw=0, ms=5.0)
            for s in styles
        ]
        labels = [style.label for style in styles]
        if floor is not None and (drawn["estimator"] == floor.name).any():
            handles.append(Line2D([], [], color=canvas.INK, lw=1.2, ls=(0, (4, 2))))
            labels.append(f"no IMU: {floor.label}")
        canvas.figure_legend(figure, handles, labels)
        return canvas.to_svg(figure, description=what)


def _draw_dots(panel: Axes, own: pd.DataFrame, style: MethodStyle, middle: float, count: int) -> None:
    """Draw recordings of a method side by side by rank, the best and the worst among them."""
    ranked = np.sort(own.loc[own["estimator"] == style.name, "value"].to_numpy())
    if len(ranked) == 0:
        return
    shown = ranked[np.unique(np.linspace(0, len(ranked) - 1, MOST_DOTS).round().astype(int))]
    wide = min(0.62 / count, 0.006 * len(shown)) if len(shown) > 1 else 0.0
    x = middle + wide * (np.linspace(-0.5, 0.5, len(shown)) if len(shown) > 1 else np.zeros(1))
    if len(shown) < FEW:
        face = "none" if style.baseline else style.colour
        panel.plot(x, shown, "o", ms=4.6, mfc=face, mec=style.colour, mew=0.8, zorder=3)
        return
    # Many dots as one line of very short strokes, whose ends are round: an element in place of sixty.
    gap = np.full(len(shown), np.nan)
    ends = np.column_stack((x - DOT, x + DOT, gap)).ravel()
    size, alpha = (1.6, 0.8) if style.baseline else (3.0, 1.0)
    dots: dict[str, Any] = {"lw": size, "alpha": alpha, "solid_capstyle": "round", "zorder": 3}
    panel.plot(ends, np.repeat(shown, 3), color=style.colour, **dots)
