"""The command `engine-dyn`."""
