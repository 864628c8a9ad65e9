"""Offset, uneven firing, misfire and mass spread: an independent solution, limits, symmetry."""

import math
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from engine_dyn.forces import torque as forces
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.geometry.arrangement import Arrangement
from engine_dyn.geometry.cylinders import EQUAL, Cylinders, Member, cylinders_of, even_cylinders
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.geometry.slider_crank import crank_radius, crank_radius_of_ratio, dead_centres
from engine_dyn.loads.driven_machine import DrivenMachine
from engine_dyn.loads.friction import StrokeFriction
from engine_dyn.loads.torque_curves import torque_over_angle
from engine_dyn.pressure.diagram import diagram_from_points
from engine_dyn.pressure.family import family_from_diagrams
from engine_dyn.pressure.motored import motored
from engine_dyn.speed import dispatch
from engine_dyn.speed.fields import FRICTION_NAMES, TORQUE_NAMES
from engine_dyn.speed.torque import mean_gas_torque, torque_extremes
from oracle import solution
from oracle.designs import SmoothPressure, engine
from oracle.solution import CYCLE, Design
from sweeps.scene.engine.engine_files import load_engine
from tests.support.differences import slope
from tests.support.held_out import family_of, inputs_of, solved, torque_inputs_of

DEGREE = math.pi / 180.0


def arranged(text: str) -> Arrangement:
    return arrangement_from_text(text, CYCLE)


def angles_of(text: str) -> tuple[float, ...]:
    return tuple(arranged(text).firing_angles.tolist())


def unequal(
    cylinders: int, exponent: float, model: str, closure: str = "power_mean", **changes: Any
) -> Design:
    """A random engine; `offset` is over half the stroke."""
    random = Random(f"{cylinders} {exponent} {model} {closure}")
    design = engine(random, cylinders, exponent, model, closure, delta=0.01)
    assert isinstance(design.pressure, SmoothPressure)
    if "friction_shares" in changes:
        changes = {"ring_pressure": 1.2e5, **changes}
    if {"pressure_factors", "mass_factors", "radius_factors"} & set(changes):
        # The oracle numbers cylinders by their firing otherwise.
        changes = {"firing_angles": angles_of(f"in-line {cylinders}"), **changes}
    changes["offset"] = 0.5 * design.stroke * changes.get("offset", 0.0)
    if "pressure_factors" in changes:
        changes["motored"] = replace(design.pressure, burn=0.0, after=0.0)
    return replace(design, **changes)


SHARES = (0.3, 0.2, 0.25, 0.15)
"""Boundary, mixed, hydrodynamic, skirt."""

DESIGNS = {
    "offset, 1 cyl": unequal(1, 2.0, "constant", offset=0.4),
    "offset, 3 cyl, variable": unequal(3, 1.0, "variable", offset=-0.3),
    "offset, 2 cyl, cycle_time": unequal(2, 1.6, "constant", "cycle_time", offset=0.5),
    "twin 180": unequal(2, 2.0, "constant", firing_angles=angles_of("parallel twin 180")),
    "twin 270": unequal(2, 1.6, "constant", firing_angles=angles_of("parallel twin 270")),
    "twin 270, variable": unequal(2, 0.0, "variable", firing_angles=(0.0, 270.0 * DEGREE)),
    # no multiple of the width between nodes
    "V2 at 47.3 degrees": unequal(2, 2.0, "variable", firing_angles=(0.0, 407.3 * DEGREE)),
    "V6 90, shared pins": unequal(
        6, 2.0, "constant", firing_angles=angles_of("V6 90 shared-pin 1-6-5-4-3-2")
    ),
    "V6 90, shared pins, variable": unequal(
        6, 1.0, "variable", "cycle_time", firing_angles=angles_of("V6 90 shared-pin 1-6-5-4-3-2")
    ),
    "misfire, 4 cyl": unequal(4, 2.0, "constant", pressure_factors=(1.0, 1.0, 0.0, 1.0)),
    "misfire, 6 cyl": unequal(6, 0.0, "constant", pressure_factors=(1.0,) * 5 + (0.0,)),
    "half a misfire, 3 cyl": unequal(3, 1.6, "variable", pressure_factors=(1.0, 0.5, 1.1)),
    "mass spread, 4 cyl": unequal(4, 2.0, "constant", mass_factors=(1.0, 1.2, 0.9, 1.0)),
    "mass spread, 3 cyl, variable": unequal(3, 1.6, "variable", mass_factors=(1.3, 1.0, 0.8)),
    "everything": unequal(
        3, 2.0, "variable", offset=0.2, firing_angles=(0.0, 200.0 * DEGREE, 500.0 * DEGREE),
        pressure_factors=(0.9, 1.0, 0.3), mass_factors=(1.0, 0.9, 1.2),
    ),
    "throws of unequal radius": unequal(3, 2.0, "constant", radius_factors=(1.0, 0.8, 1.15)),
    "unequal throws, misfire, variable": unequal(
        4, 1.6, "variable", radius_factors=(1.0, 0.9, 0.9, 1.0), pressure_factors=(1, 1, 0, 1)
    ),
    "unequal throws, offset": unequal(
        3, 2.0, "constant", offset=0.35, radius_factors=(1.0, 0.8, 1.15)
    ),
    "unequal throws, offset, friction, variable": unequal(
        2, 1.6, "variable", offset=-0.3, radius_factors=(1.0, 0.9),
        pressure_factors=(1.0, 0.5), mass_factors=(1.0, 1.1), friction_shares=SHARES,
    ),
    "friction, 1 cyl": unequal(1, 2.0, "constant", friction_shares=SHARES),
    "friction, 2 cyl, variable": unequal(2, 1.0, "variable", friction_shares=SHARES),
    "friction, offset": unequal(2, 1.6, "constant", offset=0.3, friction_shares=SHARES),
    "friction, unequal throws, cycle_time": unequal(
        2, 2.0, "constant", "cycle_time", radius_factors=(1.0, 0.9),
        pressure_factors=(1.0, 0.4), friction_shares=(0.5, 0.0, 0.1, 0.2),
    ),
}  # fmt: skip


