"""Derive the numerical constants that docs/method.md states, and compare them with the code's.

Every constant that is derived or fitted is made again here, by rational arithmetic or with NumPy
and SciPy alone, and printed beside the constant of the code. Numbers in parentheses are equations
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
from numpy.polynomial import chebyshev, polynomial
from scipy.integrate import quad
from scipy.special import binom, iv

WHERE = {
    "work tables": "engine_dyn.speed.tables.work_tables",
    "pressure grid": "engine_dyn.speed.tables.pressure_grid",
    "extrema": "engine_dyn.speed.tables.extremes",
    "segments": "engine_dyn.speed.general.segments",
    "stiff": "engine_dyn.speed.general.stiff",
    "batch weights": "engine_dyn.speed.batch.reduction",
    "batch powers": "engine_dyn.speed.batch.powers",
    "two grids": "engine_dyn.speed.batch.two_grid",
    "harmonics": "engine_dyn.geometry.velocity_harmonics",
    "speeds": "engine_dyn.speed.general.speeds",
    "diesel cycle": "engine_dyn.pressure.diesel_cycle",
}
"""Modules of the constants; the one place to correct when files move."""

Row = tuple[str, str, float, float, float]
"""Equation, name, derived value, value of the code, allowed difference."""


def of_code(room: str, name: str) -> Any:
    """Take a constant or a function of the code; of a compiled function its Python source's."""
    found = getattr(importlib.import_module(WHERE[room]), name)
    return getattr(found, "py_func", found)


def numbers_in(function: Callable[..., Any]) -> list[float]:
    """Decimal numbers with many digits in a function's source, in the order in which they stand."""
    return [float(n) for n in re.findall(r"-?\d+\.\d{5,}", inspect.getsource(function))]


def gauss_points() -> list[Row]:
    """Three-point Gauss-Legendre on [0, 1]."""
    node, weight = np.polynomial.legendre.leggauss(3)
    points = of_code("pressure grid", "GAUSS_POINTS")
    end, middle = of_code("pressure grid", "END_WEIGHT"), of_code("pressure grid", "MIDDLE_WEIGHT")
    weights = (end, middle, end)
    rows = [
        ("(49)", f"Gauss point {i + 1}", 0.5 * (1.0 + node[i]), points[i], 1e-15) for i in range(3)
    ]
    rows += [
        ("(49)", f"Gauss weight {i + 1}", 0.5 * weight[i], weights[i], 1e-15) for i in range(3)
    ]
    return rows


def obreshkov() -> list[Row]:
    """Weights of the two-point formula: exact for polynomials up to the fourth degree."""
    # int_0^1 t^k dt = A (0^k + 1) + B (k 0^(k-1) - k) for k = 0 .. 3 gives A and B.
    a, b = Fraction(1, 2), Fraction(1, 12)
    for k in range(4):
        ends = 2 if k == 0 else 1
        slope = 1 if k == 1 else 0
        assert Fraction(1, k + 1) == a * ends + b * (slope - k), k
    error = Fraction(1, 5) - (a - 4 * b)
    missed = of_code("speeds", "load_missed")
    source = inspect.getsource(missed)
    found = [int(n) for n in re.findall(r"1\.0 / (\d+)\.0", source)]
    rows: list[Row] = [
        ("(63)", "error of the formula, 1/", float(math.factorial(4) / error), found[0], 0.0),
        ("(95)", "error of a cubic, 1/", float(math.factorial(4) * 16), found[1], 0.0),
    ]
    for x in (1e-3, 0.3, 40.0):
        loss, before, behind, cross = of_code("segments", "two_point")(x, 1.0)
        below = 1.0 + x / 2.0 + x * x / 12.0
        rows += [
            ("(65)", f"loss at x = {x:g}", 1.0 - (1.0 - x / 2.0 + x * x / 12.0) / below, loss,
             1e-15),
            ("(65)", f"weight before, x = {x:g}", (0.5 - x / 12.0) / below, before, 1e-15),
            ("(65)", f"weight behind, x = {x:g}", (0.5 + x / 12.0) / below, behind, 1e-15),
            ("(65)", f"weight of slopes, x = {x:g}", 1.0 / 12.0 / below, cross, 1e-15),
        ]  # fmt: skip
    return rows


