"""Labelled datasets, the netCDF files that contain them, and the folders of unfinished ones.

labels                  names, units and attributes of all variables
netcdf, partial         files that are complete or do not exist; runs that are not finished
contents, provenance    what an archive holds beside its results, and where it comes from
"""
