"""Sobol' indices against SALib's test functions and against closed forms."""

import json
from typing import Any

import numpy as np
import pytest
import xarray as xr
from SALib.test_functions import Ishigami, Sobol_G

import sweeps
from engine_dyn.types import Floats
from tests.support.scenes import computed

KEYS = ("inertia", "rod_length", "bore", "stroke", "speed", "load", "piston_mass", "rod_mass")


def archive_of(function: Any, low: float, high: float, many: int, number: int, method: str) -> Any:
    """An archive as `run` would write it, whose result is a function of its parameters."""
    keys = KEYS[:many]
    table: dict[str, Any] = {key: {"low": 0.0, "high": 1.0} for key in keys}
    scene = {"sample": {"method": method, "number": number, **table}}
    from sweeps.scene.distributions import Uniform
    from sweeps.scene.sample import Sample, drawn

    law = Uniform(0.0, 1.0)
    columns = drawn(Sample(method, number, 3, dict.fromkeys(keys, law)))
    points = low + (high - low) * np.column_stack([columns[key] for key in keys])
    values = function(points)
    return xr.Dataset(
        {"delta": ("design", values), "status": ("design", np.zeros(len(values), np.int8))},
        coords={
            "design": np.arange(len(values)),
            **{key: ("design", points[:, i]) for i, key in enumerate(keys)},
        },
        attrs={"scene": json.dumps(scene)},
    )


def ishigami_exact() -> tuple[Floats, Floats]:
    """First and total indices (Saltelli et al. 2000, with a = 7, b = 0.1)."""
    a, b, pi = 7.0, 0.1, np.pi
    whole = a**2 / 8 + b * pi**4 / 5 + b**2 * pi**8 / 18 + 0.5
    one = 0.5 * (1 + b * pi**4 / 5) ** 2
    two = a**2 / 8
    both = b**2 * pi**8 * (1 / 18 - 1 / 50)
    return np.array([one, two, 0.0]) / whole, np.array([one + both, two, both]) / whole


def test_indices_of_known_functions() -> None:
    archive = archive_of(Ishigami.evaluate, -np.pi, np.pi, 3, 4096, "saltelli")
    found = sweeps.sensitivities(archive, "delta")
    assert [str(p) for p in found.parameter.values] == list(KEYS[:3])
    for name, exact in zip(("first", "total"), ishigami_exact(), strict=True):
        error = np.abs(found[f"delta_{name}"].values - exact)
        # 95 % intervals: 2 of 6 outside would be one case in 30.
        assert (error < 1.5 * found[f"delta_{name}_confidence"].values + 1e-3).all()
        assert (error < 0.02).all()
    assert found.delta_left_out == 0
    # Sobol g.
    a = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0])
    archive = archive_of(lambda x: Sobol_G.evaluate(x, a=a), 0.0, 1.0, 8, 4096, "saltelli")
    found = sweeps.sensitivities(archive, "delta")
    parts = 1.0 / (3.0 * (1.0 + a) ** 2)
    whole = np.prod(1.0 + parts) - 1.0
    total = parts * np.prod(1.0 + parts) / (1.0 + parts) / whole
    assert np.abs(found.delta_first.values - parts / whole).max() < 0.02
    assert np.abs(found.delta_total.values - total).max() < 0.02


