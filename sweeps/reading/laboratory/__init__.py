"""Files as laboratories have them: each format is a few lines around the library that reads it.

recording       what such a file holds: columns with their units; `read_recording` picks the reader
headers         names and units of columns, from the lines above the numbers
text_tables, fixed_width, spreadsheets, matlab_files, tdms_files, mdf_files, netcdf_tables,
parquet_tables  one module for each kind of file
pressure_options  the keys that a person may give
columns, units, cycles_of_signals  which columns are meant, their units, cycles of crank angles
pressure, imported_pressure        the steps from a recording to a diagram, and what comes out
evaluation      recorded cycles as a Dataset, for figures
"""
