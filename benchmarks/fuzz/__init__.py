"""Hostile files by the thousand: `benchmarks.fuzz.__main__`."""
