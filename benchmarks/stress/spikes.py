"""Diagrams with a spike, with noise, with steps, through `engine_dyn.periodic_speed`."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.stress import draw
from benchmarks.stress.findings import Findings
from benchmarks.stress.sample import BORDER, TOLERANCE
from engine_dyn import diagram_from_points, family_from_diagrams, periodic_speed
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


def one(kind: str, random: np.random.Generator, result: Findings) -> None:
    """Draw one diagram and one engine, and add what comes of them."""
    try:
        diagram = diagram_from_points(*spoiled(kind, random))
    except ValueError:
        result.counts[kind, "refused"] += 1
        return
    given = inputs(random)
    found = periodic_speed(diagram, **given)
    columns = {
        "row": 0.0, "crankcase": 101325.0, "mass": given["reciprocating_mass"],
        "exponent": given["load_exponent"], "mean_torque": found.torque_mean, "offset": 0.0,
        "variable": given["inertia_model"] == "variable",
        **{name: given[name] for name in ("crank_ratio", "bore", "stroke", "inertia", "speed",
                                          "cylinders")},
    }  # fmt: skip
    exact = draw.exact(columns, given["closure"], family_from_diagrams([0.0], [diagram]))
    true, code = int(exact.status[0]), found.status
    differs = abs(found.delta / float(exact.delta[0]) - 1.0)
    by_code = {STALLED: spline.STALLED, NO_STEADY_STATE: spline.NO_STEADY_STATE,
               INVALID_INPUT: spline.INVALID_INPUT}  # fmt: skip
    if code in (CONVERGED, TOLERANCE_NOT_MET) and true == spline.CONVERGED:
        good = differs <= max(TOLERANCE, found.delta_error if code == TOLERANCE_NOT_MET else 0.0)
        if code == CONVERGED:
            result.note(kind, differs)
    else:
        good = by_code.get(code) == true
    near = abs(float(exact.lowest[0])) < BORDER or float(exact.doubt[0]) > 0.1 * TOLERANCE
    verdict = "agrees" if good else "border" if near else "off"
    result.counts[kind, verdict] += 1
    if verdict == "off":
        result.examples.append({
            "diagram": kind, "inputs": given, "status": code, "exact": true, "differs": differs,
            "delta_error": found.delta_error,
        })  # fmt: skip


def run(seed: int, count: int, say: Callable[[str], None]) -> Findings:
    """Draw `count` diagrams of each kind."""
    result = Findings()
    for number, kind in enumerate(KINDS):
        random = np.random.default_rng([seed, 1000 + number])
        for _ in range(count):
            one(kind, random, result)
        say(f"diagrams with {kind}: {result.of('off', kind)} off")
    return result
