"""The masses of throws where rods share a pin, against sums over throws and rods made here.

Every engine is a table of throws, banks and cylinders. A throw of mass m_t counts once, a rod's
turning part m_r and a reciprocating mass m for each cylinder. With the pin of each throw at d, and
each cylinder at g fired at f (so that its pin is at g - f = d):

    moment of inertia  r^2 (T m_t + Z m_r + Z m mean(v^2))
    order 1, forward   r omega^2 (sum m_t e^(i d) + sum (m_r + m/2) e^(i (g - f)))
    order 1, backward  r omega^2 (m/2) sum e^(i (g + f))

The piston's travel has the first harmonic r cos(phi) exactly: the rod adds even ones alone.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pytest

import sweeps

pytestmark = pytest.mark.compiled

RADIUS, LENGTH, SPACING, RPM = 0.045, 0.15, 0.11, 3000.0
OMEGA = RPM * math.pi / 30.0
PULL = RADIUS * OMEGA**2
THROW, PISTON, ROD, CENTRE = 2.0, 0.5, 0.6, 0.04
TURNING, RECIPROCATING = ROD * (1.0 - CENTRE / LENGTH), PISTON + ROD * CENTRE / LENGTH
GRAVITY = 9.80665


class Engine(NamedTuple):
    """Throws (angle, place), banks, cylinders (throw, bank, firing angle); degrees, from 0."""

    throws: Sequence[tuple[float, float]]
    banks: Sequence[float]
    cylinders: Sequence[tuple[int, int, float]]

    def table(self) -> dict[str, Any]:
        throws = [{"angle": angle, "position": place} for angle, place in self.throws]
        cylinders = [
            {"throw": throw + 1, "bank": bank + 1, "firing_angle": firing}
            for throw, bank, firing in self.cylinders
        ]
        table = {"throws": throws, "banks": self.banks, "cylinders": cylinders}
        return {**table, "uneven": True}

    def levers(self) -> list[float]:
        places = [place for _, place in self.throws]
        middle = 0.5 * (min(places) + max(places))
        return [SPACING * (place - middle) for place in places]

    def first_order(self, rod: float, throw: float, moment: bool = False) -> float:
        """Long semi-axis, with what counterweights leave of the masses of a rod and a throw."""
        levers = self.levers() if moment else [1.0] * len(self.throws)
        forward = sum(
            throw * lever * np.exp(1j * math.radians(angle))
            for lever, (angle, _) in zip(levers, self.throws, strict=True)
        )
        backward = 0.0
        for place, bank, fires in self.cylinders:
            across, firing = math.radians(self.banks[bank]), math.radians(fires)
            share = 0.5 * RECIPROCATING
            forward += levers[place] * (rod + share) * np.exp(1j * (across - firing))
            backward += levers[place] * share * np.exp(1j * (across + firing))
        return float(PULL * (abs(forward) + abs(backward)))


ENGINES = {
    "V8, shared pins": Engine(
        [(0, 0), (270, 1), (90, 2), (180, 3)], [0, 90],
        [(0, 0, 0), (1, 0, 90), (2, 0, 270), (3, 0, 180),
         (0, 1, 450), (1, 1, 540), (2, 1, 360), (3, 1, 630)],
    ),
    "V6, split pins": Engine(
        [(0, 0), (300, 0), (120, 1), (60, 1), (240, 2), (180, 2)], [0, 60],
        [(0, 0, 0), (2, 0, 240), (4, 0, 480), (1, 1, 120), (3, 1, 360), (5, 1, 600)],
    ),
    "radial 9": Engine(
        [(0, 0)], [40.0 * k for k in range(9)],
        [(0, k, 40.0 * k + 360.0 * (k % 2)) for k in range(9)],
    ),
    "in-line 4": Engine(
        [(0, 0), (180, 1), (180, 2), (0, 3)], [0],
        [(0, 0, 0), (1, 0, 180), (2, 0, 540), (3, 0, 360)],
    ),
    "two rods and one": Engine(
        [(0, 0), (180, 1)], [0, 90], [(0, 0, 0), (0, 1, 90), (1, 0, 180)],
    ),
}  # fmt: skip
EACH = pytest.mark.parametrize("name", ENGINES)
ALIKE = [name for name in ENGINES if name != "two rods and one"]


def run(
    engine: Engine, quantities: list[str], axes: Any = None, angle_step: float = 10.0, **values: Any
) -> Any:
    own = {
        "stroke": 2.0 * RADIUS, "rod_length": LENGTH, "piston_mass": PISTON, "rod_mass": ROD,
        "rod_centre_of_gravity": CENTRE, "crank_mass": THROW, "cylinder_spacing": SPACING,
        "speed": RPM, "cylinders": len(engine.cylinders), "arrangement": engine.table(),
    }  # fmt: skip
    values = {key: value for key, value in {**own, **values}.items() if key not in (axes or {})}
    output = {"quantities": quantities, "angle_step": angle_step, "highest_order": 2}
    scene = {"engine": "v8_cross_plane_93x86", "set": values, "axes": axes or {}, "output": output}
    return sweeps.run(scene)


@EACH
def test_the_moment_of_inertia_has_each_throw_once(name: str) -> None:
    engine = ENGINES[name]
    phi, ratio = np.arange(720) * (math.tau / 720), RADIUS / LENGTH
    sine, cosine = np.sin(phi), np.cos(phi)
    velocity = sine + ratio * sine * cosine / np.sqrt(1.0 - (ratio * sine) ** 2)
    each = TURNING + RECIPROCATING * np.mean(velocity**2)
    whole = RADIUS**2 * (len(engine.throws) * THROW + len(engine.cylinders) * each)
    found = run(engine, ["engine_inertia", "rotating_mass", "rotating_force"])
    assert float(found["engine_inertia"]) == pytest.approx(whole, rel=1e-12)
    turning = TURNING + THROW * len(engine.throws) / len(engine.cylinders)
    assert float(found["rotating_mass"]) == pytest.approx(turning, rel=1e-12)
    assert float(found["rotating_force"]) == pytest.approx(turning * PULL, rel=1e-12)


@EACH
def test_first_orders_of_force_and_moment(name: str) -> None:
    engine = ENGINES[name]
    asked = ["shaking_force_major", "shaking_moment_major", "throw_force", "counterweight_force"]
    weights = {
        "none": ({"counterweight_mass": 0.0}, TURNING, THROW),
        "given": (
            {"counterweight_mass": 1.5, "counterweight_radius": 0.06},
            TURNING, THROW - 1.5 * 0.06 / RADIUS,
        ),
        "by fraction": ({"counterweight_fraction": 0.4}, -0.4 * RECIPROCATING, 0.0),
    }  # fmt: skip
    whole = PULL * max(len(engine.cylinders) * RECIPROCATING, THROW)
    for given, rod, throw in weights.values():
        found = run(engine, asked, **given).sel(order=1.0)
        force, moment = engine.first_order(rod, throw), engine.first_order(rod, throw, moment=True)
        limit = {"rel": 1e-11, "abs": 1e-11 * whole}
        assert float(found["shaking_force_major"]) == pytest.approx(force, **limit)
        assert float(found["shaking_moment_major"]) == pytest.approx(moment, **limit)
        pins = [math.radians(engine.throws[throw_of][0]) for throw_of, _, _ in engine.cylinders]
        rods = np.sum(np.exp(1j * np.array(pins)))
        throws = sum(np.exp(1j * math.radians(angle)) for angle, _ in engine.throws)
        phi = np.radians(found["crank_angle"].values)
        for what, amplitude in {
            "throw_force": TURNING * rods + THROW * throws,
            "counterweight_force": (rod - TURNING) * rods + (throw - THROW) * throws,
        }.items():
            vector = PULL * amplitude * np.exp(1j * phi)
            got = found[what].sel(direction=0) + 1j * found[what].sel(direction=90)
            assert np.abs(got.values - vector).max() < 1e-11 * whole, what


def test_a_v8_with_throws_of_two_kilograms() -> None:
    """(2 m_rod + m_rec + m_throw) r omega^2 a |sum z e^(i d)|, with sqrt(10) from 90 degrees."""
    engine = ENGINES["V8, shared pins"]
    found = run(
        engine, ["shaking_moment_major"], {"crank_mass": [0.0, 2.0]}, counterweight_mass=0.0
    )["shaking_moment_major"].sel(order=1.0)
    levers = np.abs(np.sum([-1.5, -0.5 * -1j, 0.5 * 1j, -1.5]))
    assert levers == pytest.approx(math.sqrt(10.0))
    for mass in (0.0, 2.0):
        closed = (2.0 * TURNING + RECIPROCATING + mass) * PULL * SPACING * levers
        assert float(found.sel(crank_mass=mass)) == pytest.approx(closed, rel=1e-12)
    assert found.values == pytest.approx([2379.0, 5469.0], abs=0.5)


@pytest.mark.parametrize("name", ALIKE)
def test_counterweights_of_each_throw_are_those_of_the_fraction(name: str) -> None:
    engine, fraction, arm = ENGINES[name], 0.3, 0.06
    asked = ["shaking_force_max", "shaking_moment_rms", "unbalanced_mass", "main_journal_y",
             "counterweight_required", "counterweight_force"]  # fmt: skip
    found = run(engine, asked, counterweight_fraction=fraction, counterweight_radius=arm)
    rods = len(engine.cylinders) / len(engine.throws)
    mass = THROW + rods * (TURNING + fraction * RECIPROCATING)
    assert float(found["unbalanced_mass"]) == pytest.approx(mass, rel=1e-12)
    weight = float(found["counterweight_required"])
    assert weight == pytest.approx(mass * RADIUS / arm, rel=1e-12)
    given = run(engine, asked[:4] + asked[5:], counterweight_mass=weight, counterweight_radius=arm)
    for what in asked[:2] + asked[3:4] + asked[5:]:
        limit = 1e-9 * float(np.abs(found["main_journal_y"]).max())
        assert np.abs(given[what] - found[what]).max() < limit, what


@EACH
@pytest.mark.parametrize("weight", [None, 1.5])
def test_main_journals_and_gravity_have_each_throw_once(name: str, weight: float | None) -> None:
    """What a throw adds: half its pull to each journal beside it, its weight to the torque."""
    engine = ENGINES[name]
    asked = ["main_journal_x", "main_journal_y", "gravity_torque", "crank_pin_load",
             "main_journal_load_max", "gravity_torque_order"]  # fmt: skip
    given = {} if weight is None else {"counterweight_mass": weight, "counterweight_radius": 0.06}
    found = run(engine, asked, {"crank_mass": [0.0, THROW]}, angle_step=0.05, **given)
    added = found.sel(crank_mass=THROW) - found.sel(crank_mass=0.0)
    span = max(engine.banks) - min(engine.banks)
    upright = 0.5 * (max(engine.banks) + min(engine.banks)) if span <= 180.0 else 0.0
    phi = np.radians(found["crank_angle"].values)
    places = sorted({place for _, place in engine.throws})
    torque = 0.0
    journals = np.zeros((len(places) + 1, phi.size), dtype=complex)
    for angle, place in engine.throws:
        lean = phi + math.radians(angle - upright)
        for journal in (places.index(place), places.index(place) + 1):
            journals[journal] += 0.5 * THROW * PULL * (np.sin(lean) + 1j * np.cos(lean))
        torque += THROW * GRAVITY * RADIUS * np.sin(lean)
    got = added["main_journal_x"] + 1j * added["main_journal_y"]
    gas = float(np.abs(found["main_journal_y"]).max())
    got = got.transpose("main_bearing", "crank_angle").values
    assert np.abs(got - journals).max() < 1e-11 * gas
    assert np.abs(added["gravity_torque"].values - torque).max() < 1e-11
    first = 2.0 * np.mean(found["gravity_torque"].values * np.exp(-1j * phi), axis=-1)
    order = found["gravity_torque_order"].sel(order=1.0)
    assert np.abs(order.values - np.abs(first)).max() < 1e-11
    largest = np.hypot(found["main_journal_x"], found["main_journal_y"]).max("crank_angle")
    assert np.allclose(found["main_journal_load_max"], largest, rtol=2e-5)
    assert found["crank_pin_load"].dims == ("crank_angle",)  # of the rod alone
