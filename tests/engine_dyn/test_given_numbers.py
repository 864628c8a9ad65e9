"""Numbers that callers give: nothing is dropped or changed in silence."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import engine_dyn
from engine_dyn.flywheel import required_inertia, ring_mass, triangular_torque
from engine_dyn.given_numbers import given_array, given_number
from engine_dyn.loads.friction import FrictionShape
from engine_dyn.loads.torque_curves import torque_over_angle, torque_over_speed
from engine_dyn.speed.api import energy_swing
from engine_dyn.types import Floats


class Quantity:
    """As pint's quantities are to NumPy: a number that also has a unit."""

    magnitude, units = 0.1, "centimeter"

    def __float__(self) -> float:
        """Drop the unit, as pint does with a warning."""
        return self.magnitude


NO_NUMBERS: dict[str, Any] = {
    "nothing": None, "a text": "0.1", "truth": True, "complex": 1 + 2j, "beyond floats": 10**400,
    "masked": np.ma.masked_array([0.1, 0.2], [False, True]), "masked number": np.ma.masked,
    "with a unit": Quantity(), "units in a list": [Quantity(), Quantity()], "object": object(),
    "table": {}, "None in a list": [0.1, None], "texts": np.array(["0.1"]),
    "complex array": np.array([1j]), "truths": np.array([True]), "objects": np.array([None, 1.0]),
}  # fmt: skip


@pytest.mark.parametrize("kind", NO_NUMBERS)
def test_what_is_no_number_is_refused(kind: str) -> None:
    for take in (given_array, given_number):
        with pytest.raises(ValueError, match=r"^bore: \S") as refusal:
            take("bore", NO_NUMBERS[kind])
        assert "\n" not in str(refusal.value)


def test_numbers_of_every_kind_are_taken() -> None:
    assert given_number("x", Fraction(1, 4)) == 0.25
    assert given_number("x", np.float32(0.25)) == 0.25
    assert given_number("x", np.array(3)) == 3.0
    assert np.array_equal(given_array("x", [1, 2.5]), [1.0, 2.5])
    assert np.array_equal(given_array("x", np.ma.masked_array([1.0, 2.0])), [1.0, 2.0])
    array = np.array([1.0, np.nan])
    assert given_array("x", array) is array


def test_numbers_that_must_be_finite() -> None:
    with pytest.raises(ValueError, match=r"^x, value 2 = nan: must be a finite number$"):
        given_array("x", [1.0, np.nan], finite=True)
    with pytest.raises(ValueError, match=r"^x = inf: must be a finite number$"):
        given_number("x", np.inf, finite=True)


def _angles() -> Floats:
    return np.radians(np.arange(-360.0, 361.0))


def _pressures() -> Floats:
    return np.asarray(1e5 * (1.0 + 60.0 * np.exp(-(((np.degrees(_angles()) - 8.0) / 30.0) ** 2))))


@pytest.fixture(scope="module")
def diagram() -> engine_dyn.Diagram:
    return engine_dyn.diagram_from_points(_angles(), _pressures())


ENGINE: dict[str, Any] = {
    "bore": 0.1, "stroke": 0.12, "crank_ratio": 0.25, "reciprocating_mass": 1.0, "inertia": 1.0,
    "speed": 150.0, "cylinders": 4, "offset": 0.0, "load_exponent": 2.0, "load_linear": 0.0,
    "load_square": 0.0, "load_offset": 0.0, "friction_torque": 10.0, "gear_ratio": 1.0,
    "load_phase": 0.0, "load_scale": 1.0, "crankcase_pressure": 1e5, "tolerance": 1e-6,
    "start_angle": 0.0, "breakdown_torque": 1.0,
}  # fmt: skip

MOTIONS = (
    engine_dyn.position, engine_dyn.velocity, engine_dyn.acceleration, engine_dyn.rod_angle,
)  # fmt: skip
OF_CYLINDERS = (
    "firing_angles", "pressure_factor", "mass_factor", "radius_factor", "bore_factor",
)  # fmt: skip
OPTIONAL = ("passes", "start_speed", "synchronous_speed", "breakdown_slip", "crank_angle")


