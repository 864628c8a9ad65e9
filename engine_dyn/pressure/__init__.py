"""Pressure in the cylinder over the crank angle; docs/architecture.md names the files."""
