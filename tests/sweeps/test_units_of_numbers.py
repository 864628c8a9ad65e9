"""Units beside numbers: every key of scenes and engine files, options and conditions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest

import sweeps
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.quantities.node import Node
from sweeps.base.checks import Strict, number, unit_of_field
from sweeps.base.errors import SceneError
from sweeps.base.files.numbers_with_units import factor_between, number_with_unit
from sweeps.cli.searching import _setting
from sweeps.decide.optimise.space import read_space
from sweeps.scene.conditions import constraint
from sweeps.scene.engine.modelled_diagrams import KINDS
from sweeps.scene.json_schema import engine_schema
from sweeps.view.figures.options import options_of, with_targets
from tests.support.scenes import refusal

# Another unit of each kind, and how large one of it is, by hand
OTHERS = {
    "1": ("%", 0.01), "m": ("mm", 1e-3), "N m s rad-1": ("kN m s/rad", 1e3),
    "N m rad-1": ("MN m/rad", 1e6), "MPa": ("N/mm2", 1.0), "kg m2": ("kg cm²", 1e-4),
    "N m": ("kN·m", 1e3), "degree": ("rad", 57.29577951308232), "GPa": ("MPa", 1e-3),
    "kg": ("g", 1e-3), "m2": ("cm^2", 1e-4), "rpm": ("rad/s", 30.0 / math.pi),
    "rpm s-1": ("rad/s2", 30.0 / math.pi),
    "bar": ("Pa", 1e-5),
    "m s-1": ("mm/s", 1e-3), "W": ("kW", 1e3), "percent": ("%", 1.0), "N m s": ("kN m s", 1e3),
    "N m s2": ("kg m2", 1.0), "bar s m-1": ("kPa s/m", 0.01), "bar s2 m-2": ("Pa s2/m2", 1e-5),
    "rad s-1": ("rpm", 0.1047197551196598), "kg m-3": ("g/cm3", 1e3), "J": ("kWh", 3.6e6),
    "s": ("ms", 1e-3), "s-1": ("1/min", 1.0 / 60.0), "N": ("kgf", 9.80665),
    "W rad-1": ("kW/rad", 1e3),
}  # fmt: skip


def models(model: type[Strict] = Strict) -> Iterator[type[Strict]]:
    for one in model.__subclasses__():
        yield one
        yield from models(one)


@pytest.mark.parametrize(
    "node", [n for n in PARAMETERS.values() if not n.whole], ids=lambda n: n.name
)
def test_every_key_takes_another_unit(node: Node) -> None:
    unit, size = OTHERS[node.unit]
    assert number(f"3 {unit}", "x", node) == pytest.approx(3.0 * size, rel=1e-12)
    assert number(f"3 {node.unit}" if node.unit != "1" else "300 %", "x", node) == pytest.approx(
        3.0
    )
    with pytest.raises(SceneError, match="must be a number"):
        number("3 K", "x", node)


def test_every_number_of_tables_has_a_unit_that_its_words_name() -> None:
    """Numbers without a unit are those whose words name none; no model is left out."""
    engine_schema()  # Imports all models
    units = {(m.__name__, key): unit_of_field(m, key) for m in models() for key in m.model_fields}
    assert units["Disc", "ground_stiffness"] == "N m/rad" and units["Damper", "surface"] == "m2"
    assert units["StiffnessTable", "torque"] == "N m" and units["PressureScale", "speed"] == "rpm"
    assert units["TorqueDiagram", "areas"] == "J" and units["MountTable", "stiffness"] == "1"
    assert units["Output", "modes_below"] == "Hz" and units["Output", "modes"] is None
    for (_, key), unit in units.items():
        described = unit not in (None, "1")
        assert not described or factor_between(str(unit), str(unit)) == 1.0, key


def test_every_number_of_modelled_cycles_takes_a_unit() -> None:
    for kind in KINDS.values():
        for key, field in kind.fields.items():
            unit, size = {**OTHERS, "K": ("mK", 1e-3), "K-1": ("1/K", 1.0)}[field.unit]
            if unit != "mK":
                found = number(f"3 {unit}", key, unit=field.unit)
                assert found == pytest.approx(3.0 * size, rel=1e-12)


def test_scenes_with_units_are_those_without() -> None:
    plain = {"speed": 1500.0, "inertia": 2.0, "load": 50.0, "bore": 0.1}
    texts = {
        "speed": "157.07963267948966 rad/s",
        "inertia": "2e4 kg cm2",
        "load": "50 %",
        "bore": "10 cm",
    }
    tables: dict[str, Any] = {"output": {"quantities": ["delta"]}, "engine": "ntua"}
    one, other = (sweeps.read_scene({**tables, "set": given}) for given in (plain, texts))
    assert one.settings == pytest.approx(other.settings, rel=1e-12)
    axis = {"start": "60 kW", "stop": "100 kW", "num": 3}
    scene = {**tables, "axes": {"inertia": ["2 kg m2", 3]},
             "set": {"rated_power": "60 kW"}, "counterweights": [
                 {"mass": "500 g", "radius": "6 cm", "angle": "0.5 rev", "position": 0}
             ]}  # fmt: skip
    assert refusal({**scene, "axes": {"rated_power": axis, "inertia": ["2 kg"]}}).endswith(
        "inertia, value 1 = '2 kg': must be a number in kg m2, or a number with a unit, such as "
        "10 kg m2"
    )
    weight = scene["counterweights"][0]
    assert "mass = '5 m': must be a number in kg" in refusal(
        {**scene, "counterweights": [{**weight, "mass": "5 m"}]}
    )


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [("3 N m", "N m rad-1", 3.0), ("1 N m/deg", "N m rad-1", 57.29577951308232),
     ("1 lbf*ft", "N m", 1.3558179483314004), ("2 Nm", "N m", 2.0),
     ("4 ft-lbf", "N m", 5.4232717932), ("50 hp", "W", 37284.99358), ("7 kp/cm2", "bar", 6.864655)],
)  # fmt: skip
def test_units_of_practice(text: str, unit: str, value: float) -> None:
    assert number_with_unit(text, "x", unit) == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize(
    ("text", "unit"),
    [("3 rad/s", "Hz"), ("3 Hz", "rad s-1"), ("3 N m/rad", "N m"), ("1 deg", "1"), ("3 1/K", "K"),
     ("3 m" + " m" * 30, "m"), ("3 kWW", "W"), ("3 W(", "W"), ("3 MPa", "MPa degree-1")],
)  # fmt: skip
def test_another_dimension_is_refused(text: str, unit: str) -> None:
    with pytest.raises(SceneError, match="must be a number"):
        number_with_unit(text, "x", unit)


def test_options_take_units() -> None:
    assert _setting("speed=157.07963267948966 rad/s")[1] == pytest.approx(1500.0)
    with pytest.raises(SceneError, match="--set bore = '3 kg': must be a number in m"):
        _setting("bore=3 kg")
    space = read_space("bore = 80 to 90 mm", {}, "scene").parameters["bore"]
    assert space.words == "0.08 to 0.09"
    assert (
        read_space("stroke = 80, 9 cm", {}, "scene").parameters["stroke"].words
        == "one of 0.8, 0.09"
    )
    archive = sweeps.run("first", set={"speed": 1500}, output={"quantities": ["brake_power"]})
    target = with_targets(options_of(target="brake_power=20 kW"), archive).targets["brake_power"]
    assert target == (("20000", 20000.0),)
    with pytest.raises(SceneError, match="target brake_power = '3 bar': must be a number in W"):
        with_targets(options_of(target="brake_power=3 bar"), archive)
    assert constraint("omega_max <= 1600 rpm", lambda _: "rad s-1").limit == pytest.approx(
        167.55160819
    )
