"""The profile filter with filterpy's predict and update, on a list of nodes that grows and shrinks.

What its kernel is held to: no ring, no sparse algebra; a node is made, and forgotten, by a matrix. Hidalgo et
al. (paper 004), Eqs. 2 to 6.
"""

from __future__ import annotations

import numpy as np
from filterpy.kalman import predict, update
from simrail.estimators.profile.kernel import OWN, SAME, SLACK, Found, Model

from simrail.core.jit import FloatArray


class Line:
    """State, covariance, and which node stands behind which of the states."""

    def __init__(self, model: Model, low: int, high: int) -> None:
        count = len(model.start) - OWN
        self.nodes = list(range(low, high + 1))
        keep = [*range(OWN), *(OWN + node % count for node in self.nodes)]
        self.x, self.p = model.start[keep], model.start_covariance[np.ix_(keep, keep)]

    def row(self, own: dict[int, float], nodes: dict[int, float] | None = None) -> FloatArray:
        """A row of the Jacobian by states and nodes."""
        row = np.zeros((1, len(self.x)))
        for state, value in own.items():
            row[0, state] = value
        for node, value in (nodes or {}).items():
            row[0, OWN + self.nodes.index(node)] = value
        return row

    def measure(self, row: FloatArray, value: float, variance: float) -> tuple[float, float]:
        """Innovation and its variance; the state takes them in."""
        error = float(value - row[0] @ self.x)
        spread = float((row @ self.p @ row.T)[0, 0] + variance)
        x, self.p = update(self.x[:, None], self.p, np.array([[value]]), np.array([[variance]]), row)[:2]
        self.x = x[:, 0]
        return error, spread

    def add(self, node: int, row: FloatArray, variance: float) -> None:
        """A node that is so much of the others, and noise; on either side."""
        at = len(self.x) if not self.nodes or node > self.nodes[-1] else OWN
        turn = np.insert(np.eye(len(self.x)), at, row[0], axis=0)
        self.x, self.p = turn @ self.x, turn @ self.p @ turn.T
        self.p[at, at] += variance
        self.nodes.insert(at - OWN, node)

    def drop(self, node: int, found: Found) -> None:
        """Forget a node, having written it down."""
        self.write(node, found.oldest, found)
        at = OWN + self.nodes.index(node)
        self.x, self.p = np.delete(self.x, at), np.delete(np.delete(self.p, at, 0), at, 1)
        self.nodes.remove(node)

    def write(self, node: int, out: FloatArray, found: Found) -> None:
        """Height and variance of a node."""
        at = OWN + self.nodes.index(node)
        out[node - found.first_node] = self.x[at], self.p[at, at]


def slope_weights(t: float, *, linear: bool) -> FloatArray:
    """Slope per step at t between the nodes 0 and 1, by those at -1, 0, 1, 2: of the cubic through them."""
    if linear:
        return np.array([0.0, -1.0, 1.0, 0.0])
    powers = np.vander([-1.0, 0.0, 1.0, 2.0], increasing=True)
    return np.linalg.solve(powers.T, [0.0, 1.0, 2.0 * t, 3.0 * t * t])


def filterpy_profile(model: Model, found: Found) -> float:
    """The same filter; arguments and result as of the kernel."""
    dt, step, base = model.step_s, model.step_m, model.wheelbase_m
    keep, likelihood = int(np.ceil(base / step)), 0.0
    here, behind = (int(np.floor((model.place[0] - back) / step)) for back in (0.0, base))
    line, passed = Line(model, behind - 1, here), here
    for k, (place, speed) in enumerate(zip(model.place, model.speed, strict=True)):
        if k > 0:
            advance(line, model, model.vertical[k])
        here, behind = (int(np.floor((place - back) / step)) for back in (0.0, base))

        def late(node: int, place: float = place, speed: float = speed) -> float:
            return min(abs((place - node * step) / speed), dt) if speed else 0.0

        while line.nodes[0] < behind - 1 - SLACK:
            line.drop(line.nodes[0], found)
        crossed = [*range(passed + 1, here + 1), *range(passed, here, -1)]
        for node in crossed:
            back = line.row({0: 1.0, 1: -late(node)})
            if node > line.nodes[-1]:
                line.add(node, back, 0.0)
            else:
                line.measure(back - line.row({}, {node: 1.0}), 0.0, SAME)
            line.write(node, found.front, found)
        passed = here
        while line.nodes[-1] > here + keep:
            line.drop(line.nodes[-1], found)
        while line.nodes[0] > behind - 1:
            first = line.nodes[0]
            line.add(first - 1, line.row({}, {first: 1.0}), model.profile_variance)
        if model.moves[k]:
            line.measure(line.row({0: 1.0}), 0.0, model.zero_variance[k])
        else:
            line.measure(line.row({1: 1.0}), 0.0, model.still_variance)
        if model.sees[k]:
            t = (place - base) / step - behind
            weights = -speed / (base * step) * slope_weights(t, linear=model.is_linear)
            around = {behind - 1 + i: weight for i, weight in enumerate(weights)}
            row = line.row({1: 1.0 / base, 3: 1.0, 5: 1.0}, around)
            error, spread = line.measure(row, model.rate[k], model.rate_variance)
            if model.moves[k]:
                likelihood -= 0.5 * (error**2 / spread + np.log(2.0 * np.pi * spread))
        found.states[k], found.variances[k] = line.x[:OWN], np.diag(line.p)[:OWN]
    for node in line.nodes:
        line.write(node, found.oldest, found)
    return float(likelihood)


def advance(line: Line, model: Model, vertical: float) -> None:
    """Over one sample; nodes stay."""
    dt, n = model.step_s, len(line.x)
    f, q, b = np.eye(n), np.zeros((n, n)), np.zeros(n)
    f[0, 1], f[0, 2], f[1, 2] = dt, -0.5 * dt * dt, -dt
    f[4:6, 4:6] = model.angle_step
    b[:2] = 0.5 * dt * dt, dt
    q += model.accel_variance * np.outer(b, b)
    q[2, 2], q[3, 3] = model.bias_walk
    q[4:6, 4:6] += model.angle_process
    line.x, line.p = predict(line.x, line.p, f, q, b, vertical)
