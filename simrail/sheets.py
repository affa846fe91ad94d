"""From the error terms of a device to what its data sheet tells an estimator."""

from __future__ import annotations

from simrail.recording import ImuSheet
from simrail.sensors.grades import ImuGrade


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
    )
