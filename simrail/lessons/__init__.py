"""Lessons one can move: six notebooks whose figures follow their sliders, all from simrail's own parts.

A notebook (``notebooks/<name>.py``) is served by marimo (``simrail lesson NAME``), opened for changes
(``--edit``), or run as a script, which works out its claims at fixed settings and fails if one does not hold.
This room holds what the notebooks share: rides (`simrail.lessons.rides`), claims and figures.
"""

from pathlib import Path

LESSONS = {
    "drift": "Why a filter drifts: bias, noise and time",
    "curve": "A curve felt as a slope: centripetal acceleration read as gravity",
    "baseline": "Why no IMU at all is hard to beat, and how to score fairly",
    "slip": "What an encoder says when its wheel slips",
    "interval": "Is the interval true? NEES, coverage, and a filter that is too sure",
    "rails": "What rails look like from a bogie: smoothing, wavelengths, what cannot be seen",
}
"""Names and titles, in the order of a course."""


def notebook(name: str) -> Path:
    """File of a lesson's notebook."""
    return Path(__file__).parent / "notebooks" / f"{name}.py"


def teacher_page() -> Path:
    """What a teacher wants to know: how to use the lessons, how long each takes, and what to expect."""
    return Path(__file__).parent / "TEACHER.md"