@pytest.mark.parametrize("name", [*ENGINE, *OF_CYLINDERS, *OPTIONAL])
def test_periodic_speed_refuses_what_is_no_number(diagram: engine_dyn.Diagram, name: str) -> None:
    for kind, value in [*NO_NUMBERS.items(), ("not finite", np.nan), ("infinite", -np.inf)]:
        if kind == "nothing" and name in ("load_exponent", *OF_CYLINDERS, *OPTIONAL):
            continue  # the default
        with pytest.raises(ValueError, match=name):
            engine_dyn.periodic_speed(diagram, **{**ENGINE, name: value})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mass_factor": 1.0}, "mass_factor: must be a list of numbers, one for each"),
        ({"pressure_factor": (1.0,)}, "pressure_factor: 1 values for 4 cylinders"),
        ({"mass_factor": (1.0, 1.0, 1.0, -0.1)}, "mass_factor, value 4 = -0.1: must be a number"),
        ({"bore_factor": (1.0, 0.9)}, "bore_factor: 2 values for 4 cylinders: must be one for"),
        ({"bore_factor": (1.0, 0.0, 1.0, 1.0)}, "bore_factor, value 2 = 0: must be a positive"),
        ({"bore_factor": (0.9, 1.0, 1.0, 1.0)}, "bore_factor, value 1 = 0.9: must be 1"),
        ({"diagrams": {2: 3}}, "diagrams, cylinder 2 = 3: must be a Diagram"),
        ({"diagrams": {5: 3}}, "diagrams, cylinder 5: must be a number from 1 to 4"),
    ],
)
def test_factors_are_one_for_each_cylinder(
    diagram: engine_dyn.Diagram, changes: dict[str, Any], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        engine_dyn.periodic_speed(diagram, **ENGINE, **changes)


def test_a_diagram_that_is_none_is_told_in_one_line() -> None:
    with pytest.raises(ValueError, match=r"^diagram = 3: must be a Diagram, as returned by"):
        engine_dyn.periodic_speed(3, **ENGINE)


TURN = np.radians(np.arange(0.0, 360.0, 2.0))
SIZES = {name: ENGINE[name] for name in ("bore", "stroke", "crank_ratio", "reciprocating_mass",
                                         "speed")}  # fmt: skip
SHAPE = (0.1, 0.1, 0.1, 0.1, 1e5)
CALLS: dict[str, tuple[str, Callable[[engine_dyn.Diagram, Any], Any]]] = {
    **{f"{call.__name__}, angle": ("phi", lambda _, v, call=call: call(v, 0.25))
       for call in MOTIONS},
    **{f"{call.__name__}, ratio": ("crank_ratio", lambda _, v, call=call: call(0.0, v))
       for call in MOTIONS},
    **{f"energy swing, {key}": (
        key, lambda d, v, key=key: energy_swing(d, **{**SIZES, key: v})
    ) for key in (*SIZES, "tolerance", "crankcase_pressure", "load_phase")},
    "required inertia": ("wanted_delta", lambda d, v: required_inertia(d, v, **SIZES)),
    "diagram": ("phi", lambda d, v: d(v)), "slope": ("phi", lambda d, v: d.derivative(v)),
    "over angle": ("theta", lambda _, v: torque_over_angle(TURN, np.sin(TURN) + 2.0)(v)),
    "over speed": ("omega", lambda _, v: torque_over_speed([0.0, 100.0], [1.0, 2.0])(v)),
    "angles": ("", lambda _, v: engine_dyn.diagram_from_points(v, _pressures())),
    "pressures": ("", lambda _, v: engine_dyn.diagram_from_points(_angles(), v)),
    "torques": ("", lambda _, v: torque_over_angle(TURN, v)),
    "speeds": ("", lambda _, v: torque_over_speed(v, [1.0, 2.0])),
    "a share": ("", lambda _, v: FrictionShape(v, *SHAPE[1:])),
    "ring pressure": ("", lambda _, v: FrictionShape(*SHAPE[:-1], v)),
    "power": ("", lambda _, v: triangular_torque(v, 100.0, 0.01)),
    "mass": ("", lambda _, v: ring_mass(v, 1.0, 0.5)),
    "loads": ("", lambda d, v: engine_dyn.family_from_diagrams(v, [d])),
}  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_other_calls_refuse_likewise(diagram: engine_dyn.Diagram, name: str) -> None:
    word, call = CALLS[name]
    finite = name.startswith(("energy swing", "required inertia"))
    for value in (*NO_NUMBERS.values(), *([np.nan] if finite else [])):
        with pytest.raises(ValueError, match=word or r"\S"):
            call(diagram, value)
