"""NetCDF files, which a process with limits reads first."""

ARCHIVE_FORMAT = 2
"""Format of the archives that this version writes, their attribute `archive_format`.

1, of version 0.1, has no such attribute; it names the files of the catalogue by another folder: see
`sweeps.running.archive.contents`. A change that an older version would misread raises the number.
"""
