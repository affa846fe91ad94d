"""A vehicle's vertical vibration by short waves: its linear model, integrated exactly."""
