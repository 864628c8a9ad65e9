"""What `import` takes from an engine: measures and firing angles, without any diagram."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweeps
from sweeps.reading.engine_files import load_engine
from sweeps.reading.pressure_recordings import read_pressure
from tests.support import recorded_engine as engine
from tests.support.laboratory import avl, four_cylinders, imep, own, rows, samples

OWN = """\
title = "An engine that is yet to be measured"
cycle = "four-stroke"
firing_order = [1, 3, 4, 2]

[values]
bore = 0.1
stroke = 0.12
rod_length = 0.21
cylinders = 4
"""

DIAGRAM = """
[[diagram]]
load = {}
kind = "first_law"
compression_ratio = {}
"""


def written(folder: Path, more: str = "") -> str:
    (folder / "mine.toml").write_text(OWN + more)
    return str(folder / "mine.toml")


def test_engines_need_no_diagrams_and_give_measures_and_firing_angles(tmp_path: Path) -> None:
    own(tmp_path / "raw.csv")
    found = read_pressure(tmp_path / "raw.csv", engine=written(tmp_path))
    assert found.geometry.crank_ratio == pytest.approx(engine.GEOMETRY.crank_ratio)
    assert (found.geometry.bore, found.geometry.stroke) == (0.1, 0.12)
    assert found.geometry.compression_ratio is None
    assert not any("assumed" in line for line in found.warnings)
    # Firing angles come from the file.
    four_cylinders(tmp_path / "four.csv")
    told = read_pressure(tmp_path / "four.csv", engine=written(tmp_path)).steps
    assert "cylinders fire at 0, 540, 180, 360 degree, from the engine file" in told
    # An engine of the catalogue has the same measures either way.
    own(tmp_path / "raw.csv")
    by_name = read_pressure(tmp_path / "raw.csv", engine="boxer_twin_101x70").geometry
    loaded = read_pressure(tmp_path / "raw.csv", engine=load_engine("boxer_twin_101x70")).geometry
    assert by_name == loaded
    assert by_name.compression_ratio == 10.3


def test_less_torque_than_at_the_shaft_is_warned_of(tmp_path: Path) -> None:
    """A pressure two degrees early does that, and nothing else told of it."""
    own(tmp_path / "raw.csv")
    keys = {"engine": written(tmp_path)}
    angle, pressure = samples(-360.0)
    works = {}
    for shift in (0.0, -2.0):
        moved = np.interp(angle - shift, angle, pressure, period=720.0)
        mean_pressure = imep(angle * engine.DEGREE, moved * 1e5) * 1e5
        works[shift] = mean_pressure * engine.SWEPT * 4.0 / (4.0 * np.pi)
    brake = 0.95 * works[0.0]
    assert works[-2.0] < brake
    for shift, count in ((0.0, 0), (-2.0, 1)):
        found = read_pressure(tmp_path / "raw.csv", shift=shift, brake_torque=brake, **keys)
        told = [line for line in found.warnings if line.startswith("brake_torque: ")]
        assert len(told) == count
    indicated = float(told[0].split("indicated torque is ")[1].split(" N m")[0])
    assert indicated == pytest.approx(works[-2.0], rel=3e-3)
    assert f"less than the {brake:.4g} N m at the shaft" in told[0]
    with pytest.raises(sweeps.SceneError, match="needs an engine with bore, stroke and cylinders"):
        read_pressure(tmp_path / "raw.csv", brake_torque=brake)


POINTS = '\n[[diagram]]\nload = 100\nkind = "points"\nfile = "yet to be written.csv"\n'
DATA_SHEET = "\n[data_sheet.cycle]\ncompression_ratio = {}\n"


@pytest.mark.parametrize(
    ("more", "given", "ratio"),
    [
        (DIAGRAM.format(50, 16.0) + DIAGRAM.format(100, 16.0), {}, 16.0),
        (DIAGRAM.format(50, 16.0) + DIAGRAM.format(100, 16.0), {"compression_ratio": 17.0}, 17.0),
        (DIAGRAM.format(50, 16.0) + DIAGRAM.format(100, 17.0), {}, "compression_ratio"),
        (DATA_SHEET.format(16.5), {}, 16.5),
        (DATA_SHEET.format(900), {}, r"\[data_sheet.cycle\] compression_ratio = 900"),
        (DATA_SHEET.format(16.5) + POINTS, {}, 16.5),
        (POINTS, {}, r"or geometric_compression_ratio in \[values\]"),
    ],
    ids=["all diagrams", "given", "others", "data sheet", "absurd", "sheet and points", "points"],
)
def test_where_the_compression_ratio_comes_from(
    more: str, given: dict[str, float], ratio: Any, tmp_path: Path
) -> None:
    avl(tmp_path / "raw.csv")
    path = written(tmp_path, more)
    if isinstance(ratio, str):
        with pytest.raises(sweeps.SceneError, match=ratio):
            read_pressure(tmp_path / "raw.csv", engine=path, pegging="compression", **given)
    else:
        found = read_pressure(tmp_path / "raw.csv", engine=path, pegging="compression", **given)
        assert found.geometry.compression_ratio == ratio
        assert f"compression ratio {ratio:g} of the engine" in found.steps or given
    if more == POINTS:
        steps = read_pressure(tmp_path / "raw.csv", engine=path).steps
        assert any(step.startswith("compression ratio unknown") for step in steps)


def test_what_is_no_engine_is_refused(tmp_path: Path) -> None:
    own(tmp_path / "raw.csv")
    for name, said in (("ntuaa", "unknown engine"), (str(tmp_path / "no.toml"), "no such file")):
        with pytest.raises(sweeps.SceneError, match=said):
            read_pressure(tmp_path / "raw.csv", engine=name)
    path = written(tmp_path)
    (tmp_path / "mine.toml").write_text(OWN.replace("bore = 0.1", "bore = -1"))
    with pytest.raises(sweeps.SceneError, match="bore = -1"):
        read_pressure(tmp_path / "raw.csv", engine=path)


def test_the_crank_ratio_may_be_given(tmp_path: Path) -> None:
    own(tmp_path / "raw.csv")
    found = read_pressure(tmp_path / "raw.csv", crank_ratio=0.3, engine="ntua")
    assert found.geometry.crank_ratio == 0.3
    assert not any("assumed" in line for line in found.warnings)
    with pytest.raises(sweeps.SceneError, match=r"above 0 and up to 0\.5"):
        read_pressure(tmp_path / "raw.csv", crank_ratio=0.6)


def test_heads_with_quantity_over_unit(tmp_path: Path) -> None:
    angle = np.arange(-360.0, 360.0)
    pressure = engine.pressure(angle * engine.DEGREE) / 1e5
    text = "Phi/°KW;Druck/bar;n/1/min\n" + rows(angle, pressure, 0 * angle + 1500, separator=";")
    (tmp_path / "din.csv").write_bytes(text.encode("cp1252"))
    found = read_pressure(tmp_path / "din.csv")
    assert "column 'Phi' taken as the crank angle" in found.steps
    assert "column 'Druck' taken as the cylinder pressure" in found.steps
    assert np.allclose(found.mean.pressure[0] / 1e5, pressure, atol=1e-4)
