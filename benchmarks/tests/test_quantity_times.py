"""Rates of single quantities: their scenes run, and the table says what was measured."""

from __future__ import annotations

import pytest

from benchmarks import quantity_times
from benchmarks.quantity_times import CHOSEN, KINDS
from engine_dyn.quantities.graph import QUANTITIES


def test_names_exist() -> None:
    assert set(CHOSEN) <= set(QUANTITIES)


def test_what_is_not_known_or_equal_for_all_is_left_out() -> None:
    sampled = next(kind for kind in KINDS if kind.name == "sampled")
    modelled = next(kind for kind in KINDS if kind.name == "modelled")
    assert quantity_times.depends(sampled, "shaking_force_max")
    assert not quantity_times.depends(modelled, "shaking_force_max")
    assert not quantity_times.depends(sampled, "characteristic_torque")


@pytest.mark.compiled
@pytest.mark.slow
def test_rates_are_measured() -> None:
    found = quantity_times.measured(
        [KINDS[0], KINDS[4]], ["crank_pin_load_max", "shaking_force_max"], 1, 0.01, 1
    )
    assert [(row.kind.name, row.quantity) for row in found.rows] == [
        ("sampled", "crank_pin_load_max"), ("sampled", "shaking_force_max"),
        ("modelled", "crank_pin_load_max"),
    ]  # fmt: skip
    lines = quantity_times.body(found)
    assert lines[-1][0] == "`si_four_87x101`, modelled cycles: `crank_pin_load_max`"
    assert "nan" not in str(lines)
