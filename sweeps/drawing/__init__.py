"""Parts of `sweeps.figures`: wording, views of an archive, sheets, curves, numbers."""
