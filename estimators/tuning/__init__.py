"""An estimator's parameters from recordings: by likelihood, or against known rails."""
