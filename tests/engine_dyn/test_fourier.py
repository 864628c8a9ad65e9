"""Fourier coefficients of diagrams against adaptive quadrature between their knots."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from engine_dyn.pressure.diagram import Diagram, diagram_from_points
from engine_dyn.pressure.family import family_from_diagrams
from engine_dyn.pressure.fourier import coefficients_of_rows, weights_of_knots
from engine_dyn.pressure.motored import motored

pytestmark = pytest.mark.quick

PERIOD = 4.0 * np.pi


def diagram(*, even: bool) -> Diagram:
    """A smooth compression and expansion, at knots 3 to 9 degrees apart or 6."""
    step = np.full(120, 6.0) if even else np.random.default_rng(1).uniform(3.0, 9.0, 120)
    angle = -0.5 * PERIOD + np.cumsum(step) / step.sum() * (PERIOD - 1e-3)
    travel = np.sin(0.5 * angle) ** 2
    closed = np.exp(-((angle / (0.9 * np.pi)) ** 8))
    pressure = 1e5 + closed * 4e6 / (1.0 + 15.0 * travel) ** 1.3
    return diagram_from_points(angle, pressure, PERIOD)


@pytest.mark.parametrize("even", [False, True])
@pytest.mark.parametrize("factor", [1.0, 0.4])
def test_coefficients_are_the_integrals(even: bool, factor: float) -> None:
    whole = diagram(even=even)
    family = family_from_diagrams([10.0, 90.0], [whole, whole.scaled(1.5)])
    orders = np.array([0.0, 0.5, 1.0, 7.5, 21.0, 64.0, 200.0])
    real, imaginary = coefficients_of_rows(family, np.array([0]), orders, factor)
    base = motored(whole)
    edges = np.append(whole.angle, whole.angle[0] + PERIOD)
    for i, order in enumerate(orders):
        total = 0.0j
        for left, right in pairwise(edges):
            for part, wave in ((1.0, np.cos), (-1j, np.sin)):

                def curve(phi: float) -> float:
                    p, q = float(whole(phi)), float(base(phi))
                    return (q + factor * (p - q)) * float(wave(order * phi))  # noqa: B023

                total += part * quad(curve, left, right, epsabs=1e-3, epsrel=1e-13)[0]
        exact = 2.0 / PERIOD * total
        assert real[0, i] + 1j * imaginary[0, i] == pytest.approx(exact, abs=1e-9 * whole.peak)


def test_series_and_closed_form_meet() -> None:
    """Where the weights change from one to the other they are equal."""
    angle = np.linspace(-0.5 * PERIOD, 0.5 * PERIOD, 90, endpoint=False)
    step = PERIOD / 90
    below, above = (weights_of_knots(angle, PERIOD, np.array([2.0 / step * (1.0 + e)]))
                    for e in (-1e-13, 1e-13))  # fmt: skip
    assert below == pytest.approx(above, abs=1e-10 * np.abs(below).max())


def test_a_row_is_itself_among_others() -> None:
    whole = diagram(even=True)
    family = family_from_diagrams([10.0, 90.0], [whole, whole.scaled(1.5)])
    orders = 0.5 * np.arange(150)
    together = coefficients_of_rows(family, np.arange(100), orders, threads=3)
    for row in (0, 17, 99):
        alone = coefficients_of_rows(family, np.array([row]), orders)
        assert all((a[0] == t[row]).all() for a, t in zip(alone, together, strict=True))
