"""Recorded pressure becomes a diagram, and is judged."""
