"""A scenario of rails on a short line, scored beside Gonzalez-Carbajal et al. 2023; its methods follow."""

SHORT_LINE = """
title = "Rails of a short line"
paper = "gonzalez_2023"
seed = 3
track = "condequinto_olivar"
vehicle = "metro_irw_bogie"
engine = "kinematic"
odometry = "truth"
[irregularity]
spectrum = "erri_b176_low"
[[ride]]
name = "go"
start_m = 10.0
end_m = 460.0
speed_kmh = 70.0
rest_s = 5.0
[[imu]]
name = "axle"
grade = "lord_3dm_gx4_25"
body = "front"
position_m = [0.0, 0.0, 0.6]
"""
