"""Periodic crank speed omega(phi) and its irregularity: one file a method, one place that loops."""
