"""Solvers that take any design, one design at a time."""
