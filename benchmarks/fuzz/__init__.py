"""Hostile files by the thousand: see `benchmarks.fuzz.campaign`."""
