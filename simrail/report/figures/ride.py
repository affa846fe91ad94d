"""How a ride went over distance: its runs, its direction, and the axis of figures over it."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from simrail.campaign.cell import CellResult
from simrail.core.jit import FloatArray
from simrail.core.turning import turning_rows
from simrail.report.figures.canvas import distance_axis, places_of, shade_places


def direction_of(example: CellResult) -> int:
    """+1 towards larger s, -1 towards smaller s; of a ride that turns back, that of its first run."""
    _, position = runs_of(example)
    return 1 if position[1] >= position[0] else -1


def runs_of(example: CellResult) -> tuple[int, FloatArray]:
    """Number n of runs of a ride, and the places (n + 1,) between which they lie."""
    position = example.motion["position_m"].to_numpy()
    rows = turning_rows(position, step=max(1, len(position) // 50_000))
    return len(rows) - 1, position[rows]


def over_distance(
    axes: Sequence[Axes],
    example: CellResult,
    *,
    limits: tuple[float, float] | None = None,
    arrow: bool = True,
) -> None:
    """Finish panels over the distance of a ride: curves, and the direction of travel below the last."""
    if limits is None:
        position = example.motion["position_m"].to_numpy()
        low, high = float(position.min()), float(position.max())
        room = 0.01 * max(high - low, 1.0)
        limits = low - room, high + room
    shade_places(axes, places_of(example.line), limits=limits)
    distance_axis(axes[-1], direction=direction_of(example) if arrow and runs_of(example)[0] == 1 else None)
