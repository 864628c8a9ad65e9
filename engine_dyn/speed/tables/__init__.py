"""Work over one period at the nodes of a grid, which all solvers read.

work_tables         how a table is built
lookup              from which diagrams, and what solvers need to know of it
node_counts         how many nodes
load_over_angle     a load over angle as a part of a table
extremes, torque_extremes, mean_gas    what is found with a table
"""
