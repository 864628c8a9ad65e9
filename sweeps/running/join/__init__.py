"""Making one archive of several, or a larger or newer one of one.

merge, extend, rerun   the commands of these names
places, copying        where the points of several archives lie in one, and how values get there
"""
