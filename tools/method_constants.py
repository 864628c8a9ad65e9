"""Derive the numerical constants that docs/method.md states, and compare them with the code's.

Every constant that is derived or fitted is made again here, by rational arithmetic or with NumPy
alone, and printed beside the constant of the code. Numbers in parentheses are equations
of docs/method.md. The exit status is 1 if any of them differs. Run it from the project's root:
`python tools/method_constants.py`.
"""

from __future__ import annotations

import importlib
import inspect
import math
import re
import sys
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.polynomial import polynomial

WHERE = {
    "columns": "engine_dyn.speed.work.columns",
    "boxes": "engine_dyn.speed.work.boxes",
    "integrals": "engine_dyn.speed.work.tabulation",
    "summits": "engine_dyn.speed.work.summit",
    "batch tables": "engine_dyn.speed.batch.tables",
    "batch weights": "engine_dyn.speed.batch.weights",
    "radau": "engine_dyn.speed.general.radau",
    "speeds": "engine_dyn.speed.general.speeds",
    "crank train": "engine_dyn.geometry.slider_crank",
    "diesel cycle": "engine_dyn.pressure.diesel_cycle",
}
"""Modules of the constants; the one place to correct when files move."""

Row = tuple[str, str, float, float, float]
"""Equation, name, derived value, value of the code, allowed difference."""


def of_code(room: str, name: str) -> Any:
    """Take a constant or a function of the code; of a compiled function its Python source's."""
    found = getattr(importlib.import_module(WHERE[room]), name)
    return getattr(found, "py_func", found)


def ratios_in(function: Callable[..., Any]) -> list[Fraction]:
    """Quotients of two numbers in a function's source, in the order in which they stand."""
    found = re.findall(r"(-?\d+)\.0 / (\d+)\.0", inspect.getsource(function))
    return [Fraction(int(above), int(below)) for above, below in found]


def through(nodes: range, functional: Callable[[int], Fraction]) -> list[Fraction]:
    """Weights of values at nodes that give a functional exactly for as many powers of t."""
    matrix = [[Fraction(t) ** k for t in nodes] + [functional(k)] for k in range(len(nodes))]
    size = len(nodes)
    for i in range(size):
        pivot = next(row for row in range(i, size) if matrix[row][i])
        matrix[i], matrix[pivot] = matrix[pivot], matrix[i]
        matrix[i] = [value / matrix[i][i] for value in matrix[i]]
        for row in range(size):
            if row != i:
                factor = matrix[row][i]
                matrix[row] = [v - factor * w for v, w in zip(matrix[row], matrix[i], strict=True)]
    return [row[-1] for row in matrix]


