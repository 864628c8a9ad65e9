"""Scenes: what a person wants computed, read and checked.

model, values    a scene as data; which parameters it gives, and where
reading          finds a scene and puts it together; `read_scene`
toml_tables      the tables of its file as pydantic models; `json_schema` makes their JSON schema
axes, word_keys, cylinders, firing_patterns, solver, sample, reference    what reads each table
features         tables and keys of structured parts, one file each
variants         what follows for the graph of quantities, and for loads and drivers
consistency      whether the parts of a whole scene fit each other and the engine
"""
