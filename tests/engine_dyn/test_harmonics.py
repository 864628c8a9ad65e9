"""Orders of the torque against transforms of the curves themselves."""

from typing import Any

import numpy as np
import pytest

from engine_dyn.forces import harmonics, mechanism, torque
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.geometry import kinematic_series, slider_crank
from engine_dyn.geometry.cylinders import Cylinders, cylinders_of, even_cylinders
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.pressure.diagram import diagram_from_points
from engine_dyn.pressure.family import Family, family_from_diagrams
from oracle.designs import Design
from tests.support.held_out import design_of, family_of

pytestmark = pytest.mark.quick

PERIOD = 4.0 * np.pi
POINTS = 65536
PHI = np.arange(POINTS) * (PERIOD / POINTS)
ROUNDING = POINTS * 1.1e-16
"""Of a transform, over the largest value of its curve."""
ORDERS = 0.5 * np.arange(1, 49)


@pytest.fixture(scope="module")
def design() -> Design:
    return design_of("alpha 1, constant, 3 cyl, power_mean")


@pytest.fixture(scope="module")
def family(design: Design) -> Family:
    return family_of(design, 1.0)


def transform(curve: Any) -> Any:
    return 2.0 * np.fft.rfft(curve)[..., 1:49] / POINTS


def engine_of(text: str, **factors: Any) -> dict[int, Cylinders]:
    made = cylinders_of(arrangement_from_text(text)).with_factors(**factors)
    return {len(made.members): made}


@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize(
    ("ratio", "offset"),
    [(1e-6, 0.0), (0.2, 0.0), (0.2, 0.25), (0.5, 0.0), (0.5, -0.4), (0.4, 0.5), (0.8, 0.0),
     (0.99, 0.0), (0.62, 0.6)],
)  # fmt: skip
def test_gas_harmonics_are_the_transform(
    family: Family, ratio: float, offset: float, even: bool
) -> None:
    """Of diagrams with even and uneven knots, and velocities of few and of many waves."""
    if not even:
        whole = family.row(0)
        kept = np.sort(np.random.default_rng(1).permutation(whole.angle.size)[:400])
        uneven = diagram_from_points(whole.angle[kept], whole.pressure[kept], PERIOD)
        family = family_from_diagrams([0.0], [uneven])
    found = harmonics.gas_harmonics(ORDERS, ratio, offset, 0.0, family, PERIOD)
    pressure = torque.pressure(PHI, family, 0.0)
    wanted = transform(pressure * slider_crank.velocity(PHI, ratio, offset))
    assert found == pytest.approx(wanted, abs=ROUNDING * pressure.max())


@pytest.mark.compiled
@pytest.mark.parametrize("highest", [0.4, 0.95])
def test_designs_of_many_crank_ratios_are_those_alone(family: Family, highest: float) -> None:
    """Bit for bit, with and without an offset, in any row, on any number of threads."""
    whole = family.row(0)
    rows = family_from_diagrams([10.0, 90.0], [whole, whole.scaled(1.5)])
    ratio = np.linspace(0.01, highest, 700)[:, None]
    offset = np.where(np.arange(700) % 3 == 0, 0.02, 0.0)[:, None]
    place = np.linspace(0.0, rows.row_count - 1.0, 700)[:, None]
    found = harmonics.gas_harmonics(ORDERS, ratio, offset, place, rows, PERIOD, threads=3)
    assert found.shape == (ratio.size, ORDERS.size)
    for i in (0, 50, 51, -1):
        alone = harmonics.gas_harmonics(
            ORDERS, ratio[i, 0], offset[i, 0], place[i, 0], rows, PERIOD
        )
        assert (found[i] == alone).all()


def test_rows_blend_as_their_pressures_do() -> None:
    whole = family_of(design_of("alpha 1, constant, 3 cyl, power_mean"), 2.0)
    low, high = whole.row(0), whole.row(0).scaled(1.4)
    two = family_from_diagrams([20.0, 80.0], [low, high])
    index, weight = two.locate(np.array(43.0))
    place = float(index + weight)
    found = harmonics.gas_harmonics(ORDERS, 0.3, 0.0, place, two, PERIOD)
    wanted = transform(torque.pressure(PHI, two, place) * slider_crank.velocity(PHI, 0.3))
    assert found == pytest.approx(wanted, abs=2.0 * ROUNDING * high.peak)


@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_inertia_and_velocity_harmonics(offset: float) -> None:
    v = slider_crank.velocity(PHI, 0.35, offset)
    b = slider_crank.acceleration(PHI, 0.35, offset)
    found = harmonics.velocity_harmonics(ORDERS, 0.35, offset)
    assert found == pytest.approx(transform(v), abs=2.0 * ROUNDING)
    found = harmonics.inertia_harmonics(ORDERS, 0.35, offset)
    assert found == pytest.approx(transform(-b * v), abs=2.0 * ROUNDING)


FACTORS = {"pressure_factor": (0.0, 1.0, 0.8, 1.0), "mass_factor": (1.0, 1.1, 1.0, 0.9)}
ENGINES = [
    ("V6 60 split-pin", {}), ("V8 cross-plane", {}), ("boxer 4", {}), ("parallel twin 270", {}),
    ("V6 90 shared-pin", {}), ("VR6 15", {}), ("in-line 4", FACTORS),
    ("in-line 4", {**FACTORS, "radius_factor": (1.0, 0.8, 1.2, 0.8)}),
]  # fmt: skip