def between_nodes() -> list[Row]:
    """The quartic of the middle and the quintic of the tilt."""
    s = math.sqrt(1.0 / 20.0)  # where 16 s (1/4 - s^2)^2 is stationary, t = 1/2 + s
    largest = 16.0 * s * (0.25 - s * s) ** 2
    value, place, bump = of_code("extrema", "refine")(0.0, 0.0, 1.0, -1.0, 1.0)
    return [
        ("(55)", "largest value of the quintic, 8/sqrt(3125)", 8.0 / math.sqrt(3125.0), largest,
         1e-15),
        ("(55)", "twice QUINTIC, as error estimates take it", largest,
         2.0 * of_code("work tables", "QUINTIC"), 1e-15),
        ("(91)", "quartic in the middle of an interval", 1.0, bump, 1e-15),
        ("(91)", "place of that extreme", 0.5, place, 1e-15),
        ("(91)", "cubic and quartic there", 1.25, value, 1e-15),
    ]  # fmt: skip


def moments() -> list[Row]:
    """Moments of the decaying exponential."""
    rows: list[Row] = []
    for x in (1e-6, 0.5, 0.999, 1.0, 30.0):
        found = of_code("stiff", "_moments")(x)
        for k in range(4):
            wanted = quad(lambda t: math.exp(-x * (1.0 - t)) * t**k, 0.0, 1.0, epsabs=1e-15)[0]  # noqa: B023
            rows.append(("(80)", f"moment {k} at x = {x:g}", wanted, found[k], 1e-13))
    deep = of_code("stiff", "DEEP")
    lost = math.factorial(3) / math.factorial(deep)
    rows.append(("(80)", f"what order {deep} leaves at x = 1", 0.0, lost / (deep + 1.0), 1e-17))
    return rows


def euler_maclaurin() -> list[Row]:
    """Trapezoidal rule's end corrections in central differences on five nodes."""
    # h f' = mu delta - mu delta^3/6, h^3 f''' = mu delta^3; corrections -1/12 and +1/720, halved
    # because mu delta f = (f_1 - f_-1)/2 and mu delta^3 f = (f_2 - 2 f_1 + 2 f_-1 - f_-2)/2.
    first, third = Fraction(-1, 12), Fraction(1, 720)
    cube = third - first / 6
    near, far = first / 2 - cube, cube / 2
    source = inspect.getsource(importlib.import_module(WHERE["batch weights"]))
    found = [Fraction(int(a), int(b)) for a, b in re.findall(r"\((\d+)\.0 / (1440)\.0\)", source)]
    return [
        ("(101)", "weight of the neighbours, 82/1440", float(-near), float(found[0]), 0.0),
        ("(101)", "weight of the next nodes, 11/1440", float(far), float(found[1]), 0.0),
    ]


def through_chebyshev(f: Callable[[Any], Any], count: int, reach: float) -> Any:
    """Coefficients in u of the polynomial through Chebyshev's points of |u| <= reach."""
    points = np.cos(np.pi * (np.arange(count) + 0.5) / count)
    return chebyshev.cheb2poly(chebyshev.chebfit(points, f(reach * points), count - 1)) / (
        reach ** np.arange(count)
    )


