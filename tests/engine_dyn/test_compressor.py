"""The modelled compressor: an independent integration, the ideal cycle, what is refused."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from engine_dyn import status
from engine_dyn.geometry.slider_crank import velocity
from engine_dyn.pressure.compressor import FILE_UNITS, CompressorCycle, tabulate
from tests.support.cycles import between_lines

DEGREE = np.pi / 180.0
BAR = 1e5

USUAL: dict[str, float] = {
    "clearance_ratio": 0.06, "crank_ratio": 0.2, "suction_pressure": 1.0,
    "delivery_pressure": 8.0, "suction_loss": 0.08, "delivery_loss": 0.5,
    "compression_exponent": 1.32, "expansion_exponent": 1.22, "valve_ramp": 14.0,
    "valve_lag": 3.0,
}  # fmt: skip


def cycle(**changes: float) -> CompressorCycle:
    """A compressor from values in file units."""
    values = {**USUAL, **changes}
    return CompressorCycle(**{name: value * FILE_UNITS[name][1] for name, value in values.items()})


def si(model: CompressorCycle) -> dict[str, Any]:
    return dataclasses.asdict(model)


@pytest.mark.parametrize(
    "changes",
    [{}, {"delivery_pressure": 3.0, "valve_ramp": 25.0}, {"suction_pressure": 8.0,
     "delivery_pressure": 30.0, "clearance_ratio": 0.15, "valve_lag": 1.0}],
)  # fmt: skip
def test_against_a_general_integrator(changes: dict[str, float]) -> None:
    model = cycle(**changes)
    angle, pressure = model.points(1.0)
    place = np.argmin(np.abs(angle))
    ratio = model.crank_ratio

    def swept(phi: float) -> tuple[Any, Any]:
        root = np.sqrt(1.0 - (ratio * np.sin(phi)) ** 2)
        travel = 1.0 - np.cos(phi) + (1.0 - root) / ratio
        return 0.5 * travel, 0.5 * np.sin(phi) * (1.0 + ratio * np.cos(phi) / root)

    start = float(pressure[place])
    expected, last = between_lines(
        model, model.clearance_ratio, swept, start, np.arange(360) * DEGREE
    )
    np.testing.assert_allclose(
        np.roll(pressure, -place), expected, rtol=0.0, atol=1e-9 * pressure.max()
    )
    assert last == pytest.approx(start, rel=1e-9)


def work(model: CompressorCycle) -> float:
    """Work of the gas over a cycle and the swept volume [Pa]."""
    angle, pressure = model.points(0.5)
    return float((pressure * 0.5 * velocity(angle, model.crank_ratio)).mean() * 2.0 * np.pi)


@pytest.mark.parametrize("ratio", [2.0, 5.0, 8.0])
def test_the_limit_is_the_ideal_cycle(ratio: float) -> None:
    """W = n/(n - 1) p_s V_in (r^((n-1)/n) - 1), V_in the volumetric efficiency times V_h."""
    n = 1.3
    model = cycle(
        delivery_pressure=ratio, suction_loss=0.0, delivery_loss=0.0, compression_exponent=n,
        expansion_exponent=n, valve_ramp=1.5, valve_lag=0.3,
    )  # fmt: skip
    volumetric_efficiency = 1.0 - 0.06 * (ratio ** (1.0 / n) - 1.0)
    ideal = n / (n - 1.0) * BAR * volumetric_efficiency * (ratio ** ((n - 1.0) / n) - 1.0)
    assert -work(model) == pytest.approx(ideal, rel=1e-2)


def test_a_batch_is_its_cycles_and_leaves_out_the_impossible() -> None:
    delivery = np.array([4.0, 8.0, 0.5, 60.0]) * BAR
    found = tabulate({**si(cycle()), "delivery_pressure": delivery}, 1.0)
    assert found.status.tolist() == [
        status.CONVERGED, status.CONVERGED, status.INVALID_INPUT, status.INVALID_INPUT
    ]  # fmt: skip
    for i in range(2):
        one = cycle(delivery_pressure=delivery[i] / BAR)
        np.testing.assert_array_equal(found.pressure[i], one.points(1.0)[1])
    assert np.isnan(found.pressure[2:]).all()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"clearance_ratio": 0.0}, "clearance_ratio = 0: must be between 0 and 0.5"),
        ({"delivery_pressure": 0.9}, "delivery_pressure = 0.9 bar: must be above suction_pressure"),
        ({"delivery_pressure": 60.0}, "delivery_pressure = 60 bar: must be lower: gas re-expand"),
        ({"delivery_pressure": 30.0, "clearance_ratio": 0.001, "compression_exponent": 1.0,
          "valve_ramp": 40.0}, "delivery_pressure = 30 bar: must be lower: it is reached too late"),
        ({"suction_loss": 0.8}, "suction_loss = 0.8 bar: must be at most half"),
        ({"valve_ramp": 0.0}, "valve_ramp = 0 degree: must be between 1 and 45 degree"),
        ({"valve_lag": float("nan")}, "valve_lag = nan: must be a finite number"),
    ],
)  # fmt: skip
def test_bad_parameters(changes: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError) as caught:
        cycle(**changes)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_a_batch_refuses() -> None:
    values = si(cycle())
    with pytest.raises(ValueError, match="heat: CompressorCycle has no such field"):
        tabulate({**values, "heat": 1.0})
    del values["valve_lag"]
    with pytest.raises(ValueError, match="valve_lag: missing"):
        tabulate(values)
    with pytest.raises(ValueError, match="360 must be a multiple"):
        cycle().points(0.7)
