"""A commented scene to start from, as a text: the built-in one, or one about a given engine."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence

from engine_dyn.engine import Engine
from engine_dyn.loads.torque_curves import TorqueOverSpeed
from engine_dyn.parameters import PARAMETERS
from engine_dyn.plausibility.usual_ranges import CHECKS
from engine_dyn.quantities.features import torque_tables
from engine_dyn.quantities.friction import FRICTION_LAWS
from sweeps.scene.engine_choices import those_possible
from sweeps.scene.reading import built_in_scenes, read_scene
from sweeps.scene.values import BY_COMPONENT


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
    loads = loads or [values.get("load", 0.0)]
    if engine.torque is not None:
        text = re.sub(r"(?m)^load = .*\n", "", text).replace(", for three loads", "")
    lines = {
        "title": _quoted(
            f"Coefficient of speed fluctuation over flywheel inertia: {engine.title}"[:200]
        ),
        "engine": _quoted(path),
        "speed": f"{values['speed']:g}                    # rpm",
        "load": f"{[float(f'{load:g}') for load in loads]}    # percent",
    }
    law = FRICTION_LAWS[int(values.get("friction_law", 1.0)) - 1]
    without_effect = ["friction_"] if law == BY_COMPONENT else []
    if engine.torque is not None:  # A given torque is that at the shaft, without friction
        without_effect = ["friction_", "crankcase_pressure"]
    # A table over speed replaces k omega^exponent
    if isinstance(torque_tables.LOAD.of(engine), TorqueOverSpeed):
        without_effect.append("load_exponent")
    # Comments on values that an engine file lacks; other values have their unit as a comment
    meanings = {
        "load_exponent": "load torque a + k omega^exponent",
        "load_offset": "N m, constant part a of the load torque",
    }
    lacking = [
        f"{f'{key} = {one.typical:g}':<35}# {meanings.get(key, one.unit)}"
        for key, one in PARAMETERS.items()
        if not math.isnan(one.typical) and key not in values
        if not key.startswith(tuple(without_effect))
    ]
    if lacking:
        lines["speed"] += "\n# Usual values, which the engine file does not give: replace them.\n"
        lines["speed"] += "\n".join(lacking)
    lines = {key: f"{key} = {line}" for key, line in lines.items()}
    number = 25
    key = next((key for key in ("inertia", "flywheel_inertia") if key in values), None)
    if key is not None:
        low, high, number = _range_of_inertia(values, key)
        lines["inertia"] = (
            f'{key} = {{ start = {low}, stop = {high}, num = {number}, spacing = "log" }}    '
            f"# kg m2; the engine's own is {values[key]:g}"
        )
    elif {"bore", "stroke", "cylinders"} <= values.keys():
        volume = math.pi / 4.0 * values["bore"] ** 2 * values["stroke"] * values["cylinders"]
        # Ends of usual moments of inertia over the displacement to the power 5/3 [kg m-3], for
        # engine files without an inertia; they span most of the range that its plausibility check
        # takes for usual
        low, high = (float(f"{each * volume ** (5.0 / 3.0):.2g}") for each in (5e3, 8e5))
        lines["inertia"] = (
            f'inertia = {{ start = {low}, stop = {high}, num = 25, spacing = "log" }}    # kg m2; '
            "usual for engines of its size"
        )
    text = re.sub(r"(?m)^(\w+) = .*$", lambda match: lines.get(match[1], match[0]), text)
    counts = f"{len(loads)} x {number} designs"
    return text.replace("3 x 25 designs", counts)


BALANCE = (
    "shaking_force_max", "shaking_force_rms", "shaking_moment_max", "shaking_moment_rms",
)  # fmt: skip
"""Quantities of a scene about an engine without a diagram; moments need the cylinder spacing."""


def balance_scene(engine: Engine, given: str, path: str) -> str:
    """Write a scene about the balance of an engine without a diagram, which has no torque.

    `given` is the engine as the reader gives it, `path` as the scene names it. SceneError refuses
    one of which not even shaking forces are known.
    """

    def known(quantities: Sequence[str]) -> list[str]:
        read_scene({"engine": given, "output": {"quantities": list(quantities)}})
        return list(quantities)

    quantities, _ = those_possible(BALANCE, known)
    speed = engine.values["speed"]
    speeds = ", ".join(f"{share * speed:g}" for share in (0.5, 1.0, 1.5))
    return f"""\
# Shaking forces and moments. A flywheel, delta and all else about the torque need [[diagram]] in
# the engine file, which `engine-dyn calibrate` makes from [data_sheet].
title = {_quoted(f"Shaking forces and moments over the speed: {engine.title}"[:200])}
engine = {_quoted(path)}

[axes]
speed = [{speeds}]    # rpm; the engine's own is {speed:g}

[output]
quantities = [{", ".join(map(_quoted, quantities))}]
"""


_MARGIN = 0.9
"""Share of the largest usual inertia up to which that of a flywheel goes: the running gear, whose
inertia follows from other values, is added to it."""


def _range_of_inertia(values: Mapping[str, float], key: str) -> tuple[float, float, int]:
    """Ends and number of points of the axis of an inertia, in steps of 2^(1/8) from the own one.

    The ends are half and four times the own, as far as that is usual: the axis gives no warning
    unless the own inertia does. Warnings of results, such as a large delta, need a computation.
    """
    points = {step: float(f"{values[key] * 2.0 ** (step / 8):.3g}") for step in range(-8, 17)}
    check = next(one for one in CHECKS if one.name == "inertia")
    if {*check.needs[1:]} <= values.keys():
        others, share = 0.0, 1.0
        if key == "flywheel_inertia":
            load = values.get("load_inertia", 0.0) * values.get("gear_ratio", 1.0) ** 2
            others, share = values.get("auxiliary_inertia", 0.0) + load, _MARGIN
        low, high = check.edges
        sizes = [values[need] for need in check.needs[1:]]
        usual = {
            step: point
            for step, point in points.items()
            if low <= check.measure(point + others, *sizes) <= share * high
        }
        points = usual if 0 in usual and len(usual) > 1 else points
    return min(points.values()), max(points.values()), len(points)


def _quoted(text: str) -> str:
    """A text in TOML, whose escapes are those of JSON but for letters beyond 16 bits."""
    quoted = json.dumps(text, ensure_ascii=False)
    return "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in quoted)
