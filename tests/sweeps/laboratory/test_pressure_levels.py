"""A recording that is not absolute: said by import, plan and run, with what puts it right."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import sweeps
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, RecordedCycles
from engine_dyn.recordings.level import recorded_level
from engine_dyn.units import BAR, DEGREE
from sweeps.scene.engine.engine_files import catalogue, load_engine
from sweeps.scene.features.indicator_files import read_indicator
from tests.support.commands import invoke, ok, refused
from tests.support.known_pressures import KnownPressure

KNOWN = KnownPressure(16.5, 1.335, inlet=0.95, rise=0.7)
ENGINE = """
cycle = "four-stroke"
[values]
bore = 0.095
stroke = 0.105
cylinders = 4
crank_ratio = 0.27
reciprocating_mass = 0.9
inertia = 0.5
speed = 1500
load = 100
load_exponent = 1
load_offset = 0
crankcase_pressure = 1.01325
friction_constant = 0.3
friction_peak_pressure = 0
friction_mean_piston_speed = 0
geometric_compression_ratio = 16.5
[[diagram]]
load = 100
kind = "points"
file = "pressure.csv"
"""
SCENE = """
engine = "engine.toml"
[output]
quantities = ["delta"]
"""


def written(folder: Path, offset: float, late: float, cycles: int = 8, unit: str = "bar") -> Path:
    """A file as a German spreadsheet writes it, of cycles in a row from gas exchange on."""
    angle, pressure = KNOWN.recorded(offset, late, cycles=cycles, noise=0.03)
    running = (angle + 720.0 * np.arange(cycles)[:, None]).ravel() + 360.0
    lines = [f"{a:.1f};{p:.4f}" for a, p in zip(running, pressure.ravel(), strict=True)]
    head = f"Kurbelwinkel [°];Zylinderdruck [{unit}]\n"
    path = folder / "recording.csv"
    path.write_text(head + "\n".join(lines).replace(".", ",") + "\n", encoding="utf-8")
    (folder / "engine.toml").write_text(ENGINE)
    (folder / "scene.toml").write_text(SCENE)
    return path


def level_line(text: str) -> str:
    (line,) = [line for line in text.splitlines() if " level: " in line]
    return line


@pytest.mark.parametrize("engine", [True, False], ids=["with engine", "without"])
@pytest.mark.parametrize(("offset", "late"), [(2.7, 1.5), (-0.6, -1.0)])
def test_the_option_that_is_offered_puts_the_level_right(
    tmp_path: Path, offset: float, late: float, engine: bool
) -> None:
    raw, made = written(tmp_path, offset, late), tmp_path / "pressure.csv"
    more = ["--engine", tmp_path / "engine.toml"] if engine else []
    first = invoke("import", raw, "--average", "-o", made, *more)
    assert first.exit_code == 0
    found = re.search(r"the pressure is ([\d.]+) bar too (high|low)", level_line(first.stderr))
    assert found is not None
    assert (1 if found[2] == "high" else -1) * float(found[1]) == pytest.approx(offset, abs=0.05)
    assert "dead_centre" not in first.stderr and "exponent" not in first.stderr
    assert "cannot be told to 0.3 degree" in first.stdout
    assert "absolute;" not in made.read_text()
    assert "level as recorded, not pegged" in made.read_text().splitlines()[0]
    # What is offered, pasted.
    offer = re.search(r"--pegging inlet --inlet-pressure [\d.]+", level_line(first.stderr))
    assert offer is not None
    again = invoke("import", raw, "--average", "-o", made, "--overwrite", *more,
                   *shlex.split(offer[0]))  # fmt: skip
    assert again.exit_code == 0 and " level: " not in again.stderr, again.stderr
    assert "absolute;" in made.read_text().splitlines()[0]
    # The dead centre is as late as before: said with what it changes and the option that moves it.
    (told,) = [line for line in again.stdout.splitlines() if ": pegged; dead centre" in line]
    assert re.search(r"[\d.]+ degree (late|early)", told)[0] in first.stdout
    worth = re.search(r"is worth ([-+][\d.]+) bar \(.*\) of imep; (--shift -?[\d.]+)", again.stdout)
    moved = invoke("import", raw, "--average", "-o", made, "--overwrite", *more,
                   *shlex.split(offer[0]), *shlex.split(worth[2]))  # fmt: skip
    imeps = [float(re.search(r": imep ([\d.]+) bar", one.stdout)[1]) for one in (again, moved)]
    shift = -float(worth[2].split()[1])
    assert imeps[1] - imeps[0] == pytest.approx(shift * float(worth[1]), rel=0.1, abs=0.01)
    assert read_indicator(made)(-np.pi) / BAR == pytest.approx(KNOWN.inlet, abs=0.1)  # noise


def test_what_is_wrong_by_the_level_in_delta_is_mended_by_pegging(tmp_path: Path) -> None:
    """The pegged recording gives the speed of the closed form itself."""
    raw, made = written(tmp_path, 2.7, 0.0), tmp_path / "pressure.csv"
    ok("import", raw, "--average", "-o", made)
    wrong = float(sweeps.run(tmp_path / "scene.toml").delta)
    ok("import", raw, "--average", "-o", made, "--overwrite", "--pegging", "inlet",
       "--inlet-pressure", str(KNOWN.inlet))  # fmt: skip
    found = float(sweeps.run(tmp_path / "scene.toml").delta)
    angle = np.arange(-360.0, 360.0)
    rows = "".join(f"{a:g},{p:.8g}\n" for a, p in zip(angle, KNOWN(angle), strict=True))
    made.write_text("crank_angle_deg,pressure_bar\n" + rows)
    true = float(sweeps.run(tmp_path / "scene.toml").delta)
    assert found == pytest.approx(true, rel=0.005)
    assert wrong / true == pytest.approx(1.26, abs=0.01)  # as docs/measured_pressure.md says


def test_the_catalogue_is_absolute() -> None:
    """Each modelled diagram, with its compression ratio and without, and 1.5 bar too high."""
    for name in catalogue():
        engine = load_engine(name)
        if engine.cycles is None or "compressor" in name:
            continue
        values = engine.values
        for diagram in engine.family.diagrams:
            angle = np.arange(-diagram.period / 2, diagram.period / 2 - 1e-9, DEGREE)
            for ratio, offset in ((engine.compression_ratio, 0.0), (None, 1.5 * BAR)):
                cycles = RecordedCycles(angle, diagram(angle)[None] + offset, diagram.period)
                geometry = CylinderGeometry(
                    values["bore"], values["stroke"], values["crank_ratio"], ratio
                )
                found = recorded_level(cycles, geometry)
                assert abs(found.offset - offset) < min(0.05 * BAR, 2.0 * found.uncertainty), name
                assert found.off == (offset > 0.0)
                assert abs(found.shift) < 3.0 * found.shift_uncertainty


def test_an_indicator_says_for_which_speeds_it_holds(tmp_path: Path) -> None:
    raw = written(tmp_path, 0.0, 0.0)
    ok("import", raw, "--average", "-o", tmp_path / "pressure.csv")
    for name in ("recording.csv", "pressure.csv"):
        average = "average = true\n" if name == "recording.csv" else ""
        text = f'{SCENE}[indicator]\nfile = "{name}"\n{average}speeds = [1400, 1600]\n'
        (tmp_path / "indicated.toml").write_text(text)
        assert "diagram_speeds" not in invoke("plan", tmp_path / "indicated.toml").stderr
        (tmp_path / "indicated.toml").write_text(
            text.replace("[output]", "[set]\nspeed=2000\n[output]")
        )
        told = invoke("plan", tmp_path / "indicated.toml").stderr
        assert "speed = 2000 rpm; [indicator] holds for 1400 to 1600 rpm" in told
    (tmp_path / "indicated.toml").write_text(text.replace("[1400, 1600]", "[1600, 1400]"))
    assert "must ascend" in refused("plan", tmp_path / "indicated.toml")
