"""The general solver: one design at a time."""
