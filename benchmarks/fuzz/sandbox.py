"""A folder of scenes, engine files and tables, good and bad, in which hostile files are read."""

from __future__ import annotations

import os
import tempfile
from functools import cache
from pathlib import Path

from benchmarks.fuzz.changes import WORDS
from engine_dyn.quantities.graph import PARAMETERS, QUANTITIES
from sweeps.catalogue import ENGINES, SCENES
from sweeps.reading.cylinder_keys import CYLINDER_KEYS
from sweeps.scene.toml_tables import SceneFile

__all__ = ["DESIGNS", "DRIVER", "LOAD", "PRESSURE", "PUBLISHED", "SCENE", "engines", "names",
           "sandbox", "scenes"]  # fmt: skip

SCENE = """\
title = "All tables"
engine = "ntua"

[set]
load = 50
pressure_factor = [1.0, 1.0, 1.0, 0.0, 1.0, 1.0]
load_table = "load.csv"

[axes]
speed = [1000.0, 1200.0]
inertia = { start = 1.0, stop = 9.0, num = 3, spacing = "log" }

[designs]
case = ["one", "two"]
bore = [0.14, 0.15]

[solver]
method = ["auto", "newton"]
inertia_model = "variable"
closure = "power_mean"
tolerance = 1e-6

[output]
quantities = ["delta", "omega", "imep"]
angle_step = 2
highest_order = 6
fail_on = ["stalled"]

[reference]
file = "published.csv"
"""

PRESSURE = "diesel_105x137_pressure.csv"

LOAD = "load_angle_deg,torque_Nm\n0,10\n90,20\n180,15\n270,5\n360,10\n"
DRIVER = "speed_rpm,torque_Nm\n0,100\n1500,90\n3000,10\n"
PUBLISHED = "case,speed,inertia,delta\none,1000,1,0.01\ntwo,1200,9,\n"
DESIGNS = "case,bore,stroke\nfirst,0.1,0.12\nsecond,0.11,0.13\n"


@cache
def sandbox() -> Path:
    """A folder of scenes with files that they name, good and bad; beside it what is private."""
    home = Path(tempfile.mkdtemp(prefix="engine-dyn-fuzz-"))
    outside, inside = home / "outside", home / "scenes"
    outside.mkdir()
    inside.mkdir()
    (home / "out").mkdir()
    (home / "secret.csv").write_text(DESIGNS)
    (outside / "precious.txt").write_text("precious")
    pressure = (ENGINES / PRESSURE).read_bytes()
    files = {
        "pressure.csv": pressure, PRESSURE: pressure, "load.csv": LOAD.encode(),
        "driver.csv": DRIVER.encode(), "published.csv": PUBLISHED.encode(),
        "designs.csv": DESIGNS.encode(), "engine.toml": engines()["diesel_105x137"],
        "scene.toml": SCENE.encode(),
    }  # fmt: skip
    for path in SCENES.glob("*.csv"):
        files[path.name] = path.read_bytes()
    for name, data in files.items():
        (inside / name).write_bytes(data)
    (inside / "folder.csv").mkdir()
    (inside / "loop.csv").symlink_to("loop.csv")
    (inside / "outside.csv").symlink_to("../secret.csv")
    (inside / "zero.csv").symlink_to("/dev/zero")
    if hasattr(os, "mkfifo"):
        os.mkfifo(inside / "fifo")
    return home


@cache
def engines() -> dict[str, bytes]:
    return {p.stem: p.read_bytes() for p in sorted(ENGINES.glob("*.toml"))}


@cache
def scenes() -> dict[str, bytes]:
    built_in = {p.stem: p.read_bytes() for p in sorted(SCENES.glob("*.toml"))}
    return {"all tables": SCENE.encode(), **built_in}


@cache
def names() -> tuple[str, ...]:
    return (
        *WORDS,
        *PARAMETERS,
        *CYLINDER_KEYS,
        *SceneFile.model_fields,
        *QUANTITIES,
        "file",
        "kind",
    )
