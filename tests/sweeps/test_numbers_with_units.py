"""Numbers with units, as people write them."""

import math
from typing import Any

import pytest

from sweeps.errors import SceneError
from sweeps.reading.numbers_with_units import number_with_unit


@pytest.mark.parametrize(
    ("raw", "unit", "value"),
    [
        (36.4, "kW", 36.4), ("36.4", "kW", 36.4), (" 36.4kW ", "kW", 36.4),
        ("3.64e4 W", "kW", 36.4), ("50 hp", "kW", 50 * 0.745699872),
        ("50 PS", "kW", 50 * 0.73549875), ("2700rpm", "rpm", 2700.0), ("2700/min", "rpm", 2700.0),
        ("2700 1/min", "rpm", 2700.0), ("2700 min-1", "rpm", 2700.0), ("45 Hz", "rpm", 2700.0),
        ("45/s", "rpm", 2700.0), ("45 rev/s", "rpm", 2700.0), ("282.7433388 rad/s", "rpm", 2700.0),
        ("7.5 MPa", "bar", 75.0), ("1087.78 psi", "bar", 75.0), ("76.48 kgf/cm2", "bar", 75.0),
        ("245 g/kWh", "g/kWh", 245.0), ("245 g/kW/h", "g/kWh", 245.0),
        ("0.403 lb/hp/h", "g/kWh", 245.0),
    ],
)  # fmt: skip
def test_is_understood(raw: Any, unit: str, value: float) -> None:
    assert number_with_unit(raw, "--x", unit) == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize("raw", ["40 kVA", "40kva", "40000 VA", "40 kV*A", "0.04 MVA", "40 KVA"])
def test_apparent_power_is_no_power(raw: str) -> None:
    with pytest.raises(SceneError, match=r"--power = .*: is apparent power; must be a power in W"):
        number_with_unit(raw, "--power", "kW")


@pytest.mark.parametrize(
    "raw",
    [
        "", "kW", "36,4 kW", "36.4 kg", "nan", "inf kW", "1e999 kW", math.nan, math.inf, True, None,
        [36.4], "9**9**9 W", "36.4 kW; import os", "36.4 __import__('os')", "٣٦ kW", "36.4 kW" * 99,
        "36.4 " + "k" * 10**6, "1" * 10**6, "36.4 W**9**9", "20 degC",
    ],
)  # fmt: skip
def test_is_refused_in_one_line(raw: Any) -> None:
    with pytest.raises(SceneError, match=r"--x = .*: must be a number in kW") as error:
        number_with_unit(raw, "--x", "kW")
    assert len(str(error.value)) < 300
