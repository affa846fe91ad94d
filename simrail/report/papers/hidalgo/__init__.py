"""Hidalgo et al.: a vertical profile from the IMU over one of two axles."""
