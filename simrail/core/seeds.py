"""Random streams by name.

A stream is found by its name, never by the order in which streams are asked for: adding a sensor
to a scenario changes no other sensor's samples, and two draws never share a stream.
"""

import hashlib

import numpy as np


def stream(root: int, *names: str | int) -> np.random.Generator:
    """Return the random generator that belongs to a name.

    Parameters
    ----------
    root : int
        Seed of the scenario, >= 0.
    *names : str or int
        Path of the stream, e.g. ``"ride", 3, "imu", "axle", "gyro_white"``. ``3`` and ``"3"`` are
        different names, and so are ``("a", "bc")`` and ``("ab", "c")``.

    Returns
    -------
    numpy.random.Generator
        PCG64 seeded by the SHA-256 hash of root and names.
    """
    text = repr((int(root), *names)).encode()
    words = np.frombuffer(hashlib.sha256(text).digest(), dtype="<u4")
    return np.random.default_rng(np.random.SeedSequence(words.tolist()))
