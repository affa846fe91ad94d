"""Gonzalez-Carbajal et al. 2023: rails from a trajectory smoother."""
