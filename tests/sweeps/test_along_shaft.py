"""Numbers of the torque along the shaft and of all main journals, against their curves."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import sweeps

QUANTITIES = [
    "torque_after_throw", "torque_after_throw_range", "first_mode_torque_rms",
    "first_mode_torque_order", "first_mode_vector_sum", "throw_torque_order",
    "throw_torque_phase", "main_journal_load", "main_journal_load_max", "main_journal_load_rms",
    "any_main_journal_load_max", "all_main_journals_load_rms", "cylinder_torque_order",
]  # fmt: skip

SCENES = {
    "ntua": {"cylinders": 6},
    "v8_cross_plane_93x86": {},
    "v6_96x81": {"mass_factor": [1.0, 1.1, 0.9, 1.0, 1.05, 1.0]},
}


@pytest.fixture(scope="module", params=SCENES)
def found(request: pytest.FixtureRequest) -> xr.Dataset:
    speeds = [900.0, 2200.0]
    return sweeps.run(
        engine=request.param, set=SCENES[request.param], axes={"speed": speeds},
        output={"quantities": QUANTITIES, "angle_step": 0.5, "highest_order": 48},
    )  # fmt: skip


def test_range_and_journals_are_those_of_the_curves(found: xr.Dataset) -> None:
    curves = found["torque_after_throw"]
    ranges = curves.max("crank_angle") - curves.min("crank_angle")
    assert_allclose(found["torque_after_throw_range"], ranges.max("cylinder"), rtol=1e-12)
    # All journals are taken.
    curves = found["main_journal_load"]
    squares = (curves**2).mean("crank_angle")
    # The curves stand at the angles at which the kernel samples.
    assert_allclose(
        found["main_journal_load_rms"].transpose(*squares.dims), np.sqrt(squares), rtol=1e-12
    )
    assert_allclose(
        found["all_main_journals_load_rms"], np.sqrt(squares.mean("main_bearing")), rtol=1e-12
    )
    largest = found["main_journal_load_max"].max("main_bearing")
    assert_allclose(found["any_main_journal_load_max"], largest, rtol=0.0)


def test_first_mode_takes_up_each_throw_by_its_amplitude(found: xr.Dataset) -> None:
    each = found["throw_torque_order"] * np.exp(1j * np.radians(found["throw_torque_phase"]))
    each = each.dropna("cylinder", how="all")
    throws = each.sizes["cylinder"]
    stiffness = 2.0 * np.eye(throws) - np.eye(throws, k=1) - np.eye(throws, k=-1)
    stiffness[-1, -1] = 1.0
    mode = np.linalg.eigh(stiffness)[1][:, 0]
    weights = xr.DataArray(mode / mode[-1], dims="cylinder")
    expected = np.abs((each * weights).sum("cylinder"))
    limit = 1e-9 * float(expected.max())
    taken = found["first_mode_torque_order"].transpose(*expected.dims)
    assert_allclose(taken, expected, atol=limit)
    # Parseval: 48 orders hold all but a small rest of the torque; friction is constant.
    rms = np.sqrt(0.5 * (expected**2).sum("order"))
    assert_allclose(found["first_mode_torque_rms"], rms, rtol=2e-3)


def test_equal_cylinders_have_the_vector_sum_as_factor(found: xr.Dataset) -> None:
    if found.attrs["engine"] == "v6_96x81":
        pytest.skip("its masses differ")
    product = found["cylinder_torque_order"] * found["first_mode_vector_sum"]
    assert_allclose(
        found["first_mode_torque_order"].transpose(*product.dims), product,
        atol=1e-9 * float(product.max()),
    )  # fmt: skip
