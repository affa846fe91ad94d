"""States of the track-relative smoother: their order, and what each is.

The state has three layers, each relative to the one below, and what the sensors do to all of them:

    body in the track    ROLL, ROLL_RATE, PITCH, PITCH_RATE, YAW, YAW_RATE
                                  rad, and derivatives by distance (of a roll that sways: by time)
                         ROLL_SLOW
                                  rad, of ROLL what is slower than irregularities are: it is taken off again,
                                  since the map's own CANT_ALONG has it (none of a roll that sways)
                         Y, Y_1, Y_2, Z, Z_1, Z_2
                                  m, place of the mount beside the nominal one, and derivatives by distance
                         TILT     rad of roll per rad of cant deficiency: suspension (quasi-static)
                         TILT_RATE
                                  s, the same per rad/s of it: the suspension follows late
                         TORSION  rad of roll per rad by which the body above rolls more than the track here
                         SQUAT    rad of pitch per g of acceleration
                         LAG      m, how far behind its chord a body points, in the direction of travel
                         LEAD     m, the same of its slope
                         Y_TILT, Y_BEND
                                  lateral place per rad of cant deficiency, m, and per curvature, m2
    track in the map     CANT     rad, of the curve's cant at its full height
                         CANT_ALONG, CANT_ALONG_1
                                  rad, of the cant along the line, and its derivative by distance
                         SLOPE    rad, of the gradient
                         HEADING  rad, of the yaw: it counts from the start and is in no measurement
                         CURVE    relative, of the curve's curvature
                         EVEN, ODD
                                  m, shift of the joints of even and odd number
    train on the line    S, V, A  m, m/s, m/s2: place, speed and acceleration of the mount along the map
                         WAY      m, that the encoder's wheel should show
                         SCALE, TREAD, LEFT, RIGHT
                                  relative, of its rolling radius: constant, wandering, in curves to a side
    sensors              GYRO_BIAS, ACCEL_BIAS
                                  rad/s, m/s2: three each
                         GYRO_OF_Z
                                  relative, what each gyro shows of the rate about Z: three
                         ACCEL_OF_X, ACCEL_OF_Y
                                  relative, what each accelerometer shows of the force along X and along Y:
                                  three each (what it shows of gravity, along Z, is in its bias)

The order is chosen for the transition (`simrail.estimators.track_relative.kernel`): pairs, triples, chains.
"""

ROLL, ROLL_RATE, PITCH, PITCH_RATE, YAW, YAW_RATE, CANT_ALONG, CANT_ALONG_1 = range(8)
Y, Y_1, Y_2, Z, Z_1, Z_2 = range(8, 14)
WAY, HEADING, S, V, A, SCALE, TREAD, LEFT, RIGHT, CURVE, EVEN, ODD, CANT, SLOPE = range(14, 28)
TILT, SQUAT, LAG, LEAD, Y_TILT, Y_BEND = range(28, 34)
GYRO_BIAS = (34, 35, 36)
ACCEL_BIAS = (37, 38, 39)
GYRO_OF_Z = (40, 41, 42)
ACCEL_OF_X = (43, 44, 45)
ACCEL_OF_Y = (46, 47, 48)

TORSION, TILT_RATE, ROLL_SLOW = 49, 50, 51

STATES = 52

WIDTH = 52
"""Length of a row of the covariance: a multiple of four, which fills the vector registers."""

PAIRS = (ROLL, PITCH, YAW, CANT_ALONG)
"""First states of those with one derivative."""

TRIPLES = (Y, Z)
"""First states of those with two."""
