"""Engine files: TOML with the tables of cylinders and diagrams, and those of features."""
