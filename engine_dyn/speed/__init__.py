"""Periodic crank speed omega(phi) and its irregularity; docs/architecture.md names the files."""
