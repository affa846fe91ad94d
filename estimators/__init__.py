"""Estimators of attitude, trajectory and track geometry: one method per file.

Those that are registered are found here by their names, e.g. ``simrail.estimators.AttitudeEkf``.
"""

from typing import Any


def __getattr__(name: str) -> Any:
    """Import an estimator when it is first asked for."""
    from simrail.estimation.estimate import estimator_class, registered

    if name.startswith("_") or name not in registered():
        raise AttributeError(f"module 'simrail.estimators' has no attribute {name!r}")
    return estimator_class(name)


def __dir__() -> list[str]:
    from simrail.estimation.estimate import registered

    return sorted(registered())
