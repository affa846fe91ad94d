"""One figure out of a score table, and a table of several for a notebook."""

from collections.abc import Mapping, Sequence

import pandas as pd

from simrail.core.errors import InputError


def pick(
    table: pd.DataFrame,
    quantity: str,
    metric: str,
    *,
    window: str = "whole",
    reference: str = "truth",
    band: str = "full",
) -> float:
    """The one figure of a score table; NaN where it could not be computed.

    Raises
    ------
    InputError
        If the table has no such figure.
    """
    wanted = {
        "quantity": quantity,
        "metric": metric,
        "window": window,
        "reference": reference,
        "band": band,
    }
    rows = table
    for column, value in wanted.items():
        rows = rows[rows[column] == value]
        if rows.empty:
            raise InputError(
                "the score table has no such figure",
                field=column,
                value=value,
                limit=f"a {column} that the score table holds",
            )
    return float(rows["value"].iloc[0])


def markdown(rows: Mapping[str, Sequence[float]], columns: Sequence[str], *, digits: int = 3) -> str:
    """A table in Markdown: one row per name."""
    lines = ["| | " + " | ".join(columns) + " |", "|:--" + "|--:" * len(columns) + "|"]
    for name, values in rows.items():
        cells = ("\N{EN DASH}" if value != value else f"{value:.{digits}f}" for value in values)
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)
