"""Where a body is in its track, and the rails: the smoother of Gonzalez-Carbajal et al. 2023."""
