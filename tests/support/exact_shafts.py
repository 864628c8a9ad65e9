"""Shafts whose numbers are far apart, and what they do, in fractions: nothing is rounded."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from engine_dyn.torsion.system import ShaftSystem, shaft_system

__all__ = ["exact_response", "modes_below", "random_system"]


def random_system(random: np.random.Generator, most: int, damped: bool = False) -> ShaftSystem:
    """A tree of up to `most` discs: stiffness ratios to 1e12 and more, equal branches, no mass."""
    count = int(random.integers(2, most + 1))
    shafts = [
        (int(random.integers(0, i)) if random.random() < 0.4 else i - 1, i)
        for i in range(1, count)
    ]  # fmt: skip
    inertia = 10.0 ** random.uniform(-3.0, 1.0, count)
    stiffness = 10.0 ** (3.0 + random.uniform(0.0, random.uniform(0.0, 12.0), count - 1))
    ground = np.zeros(count)
    match int(random.integers(0, 4)):
        case 1:
            inertia[random.random(count) < 0.4] = 1e-15
        case 2 if count > 3:
            shafts = [(0, 1)] + [(1, i) for i in range(2, count)]
            inertia[2:], stiffness[1:] = inertia[2], stiffness[1]
        case 3:
            stiffness[random.random(count - 1) < 0.4] *= 10.0 ** random.uniform(6.0, 20.0)
    if random.random() < 0.3:
        ground[random.integers(0, count)] = 10.0 ** random.uniform(0.0, 8.0)
    loss, damping, own = (
        damped * value * (random.random(size) < 0.5)
        for value, size in ((0.05, count - 1), (1.0, count - 1), (0.5, count))
    )
    return shaft_system(
        inertia, stiffness, shafts, ground_stiffness=ground, loss_factor=loss, damping=damping,
        disc_damping=own,
    )  # fmt: skip


def modes_below(system: ShaftSystem, square: Fraction) -> int:
    """Number of natural frequencies, those of free parts too, below a square, by inertia's law."""
    dynamic = [
        Fraction(ground) - square * Fraction(inertia)
        for ground, inertia in zip(system.ground_stiffness, system.inertia, strict=True)
    ]
    below = 0
    for node in range(system.parent.size - 1, 0, -1):
        stiffness = Fraction(system.stiffness[node])
        pivot = stiffness + dynamic[node]
        below += pivot < 0
        dynamic[system.parent[node]] += stiffness * dynamic[node] / pivot
    return below + (dynamic[0] < 0)


def exact_response(
    system: ShaftSystem, omega: float, torque: Sequence[complex]
) -> tuple[Any, Any]:  # fmt: skip
    """Angles of the nodes under torques on them, and torques in the shafts above them.

    Gauss elimination of the dense real equations of twice the size.
    """
    nodes, w = system.parent.size, Fraction(omega)
    rows = [[Fraction(0)] * (2 * nodes + 1) for _ in range(2 * nodes)]

    def add(i: int, j: int, real: Fraction, imaginary: Fraction) -> None:
        rows[i][j] += real
        rows[nodes + i][nodes + j] += real
        rows[nodes + i][j] += imaginary
        rows[i][nodes + j] -= imaginary

    stiff = []
    for node in range(nodes):
        inertia, ground = Fraction(system.inertia[node]), Fraction(system.ground_stiffness[node])
        add(node, node, ground - w * w * inertia, w * Fraction(system.disc_damping[node]))
        rows[node][-1] = Fraction(complex(torque[node]).real)
        rows[nodes + node][-1] = Fraction(complex(torque[node]).imag)
        real = Fraction(system.stiffness[node])
        lost = real * Fraction(system.loss_factor[node]) + w * Fraction(system.damping[node])
        stiff.append((real, lost))
        above = int(system.parent[node])
        ends = [(node, node, 1), (above, above, 1), (node, above, -1), (above, node, -1)]
        for i, j, sign in ends if node else ():
            add(i, j, sign * real, sign * lost)
    size = 2 * nodes
    for column in range(size):
        pivot = next(row for row in range(column, size) if rows[row][column])
        rows[column], rows[pivot] = rows[pivot], rows[column]
        for row in range(size):
            if row != column and rows[row][column]:
                factor = rows[row][column] / rows[column][column]
                rows[row] = [a - factor * b for a, b in zip(rows[row], rows[column], strict=True)]
    found = [rows[i][-1] / rows[i][i] for i in range(size)]
    angles, torques = [], []
    for node, (real, lost) in enumerate(stiff):
        above = max(int(system.parent[node]), 0)
        x, y = found[node] - found[above], found[nodes + node] - found[nodes + above]
        angles.append(complex(float(found[node]), float(found[nodes + node])))
        torques.append(complex(float(real * x - lost * y), float(real * y + lost * x)))
    return np.array(angles), np.array(torques)
