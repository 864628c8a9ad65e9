"""Libraries of arrays kept out of a process until something asks for one of them.

xarray imports dask and pint, where they are installed, to ask whether an array is one of theirs.
That takes up to half a second of each command, and no command has such arrays.
"""

import sys
from typing import Any

LIBRARIES = ("dask", "pint")

_modules: dict[str, Any] = sys.modules


def keep_out() -> None:
    """Let the imports of all of them fail, as where they are not installed."""
    for name in LIBRARIES:
        _modules.setdefault(name, None)


def let_in(name: str) -> None:
    """Let one of them be imported again."""
    if _modules.get(name, ...) is None:
        del _modules[name]
