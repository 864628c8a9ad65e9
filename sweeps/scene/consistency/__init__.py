"""Whether the parts of a scene fit each other and its engine; one subject a file.

`sweeps.base.checks` looks at single values and tables by themselves, this package at whole scenes.
"""
