"""The attitude EKF by filterpy: short, readable, what its kernel is held to.

Briales et al. 2021 (paper 000), Eqs. 21-39.
"""

from __future__ import annotations

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from simrail.core.jit import FloatArray


class EulerEkf(ExtendedKalmanFilter):
    """filterpy's EKF with the attitude's own state prediction."""

    def predict_x(self, u: FloatArray) -> None:
        """Add the step u of the Euler angles."""
        self.x: FloatArray = self.x + u


def filterpy_ekf(
    rate: FloatArray,
    force: FloatArray,
    process: FloatArray,
    noise: FloatArray,
    start: FloatArray,
    start_variance: FloatArray,
    step_s: float,
    gravity: float,
    states: FloatArray,
    covariance: FloatArray,
    innovations: FloatArray,
) -> None:
    """The same filter by filterpy: block update, Joseph form; arguments as in the kernel."""

    def predicted_force(x: FloatArray) -> FloatArray:
        roll, pitch, _ = x
        return gravity * np.array(
            [-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)]
        )

    def force_jacobian(x: FloatArray) -> FloatArray:
        (sr, sp, _), (cr, cp, _) = np.sin(x), np.cos(x)
        return gravity * np.array([[0.0, -cp, 0.0], [cr * cp, -sr * sp, 0.0], [-sr * cp, -cr * sp, 0.0]])

    ekf = EulerEkf(dim_x=3, dim_z=3)
    ekf.x, ekf.P = start.copy(), np.diag(start_variance)
    for k in range(rate.shape[0]):
        if k > 0:
            (sr, sp, _), (cr, cp, _) = np.sin(ekf.x), np.cos(ekf.x)
            x, y, z = rate[k]
            u, w = y * cr - z * sr, y * sr + z * cr
            jacobian = np.array(
                [[u * sp / cp, w / cp**2, 0.0], [-w, 0.0, 0.0], [u / cp, w * sp / cp**2, 0.0]]
            )
            ekf.F = np.eye(3) + step_s * jacobian
            ekf.Q = process[k] * np.eye(3)
            ekf.predict(step_s * np.array([x + w * sp / cp, u, w / cp]))
        yaw, yaw_variance = ekf.x[2], ekf.P[2, 2]
        ekf.update(force[k], force_jacobian, predicted_force, R=np.diag(noise[k]))
        # Gravity says nothing of heading: its gain is zero, so its value and variance stay (Schmidt).
        ekf.x[2], ekf.P[2, 2] = yaw, yaw_variance
        states[k], covariance[k] = ekf.x, ekf.P
        innovations[k, :3], innovations[k, 3] = ekf.y, ekf.y @ ekf.SI @ ekf.y
