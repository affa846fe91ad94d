"""Responses of a sensitivity analysis over each of the values that were sampled."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from simrail.campaign.sensitivity import INDEX_COLUMNS, Sensitivity
from simrail.core.jit import FloatArray
from simrail.report.figures import canvas
from simrail.scenario.designs import block_size
from simrail.scenario.distributions import Distribution

_WIDTH = 0.12
"""Standard deviation of the smooth's kernel, a share of the distribution."""

_COLOUR = "#0072B2"
_TICKS = (0.0, 0.25, 0.5, 0.75, 1.0)


def smooth(x: FloatArray, y: FloatArray, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Local-linear smooth of points, with a Gaussian kernel, and half of its 95 % band.

    The band is that of the mean: 1.96 sqrt(sum l_i^2 r_i^2) with the weights l_i of the smooth and the
    residuals r_i of the points, whose scatter need not be alike everywhere. It holds no bias of the smooth.

    Parameters
    ----------
    x, y : ndarray (n,)
        Points, independent of each other.
    at : ndarray (m,)
        Where.

    Returns
    -------
    mean, half : ndarray (m,)
        The smooth, and half the width of its band.
    """

    def weights(place: float) -> FloatArray:
        away = x - place
        kernel = np.exp(-0.5 * (away / _WIDTH) ** 2)
        first, second = (kernel * away).sum(), (kernel * away**2).sum()
        local = kernel * (second - away * first)
        normed: FloatArray = local / local.sum()
        return normed

    residual = y - np.array([weights(place) @ y for place in x])
    rows = np.array([weights(place) for place in at])
    return rows @ y, 1.96 * np.sqrt(rows**2 @ residual**2)


def independent_rows(method: str, dimensions: int, count: int) -> FloatArray:
    """Which samples (count,) of a design are independent of each other, as a mask.

    Of Saltelli's blocks the two points that the others are made of; of Morris' trajectories all, which are
    not quite.
    """
    if method == "morris":
        return np.ones(count, dtype=bool)
    place = np.arange(count) % block_size(method, dimensions)
    mask: FloatArray = (place == 0) | (place == dimensions + 1)
    return mask


def responses_figure(one: Sensitivity, distributions: Mapping[str, Distribution]) -> str:
    """The figure over each sampled value, the most influential first: points, their smooth and its band."""
    names = list(distributions)
    rows = independent_rows(one.method, len(names), len(one.values)) & np.isfinite(one.values)
    with canvas.look():
        figure, axes = canvas.panels_beside(
            len(names), tall_in=1.55, across=4, gap_in=0.3, row_gap_in=0.85, share_y=True
        )
        for place, (axis, name) in enumerate(zip(axes, one.order, strict=True)):
            x, y = one.shares[rows, names.index(name)], one.values[rows]
            axis.plot(x, y, ".", color=canvas.TRUTH, ms=2.2, zorder=2)
            if one.method == "morris":
                levels = np.unique(x)
                axis.plot(levels, [y[x == level].mean() for level in levels], "o-", color=_COLOUR, ms=4.0)
            elif len(y) > 8:
                at = np.linspace(0.0, 1.0, 61)
                mean, half = smooth(x, y, at)
                axis.fill_between(at, mean - half, mean + half, color=_COLOUR, alpha=0.22, lw=0, zorder=3)
                axis.plot(at, mean, color=_COLOUR, lw=1.6, zorder=4)
            axis.set_xlim(-0.02, 1.02)
            axis.set_xticks(_TICKS, [_word(distributions[name], share) for share in _TICKS], fontsize=7.6)
            axis.set_title(f"{_short(name)}\n{_words(one, name)}", fontsize=8.2, color=canvas.INK)
            if place % 4 == 0:
                axis.set_ylabel(f"{one.figure.quantity} {one.figure.metric}, {one.unit}")
            else:
                axis.tick_params(labelleft=False)
        about = f"{one.figure.quantity} {one.figure.metric} of {one.estimator}"
        return canvas.to_svg(figure, description=f"{about} over each sampled value, with smooth and band")


def _short(name: str) -> str:
    """A value's name without the table that it stands in, where the rest says it."""
    return name.split(".sheet.")[-1].removeprefix("estimator.").removeprefix("imu.")


def _word(distribution: Distribution, share: float) -> str:
    value = distribution.at(share)
    # Three digits, without an exponent where there is room for the number.
    return f"{float(f'{value:.3g}'):g}" if isinstance(value, float) else str(value)


def _words(one: Sensitivity, name: str) -> str:
    """The index that ranks a value, with its interval."""
    column = INDEX_COLUMNS[one.method][2 if one.method == "saltelli" else 0]
    value, half = (float(one.indices[which][name]) for which in (column, f"{column}_pm"))
    if not np.isfinite(value):
        return "no index"
    if one.method == "saltelli":
        return f"total index {value:.3f} ± {half:.3f}"
    return f"mu* {value:.3g} ± {half:.2g} {one.unit}"
