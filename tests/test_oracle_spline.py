"""The NumPy solver for tabulated diagrams against the adaptive one, and against itself."""

import math
from typing import Any

import numpy as np
import pytest

from oracle import golden, spline
from oracle.designs import HeldOut, _mean
from tests.support.held_out import diagram_of, items

GOLDEN = golden.read()
ITEMS = items()
KNOTS = np.radians(np.arange(-360.0, 360.0, 0.5))
NAMES = {
    spline.CONVERGED: "converged", spline.STALLED: "stalled",
    spline.NO_STEADY_STATE: "no_steady_state", spline.INVALID_INPUT: "invalid_input",
}  # fmt: skip


def columns(item: HeldOut, **changes: Any) -> spline.Designs:
    design = item.design
    given = {
        "row": 0.0, "scale": 1.0, "crankcase": design.crankcase_pressure,
        "crank_ratio": design.crank_ratio, "bore": design.bore, "stroke": design.stroke,
        "mass": design.reciprocating_mass, "inertia": design.inertia, "speed": design.omega_n,
        "exponent": design.load_exponent, "surplus": _mean(design) - design.load_offset,
        "cylinders": design.cylinders, "variable": design.inertia_model == "variable",
        "cycle_time": design.closure == "cycle_time",
    }  # fmt: skip
    return spline.Designs.of(**{**given, **changes})


def solve(item: HeldOut, splits: int = 1, **changes: Any) -> spline.Solutions:
    """With the pressure in closed form: then the knots are only where pieces meet."""
    return spline.solve(
        columns(item, **changes), lambda row, phi: item.design.pressure(phi), KNOTS, splits
    )


SOME = list(ITEMS)[:76:8] + list(ITEMS)[76::2]


@pytest.mark.parametrize("name", SOME)
def test_agrees_with_the_adaptive_solver(name: str) -> None:
    found, known = solve(ITEMS[name]), GOLDEN[name]
    assert NAMES[int(found.status[0])] == known["status"]
    if known["status"] != "converged":
        assert math.isnan(found.delta[0])
        return
    # That one is good to about 1e-10.
    for quantity in ("delta", "omega_max", "omega_min", "omega_mean"):
        assert getattr(found, quantity)[0] == pytest.approx(known[quantity], rel=5e-11), quantity


def test_batches_do_not_matter_and_the_spline_is_solved() -> None:
    """Several designs at once, the pressure from points."""
    item = ITEMS["alpha 1.6, constant, 3 cyl, power_mean"]
    diagram = diagram_of(item.design)
    designs = columns(item, exponent=np.linspace(0.0, 4.0, 9))
    whole = spline.solve(designs, lambda row, phi: diagram(phi), diagram.angle)
    for i in (0, 4, 8):
        alone = spline.solve(designs.take([i]), lambda row, phi: diagram(phi), diagram.angle)
        assert alone.delta[0] == pytest.approx(whole.delta[i], rel=1e-13)
    exact = solve(item, exponent=np.linspace(0.0, 4.0, 9))
    np.testing.assert_allclose(whole.delta, exact.delta, rtol=1e-7)


def test_tiny_irregularity_keeps_its_digits() -> None:
    """Delta falls as one over the inertia, to 1e-15 and below."""
    item = ITEMS["alpha 2, constant, 1 cyl, power_mean"]
    found = solve(item, inertia=item.design.inertia * np.array([1e5, 1e7, 1e11, 1e15]), mass=0.0)
    scaled = found.delta * np.array([1.0, 1e2, 1e6, 1e10])
    np.testing.assert_allclose(scaled, scaled[-1], rtol=1e-6)
    np.testing.assert_allclose(scaled[2:], scaled[-1], rtol=1e-10)
