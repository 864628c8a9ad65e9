"""Draw figures of recordings: recorded_pressure.png, recorded_train.png, torsiogram.png.

The recordings are simulated here. Run it from the project's root:
`python tools/recorded_figures.py`; it prints what the commands would say.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from pages import csv_text, keep_figure

import sweeps
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry, RecordedCycles
from engine_dyn.recordings.signal_checks import examine
from engine_dyn.units import BAR, DEGREE
from sweeps.lab.pressure.evaluation import evaluated
from sweeps.scene.engine.engine_files import load_engine
from sweeps.view.figures.measured_speeds import DISC_ORDERS
from sweeps.view.texts.lab_texts import train_text


def pressure() -> xr.Dataset:
    """Evaluation of forty noisy cycles of a modelled diesel engine, six degrees late."""
    rng = np.random.default_rng(3)
    angle = np.arange(-360.0, 360.0, 0.5) * DEGREE
    light, heavy = (one(angle - 6.0 * DEGREE) for one in load_engine("ntua").family.diagrams[1:])
    rows = []
    for _ in range(40):
        share = rng.normal(0.5, 0.15)
        rows.append(light + share * (heavy - light) + 0.03 * BAR * rng.standard_normal(angle.size))
    cycles = RecordedCycles(angle, np.array(rows))
    cylinder = CylinderGeometry(0.14, 0.18, 0.18 / 0.7, 17.433233)
    title = "Recorded pressure, modelled diesel engine 140/180 mm, dead centre wrong by 6 degrees"
    return evaluated(cycles, cylinder, title=title, findings=examine(cycles, cylinder))


def train() -> xr.Dataset:
    """Speed over sixteen cycles of a modelled diesel engine, the sixth of which hardly burns."""
    rng = np.random.default_rng(3)
    angle = np.arange(-360.0, 360.0)
    light, *_, heavy = (one(angle * DEGREE) / BAR for one in load_engine("ntua").family.diagrams)
    shares = rng.normal(0.7, 0.06, 16)
    shares[5] = 0.0
    rows = [["cycle", *(f"{a:g}" for a in angle)]]
    for number, share in enumerate(shares, start=1):
        rows.append([str(number), *(f"{p:.5f}" for p in light + share * (heavy - light))])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cycles.csv"
        path.write_text(csv_text(rows), encoding="utf-8")
        return sweeps.follow_cycles({
            "engine": "ntua",
            "axes": {"recorded_cycle": list(range(1, 17))},
            "indicator": {"file": str(path), "unit": "bar"},
            "output": {"quantities": ["delta"]},
        })  # fmt: skip


def torsiogram() -> xr.Dataset:
    """Speed of a pulley at some twenty speeds, whose damper is weaker than the scene says."""
    damped: dict[str, Any] = {"engine": "diesel_105x137", "shaft": "diesel_105x137_damper"}
    speeds = list(range(1200, 2351, 50))
    names = ["disc_angle_order", "disc_angle_phase"]
    found = sweeps.run(**damped, set={"damper_damping_1": 70.0}, axes={"speed": speeds},
                       output={"quantities": names}).isel(disc=0)  # fmt: skip
    size, phase = (np.radians(found[name].values) for name in names)
    theta = size * np.exp(1j * phase)
    phi = np.radians(np.arange(-360.0, 720.0 * 4 - 360.0, 0.5))
    waves = np.exp(1j * np.multiply.outer(found.order.values, phi))
    noise = np.random.default_rng(3)
    with tempfile.TemporaryDirectory() as folder:
        files = [str(Path(folder) / f"{rpm}.csv") for rpm in speeds]
        for file, rpm, own in zip(files, speeds, theta, strict=True):
            swing = (1j * found.order.values * own) @ waves + 5e-4 * noise.standard_normal(phi.size)
            table = [np.degrees(phi + (own @ waves).real), rpm * (1.0 + swing.real)]
            heads = "crank angle [deg],speed [rpm]"
            np.savetxt(file, np.transpose(table), delimiter=",", header=heads, comments="")
        return sweeps.measured(
            **damped, axes={"speed": speeds}, output={"quantities": ["delta"]},
            measured={"file": files, "kind": "speed", "disc": "pulley", "at": {"speed": speeds}},
        )[[*DISC_ORDERS]]  # fmt: skip


if __name__ == "__main__":
    keep_figure(torsiogram(), "torsiogram")
    keep_figure(pressure(), "recorded_pressure")
    found = train()
    print(train_text(found))
    keep_figure(found, "recorded_train")
