"""Worked examples of textbooks, beside what is computed here.

They stand in tests/reference/worked_examples.toml, which says what its keys are. Each is posed as a
user would: an engine file and a scene, or a function of engine_dyn.
"""

from __future__ import annotations

import functools
import importlib
import math
import tempfile
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

import sweeps
from engine_dyn.geometry.slider_crank import angle_of_travel, position
from engine_dyn.units import RPM

TESTS = Path(__file__).resolve().parents[1] / "tests"
DATA = tomllib.loads((TESTS / "reference" / "worked_examples.toml").read_text(encoding="utf-8"))
EXAMPLES: dict[str, dict[str, Any]] = {example["id"]: example for example in DATA["example"]}

UNITS = {
    "kN": 1e3, "kN m": 1e3, "lb": 0.45359237, "long ton": 1016.0469088, "lbf": 4.4482216152605,
    "lbf ft": 1.3558179483314004, "ft lbf": 1.3558179483314004, "kW": 1e3,
}  # fmt: skip
"""Units of the sources that archives do not use, with the units that archives use."""

USUAL_TOLERANCE = 1e-6


class Result(NamedTuple):
    """A value of an example, and ours in the same unit; None if it cannot be posed."""

    example: dict[str, Any]
    value: dict[str, Any]
    ours: Any

    @property
    def independent(self) -> Any:
        """Exact or expected value with which the computed one must agree."""
        return self.value.get("exact", self.value.get("expected"))

    @property
    def tolerance(self) -> float:
        """Relative difference that is allowed."""
        return float(self.value.get("tolerance", USUAL_TOLERANCE))

    @property
    def difference(self) -> float:
        """Relative; NaN of texts and of what cannot be posed."""
        return self.ours / self.independent - 1.0 if isinstance(self.ours, float) else math.nan

    @property
    def agrees(self) -> bool:
        """Whether ours is the independent value, within the tolerance of the data."""
        return self.ours == self.independent or abs(self.difference) <= self.tolerance


def engine_file(example: dict[str, Any]) -> str:
    more = DATA["with_pressure"]["text"] if "pressure" in example else ""
    return f"{example['engine']}{more}"


def engine_values(example: dict[str, Any]) -> dict[str, float]:
    values: dict[str, float] = tomllib.loads(example["engine"])["values"]
    return values


def pressure_rows(example: dict[str, Any]) -> list[str]:
    """Points of the pressure diagram at every degree, [degree] and [bar]."""
    given, values = example["pressure"], engine_values(example)
    half = 360 if "four-stroke" in example["engine"] else 180
    angle = np.arange(-half, half + 1)
    crank_ratio = 0.5 * values["stroke"] / values["rod_length"]
    low, high, exponent = given["low"], given["high"], given.get("exponent", 1.0)
    clearance = 1.0 / (given.get("compression_ratio", np.inf) - 1.0)  # travel over the stroke
    volume = clearance + 0.5 * position(np.radians(angle), crank_ratio)
    end = clearance + given.get("cut_off", 1.0)  # end of the admission or injection
    pressure = high * (end / np.maximum(volume, end)) ** exponent
    rise = [-1, 0] if clearance else [-40, -20]
    # Steps would make the curve through the points swing below zero.
    share = np.interp(angle, [*rise, 150, 170], [0.0, 1.0, 1.0, 0.0])
    pressure = low + share * (pressure - low)
    if clearance:
        compressed = (angle >= -180) & (angle < 0)
        pressure[compressed] = low * ((clearance + 1.0) / volume[compressed]) ** exponent
    return [f"{phi},{p!r}" for phi, p in zip(angle.tolist(), pressure.tolist(), strict=True)]


def torque_rows(example: dict[str, Any]) -> list[str]:
    """Points of straight lines between the corners of a torque, [degree] and [N m]."""
    corner, level = np.array(example["torque"], dtype=float).T
    last, step = corner[-1], example.get("torque_step", 0.1)
    angle = np.linspace(0.0, last, round(last / step) + 1)
    torque = np.interp(angle, corner, level)
    return [f"{phi!r},{m!r}" for phi, m in zip(angle.tolist(), torque.tolist(), strict=True)]


