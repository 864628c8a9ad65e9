"""Coverage of fitted intervals with a real engine; 400 cases of each kind are the command's."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks import identification
from benchmarks.identification import KINDS, WHEEL, Counted, count, simulated, told


def test_a_simulated_case() -> None:
    case = simulated(KINDS[1], np.random.default_rng(4))
    assert abs(case.errors @ WHEEL.width) < 1e-12
    for times in case.times:
        assert (np.diff(times) > 0.0).all()
        assert times[-1] == pytest.approx(12 * 0.08, rel=2e-3)  # 12 cycles at 1500 rpm


@pytest.mark.compiled
def test_intervals_cover_the_truth() -> None:
    """Three sigma of 16 cases."""
    found = count(KINDS[0], 16)
    assert found.refused == []
    least = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / 16)
    assert set(found.covered) == set(KINDS[0].vary)
    assert all(number / 16 >= least for number in found.covered.values()), found
    # Errors are as large as the standard deviations say, not far smaller.
    assert all(0.4 < (off / 16) ** 0.5 < 1.6 for off in found.off.values()), found


@pytest.mark.compiled
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS[1:], ids=lambda kind: kind.name)
def test_every_kind_is_fitted(kind: identification.Kind) -> None:
    found = count(kind, 2)
    assert found.cases == 2 and found.refused == []
    wanted = 6 if kind.name == "own" else 4
    assert len(found.covered) == wanted


def test_the_table_and_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = Counted(20, {"inertia": 19}, {"inertia": 20.0}, ["refused"], 1)
    monkeypatch.setattr(identification, "count", lambda kind, cases: made)
    identification.main(["--only", "white", "--cases", "20", "--part", str(tmp_path / "x.json")])
    written = json.loads((tmp_path / "x.json").read_text())
    assert written["coverage"]["white"]["covered"] == {"inertia": 19}
    assert told({"white": made}).splitlines()[-1] == "| white noise | 20 | 95.0 % |"
