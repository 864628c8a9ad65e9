"""Tables of designs, from CSV, Excel, Parquet and netCDF files, a piece at a time."""
