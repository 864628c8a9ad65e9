"""Stress suite: absurd designs by the million, against bounds and an independent solver."""
