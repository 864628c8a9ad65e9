"""The methods of this project, called as `sweeps` calls them: through `sweep.solve`.

The mean torque of each design is an input of `sweep.solve`, so computing it is timed with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from benchmarks.peers import Case, Floats, Solver
from benchmarks.problem import Designs, Scene, family, own_inputs
from engine_dyn.speed import sweep

FAMILY = family()


def answer(
    source: Scene | Designs, threads: int, wanted: tuple[str, ...] = ("delta",), **options: Any
) -> dict[str, Any]:
    """Results of `sweep.solve` for a scene or a table."""
    return sweep.solve(wanted=wanted, threads=threads, **own_inputs(source, FAMILY), **options)


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


# To be kept by whoever changes a kernel: what the code does for one design, counted by hand.
# The report sets rate x flops against the machine's measured peak; None is shown as not counted.
# Divisions, roots and powers count as one each, so the fraction is a lower bound of the load.
OPERATIONS: dict[str, Operations | None] = {
    "factorial, alpha 2, Z 1": Operations(
        4100,
        "30 a coarse node (92), 14 a chunk of four, 70 for the work of a period, 900 for weights "
        "and two extremes",
    ),
    "factorial, alpha 1, Z 1": Operations(
        7200,
        "12 a coarse node (92) once, 1.1 times 20 for the rest and 28 for what it adds and how "
        "that changes it, extremes as above",
    ),
    "factorial, alpha 0, Z 1": Operations(
        4200, "one pass of 32 a coarse node (92), extremes as above"
    ),
    "factorial, alpha 2, Z 8": Operations(1800, "24 coarse nodes"),
    "factorial, alpha 1.6, Z 1": Operations(
        9800, "as alpha 1 with 25 for the rest, and 22 for the mean"
    ),
    "factorial, alpha 2, Z 1, variable": Operations(
        9600, "as alpha 1 with 6 for the rest, 12 more twice for the inertia, and 22 for the mean"
    ),
    "table": Operations(
        32000, "20000 to interpolate a coarse table, 2400 for fine nodes, the rest the passes"
    ),
}
