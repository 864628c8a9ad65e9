"""Texts for people: what an archive, an engine or the package holds."""
