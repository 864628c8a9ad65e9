"""Laws of the friction in scenes: components, their sum, the stroke, bearing pressures."""

import re
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

import sweeps
from sweeps.scene.engine.engine_files import load_engine
from tests.support.scenes import BEARINGS, VALVES, refusal_of

pytestmark = pytest.mark.compiled

LAW = {"friction_law": "patton_nitschke_heywood"}
PARTS = (
    "fmep_crankshaft_seals", "fmep_main_bearings", "fmep_crank_pin_bearings", "fmep_skirt",
    "fmep_rings", "fmep_ring_gas_pressure", "fmep_valve_train", "fmep_auxiliaries",
)  # fmt: skip
SHARES = ("bearings", "rings", "skirt", "valve_train", "auxiliaries")
FOUR = "si_four_87x101"


def run(engine: str = FOUR, *quantities: str, **tables: Any) -> xr.Dataset:
    return sweeps.run(engine=engine, output={"quantities": list(quantities)}, **tables)


def test_the_whole_engine_by_hand() -> None:
    """Chrysler 2.4, 3000 rpm, full load: the law written down once more, in its own units."""
    found = run(FOUR, *PARTS, "fmep_components", "pressure", axes={"speed": [3000, 5000]}).sel(
        speed=3000
    )
    b, s, z, n, piston = 87.5, 101.0, 4, 3000.0, 2.0 * 0.101 * 3000.0 / 60.0
    gas = float(found["pressure"].sel(crank_angle=-180)) / 1.01325
    slow = 1.0 + 1000.0 / n
    expected = {
        "crankshaft_seals": 1.22e5 * 60.0 / (b**2 * s * z),
        "main_bearings": 3.03e-4 * n * 60.0**3 * 22.2 * 5 / (b**2 * s * z)
        + 1.35e-10 * 60.0**2 * n**2 * 5 / z,
        "crank_pin_bearings": 3.03e-4 * n * 50.0**3 * 20.5 * 4 / (b**2 * s * z),
        "skirt": 294.0 * piston / b,
        "rings": 4.06e4 * slow / b**2,
        "ring_gas_pressure": 6.89 * gas * (0.088 * 9.4 + 0.182 * 9.4 ** (1.33 - 0.0238 * piston)),
        "valve_train": 4.12 + 244.0 * n * 12 / (b**2 * s * z) + 0.0227 * n * 16 / (s * z)
        + 0.2 * 8.5**1.5 * n**0.5 * 16 / (b * s * z) + 25.8 * slow * 8.5 * 16 / (s * z),
        "auxiliaries": 6.23 + 5.22e-3 * n - 1.79e-7 * n**2,
    }  # fmt: skip
    for name, kilopascal in expected.items():
        assert float(found[f"fmep_{name}"]) == pytest.approx(0.01 * kilopascal, rel=1e-9), name
    total = 0.01 * sum(expected.values())
    assert float(found["fmep_components"]) == pytest.approx(total, rel=1e-9)


def test_shares_add_up_and_the_law_makes_the_torque() -> None:
    shares = [f"friction_share_{group}" for group in SHARES]
    asked = (*PARTS, *shares, "fmep_components", "fmep", "friction_torque", "displacement")
    both = [
        run(FOUR, *asked, axes={"speed": [800, 2000, 6000], "load": [30, 65, 100]}, set=law)
        for law in ({}, LAW)
    ]
    for found in both:
        parts = sum(found[name] for name in PARTS)
        assert_allclose(parts, found["fmep_components"], rtol=1e-12)
        assert_allclose(sum(found[name] for name in shares), 1.0, rtol=1e-12)
    usual, by_component = both
    for name in (*PARTS, *shares, "fmep_components"):  # whatever law the friction is by
        assert_array_equal(usual[name], by_component[name])
    assert_array_equal(by_component["fmep"], by_component["fmep_components"])
    assert (np.abs(usual["fmep"] / usual["fmep_components"] - 1.0) > 0.01).any()
    torque = by_component["fmep"] * 1e5 * by_component["displacement"] / (4.0 * np.pi)
    assert_allclose(by_component["friction_torque"], torque, rtol=1e-12)
    # The gas presses on the rings: less of it at part load. All else knows no load.
    assert (by_component["fmep_ring_gas_pressure"].diff("load") > 0.0).all()
    assert set(by_component["fmep_valve_train"].dims) == {"speed"}


