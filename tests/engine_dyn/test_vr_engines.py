"""VR engines against points on two lines beside the crank's axis, cylinder by cylinder."""

import math

import numpy as np
import pytest

from engine_dyn.forces import torque
from engine_dyn.forces.balance import running_gear
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.geometry.arrangement import FOUR_STROKE, Arrangement
from engine_dyn.geometry.cylinders import cylinders_of
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.pressure.family import Family, family_from_diagrams
from engine_dyn.speed.torque import mean_gas_of_unequal_throws
from tests.support.master_rods import diagram, slope

# Volkswagen 2.8 l VR6: stroke 90.3 mm, of which half is taken for the crank radius (the offset
# makes it 0.2 % less), rod 164 mm, offset of the banks 12.5 mm.
RADIUS, ROD, OFFSET, BANK = 0.04515, 0.164, 0.0125, math.radians(15.0)
RATIO, E = RADIUS / ROD, OFFSET / RADIUS
MASS, SPEED, SPACING, TURNING, AREA = 0.6, 500.0, 0.065, 0.4, 0.00515
TURN = np.arange(720) * (math.tau / 720)
TEXTS = ["VR6 15", "VR5 15", "VR6 10.6"]


def pins(text: str) -> list[tuple[float, float, float, float]]:
    """Direction of the cylinder, its offset, pin's direction at phi = 0, firing angle."""
    bank = math.radians(float(text.split()[1]))
    order = [1, 5, 3, 6, 2, 4] if text.startswith("VR6") else [1, 2, 4, 5, 3]
    found = []
    for number in range(1, len(order) + 1):
        fires = order.index(number) * 2.0 * math.tau / len(order)
        direction, beside = (0.0, OFFSET) if number % 2 else (-bank, -OFFSET)
        top = direction + math.asin(beside / (ROD + RADIUS))
        found.append((direction, beside, top - fires, fires))
    return found


def heights(text: str) -> np.ndarray:
    """Height of each piston pin along its cylinder over a revolution of the crank."""
    each = []
    for direction, beside, pin, _ in pins(text):
        place = RADIUS * np.exp(1j * (TURN + pin - direction))
        each.append(place.real + np.sqrt(ROD**2 - (place.imag - beside) ** 2))
    return np.array(each)


def family() -> Family:
    return family_from_diagrams([100.0], [diagram().diagrams[0]])


def test_the_pins_of_a_pair_stand_22_degrees_apart() -> None:
    """Liquisearch, VR6 engine, detailed specifications: journals "are offset 22 degrees"."""
    found = [pin for _, _, pin, _ in pins("VR6 15")]
    apart = math.degrees(abs(math.remainder(found[5] - found[0], math.tau)))
    assert apart == pytest.approx(21.853, abs=1e-3)
    assert round(apart) == 22
    made = arrangement_from_text("VR6 15")
    cylinders = cylinders_of(made)
    tops = [math.asin(m.side * OFFSET / (ROD + RADIUS)) for m in cylinders.members]
    for k, throw in enumerate(made.throws):
        assert math.remainder(throw.angle + tops[k] - found[k], math.tau) == pytest.approx(
            0.0, abs=1e-12
        )


@pytest.mark.parametrize("text", TEXTS)
def test_torque_is_that_of_points(text: str) -> None:
    cylinders = cylinders_of(arrangement_from_text(text))
    count, own = cylinders.count, family()
    assert cylinders.both_sides
    assert cylinders.even
    rates = slope(heights(text))
    phi = np.arange(1440) * (math.tau / 720)
    gas = sum(
        -AREA * np.tile(rate, 2) * (torque.pressure(phi - fires, own, 0.0) - 1e5)
        for rate, (_, _, _, fires) in zip(rates, pins(text), strict=True)
    )
    masses = -MASS * SPEED**2 * (rates * slope(heights(text), 2)).sum(axis=0)
    train = CrankTrain(RATIO, 2 * RADIUS, count, FOUR_STROKE, E, {count: cylinders})
    bore = math.sqrt(4.0 * AREA / math.pi)
    found = torque.gas_torque(phi, train, bore, torque.GasPressure(own, 0.0, 1.0, 1e5))
    assert np.abs(found - gas).max() < 1e-9 * np.ptp(gas)
    found = torque.inertia_torque(TURN, train, MASS, SPEED)
    assert np.abs(found - masses).max() < 1e-9 * MASS * (RADIUS * SPEED) ** 2
    mean = mean_gas_of_unequal_throws(RATIO, E, 0.0, own, count, {count: cylinders})
    assert count * AREA * RADIUS * float(mean) == pytest.approx(np.mean(gas), rel=1e-6)


@pytest.mark.parametrize("text", TEXTS)
def test_shaking_forces_are_those_of_points(text: str) -> None:
    lines = np.array([np.exp(1j * direction) for direction, *_ in pins(text)])
    places = np.arange(lines.size) - 0.5 * (lines.size - 1)
    turned = np.array([np.exp(1j * (TURN + pin)) for _, _, pin, _ in pins(text)])
    each = -MASS * SPEED**2 * lines[:, None] * slope(heights(text), 2)
    each = each + TURNING * RADIUS * SPEED**2 * turned
    gear = running_gear(
        cylinders_of(arrangement_from_text(text)), RATIO, RADIUS, MASS, SPEED, offset=E,
        spacing=SPACING, turning_mass=TURNING,
    )  # fmt: skip
    unit = MASS * RADIUS * SPEED**2
    force, moment = each.sum(axis=0), SPACING * (places[:, None] * each).sum(axis=0)
    assert np.abs(gear.force(TURN) - force).max() < 1e-9 * unit
    assert np.abs(gear.moment(TURN) - moment).max() < 1e-9 * unit
    assert float(gear.force_rms()) == pytest.approx(
        math.sqrt(np.mean(np.abs(force) ** 2)), abs=1e-9 * unit
    )
    assert float(gear.moment_max()) == pytest.approx(np.abs(moment).max(), rel=1e-4)
    for nu in (1, 2, 3):
        waves = np.fft.fft(moment) / TURN.size
        ellipse = gear.moment_ellipse(float(nu))
        assert float(ellipse.major) == pytest.approx(
            abs(waves[nu]) + abs(waves[-nu]), abs=1e-9 * unit
        )


@pytest.mark.parametrize(
    ("sides", "message"),
    [
        ((1.0,), "sides = 1: must be 1 or -1 for each of the banks"),
        ((1.0, 0.5), "sides = 1, 0.5: must be 1 or -1"),
        ((-1.0, 1.0), "sides = -1, 1: must be 1 for the bank of cylinder 1"),
    ],
)
def test_sides_that_are_none(sides: tuple[float, ...], message: str) -> None:
    made = arrangement_from_text("VR6 15")
    with pytest.raises(ValueError, match=message):
        Arrangement(made.period, made.throws, made.banks, made.cylinders, sides=sides)
