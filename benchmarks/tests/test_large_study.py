"""The study of the V6 at a small size: all it prints is of the archive that it writes."""

from pathlib import Path

import pytest

import sweeps
from benchmarks.large_study import RANGES, SPEEDS, main

pytestmark = pytest.mark.compiled


def test_the_study_prints_what_it_found(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "study.nc"
    main(["--points", "64", "-o", str(path)])
    printed = capfd.readouterr().out
    with sweeps.open(path) as found:
        designs = 64 * (len(RANGES) + 2)
        assert f"{designs} designs at {designs * len(SPEEDS):,} points reduced" in printed
        ranks = found["rank"].values
        best, least = (found.isel(design=(ranks[search] == 1).argmax()) for search in (0, 1))
        assert (best.delta.values <= 1 / 9).all() and (best.torque_mean.values >= 282).all()
        # The first design of each search heads a table of its own.
        rows = [line.split() for line in printed.splitlines()]
        heads = [
            line[1] for line, before in zip(rows[1:], rows, strict=False) if "──" in str(before)
        ]
        assert {str(int(best.design)), str(int(least.design))} <= set(heads)
        total = float(found.delta_total.sel(parameter="inertia", speed=SPEEDS[0]))
        assert f"{total:.3f} +- " in printed
        fronts = int((ranks[1] > 0).sum())
    assert f"{fronts} kept" in printed
