"""Files that people write, opened safely: one module for each kind.

regular_files                  opening files; those that scenes and engine files refer to
csv_tables, toml_files, sheets  the text formats and spreadsheets
numbers_with_units             "36.4 kW"; the registry of units
child_process, libraries       reading in another process; libraries that are optional
"""
