"""The same periodic problem a second way: Fourier collocation and Newton over a whole cycle.

Shares only the torques with `solution`.  Unknown are the scaled kinetic energy ``e`` at an odd
number of equidistant angles and the scaled load ``mu`` together; the equations are

    ``D e = 2 (M - a) / (Theta omega_n^2) - mu u^(alpha/2)``  at every angle, and the closure,

so that, unlike there, ``k`` comes out of the solution instead of being put in.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve, toeplitz

from .solution import CYCLE, Problem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Collocated:
    """Speeds [rad/s], ``k omega_n^alpha`` [N m], kinetic energy swing [J], speed at ``phi``."""

    omega_mean: float
    omega_max: float
    omega_min: float
    load_torque_nominal: float
    energy_swing: float
    phi: Array
    omega: Array


def differentiation_matrix(nodes: int) -> Array:
    """Derivative of the trigonometric interpolant at an odd number of angles over the cycle."""
    if nodes % 2 == 0:
        raise ValueError("an odd number of nodes is needed")
    index = np.arange(1, nodes)
    column = np.concatenate([[0.0], 0.5 * (-1.0) ** index / np.sin(math.pi * index / nodes)])
    return np.asarray(toeplitz(column, -column)) * (2.0 * math.pi / CYCLE)


def _extremes(values: Array) -> tuple[float, float]:
    """Smallest and largest value of the trigonometric interpolant."""
    nodes = values.size
    coefficients = np.fft.rfft(values) / nodes
    coefficients[1:] *= 2.0
    order = np.arange(coefficients.size) * (2.0 * math.pi / CYCLE)
    fine = np.fft.irfft(np.pad(np.fft.rfft(values) * 8.0, (0, 4 * nodes)), 8 * nodes)
    found = []
    for sign in (1.0, -1.0):
        phi = float(np.argmin(sign * fine)) * CYCLE / fine.size
        for _ in range(6):  # Newton for the angle where the slope is zero
            wave = coefficients * np.exp(1j * order * phi)
            slope = float(np.sum(1j * order * wave).real)
            curvature = float(np.sum(-(order**2) * wave).real)
            phi -= slope / curvature if curvature != 0.0 else 0.0
        found.append(float(np.sum(coefficients * np.exp(1j * order * phi)).real))
    return found[0], found[1]


def collocate(problem: Problem, nodes: int = 1441) -> Collocated:
    """Periodic speed of a problem that has one.

    Parameters
    ----------
    problem : Problem
    nodes : int
        Odd number of angles over the cycle; the error falls exponentially with it for an
        analytic torque.

    Raises
    ------
    RuntimeError
        If Newton does not converge.
    """
    phi = np.arange(nodes) * CYCLE / nodes
    scale = 2.0 / (problem.inertia * problem.omega_n**2)
    drive = scale * (np.asarray(problem.torque(phi)) - problem.load_offset)
    theta = np.broadcast_to(np.asarray(problem.inertia_ratio(phi), dtype=float), nodes)
    half = problem.load_exponent / 2.0
    derivative = differentiation_matrix(nodes)
    # A start that satisfies all but the load's variation: the integral of drive less its mean.
    spectrum = np.fft.rfft(drive)
    harmonic = 1j * np.arange(spectrum.size) * (2.0 * math.pi / CYCLE)
    integral = np.fft.irfft(np.concatenate([[0.0], spectrum[1:] / harmonic[1:]]), nodes)
    energy = 1.0 + integral - min(0.0, float(np.min(1.0 + integral)) - 0.1)
    load = float(np.mean(drive))
    matrix = np.zeros((nodes + 1, nodes + 1))
    for _ in range(80):
        u = energy / theta
        power = u**half
        if problem.closure == "cycle_time":
            closing, closing_u = 1.0 - u**-0.5, 0.5 * u**-1.5
        elif half == 0.0:
            closing, closing_u = 0.5 * np.log(u), 0.5 / u
        else:
            closing, closing_u = power - 1.0, half * power / u
        residual = np.append(derivative @ energy - drive + load * power, np.mean(closing))
        matrix[:nodes, :nodes] = derivative
        matrix[range(nodes), range(nodes)] += load * half * power / u / theta
        matrix[:nodes, nodes] = power
        matrix[nodes, :nodes] = closing_u / theta / nodes
        step = lu_solve(lu_factor(matrix), -residual)
        share = 1.0
        while np.min(energy + share * step[:nodes]) <= 0.1 * np.min(energy):
            share *= 0.5
        energy = energy + share * step[:nodes]
        load += share * float(step[nodes])
        # Newton is quadratic: after a step this small only rounding is left.
        if np.max(np.abs(step[:nodes])) < 1e-9 * np.max(energy):
            break
    else:
        raise RuntimeError("Newton did not converge")
    omega = problem.omega_n * np.sqrt(energy / theta)
    lowest, highest = _extremes(omega)
    least, most = _extremes(energy)
    return Collocated(
        omega_mean=float(np.mean(omega)),
        omega_max=highest,
        omega_min=lowest,
        load_torque_nominal=load / scale,
        energy_swing=(most - least) / scale,
        phi=phi,
        omega=omega,
    )
