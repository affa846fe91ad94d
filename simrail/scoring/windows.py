"""Windows of a ride and the choice among windows and metrics, for every score alike."""

from collections.abc import Collection, Mapping

import numpy as np

from simrail.core.errors import one_of
from simrail.core.jit import FloatArray
from simrail.scoring.metrics import IntArray
from simrail.scoring.table import CURVE_PREFIX, EVERY_CURVE, METRICS, ON_REQUEST, WINDOWS
from simrail.track.design import CURVE, STRAIGHT, TRANSITION, TrackDesign

STANDSTILL_MPS = 0.01
"""Below this true speed the vehicle counts as standing."""


CROP_S = 2.0
"""What the window ``cropped`` leaves out at either end, as Briales et al. 2021 (section 7.1) do."""


def windows_of(
    track: TrackDesign, position: FloatArray, speed: FloatArray, *, time_s: FloatArray | None = None
) -> dict[str, IntArray]:
    """Sample numbers of every window, from places (n,) on the track, speeds (n,) and times (n,).

    Without times there is no window ``cropped``.
    """
    moving = np.abs(speed) >= STANDSTILL_MPS
    kind = track.kind(position)
    masks = {
        "whole": np.ones(len(position), dtype=bool),
        "straight": moving & (kind == STRAIGHT),
        "transition": moving & (kind == TRANSITION),
        "curve": moving & (kind == CURVE),
        "standstill": ~moving,
        "moving": moving,
    }
    if time_s is not None:
        masks["cropped"] = (time_s >= time_s[0] + CROP_S) & (time_s <= time_s[-1] - CROP_S)
    windows = {name: np.flatnonzero(mask) for name, mask in masks.items()}
    in_curve = windows["curve"]
    segments = np.asarray(track.segment(position[in_curve]))
    for number in np.unique(segments):
        name = CURVE_PREFIX + track.segment_name(int(number))
        windows[name] = in_curve[segments == number]
    return windows


def chosen_windows(windows: Mapping[str, IntArray], wanted: Collection[str] | None) -> dict[str, IntArray]:
    """Those of a ride's windows that are wanted; all if nothing is said."""
    if wanted is None:
        return dict(windows)
    for name in wanted:
        if not name.startswith(CURVE_PREFIX):
            one_of(name, (*WINDOWS, EVERY_CURVE), "no such window")
    every_curve = EVERY_CURVE in wanted
    return {n: i for n, i in windows.items() if n in wanted or (every_curve and n.startswith(CURVE_PREFIX))}


def chosen_metrics(wanted: Collection[str] | None) -> tuple[str, ...]:
    """The metrics that are wanted; all if nothing is said."""
    if wanted is None:
        return METRICS
    known = (*METRICS, *ON_REQUEST)
    for name in wanted:
        one_of(name, known, "no such metric")
    return tuple(name for name in known if name in wanted)
