"""`archive.dyn`: what `sweeps` does with an archive, as methods of its dataset.

Functions of `sweeps` that return datasets register it. `import sweeps.view.accessor` does so for
datasets that xarray opened by itself.
"""

from __future__ import annotations

from sweeps.view.accessor.archive import ArchiveAccessor

__all__ = ["ArchiveAccessor"]
