"""Torques of loads, drivers and friction on the crank; docs/architecture.md names the files."""
