"""Rail geometry over the axes of a campaign: what every method errs by, in the band that counts."""

from collections.abc import Mapping, Sequence

import pandas as pd

from simrail.report.campaign.axes import CampaignAxis, draws_of, finest
from simrail.report.campaign.heat import Side, heat_maps, side_of
from simrail.report.tables.geometry_bands import JUDGED, QUANTITIES, waves_words
from simrail.report.tables.methods import MethodStyle
from simrail.track.bands import Band


def rails_figures(
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    axes: Sequence[CampaignAxis],
    styles: Sequence[MethodStyle],
    *,
    band: str,
    known: Mapping[str, Band],
) -> list[tuple[str, str]]:
    """Caption and heat maps for each axis, methods by its values; [] if no method says what rails look like.

    Parameters
    ----------
    scores, cells : pandas.DataFrame
        Score table and table of cells.
    axes : sequence of CampaignAxis
        What the cells differ in; an axis that follows from another has no figure of its own.
    styles : sequence of MethodStyle
        Methods, in their order.
    band : str
        Band that is shown.
    known : mapping of str to Band
        Bands whose wavelengths are told.
    """
    draws = {
        QUANTITIES[quantity]: draws_of(scores, cells, axes, quantity=quantity, metric="sd", band=band)
        for quantity in JUDGED
    }
    named = {name for rows in draws.values() for name in rows["estimator"].unique()}
    shown = [style for style in styles if style.name in named]
    if not shown:
        return []
    down = Side("method", [(s.name,) for s in shown], [s.label for s in shown], ["estimator"])
    by_column = {axis.column: axis for axis in finest(axes, cells)}
    sides = {}
    if "speed_kmh" in by_column and "direction" in by_column:
        both = by_column.pop("speed_kmh"), by_column.pop("direction")
        sides["speed and direction of travel"] = side_of(*both)
    sides |= {axis.title.partition(",")[0]: side_of(axis) for axis in by_column.values()}
    return [
        (
            f"Rails: standard deviation of the error {waves_words(band, known)}, by method and {title}; mean "
            "over all other axes and draws.",
            heat_maps(draws, across, down, unit="mm", what=f"Errors of the rails by method and {title}"),
        )
        for title, across in sides.items()
    ]
