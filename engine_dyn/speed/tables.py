"""Cumulative work of one engine period: everything that designs of one geometry share.

A table holds, at the nodes of one firing period, the work of the gas and of the reciprocating
masses in reduced form. Work is one integration smoother than torque, so a table of it needs few
nodes, and a design is only two factors on two tables:

    gas:      P(phi) = int sum_i [(p_i - p_c) v_i - mean] dphi          [Pa]
    inertia:  V(phi) = sum_i v_i^2 - mean                               [1]

because the inertia torque -m r^2 omega^2 b v has the exact integral -m r^2 omega^2 v^2/2. Cylinders
fire evenly, so the curve of one cylinder, folded at the firing interval, is the whole engine's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import kernel
from engine_dyn.indicator import Family
from engine_dyn.slider_crank import acceleration_at, jerk_at, velocity_at

__all__ = ["FEWEST_NODES", "PressureNodes", "build", "pressure_nodes", "steps_per_cycle"]

FEWEST_NODES = 720
"""Nodes of a cycle at least: one a degree, the step of most measured diagrams."""

MOST_NODES = 23040

_THIRD = math.sqrt(0.15)
_POINTS = (0.5 - _THIRD, 0.5, 0.5 + _THIRD)
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
"""Gauss-Legendre with three points on [0, 1]."""

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class PressureNodes:
    """Pressure of a family's rows at the nodes, the middles and the quadrature points of a cycle.

    `rows` maps a row of the family to its place here. Arrays are (row, point); `angles` lists
    sine and cosine at the same points.
    """

    rows: npt.NDArray[np.int64]
    at_node: Floats
    slope_at_node: Floats
    at_middle: Floats
    at_quadrature: Floats
    node: tuple[Floats, Floats]
    middle: tuple[Floats, Floats]
    quadrature: tuple[Floats, Floats]


def steps_per_cycle(cylinders: int, fewest: int) -> int:
    """Nodes of a cycle: from `fewest` on the first that gives every cylinder the same even number.

    Even, so that the means over every other node tell whether the curve is resolved.
    """
    return -(-fewest // (2 * cylinders)) * 2 * cylinders


def pressure_nodes(family: Family, rows: npt.NDArray[np.int64], steps: int) -> PressureNodes:
    """Evaluate the diagrams `rows` of a family on a grid of `steps` intervals, from phi = 0 on."""
    period = family.row(int(rows[0])).period
    width = period / steps
    node = np.arange(steps) * width
    middle = node + 0.5 * width
    offsets = np.array([half + 0.5 * point for half in (0.0, 0.5) for point in _POINTS])
    quadrature = (node[:, None] + offsets * width).ravel()
    diagrams = [family.row(int(row)) for row in rows]

    def trigonometry(angle: Floats) -> tuple[Floats, Floats]:
        return np.sin(angle), np.cos(angle)

    return PressureNodes(
        rows=rows,
        at_node=np.array([d(node) for d in diagrams]),
        slope_at_node=np.array([d.derivative(node) for d in diagrams]),
        at_middle=np.array([d(middle) for d in diagrams]),
        at_quadrature=np.array([d(quadrature) for d in diagrams]),
        node=trigonometry(node),
        middle=trigonometry(middle),
        quadrature=trigonometry(quadrature),
    )


TABLE_ROWS = 12
(
    GAS_WORK,
    GAS_TORQUE,
    GAS_WORK_MIDDLE,
    SQUARE,
    SQUARE_SLOPE,
    SQUARE_MIDDLE,
    TORQUE,
    TORQUE_SLOPE,
    TORQUE_MIDDLE,
    SHAPE,
    SHAPE_SLOPE,
    SHAPE_MIDDLE,
) = range(TABLE_ROWS)
"""Rows of a table, each with one value a node of the firing period:

