"""Where the train is and how fast: odometries, which are estimators like any other."""
