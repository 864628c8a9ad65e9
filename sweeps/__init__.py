"""Sweeps over engine designs: scene in, labelled netCDF archive and figures out."""

from __future__ import annotations

from typing import Any

__all__ = [
    "Scene",
    "SceneError",
    "best",
    "export",
    "nearest",
    "open",
    "open_archive",
    "pareto",
    "read_scene",
    "run",
    "stream",
]

_HOMES = {
    "Scene": "sweeps.scene",
    "SceneError": "sweeps.errors",
    "best": "sweeps.reading",
    "export": "sweeps.exporting",
    "nearest": "sweeps.reading",
    "open": "sweeps.reading",
    "open_archive": "sweeps.archive",
    "pareto": "sweeps.reading",
    "read_scene": "sweeps.scene",
    "run": "sweeps.runner",
    "stream": "sweeps.streaming",
}


def __getattr__(name: str) -> Any:
    # Loaded when first used: `import sweeps` and the command's help stay quick.
    if name in _HOMES:
        import importlib

        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'sweeps' has no attribute {name!r}")
