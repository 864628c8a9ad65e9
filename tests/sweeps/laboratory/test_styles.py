"""Files of one synthetic engine in the styles of laboratories: all give the same imep."""

from pathlib import Path

import numpy as np
import pytest

import sweeps
from sweeps.base.columns import text_tables
from sweeps.base.columns.options import ReadingChoices
from sweeps.lab.pressure.evaluation import evaluated
from sweeps.lab.pressure.reading import read_pressure
from tests.support import recorded_engine
from tests.support.laboratory import DEGREE, STYLES, four_cylinders, imep, rows, samples
from tests.support.tiers import every


def true_imep() -> float:
    angle = np.arange(-360.0, 360.0, 0.05) * DEGREE
    return imep(angle, recorded_engine.pressure(angle))


TRUE = true_imep()


@pytest.mark.parametrize("style", every(2, STYLES))
def test_every_style_has_the_same_imep(style: str, tmp_path: Path) -> None:
    write, name, options = STYLES[style]
    write(tmp_path / name)
    found = read_pressure(tmp_path / name, **options)
    mean = found.mean
    assert imep(mean.angle, mean.pressure[0]) == pytest.approx(TRUE, rel=2e-3)
    (tmp_path / "pressure.csv").write_text(found.text())
    written = read_pressure(tmp_path / "pressure.csv").mean
    assert imep(written.angle, written.pressure[0]) == pytest.approx(TRUE, rel=2e-3)


@pytest.mark.parametrize("above", ["", "MEASURED\n", "1440\n", "2\n", "\nMEASURED\n\n"])
def test_a_word_between_names_and_numbers_hides_no_names(above: str, tmp_path: Path) -> None:
    angle, pressure = samples(-360.0)
    text = f"1440\nangle_deg;p_cyl_bar\n{above}" + rows(angle, pressure, separator=";")
    (tmp_path / "run.ind").write_text(text)
    found = read_pressure(tmp_path / "run.ind")
    assert list(found.recorded) == ["p_cyl_bar"]
    assert imep(found.mean.angle, found.mean.pressure[0]) == pytest.approx(TRUE, rel=2e-3)


@pytest.mark.parametrize("count", [1, 12, 70])
@pytest.mark.parametrize("head", ["", "71\n"])
def test_cycles_in_columns_need_no_names(head: str, count: int, tmp_path: Path) -> None:
    angle, _ = samples(-360.0)
    cycles = [samples(-360.0, seed=seed)[1] for seed in range(count)]
    (tmp_path / "run.txt").write_text(head + rows(angle, *cycles, separator="\t"))
    found = read_pressure(tmp_path / "run.txt", columns_are="cycles", average=True, unit="bar")
    (recorded,) = found.recorded.values()
    assert recorded.cycles == count
    assert imep(found.mean.angle, found.mean.pressure[0]) == pytest.approx(TRUE, rel=2e-3)


def test_cylinders_of_one_file_are_told_apart(tmp_path: Path) -> None:
    four_cylinders(tmp_path / "four.csv")
    found = read_pressure(tmp_path / "four.csv")
    assert "0, 540, 180, 360" in " ".join(found.steps)
    for name, cycles in found.cylinders.items():
        factor = 1.05 if name == "PCYL2" else 1.0
        assert imep(cycles.angle, cycles.pressure[0]) == pytest.approx(factor * TRUE, rel=2e-3)
    assert any("'PCYL2' differs" in s and "imep +3.7" in s for s in found.steps)
    assert found.text().count("pressure_2_bar") == 1
    four_cylinders(tmp_path / "four.csv")
    found = read_pressure(tmp_path / "four.csv", firing_angles=[0.0, 540.0, 180.0, 360.0])
    works = [imep(c.angle, c.pressure[0]) for c in found.cylinders.values()]
    assert works[2] == pytest.approx(TRUE, rel=2e-3)
    with pytest.raises(sweeps.SceneError, match="3 values for 4 columns"):
        read_pressure(tmp_path / "four.csv", firing_angles=[0.0, 540.0, 180.0])