def test_a_published_breakdown() -> None:
    """Wong and Tung, Friction 4 (2016) 1: crankshaft 1.5 to 2 times the valve train, and so on.

    "Prevalent reported results": pistons about as much as crankshaft and valve train together. A
    tolerance of a factor of two, chosen before; the law is that of one engine, the statement that
    of many.
    """
    found = run(FOUR, *PARTS, axes={"speed": [2000, 3000, 4000]}).mean("speed")
    crankshaft = sum(float(found[name]) for name in PARTS[:3])
    piston = sum(float(found[name]) for name in PARTS[3:6])
    valves = float(found["fmep_valve_train"])
    assert 1.5 / 2.0 < crankshaft / valves < 2.0 * 2.0
    assert 0.5 < piston / (crankshaft + valves) < 2.0


def test_the_curve_of_one_cylinder_by_hand() -> None:
    """Rings by load times speed, skirt by the square of the speed, the rest constant.

    Means over half degrees of curves with kinks are exact to some 1e-4.
    """
    asked = ("instantaneous_friction_torque", "friction_torque", "fmep", *PARTS, "velocity",
             "pressure")  # fmt: skip
    found = sweeps.run(
        engine="ntua", set={**BEARINGS, **VALVES, **LAW, "ring_pressure": 2.0, "load": 90},
        output={"quantities": list(asked), "angle_step": 0.5},
    )  # fmt: skip
    speed = np.abs(found["velocity"])
    load = np.maximum(2.0 + found["pressure"] - 1.01325, 0.0)
    rings = (found["fmep_rings"] + found["fmep_ring_gas_pressure"]) / found["fmep"]
    skirt = found["fmep_skirt"] / found["fmep"]
    of_rings, of_skirt = load * speed, speed**2
    shape = (
        1.0 - rings - skirt
        + rings * of_rings / of_rings.mean("crank_angle")
        + skirt * of_skirt / of_skirt.mean("crank_angle")
    )  # fmt: skip
    expected = found["friction_torque"] * shape
    assert_allclose(found["instantaneous_friction_torque"], expected, rtol=2e-4)
    assert 0.1 < float(rings) < 0.6 and 0.05 < float(skirt) < 0.6


