"""Bearing loads against Newton's equations of the bodies and the momentum of the whole engine."""

from typing import Any

import numpy as np
import pytest

from engine_dyn.forces import bearings, mechanism, torque
from engine_dyn.geometry import masses, slider_crank
from engine_dyn.geometry.cylinders import Cylinders, cylinders_of, even_cylinders
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.pressure.family import Family, family_from_diagrams
from oracle.rigid_bodies import Bodies
from tests.support.held_out import design_of, family_of

pytestmark = pytest.mark.quick

PERIOD = 4.0 * np.pi
AREA, SCALE, CRANKCASE = 0.008, 0.9, 1.05e5


@pytest.fixture(scope="module")
def family() -> Family:
    return family_of(design_of("alpha 1, constant, 3 cyl, power_mean"), 1.0)


def engine_of(text: str, **factors: Any) -> dict[int, Cylinders]:
    made = cylinders_of(arrangement_from_text(text)).with_factors(**factors)
    return {len(made.members): made}


def factors_of(bodies: Bodies, turning: float, mass: float) -> bearings.Factors:
    centrifugal = bodies.radius * bodies.omega**2
    return bearings.Factors(
        SCALE * AREA, CRANKCASE * AREA, mass * centrifugal, turning * centrifugal
    )


def third_condition(offset: float) -> Bodies:
    """Bodies whose rod is exactly two masses."""
    bodies = Bodies(offset)
    bodies.rod_inertia = mechanism.two_mass_rod_inertia(
        bodies.rod_mass, bodies.centre, bodies.length
    )
    return bodies


@pytest.mark.parametrize("offset", [0.0, 0.2, -0.3])
def test_pins_against_newtons_equations(family: Family, offset: float) -> None:
    bodies = third_condition(offset)
    one = {1: even_cylinders(1, PERIOD)}
    at_crank = masses.rod_mass_at_crank(bodies.rod_mass, bodies.centre, bodies.length)
    at_piston = bodies.rod_mass - at_crank
    mass = bodies.piston_mass + at_piston
    phi = np.linspace(-6.0, 6.0, 9)
    gas = AREA * (torque.pressure(phi, family, 0.0, SCALE) - CRANKCASE)
    exact = [bodies.solve(float(p), float(g)) for p, g in zip(phi, gas, strict=True)]
    limit = 2e-6 * np.abs(gas).max()

    radial, tangential = bearings.crank_pin_load(
        phi, bodies.ratio, offset, family, 0.0, factors_of(bodies, at_crank, mass), 1, one
    )
    crank = bearings.first_crank(phi, bodies.ratio, offset, 1, one)
    turned = bearings.in_turned_axes(radial + 1j * tangential, crank)
    assert turned.real == pytest.approx([found["x"] for found in exact], abs=limit)
    assert turned.imag == pytest.approx([found["y"] for found in exact], abs=limit)
    assert tangential * bodies.radius == pytest.approx([f["torque"] for f in exact], abs=limit)

    side, down = bearings.piston_pin_load(
        phi, bodies.ratio, offset, family, 0.0, factors_of(bodies, at_piston, mass), 1, one
    )
    assert side == pytest.approx([found["thrust"] for found in exact], abs=limit)
    assert down == pytest.approx([found["down"] for found in exact], abs=limit)


