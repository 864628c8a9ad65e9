"""Diagrams with a spike, with noise, with steps, through `engine_dyn.periodic_speed`."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.stress import draw
from benchmarks.stress.sample import BORDER, TOLERANCE
from engine_dyn import Diagram, diagram_from_points, periodic_speed
from engine_dyn.status import (
    CONVERGED,
    INVALID_INPUT,
    NO_STEADY_STATE,
    STALLED,
    TOLERANCE_NOT_MET,
)
from engine_dyn.types import Floats
from oracle import spline

KINDS = ("spike", "noise", "steps")


@dataclass
class Spiky:
    """What came of each kind of diagram: counts, and the largest difference of delta."""

    asked: Counter[str] = field(default_factory=lambda: Counter(dict.fromkeys(KINDS, 0)))
    refused: Counter[str] = field(default_factory=Counter)
    agree: Counter[str] = field(default_factory=Counter)
    border: Counter[str] = field(default_factory=Counter)
    off: Counter[str] = field(default_factory=Counter)
    worst: dict[str, float] = field(default_factory=lambda: dict.fromkeys(KINDS, 0.0))
    examples: list[dict[str, Any]] = field(default_factory=list)

    @property
    def wrong(self) -> int:
        """Designs that disagree."""
        return sum(self.off.values())


def spoiled(kind: str, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Angles [rad] and pressures [Pa] of a good diagram made bad."""
    step = random.choice([0.5, 1.0, 2.0])
    degrees = np.arange(-360.0, 360.0, step)
    phi = np.radians(degrees)
    pressure = draw.family().row(int(random.integers(0, draw.family().row_count)))(phi)
    if kind == "spike":
        for _ in range(random.integers(1, 4)):
            place = int(random.integers(0, phi.size))
            pressure[place] += random.choice([0.3, 0.03, 3.0]) * random.uniform(0.1, 1.0) * 1e6
    elif kind == "noise":
        pressure = pressure * (1.0 + random.normal(0.0, 10.0 ** random.uniform(-4, -1), phi.size))
    else:
        # Held over several points, as a slow converter or a coarse one would give it.
        held = int(random.integers(2, 9))
        pressure = pressure[np.arange(phi.size) // held * held]
        level = 10.0 ** random.uniform(3.0, 4.8)
        pressure = np.maximum(np.round(pressure / level), 1.0) * level
    return phi, pressure


def inputs(random: np.random.Generator) -> dict[str, Any]:
    """Keywords of `periodic_speed`, from sane to odd."""
    bore = random.uniform(0.05, 0.25)
    return {
        "bore": bore,
        "stroke": bore * random.uniform(0.7, 1.6),
        "crank_ratio": random.uniform(0.05, 0.9),
        "reciprocating_mass": random.uniform(0.1, 3.0) * (bore / 0.1) ** 3,
        "inertia": 10.0 ** random.uniform(-1.5, 1.5) * (bore / 0.1) ** 5,
        "speed": 10.0 ** random.uniform(2.5, 3.7) * math.pi / 30.0,
        "cylinders": int(random.integers(1, 9)),
        "load_exponent": float(random.choice([0.0, 1.0, 2.0, random.uniform(0.0, 4.0)])),
        "inertia_model": str(random.choice(["constant", "variable"])),
        "closure": str(random.choice(["power_mean", "cycle_time"])),
    }


def _exact(diagram: Diagram, given: dict[str, Any], surplus: float) -> spline.Solutions:
    designs = spline.Designs.of(
        row=0.0, scale=1.0, crankcase=101325.0, crank_ratio=given["crank_ratio"],
        bore=given["bore"], stroke=given["stroke"], mass=given["reciprocating_mass"],
        inertia=given["inertia"], speed=given["speed"], exponent=given["load_exponent"],
        surplus=surplus, cylinders=given["cylinders"],
        variable=given["inertia_model"] == "variable",
        cycle_time=given["closure"] == "cycle_time",
    )  # fmt: skip
    return spline.solve(designs, lambda row, phi: diagram(phi), diagram.angle)


def one(kind: str, random: np.random.Generator, result: Spiky) -> None:
    """Draw one diagram and one engine, and add what comes of them."""
    result.asked[kind] += 1
    try:
        diagram = diagram_from_points(*spoiled(kind, random))
    except ValueError:
        result.refused[kind] += 1
        return
    given = inputs(random)
    found = periodic_speed(diagram, **given)
    exact = _exact(diagram, given, found.torque_mean)
    true, code = int(exact.status[0]), found.status
    differs = abs(found.delta / float(exact.delta[0]) - 1.0)
    by_code = {STALLED: spline.STALLED, NO_STEADY_STATE: spline.NO_STEADY_STATE,
               INVALID_INPUT: spline.INVALID_INPUT}  # fmt: skip
    if code in (CONVERGED, TOLERANCE_NOT_MET) and true == spline.CONVERGED:
        good = differs <= max(TOLERANCE, found.delta_error if code == TOLERANCE_NOT_MET else 0.0)
        if code == CONVERGED:
            result.worst[kind] = max(result.worst[kind], differs)
    else:
        good = by_code.get(code) == true
    if good:
        result.agree[kind] += 1
    elif abs(float(exact.lowest[0])) < BORDER or float(exact.doubt[0]) > 0.1 * TOLERANCE:
        result.border[kind] += 1
    else:
        result.off[kind] += 1
        result.examples.append({
            "diagram": kind, "number": result.asked[kind], "inputs": given, "status": code,
            "exact": true, "differs": differs, "delta_error": found.delta_error,
        })  # fmt: skip


def run(seed: int, count: int, say: Callable[[str], None]) -> Spiky:
    """Draw `count` diagrams of each kind."""
    result = Spiky()
    for number, kind in enumerate(KINDS):
        random = np.random.default_rng([seed, 1000 + number])
        for _ in range(count):
            one(kind, random, result)
        say(f"diagrams with {kind}: {result.off[kind]} off, {result.refused[kind]} refused")
    return result
