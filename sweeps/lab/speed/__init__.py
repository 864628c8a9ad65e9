"""Measured and computed speed side by side, and what the measured speed tells about the engine."""
