"""Figures of an archive, drawn from the Dataset alone."""
