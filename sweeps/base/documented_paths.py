"""Paths of modules that pages name and that people import: they stay where the modules move."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from typing import Any


class _SameModule(Loader):
    """Gives a module a second name; it is loaded once, and both names are one object."""

    def __init__(self, name: str) -> None:
        self.module = import_module(name)
        self.spec = self.module.__spec__

    def create_module(self, spec: ModuleSpec) -> Any:
        return self.module

    def exec_module(self, module: Any) -> None:
        module.__spec__ = self.spec  # The import has replaced the module's own specification


class _Paths(MetaPathFinder):
    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        paths = {
            "sweeps.accessor": "sweeps.view.accessor",
            "sweeps.exploring": "sweeps.decide.explore",
            "sweeps.figures": "sweeps.view.figures",
            "sweeps.measuring": "sweeps.lab.speed",
            "sweeps.reading": "sweeps.scene.engine",
            "sweeps.reading.laboratory": "sweeps.lab.pressure",
        }
        old = max((o for o in paths if f"{fullname}.".startswith(f"{o}.")), key=len, default=None)
        if old is None:
            return None
        return ModuleSpec(fullname, _SameModule(paths[old] + fullname.removeprefix(old)))


def keep() -> None:
    """Let `import` find the modules under these paths too, whoever asks first."""
    if not any(isinstance(finder, _Paths) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Paths())
