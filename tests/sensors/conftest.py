"""What several tests of the magnetometer measure with."""

import numpy as np
import pytest

from simrail.core.columns import MAGNETIC


@pytest.fixture(scope="session")
def heading_error():
    """Error (rad) of a tilt-compensated compass: level the field, see how far it has turned from north."""

    def error(field, roll, pitch, yaw, *, north_rad):
        x, y, z = field[list(MAGNETIC)].to_numpy().T
        y, z = np.cos(roll) * y - np.sin(roll) * z, np.sin(roll) * y + np.cos(roll) * z
        x = np.cos(pitch) * x + np.sin(pitch) * z
        return (north_rad - np.arctan2(y, x) - yaw + np.pi) % (2.0 * np.pi) - np.pi

    return error