GAS_WORK P, GAS_TORQUE its slope, SQUARE V and SQUARE_SLOPE (both without their means);
TORQUE sum (p - p_c) v and SHAPE sum -b v, with their slopes, for the extremes of the torque.
*_MIDDLE is the true value in the middle of the interval after the node, less the cubic Hermite
interpolant's: what a cubic misses.
"""


@kernel
def build(
    ratio: float,
    first: int,
    second: int,
    weight: float,
    scale: float,
    crankcase: float,
    nodes: int,
    steps: int,
    width: float,
    at_node: Floats,
    slope_at_node: Floats,
    at_middle: Floats,
    at_quadrature: Floats,
    node_sine: Floats,
    node_cosine: Floats,
    middle_sine: Floats,
    middle_cosine: Floats,
    quadrature_sine: Floats,
    quadrature_cosine: Floats,
    table: Floats,
    middles: Floats,
) -> float:
    """Fill `table` (TABLE_ROWS, nodes) for one geometry and diagram; return the gas torque's mean.

    The diagram is (1 - weight) row `first` + weight row `second`, times `scale`, over the crankcase
    pressure. `middles` is scratch (4, nodes). The mean is over angle, of the sum over cylinders.
    """
    one = 1.0 - weight
    for row in range(TABLE_ROWS):
        for j in range(nodes):
            table[row, j] = 0.0
    for row in range(4):
        for j in range(nodes):
            middles[row, j] = 0.0
    # Row GAS_WORK first collects the work of whole intervals, `middles` that of their first halves.
    cylinders = steps // nodes
    for cylinder in range(cylinders):
        for j in range(nodes):
            step = cylinder * nodes + j
            halves = (0.0, 0.0)
            for half in range(2):
                total = 0.0
                for point in range(3):
                    place = step * 6 + half * 3 + point
                    pressure = (
                        scale * (one * at_quadrature[first, place] + weight * at_quadrature[second, place])
                        - crankcase
                    )
                    share = 8.0 / 18.0 if point == 1 else 5.0 / 18.0
                    total += share * pressure * velocity_at(
                        quadrature_sine[place], quadrature_cosine[place], ratio
                    )
                halves = (halves[1], total * 0.5 * width)
            table[GAS_WORK, j] += halves[0] + halves[1]
            middles[0, j] += halves[0]

            sine, cosine = node_sine[step], node_cosine[step]
            v = velocity_at(sine, cosine, ratio)
            b = acceleration_at(sine, cosine, ratio)
            pressure = scale * (one * at_node[first, step] + weight * at_node[second, step]) - crankcase
            slope = scale * (one * slope_at_node[first, step] + weight * slope_at_node[second, step])
            table[TORQUE, j] += pressure * v
            table[TORQUE_SLOPE, j] += slope * v + pressure * b
            table[SHAPE, j] -= b * v
            table[SHAPE_SLOPE, j] -= b * b + v * jerk_at(sine, cosine, ratio)
            table[SQUARE, j] += v * v
            table[SQUARE_SLOPE, j] += 2.0 * v * b

            sine, cosine = middle_sine[step], middle_cosine[step]
            v = velocity_at(sine, cosine, ratio)
            pressure = scale * (one * at_middle[first, step] + weight * at_middle[second, step]) - crankcase
            middles[1, j] += v * v
            middles[2, j] += pressure * v
            middles[3, j] -= acceleration_at(sine, cosine, ratio) * v

    total = 0.0
    for j in range(nodes):
        total += table[GAS_WORK, j]
    mean = total / (nodes * width)
    running = 0.0
    mean_work = 0.0
    mean_square = 0.0
    for j in range(nodes):
        whole = table[GAS_WORK, j] - mean * width
        table[GAS_WORK, j] = running
        mean_work += running
        mean_square += table[SQUARE, j]
        middles[0, j] += running - 0.5 * mean * width
        running += whole
        table[GAS_TORQUE, j] = table[TORQUE, j] - mean
    mean_work /= nodes
    mean_square /= nodes
    for j in range(nodes):
        table[GAS_WORK, j] -= mean_work
        middles[0, j] -= mean_work
        table[SQUARE, j] -= mean_square
        middles[1, j] -= mean_square
    for j in range(nodes):
        after = j + 1 if j + 1 < nodes else 0
        eighth = 0.125 * width
        for k in range(4):
            value, slope_row, target = (
                (GAS_WORK, GAS_TORQUE, GAS_WORK_MIDDLE)
                if k == 0
                else (SQUARE, SQUARE_SLOPE, SQUARE_MIDDLE)
                if k == 1
                else (TORQUE, TORQUE_SLOPE, TORQUE_MIDDLE)
                if k == 2
                else (SHAPE, SHAPE_SLOPE, SHAPE_MIDDLE)
            )
            cubic = 0.5 * (table[value, j] + table[value, after]) + eighth * (
                table[slope_row, j] - table[slope_row, after]
            )
            table[target, j] = middles[k, j] - cubic
    return mean
