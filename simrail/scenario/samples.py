"""The joint draws of a scenario's distributions: one value for each of them, in each sample.

All distributions of a scenario (of its tables, rides, IMUs and estimators) are dimensions of one
design, a Latin hypercube or Sobol points, so that few samples fill the whole space. Each dimension
has a random stream of its own, found by its name:

* Latin hypercube: a dimension's values do not change when another distribution is added; they do
  when the number of samples changes, since every sample is one of n equal shares.
* Sobol: a dimension's values stay when samples are added, and when a distribution is added behind it;
  the number of samples is a power of two. Points are moved by a random digital shift per dimension.

Sources: McKay, Beckman, Conover 1979 (Latin hypercube); Owen 1998, section on digital shifts (Sobol).
"""

from __future__ import annotations

import numpy as np

from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.scenario.axes import Scalar, distributions_of
from simrail.scenario.distributions import Distribution
from simrail.scenario.scenario import ScenarioFile

SOBOL_BITS = 30
ARRAYS = ("ride", "imu", "estimator")


def dimensions(spec: ScenarioFile) -> dict[str, Distribution]:
    """All distributions of a scenario, by name: ``irregularity.scale``, ``ride.out.speed_kmh``."""
    found = distributions_of(spec)
    for array in ARRAYS:
        for part in getattr(spec, array):
            found |= distributions_of(part, prefix=f"{array}.{part.name}.")
    return found


def samples_of(spec: ScenarioFile) -> list[dict[str, Scalar]]:
    """The values of all distributions in each sample; one sample without values if there are none.

    Parameters
    ----------
    spec : ScenarioFile
        Its ``[monte_carlo]`` says how many samples, and by which method.
    """
    found = dimensions(spec)
    if not found:
        return [{}]
    shares = _shares(spec, list(found))
    return [
        {name: distribution.at(share) for (name, distribution), share in zip(found.items(), row, strict=True)}
        for row in shares.tolist()
    ]


def sample_count(spec: ScenarioFile) -> int:
    """Number of samples; 1 without distributions."""
    return spec.monte_carlo.samples if dimensions(spec) else 1


def _shares(spec: ScenarioFile, names: list[str]) -> FloatArray:
    """Points (samples, dimensions) in the unit cube."""
    from scipy.stats import qmc  # slow to import, and needed by few scenarios

    n = spec.monte_carlo.samples
    if spec.monte_carlo.method == "latin_hypercube":
        # Columns of a Latin hypercube are independent, so that each may have a stream of its own.
        columns = [qmc.LatinHypercube(1, rng=stream(spec.seed, "sample", name)).random(n) for name in names]
        return np.hstack(columns)
    points = qmc.Sobol(len(names), scramble=False, bits=SOBOL_BITS).random(n)
    digits = np.round(points * 2**SOBOL_BITS).astype(np.int64)
    shifts = [int(stream(spec.seed, "sample", name).integers(2**SOBOL_BITS)) for name in names]
    points = ((digits ^ np.array(shifts)) + 0.5) / 2.0**SOBOL_BITS
    return points
