"""Drafts of catalogue engines: what can be checked before the reader knows their keys."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import pytest

from engine_dyn.layouts import arrangement_from_text
from engine_dyn.quantities import PARAMETERS
from sweeps.checks import check_range, number

FOLDER = Path(__file__).parents[1] / "tools" / "engine_drafts"
DRAFTS = sorted(FOLDER.glob("*.toml"))
PERIODS = {"four-stroke": 4.0 * math.pi, "two-stroke": 2.0 * math.pi}


def read(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))


def test_the_drafts_are_there() -> None:
    assert len(DRAFTS) == 10


@pytest.mark.parametrize("path", DRAFTS, ids=lambda path: path.stem)
def test_values_are_parameters_within_their_range(path: Path) -> None:
    draft = read(path)
    assert draft["name"] == path.stem
    assert draft["source"]
    for key, value in draft["values"].items():
        node = PARAMETERS[key]
        check_range(number(value, key, node), key, node)
    values = draft["values"]
    ratio = 0.5 * values["stroke"] / values["rod_length"]
    assert 0.25 <= ratio <= 0.5
    assert values["rod_centre_of_gravity"] < values["rod_length"]


@pytest.mark.parametrize("path", DRAFTS, ids=lambda path: path.stem)
def test_arrangements(path: Path) -> None:
    draft = read(path)
    engine = arrangement_from_text(draft["arrangement"], PERIODS[draft["cycle"]])
    assert len(engine.cylinders) == draft["values"]["cylinders"]
    uneven = {"parallel_twin_180", "parallel_twin_270"}
    assert engine.is_even == (path.stem not in uneven)


@pytest.mark.parametrize("path", DRAFTS, ids=lambda path: path.stem)
def test_reasons_belong_to_something(path: Path) -> None:
    draft = read(path)
    known = {*draft["values"], *draft["cycle_data"], *draft["rated"], "arrangement"}
    for key, reason in draft["assumed"].items():
        assert key in known
        assert len(reason) > 10


@pytest.mark.parametrize("path", DRAFTS, ids=lambda path: path.stem)
def test_rated_power_is_that_of_an_engine_of_this_size(path: Path) -> None:
    """Mean effective pressure: P Phi/(V omega); 8 to 13 bar without a charger."""
    draft = read(path)
    values, rated = draft["values"], draft["rated"]
    if "power" not in rated:
        return  # the compressor
    volume = values["cylinders"] * 0.25 * math.pi * values["bore"] ** 2 * values["stroke"]
    omega = values["speed"] * math.pi / 30.0
    bmep = 1e3 * rated["power"] * PERIODS[draft["cycle"]] / (volume * omega) / 1e5
    if "bmep" in rated:
        assert bmep == pytest.approx(rated["bmep"], rel=5e-3)
    else:
        assert 8.0 < bmep < 13.0
        torque = rated.get("torque_maximum", math.inf)
        assert torque > 1e3 * rated["power"] / omega
