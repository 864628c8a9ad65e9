"""Which modes of a shaft a scene computes, and that it says so."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps
from sweeps.scene.plan.forecast import text
from tests.support.shafts import complete_shaft


def chain(count: int, stiffness: float = 300.0, held: float = 0.0) -> dict[str, Any]:
    """Equal discs of 2 kg m2, the first on a spring."""
    discs: list[dict[str, Any]] = [{"name": f"d{i}", "inertia": 2.0} for i in range(count)]
    discs[0] |= {"throw": 1}
    if held:
        discs[0]["ground_stiffness"] = held
    return {
        "reciprocating": "included", "flywheel": "d0", "discs": discs,
        "shafts": [{"stiffness": stiffness} for _ in discs[1:]],
    }  # fmt: skip


def run(quantities: list[str], shaft: Any, **tables: Any) -> xr.Dataset:
    scene = posed(quantities, shaft, **tables)
    return sweeps.run(scene)


def posed(quantities: list[str], shaft: Any, **tables: Any) -> dict[str, Any]:
    return {
        "engine": "ntua", "shaft": shaft, "silenced_warnings": ["all"],
        "set": {"speed": 1500, "cylinders": 1}, **tables,
        "output": {"quantities": quantities, **tables.get("output", {})},
    }  # fmt: skip


@pytest.mark.parametrize("count", [2, 5, 12])
def test_a_held_chain_has_as_many_modes_as_discs(count: int) -> None:
    """f_i = sqrt(k/J)/pi sin((2 i - 1) pi/(2 (2 n + 1))): theta_0 = 0, and a free end."""
    found = run(["natural_frequency", "mode_shape"], chain(count, held=300.0))
    place = 2 * np.arange(1, count + 1) - 1
    expected = np.sqrt(150.0) / np.pi * np.sin(place * np.pi / (2 * (2 * count + 1)))
    assert_allclose(found.natural_frequency, expected, rtol=1e-10)
    assert_allclose(np.abs(found.mode_shape).max("disc"), 1.0, rtol=1e-9)
    assert found.mode.attrs["comment"] == f"{count} of {count} modes of the system"


def test_a_set_on_the_grid_swings_against_it() -> None:
    """Two discs, the second on a spring: the quadratic of its determinant."""
    shaft = chain(2, 15e3)
    shaft["discs"][0]["inertia"] = 2.36
    shaft["discs"][1]["ground_stiffness"] = 7639.0
    found = run(["natural_frequency"], shaft)
    matrix = np.array([[15e3, -15e3], [-15e3, 22639.0]]) / np.array([[2.36], [2.0]])
    squares = np.sort(np.linalg.eigvals(matrix).real)
    assert_allclose(found.natural_frequency, np.sqrt(squares) / (2.0 * np.pi), rtol=1e-12)


@pytest.mark.parametrize(
    "axes",
    [
        {"shaft_stiffness_2": [1e5, 2e6, 1e7]},
        {"disc_inertia_2": [0.05, 3.0], "damper_stiffness_1": [0.0, 1e4], "speed": [1000, 2400]},
        {"shaft_length_6": [0.1, 2.0], "shaft_gear_ratio_1": [-2.0, 0.1]},
        {"wanted_delta": [0.01, 0.1]},
    ],
)
def test_all_modes_that_orders_can_excite_are_there_by_default(axes: dict[str, Any]) -> None:
    """In every design, whichever way its frequencies change; six at least."""
    shaft = complete_shaft(6)
    shaft["pendulums"] = []
    del shaft["load"], shaft["dampers"][0]["surface"]
    posing: dict[str, Any] = {"engine": "diesel_105x137", "axes": axes, "set": {}}
    if "speed" not in axes:
        posing["set"]["speed"] = 1500
    for order in (12, 48):
        found = run(["natural_frequency"], shaft, **posing, output={"highest_order": order})
        every = run(["natural_frequency"], shaft, **posing, output={"modes": 10})
        kept = found.sizes["mode"]
        highest = order * np.max(axes.get("speed", 1500)) / 60.0
        left = every.natural_frequency.isel(mode=slice(kept, None)).values
        assert kept >= 6 and not (left <= highest).any()
        assert f"{kept} of 10 modes" in found.mode.attrs["comment"]
        assert_allclose(found.natural_frequency, every.natural_frequency[..., :kept])


def test_many_modes_are_those_in_range_or_as_asked_for() -> None:
    long = chain(12)
    assert run(["natural_frequency"], long).sizes["mode"] == 11
    stiff = chain(12, 1.5e7)  # from 114 Hz to 864 Hz, orders to 300 Hz
    slow = run(["natural_frequency"], stiff)
    assert slow.sizes["mode"] == 6
    said = "6 of 11 modes of the system: all that orders up to 12 can excite at 1500 rpm, and 6 at"
    assert slow.mode.attrs["comment"].startswith(said)
    assert said in text(sweeps.plan(posed(["natural_frequency"], stiff)))
    fast = run(["natural_frequency"], stiff, output={"highest_order": 30})
    assert fast.sizes["mode"] == 11
    three = run(["natural_frequency", "mode_shape"], stiff, output={"modes": 3})
    assert three.mode_shape.shape == (3, 12)
    assert three.mode.attrs["comment"] == "3 of 11 modes of the system: as asked for"
    endless = run(["natural_frequency"], stiff, output={"modes_below": 1e300})
    assert endless.sizes["mode"] == 11
    below = run(["natural_frequency"], stiff, output={"modes_below": 500})
    assert below.sizes["mode"] == int((fast.natural_frequency < 500.0).sum())


@pytest.mark.parametrize(
    ("output", "message"),
    [
        ({"modes": 12}, "modes = 12: the shaft has 11; must be at most as many"),
        ({"modes_below": 0.01}, "modes_below = 0.01: no mode is below it"),
        ({"modes": 2, "modes_below": 5}, "has both modes and modes_below; give one of them"),
        ({"modes": 0}, "modes = 0"),
    ],
)
def test_what_is_refused(output: dict[str, Any], message: str) -> None:
    with pytest.raises(sweeps.SceneError) as error:
        sweeps.plan(posed(["natural_frequency"], chain(12), output=output))
    assert message in str(error.value)


def test_a_mode_in_which_no_throw_moves_is_not_excited() -> None:
    """Of three equal branches behind the flywheel, two modes leave the rest at rest."""
    shaft: dict[str, Any] = {
        "reciprocating": "included", "flywheel": "flywheel", "load": "flywheel",
        "discs": [
            {"name": "throw", "throw": 1, "inertia": 0.05}, {"name": "flywheel", "inertia": 1.0},
            *({"name": f"branch {i}", "inertia": 0.02} for i in range(3)),
        ],
        "shafts": [
            {"stiffness": 1e5},
            *({"between": ["flywheel", f"branch {i}"], "stiffness": 3e3} for i in range(3)),
        ],
    }  # fmt: skip
    found = run(["mode_shape", "mode_vector_sum", "modal_inertia", "natural_frequency"], shaft)
    alone = np.isclose(found.natural_frequency, np.sqrt(3e3 / 0.02) / (2.0 * np.pi), rtol=1e-9)
    assert alone.sum() == 2
    assert (found.mode_vector_sum[alone] == 0.0).all()
    assert (found.mode_vector_sum[~alone] > 1e-3).all()
    assert np.isfinite(found.modal_inertia).all()
    assert_allclose(np.abs(found.mode_shape).max("disc"), 1.0, rtol=1e-9)
