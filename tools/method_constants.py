"""Derive the numerical constants that docs/solver.md states, and compare them with the code's.

Every constant that follows from mathematics is made again here, by rational arithmetic or with
NumPy and SciPy alone, and printed beside that of the code. Numbers in parentheses are equations of
docs/method.md and docs/solver.md. The exit status is 1 if any of them differs. Run it from the
project's root: `python tools/method_constants.py`.
"""

from __future__ import annotations

import importlib
import inspect
import math
import re
import sys
from collections.abc import Callable, Sequence
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.integrate import quad

WHERE = {
    "columns": "engine_dyn.speed.work.tabulation",
    "boxes": "engine_dyn.speed.work.boxes",
    "roughness": "engine_dyn.speed.work.columns",
    "extrema": "engine_dyn.speed.work.maxima",
    "block": "engine_dyn.speed.batch.block",
    "interpolation": "engine_dyn.speed.work.interpolation",
    "vectors": "engine_dyn.speed.vectors",
    "weights": "engine_dyn.speed.batch.weights",
    "solution": "engine_dyn.speed.batch.solution",
    "speeds": "engine_dyn.speed.general.speeds",
    "laws": "engine_dyn.loads.laws",
    "mechanism": "engine_dyn.geometry.slider_crank",
    "diesel cycle": "engine_dyn.pressure.diesel_cycle",
}
"""Modules of the constants; the one place to correct when files move."""

Row = tuple[str, str, float, float, float]
"""Equation, name, derived value, value of the code, allowed difference."""

HALF = Fraction(1, 2)


def of_code(room: str, name: str) -> Any:
    """Take a constant or a function of the code; of a compiled function its Python source's."""
    found = getattr(importlib.import_module(WHERE[room]), name)
    return getattr(found, "py_func", found)


def stencil(nodes: Sequence[int], wanted: Callable[[int], Fraction]) -> list[Fraction]:
    """Weights of nodes that give `wanted(k)` of t^k for every k below their number."""
    rows = [[Fraction(node) ** k for node in nodes] + [wanted(k)] for k in range(len(nodes))]
    for i in range(len(rows)):
        pivot = next(row for row in rows[i:] if row[i] != 0)
        rows.remove(pivot)
        rows.insert(i, [value / pivot[i] for value in pivot])
        rows = [
            row if j == i else [a - row[i] * b for a, b in zip(row, rows[i], strict=True)]
            for j, row in enumerate(rows)
        ]
    return [row[-1] for row in rows]


def mean_of(k: int) -> Fraction:
    """Integral of t^k from 0 to 1."""
    return Fraction(1, k + 1)


def moment_of(k: int) -> Fraction:
    """Integral of (t - 1/2) t^k from 0 to 1."""
    return Fraction(1, k + 2) - HALF * Fraction(1, k + 1)


