"""Files that people write, read and checked: one module for each kind of file or table.

regular_files, referred_files  opening files safely; files that scenes and engine files refer to
csv_tables, toml_files         the two text formats, by themselves
netcdf_files, netcdf_child     netCDF files, which a process with limits reads first
engine_files                   engines: TOML, with `cylinder_keys` and `modelled_diagrams`
indicator_files                measured pressure over crank angle: CSV
torque_tables                  torque of a load or driver over angle or speed: CSV
design_files                   tables of designs, from the four `design_*` of their formats
exclusive_keys                 parameters that exclude each other
"""
