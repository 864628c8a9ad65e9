"""Labelled datasets and the netCDF files that hold them."""
