"""What happened: a vehicle's ride over a laid track, its truth, and the cache of both."""