def test_a_speed_characteristic_finds_the_load() -> None:
    """The load whose brake torque is that of the curve, with the friction of that load."""
    rated = {"rated_power": 100e3, "rated_speed": 5200, "characteristic_share": 0.6}
    found = run(
        FOUR, "characteristic_load", "characteristic_torque", "torque_mean", "fmep",
        set={**LAW, **rated}, axes={"speed": [2500, 4000]},
        characteristic={"kind": "spark ignition"},
    )  # fmt: skip
    assert_allclose(found["torque_mean"], 0.6 * found["characteristic_torque"], rtol=1e-6)
    for speed in (2500, 4000):
        load = float(found["characteristic_load"].sel(speed=speed))
        alone = run(FOUR, "fmep", set={**LAW, "speed": speed, "load": load})
        assert float(alone["fmep"]) == pytest.approx(float(found["fmep"].sel(speed=speed)))


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"set": {"friction_law": "heywood"}},
         r"\[set\] friction_law = 'heywood': must be one of 'chen_flynn', 'patton_nitschke_"),
        ({"set": {"friction_law": 3}},
         r"\[set\] friction_law = 3: must be one of 'chen_flynn', 'patton_nitschke_heywood', or "
         r"its number from 1 to 2"),
        ({"axes": {"friction_law": [1, 2]}}, r"\[axes\] friction_law: must be one value, in \[set"),
        ({"designs": {"friction_law": [1, 2]}}, r"\[designs\] friction_law: must be one value"),
        ({"set": {"valve_train": "desmodromic"}}, r"\[set\] valve_train = 'desmodromic': .*'ohv'"),
        ({"set": {"camshaft_bearings": 2.5}}, r"\[set\] camshaft_bearings = 2.5: must be a whole"),
        ({"set": {"crank_pin_width": 0}}, r"\[set\] crank_pin_width = 0: must be a finite number"),
        ({"set": {**LAW, "friction_constant": 0.2}},
         r"\[set\] friction_constant: not allowed together with friction_law = "
         r"'patton_nitschke_heywood'"),
        ({"set": LAW, "axes": {"friction_skirt": [0.1, 0.2]}},
         r"\[axes\] friction_skirt: not allowed together with friction_law"),
        ({"engine": "ntua", "set": LAW},
         r"'fmep' needs \w+ .*which engine ntua does not give; must be in \[set\]"),
        ({"engine": "marine_80x345", "set": LAW},
         r"friction_law = 'patton_nitschke_heywood': the law of Patton, Nitschke and Heywood "
         r"applies to four-stroke engines; a cycle of engine marine_80x345 is one revolution"),
        ({"engine": "marine_80x345", "output": {"quantities": ["fmep_rings"]}},
         r"\[output\] quantities: 'fmep_rings': the law"),
    ],
)  # fmt: skip
def test_what_is_refused_in_one_line(tables: dict[str, Any], message: str) -> None:
    scene = {"engine": FOUR, "output": {"quantities": ["fmep"]}, **tables}
    assert re.search(message, refusal_of(lambda: sweeps.run(scene)))


PRESSURES = ("crank_pin", "main_journal", "piston_pin")


@pytest.mark.parametrize("bearing", PRESSURES)
def test_a_bearing_pressure_is_its_load_over_the_projected_area(bearing: str) -> None:
    widths = [0.02, 0.04]
    ends = ("", "_max", "_mean")
    asked = [f"{bearing}_{what}{end}" for what in ("load", "pressure") for end in ends]
    found = run(FOUR, *asked, axes={f"{bearing}_width": widths, "speed": [1500, 4000]})
    diameter = load_engine(FOUR).values[f"{bearing}_diameter"]
    for end in ends:
        load, pressure = found[f"{bearing}_load{end}"], found[f"{bearing}_pressure{end}"]
        assert pressure.attrs["units"] == "MPa"
        width = pressure[f"{bearing}_width"]
        assert width.values.tolist() == widths
        expected = (load / (diameter * width) * 1e-6).transpose(*pressure.dims)
        assert_allclose(pressure, expected, rtol=1e-12)
        assert f"{bearing}_width" not in load.dims


def test_bearing_pressures_of_the_catalogue_are_those_of_textbooks() -> None:
    """Turbocharged diesel: crank pins near the 52 to 55 MPa that linings bear; car engine: below.

    Neale, The Tribology Handbook, section A7, and Pratt and Perkins, SAE 810199.
    """
    asked = [f"{bearing}_pressure_max" for bearing in PRESSURES]
    diesel = run("diesel_105x137", *asked, axes={"speed": [1000, 1500, 2198]})
    car = run(FOUR, *asked, axes={"speed": [2600, 3900, 5200]})
    assert 40.0 < float(diesel["crank_pin_pressure_max"].max()) < 60.0
    assert 20.0 < float(car["crank_pin_pressure_max"].max()) < 52.0
    for found in (diesel, car):
        journals, pins = found["main_journal_pressure_max"], found["crank_pin_pressure_max"]
        assert (journals.max("main_bearing") < pins).all()
        assert (found["piston_pin_pressure_max"] > pins).all()
        assert found.attrs["warnings"] == ""
