"""The methods of this project, called as `sweeps` calls them: through `sweep.solve`.

The mean torque of each design is an input of `sweep.solve`, so computing it is timed with it.
"""

from __future__ import annotations

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
    # Repeating cycles takes hundreds of them: few runs. Euler never closes at 0.
    found.append(
        Case("thesis", "Euler, 1 degree", own(threads, method="thesis"), runs=3,
             exponents=(1.0, 1.6, 2.0))
    )  # fmt: skip
    return found
