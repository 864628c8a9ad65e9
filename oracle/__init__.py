"""Slow and obvious reference solutions, which share no code with the packages they check."""
