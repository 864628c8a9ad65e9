r"""Modes of systems whose stiffnesses or inertias are far apart, each to its own digits.

Eigenvalues of J^(-1/2) K J^(-1/2) are found to the rounding of the largest: beside a shaft of
1e20 N m/rad nothing is left of a soft mode. They are the squares of the singular values of

    W = k^(1/2) B J^(-1/2),

with a row for each shaft and spring to the frame, and B of 1 and -1: K = B^T k B. A tree leaves W
without loops, so that Gaussian elimination never adds two numbers: W = X D Y^T comes out to the
last digits of each entry, with D diagonal, however far apart its numbers are, and X and Y that are
as good as B. One-sided Jacobi rotations keep that: first X D = U S V^T, then Y V S. So each
frequency is as exact as the numbers of the system that it depends on, and where nothing holds a
part of the system, the rank of W says so exactly. J. Demmel and others, Linear Algebra and its
Applications 299 (1999) 21-80, algorithm 3.1 and section 5 (acyclic matrices).

Where stiffnesses follow the frequency, as those of pendulums do at an order, frequencies are found
by counting: the pivots of K - omega^2 J below 0, eliminated from the ends of the tree, are as many
as the modes below omega. Each pivot is that of a system whose numbers are off by their rounding.
"""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.compilation import inlined, kernel
from engine_dyn.types import Floats, Integers

LOW, HIGH = 1e-30, 1e60  # Squares of frequencies [rad2/s2] that bracket all modes


@kernel
def graded_modes(
    parent: Integers, inertia: Floats, stiffness: Floats, ground: Floats, squares: Floats,
    amplitude: Floats, twist: Floats,
) -> None:  # fmt: skip
    """Fill in the elastic modes of each design, from the lowest; NaN beyond the last.

    Parameters
    ----------
    parent : ndarray of int, shape (M,)
    inertia, stiffness, ground : ndarray, shape (designs, M)
        As of `system.ShaftSystem`.
    squares : ndarray, shape (designs, m)
        Gets omega_m^2.
    amplitude, twist : ndarray, shape (designs, m, M)
        Get the angle of each node, with sum J a^2 = 1, and that against its parent.
    """
    nodes = parent.size
    for design in range(inertia.shape[0]):
        own, stiff = inertia[design], stiffness[design]
        matrix = np.zeros((2 * nodes, nodes))
        for node in range(nodes):
            matrix[nodes + node, node] = math.sqrt(ground[design, node] / own[node])
            if node > 0:
                matrix[node, node] = math.sqrt(stiff[node] / own[node])
                matrix[node, parent[node]] = -math.sqrt(stiff[node] / own[parent[node]])
        left, right = np.zeros((nodes, 2 * nodes)), np.zeros((nodes, nodes))
        rank = _factor(matrix, left, right)
        turned, again = np.eye(rank), np.eye(rank)
        _orthogonalise(left[:rank], turned)
        sizes = _normalised(left[:rank])
        modes = np.zeros((rank, nodes))
        for i in range(rank):
            for j in range(rank):
                for node in range(nodes):
                    modes[i, node] += sizes[i] * turned[i, j] * right[j, node]
        _orthogonalise(modes, again)
        sizes = _normalised(modes)
        ascending = np.argsort(sizes)
        squares[design], amplitude[design], twist[design] = np.nan, np.nan, np.nan
        for m in range(min(rank, squares.shape[1])):
            i = ascending[m]
            squares[design, m] = sizes[i] ** 2
            for node in range(nodes):
                amplitude[design, m, node] = modes[i, node] / math.sqrt(own[node])
                torque = 0.0  # torque in the shaft over omega k^(1/2), by its row of W
                for j in range(rank):
                    torque += again[i, j] * left[j, node]
                over = sizes[i] / math.sqrt(stiff[node]) if stiff[node] > 0.0 else 0.0
                twist[design, m, node] = over * torque
            _reconcile(parent, own, stiff, sizes[i], amplitude[design, m], twist[design, m])


@inlined
def _factor(matrix: Floats, left: Floats, right: Floats) -> int:
    """Factorise W = left^T right with complete pivoting, pivots in `left`; return the rank."""
    rows, columns = matrix.shape
    for step in range(columns):
        most, row, column = 0.0, 0, 0
        for i in range(rows):
            for j in range(columns):
                if abs(matrix[i, j]) > most:
                    most, row, column = abs(matrix[i, j]), i, j
        if most == 0.0:
            return step
        pivot = matrix[row, column]
        for i in range(rows):
            left[step, i] = matrix[i, column]
        for j in range(columns):
            right[step, j] = matrix[row, j] / pivot
        for i in range(rows):
            for j in range(columns):
                if i == row or j == column:
                    matrix[i, j] = 0.0
                elif left[step, i] != 0.0 and right[step, j] != 0.0:
                    matrix[i, j] -= left[step, i] * right[step, j]
    return columns


