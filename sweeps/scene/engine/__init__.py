"""Engine files: TOML with the tables of cylinders and diagrams, and those of features.

engine_files, engine_tables    an engine from its file; the tables as pydantic models
cylinder_keys, indicator_files  keys of single cylinders; measured pressure over crank angle: CSV
modelled_diagrams, data_sheets  diagrams that are modelled or follow from a sheet
"""