ENGINES = ["in-line 4", "in-line 6", "V6 60 split-pin", "V8 cross-plane", "boxer 4", "radial 5",
           "VR6 15"]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "offset", "turning", "unequal"),
    [
        *((text, offset, 1.3, {}) for text in ENGINES for offset in (0.0, 0.2)),
        # counterweights balance more than what turns; throws and pistons differ
        ("in-line 4", 0.2, -0.5, {}),
        *(("in-line 3", offset, -0.5, {"radius_factor": (1.0, 1.3, 0.7),
                                       "mass_factor": (1.0, 1.2, 0.9),
                                       "pressure_factor": (1.0, 0.0, 0.8)})
          for offset in (0.0, 0.2)),
    ],
)  # fmt: skip
def test_loads_of_all_journals_are_what_the_engine_applies(
    family: Family, text: str, offset: float, turning: float, unequal: dict[str, Any]
) -> None:
    # Forces on the frame are those of the journals, of the pistons on the walls and of the gas on
    # the heads. Together they are minus the change of momentum of all masses.
    by_count = engine_of(text, **unequal)
    ((count, engine),) = by_count.items()
    bodies = Bodies(offset)
    ratio, radius, omega = bodies.ratio, bodies.radius, bodies.omega
    mass = 0.8
    factors = factors_of(bodies, turning, mass)
    phi = np.linspace(-6.0, 6.0, 13)
    assert engine.along_shaft is not None
    journals = np.arange(1, len(engine.along_shaft) + 2)[:, None]
    x, y = bearings.main_journal_load(
        phi, ratio, offset, family, 0.0, factors, count, by_count, journals
    )
    assert x.shape == (journals.size, phi.size)
    total = np.stack([x.sum(axis=0), y.sum(axis=0)])

    def centre(phi: Any) -> Any:
        """Sum of mass times place over all masses."""
        found: Any = 0.0
        for member, bank in zip(engine.members, mechanism.banks_of(engine), strict=True):
            angle, own = phi + member.phase, member.radius_factor
            crank = (
                angle
                + slider_crank.dead_centres(own * ratio, member.side * offset / own).top
                + bank
            )
            down = -own * slider_crank.position(angle, own * ratio, member.side * offset / own)
            axis = np.array([np.sin(bank), np.cos(bank)])[:, None]
            found = found + member.mass_factor * mass * radius * down * axis
            found = found + turning * radius * own * np.stack([np.sin(crank), np.cos(crank)])
        return found

    step = 1e-3
    weights = {-2: -1 / 12, -1: 4 / 3, 0: -5 / 2, 1: 4 / 3, 2: -1 / 12}
    force = sum(w * centre(phi + k * step) for k, w in weights.items()) * (omega / step) ** 2
    frame = total.copy()
    for member, bank in zip(engine.members, mechanism.banks_of(engine), strict=True):
        angle, own = phi + member.phase, member.radius_factor
        pressure = torque.pressure(angle, family, 0.0, SCALE, member.pressure_factor)
        gas = AREA * (pressure - CRANKCASE)
        beside = member.side * offset / own
        b = own * slider_crank.acceleration(angle, own * ratio, beside)
        inertia = -member.mass_factor * mass * radius * omega**2 * b
        thrust = (gas + inertia) * mechanism.thrust_ratio(
            angle, own * ratio, member.side * offset / own
        )
        frame += gas * np.array([np.sin(bank), np.cos(bank)])[:, None]
        frame -= thrust * np.array([np.cos(bank), -np.sin(bank)])[:, None]
    assert frame == pytest.approx(-force, abs=1e-6 * np.abs(total).max())


FACTORS: dict[str, Any] = {"radius_factor": (1.0, 1.3, 0.7), "mass_factor": (1.0, 1.2, 0.9),
                           "pressure_factor": (1.0, 0.0, 0.8)}  # fmt: skip


