"""Is `delta_error` what it says? Estimates against true errors, for designs of sane ranges."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.stress import draw
from benchmarks.workers import in_processes
from engine_dyn import Family, diagram_from_points
from engine_dyn.speed.mean_gas import mean_gas_torque
from engine_dyn.speed.methods import CLOSURES
from engine_dyn.speed.torque import torque_extremes
from engine_dyn.status import CONVERGED, TOLERANCE_NOT_MET
from engine_dyn.types import Floats
from oracle import spline
from oracle.designs import smooth_pressure, table
from sweeps.reading.engine_files import load_engine

CURVES = 12
STEPS = (0.5, 1.0)
ENGINES = ("ntua", "b112", "diesel_105x137")

RANGES = {
    "crank ratio": "0.15 to 0.45",
    "cylinders": "1 to 12",
    "load exponent": "0, 1, 2 (a sixth each) and anything from 0 to 3",
    "bore": "60 to 200 mm",
    "stroke": "0.8 to 1.4 bores",
    "reciprocating mass": "0.5 to 2 kg times (bore/100 mm)³",
    "speed": "500 to 5000 rpm",
    "inertia": "such that δ would be 0.001 to 0.3 without load (evenly in the logarithm)",
    "friction": "0 to 30 % of the indicated torque",
    "load offset": "-50 to 99 % of the mean torque",
    "inertia model": "both",
    "closure": "power_mean three times in four, cycle_time",
}

FLOOR = 2e-10
COVERAGE, MEDIAN, TAIL = 0.999, 10.0, 100.0
"""Required: share of designs whose true error is below the estimate; median and 95th percentile of
estimate / max(true error, FLOOR). The floor is about a fifth of the constant in the estimate."""


@dataclass
class Reading:
    """Estimates and true relative errors of delta, with what they belong to."""

    estimate: Floats
    true: Floats
    diagram: Any
    closure: Any
    variable: Any
    exponent: Floats
    cylinders: Any
    status: Any
    asked: int
    examples: list[dict[str, Any]] = field(default_factory=list)
    """Designs whose true error is above the estimate, with all inputs."""

    def __len__(self) -> int:
        return self.true.size

    @property
    def ratio(self) -> Floats:
        """Estimate over true error, that at least `FLOOR`."""
        return np.asarray(self.estimate / np.maximum(self.true, FLOOR))

    def numbers(self, mask: Any = slice(None)) -> tuple[int, float, float, float, float, float]:
        """Designs, coverage, median and 95th percentile of the ratio, median and largest error."""
        true, ratio = self.true[mask], self.ratio[mask]
        covered = float(np.mean(true <= self.estimate[mask]))
        return (true.size, covered, float(np.median(ratio)), float(np.quantile(ratio, 0.95)),
                float(np.median(true)), float(true.max()))  # fmt: skip

    def groups(self) -> dict[str, Any]:
        """Masks by which the designs are told apart."""
        e = self.exponent
        found: dict[str, Any] = {"all": np.full(e.size, True)}
        found |= {str(name): self.diagram == name for name in np.unique(self.diagram)}
        found |= {f"closure {name}": self.closure == name for name in CLOSURES}
        found |= {"inertia constant": ~self.variable, "inertia variable": self.variable}
        found |= {f"exponent {value:g}": e == value for value in (0.0, 1.0, 2.0)}
        found["other exponents"] = ~np.isin(e, (0.0, 1.0, 2.0))
        for low, high in ((1, 2), (3, 6), (7, 12)):
            found[f"{low} to {high} cylinders"] = (self.cylinders >= low) & (self.cylinders <= high)
        return found


@cache
def diagrams() -> dict[str, Family]:
    """Smooth curves in closed form as points, and the catalogue's diagrams."""
    random = Random(11)
    curves = [smooth_pressure(random) for _ in range(CURVES)]
    found = {}
    for step in STEPS:
        made = []
        for curve in curves:
            degrees, bar = table(curve, step)
            made.append(diagram_from_points(np.radians(degrees), bar * 1e5))
        found[f"smooth curves, {step:g}°"] = Family(0.5 * np.arange(float(CURVES)), tuple(made))
    for name in ENGINES:
        family = load_engine(name, Path()).family
        assert isinstance(family, Family)
        found[f"engine {name}"] = family
    return found


