"""A scenario of twenty metres on the kinematic engine that has each part of one; its methods follow."""

SHORTEST_RIDE = """
title = "t"
seed = 3
track = "condequinto_olivar"
vehicle = "metro_irw_bogie"
engine = "kinematic"
truth_rate_hz = 250.0
[[ride]]
name = "line"
start_m = 40.0
end_m = 60.0
speed_kmh = 10.0
acceleration_mps2 = 1.5
jerk_mps3 = 1.5
rest_s = 1.0
final_rest_s = 1.0
[encoder]
wheel = "trailing.left"
pulses_per_revolution = 1024
rate_hz = 250.0
[[imu]]
name = "axle"
grade = "consumer"
body = "front"
position_m = [0.0, 0.0, 0.6]
"""

DESIGN = """
[[estimator]]
name = "design"
method = "DesignAngles"
"""
