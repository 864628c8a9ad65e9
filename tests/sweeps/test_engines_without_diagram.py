"""Balance and moments of inertia of engine files that have no diagram, load or friction."""

import math
from pathlib import Path

import numpy as np
import pytest

import sweeps
from sweeps.errors import SceneError
from sweeps.reading.engine_files import load_engine
from sweeps.scene.reading import read_scene
from tests.support.commands import ok
from tests.support.engine_files import indicator_text, points

pytestmark = pytest.mark.compiled

RADIUS, LENGTH, SPACING, OMEGA = 0.045, 0.15, 0.11, 100.0 * math.pi
TURNING, RECIPROCATING = 0.6 * (1.0 - 0.04 / LENGTH), 0.5 + 0.6 * 0.04 / LENGTH

HEAD = """
title = "V8 of 90 degrees"
cycle = "four-stroke"
"""
VALUES = """
[values]
stroke = 0.09
rod_length = 0.15
piston_mass = 0.5
rod_mass = 0.6
rod_centre_of_gravity = 0.04
crank_mass = 0.0
cylinder_spacing = 0.11
"""
NAMED = HEAD + 'arrangement = "V8 cross-plane"\n' + VALUES + "cylinders = 8\nspeed = 3000\n"
ANGLES = HEAD + VALUES + """
[arrangement]
banks = [0, 90]
throws = [{ angle = 0 }, { angle = 270 }, { angle = 90 }, { angle = 180 }]
cylinders = [
  { throw = 1, bank = 1, firing_angle = 0 }, { throw = 2, bank = 1, firing_angle = 90 },
  { throw = 3, bank = 1, firing_angle = 270 }, { throw = 4, bank = 1, firing_angle = 180 },
  { throw = 1, bank = 2, firing_angle = 450 }, { throw = 2, bank = 2, firing_angle = 540 },
  { throw = 3, bank = 2, firing_angle = 360 }, { throw = 4, bank = 2, firing_angle = 630 },
]
"""  # fmt: skip
BALANCE = ["shaking_force_max", "shaking_moment_max", "shaking_moment_major", "engine_inertia",
           "counterweight_required", "balance_couple_required", "best_fraction_rms"]  # fmt: skip


@pytest.mark.parametrize("text", [NAMED, ANGLES], ids=["named", "angles alone"])
def test_the_balance_of_a_cross_plane_v8(text: str, tmp_path: Path) -> None:
    """(2 m_rod + m_rec) r omega^2 a sqrt(10): the pair of a pin pulls with m_rec all around."""
    path = tmp_path / "v8.toml"
    path.write_text(text, encoding="utf-8")
    assert load_engine(path).values["cylinders"] == 8.0
    scene = {
        "engine": str(path), "output": {"quantities": BALANCE},
        "set": {"speed": 3000.0, "counterweight_mass": 0.0, "counterweight_radius": 0.045},
    }  # fmt: skip
    found = sweeps.run(scene)
    moment = (2.0 * TURNING + RECIPROCATING) * RADIUS * OMEGA**2 * SPACING * math.sqrt(10.0)
    assert moment == pytest.approx(2379.0, abs=0.5)
    first = found["shaking_moment_major"].sel(order=1.0)
    assert float(first) == pytest.approx(moment, rel=1e-12)
    assert float(found["engine_inertia"]) == pytest.approx(0.0126, abs=5e-6)
    assert "no diagrams" in ok("info", path)


def test_one_line_names_all_that_the_speed_needs(tmp_path: Path) -> None:
    path = tmp_path / "v8.toml"
    path.write_text(NAMED, encoding="utf-8")
    scene = {"engine": str(path), "output": {"quantities": ["delta", "shaking_force_max"]}}
    with pytest.raises(SceneError) as refused:
        read_scene(scene)
    (line,) = str(refused.value).splitlines()
    assert "'delta' needs [[diagram]], which engine v8 does not give; must be in its file" in line
    assert all(f"{key} (" in line for key in ("inertia", "load", "bore", "friction_constant"))
    assert "shaking_force_max" not in line

    with pytest.raises(SceneError, match=r"\[set\] heat: not allowed: engine v8 has no diagrams"):
        read_scene({**scene, "set": {"heat": 20.0}})


def test_a_measured_diagram_gives_the_pressure(tmp_path: Path) -> None:
    """The indicated work is the sum of p dV, here by trapezoids of the same points."""
    path = tmp_path / "v8.toml"
    path.write_text(NAMED, encoding="utf-8")
    rows = [(a, p * (1.0 + 0.5 * math.sin(math.radians(a)) * (0 < a < 180))) for a, p in points()]
    (tmp_path / "pressure.csv").write_text(indicator_text(rows))
    found = sweeps.run(
        engine=str(path), indicator={"file": str(tmp_path / "pressure.csv")},
        set={"bore": 0.1, "load": 100.0, "friction_constant": 0.0, "friction_peak_pressure": 0.0,
             "friction_mean_piston_speed": 0.0, "crankcase_pressure": 1.0},
        output={"quantities": ["imep"]},
    )  # fmt: skip
    phi, bar = np.radians([a for a, _ in rows]), np.array([p for _, p in rows])
    travel = RADIUS * (1.0 - np.cos(phi)) + LENGTH
    travel -= np.sqrt(LENGTH**2 - (RADIUS * np.sin(phi)) ** 2)
    mean = np.sum(0.5 * (bar[1:] + bar[:-1]) * np.diff(travel)) / (2.0 * RADIUS)
    assert float(found["imep"]) == pytest.approx(mean, rel=2e-3) and mean > 1.0
