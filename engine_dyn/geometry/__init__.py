"""Geometry and masses of the crank train; docs/architecture.md names the files."""
