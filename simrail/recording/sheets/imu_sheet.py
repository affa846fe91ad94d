"""From the error terms of a device to what its data sheet tells an estimator."""

import math

from simrail.recording.recording import ImuSheet
from simrail.recording.sheets.grades import ImuGrade


def imu_sheet(grade: ImuGrade, *, delay_s: float) -> ImuSheet:
    """What the data sheet of a grade tells an estimator."""
    return ImuSheet(
        grade=grade.name,
        rate_hz=grade.rate_hz,
        delay_s=delay_s,
        gyro_noise_radpsqrts=grade.gyro_noise_radpsqrts,
        accel_noise_mpsqrts=grade.accel_noise_mpsqrts,
        gyro_bias_instability_radps=grade.gyro_bias_instability_radps,
        accel_bias_instability_mps2=grade.accel_bias_instability_mps2,
        gyro_turn_on_bias_radps=grade.gyro_turn_on_bias_radps,
        accel_turn_on_bias_mps2=grade.accel_turn_on_bias_mps2,
        lag_s=grade.lag_s,
        bandwidth_hz=grade.bandwidth_hz,
        gyro_bias_correlation_s=grade.gyro_bias_correlation_s,
        accel_bias_correlation_s=grade.accel_bias_correlation_s,
        gyro_random_walk_radpspsqrts=grade.gyro_random_walk_radpspsqrts,
        accel_random_walk_mps2psqrts=grade.accel_random_walk_mps2psqrts,
        gyro_scale_error=grade.gyro_scale_error,
        accel_scale_error=grade.accel_scale_error,
        package_misalignment_rad=grade.package_misalignment_rad,
        gyro_resolution_radps=grade.gyro_resolution_radps,
        accel_resolution_mps2=grade.accel_resolution_mps2,
        gyro_range_radps=_finite(grade.gyro_range_radps),
        accel_range_mps2=_finite(grade.accel_range_mps2),
        clock_drift=grade.clock_drift,
    )


def _finite(limit: float) -> float | None:
    """A range, or None for no limit."""
    return None if math.isinf(limit) else limit
