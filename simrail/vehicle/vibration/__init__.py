"""A vehicle's small vertical vibration above what a multibody ride sees: its linear model, integrated exactly."""
