"""Pressure in the cylinder over the crank angle: given diagrams and modelled cycles.

diagram, point_checks    one curve through points, and whether points are an indicator diagram
family, family_grid      curves over load, and over load and speed
first_law, first_law_formulas, first_law_kernel    modelled cycles of engines
collocation              intervals of high order, by which these are followed
cycle_table, curves      families of many modelled cycles, and the kernels that make their rows
diesel_cycle, compressor    modelled cycles by simpler rules
double_acting            compressors with gas on both sides of the piston
file_fields              units and ranges of modelled cycles in engine files
motored                  cylinders that do not burn, or burn less or more
"""