@pytest.mark.parametrize("load", list(bearings.LOADS))
@pytest.mark.parametrize(
    ("text", "unequal"),
    [
        ("in-line 3", FACTORS),
        ("V6 60 split-pin", {}),
        ("V8 cross-plane", {}),
        ("radial 5", {}),
        ("VR6 15", {}),
    ],
)
def test_extremes_are_those_of_the_curves_at_the_samples(
    family: Family, load: str, text: str, unequal: dict[str, Any]
) -> None:
    """The kernel against curves by other code, of designs drawn at random; the limit is the one
    that quantities have to keep."""
    two = family_from_diagrams([20.0, 80.0], [family.row(0), family.row(0).scaled(1.4)])
    by_count = engine_of(text, **unequal)
    ((count, engine),) = by_count.items()
    rng = np.random.default_rng(5)
    size = 12
    ratio, offset, row = (
        rng.uniform(low, high, (size, 1)) for low, high in ((0.2, 0.4), (-0.2, 0.2), (0.0, 119.0))
    )
    factors = bearings.Factors(
        *(rng.uniform(low, high, (size, 1)) for low, high in (
            (0.5 * AREA, AREA), (500.0, 1000.0), (1e3, 6e3), (-1e3, 3e3)))
    )  # fmt: skip
    assert engine.along_shaft is not None
    journals = np.arange(1, len(engine.along_shaft) + 2)[:, None, None]
    more = (journals,) if load == "main_journal" else ()
    phi = -0.5 * PERIOD + np.arange(1440) * (PERIOD / 1440)
    function = getattr(bearings, f"{load}_load")
    one, other = function(phi, ratio, offset, two, row, factors, count, by_count, *more)
    square = np.broadcast_to(one**2 + other**2, (*journals.shape[:1], size, 1440)[-one.ndim :])
    first = np.argmax(square >= square.max(axis=-1, keepdims=True) * (1.0 - 1e-12), axis=-1)
    before, top, after = (
        np.take_along_axis(square, (first[..., None] + step) % 1440, axis=-1)[..., 0]
        for step in (-1, 0, 1)
    )
    move = 0.5 * (before - after) / (before - 2.0 * top + after)
    found = bearings.extremes(
        load, ratio, offset, two, row, factors, count, by_count, PERIOD, *more, threads=3
    )[..., 0]
    assert found["mean"] == pytest.approx(np.sqrt(square).mean(axis=-1), rel=1e-9)
    # The peak is a point of the curve, not below a sample, and near the top of a parabola.
    one, other = function(
        found["angle"][..., None], ratio, offset, two, row, factors, count, by_count, *more
    )
    assert found["peak"] == pytest.approx(np.hypot(one, other)[..., 0], rel=1e-9)
    assert (found["peak"] >= np.sqrt(top) * (1.0 - 1e-12)).all()
    angle = -0.5 * PERIOD + (first + move) * (PERIOD / 1440)
    assert found["peak"] == pytest.approx(np.sqrt(top - 0.25 * (before - after) * move), rel=1e-4)
    assert np.median(np.abs(found["angle"] - angle)) < 1e-5 * PERIOD


def test_designs_share_tables(family: Family, monkeypatch: pytest.MonkeyPatch) -> None:
    by_count = {1: even_cylinders(1, PERIOD), 3: even_cylinders(3, PERIOD)}
    ratio = np.array([0.25, 0.3, 0.25])[:, None, None, None]
    count = np.array([1, 3])[:, None, None]
    gas = np.array([AREA, 2.0 * AREA])[:, None]
    journals = np.arange(1, 5)
    factors = bearings.Factors(gas, 1e5 * gas, 2000.0, 0.0)
    arguments = ("main_journal", ratio, 0.0, family, 0.0, factors, count, by_count, PERIOD)
    whole = bearings.extremes(*arguments, journals)
    assert whole.shape == (3, 2, 2, 4)
    assert np.isnan(whole["peak"][:, 0, :, 2:]).all()  # one cylinder has two journals
    assert np.isfinite(whole["peak"][:, 1]).all()
    assert np.isfinite(whole["angle"][:, 0, :, :2]).all()
    assert (whole["peak"][0, 1] == whole["peak"][2, 1]).all()
    alone = bearings.extremes(
        "main_journal", 0.3, 0.0, family, 0.0,
        bearings.Factors(2.0 * AREA, 2e5 * AREA, 2000.0, 0.0), 3, by_count, PERIOD, 2,
    )  # fmt: skip
    assert float(alone["peak"]) == whole["peak"][1, 1, 1, 1]
    monkeypatch.setattr(bearings, "DESIGNS_AT_ONCE", 7)
    monkeypatch.setattr(bearings, "BYTES_OF_TABLE", 1.0)
    pieces = bearings.extremes(*arguments, journals)
    for field in ("peak", "mean", "angle"):
        assert np.array_equal(pieces[field], whole[field], equal_nan=True)
