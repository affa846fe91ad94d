"""What of a machine the last bits of a score depend on.

Compiled kernels and linear algebra use the widest instructions that a processor has, and sum in another order
where these differ: scores are then nearly the same (1e-9 relative on a kinematic ride), not to the bit, which
``tests/statistics/test_across_machines.py`` measures.
"""

import platform
from collections.abc import Mapping

KERNELS, FEATURES, ALGEBRA, PYTHON = "kernels", "instructions", "linear algebra", "Python"


def machine() -> dict[str, str]:
    """What kernels are compiled for, which instructions these may use, the linear algebra, and the Python."""
    import numba
    import numpy.linalg  # its library is loaded then, and seen  # noqa: F401
    from llvmlite import binding
    from threadpoolctl import threadpool_info

    config = numba.config
    name = config.CPU_NAME or binding.get_host_cpu_name()  # type: ignore[attr-defined]
    features = config.CPU_FEATURES  # type: ignore[attr-defined]
    if features is None:
        own = {} if config.CPU_NAME else binding.get_host_cpu_features()  # type: ignore[attr-defined]
        features = " ".join(sorted(feature for feature, is_there in own.items() if is_there))
    algebra = sorted({str(one.get("architecture", "")) for one in threadpool_info()} - {""})
    return {
        KERNELS: str(name),
        FEATURES: str(features),
        ALGEBRA: " ".join(algebra),
        PYTHON: ".".join(platform.python_version_tuple()[:2]),
    }


def differences(here: Mapping[str, str], others: Mapping[str, Mapping[str, str]]) -> str:
    """In what other machines differ from this one, with the first of them that does; "" if in nothing.

    Parameters
    ----------
    here : mapping of str to str
        This `machine`.
    others : mapping of str to mapping
        Those of others, by their names.
    """
    told: list[str] = []
    for what in (KERNELS, FEATURES, ALGEBRA, PYTHON):
        unlike = sorted(name for name, other in others.items() if other.get(what) != here[what])
        if not unlike or (
            what == FEATURES and told
        ):  # another processor has other instructions: said already
            continue
        ours, theirs = here[what], others[unlike[0]].get(what, "unknown")
        if what == FEATURES:
            ours, theirs = _only(ours, theirs), _only(theirs, ours)
        told.append(f"{what}: {ours} here, {theirs} on {unlike[0]}")
    return "; ".join(told)


def _only(words: str, others: str) -> str:
    """Words that stand in one text only, the first few."""
    only = sorted(set(words.split()) - set(others.split()))
    return f"also {' '.join(only[:4])}{' ...' if len(only) > 4 else ''}" if only else "no others"