def drawn(random: np.random.Generator, name: str, size: int) -> dict[str, Any]:
    """Columns of designs with the diagrams `name`."""
    family = diagrams()[name]
    last = family.row_count - 1
    bore = random.uniform(0.06, 0.2, size)
    columns: dict[str, Any] = {
        "row": random.choice(np.round(np.linspace(0.0, last, min(last + 1, 12)) * 4.0) / 4.0, size),
        "crankcase": random.choice([0.0, 101325.0], size),
        "crank_ratio": random.uniform(0.15, 0.45, size),
        "bore": bore,
        "stroke": bore * random.uniform(0.8, 1.4, size),
        "mass": random.uniform(0.5, 2.0, size) * (bore / 0.1) ** 3,
        "speed": random.uniform(500.0, 5000.0, size) * math.pi / 30.0,
        "exponent": np.where(
            random.uniform(size=size) < 0.5, random.choice([0.0, 1.0, 2.0], size),
            random.uniform(0.0, 3.0, size),
        ),
        "cylinders": random.integers(1, 13, size),
        "variable": random.uniform(size=size) < 0.5,
    }  # fmt: skip
    if name.startswith("smooth"):
        columns["row"] = random.integers(0, CURVES, size).astype(float)
    gas = mean_gas_torque(columns["crank_ratio"], columns["row"], family)
    lever = 0.125 * math.pi * bore**2 * columns["stroke"]
    indicated = columns["cylinders"] * lever * gas
    columns["friction"] = np.abs(indicated) * random.uniform(0.0, 0.3, size)
    columns["mean_torque"] = indicated - columns["friction"]
    share = np.where(random.uniform(size=size) < 0.5, 0.0, random.uniform(-0.5, 0.99, size))
    columns["offset"] = share * columns["mean_torque"]
    geometry = {
        "family": family, "cylinders": columns["cylinders"], "crank_ratio": columns["crank_ratio"],
        "row": columns["row"], "scale": 1.0, "crankcase_pressure": columns["crankcase"],
        "bore": bore, "double_radius": columns["stroke"], "mass": columns["mass"],
        "speed": columns["speed"], "friction_torque": columns["friction"],
    }  # fmt: skip
    # Only to set the size of delta.
    swing = torque_extremes(wanted=("energy_swing",), threads=1, **geometry)["energy_swing"]
    delta = np.exp(random.uniform(math.log(0.001), math.log(0.3), size))
    columns["inertia"] = swing / (delta * columns["speed"] ** 2)
    return columns


def measure(job: tuple[int, str, str, int]) -> Reading:
    """Estimates and true errors of `size` designs of one family and closure."""
    seed, name, closure, size = job
    family = diagrams()[name]
    key = sorted(diagrams()).index(name)
    columns = drawn(np.random.default_rng([seed, key, closure == "cycle_time"]), name, size)
    found = draw.Chunk(columns, closure, (size,), (seed, key)).solve(family=family, threads=1)
    exact = draw.exact(columns, closure, family)
    good = np.isin(found["status"], (CONVERGED, TOLERANCE_NOT_MET))
    good &= (exact.status == spline.CONVERGED) & (exact.doubt < 1e-10)
    true = np.abs(found["delta"] / exact.delta - 1.0)
    examples = [
        {
            "uncovered": name, "closure": closure,
            "inputs": {key: column[i].item() for key, column in columns.items()},
            "results": {key: array[i].item() for key, array in found.items()},
            "delta": float(exact.delta[i]), "error": float(true[i]),
        }
        for i in np.flatnonzero(good & (true > found["delta_error"]))
    ]  # fmt: skip
    return Reading(
        estimate=found["delta_error"][good],
        true=true[good],
        diagram=np.full(good.sum(), name),
        closure=np.full(good.sum(), closure),
        variable=columns["variable"][good],
        exponent=columns["exponent"][good],
        cylinders=columns["cylinders"][good],
        status=found["status"][good],
        asked=size,
        examples=examples,
    )


def joined(readings: list[Reading]) -> Reading:
    """One reading of several."""
    names = [n for n in Reading.__dataclass_fields__ if n not in ("asked", "examples")]
    columns: dict[str, Any] = {
        n: np.concatenate([getattr(reading, n) for reading in readings]) for n in names
    }
    return Reading(
        asked=sum(reading.asked for reading in readings),
        examples=[example for reading in readings for example in reading.examples],
        **columns,
    )


def jobs_of(seed: int, designs: int) -> list[tuple[int, str, str, int]]:
    """How many designs of each family and closure."""
    names = sorted(diagrams())
    each = designs // (4 * len(names))
    return [
        (seed, name, closure, max(1, share * each))
        for name in names
        for closure, share in (("power_mean", 3), ("cycle_time", 1))
    ]


def run(seed: int, designs: int, processes: int, say: Callable[[str], None]) -> Reading:
    """Read the meter, in processes of their own."""
    jobs = jobs_of(seed, designs)
    readings = []
    for done, reading in enumerate(in_processes(measure, jobs, processes), 1):
        readings.append(reading)
        say(f"delta_error: {done} of {len(jobs)} groups")
    return joined(readings)


def own_error(seed: int, designs: int = 24) -> float:
    """Largest relative change of the reference's delta with pieces half as long."""
    worst = 0.0
    for name, family in diagrams().items():
        columns = drawn(np.random.default_rng([seed, 99]), name, designs)
        one, two = (draw.exact(columns, "power_mean", family, splits) for splits in (1, 2))
        good = (one.status == spline.CONVERGED) & (two.status == spline.CONVERGED)
        worst = max(worst, float(np.abs(one.delta[good] / two.delta[good] - 1.0).max()))
    return worst
