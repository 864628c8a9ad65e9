"""Sweeps over engine designs: scene in, labelled netCDF archive and figures out."""

from __future__ import annotations

from typing import Any

__all__ = [
    "Scene",
    "SceneError",
    "best",
    "calibrate",
    "cylinder_deviations",
    "export",
    "follow_cycles",
    "identify",
    "measured",
    "nearest",
    "open",
    "open_archive",
    "pareto",
    "read_pressure",
    "read_scene",
    "run",
    "stream",
]

_HOMES = {
    "Scene": "sweeps.scene.model",
    "SceneError": "sweeps.errors",
    "best": "sweeps.exploring.search",
    "calibrate": "sweeps.measuring.calibration",
    "cylinder_deviations": "sweeps.measuring.cylinder_deviations",
    "export": "sweeps.exploring.export",
    "follow_cycles": "sweeps.measuring.recorded_train",
    "measured": "sweeps.measuring.measured",
    "identify": "sweeps.measuring.identification",
    "nearest": "sweeps.exploring.slices",
    "open": "sweeps.exploring.opening",
    "open_archive": "sweeps.archive.netcdf",
    "pareto": "sweeps.exploring.search",
    "read_pressure": "sweeps.reading.laboratory.pressure",
    "read_scene": "sweeps.scene.reading",
    "run": "sweeps.running.in_memory",
    "stream": "sweeps.running.streaming",
}


def __getattr__(name: str) -> Any:
    # Loaded when first used: `import sweeps` and the command's help stay quick.
    if name in _HOMES:
        import importlib

        return getattr(importlib.import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'sweeps' has no attribute {name!r}")
