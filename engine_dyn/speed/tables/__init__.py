"""Work over one period at the nodes of a grid, which all solvers read."""
