"""How axles on a curved line turn the bodies above them: by the stiffness of what connects them.

Most bodies point from one support to the other. But where rods let the axles yaw, and steer about a point
beyond each other, they hardly guide their frame, and the traction rods above turn it towards the car body.

Not here: play in the gauge and creep, which move axles across the track; heights, which couple yaw to roll.
"""

import numpy as np

from simrail.core.jit import FloatArray
from simrail.vehicle.model import VehicleModel

_ALONG, _ACROSS = np.array([1.0, 0.0]), np.array([0.0, 1.0])

RIGID = 1e-6
"""How far weights may be from those that turn a vehicle on a straight line with that line."""


def heading_weights(vehicle: VehicleModel) -> dict[str, dict[str, float]]:
    """Heading of every body as a sum over the axles' lateral offsets y, its weights in 1/m.

    Axles are held across at their middles and are free to yaw and to move along; the energy in springs, rods
    and bushings is least, seen from above. Dampers, tabled laws and the guide do not take part. A body that
    nothing holds in yaw is left out.
    """
    names, axles = vehicle.body_names, vehicle.axle_names
    stiffness = _stiffness(vehicle)
    stiffness /= max(float(np.abs(stiffness).max()), 1.0)
    at = [np.array(vehicle.body(axle).position_m[:2]) for axle in axles]
    held = np.array([_motion(names, axle, place, _ACROSS) for axle, place in zip(axles, at, strict=True)])
    n, m = len(stiffness), len(axles)
    system = np.block([[stiffness, held.T], [held, np.zeros((m, m))]])
    asked = np.vstack([np.zeros((n, m)), np.eye(m)])
    # Nothing holds the vehicle along the track: of all solutions the least.
    turns = np.linalg.lstsq(system, asked, rcond=1e-13)[0][2:n:3]
    x = np.array(at)[:, 0]
    return {
        name: dict(zip(axles, (float(weight) for weight in row), strict=True))
        for name, row in zip(names, turns, strict=True)
        if abs(row.sum()) < RIGID and abs(row @ x - 1.0) < RIGID
    }


def _stiffness(vehicle: VehicleModel) -> FloatArray:
    """Stiffness matrix (3 b, 3 b) over x, y and yaw of each body about the vehicle's origin."""
    names = vehicle.body_names
    matrix = np.zeros((3 * len(names), 3 * len(names)))

    def between(
        inner: tuple[str, FloatArray], outer: tuple[str, FloatArray], along: FloatArray, stiffness: float
    ) -> None:
        stretch = _motion(names, *outer, along) - _motion(names, *inner, along)
        matrix[:] += stiffness * np.outer(stretch, stretch)

    for spring in vehicle.suspensions:
        at = np.array(spring.position_m[:2])
        for axis, along in enumerate((_ALONG, _ACROSS)):
            between((spring.inner, at), (spring.outer, at), along, spring.stiffness_npm[axis])
    for rod in vehicle.rods:
        ends = np.array(rod.inner_position_m), np.array(rod.outer_position_m)
        along = (ends[1] - ends[0])[:2] / rod.length_m
        between((rod.inner, ends[0][:2]), (rod.outer, ends[1][:2]), along, rod.stiffness_npm)
    for arms in vehicle.arms:
        for bushing in arms.bushings_m:
            at = np.array(bushing[:2])
            for axis, along in enumerate((_ALONG, _ACROSS)):
                between((arms.axle, at), (arms.frame, at), along, arms.stiffness_npm[axis])
    for rotation in vehicle.rotations:
        i, j = 3 * names.index(rotation.inner) + 2, 3 * names.index(rotation.outer) + 2
        matrix[np.ix_([i, j], [i, j])] += rotation.stiffness_nmprad[2] * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return matrix


def _motion(names: list[str], body: str, at: FloatArray, along: FloatArray) -> FloatArray:
    """Row (3 b,): what a point of a body moves along a direction, by x, y and yaw of all bodies."""
    row, i = np.zeros(3 * len(names)), 3 * names.index(body)
    row[i : i + 3] = along[0], along[1], at[0] * along[1] - at[1] * along[0]
    return row
