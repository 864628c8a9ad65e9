"""The laboratory: measured pressure and measured speed, and what they tell about an engine.

Only `view` and `cli` import it; scenes reach it through the entry point `sweeps.recordings`.
"""
