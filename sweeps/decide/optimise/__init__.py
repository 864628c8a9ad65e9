"""Searches for designs: the exact inverse where there is one, else generations of designs.

`space.py` says what may vary, `task.py` what is wanted of a scene, `evaluation.py` computes and
judges designs, `generations.py` looks for better ones, `least_inertia.py` is the exact inverse, and
`optimise.py` puts them together.
"""
