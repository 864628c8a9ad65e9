"""Forces and torques of the crank train; docs/architecture.md names the files."""