def scene(example: dict[str, Any]) -> dict[str, Any]:
    """The scene of an example, whose engine file is engine.toml."""
    asked = [name for value in example["values"] for name in value.get("ask", ())]
    output = {"quantities": list(dict.fromkeys(asked))}
    if "step" in example:
        output["angle_step"] = example["step"]
    return {
        "engine": "engine.toml", "set": example.get("set", {}), "output": output,
        "silenced_warnings": ["all"],
    }  # fmt: skip


@functools.cache
def computed(name: str) -> xr.Dataset:
    """The archive of an example."""
    example = EXAMPLES[name]
    with tempfile.TemporaryDirectory() as folder:
        engine = Path(folder, "engine.toml")
        engine.write_text(engine_file(example), encoding="utf-8")
        if "pressure" in example:
            rows = ["crank_angle_deg,pressure_bar", *pressure_rows(example)]
            Path(folder, "pressure.csv").write_text("\n".join(rows), encoding="utf-8")
        if "torque" in example:
            rows = ["crank_angle_deg,torque_Nm", *torque_rows(example)]
            Path(folder, "torque.csv").write_text("\n".join(rows), encoding="utf-8")
        return sweeps.run({**scene(example), "engine": str(engine)})


PICKS: dict[str, Callable[[xr.DataArray], Any]] = {
    "value": lambda curve: curve,
    "largest": lambda curve: curve.max(),
    "smallest": lambda curve: curve.min(),
    "angle of largest": lambda curve: curve.idxmax(),
    "angle of smallest": lambda curve: curve.idxmin(),
    "angle of zero": lambda curve: abs(curve).idxmin(),
    "reciprocal": lambda number: 1.0 / number,
    "magnitude": lambda vector: np.sqrt(np.square(vector).sum()),
}


def of_scene(example: dict[str, Any], value: dict[str, Any]) -> float:
    """A value of an example, in the units of archives."""
    found, values = computed(example["id"]), engine_values(example)
    at = dict(value.get("at", {}))
    if "travel" in at:
        radius = 0.5 * values["stroke"]
        angle = angle_of_travel(at.pop("travel") / radius, True, radius / values["rod_length"])
        at["crank_angle"] = np.degrees(angle)
    if "between" in value:
        found = found.sel(crank_angle=slice(*value["between"]))
    asked = found[value["ask"]].interp(at)
    if value.get("pick") == "speed of no force":  # the masses' force grows with its square
        *others, masses = (float(asked[name]) for name in value["ask"])
        return values["speed"] * math.sqrt(-sum(others) / masses)
    total = sum(asked[name] for name in value["ask"])
    assert isinstance(total, xr.DataArray)
    return float(PICKS[value.get("pick", "value")](total))


def of_function(value: dict[str, Any]) -> Any:
    """Result of a function of engine_dyn, or a part of it; a firing order as a text."""
    module, _, name = value["function"].rpartition(".")
    found = getattr(importlib.import_module(module), name)(**value["arguments"])
    if "part" in value:
        found = getattr(found, value["part"])
    return "-".join(map(str, found)) if isinstance(found, tuple) else float(found)


def factor(example: dict[str, Any], value: dict[str, Any]) -> float:
    """Factor by which a result is multiplied."""
    times = value.get("times", 1.0)
    if isinstance(times, float):
        return times
    values = engine_values(example)
    radius, omega = 0.5 * values["stroke"], values["speed"] * RPM
    factors = {"r": radius, "r omega": radius * omega, "r omega^2": radius * omega**2}
    return factors[times]


def result(example: dict[str, Any], value: dict[str, Any]) -> Result:
    """Compute one value; nothing of one that waits."""
    if "needs" in value:
        return Result(example, value, None)
    ours = of_scene(example, value) if "ask" in value else of_function(value)
    if not isinstance(ours, str):
        ours *= value.get("sign", 1.0) * factor(example, value) / UNITS.get(value["unit"], 1.0)
        ours += value.get("plus", 0.0)
    return Result(example, value, ours)


def results() -> list[Result]:
    """Every value of every example."""
    return [result(one, value) for one in EXAMPLES.values() for value in one["values"]]
