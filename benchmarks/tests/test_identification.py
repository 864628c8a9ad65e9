"""Simulated recordings of an engine, and that fits to them cover the truth."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.identification import KINDS, WHEEL, Kind, covered, simulated


def test_a_simulated_case() -> None:
    case = simulated(KINDS[1], np.random.default_rng(4))
    assert abs(case.errors @ WHEEL.width) < 1e-12
    for times in case.times:
        assert (np.diff(times) > 0.0).all()
        assert times[-1] == pytest.approx(12 * 0.08, rel=2e-3)  # 12 cycles at 1500 rpm


@pytest.mark.compiled
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS[1:], ids=lambda kind: kind.name)
def test_every_kind_is_fitted(kind: Kind) -> None:
    assert len(covered(kind, 1)) == (6 if kind.name == "own" else 4)