def test_failed_designs_drop_their_groups_and_many_are_named() -> None:
    archive = archive_of(Ishigami.evaluate, -np.pi, np.pi, 3, 1024, "saltelli")
    few = archive.copy(deep=True)
    few["status"][17] = 1
    few["delta"][4321] = np.nan
    found = sweeps.sensitivities(few, "delta")
    assert found.delta_left_out == 2
    assert np.abs(found.delta_total.values - ishigami_exact()[1]).max() < 0.05
    whole = archive.delta.values.reshape(-1, 5)
    kept = np.delete(whole, [17 // 5, 4321 // 5], axis=0).reshape(-1)
    from SALib.analyze import sobol

    problem = {"num_vars": 3, "names": list(KEYS[:3]), "bounds": [[0, 1]] * 3}
    expected = sobol.analyze(problem, kept, calc_second_order=False, seed=1)
    assert np.array_equal(found.delta_total.values, expected["ST"])
    archive = archive_of(Ishigami.evaluate, -np.pi, np.pi, 3, 4096, "saltelli")
    bad = archive.inertia.values > 2.9
    assert 0.01 < bad.mean() < 0.1
    archive["status"][bad] = 1
    found = sweeps.sensitivities(archive, "delta")
    assert "delta_first" not in found and "delta_total_conditional" not in found
    assert "only designs with results" in found.delta_first_conditional.attrs["long_name"]
    assert found.delta_left_out == bad.sum()
    assert np.isfinite(found.delta_first_conditional).all()


def product_exact(one: tuple[float, float], two: tuple[float, float]) -> tuple[Floats, Floats]:
    """Indices of f g, of which mean and variance are given, f and g independent."""
    (mean_f, var_f), (mean_g, var_g) = one, two
    whole = (var_f + mean_f**2) * (var_g + mean_g**2) - (mean_f * mean_g) ** 2
    first = np.array([var_f * mean_g**2, var_g * mean_f**2]) / whole
    total = np.array([var_f * (var_g + mean_g**2), var_g * (var_f + mean_f**2)]) / whole
    return first, total


def powers(low: float, high: float, power: float) -> tuple[float, float]:
    """Mean and variance of a power of a number that is uniform between two values."""

    def moment(p: float) -> float:
        if p == -1.0:
            return float(np.log(high / low) / (high - low))
        return float((high ** (p + 1) - low ** (p + 1)) / ((p + 1) * (high - low)))

    mean = moment(power)
    return mean, moment(2.0 * power) - mean**2


@pytest.mark.compiled
def test_delta_of_two_parameters_in_closed_form() -> None:
    """delta = dW / (Theta omega^2) where the wheel is heavy and the masses are light.

    The swing dW of the energy is then that of the gas alone, and neither depends on the other.
    """
    archive = computed(
        ["delta"],
        set={"load": 50.0, "reciprocating_mass": 1e-3, "load_exponent": 0.0},
        sample={
            "method": "saltelli",
            "number": 4096,
            "inertia": {"low": 200.0, "high": 800.0},
            "speed": {"low": 1000.0, "high": 2500.0},
        },
        silenced_warnings=["reciprocating_mass", "inertia"],
    )
    one = archive.delta * archive.inertia * archive.speed**2
    assert float(one.std() / one.mean()) < 1e-3
    found = sweeps.sensitivities(archive, "delta")
    first, total = product_exact(powers(200.0, 800.0, -1.0), powers(1000.0, 2500.0, -2.0))
    assert np.abs(found.delta_first.values - first).max() < 0.02
    assert np.abs(found.delta_total.values - total).max() < 0.02
    assert (np.abs(found.delta_first - first) < 2.0 * found.delta_first_confidence).all()


@pytest.mark.compiled
def test_a_grid_is_exact() -> None:
    archive = computed(
        ["delta", "mean_piston_speed"],
        axes={"inertia": [1.0, 2.0, 4.0], "speed": [1000.0, 1300.0, 1600.0, 2000.0]},
    )
    found = sweeps.sensitivities(archive)
    logs = np.log(archive.delta.values)
    additive = sweeps.sensitivities(archive.assign(delta=(("inertia", "speed"), logs)), "delta")
    # ln delta is nearly a sum of both: then first and total indices are the same, with sum 1.
    assert float(additive.delta_first.sum()) == pytest.approx(1.0, abs=1e-3)
    assert additive.delta_total.values == pytest.approx(additive.delta_first.values, abs=1e-3)
    assert found.delta_total.values.sum() > found.delta_first.values.sum()
    assert found.mean_piston_speed_first.values.tolist() == [0.0, 1.0]
