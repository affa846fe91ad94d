"""The vertical profile of the rails from one axle to the next: the filter of Hidalgo et al."""
