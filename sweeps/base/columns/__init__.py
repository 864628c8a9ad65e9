"""Tables of laboratories: each format is a few lines around the library that reads it.

recording       the columns of such a file with their units; `read_recording` picks the reader
headers         names and units of columns, from the lines above the numbers
text_tables, fixed_width, spreadsheets, matlab_files, tdms_files, mdf_files, netcdf_tables,
parquet_tables  one module for each kind of file
columns, units, reading_choices, pressure_options  the columns that are meant, and how to read them
"""