@pytest.mark.parametrize("offset", [0.0, 0.1])
@pytest.mark.parametrize(("text", "factors"), ENGINES)
def test_engines_are_sums_over_cylinders(
    family: Family, text: str, factors: dict[str, Any], offset: float
) -> None:
    by_count = engine_of(text, **factors)
    ((count, engine),) = by_count.items()
    bore, stroke, mass, speed, crankcase = 0.1, 0.12, 1.4, 200.0, 1.1e5
    train = CrankTrain(0.3, stroke, count, PERIOD, offset, by_count)
    of_all = (ORDERS, 0.3, offset, count, by_count)
    gas = harmonics.gas_part(0.0, family, PERIOD)
    curve = torque.gas_torque(PHI, train, bore, torque.GasPressure(family, 0.0, 0.9, crankcase))
    work = 0.9 * harmonics.of_engine(gas, *of_all)
    work -= crankcase * harmonics.of_engine(harmonics.VELOCITY, *of_all)
    found = torque.piston_area(bore) * 0.5 * stroke * work
    assert found == pytest.approx(transform(curve), abs=ROUNDING * np.abs(curve).max())
    curve = torque.inertia_torque(PHI, train, mass, speed)
    found = mass * (0.5 * stroke * speed) ** 2 * harmonics.of_engine(harmonics.INERTIA, *of_all)
    assert found == pytest.approx(transform(curve), abs=ROUNDING * max(np.abs(curve).max(), 1.0))
    # A cylinder that does not burn has the harmonics of the motored pressure.
    own = engine.members[0].pressure_factor
    pressure = torque.pressure(PHI, family, 0.0, 1.0, own)
    wanted = transform(pressure * slider_crank.velocity(PHI, 0.3, offset))
    first = harmonics.of_first(gas, *of_all)
    assert first == pytest.approx(wanted, abs=ROUNDING * pressure.max())
    # The throws add up to the engine.
    assert engine.along_shaft is not None
    throws = np.arange(1, len(engine.along_shaft) + 1)[:, None]
    for part in (gas, harmonics.VELOCITY, harmonics.INERTIA):
        whole = harmonics.of_engine(part, *of_all)
        each = harmonics.of_throws(part, *of_all, throws)
        assert each.sum(axis=0) == pytest.approx(whole, abs=4e-12 * np.abs(each).max())


@pytest.mark.parametrize(("text", "factors"), ENGINES)
def test_gravity_harmonics(text: str, factors: dict[str, Any]) -> None:
    by_count = engine_of(text, **factors)
    ((count, engine),) = by_count.items()
    limit = ROUNDING * mechanism.GRAVITY * 0.06 * (1.4 + 2.2) * count  # they may cancel
    given = (0.3, 1.4, 2.2, 0.06, count, by_count, 0.2)
    for inclination in (0.0, 0.7):
        curve = mechanism.gravity_torque(PHI, *given, inclination=inclination)
        found = harmonics.gravity_harmonics(ORDERS, *given, inclination=inclination)
        assert found == pytest.approx(transform(curve), abs=limit)
    if not factors and mechanism.banks_of(engine)[0] == 0.0:
        alone = harmonics.gravity_harmonics(ORDERS, *given, True)
        one = {1: even_cylinders(1, PERIOD)}
        phi = PHI + engine.members[0].phase
        curve = mechanism.gravity_torque(phi, 0.3, 1.4, 2.2, 0.06, 1, one, 0.2)
        assert alone == pytest.approx(transform(curve), abs=limit)


def test_gravity_series_of_the_notes() -> None:
    # T_G = (G_l + G_r) sin + G_l (gamma_2 sin 2phi + ...); printed (G_l + G_l) sin.
    one = {1: even_cylinders(1, PERIOD)}
    found = harmonics.gravity_harmonics(np.array([1.0, 2.0, 4.0]), 0.3, 1.4, 2.2, 1.0, 1, one)
    gamma = kinematic_series.velocity_coefficients(np.array([2.0, 4.0]), 0.3)
    weights = np.array([1.4 + 2.2, *(1.4 * gamma)]) * mechanism.GRAVITY
    assert -found.imag == pytest.approx(weights, rel=1e-13)
    assert abs(-found.imag[0] - 2.0 * 1.4 * mechanism.GRAVITY) > 7.0


def test_which_orders_cancel_and_which_are_major() -> None:
    by_count = {z: even_cylinders(z, PERIOD) for z in (1, 4, 6)}
    orders = 0.5 * np.arange(1, 25)
    sums = np.abs(harmonics.phase_vectors(orders, np.array([1, 4, 6])[:, None], by_count))
    assert (sums[0] == 1.0).all()
    assert sums[1] == pytest.approx(np.where(orders % 2 == 0, 4.0, 0.0), abs=1e-12)
    assert sums[2] == pytest.approx(np.where(orders % 3 == 0, 6.0, 0.0), abs=1e-12)
    assert (sums[1][orders % 2 != 0] == 0.0).all()  # rounding is taken away
    two_stroke = {7: even_cylinders(7, 2.0 * np.pi)}
    sums = np.abs(harmonics.phase_vectors(np.arange(1.0, 15.0), 7, two_stroke))
    assert sums == pytest.approx(np.where(np.arange(1, 15) % 7 == 0, 7.0, 0.0), abs=1e-12)
