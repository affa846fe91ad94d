"""Forces of the contact kernel are continuously differentiable: no kink for an integrator to trip over."""

import numpy as np
import pytest

from simrail.vehicle.contact.creep_laws import CreepLaw


@pytest.mark.parametrize(
    "name, step",
    [
        ("y", 1e-6),
        ("z", 2e-7),
        pytest.param("phi", 1e-6, marks=pytest.mark.slow),
        pytest.param("psi", 4e-6, marks=pytest.mark.slow),
    ],
)
def test_forces_are_continuously_differentiable_in_the_pose(kernel, name, step):
    # Second differences over the step fall with the step (like it where curved, like its root where
    # the wheel lifts off); at a kink they would stay.
    check_smooth(kernel, name, step)


@pytest.mark.parametrize("index", [0, 1])
def test_forces_and_creep_rates_are_continuously_differentiable_in_the_creep(kernel, index):
    check_smooth(kernel, index, 4e-6)


@pytest.mark.parametrize(
    "variable, step", [pytest.param("z", 2e-7, marks=pytest.mark.slow), (0, 4e-6), ("v_x", 1e-4)]
)
def test_forces_are_smooth_with_polach_and_falling_friction(kernel, variable, step):
    law = CreepLaw("polach", adhesion=0.9, slip=0.5, friction_floor=0.4, friction_decay_spm=0.6)
    check_smooth(kernel, variable, step, contact=kernel.table(creep_law=law))


def check_smooth(kernel, variable, step, contact=None):
    contact = contact or kernel.table()
    worst = []
    for divisor in (1.0, 16.0):
        h, most = step / divisor, 0.0
        for y in (1e-4, 5.05e-3, 6.6e-3):
            base = {"y": y, "V": 8.0, "v_x": 8.0, "W": 8.0 / 0.4605, "psi": 1e-3}
            base["z"] = kernel.height_for(contact, base, 30e-6)
            # As fine as the step itself, so that no kink hides between the points.
            points = np.arange(-400.0 * divisor, 400.0 * divisor) * h
            values = []
            for x in points:
                state, zeta = dict(base), np.array([1e-3, 5e-4, 1e-3, 5e-4])
                if isinstance(variable, str):
                    state[variable] = state.get(variable, 0.0) + x
                else:
                    zeta[variable] += x
                _, out, rate = kernel.call(contact, zeta, **state)
                values.append([*out[:3], *(out[3:6] / 0.75), *(rate[:2] if variable in (0, 1) else (0, 0))])
            second = np.abs(np.diff(values, 2, axis=0)) / h
            most = np.maximum(most, second.max(axis=0))
        worst.append(most)
    first, last = np.array(worst)
    slope_scale = np.maximum(first, 1e-12)
    assert ((last / slope_scale < 0.5) | (last < 1e-3)).all(), (first, last)
