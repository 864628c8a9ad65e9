"""Periodic crank speed omega(phi) and its irregularity.

fields, methods, results    the tables of the kernels' inputs, of methods, and of results
product, packing, broadcasting    from arrays that broadcast to what kernels take
arguments, pieces, error_estimate    a part of a sweep, work on threads, the error of a solution
tables       work tables, which all solvers read
general      the solver of any design, one at a time
batch        the solver of many designs at once, in lanes
dispatch     splits a sweep into parts and gives each to its solver
api, groups  `periodic_speed` of one design, and its keywords in groups
required     the inertia that gives a wanted delta
torque, mean_gas                           results at nominal speed
"""
