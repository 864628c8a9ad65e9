"""Labelled datasets, the netCDF files that contain them, and the folders of unfinished ones."""
