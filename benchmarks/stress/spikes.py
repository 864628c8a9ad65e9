"""Diagrams with a spike, with noise, with steps, through `engine_dyn.periodic_speed`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from benchmarks.stress import draw
from benchmarks.stress.findings import Findings, Say
from benchmarks.stress.judging import QUANTITIES, judge
from engine_dyn import diagram_from_points, family_from_diagrams, periodic_speed
from engine_dyn.status import CONVERGED
from engine_dyn.types import Floats

PART = "Diagrams with a spike, with noise, with steps"

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
        result.counts["refused", kind] += 1
        return
    given = inputs(random)
    answer = periodic_speed(diagram, **given)
    columns = {
        "row": 0.0, "crankcase": 101325.0, "mass": given["reciprocating_mass"],
        "exponent": given["load_exponent"], "mean_torque": answer.torque_mean, "offset": 0.0,
        "variable": given["inertia_model"] == "variable",
        **{name: given[name] for name in ("crank_ratio", "bore", "stroke", "inertia", "speed",
                                          "cylinders")},
    }  # fmt: skip
    exact = draw.exact(columns, given["closure"], family_from_diagrams([0.0], [diagram]))
    names = ("status", "delta_error", *QUANTITIES)
    found = {name: np.array([getattr(answer, name)]) for name in names}
    (verdict,), differs = judge(found, exact, given["speed"])
    # One design at a time is always followed to an answer.
    verdict = "off" if verdict == "gave up" else str(verdict)
    result.counts[verdict, kind] += 1
    if verdict == "agrees" and answer.status == CONVERGED:
        result.note(kind, float(differs["delta"][0]))
    elif verdict in ("off", "outcome"):
        told = {name: float(values[0]) for name, values in {**found, **differs}.items()}
        exactly = int(exact.status[0])
        result.examples.append(
            {"what": f"{verdict} {kind}", "inputs": given, "exact": exactly, **told}
        )


def run(seed: int, number: int, say: Say) -> Findings:
    """Draw so many diagrams of each kind."""
    result = Findings()
    for place, kind in enumerate(KINDS):
        random = np.random.default_rng([seed, 1000 + place])
        for _ in range(number):
            one(kind, random, result)
        say(f"diagrams with {kind}: {result.of('off', kind)} off")
    return result


def words(_: Findings) -> dict[str, str]:
    """No sentence tells of them: the table does."""
    return {}