def test_angles_from_a_toothed_wheel(tmp_path: Path) -> None:
    """Samples over time at a speed that swings; the gap's first tooth passes 100 degrees late."""
    times = 1e-5 * np.arange(60_000)  # 0.6 s at 1500 rpm: 7.5 cycles
    rate = 9000.0
    angle = rate * times + 2.0 * np.sin(2.0 * np.pi * rate * times / 360.0)
    inside = (angle + 360.0) % 720.0 - 360.0
    of_wheel = (angle - 100.0) % 360.0
    tooth = (of_wheel % 6.0 < 3.0) & (of_wheel < 348.0)
    signal = np.where(tooth, 5.0, 0.0)  # the crossing is known to a sample, 0.09 degree
    pressure = recorded_engine.pressure(inside * DEGREE) / 1e5
    (tmp_path / "run.csv").write_text(
        "instant [s],wheel [V],p [bar]\n" + rows(times, signal, pressure)
    )
    keys = {"encoder_column": "wheel", "wheel": "60-2", "average": True, "angle_step": 0.5,
            "gap_angle": 100.0, "edge": "rising"}  # fmt: skip
    found = read_pressure(tmp_path / "run.csv", time_column="instant", pressure_column=3, **keys)
    assert imep(found.mean.angle, found.mean.pressure[0]) == pytest.approx(TRUE, rel=1e-2)
    with pytest.raises(sweeps.SceneError, match="time_column or sample_rate"):
        read_pressure(tmp_path / "run.csv", **keys)
    with pytest.raises(sweeps.SceneError, match="wheel"):
        read_pressure(tmp_path / "run.csv", sample_rate=1e5, **{**keys, "wheel": "36-1"})


def test_a_falling_single_cycle_is_turned_by_its_work(tmp_path: Path) -> None:
    angle, pressure = samples(-360.0)
    text = "CA [deg],p [bar]\n" + rows(-angle, pressure)  # counted backward, in time
    (tmp_path / "back.csv").write_text(text)
    found = read_pressure(tmp_path / "back.csv")
    assert imep(found.mean.angle, found.mean.pressure[0]) == pytest.approx(TRUE, rel=2e-3)
    assert any("backward" in step for step in found.steps)


def test_motored_cycles(tmp_path: Path) -> None:
    angle = np.arange(-360.0, 360.0)
    pressure = recorded_engine.pressure(angle * DEGREE, heat=0.0, loss=8.0) / 1e5
    (tmp_path / "off.csv").write_text("CA [deg],p [bar]\n" + rows(angle, pressure))
    found = read_pressure(tmp_path / "off.csv", compression_ratio=recorded_engine.RATIO)
    assert imep(found.mean.angle, found.mean.pressure[0]) < -0.1
    assert any("dead centre: motored" in step for step in found.steps)
    assert not any("backward" in warning for warning in found.warnings)
    # Motored cycles have a loss angle and no variation of imep.
    angle = np.arange(-360.0, 360.0 * 11, 0.5)
    one = recorded_engine.pressure(np.arange(-360.0, 360.0, 0.5) * DEGREE, heat=0.0, loss=25.0)
    factor = 1.0 + 0.002 * np.random.default_rng(3).standard_normal(6)
    pressure = np.concatenate([one * f for f in factor]) / 1e5
    (tmp_path / "off.csv").write_text("CA [deg],p [bar]\n" + rows(angle, pressure))
    found = read_pressure(
        tmp_path / "off.csv", compression_ratio=recorded_engine.RATIO, average=True
    )
    fine = np.arange(-5.0, 5.0, 0.01)
    top = fine[np.argmax(recorded_engine.pressure(fine * DEGREE, heat=0.0, loss=25.0))]
    told = next(step for step in found.steps if "': imep " in step)
    assert "6 cycles" in told and "variation of imep" not in told
    assert "variation of the largest pressure" in told
    loss = float(told.split("loss angle ")[1].split(" degree")[0])
    assert loss == pytest.approx(-top, abs=0.05) and loss > 0.2
    sheet = evaluated(found.recorded["p"], found.geometry)
    assert "imep_variation" not in sheet
    assert float(sheet.loss_angle) == pytest.approx(-top, abs=0.05)
    assert "variation of imep" not in sheet.summary and "loss angle" in sheet.summary


@pytest.mark.parametrize(
    ("text", "expected"),
    [("n,time_us\n001,1500\n002,3000\n003,4500\n", [("n", 2.0), ("time_us", 3000.0)]),
     ("hour,pressure\n08,12\n09,13\n10,14\n", [("hour", 9.0), ("pressure", 13.0)]),
     ("angle,p\n1,003\n2,006\n3,009\n", [("angle", 2.0), ("p", 6.0)]),
     ("001,15\n002,30\n003,45\n", [("column 1", 2.0), ("column 2", 30.0)]),
     ("angle p\n1,0 1,003\n2,0 1,066\n3,0 2,009\n", [("angle", 2.0), ("p", 1.066)]),
     ("1,003\n1,066\n2,009\n", [("column 1", 1.066)])],
)  # fmt: skip
def test_zeros_before_whole_numbers(text: str, expected: list[tuple[str, float]]) -> None:
    """They seem to stand behind a decimal comma only where names do not say otherwise."""
    columns = text_tables.read_text(
        Path("log.csv"), text.encode(), "log.csv", ReadingChoices()
    ).columns
    assert [(column.name, column.values[1]) for column in columns] == expected
