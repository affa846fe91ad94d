"""What an estimator is, what it concludes, and the battery that each one must pass."""
