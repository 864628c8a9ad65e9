"""The study of the V6 at a small size: all it prints is of the archive that it writes."""

from pathlib import Path

import numpy as np
import pytest

import sweeps
from benchmarks.large_study import RANGES, SHOWN, SPEEDS, main

pytestmark = pytest.mark.compiled


def test_the_study_prints_what_it_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "study.nc"
    main(["--points", "64", "-o", str(path)])
    lines = capsys.readouterr().out.splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    with sweeps.open(path) as found:
        designs = 64 * (len(RANGES) + 2) * len(SPEEDS)
        assert ["designs, of both speeds", f"{designs:,}"] in cells
        first = found.isel(design=int(np.argmax(found["rank"].values[0] == 1)))
        tabled = next(one for one in cells if one[0] == str(int(first.design)))
        assert tabled[1] == f"{float(first.inertia):.4g}"
        assert (first.delta.values <= 1 / 9).all() and (first.torque_mean.values >= 282).all()
        total = found.delta_total.sel(parameter="inertia").values
        shown = [one for one in cells if one[0] == "inertia" and len(one) == 3]
        assert [float(one[2].split()[0]) for one in shown] == [round(v, 5) for v in total]
        fronts = int(np.count_nonzero(found["rank"].values[1]))
    where = next(i for i, line in enumerate(lines) if line.startswith("the front"))
    rows = [one for one in cells[where + 4 : where + 4 + SHOWN] if one[0].isdigit()]
    assert len(rows) == min(fronts, SHOWN)
    assert np.all(np.diff([float(one[1]) for one in rows]) > 0)
