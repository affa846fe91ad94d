"""Briales, Urda and Escalona 2021: attitude from one IMU and the track it runs on."""
