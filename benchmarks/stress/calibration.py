"""Is `delta_error` what it says? Estimates against true errors, for designs of sane ranges.

The ranges are those of docs/stability/error_ranges.csv.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.stress import draw
from benchmarks.stress.absurd import example
from benchmarks.stress.findings import Findings, Say, count, gathered, size
from engine_dyn import Family, diagram_from_points
from engine_dyn.speed.torque import mean_gas_torque, torque_extremes
from engine_dyn.status import CONVERGED, TOLERANCE_NOT_MET
from engine_dyn.types import Floats
from oracle import spline
from oracle.designs import smooth_pressure
from oracle.designs import table as points_of
from sweeps.scene.engine.engine_files import load_engine

PART = "delta_error"

CURVES = 12
STEPS = (0.5, 1.0)
ENGINES = ("ntua", "b112", "diesel_105x137")

FLOOR = 2e-10
COVERAGE, MEDIAN, TAIL = 0.999, 10.0, 100.0
"""Required: share of designs whose true error is below the estimate; median and 95th percentile of
estimate / max(true error, FLOOR). The floor is about a fifth of the constant in the estimate."""


@dataclass(frozen=True)
class Numbers:
    """Of some designs: coverage, ratios of estimate to true error, and true errors."""

    designs: int
    covered: float
    median: float
    tail: float  # 95th percentile
    typical: float  # true error, median
    largest: float

    @staticmethod
    def of(true: Floats, estimate: Floats) -> Numbers:
        """Numbers of some designs; a true error below `FLOOR` counts as that."""
        ratio = estimate / np.maximum(true, FLOOR)
        return Numbers(
            true.size, float(np.mean(true <= estimate)), float(np.median(ratio)),
            float(np.quantile(ratio, 0.95)), float(np.median(true)), float(true.max()),
        )  # fmt: skip

    @property
    def met(self) -> bool:
        """Whether the estimate is what it must be."""
        return self.covered >= COVERAGE and self.median <= MEDIAN and self.tail <= TAIL


@cache
def diagrams() -> dict[str, Family]:
    """Smooth curves in closed form as points, and the catalogue's diagrams."""
    random = Random(11)
    curves = [smooth_pressure(random) for _ in range(CURVES)]
    found = {}
    for step in STEPS:
        made = []
        for curve in curves:
            degrees, bar = points_of(curve, step)
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


def measure(job: tuple[int, str, str, int]) -> Findings:
    """Estimates and true errors of so many designs of one family and closure."""
    seed, name, closure, number = job
    key = sorted(diagrams()).index(name)
    columns = drawn(np.random.default_rng([seed, key, closure == "cycle_time"]), name, number)
    chunk = draw.Chunk(columns, closure, (number,), (seed, key), diagrams=diagrams()[name])
    found, exact = chunk.solve(threads=1), chunk.exact()
    good = np.isin(found["status"], (CONVERGED, TOLERANCE_NOT_MET))
    good &= (exact.status == spline.CONVERGED) & (exact.doubt < 1e-10)
    true = np.abs(found["delta"] / exact.delta - 1.0)
    result = Findings(Counter({("asked",): number}))

    def tell(i: int) -> dict[str, Any]:
        return {**example(chunk, i, found), "delta": float(exact.delta[i]), "error": float(true[i])}

    result.mark("above", name, mask=good & (true > found["delta_error"]), tell=tell)
    result.keep(
        estimate=found["delta_error"][good], true=true[good], diagram=np.full(good.sum(), name),
        status=found["status"][good],
    )  # fmt: skip
    return result


def jobs_of(seed: int, designs: int) -> list[tuple[int, str, str, int]]:
    """How many designs of each family and closure."""
    names = sorted(diagrams())
    each = designs // (4 * len(names))
    return [
        (seed, name, closure, max(1, part * each))
        for name in names
        for closure, part in (("power_mean", 3), ("cycle_time", 1))
    ]


def run(seed: int, designs: int, processes: int, say: Say) -> Findings:
    """Read the meter, in processes of their own; it is a defect where it is not what it must be."""
    result = gathered(measure, jobs_of(seed, designs), processes, say, "delta_error, groups")
    if not Numbers.of(result.array("true"), result.array("estimate")).met:
        result.counts[("uncovered",)] += 1
    return result


# What is told -------------------------------------------------------------------------------------


def words(found: Findings) -> dict[str, str]:
    """Sentences with figures, by their names."""
    true, estimate = found.array("true"), found.array("estimate")
    n, short = Numbers.of(true, estimate), true > estimate
    shortfall = "No true error is above its estimate."
    if short.any():
        factor = true[short] / np.maximum(estimate[short], 1e-300)
        shortfall = (
            f"Where the true error is above the estimate ({count(int(short.sum()))} designs) it "
            f"exceeds it by a factor of {np.median(factor):.2g} (median) to {factor.max():.2g}."
        )
    return {
        "estimate": "`delta_error`: the true error is below the estimate for "
        f"{100.0 * n.covered:.2f} % of {count(n.designs)} realistic designs; median of estimate "
        f"over error {n.median:.3g}, 95th percentile {n.tail:.3g}. Required: "
        f"{100.0 * COVERAGE:.1f} %, {MEDIAN:g} and {TAIL:g}: {'met' if n.met else 'not met'}.",
        "shortfall": shortfall,
    }


def table(found: Findings) -> list[list[str]]:
    """The meter for all designs, and for those of each family of diagrams; heads first."""
    head = ["designs", "number", "true error ≤ estimate, %", "median of estimate/error",
            "95th percentile", "median true error", "largest"]  # fmt: skip
    rows, diagram = [head], found.array("diagram")
    for name in ("all", *np.unique(diagram).tolist()):
        mask = (diagram == name) | (name == "all")
        n = Numbers.of(found.array("true")[mask], found.array("estimate")[mask])
        rows.append([name, count(n.designs), f"{100.0 * n.covered:.2f}", f"{n.median:.3g}",
                     f"{n.tail:.3g}", size(n.typical), size(n.largest)])  # fmt: skip
    return rows
