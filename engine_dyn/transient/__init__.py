"""The speed of the crankshaft while nothing repeats: load steps, governors, start and stop."""