def gauss_points() -> list[Row]:
    """Three-point Gauss-Legendre on each half of [0, 1]."""
    node, weight = np.polynomial.legendre.leggauss(3)
    points, weights = of_code("integrals", "POINTS"), of_code("integrals", "WEIGHTS")
    rows: list[Row] = []
    for i in range(6):
        begin, k = 0.5 * (i // 3), i % 3
        rows += [
            ("(49)", f"Gauss point {i + 1}", begin + 0.25 * (1.0 + node[k]), points[i], 1e-15),
            ("(49)", f"Gauss weight {i + 1}", 0.25 * weight[k], weights[i], 1e-15),
        ]
    return rows


def between_nodes() -> list[Row]:
    """Polynomials between nodes, and what they miss."""
    middle = through(range(-2, 4), lambda k: Fraction(1, 2) ** k)
    found = ratios_in(of_code("columns", "_roughness"))
    rows: list[Row] = [
        ("(56)", f"weight {i + 1} of the middle", float(middle[2 - i]), float(found[i]), 0.0)
        for i in range(3)
    ]
    value, bump = of_code("summits", "peak_between")(0.0, 0.0, 1.0, -1.0, 1.0)
    # Two-point formula: int_0^1 t^4 dt less what values and slopes at both ends give.
    a, b = Fraction(1, 2), Fraction(1, 12)
    for k in range(4):
        slopes = (1 if k == 1 else 0) - k
        assert Fraction(1, k + 1) == a * (2 if k == 0 else 1) + b * slopes, k
    formula, cubic = ratios_in(of_code("speeds", "_load_missed"))[-2:]
    return [
        *rows,
        ("(91)", "quartic in the middle of an interval", 1.0, bump, 1e-15),
        ("(91)", "cubic and quartic there", 1.25, value, 1e-15),
        ("(63)", "error of the two-point formula",
         float((Fraction(1, 5) - (a - 4 * b)) / math.factorial(4)), float(formula), 0.0),
        ("(95)", "error of a cubic", 1.0 / (math.factorial(4) * 16), float(cubic), 0.0),
    ]  # fmt: skip


def moments() -> list[Row]:
    """Mean and first moment of a polynomial over an interval, and their weights in a recurrence."""
    mean = through(range(-2, 4), lambda k: Fraction(1, k + 1))
    first = through(range(-1, 3), lambda k: Fraction(1, k + 2) - Fraction(1, 2 * k + 2))
    rows: list[Row] = []
    for node in range(-2, 4):
        curve = np.zeros((4, 12))
        curve[0, 5 + node] = 1.0
        of_code("batch tables", "add_moments")(curve)
        rows.append(
            ("(66)", f"mean: weight of node {node}", float(mean[node + 2]), -curve[3, 5], 1e-15)
        )
        if -1 <= node <= 2:
            given = float(first[node + 1])
            rows.append(("(66)", f"moment: weight of node {node}", given, curve[2, 5], 1e-15))
    # The recurrence adds x exp(-x (1 - t)) times the curve, whose slope is 12 first moments.
    numbers = re.search(
        r"of_tilt = .*\((\d\.\d+) \+ square / (\d+)\.0\)",
        inspect.getsource(importlib.import_module(WHERE["batch weights"])),
    )
    assert numbers is not None
    second, fourth = (Fraction(12, math.factorial(k) * (k + 2) * 2 ** (k + 1)) for k in (3, 5))
    rows += [
        ("(65)", "weight of the moment, x^2", float(second), float(numbers[1]), 1e-15),
        ("(65)", "weight of the moment, x^4", float(fourth), 1.0 / float(numbers[2]), 1e-15),
    ]
    return rows


def boxes() -> list[Row]:
    """What sums of products of Chebyshev polynomials miss of the velocity, docs/method.md (60)."""
    box_of, factor = of_code("boxes", "box_of"), of_code("boxes", "factor_of")
    velocity = of_code("crank train", "velocity")
    angle, worst = np.linspace(0.0, math.tau, 181), 0.0
    for number in range(3 * (len(of_code("boxes", "RATIO_EDGES")) - 1)):
        box = box_of(number)
        (middle, half), (aside, width) = box.ratio, box.offset
        columns = box.transform @ velocity(angle, *(side[:, None] for side in box.samples.T))
        for u in np.linspace(-0.999, 1.0, 9):  # no crank ratio is 0
            for v in np.linspace(-1.0, 1.0, 9) if width else (0.0,):
                factors = np.array([factor(i, u) * factor(j, v) for i, j in box.degrees.tolist()])
                exact = velocity(angle, middle + half * u, aside + width * v)
                worst = max(worst, float(np.abs(factors @ columns - exact).max()))
    return [("(60)", "velocity by columns (1e-8 stated)", 0.0, worst, 1e-8)]


def radau() -> list[Row]:
    """Radau's formula with three stages: collocation at places that integrate the fifth degree."""
    # The places are the roots of the second derivative of t^2 (t - 1)^3.
    curve = polynomial.Polynomial([0, 0, 1]) * polynomial.Polynomial([-1, 1]) ** 3
    places = np.sort(curve.deriv(2).roots().real)
    rows: list[Row] = [
        ("(126)", f"place {i + 1}", places[i], of_code("radau", f"PLACE_{i + 1}"), 1e-14)
        for i in range(2)
    ]
    start = polynomial.Polynomial([0.0, 1.0])
    for j in range(3):
        others = np.delete(places, j)
        stage = polynomial.Polynomial.fromroots(others)
        weight = (stage / stage(places[j])).integ()
        rows += [
            ("(126)", f"weight {i + 1}{j + 1}", weight(places[i]),
             of_code("radau", f"A{i + 1}{j + 1}"), 1e-13)
            for i in range(3)
        ]  # fmt: skip
        rise = start * stage
        end = (rise / rise(places[j])).deriv()(1.0)
        rows.append(("(127)", f"slope at the end, stage {j + 1}", end,
                     of_code("radau", f"END_{j + 1}"), 1e-12))  # fmt: skip
    return rows


def rest() -> list[Row]:
    """Constants of pressure models that are numbers of mathematics."""
    return [("", "Wiebe's factor for 99.9 %", -math.log(1.0 - 0.999),
             of_code("diesel cycle", "WIEBE"), 1e-12)]  # fmt: skip


def main() -> int:
    print(f"{'equation':9} {'constant':52} {'derived':>24} {'code':>24}")
    wrong = 0
    for chapter in (gauss_points, between_nodes, moments, boxes, radau, rest):
        for equation, name, derived, given, allowed in chapter():
            differs = not abs(derived - given) <= allowed
            wrong += differs
            print(f"{equation:9} {name:52} {derived:24.16g} {given:24.16g}"
                  f"{'   differs' if differs else ''}")  # fmt: skip
    print(f"{wrong} differ" if wrong else "all agree")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
