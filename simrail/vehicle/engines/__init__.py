"""What integrates a vehicle's equations: Exudyn, or the same equations compiled."""