@inlined
def _orthogonalise(vectors: Floats, turned: Floats) -> None:
    """Rotate pairs of vectors, of any lengths, until orthogonal, and lines of `turned` likewise."""
    count, size = vectors.shape
    right_angle = size * 2.2e-16
    # Each sweep rotates all pairs; some ten sweeps are enough.
    for _ in range(60):
        turning = False
        for i in range(count - 1):
            for j in range(i + 1, count):
                first, second, product = 0.0, 0.0, 0.0
                for k in range(size):
                    first += vectors[i, k] ** 2
                    second += vectors[j, k] ** 2
                    product += vectors[i, k] * vectors[j, k]
                if abs(product) <= right_angle * math.sqrt(first) * math.sqrt(second):
                    continue
                turning = True
                half = 0.5 * (second - first) / product
                tangent = math.copysign(1.0, half) / (abs(half) + math.sqrt(1.0 + half * half))
                cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
                sine = cosine * tangent
                for k in range(size):
                    one, other = vectors[i, k], vectors[j, k]
                    vectors[i, k] = cosine * one - sine * other
                    vectors[j, k] = sine * one + cosine * other
                for k in range(count):
                    one, other = turned[i, k], turned[j, k]
                    turned[i, k] = cosine * one - sine * other
                    turned[j, k] = sine * one + cosine * other
        if not turning:
            return


@inlined
def _normalised(vectors: Floats) -> Floats:
    """Divide vectors by their lengths, and return the lengths."""
    count, size = vectors.shape
    lengths = np.empty(count)
    for i in range(count):
        square = 0.0
        for k in range(size):
            square += vectors[i, k] ** 2
        lengths[i] = math.sqrt(square)
        for k in range(size):
            vectors[i, k] /= lengths[i]
    return lengths


@inlined
def _reconcile(
    parent: Integers, inertia: Floats, stiffness: Floats, omega: float, angle: Floats, twist: Floats
) -> None:
    """Take each angle and twist from the vector that has it most exactly.

    Vectors are known to the rounding of their length: an angle to J^(-1/2), a twist to
    omega k^(-1/2). So a light disc turns as its neighbour and the stiff shaft between them say.
    """
    nodes = parent.size
    error = np.empty(nodes)
    for node in range(nodes):
        error[node] = 1.0 / math.sqrt(inertia[node])
    for step in range(2 * nodes):
        node = nodes - 1 - step if step < nodes else step - nodes
        if node == 0 or stiffness[node] == 0.0:
            continue
        above, more = parent[node], omega / math.sqrt(stiffness[node])
        if step < nodes and error[node] + more < error[above]:
            error[above] = error[node] + more
            angle[above] = angle[node] - twist[node]
        elif step >= nodes and error[above] + more < error[node]:
            error[node] = error[above] + more
            angle[node] = angle[above] + twist[node]
    for node in range(1, nodes):
        more = omega / math.sqrt(stiffness[node]) if stiffness[node] > 0.0 else math.inf
        if error[node] + error[parent[node]] < more:
            twist[node] = angle[node] - angle[parent[node]]


def modes_below(
    parent: Integers, numbers: tuple[Floats, Floats, Floats, Floats], order: float, square: float,
    dynamic: Floats,
) -> int:  # fmt: skip
    """Return how many modes are below a frequency, those of parts that nothing holds among them.

    Parameters
    ----------
    parent : ndarray of int, shape (M,)
        Parent of each node.
    numbers : tuple of ndarray, shape (M,)
        Inertia, stiffness, stiffness against the frame, and stiffness over the square of the speed.
    order : float
        nu, to which the speed belongs; infinite: at rest.
    square : float
        Square of the frequency [rad2/s2].
    dynamic : ndarray, shape (M,)
        Scratch.
    """
    inertia, stiffness, ground, following = numbers
    below = 0
    for node in range(parent.size):
        dynamic[node] = ground[node] - square * inertia[node]
    for node in range(parent.size - 1, 0, -1):
        stiff = stiffness[node] + following[node] * (square / (order * order))
        pivot = stiff + dynamic[node]
        if pivot == 0.0:  # a branch that resonates by itself gets a pivot as small as rounding
            pivot = 1e-16 * (stiff + abs(dynamic[node])) + 1e-300
        below += pivot < 0.0
        dynamic[parent[node]] += stiff * (dynamic[node] / pivot)
    return below + (dynamic[0] < 0.0)


_modes_below = inlined(modes_below)


@kernel
def critical_squares(
    parent: Integers, inertia: Floats, stiffness: Floats, ground: Floats, following: Floats,
    orders: Floats, squares: Floats,
) -> None:  # fmt: skip
    """Fill in omega^2, (designs, orders, m), of K a = omega^2 (J - K_s/nu^2) a; NaN past the last.

    K is positive, so that a mode of any omega^2 above 0 has positive inertia, even where a
    pendulum's is negative: the number of modes below omega never falls.
    """
    scratch = np.empty(parent.size)
    for design in range(squares.shape[0]):
        numbers = inertia[design], stiffness[design], ground[design], following[design]
        for v in range(orders.size):
            none = _modes_below(parent, numbers, orders[v], LOW, scratch)
            every = _modes_below(parent, numbers, orders[v], HIGH, scratch)
            for m in range(squares.shape[2]):
                low, high = LOW, HIGH
                while True:
                    middle = math.sqrt(low) * math.sqrt(high)
                    middle = middle if high > 2.0 * low else 0.5 * (low + high)
                    if not low < middle < high:
                        break
                    if _modes_below(parent, numbers, orders[v], middle, scratch) > none + m:
                        high = middle
                    else:
                        low = middle
                squares[design, v, m] = high if every > none + m else np.nan
