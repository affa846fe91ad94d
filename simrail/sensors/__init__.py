"""What sensors on the train would have recorded of a motion: IMU and wheel encoder, with their errors."""
