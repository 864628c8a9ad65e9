"""The batch solver: blocks of designs side by side."""
