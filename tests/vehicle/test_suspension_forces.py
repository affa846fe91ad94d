"""Springs, dampers in series and stops between two bodies: what follows from their deflection's energy.

The bodies stand and turn anyhow. No couple is left over, the force is the slope of the stored energy for any
small motion of either body, and a damper takes what its rate says.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Turn

from simrail.vehicle.engines.records import LAW, POSE, SERIES, SPRING, STOP, WRENCH
from simrail.vehicle.engines.suspension_forces import series_forces, spring_forces, stop_forces

K, C = np.array([3e5, 2e5, 5e5]), np.array([4e3, 3e3, 6e3])
INNER, OUTER, SAG_M = np.array([0.3, -0.2, 0.5]), np.array([-0.4, 0.1, -0.7]), -0.15
SPRINGS = np.zeros(1, SPRING)
SPRINGS["sag_m"], SPRINGS["inner"], SPRINGS["outer"] = SAG_M, 0, 1
SPRINGS["inner_arm"], SPRINGS["outer_arm"], SPRINGS["stiffness"], SPRINGS["damping"] = INNER, OUTER, K, C


def anyhow(seed):
    """Two bodies in motion, the second some decimetres away from where the spring is at rest."""
    rng = np.random.default_rng(seed)
    pose = np.zeros(2, POSE)
    for name in ("x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz"):
        pose[name] = rng.normal(size=2)
    pose["rotation"] = Turn.from_rotvec(rng.normal(size=(2, 3))).as_matrix()
    return pose


def vectors(records, *names):
    return np.column_stack([records[name] for name in names])


def deflection(pose):
    """A^T p - r of the spring, from its definition."""
    place = vectors(pose, "x", "y", "z")
    way = place[1] + pose["rotation"][1] @ OUTER - place[0]
    return pose["rotation"][0].T @ way - INNER


def moved(pose, t):
    """The bodies a time later, as they move now."""
    later = pose.copy()
    for name in ("x", "y", "z"):
        later[name] += t * pose[f"v{name}"]
    turns = Turn.from_rotvec(t * vectors(pose, "wx", "wy", "wz"))
    later["rotation"] = (turns * Turn.from_matrix(pose["rotation"])).as_matrix()
    return later


def rate(pose):
    """d(deflection)/dt by a central difference."""
    return (deflection(moved(pose, 1e-6)) - deflection(moved(pose, -1e-6))) / 2e-6


def of_spring(pose):
    wrench = np.zeros(2, WRENCH)
    spring_forces(SPRINGS, pose, wrench)
    d, d_rate = deflection(pose) - [0.0, 0.0, SAG_M], rate(pose)
    return wrench, (K * d + C * d_rate) @ d_rate


def of_series(pose):
    row = np.zeros(1, SERIES)
    row["stiffness"], row["damping"], row["axis"] = 2e6, 5e4, 1
    for name in ("inner", "outer", "inner_arm", "outer_arm"):
        row[name] = SPRINGS[name]
    wrench, force, force_rate = np.zeros(2, WRENCH), np.array([7e3]), np.zeros(1)
    series_forces(row, pose, force, wrench, force_rate)
    along = rate(pose)[1]
    np.testing.assert_allclose(force_rate, 2e6 * (along - 7e3 / 5e4), rtol=1e-6)
    return wrench, 7e3 * along


def of_stop(pose):
    """A stop with a law of one piece, over its deflection along x."""
    row = np.zeros(1, STOP)
    row["pieces"] = 1
    for name in ("inner", "outer", "inner_arm", "outer_arm"):
        row[name] = SPRINGS[name]
    laws = np.array([(0.0, (0.0, 0.0, 1e5, 0.0))], LAW)
    wrench = np.zeros(2, WRENCH)
    stop_forces(row, laws, pose, wrench)
    return wrench, 1e5 * deflection(pose)[0] * rate(pose)[0]


@pytest.mark.parametrize("element", [of_spring, of_series, of_stop])
@pytest.mark.parametrize("seed", range(4))
def test_an_element_makes_no_momentum_and_takes_the_power_of_its_deflection(element, seed):
    """Forces and moments of the pair balance to rounding; the power is -F d', to 1e-7 of a difference."""
    pose = anyhow(seed)
    wrench, power = element(pose)
    force, moment = vectors(wrench, "fx", "fy", "fz"), vectors(wrench, "mx", "my", "mz")
    size = np.abs(force).max()
    assert size > 1e3
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-12 * size)
    about_origin = moment + np.cross(vectors(pose, "x", "y", "z"), force)
    np.testing.assert_allclose(about_origin.sum(axis=0), 0.0, atol=1e-11 * size)
    speed, turn = vectors(pose, "vx", "vy", "vz"), vectors(pose, "wx", "wy", "wz")
    given = (force * speed).sum() + (moment * turn).sum()
    assert given == pytest.approx(-power, rel=1e-7, abs=1e-7 * size)