def gauss_points() -> list[Row]:
    """Three-point Gauss-Legendre on both halves of an interval."""
    node, weight = np.polynomial.legendre.leggauss(3)
    points, weights = of_code("columns", "POINTS"), of_code("columns", "WEIGHTS")
    rows: list[Row] = []
    for i in range(6):
        place = 0.5 * (i // 3) + 0.25 * (1.0 + node[i % 3])
        rows.append(("(56)", f"Gauss point {i + 1}", place, points[i], 1e-15))
        rows.append(("(56)", f"Gauss weight {i + 1}", 0.25 * weight[i % 3], weights[i], 1e-15))
    return rows


def obreshkov() -> list[Row]:
    """Weights of the two-point formula: exact for polynomials up to the third degree."""
    a, b = Fraction(1, 2), Fraction(1, 12)
    for k in range(4):
        ends = 2 if k == 0 else 1
        slope = 1 if k == 1 else 0
        assert Fraction(1, k + 1) == a * ends + b * (slope - k), k
    error = Fraction(1, 5) - (a - 4 * b)
    source = inspect.getsource(of_code("speeds", "_load_missed"))
    found = [int(n) for n in re.findall(r"1\.0 / (\d+)\.0", source)]
    return [
        ("(79)", "error of the formula, 1/", float(math.factorial(4) / error), found[0], 0.0),
        ("(103)", "error of a cubic, 1/", float(math.factorial(4) * 16), found[1], 0.0),
    ]


def between_nodes() -> list[Row]:
    """The quartic of the middle."""
    value, bump = of_code("extrema", "max_between")(0.0, 0.0, 1.0, -1.0, 1.0)
    middle = of_code("extrema", "cubic_in_middle")(0.0, 0.0, 1.0, -1.0)
    return [
        ("(60)", "cubic in the middle of an interval", 0.25, middle, 1e-15),
        ("(61)", "quartic there", 1.0, bump, 1e-15),
        ("(99)", "cubic and quartic there", 1.25, value, 1e-15),
    ]


def columns() -> list[Row]:
    """Error of the velocity as a sum of columns."""
    velocity = of_code("mechanism", "velocity")
    edges, kinds = of_code("boxes", "RATIO_EDGES"), of_code("boxes", "KINDS")
    largest = of_code("boxes", "LARGEST_RATIO")
    angle, worst = np.linspace(0.0, 2.0 * math.pi, 181), [0.0, 0.0]
    for number in range(kinds * (len(edges) - 1)):
        kind = number % kinds
        if edges[number // kinds] >= largest[(kind + 1) // 2]:
            continue
        box = of_code("boxes", "box_of")(number, 0.0, 0.0)
        made = box.transform @ velocity(angle, box.samples[:, :1], box.samples[:, 1:])
        for x in np.linspace(-0.98, 1.0, 13):
            for y in (-1.0, -0.7, 0.0, 0.7, 1.0):
                ratio, offset = box.ratio[0] + x * box.ratio[1], box.offset[0] + y * box.offset[1]
                (factors,) = box.factors(np.array([ratio]), np.array([offset]))
                missed = np.abs(factors @ made - velocity(angle, ratio, offset)).max()
                worst[kind > 0] = max(worst[kind > 0], missed)
    return [
        ("(58)", "velocity without offset (3e-8 stated)", 0.0, worst[0], 3e-8),
        ("(58)", "velocity with offset (3e-8)", 0.0, worst[1], 3e-8),
    ]


def resolution() -> list[Row]:
    """Weights of every other node in the middle between two of them."""
    derived = stencil([-5, -3, -1, 1, 3, 5], lambda k: Fraction(int(k == 0)))
    source = inspect.getsource(of_code("roughness", "_roughness"))
    found = [float(n) / 256.0 for n in re.findall(r"(-?\d+\.0) / 256\.0", source)]
    return [
        ("(62)", f"weight {i + 1} of other nodes", float(derived[2 - i]), found[i], 1e-16)
        for i in range(3)
    ]


def recurrence() -> list[Row]:
    """Weights along the coarse nodes, by integrals of the exponential."""
    rows: list[Row] = []
    form = of_code("laws", "Form")(of_code("laws", "POWER"), 1.0, False, np.empty((3, 0)))
    for x in (1e-3, 0.01, 0.05):
        one = np.ones(1)
        designs = SimpleNamespace(
            kappa=x * one, speed=100.0 * one, first=2.0 * one, second=0.0 * one
        )
        found = of_code("weights", "weights_of")(designs, form, 1.0, 36)

        def moment(k: int, x: float = x) -> float:
            return float(quad(lambda t: x * math.exp(-x * (1.0 - t)) * (t - 0.5) ** k, 0.0, 1.0)[0])

        rows += [
            ("(70)", f"decay, x = {x:g}", math.exp(-x), found.decay[0], 1e-15),
            ("(70)", f"weight of the mean, x = {x:g}", moment(0), found.of_mass[0], 1e-14),
            ("(71)", f"weight of the moment, x = {x:g}", 12.0 * moment(1), found.of_tilt[0],
             2e-8 * x * x),
            ("(74)", f"end of a period, x = {x:g}", 1.0 - math.exp(-36.0 * x), found.end[0], 1e-15),
        ]  # fmt: skip
    return rows


def stencils() -> list[Row]:
    """Mean and first moment of an interval by nodes around it, as the kernels take them."""
    mean, moment = stencil(range(-2, 4), mean_of), stencil(range(-1, 3), moment_of)
    pairs = of_code("interpolation", "MEAN_BY_PAIRS")
    nodes, rows, new_rows = 12, [], of_code("vectors", "new_rows")
    halo = of_code("block", "HALO")
    long = nodes + 2 * halo
    curves = of_code("block", "Curves")(
        *(new_rows(nodes) for _ in range(3)), *(new_rows(long) for _ in range(4))
    )
    for place in range(-2, 4):
        curves.work[:] = 0.0
        curves.work[halo + place] = 1.0  # seen from the interval behind node 0
        found = []
        for of_mass, of_tilt in ((1.0, 0.0), (0.0, 1.0)):
            weights = np.broadcast_to([[0.0], [of_mass], [of_tilt]], (3, curves.work.shape[1]))
            of_code("solution", "run_load")(*weights, curves.work, curves)
            found.append(curves.load[halo + 1, 0])
        of_mean = float(mean[place + 2])
        of_moment = float(moment[place + 1]) if -1 <= place <= 2 else 0.0
        rows += [
            ("(72)", f"mean, node {place}, of the columns", of_mean, pairs[max(-place, place - 1)],
             1e-15),
            ("(72)", f"mean, node {place}, of the block", of_mean, found[0], 1e-15),
            ("(72)", f"moment, node {place}, of the block", of_moment, found[1], 1e-15),
        ]  # fmt: skip
    return rows


def rest() -> list[Row]:
    """Constants of pressure models that are numbers of mathematics."""
    return [("", "Wiebe's factor for 99.9 %", -math.log(1.0 - 0.999),
             of_code("diesel cycle", "WIEBE"), 1e-12)]  # fmt: skip


def main() -> int:
    print(f"{'equation':9} {'constant':52} {'derived':>24} {'code':>24}")
    wrong = 0
    for chapter in (
        gauss_points, obreshkov, between_nodes, columns, resolution, recurrence, stencils, rest,
    ):  # fmt: skip
        for equation, name, derived, given, allowed in chapter():
            differs = not abs(derived - given) <= allowed
            wrong += differs
            print(f"{equation:9} {name:52} {derived:24.16g} {given:24.16g}"
                  f"{'   differs' if differs else ''}")  # fmt: skip
    print(f"{wrong} differ" if wrong else "all agree")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
