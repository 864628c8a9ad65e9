"""Constants of docs/solver.md that follow from mathematics, derived again and compared.

By rational arithmetic, or with NumPy and SciPy alone. Numbers in parentheses are equations of
docs/method.md and docs/solver.md.
"""

import inspect
import math
import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.loads import laws
from engine_dyn.pressure.diesel_cycle import WIEBE
from engine_dyn.speed.batch import block
from engine_dyn.speed.batch.solution import run_load
from engine_dyn.speed.batch.work_table import weights_of
from engine_dyn.speed.general import one_by_one
from engine_dyn.speed.vectors import new_rows
from engine_dyn.speed.work import boxes, columns
from engine_dyn.speed.work.interpolation import MEAN_BY_PAIRS

HALF = Fraction(1, 2)


def python_of(compiled: Any) -> Any:
    """The Python source's function of a compiled one."""
    return getattr(compiled, "py_func", compiled)


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


def test_gauss_points() -> None:
    """(56): three-point Gauss-Legendre on both halves of an interval."""
    node, weight = np.polynomial.legendre.leggauss(3)
    places = [half + 0.25 * (1.0 + node) for half in (0.0, 0.5)]
    assert pytest.approx(np.ravel(places), abs=1e-15) == columns.POINTS
    assert pytest.approx(0.25 * np.tile(weight, 2), abs=1e-15) == columns.WEIGHTS


def test_two_point_formula() -> None:
    """(79): exact for polynomials up to the third degree; its error, and (103) that of a cubic."""
    a, b = Fraction(1, 2), Fraction(1, 12)
    for k in range(4):
        ends = 2 if k == 0 else 1
        slope = 1 if k == 1 else 0
        assert Fraction(1, k + 1) == a * ends + b * (slope - k), k
    error = Fraction(1, 5) - (a - 4 * b)
    source = inspect.getsource(python_of(one_by_one._load_missed))
    found = [int(n) for n in re.findall(r"1\.0 / (\d+)\.0", source)]
    assert found[:2] == [math.factorial(4) / error, math.factorial(4) * 16]


def test_velocity_as_a_sum_of_columns() -> None:
    """(58): within 3e-8, with and without offset."""
    angle = np.linspace(0.0, 2.0 * math.pi, 181)
    for number in range(boxes.KINDS * (len(boxes.RATIO_EDGES) - 1)):
        kind = number % boxes.KINDS
        if boxes.RATIO_EDGES[number // boxes.KINDS] >= boxes.LARGEST_RATIO[(kind + 1) // 2]:
            continue
        box = boxes.box_of(number, 0.0, 0.0)
        made = box.transform @ velocity(angle, box.samples[:, :1], box.samples[:, 1:])
        for x in np.linspace(-0.98, 1.0, 13):
            for y in (-1.0, -0.7, 0.0, 0.7, 1.0):
                ratio, offset = box.ratio[0] + x * box.ratio[1], box.offset[0] + y * box.offset[1]
                (factors,) = box.factors(np.array([ratio]), np.array([offset]))
                missed = factors @ made - velocity(angle, ratio, offset)
                assert np.abs(missed).max() < 3e-8, (number, x, y)


def test_weights_of_every_other_node() -> None:
    """(62): in the middle between two of them."""
    derived = stencil([-5, -3, -1, 1, 3, 5], lambda k: Fraction(int(k == 0)))
    source = inspect.getsource(python_of(columns._roughness))
    found = [float(n) / 256.0 for n in re.findall(r"(-?\d+\.0) / 256\.0", source)]
    assert found[:3] == [float(weight) for weight in derived[2::-1]]


@pytest.mark.parametrize("x", [1e-3, 0.01, 0.05])
def test_weights_along_the_coarse_nodes(x: float) -> None:
    """(70), (71) and (74), by integrals of the exponential."""
    form = laws.Form(laws.POWER, 1.0, False, np.empty((3, 0)))
    one = np.ones(1)
    designs = SimpleNamespace(kappa=x * one, speed=100.0 * one, first=2.0 * one, second=0.0 * one)
    found = python_of(weights_of)(designs, form, 1.0, 36)

    def moment(k: int) -> float:
        return float(quad(lambda t: x * math.exp(-x * (1.0 - t)) * (t - 0.5) ** k, 0.0, 1.0)[0])

    assert found.decay[0] == pytest.approx(math.exp(-x), abs=1e-15)
    assert found.of_mass[0] == pytest.approx(moment(0), abs=1e-14)
    assert found.of_tilt[0] == pytest.approx(12.0 * moment(1), abs=2e-8 * x * x)
    assert found.end[0] == pytest.approx(1.0 - math.exp(-36.0 * x), abs=1e-15)


def test_mean_and_first_moment_of_an_interval() -> None:
    """(72): by nodes around it, as the kernels take them."""
    mean, moment = stencil(range(-2, 4), mean_of), stencil(range(-1, 3), moment_of)
    nodes, halo = 12, block.HALO
    long = nodes + 2 * halo
    rows = python_of(new_rows)
    curves = block.Curves(*(rows(nodes) for _ in range(3)), *(rows(long) for _ in range(4)))
    for place in range(-2, 4):
        curves.work[:] = 0.0
        curves.work[halo + place] = 1.0  # seen from the interval behind node 0
        found = []
        for of_mass, of_tilt in ((1.0, 0.0), (0.0, 1.0)):
            weights = np.broadcast_to([[0.0], [of_mass], [of_tilt]], (3, curves.work.shape[1]))
            python_of(run_load)(*weights, curves.work, curves)
            found.append(curves.load[halo + 1, 0])
        of_mean = float(mean[place + 2])
        of_moment = float(moment[place + 1]) if -1 <= place <= 2 else 0.0
        assert MEAN_BY_PAIRS[max(-place, place - 1)] == pytest.approx(of_mean, abs=1e-15)
        assert found == pytest.approx([of_mean, of_moment], abs=1e-15)


def test_factor_of_wiebe() -> None:
    assert pytest.approx(-math.log(1.0 - 0.999), abs=1e-12) == WIEBE