@pytest.mark.compiled
@pytest.mark.slow
@pytest.mark.parametrize("name", DESIGNS)
def test_agrees_with_an_independent_solution(name: str) -> None:
    design = DESIGNS[name]
    expected = solution.solve(design)
    assert expected.status == "converged"
    phi = np.linspace(-2.0 * np.pi, 2.0 * np.pi, 37)
    for method in ("auto", "newton"):
        found = solved(design, method=method)
        assert found.status == 0
        assert found.delta == pytest.approx(expected.delta, rel=1e-6)
        assert found.omega_max == pytest.approx(expected.omega_max, rel=1e-7)
        assert found.omega_min == pytest.approx(expected.omega_min, rel=1e-7)
        assert found.omega_mean == pytest.approx(expected.omega_mean, rel=1e-8)
        assert found.torque_mean == pytest.approx(expected.torque_mean, rel=1e-7)
    inputs = inputs_of(design, family_of(design)) | levels_of(design)
    inputs |= {
        "double_radius": 2.0 * design.radius, "offset_ratio": design.offset / design.radius,
        "mean_torque": found.torque_mean,
        "cylinders_by_count": {design.cylinders: cylinders(design)},
    }  # fmt: skip
    curves = dispatch.solve(wanted=("omega", "angular_acceleration"), crank_angle=phi, **inputs)
    np.testing.assert_allclose(curves["omega"], expected.omega(phi), rtol=1e-7)
    if design.friction_shares is None:  # else it has corners at dead centres
        rates = slope(lambda angle: 0.5 * expected.omega(angle) ** 2, phi, 2e-3)
        np.testing.assert_allclose(
            curves["angular_acceleration"], rates, rtol=0.0, atol=2e-6 * np.ptp(rates)
        )


