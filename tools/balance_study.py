"""Tables of docs/validation.md on balance, flywheel and speed characteristic.

Printed are Asgari et al. (2019) and lecture 18 (Power units); beside them stands what this project
computes. Table 1 of the paper cannot be compared: the tables say what stands on either side.
"""

from __future__ import annotations

import csv
import math
import shutil
import tempfile
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import sweeps
from engine_dyn import flywheel
from engine_dyn.forces import balance
from engine_dyn.geometry.cylinders import Cylinders, cylinders_of, even_cylinders
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.loads.characteristic import CHARACTERISTICS

SCENES = Path(sweeps.__file__).parent / "catalogue" / "scenes"
FOUR_STROKE = 4.0 * math.pi
SPEED = 3000 * math.pi / 30
RATIO, RADIUS, MASS, SPACING = 0.25, 0.05, 1.0, 0.1

TABLE_1 = ((0.693, 21.512, 84.0), (0.492, 21.512, 57.1), (0.821, 21.512, 73.6), (0.693, 17.0, 71.0),
           (0.693, 24.0, 64.0))  # fmt: skip
"""Asgari, Table 1: mass of the balance shaft [kg], its radius [mm], printed force [N]."""

CUT = "cut"
NOTES = {
    "rim_speed": "pi 0.27 3000/60 is 42.41",
    "triangle_energy_swing": "the printed factors 245.1 and 2.88 give 352.9",
    "triangle_torque_max": CUT,
    "triangle_torque_mean": CUT,
    "balance_shaft_asgari": "with the rounded 0.841 kg 0.6939, cut",
    "inertia_triangular": "two digits printed",
}


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], texts: int = 1) -> str:
    """Write a Markdown table whose first columns are texts."""
    lines = [heads, ["---"] * texts + ["---:"] * (len(heads) - texts), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def asgari() -> Any:
    """The built-in scene, computed."""
    return sweeps.run("asgari")


def printed_row() -> dict[str, str]:
    """Printed numbers of the paper, as printed."""
    text = (SCENES / "asgari_printed.csv").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    row = next(iter(csv.DictReader(lines)))
    return {name: value for name, value in row.items() if name != "case"}


def asgari_table(archive: Any) -> str:
    """Every number of the analytic part beside ours."""
    rows = []
    for name, printed in printed_row().items():
        variable = archive[name]
        value = float(variable.values.reshape(-1)[0])
        off = 100.0 * (value / float(printed) - 1.0)
        rows.append(
            [f"`{name}`", variable.attrs["units"], printed, f"{value:.5g}",
             f"{off:+.2f}".replace("-0.00", "0.00").replace("+0.00", "0.00"),
             NOTES.get(name, "")]
        )  # fmt: skip
    return table(["quantity", "unit", "printed", "computed", "%", "cause"], rows, texts=2)


def shaft_table(archive: Any) -> str:
    """Asgari's Table 1 beside what the shafts leave of the inertia force."""
    rows = []
    for place, (mass, radius, force) in enumerate(TABLE_1):
        here = archive.isel(design=place)
        vector = here["shaking_force_first"]
        along, across = (np.abs(vector.isel(direction=i)).max() for i in (0, 1))
        rows.append(
            [f"{mass:g}", f"{radius:g}", f"{force:g}", f"{float(along):.1f}",
             f"{float(across):.1f}", f"{float(here['shaking_force_max']):.1f}",
             f"{float(here['shaking_force_rms']):.1f}"]
        )  # fmt: skip
    heads = ["shaft (kg)", "radius (mm)", "printed (N)", "first order, along (N)",
             "first order, across (N)", "largest, exact (N)", "root mean square (N)"]  # fmt: skip
    return table(heads, rows, texts=0)


def flywheel_table(archive: Any) -> str:
    """Estimates of the inertia beside the exact one."""
    exact = float(archive["inertia_required"])
    rows = [["exact, periodic solution", f"{exact:.4f}", ""]]
    for text, name in (
        ("energy swing of the real torque", "inertia_energy_swing"),
        ("triangular torque, Asgari (30)", "inertia_triangular"),
    ):
        value = float(archive[name])
        rows.append([text, f"{value:.4f}", f"{100.0 * (value / exact - 1.0):+.2f}"])
    return table(["inertia for delta = 0.04", "kg m2", "%"], rows)


def engine(text: str) -> Cylinders:
    if text == "in-line 1":
        return even_cylinders(1, FOUR_STROKE)
    return cylinders_of(arrangement_from_text(text, FOUR_STROKE))


def lecture_table() -> str:
    """Resultants of the lecture's engines, over m r omega^2 and that times the spacing."""
    lam = float(balance.acceleration_harmonics(2.0, RATIO).real)
    rows = []
    for name, text, printed in (
        ("one", "in-line 1", (1.0, lam, 0.0, 0.0)),
        ("two in line, 180°", "parallel twin 180", (0.0, 2.0 * lam, 1.0, 0.0)),
        ("two opposed", "boxer 2", (0.0, 0.0, 1.0, lam)),
        ("four in line", "in-line 4", (0.0, 4.0 * lam, 0.0, 0.0)),
        ("six in line", "in-line 6", (0.0, 0.0, 0.0, 0.0)),
    ):
        gear = balance.running_gear(
            engine(text), RATIO, RADIUS, MASS, SPEED, spacing=SPACING, bank_offset=SPACING
        )
        unit = MASS * RADIUS * SPEED**2
        found = [float(gear.force_ellipse(n).major) / unit for n in (1.0, 2.0)]
        found += [float(gear.moment_ellipse(n).major) / (unit * SPACING) for n in (1.0, 2.0)]
        largest = max(abs(a - b) for a, b in zip(found, printed, strict=True))
        assert largest < 1e-12, (name, found, printed)
        rows.append([name, *(f"{0.0 if v < 1e-12 else v:.5f}" for v in found)])
    heads = ["engine", "force, 1st", "force, 2nd", "moment, 1st", "moment, 2nd"]
    return table(heads, rows)


def second_harmonic() -> str:
    """Second harmonic of the piston's acceleration, which the lecture writes as lambda."""
    return f"{float(balance.acceleration_harmonics(2.0, RATIO).real):.5f}"


def shaft_13_table() -> str:
    """What Asgari's (13) leaves of the first order across the cylinder, over m r omega^2."""
    rows = []
    for fraction in (0.0, 0.25, 0.5, 0.63, 1.0):
        shaft = float(balance.balance_shaft_mass(fraction, MASS, RADIUS, 1.0))
        gear = balance.running_gear(
            engine("in-line 1"), RATIO, RADIUS, MASS, SPEED, turning_mass=-fraction * MASS,
            shaft=shaft,
        )  # fmt: skip
        phi = np.linspace(0.0, 2.0 * np.pi, 361)
        left = gear.force_of_order(1, phi) / (MASS * RADIUS * SPEED**2)
        along, across = float(np.abs(left.real).max()), float(np.abs(left.imag).max())
        rows.append([f"{fraction:g}", f"{abs(round(along, 9)):.3f}", f"{across:.3f}"])
    return table(["c", "along", "across"], rows, texts=0)


def best_fractions() -> str:
    """Say which c leaves the least, of B112."""
    gear = balance.running_gear(engine("in-line 1"), 0.0355 / 0.1175, 0.0355, 0.841, SPEED)
    rms, peak = (float(gear.best_fraction(norm)) for norm in ("rms", "peak"))
    return f"{rms:.3f} for the smallest mean square and {peak:.3f} for the smallest peak force"


def irregularity_table() -> str:
    """The lecture's mu by the quantity, by the curves of the torque, and over the brake torque."""
    names = ["torque_irregularity", "torque_irregularity_brake"]
    scene = tomllib.loads((SCENES / "lecture18.toml").read_text(encoding="utf-8"))
    scene["axes"] = {"speed": [700, 1500]}
    scene["output"] = {"quantities": [*names, "gas_torque", "inertia_torque"], "angle_step": 0.1}
    found = sweeps.run(scene)
    curve = found["gas_torque"] + found["inertia_torque"]
    by_curve = (curve.max("crank_angle") - curve.min("crank_angle")) / curve.mean("crank_angle")
    rows = []
    for place, case in enumerate(found["case"].values.tolist()):
        for speed in (700, 1500):
            at = {"speed": speed}
            mu, brake = (float(found[name].isel(design=place).sel(at)) for name in names)
            own = float(by_curve.isel(design=place).sel(at))
            rows.append([case, str(speed), f"{mu:.3f}", f"{own:.3f}", f"{brake:.3f}"])
    return table(["engine", "rpm", "mu", "by the curves", "over the brake torque"], rows)


def characteristic_table() -> str:
    """The lecture's curves: torque over that at rated speed."""
    speeds = (0.25, 0.5, 0.75, 1.0)
    rows = []
    for name, curve in CHARACTERISTICS.items():
        x, most = curve.largest_torque
        peak = [f"{most:.4f}", f"{x:.3f}"] if curve.square < 0.0 else ["", ""]
        coefficients = [f"{curve.constant:g}", f"{curve.linear:g}"]
        rows.append(
            [name, *(coefficients if curve.square < 0.0 else ["", ""]),
             *(f"{float(curve.torque(s, 1.0, 1.0)):.4f}" for s in speeds), *peak]
        )  # fmt: skip
    heads = ["curve", "A", "C", *(f"M at {s:g}" for s in speeds), "largest M", "at"]
    return table(heads, rows)


def draw_shaft(path: Path) -> None:
    """Draw the curve of the shaking force's vector for shafts of several masses."""
    from sweeps.figures import draw

    archive = asgari()[["reciprocating_force", "shaking_force"]]
    with tempfile.TemporaryDirectory() as folder:
        made = {file.stem: file for file in draw(archive, folder)}
        shutil.copyfile(made["shaking_force_polar_balance_shaft_mass"], path)


def draw_shaft_torques(folder: Path) -> None:
    """Draw the torques before and behind the flywheel at the lowest speed of Asgari's Table 2."""
    from sweeps.figures import draw

    names = ("flywheel_shaft_torque", "load_shaft_torque")
    archive = sweeps.run("asgari_flywheel").isel(speed=0)
    archive = archive[[*names, *(f"{name}_rms" for name in names)]]
    with tempfile.TemporaryDirectory() as made_in:
        made = {file.stem: file for file in draw(archive, made_in)}
        for name in names:
            shutil.copyfile(made[f"{name}_flywheel_inertia"], folder / f"{name}.png")


def shaft_torque_table(archive: Any) -> str:
    """Asgari's Table 2 beside both torques of the rigid shaft, of which docs/flywheel.md tells."""
    rows = []
    for inertia in archive["flywheel_inertia"].values:
        for speed in archive["speed"].values[:4]:
            at = archive.sel(flywheel_inertia=inertia, speed=speed)
            rows.append(
                [f"{inertia:g}", f"{speed:g}", f"{float(at['load_shaft_torque_rms_published']):g}",
                 f"{float(at['flywheel_shaft_torque_rms']):.1f}",
                 f"{float(at['load_shaft_torque_rms']):.1f}"]
            )  # fmt: skip
    heads = ["flywheel (kg m²)", "speed (rpm)", "printed", "before the flywheel", "behind it"]
    return table(heads, rows, texts=0)


def tables() -> dict[str, str]:
    """Tables of docs/validation.md by the names of their files."""
    archive = asgari()
    return {
        "asgari": asgari_table(archive),
        "asgari_shafts": shaft_table(archive),
        "asgari_inertia": flywheel_table(archive),
        "asgari_shaft_13": shaft_13_table(),
        "asgari_table_2": shaft_torque_table(sweeps.run("asgari_flywheel")),
        "lecture_resultants": lecture_table(),
        "lecture_irregularity": irregularity_table(),
        "lecture_characteristic": characteristic_table(),
    }


def values() -> dict[str, str]:
    """Numbers of docs/validation.md."""
    triangle = flywheel.triangular_torque(7000.0, SPEED, 0.04)
    return {
        "triangle_swing": f"{float(triangle.energy_swing):.1f}",
        "second_harmonic": second_harmonic(),
        "best_fractions": best_fractions(),
    }
