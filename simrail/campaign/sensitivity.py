"""What decides a figure of the score table: indices over the values that the samples of a design have.

A scenario with ``[monte_carlo] method`` ``morris`` or ``saltelli`` (`simrail.scenario.designs`) is run as any
campaign. Here its scores become one response per sample, the mean of a figure over the draws that all samples
share, and of the responses come

* of Morris' trajectories, by value: mu* (mean size of the change of the response over a step of the value,
  divided by the step as a share of its distribution), mu (with its sign) and sigma (how unlike these are:
  curved, or dependent on the other values);
* of Saltelli's blocks, Sobol's indices by value: of first order (the share of the response's variance that it
  explains alone) and total (that it explains with all others).

A trajectory or block of which a sample failed is left out whole, and told: without one of its samples the
others say something else.

Sources: Morris, Technometrics 33 (1991), p. 161; Campolongo, Cariboni, Saltelli, Environmental Modelling &
Software 22 (2007), p. 1509 (mu*); Saltelli et al., Computer Physics Communications 181 (2010), p. 259; by
SALib.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from simrail.core.errors import InputError, one_of
from simrail.core.jit import FloatArray
from simrail.scenario.designs import DESIGNS, LEVELS, block_size, design_seed, problem_of, salib
from simrail.scenario.distributions import dimensions, sample_count, shares_of
from simrail.scenario.scenario import ScenarioFile
from simrail.scoring.aggregate import axis_columns
from simrail.scoring.table import OK

RESAMPLES = 500
"""Bootstrap resamples of the trajectories or blocks, for the intervals."""

INDEX_COLUMNS = {
    "saltelli": ("first", "first_pm", "total", "total_pm"),
    "morris": ("mu_star", "mu_star_pm", "mu", "sigma"),
}
"""Columns of a table of indices; ``_pm`` is half of a 95 % interval."""

_SALIB = {
    "saltelli": ("S1", "S1_conf", "ST", "ST_conf"),
    "morris": ("mu_star", "mu_star_conf", "mu", "sigma"),
}
_CASE_LABELS = ("ride", "vehicle", "mount", "imu", "odometry", "map", "vibration")


class FigureName(NamedTuple):
    """Which figure of the score table is the response."""

    quantity: str = "roll"
    metric: str = "rms"
    window: str = "whole"
    reference: str = "truth"
    band: str = "full"


@dataclass(frozen=True)
class Sensitivity:
    """What decides one figure of one estimator, in one case of a scenario.

    Attributes
    ----------
    case : str
        What the case is called; "" where there is one.
    estimator, figure, unit : str, FigureName, str
        Whose figure.
    method : str
        The design.
    indices : pandas.DataFrame
        By the values' names (index), columns `INDEX_COLUMNS`; the unit of Morris' is that of the figure.
    shares, values : ndarray (n, D), (n,)
        Points of the samples in the unit cube, and the responses; NaN of those that failed.
    blocks, dropped : int
        Trajectories or blocks, and those that were left out.
    note : str
        Why there are no indices, or why samples failed.
    """

    case: str
    estimator: str
    figure: FigureName
    unit: str
    method: str
    indices: pd.DataFrame
    shares: FloatArray
    values: FloatArray
    blocks: int
    dropped: int
    note: str = ""

    @property
    def order(self) -> list[str]:
        """Names of the values, the most influential first."""
        column = INDEX_COLUMNS[self.method][2 if self.method == "saltelli" else 0]
        ranked = self.indices[column].sort_values(ascending=False, kind="stable", na_position="last")
        return [str(name) for name in ranked.index]


def indices_of(
    method: str, names: Sequence[str], shares: FloatArray, values: FloatArray, *, seed: int
) -> tuple[pd.DataFrame, int, str]:
    """Indices of responses.

    Parameters
    ----------
    method : {"morris", "saltelli"}
        The design of the samples.
    names : sequence of str
        Of the D values.
    shares, values : ndarray (n, D), (n,)
        Points of the samples in the unit cube, and their responses; NaN of one that failed.
    seed : int
        Of the bootstrap.

    Returns
    -------
    indices : pandas.DataFrame
        By name, columns `INDEX_COLUMNS`; NaN where there are none.
    dropped : int
        Blocks that were left out, each for at least one failed sample.
    why : str
        Why there are no indices; "" if there are.
    """
    size = block_size(method, len(names))
    whole = np.isfinite(values.reshape(-1, size)).all(axis=1)
    dropped = int((~whole).sum())
    columns = INDEX_COLUMNS[method]
    none = pd.DataFrame(np.nan, index=list(names), columns=list(columns))
    if whole.sum() < 2:
        return none, dropped, "fewer than two blocks without a failed sample"
    kept = np.repeat(whole, size)
    points, responses = shares[kept], values[kept]
    if np.ptp(responses) == 0.0:
        return none, dropped, "it does not change with any of the values"
    problem, salib_seed = problem_of(names), design_seed(seed, "sensitivity", method)
    if method == "morris":
        found = salib("analyze.morris").analyze(
            problem, points, responses, num_resamples=RESAMPLES, num_levels=LEVELS, seed=salib_seed
        )
    else:
        found = salib("analyze.sobol").analyze(
            problem, responses, calc_second_order=False, num_resamples=RESAMPLES, seed=salib_seed
        )
    table = {
        column: np.asarray(found[name], dtype=np.float64)
        for column, name in zip(columns, _SALIB[method], strict=True)
    }
    return pd.DataFrame(table, index=list(names)), dropped, ""


def sensitivities(
    spec: ScenarioFile,
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    figure: FigureName,
    *,
    estimators: Sequence[str] = (),
) -> list[Sensitivity]:
    """What decides a figure, of each estimator in each case of a scenario.

    Parameters
    ----------
    spec : ScenarioFile
        The scenario, whose ``[monte_carlo] method`` is a design.
    scores, cells : pandas.DataFrame
        What a run of it found.
    figure : FigureName
        The figure.
    estimators : sequence of str, optional
        Those that are wanted; all if none is named.

    Raises
    ------
    InputError
        If the scores have no such figure, or the scenario is no design.
    """
    one_of(
        spec.monte_carlo.method, DESIGNS, "is no design of a sensitivity analysis", field="monte_carlo.method"
    )
    of_figure = _rows_of(scores, figure, estimators)
    names, shares = list(dimensions(spec)), shares_of(spec)
    found = []
    for (case, words), estimator in _pairs(cells, of_figure):
        mine = of_figure[of_figure["estimator"] == estimator]
        values, reason = _responses(spec, mine, cells[cells["case"] == case])
        failed = np.isnan(values)
        if failed.any() and not reason:
            reason = _reason(scores, cells[cells["case"] == case], estimator)
        table, dropped, why = indices_of(spec.monte_carlo.method, names, shares, values, seed=spec.seed)
        note = "; ".join(text for text in (why, reason if failed.any() else "") if text)
        unit = str(mine["unit"].iloc[0]) if len(mine) else ""
        found.append(
            Sensitivity(
                words,
                estimator,
                figure,
                unit,
                spec.monte_carlo.method,
                table,
                shares,
                values,
                spec.monte_carlo.samples,
                dropped,
                note,
            )
        )
    return found


def _rows_of(scores: pd.DataFrame, figure: FigureName, estimators: Sequence[str]) -> pd.DataFrame:
    """Rows of a figure; refused if there are none, with the words that would be some."""
    wanted = scores
    for name, word in figure._asdict().items():
        words = [str(one) for one in wanted[name].dropna().unique() if str(one)]
        option = "--of" if name == "quantity" else f"--{name}"
        one_of(word, sorted(words), "is not in the scores of this scenario", field=option)
        wanted = wanted[wanted[name] == word]
    for estimator in estimators:
        words = [str(one) for one in wanted["estimator"].unique()]
        one_of(estimator, words, "has no such figure in the scores", field="--estimator")
    return wanted[wanted["estimator"].isin(estimators)] if estimators else wanted


def _pairs(cells: pd.DataFrame, rows: pd.DataFrame) -> Iterator[tuple[tuple[int, str], str]]:
    """Cases with what they are called, and the estimators that have the figure."""
    labels = [name for name in (*_CASE_LABELS, *axis_columns(cells)) if name in cells]
    telling = [name for name in dict.fromkeys(labels) if len(cells[name].unique()) > 1]
    for case, group in cells.groupby("case", sort=True):
        first = group.iloc[0]
        words = ", ".join(f"{name} = {first[name]}" for name in telling)
        for estimator in rows["estimator"].unique():
            yield (int(str(case)), words), str(estimator)


def _responses(spec: ScenarioFile, rows: pd.DataFrame, cells: pd.DataFrame) -> tuple[FloatArray, str]:
    """Mean of a figure over the draws of each sample, NaN where one of them has none; why one has none."""
    drawn = cells[["cell", "sample"]].merge(rows[["cell", "value", "status"]], on="cell", how="left")
    of_samples = drawn.groupby("sample")["value"]
    means = of_samples.mean().where(of_samples.count() == of_samples.size())
    values = means.reindex(range(sample_count(spec))).to_numpy(dtype=np.float64)
    bad = drawn.loc[drawn["value"].isna() & drawn["status"].notna(), "status"]
    return values, str(bad.iloc[0]) if len(bad) else ""


def _reason(scores: pd.DataFrame, cells: pd.DataFrame, estimator: str) -> str:
    """Why an estimator failed on the first cell that it failed on."""
    mine = scores[(scores["estimator"] == estimator) & scores["cell"].isin(cells["cell"])]
    failed = mine[(mine["status"] != OK) & mine["value"].isna()].sort_values("cell")
    return str(failed["status"].iloc[0]) if len(failed) else ""


def sensitivity_table(found: Sequence[Sensitivity]) -> pd.DataFrame:
    """Every index as one table, a row for each value of each figure, the most influential first."""
    if not found:
        raise InputError(
            "there are no scores to analyse",
            field="--estimator",
            limit="an estimator with scores in every sample",
            remedy="name another with --estimator",
        )
    rows = []
    for one in found:
        labels = {"case": one.case, "estimator": one.estimator, **one.figure._asdict(), "unit": one.unit}
        for rank, name in enumerate(one.order, start=1):
            row = {str(column): one.indices[column][name] for column in one.indices}
            told = {"blocks": one.blocks, "dropped": one.dropped, "note": one.note}
            rows.append({**labels, "method": one.method, "rank": rank, "value": name, **row, **told})
    return pd.DataFrame(rows)
