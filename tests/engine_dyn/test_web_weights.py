"""Counterweights on webs and the bending of bays, against statics written out here."""

from typing import Any

import numpy as np
import pytest

from engine_dyn.geometry.arrangement import FOUR_STROKE
from engine_dyn.geometry.cylinders import Cylinders, cylinders_of, even_cylinders
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.quantities.features import web_weights
from engine_dyn.quantities.features.web_weights import Crankshaft, WebWeights

RATIO, RADIUS = 0.28, 0.05


def weights(*rows: tuple[float, float, float, float]) -> WebWeights:
    """Mass, radius, angle in degrees and position of each."""
    mass, radius, angle, position = np.array(rows).T
    return WebWeights(mass, radius, np.radians(angle), position)


def shaft_of(engine: Cylinders, webs: WebWeights | None, **more: Any) -> Crankshaft:
    return Crankshaft(
        webs, more.pop("factor", 1.0), RATIO, more.pop("offset", 0.0), 1, {1: engine},
        crank_radius=RADIUS, **more,
    )  # fmt: skip


def test_rotating_masses_in_several_planes() -> None:
    """Shaft in four planes (Indian Administrative Service examination of 2004).

    B is 18 kg and C 12.5 kg at 6 cm, A and D are at 8 cm; C stands 100 and A 190 degrees from B;
    A to B is 10 cm, B to C 20 cm. A and D and the plane of D balance the shaft.
    """
    b, c = 18.0 * 0.06, 12.5 * 0.06 * np.exp(1j * np.radians(100.0))
    towards_a = np.exp(1j * np.radians(190.0))
    # Moments about the plane of D, at distance x from C, have no part across A; forces give D.
    across = np.array([(value * np.conj(towards_a)).imag for value in (b, c)])
    x = -0.2 * across[0] / across.sum()
    a = -((b * (0.2 + x) + c * x) * np.conj(towards_a)).real / (0.3 + x)
    d = -(a * towards_a + b + c)
    webs = weights(
        (a / 0.08, 0.08, 190.0, 0.0), (18.0, 0.06, 0.0, 0.1), (12.5, 0.06, 100.0, 0.3),
        (abs(d) / 0.08, 0.08, float(np.degrees(np.angle(d))), 0.3 + x),
    )  # fmt: skip
    shaft = shaft_of(even_cylinders(4, FOUR_STROKE), webs, spacing=0.1)
    assert abs(web_weights.unbalance(shaft)) < 1e-12
    assert abs(web_weights.couple(shaft)) < 1e-12
    without_d = WebWeights(*(v[:3] for v in vars(webs).values()))
    left = shaft._replace(webs=without_d)
    assert web_weights.unbalance(left) == pytest.approx(-d)
    assert web_weights.couple(left) == pytest.approx(-d * (0.3 + x - 0.15))


def bending(
    loads: list[tuple[complex, float]], first: float, last: float, ends: tuple[bool, bool]
) -> float:
    """Largest moment of a beam on two supports, its reactions from equilibrium, cut by cut."""
    here = [
        (force, z) for force, z in loads
        if (z > first or ends[0]) and (z <= last or ends[1])
    ]  # fmt: skip
    total = sum(force for force, _ in here)
    moment = sum(force * z for force, z in here)
    left, right = np.linalg.solve(
        np.array([[1.0, 1.0], [first, last]], dtype=complex), np.array([-total, -moment])
    )
    forces = [*here, (left, first), (right, last)]
    cuts = np.union1d(np.linspace(first - 0.3, last + 0.3, 4001), [z for _, z in forces])
    sizes = [abs(sum(force * max(cut - z, 0.0) for force, z in forces)) for cut in cuts]
    return max(sizes)


@pytest.mark.parametrize(
    ("text", "offset"),
    [("in-line 4", 0.0), ("in-line 3", 0.2), ("V8 cross-plane", 0.0), ("V6 60 split-pin", 0.1)],
)
def test_bending_of_bays(text: str, offset: float) -> None:
    made = arrangement_from_text(text, FOUR_STROKE)
    engine, spacing, bank_offset = cylinders_of(made), 0.13, 0.02
    random = np.random.default_rng(44)
    throws = sorted({throw.position for throw in made.throws})
    rows = [
        (random.uniform(0.5, 2.0), random.uniform(0.03, 0.06), random.uniform(-180.0, 180.0),
         float(spacing * random.uniform(throws[0] - 0.4, throws[-1] + 0.4)))
        for _ in range(2 * len(throws))
    ]  # fmt: skip
    rod, throw_mass, factor = 0.7, 1.9, 0.8
    shaft = shaft_of(
        engine, weights(*rows), offset=offset, factor=factor, spacing=spacing,
        bank_offset=bank_offset, rod_mass=rod, throw_mass=throw_mass,
    )  # fmt: skip
    first = made.throws[made.cylinders[0].throw].angle
    top = np.arcsin(offset * RATIO / (1.0 + RATIO))
    loads: list[tuple[complex, float]] = []
    middle = 0.5 * (len(made.banks) - 1)
    rods = [cylinder.throw for cylinder in made.cylinders]
    for cylinder in made.cylinders:
        throw = made.throws[cylinder.throw]
        direction = np.exp(1j * (throw.angle - first + top))
        mass = rod + throw_mass / rods.count(cylinder.throw)
        z = throw.position * spacing + (cylinder.bank - middle) * bank_offset
        loads.append((mass * RADIUS * direction, z))
    for mass, radius, angle, position in rows:
        vector = factor * mass * radius * np.exp(1j * (np.radians(angle) - first + top))
        loads.append((vector, position))
    bearings = np.concatenate(
        [[throws[0] - 0.5], 0.5 * (np.array(throws[1:]) + throws[:-1]), [throws[-1] + 0.5]]
    )
    bearings = bearings * spacing
    found = web_weights.largest_bending(shaft, np.arange(1, len(throws) + 2))
    for bay in range(len(throws)):
        ends = (bay == 0, bay == len(throws) - 1)
        expected = bending(loads, bearings[bay], bearings[bay + 1], ends)
        assert found[bay] == pytest.approx(expected, rel=1e-12)
    assert np.isnan(found[-1])

    # What journals bear has the force and the moment of all counterweights.
    journals = np.arange(1, len(bearings) + 1)
    shares = web_weights.on_journals(shaft, journals)
    upright = shares.sum() / web_weights.unbalance(shaft)
    assert abs(upright) == pytest.approx(1.0, rel=1e-12)
    places = bearings - 0.5 * spacing * (throws[0] + throws[-1])
    assert (shares * places).sum() / upright == pytest.approx(web_weights.couple(shaft), rel=1e-12)