@pytest.mark.compiled
@pytest.mark.parametrize("name", DESIGNS)
def test_energy_balance_and_torque(name: str) -> None:
    """Mean, extremes and swing of the torque curve against sums over cylinders."""
    design = DESIGNS[name]
    family = family_of(design)
    by_count = {design.cylinders: cylinders(design)}
    double_radius = 2.0 * design.radius
    offset = design.offset / design.radius
    phi = np.arange(14400) * (CYCLE / 14400)
    train = CrankTrain(design.crank_ratio, double_radius, design.cylinders, CYCLE, offset, by_count)
    pressure = forces.GasPressure(family, 0.0, 1.0, design.crankcase_pressure)
    gas = forces.gas_torque(phi, train, design.bore, pressure)
    inertia = forces.inertia_torque(phi, train, design.reciprocating_mass, design.omega_n)
    scale = np.ptp(gas)
    np.testing.assert_allclose(gas, solution.gas_torque(design, phi), atol=1e-6 * scale)
    np.testing.assert_allclose(
        inertia, solution.inertia_torque(design, phi), atol=1e-10 * np.ptp(inertia)
    )
    # Inertia does no work over a cycle; the gas does that of the mean torque.
    assert inertia.mean() == pytest.approx(0.0, abs=1e-12 * np.ptp(inertia))
    friction = solution.friction_torque(design, phi)
    mean = solved(design).torque_mean
    assert gas.mean() - design.friction_torque == pytest.approx(mean, rel=1e-8)
    inputs = torque_inputs_of(design, family) | levels_of(design)
    inputs |= {"double_radius": double_radius, "offset_ratio": offset}
    found = torque_extremes(wanted=TORQUE_NAMES, cylinders_by_count=by_count, **inputs)
    if design.friction_shares is not None:
        two_grid = [inputs[name] for name in FRICTION_NAMES]
        curve = forces.friction_over_stroke(
            phi, train, design.bore, pressure, design.friction_torque, StrokeFriction(*two_grid)
        )
        np.testing.assert_allclose(curve, friction, atol=1e-6 * np.ptp(friction))
        assert curve.mean() == pytest.approx(design.friction_torque, rel=1e-5)
    torque = gas + inertia - friction
    assert found["torque_max"] == pytest.approx(highest(torque), abs=1e-6 * scale)
    assert found["torque_min"] == pytest.approx(-highest(-torque), abs=1e-6 * scale)
    work = np.cumsum(torque - torque.mean()) * (CYCLE / phi.size)
    assert found["energy_swing"] == pytest.approx(np.ptp(work), rel=1e-4)
    # What the kinetic energy gains over any angle is the work of the torque less that of the load.
    one = solved(design, crank_angle=np.append(phi, CYCLE))
    variable = design.inertia_model == "variable"
    problem, _ = solution.problem_of(design)
    energy = 0.5 * design.inertia * one.omega**2 * problem.inertia_ratio(one.crank_angle)
    load = design.load_offset + one.load_coefficient * one.omega**design.load_exponent
    acting = (gas if variable else gas + inertia) - friction
    surplus = np.append(acting, acting[0]) - load
    gained = np.append(0.0, np.cumsum(0.5 * (surplus[1:] + surplus[:-1]))) * (CYCLE / phi.size)
    # Speeds are required within 1e-7 of their value, so the energy is within twice that.
    np.testing.assert_allclose(energy - energy[0], gained, atol=2e-7 * energy.max())


def highest(curve: np.ndarray) -> float:
    """Vertex of the parabola through the largest sample and its neighbours."""
    place = int(curve.argmax())
    left, top, right = (float(curve[(place + i) % curve.size]) for i in (-1, 0, 1))
    return top + 0.125 * (left - right) ** 2 / (2.0 * top - left - right)


def levels_of(design: Design) -> dict[str, float]:
    """Levels of the friction for `sweep`, nothing where it is constant."""
    if design.friction_shares is None:
        return {}
    area = 0.25 * np.pi * design.bore**2
    level = design.friction_torque / (design.cylinders * area * design.radius)
    two_grid = [share * level for share in design.friction_shares]
    return dict(zip(FRICTION_NAMES, [*two_grid, design.ring_pressure], strict=True))


def cylinders(design: Design) -> Cylinders:
    count = design.cylinders
    angles = design.firing_angles or tuple(np.arange(count) * CYCLE / count)
    ones = (1.0,) * count
    factors = design.pressure_factors or ones
    masses, radii = design.mass_factors or ones, design.radius_factors or ones
    each = zip(angles, factors, masses, radii, strict=True)
    members = (Member(-a, f, m, r) for a, f, m, r in each)
    return Cylinders(CYCLE, tuple(members))


@pytest.mark.compiled
@pytest.mark.parametrize("text", ["in-line 4", "in-line 5", "V8 cross-plane", "boxer 6"])
@pytest.mark.parametrize("model", ["constant", "variable"])
def test_even_engines_given_explicitly_are_the_same_bit_for_bit(text: str, model: str) -> None:
    angles = angles_of(text)
    count = len(angles)
    design = unequal(count, 1.6, model)
    implicit = solved(design)
    ones = (1.0,) * count
    explicit = solved(design, firing_angles=angles, pressure_factor=ones, mass_factor=ones)
    for field in ("delta", "omega_max", "omega_min", "omega_mean", "torque_mean", "delta_error"):
        assert getattr(explicit, field) == getattr(implicit, field)


