"""A scenario's scores beside Gonzalez-Carbajal et al. 2023, figure by figure."""
