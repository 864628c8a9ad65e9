"""Making one archive of several, or a larger or newer one of one.

merge, extend, rerun   the commands of these names; merge copies values from one archive to another
places                 where the points of several archives lie in one
"""
