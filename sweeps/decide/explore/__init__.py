"""Archives are opened, searched, compared and exported.

opening           one archive, or several as one
search, slices    best designs, the Pareto front, slices
compare, export   differences of two archives; tables for programs that read no netCDF
torsion           orders of the torque for programs of torsional vibration
shaft_extremes    the worst of a shaft's vibration, and barred speeds
ranges            reading a range of values at a time
"""
