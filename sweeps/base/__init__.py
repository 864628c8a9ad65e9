"""The ground of all other rooms: errors, checks of values, labels of axes, files of every format.

errors, checks      messages of one line; values against the parameters of the graph
ratios, dimensions  numbers as people write them; names of dimensions, and places along axes
fronts, one_thread  non-dominated points; linear algebra whose bits do not depend on processors
files               texts, tables and other files, opened safely
netcdf              netCDF files, which a process with limits reads first
columns             tables of laboratories, in the formats of many programs
"""
