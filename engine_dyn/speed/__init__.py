"""Periodic crank speed omega(phi) and its irregularity.

fields, methods, results    the tables of the solvers' inputs, of methods, and of results
work         work curves of all designs, as sums of columns
designs, task, storage      what kernels take of designs, and where results go
batch        the solver of many designs at once, in blocks
general      the solver of any design, one at a time
thesis       the thesis's own method, for comparison
grouping, dispatch          designs that share columns; who solves them
broadcasting, pieces, error_estimate, mechanisms    arrays, threads, errors, who solved what
api, keywords  `periodic_speed` of one design, and its keywords in groups
required     the inertia that gives a wanted delta
torque, mean_gas            results at nominal speed
transient    speed over recorded cycles
"""
