"""Sizes that no machine can have are refused, with the unit that may be meant; engines are not."""

from pathlib import Path

import numpy as np
import pytest

import sweeps
from engine_dyn.plausibility.possible import impossible, possible
from engine_dyn.quantities.graph import PARAMETERS
from engine_dyn.speed.keywords import check_keywords
from sweeps.base.checks import outside

KINDS = ("m", "kg", "rpm", "rad s-1", "bar", "MPa")
"""Units of lengths, masses, speeds and pressures."""

# A glow-plug engine of 0.16 cm3, and a two-stroke engine of 0.96 m bore for ships, with a margin.
SMALLEST = {"bore": 6e-3, "stroke": 5.7e-3, "rod_length": 0.01, "piston_mass": 2e-4, "speed": 3e4,
            "rod_inertia": 1e-9, "inertia": 1e-7, "crank_pin_diameter": 1.5e-3}  # fmt: skip
LARGEST = {"bore": 1.1, "stroke": 4.0, "rod_length": 5.0, "piston_mass": 2e4, "crank_mass": 2e5,
           "inertia": 1e7, "cylinder_spacing": 2.0, "shaft_length_3": 150.0, "speed": 60.0,
           "flywheel_outer_diameter": 9.0, "shaft_diameter_1": 1.3}  # fmt: skip


def test_all_sizes_have_ends_and_no_engine_is_beyond_them() -> None:
    for key, node in PARAMETERS.items():
        ends = possible(key, node.unit)
        assert node.unit not in KINDS or ends is not None, key
        assert ends is None or 0.0 <= ends.least < 1e-3 * ends.most, key
    for key, value in [*SMALLEST.items(), *LARGEST.items()]:
        node = PARAMETERS[key]
        assert not impossible(key, value, node.unit, node.si), key
        assert not outside(np.array([value]), node).any(), key


@pytest.mark.parametrize(
    ("key", "value", "unit"),
    [
        ("bore", 105, "mm"), ("bore_2", 105, "mm"), ("stroke", 137, "mm"),
        ("rod_length", 232, "mm"), ("crank_pin_diameter", 65, "mm"), ("pin_offset", -100, "mm"),
        ("crankcase_pressure", 101325, "Pa"), ("flywheel_density", 7.85, "g/cm3"),
        ("reciprocating_mass", 5e6, "g"), ("rim_stress_limit", 2e8, "Pa"),
    ],
)  # fmt: skip
def test_an_absurd_size_is_refused_and_its_unit_proposed(
    key: str, value: float, unit: str, tmp_path: Path
) -> None:
    scene = {"engine": "ntua", "set": {key: value}, "output": {"quantities": ["delta"]},
             "silenced_warnings": ["all"]}  # fmt: skip
    if key == "bore_2":
        scene["engine"] = "diesel_105x137"
    with pytest.raises(sweeps.SceneError) as caught:
        sweeps.plan(scene)
    said = str(caught.value)
    assert f"[set] {key} = {value:.12g}: must be at " in said and said.endswith(f"in {unit}?")


def test_it_is_refused_wherever_values_are_given(tmp_path: Path) -> None:
    table = tmp_path / "designs.csv"
    table.write_text("bore,stroke\n0.1,0.12\n105,0.12\n")
    scene = {"engine": "ntua", "output": {"quantities": ["delta"]}}
    for more, where in (
        ({"axes": {"bore": [0.1, 105.0]}}, "[axes] bore = 105"),
        ({"designs": {"file": str(table)}}, "designs.csv, line 3: bore = 105"),
    ):
        with pytest.raises(sweeps.SceneError, match="must be at most 10 m") as caught:
            sweeps.plan({**scene, **more})
        assert where in str(caught.value) and str(caught.value).endswith("in mm?")
    with pytest.raises(ValueError, match=r"bore = 105: must be at most 10 m, .* is it in mm\?"):
        check_keywords(bore=105.0)
    with pytest.raises(ValueError, match="speed = 200000: must be at most 1e"):
        check_keywords(speed=200000.0)
