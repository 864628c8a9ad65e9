"""The methods of this project, called as `sweeps` calls them: through `sweep.solve`.

The mean torque of each design is an input of `sweep.solve`, so computing it is timed with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from benchmarks.peers import Case, Solver
from benchmarks.problem import Designs, Scene, family, own_inputs
from engine_dyn.speed import dispatch
from engine_dyn.types import Floats

FAMILY = family()


def answer(
    source: Scene | Designs, threads: int, wanted: tuple[str, ...] = ("delta",), **options: Any
) -> dict[str, Any]:
    """Results of `sweep.solve` for a scene or a table."""
    return dispatch.solve(wanted=wanted, threads=threads, **own_inputs(source, FAMILY), **options)


def own(threads: int, **options: Any) -> Solver:
    """Delta of a table of designs."""

    def solver(designs: Designs) -> Floats:
        delta: Floats = answer(designs, threads, **options)["delta"]
        return delta

    return solver


def cases(threads: int, quick: bool) -> list[Case]:
    """Every method, at several tolerances and node counts."""
    auto = (1e-6,) if quick else (1e-4, 1e-6, 1e-8, 1e-10)
    found = [Case("auto", f"tolerance {t:.0e}", own(threads, tolerance=t)) for t in auto]
    for finer in () if quick else (2, 4):
        found.append(Case("auto", f"tolerance 1e-06, nodes x {finer}", own(threads, finer=finer)))
    for finer in (1,) if quick else (1, 2, 4):
        nodes = f"nodes x {finer}"
        found.append(Case("newton", nodes, own(threads, method="newton", finer=finer)))
    # What peers that solve exponent 2 alone are compared with.
    found.append(
        Case("auto", "tolerance 1e-06, exponent 2", own(threads, tolerance=1e-6), exponents=(2.0,))
    )
    found.append(
        Case("closed", "exponents 0 and 2", own(threads, method="closed"), exponents=(0.0, 2.0))
    )
    # Repeating cycles takes hundreds of them: few designs, few runs. Euler never closes at 0.
    found.append(Case("picard", "until closed", own(threads, method="picard"), runs=3))
    found.append(
        Case("thesis", "Euler, 1 degree", own(threads, method="thesis"), runs=3,
             exponents=(1.0, 1.6, 2.0))
    )  # fmt: skip
    return found


@dataclass(frozen=True)
class Operations:
    """Work of one design by count: additions and multiplications (a fused one is two)."""

    flops: float
    note: str


COARSE_NODES = {1: 92, 4: 48, 8: 24}
"""Coarse nodes that the diagram takes over a firing period, by cylinders."""

# To be kept by whoever changes a kernel: what the code does for one design, counted by hand in
# `recurrence.py`, `iteration.py` and `extrema.py` of `engine_dyn/speed/batch`.
LINEAR, CONSTANT_LOAD, RECURRENCE, MEAN, VARIABLE = 28, 30, 12, 20, 12
REMAINDER, RESPONSE = {1.0: 18, 2.0: 6}, {1.0: 22, 2.0: 18}
REMAINDER_OF_POWERS, RESPONSE_OF_POWERS = 26, 26
CHUNK, WORK, EXTREMES = 14 / 4, 70, 900
OF_TABLE = Operations(
    32000, "20000 to interpolate a coarse table, 2400 for fine nodes, the rest the passes"
)


def operations(scene: Scene, passes: float) -> Operations:
    """Operations of a design of a factorial scene, which its load takes so many passes."""
    nodes, alpha = COARSE_NODES[scene.cylinders], scene.exponent
    if alpha == 0.0:
        node, note = float(CONSTANT_LOAD), f"one pass of {CONSTANT_LOAD} a node"
    elif alpha == 2.0 and not scene.variable:
        node, note = float(LINEAR), f"one pass of {LINEAR} a node"
    else:
        remainder = REMAINDER.get(alpha, REMAINDER_OF_POWERS) + (VARIABLE if scene.variable else 0)
        response = RESPONSE.get(alpha, RESPONSE_OF_POWERS) + (VARIABLE if scene.variable else 0)
        last = 0 if alpha == 1.0 else MEAN
        node = RECURRENCE + (passes - 1.0) * (remainder + response) + last
        note = f"{RECURRENCE} a node, {passes - 1.0:.2f} times {remainder} for the remainder and "
        note += f"{response} for what it adds" + (f", {last} for the mean" if last else "")
    total = nodes * (node + CHUNK) + (WORK if alpha > 0.0 else 0) + EXTREMES
    return Operations(total, f"{nodes} coarse nodes: {note}")
