"""Engine files: TOML with the tables of cylinders, diagrams, shafts and machines.

engine_files, engine_tables    an engine from its file; the tables as pydantic models
cylinder_keys, shaft_tables, block_tables, auxiliary_tables, torque_tables  one file a table
indicator_files, torque_files  measured pressure over crank angle, torque over angle or speed: CSV
modelled_diagrams, torque_diagrams, data_sheets  diagrams that are modelled or follow from a sheet
"""
