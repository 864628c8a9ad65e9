"""Settings that all tests share."""

from __future__ import annotations

from hypothesis import settings

# The same examples in every run: what fails on one machine fails on all.
settings.register_profile("engine-dyn", deadline=None, max_examples=25, derandomize=True)
settings.load_profile("engine-dyn")
