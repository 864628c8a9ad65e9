"""A commented scene to start from, as a text: the built-in one, or one about a given engine."""

from __future__ import annotations

import json
import re

from engine_dyn.engine import Engine
from sweeps.scene.reading import built_in_scenes

__all__ = ["starting_scene"]


def starting_scene(engine: Engine | None = None, path: str = "") -> str:
    """Write a commented scene that runs as it is.

    Parameters
    ----------
    engine : Engine, optional
        The engine that it is about; the catalogue's `ntua` without one.
    path : str
        The engine as the scene names it: its name in the catalogue, or its file.
    """
    text = built_in_scenes()["first"].read_text(encoding="utf-8")
    if engine is None:
        return text
    values = engine.values
    loads = [float(load) for load in engine.family.loads if load > 0.0]
    lines = {
        "title": json.dumps(
            f"Coefficient of speed fluctuation over flywheel inertia: {engine.title}"[:200]
        ),
        "engine": json.dumps(path),
        "speed": f"{values['speed']:g}                    # rpm",
        "load": f"{[float(f'{load:g}') for load in loads or [values['load']]]}    # percent",
    }
    lines = {key: f"{key} = {line}" for key, line in lines.items()}
    key = next((key for key in ("inertia", "flywheel_inertia") if key in values), None)
    if key is not None:
        low, high = (float(f"{values[key] * factor:.3g}") for factor in (0.5, 4.0))
        lines["inertia"] = (
            f'{key} = {{ start = {low}, stop = {high}, num = 25, spacing = "log" }}    # kg m2; '
            f"the engine's own is {values[key]:g}"
        )
    text = re.sub(r"(?m)^(\w+) = .*$", lambda found: lines.get(found[1], found[0]), text)
    counts = f"{len(loads) or 1} x 25 designs"
    return text.replace("3 x 25 designs", counts)
