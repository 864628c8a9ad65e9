"""What solves designs is counted, and does not change their numbers."""

from typing import Any

import numpy as np
import pytest

import sweeps
from engine_dyn.speed.mechanisms import BATCH, GENERAL, Tally, counted, tally_in_use

INERTIA = np.linspace(1.0, 3.0, 200)


def solved(**tables: Any) -> tuple[Tally, Any]:
    with counted() as tally:
        found = sweeps.run({"engine": "ntua", "output": {"quantities": ["delta"]}, **tables})
    return tally, found["delta"].values


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("tables", "mechanism"),
    [
        ({"axes": {"inertia": INERTIA.tolist()}}, BATCH),
        ({"designs": {"inertia": INERTIA, "crank_ratio": np.linspace(0.2, 0.3, 200)}}, BATCH),
        ({"axes": {"inertia": INERTIA.tolist()}, "solver": {"method": "newton"}}, GENERAL),
    ],
    ids=["shared", "interpolated", "general"],
)  # fmt: skip
def test_designs_are_counted(tables: dict[str, Any], mechanism: str) -> None:
    tally, delta = solved(**tables)
    assert dict(tally.designs) == {mechanism: 200}
    assert tally.general_share == (1.0 if mechanism == GENERAL else tally.deferred / 200)
    assert tally_in_use() is None
    again = sweeps.run({"engine": "ntua", "output": {"quantities": ["delta"]}, **tables})
    np.testing.assert_array_equal(delta, again["delta"])


@pytest.mark.compiled
def test_deferred_designs_are_counted() -> None:
    """Engines that nearly stop within the cycle, or do, are none for the batch solver."""
    tally, delta = solved(axes={"inertia": np.geomspace(0.02, 2.0, 200).tolist()})
    assert 0 < tally.deferred < 200
    again = tally.designs[GENERAL]  # stalls that more nodes might disprove
    assert 0 < again < 10 and tally.designs[BATCH] == 200
    assert tally.general_share == (tally.deferred + again) / (200 + again)
    assert np.isnan(delta).any()


def test_a_tally_without_designs_has_no_share() -> None:
    with counted() as outer, counted() as inner:
        assert tally_in_use() is inner
    assert np.isnan(outer.general_share)
