"""Sweeps over engine designs: scene in, labelled netCDF archive and figures out.

`sweeps.run` computes a scene and returns a dataset, `sweeps.plan` says what a scene would compute,
`sweeps.stream` writes an archive, and `sweeps.open` opens it. `dir(sweeps)` has all names.
"""

from __future__ import annotations

from typing import Any

import lazy_loader

from sweeps.base import documented_paths

documented_paths.keep()
# The package's names and the modules that define them stand in the stub __init__.pyi, which type
# checkers read too. A name is loaded when it is first used, so that `import sweeps` and the
# command's help stay quick.
_loaded, _, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("engine-dyn")
    if name == "figures":  # A subpackage, which the stub does not list
        from importlib import import_module

        return import_module("sweeps.view.figures")
    if name not in __all__:
        hint = ""
        if not name.startswith("_"):  # Notebooks look up dozens of names with `_`
            from sweeps.base.errors import did_you_mean

            hint = did_you_mean(name, __all__)
        raise AttributeError(f"module 'sweeps' has no attribute {name!r}{hint}")
    loaded = _loaded(name)
    if "Dataset" in str(getattr(loaded, "__annotations__", {}).get("return", "")):
        import sweeps.view.accessor  # noqa: F401  # datasets of sweeps have `dyn`
    return loaded


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
