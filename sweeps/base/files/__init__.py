"""Files that people write, opened safely: one module for each kind."""
