"""Engine files of one's own, and indicator diagrams as files."""

import tomllib
from pathlib import Path

import numpy as np

import sweeps
from sweeps.scene.engine.engine_files import catalogue

ENGINES = Path(sweeps.__file__ or "").parent / "catalogue" / "engines"


def compression(phi: np.ndarray) -> np.ndarray:
    """A motored diagram [bar]: compression and expansion of 16 : 1, 1 bar elsewhere."""
    shape = 1.0 / (1.0 + 15.0 * 0.5 * (1.0 - np.cos(np.radians(phi)))) * 16.0
    return np.where(np.abs(phi) < 180.0, shape**1.3, 1.0)


def points(step: float = 2.0) -> list[tuple[float, float]]:
    phi = np.arange(-360.0, 360.0 + step / 2.0, step)
    return [(float(a), float(p)) for a, p in zip(phi, compression(phi), strict=True)]


def indicator_text(rows: list[tuple[float, float]]) -> str:
    head = "# a comment\ncrank_angle_deg,pressure_bar\n"
    return head + "".join(f"{a:g},{p:.8g}\n" for a, p in rows)


VALUES = """\
name = "mine"
title = "An engine of one's own"
cycle = "four-stroke"

[values]
reciprocating_mass = 6.67
inertia = 2
rod_length = 0.35
bore = 0.14
stroke = 0.18
speed = 1200
load = 50
cylinders = 2
load_exponent = 2
load_offset = 0
crankcase_pressure = 1.01325
friction_constant = 0.137
friction_peak_pressure = 0.005
friction_mean_piston_speed = 0.142
"""

POINTS = '\n[[diagram]]\nload = 50\nkind = "points"\nfile = "pressure.csv"\n'


def modelled() -> str:
    """A [[diagram]] of the catalogue that is modelled, written out again."""
    raw = tomllib.loads(catalogue()["ntua"].read_text(encoding="utf-8"))
    table = next(t for t in raw["diagram"] if t["kind"] == "diesel_cycle")
    lines = [f"{key} = {value!r}" for key, value in {**table, "load": 50}.items()]
    return "\n[[diagram]]\n" + "\n".join(lines).replace("'", '"') + "\n"


def written(folder: Path, text: str) -> Path:
    folder.joinpath("pressure.csv").write_text(indicator_text(points()))
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


SPLIT_PINS = {
    "banks": [0, 90], "uneven": True,
    "throws": [{"angle": 0, "position": 0}, {"angle": 30, "position": 0},
               {"angle": 180, "position": 1}, {"angle": 210, "position": 1}],
    "cylinders": [{"throw": 1, "bank": 1, "firing_angle": 0},
                  {"throw": 2, "bank": 2, "firing_angle": 60},
                  {"throw": 3, "bank": 1, "firing_angle": 180},
                  {"throw": 4, "bank": 2, "firing_angle": 240}],
}  # fmt: skip
"""Arrangement of a V4 whose pins are split."""
