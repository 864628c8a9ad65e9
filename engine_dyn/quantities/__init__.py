"""The graph of parameters and quantities: what each is, and what it is computed from."""
