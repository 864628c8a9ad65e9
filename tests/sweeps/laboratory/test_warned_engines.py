"""Engine files and angles that are wrong are told by import and calibrate too."""

from pathlib import Path

import numpy as np
import pytest

import engine_dyn
import sweeps
from sweeps.base.errors import SceneError
from tests.support.commands import invoke, refused
from tests.support.scenes import refusal_of

ENGINE = """
title = "Engine with a mistake"
cycle = "four-stroke"
[values]
cylinders = 4
bore = 0.0875
stroke = 0.101
rod_length = 0.151
piston_mass = 0.45
rod_mass = 0.5
rod_centre_of_gravity = 0.05
inertia = 0.15
"""
MISTAKES = {
    "piston_mass = 0.45": ("piston_mass = 450", "reciprocating_mass"),
    "rod_centre_of_gravity = 0.05": ("rod_centre_of_gravity = 0.1", "rod_centre_of_gravity"),
}
RATED = ("--power", "110", "--speed", "5200", "--kind", "spark-ignition", "--loads", "100")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    computed = sweeps.run(
        engine="si_four_87x101", set={"load": 100, "speed": 3000}, silenced_warnings=["all"],
        output={"quantities": ["pressure"]},
    )  # fmt: skip
    return written(tmp_path / "raw.csv", computed.crank_angle.values, computed.pressure.values)


def written(path: Path, angle: np.ndarray, pressure: np.ndarray) -> Path:
    table = np.column_stack([angle, pressure])
    np.savetxt(path, table, delimiter=";", header="angle [deg];p [bar]", comments="")
    return path


@pytest.mark.parametrize("line", MISTAKES)
def test_unusual_engines_are_warned_of(line: str, recording: Path, tmp_path: Path) -> None:
    engine, output = tmp_path / "engine.toml", tmp_path / "out"
    wrong, name = MISTAKES[line]
    for text, warned in (
        (ENGINE, False),
        (ENGINE.replace(line, wrong), True),
        ("silenced_warnings = ['all']" + ENGINE.replace(line, wrong), False),
    ):
        engine.write_text(text)
        done = invoke("calibrate", engine, *RATED, "-o", output, "--overwrite")
        assert done.exit_code == 0 and (f"{engine}: {name}: " in done.stderr) == warned
        done = invoke("import", recording, "--engine", engine, "-o", output, "--overwrite")
        assert done.exit_code == 0 and (f"{engine}: {name}: " in done.stderr) == warned
    engine.write_text(ENGINE.replace(line, wrong))
    with pytest.warns(engine_dyn.ImplausibleWarning, match=name):
        sweeps.calibrate(engine, power=110, speed=5200, kind="spark-ignition", loads=[100])


def test_a_centre_of_gravity_beyond_the_rod_is_refused(recording: Path, tmp_path: Path) -> None:
    engine = tmp_path / "engine.toml"
    engine.write_text(ENGINE.replace("gravity = 0.05", "gravity = 0.38"))
    said = "rod_centre_of_gravity = 0.38: must be at most the rod's length, 0.151 m"
    output = tmp_path / "out"
    assert said in refused("calibrate", engine, *RATED, "-o", output)
    assert said in refused("import", recording, "--engine", engine, "-o", output)
    assert said in refused("info", engine)


def test_an_angle_in_radians_is_refused(recording: Path, tmp_path: Path) -> None:
    """Steps of 2 radians at most look like 100 degrees; those of 10 degrees are taken."""
    angle, pressure = np.loadtxt(recording, delimiter=";", skiprows=1).T
    every = max(round(10.0 / float(np.diff(angle)[0])), 1)
    ten = written(tmp_path / "ten.csv", angle[::every], pressure[::every])
    assert sweeps.read_pressure(ten).mean.angle.size >= 36
    turned = written(tmp_path / "rad.csv", angle * 180.0 / np.pi, pressure)
    with pytest.raises(SceneError, match=r"steps of .* degree; must be at most 10; is the angle"):
        sweeps.read_pressure(turned)
    less = written(tmp_path / "deg.csv", angle * np.pi / 180.0, pressure)
    assert refusal_of(lambda: sweeps.read_pressure(less))


def test_a_further_shift_takes_the_place_of_the_given_one(recording: Path) -> None:
    plain = "\n".join(sweeps.read_pressure(recording, shift=0.0).steps)
    assert "in place of" not in plain
    said = "\n".join(sweeps.read_pressure(recording, shift=-1.0).steps)
    assert "in place of --shift -1 (shift = " in said
