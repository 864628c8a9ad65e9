"""Values that publications print, of closed forms and of an independent program.

The systems stand in tests/reference/torsional_systems.toml, and tools/published_shafts.py computes
ours, for the page as well. A value is met within half a unit of its last digit, but for those that
the source itself has rounded on its way.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import pytest

# Scripts import each other by their bare names, as when they are run.
sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))
published: Any = importlib.import_module("published_shafts")

SEARCHED = {"peak", "viscous damper", "tuned damper"}
"""Kinds that are searched for over 20001 frequencies."""

CASES = [
    pytest.param(name, number, marks=[pytest.mark.compiled] if given["kind"] in SEARCHED else [])
    for name, system in published.SYSTEMS.items()
    for number, given in enumerate(system["compare"])
    if given["kind"] != "not computed"
]


@pytest.mark.parametrize(("name", "number"), CASES)
def test_ours_is_the_value_of_the_source(name: str, number: int) -> None:
    system = published.SYSTEMS[name]
    given = system["compare"][number]
    for one in published.compared(system, given):
        assert one.agrees != given.get("erratum", False), (one.value, one.ours)
