"""A small part of the sampled studies of `make stress`, and that its checks can fail."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.stress import absurd, sampled
from benchmarks.stress.findings import Findings
from benchmarks.stress.sampled import KINDS, Kind
from engine_dyn.status import CONVERGED, STALLED, TOLERANCE_NOT_MET

SEED = 7


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Less than the command's least numbers of designs."""
    monkeypatch.setattr(sampled, "FEWEST", 120)
    monkeypatch.setattr(sampled, "AGAIN", 60)


by_kind = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)


@pytest.mark.compiled
@by_kind
def test_sampled_designs_have_no_defect(kind: Kind) -> None:
    found = sampled.run(SEED, sampled.FEWEST, 0, 2, print, (kind,))
    assert found.defects == 0, found.examples[:3]
    assert found.of("status") == sampled.FEWEST
    assert found.total(("agrees", "border", "gave up")) == sampled.FEWEST
    assert found.of("status", kind.name, CONVERGED) > 0.8 * sampled.FEWEST
    assert found.of("again") == sampled.AGAIN
    assert found.of("estimated") > 0.8 * sampled.AGAIN
    # Another solver has solved them: not a bit would differ otherwise.
    assert 0.0 < found.worst[kind.name, "delta"] <= 1e-6


@pytest.mark.compiled
def test_the_independent_solver_agrees_and_would_see_an_error() -> None:
    kind = KINDS[0]
    one = sampled.chunk(kind, SEED, 0, sampled.FEWEST)
    found = sampled.solved(one)
    result = Findings()
    sampled.compare(result, kind, one, found, 2)
    assert (result.of("independent"), result.defects) == (2, 0)
    found["omega_max"] = found["omega_max"] * (1.0 + 2e-6)
    sampled.compare(result, kind, one, found, 1)
    assert (result.of("independent"), result.of("off"), result.defects) == (3, 1, 1)


def speeds(low: float, high: float, mean: float) -> dict[str, Any]:
    """Results of one design."""
    values = {"omega_min": low, "omega_max": high, "omega_mean": mean, "delta": (high - low) / mean}
    return {name: np.array([value]) for name, value in values.items()}


def judged(status: int, delta: float, lowest: float, true: int, exact: float) -> str:
    """Verdict on a design with these answers of both solvers; NaN where there is no number."""
    one = speeds(lowest, lowest * (1.0 + delta), lowest) | {"delta": np.array([delta])}
    other = {name: values * exact for name, values in one.items()}
    if status == STALLED:
        one = {name: values * np.nan for name, values in one.items()}
    one["status"], other["status"] = np.array([status]), np.array([true])
    return str(sampled.judged(one, other, 1.0)[0][0])


def test_verdicts_tell_agreement_from_defects() -> None:
    nothing = float("nan")
    assert judged(CONVERGED, 0.01, 1.0, CONVERGED, 1.0 + 5e-7) == "agrees"
    assert judged(CONVERGED, 0.01, 1.0, CONVERGED, 1.0 + 2e-6) == "off"
    assert judged(TOLERANCE_NOT_MET, 0.01, 1.0, CONVERGED, 1.0 + 2e-6) == "agrees"
    assert judged(CONVERGED, 0.01, 1.0, STALLED, nothing) == "outcome"
    assert judged(CONVERGED, 0.01, 0.01, STALLED, nothing) == "border"
    assert judged(STALLED, 0.01, 1.0, CONVERGED, 1.0) == "outcome"
    assert judged(STALLED, 0.01, 1.0, STALLED, nothing) == "agrees"


@pytest.mark.compiled
def test_other_bits_and_a_small_estimate_are_defects() -> None:
    one = sampled.chunk(KINDS[0], SEED, 0, sampled.FEWEST)
    found = sampled.solved(one)
    chosen = np.arange(10)
    other = {name: values[chosen].copy() for name, values in found.items()}
    other["delta"][3] = np.nextafter(other["delta"][3], 1.0)
    masks = absurd.unlike_bits(other, {name: values[chosen] for name, values in found.items()})
    assert {name: np.flatnonzero(mask).tolist() for name, mask in masks.items() if mask.any()} == {
        "delta": [3]
    }
    result = Findings()
    result.counts["estimated", KINDS[0].name] = 1000
    for above, uncovered in ((1, 0), (2, 1)):
        result.counts["above", KINDS[0].name] = above
        assert sampled.uncovered(result, KINDS[0]) == uncovered
