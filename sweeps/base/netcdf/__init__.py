"""NetCDF files, which a process with limits reads first."""