def series() -> list[Row]:
    """Polynomials of the batch solver, fitted at Chebyshev's points."""
    reach = of_code("batch powers", "SERIES_RANGE")
    u = np.linspace(-reach, reach, 20001)
    rows: list[Row] = []
    root, slope = of_code("batch powers", "root_remainder"), of_code("batch powers", "root_slope")
    # Written without a difference of near numbers.
    wanted = through_chebyshev(lambda u: -0.5 / (1.0 + np.sqrt(1.0 + u)) ** 2, 7, reach)
    # The code's -0.125 is the exact limit at 0; it has few digits and is added here.
    given = [-0.125, *reversed(numbers_in(root))]
    rows += [
        ("(102)", f"root_remainder, coefficient {i}", wanted[i], given[i], 1e-10) for i in range(7)
    ]
    missed = np.abs(u * u * polynomial.polyval(u, given) - (np.sqrt(1 + u) - 1 - u / 2)).max()
    rows.append(("(102)", "root_remainder, error (2e-10 stated)", 0.0, missed, 2e-10))
    wanted = through_chebyshev(
        lambda u: -0.5 / (np.sqrt(1.0 + u) * (1.0 + np.sqrt(1.0 + u))), 4, reach
    )
    high, low = numbers_in(slope)[:2], numbers_in(slope)[2:]
    given = [low[1], low[0], high[0], high[1]]
    rows += [
        ("(103)", f"root_slope, coefficient {i}", wanted[i], given[i], 1e-13) for i in range(4)
    ]
    missed = np.abs(u * polynomial.polyval(u, given) - (0.5 / np.sqrt(1 + u) - 0.5)).max()
    rows.append(("(103)", "root_slope, error (1e-5 stated)", 0.0, missed, 1e-5))
    terms, worst = of_code("batch powers", "SERIES_TERMS"), 0.0
    for a in np.linspace(1e-4, 8.0, 200):
        each = [binom(a, k) for k in range(2, 2 + terms)]
        exact = (1.0 + u) ** a - 1.0 - a * u
        worst = max(worst, np.abs(u * u * polynomial.polyval(u, each) - exact).max())
    rows.append(("(104)", "binomial series, error (1e-11 stated)", 0.0, worst, 1e-11))
    u = np.linspace(-0.5, 1.0, 10001)
    missed = max(abs(of_code("batch powers", "log_of")(float(x)) - math.log1p(x)) for x in u)
    rows.append(("(105)", "log_of, error (2e-13 stated)", 0.0, missed, 2e-13))
    missed = max(
        abs(of_code("batch powers", "exp_of")(x) / math.exp(x) - 1.0)
        for x in np.linspace(-8, 8, 10001)
    )
    rows.append(("(105)", "exp_of, relative error", 0.0, missed, 2e-11))
    missed = max(
        abs(of_code("batch powers", "loss_of")(x) / -math.expm1(-x) - 1.0)
        for x in np.linspace(1e-3, 0.1, 10001)
    )
    rows.append(("(105)", "loss_of, relative error", 0.0, missed, 1e-13))
    return rows


def two_grids() -> list[Row]:
    """Series of the work, and harmonics of the velocity."""
    terms, most = of_code("two grids", "SERIES_OF_WORK"), of_code("two grids", "MOST_IN_SERIES")
    largest = of_code("two grids", "LARGEST_STEP")
    rate = 0.5 * largest * most
    angle = np.pi * (np.arange(terms) + 0.5) / terms
    node, fine = np.cos(angle), np.linspace(-1.0, 1.0, 2001)
    worst = 0.0
    for power in range(most):
        decay = lambda t: np.exp(-0.5 * largest * power * (1.0 + t))  # noqa: B023, E731
        through = chebyshev.chebfit(node, decay(node), terms - 1)
        worst = max(worst, np.abs(chebyshev.chebval(fine, through) - decay(fine)).max())
    decays = np.exp(-0.5 * largest * (1.0 + node))
    rows: list[Row] = [
        ("(106)", "error of the series of work, by Bessel's function",
         2.0 * math.exp(-rate) * iv(terms, rate), worst, 1e-13),
        ("(106)", "decays at Chebyshev's points", 0.0,
         float(np.abs(of_code("two grids", "SERIES_DECAYS") - decays).max()), 1e-15),
    ]  # fmt: skip
    angle = np.linspace(0.0, 2.0 * math.pi, 4096, endpoint=False)
    for terms, ratio in of_code("harmonics", "LARGEST_RATIO").items():
        sine, cosine = np.sin(angle), np.cos(angle)
        velocity = sine * (1.0 + ratio * cosine / np.sqrt(1.0 - (ratio * sine) ** 2))
        of_velocity, of_square = (
            np.abs(np.fft.rfft(curve)) / 2048 for curve in (velocity, velocity**2)
        )
        order = np.arange(of_velocity.size)
        left = float((of_velocity[2 * terms - 1 :] / order[2 * terms - 1 :]).sum())
        rows.append(("(107)", f"work beyond {terms} terms", 0.0, left, 1e-11))
        left = float(of_square[2 * terms + 1 :].sum())
        rows.append(("(107)", f"square beyond {2 * terms} terms", 0.0, left, 3.5e-10))
    return rows


def rest() -> list[Row]:
    """Constants of pressure models that are numbers of mathematics."""
    return [("", "Wiebe's factor for 99.9 %", -math.log(1.0 - 0.999),
             of_code("diesel cycle", "WIEBE"), 1e-12)]  # fmt: skip


def main() -> int:
    print(f"{'equation':9} {'constant':52} {'derived':>24} {'code':>24}")
    wrong = 0
    for chapter in (
        gauss_points, obreshkov, between_nodes, moments, euler_maclaurin, series, two_grids, rest,
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