def test_representatives() -> None:
    even = even_cylinders(6, CYCLE)
    assert even.plain
    assert even.representatives == (EQUAL,)
    assert even.solved == "Phi/6, even firing"
    twin = cylinders_of(arranged("parallel twin 180"))
    assert (twin.symmetry, len(twin.representatives)) == (1, 2)
    assert twin.solved == "whole cycle, uneven firing"
    six = cylinders_of(arranged("V6 90 shared-pin 1-6-5-4-3-2"))
    assert (six.symmetry, len(six.representatives)) == (3, 2)
    assert six.solved == "Phi/3, uneven firing"
    misfire = even.with_factors(pressure_factor=(1, 1, 0, 1, 1, 1))
    assert (misfire.symmetry, len(misfire.representatives)) == (1, 6)
    assert misfire.solved == "whole cycle, even firing, unequal cylinders"
    # Opposite cylinders of the firing order alike: half the cycle.
    paired = even.with_factors(mass_factor=(1.1, 1, 1, 1, 1, 1.1))
    assert (paired.symmetry, len(paired.representatives)) == (2, 3)
    assert not even.with_factors(mass_factor=(1.1,) * 6).plain
    assert even_cylinders(9, CYCLE).along_shaft is None
    assert cylinders_of(arranged("V8 cross-plane")).along_shaft == ((0, 1), (2, 3), (4, 5), (6, 7))


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("layout", "kinds"), [("in-line 6", 1), ("V6 90 shared-pin 1-6-5-4-3-2", 2)]
)
def test_misfires_of_equal_cylinders_have_columns_in_common(layout: str, kinds: int) -> None:
    """Delta to the bit, with curves and alone; curves as without turning, which loads prevent."""
    design = unequal(6, 1.6, "constant")
    whole = cylinders_of(arranged(layout))
    sets = {6 + n: whole.without(n) for n in range(7)}
    assert len({engine.turned[0] for engine in sets.values()}) == 1 + kinds
    given: dict[str, Any] = {
        **inputs_of(design, family_of(design, 1.0)), "cylinders": np.array(list(sets)),
        "cylinders_by_count": sets,
    }  # fmt: skip
    degrees = np.arange(-360.0, 360.0, 7.0) * DEGREE
    alone = dispatch.solve(wanted=("delta", "omega_min"), **given)
    curves: dict[str, Any] = {"wanted": ("delta", "omega_min", "omega"), "crank_angle": degrees}
    both = dispatch.solve(**curves, **given)
    for name in ("delta", "omega_min", "status"):
        np.testing.assert_array_equal(both[name], alone[name])
    assert len(set(alone["delta"][1:].tolist())) == kinds
    nothing = DrivenMachine(torque_over_angle(np.radians(np.arange(0.0, 360.0)), np.zeros(360)))
    still = dispatch.solve(**curves, **given, driven=nothing)
    np.testing.assert_allclose(both["omega"], still["omega"], rtol=1e-9)
    np.testing.assert_allclose(both["delta"], still["delta"], rtol=1e-7)


@pytest.mark.parametrize("offset", [-0.02, 0.0, 0.001, 0.05])
def test_crank_radius_of_ratio_makes_the_stroke(offset: float) -> None:
    radius = crank_radius_of_ratio(0.18, 0.3, offset)
    assert 2.0 * radius * dead_centres(0.3, offset / radius).stroke == pytest.approx(
        0.18, rel=1e-14
    )
    assert crank_radius(0.18, radius / 0.3, offset) == pytest.approx(radius, rel=1e-14)
    if offset == 0.0:
        assert radius == 0.5 * 0.18


def test_constructed_motored_diagram() -> None:
    """As if a modelled cycle had been measured: its own motored cycle comes back."""
    known = load_engine("b112", Path()).family.row(0)
    assert known.motored is not None
    exact, diagram = known.motored(), replace(known, motored=None)
    found = motored(diagram)
    near = np.radians(np.arange(-179.0, 100.0))
    np.testing.assert_allclose(found(near), exact(near), rtol=0.03)
    assert found.peak == pytest.approx(exact.peak, rel=0.02)
    assert abs(math.degrees(found.peak_angle)) < 1.0
    exchange = np.radians(np.concatenate([np.arange(-359.0, -51.0), np.arange(241.0, 359.0)]))
    np.testing.assert_allclose(found(exchange), diagram(exchange), rtol=1e-12)
    # With a dip to 0.1 bar in the intake, it is not taken for a diagram in megapascal.
    dip = 1.0 - 0.8 * np.exp(-(((np.degrees(diagram.angle) + 300.0) / 20.0) ** 2))
    low = motored(diagram_from_points(diagram.angle, 0.5 * dip * diagram.pressure))
    assert 0.05e5 < low.pressure.min() < 0.15e5
    assert low.peak < 35e5
    # What remains of its mean torque is the gas exchange: small, and negative.
    one = [float(mean_gas_torque(0.3, 0.0, family_from_diagrams([0.0], [d])))
           for d in (diagram, found, exact)]  # fmt: skip
    assert -0.12 * one[0] < one[1] < 0.0
    assert -0.12 * one[0] < one[2] < 0.0
