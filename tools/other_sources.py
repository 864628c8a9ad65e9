"""Tables of docs/validation.md on all sources but the thesis.

Printed are Asgari et al. (2019), lecture 18 (Power units), Mosakowski's relations, the notes after
Rakopoulos, and textbook cycles; beside them stands what this project computes. All tables are rows
of text, heads first.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import fields, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from pages import csv_rows
from thesis_study import percent, read_reference

import sweeps
from engine_dyn import flywheel
from engine_dyn.forces import balance
from engine_dyn.geometry import kinematic_series as series
from engine_dyn.geometry import slider_crank
from engine_dyn.geometry.cylinders import cylinders_of, even_cylinders
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.pressure.first_law import FourStrokeCycle, tabulate
from engine_dyn.quantities.features.characteristic import CHARACTERISTICS
from engine_dyn.units import DEGREE
from oracle.textbook_cycles import GAMMA, Textbook, finite_release, otto
from sweeps.scene.engine.engine_files import load_engine

Rows = list[list[str]]

SCENES = Path(sweeps.__file__).parent / "catalogue" / "scenes"


def signed(value: float, decimals: int = 2) -> str:
    """Write a number with its sign; a zero has none."""
    text = f"{value:+.{decimals}f}"
    return f"{abs(float(text)):.{decimals}f}" if float(text) == 0.0 else text


def run(engine: str, quantities: list[str], **tables: Any) -> Any:
    """Quantities of an engine of the catalogue."""
    return sweeps.run(engine=engine, output={"quantities": quantities}, **tables)


# --- Asgari et al. --------------------------------------------------------------------------------

SPEED = 3000 * math.pi / 30
RATIO, RADIUS, MASS, SPACING = 0.25, 0.05, 1.0, 0.1

TABLE_1 = ("84", "57.1", "73.6", "71", "64")
"""Asgari, Table 1: printed forces [N] of the balance shafts that are the designs of the scene."""

NOTES = {
    "rim_speed": "pi 0.27 3000/60 is 42.41",
    "triangle_energy_swing": "the printed factors 245.1 and 2.88 give 352.9",
    "triangle_torque_max": "cut",
    "triangle_torque_mean": "cut",
    "balance_shaft_asgari": "with the rounded 0.841 kg 0.6939, cut",
    "inertia_triangular": "two digits printed",
}


def asgari_table(archive: Any) -> Rows:
    """Every number of the analytic part beside ours."""
    printed = csv_rows(SCENES / "asgari_printed.csv")[0]
    rows = [["quantity", "unit", "printed", "computed", "%", "cause"]]
    for name, text in printed.items():
        if name != "case":
            value = float(archive[name].values.reshape(-1)[0])
            off = signed(percent(value, float(text)))
            unit = archive[name].attrs["units"]
            rows.append([name, unit, text, f"{value:.5g}", off, NOTES.get(name, "")])
    return rows


def shaft_table(archive: Any) -> Rows:
    """Asgari's Table 1 beside what the shafts leave of the inertia force."""
    rows = [["shaft (kg)", "radius (mm)", "printed (N)", "first order, along (N)",
             "first order, across (N)", "largest, exact (N)", "root mean square (N)"]]  # fmt: skip
    for place, force in enumerate(TABLE_1):
        here = archive.isel(design=place)
        left = np.abs(here["shaking_force_first"]).max("crank_angle").values
        values = [*left, here["shaking_force_max"], here["shaking_force_rms"]]
        mass, radius = (float(here[f"balance_shaft_{key}"]) for key in ("mass", "radius"))
        rows.append([f"{mass:g}", f"{1e3 * radius:g}", force, *(f"{float(v):.1f}" for v in values)])
    return rows


def flywheel_table(archive: Any) -> Rows:
    """Estimates of the inertia beside the exact one."""
    exact = float(archive["inertia_required"])
    rows = [["inertia for delta = 0.04", "kg m2", "%"],
            ["exact, periodic solution", f"{exact:.4f}", ""]]  # fmt: skip
    for text, name in (
        ("energy swing of the real torque", "inertia_energy_swing"),
        ("triangular torque, Asgari (30)", "inertia_triangular"),
    ):
        value = float(archive[name])
        rows.append([text, f"{value:.4f}", signed(percent(value, exact))])
    return rows


def running_gear(text: str, **more: float) -> Any:
    """Gear of an arrangement, of which all lengths and masses are round numbers."""
    cylinders = (
        even_cylinders(1, 4.0 * math.pi)
        if text == "in-line 1"
        else cylinders_of(arrangement_from_text(text, 4.0 * math.pi))
    )
    return balance.running_gear(cylinders, RATIO, RADIUS, MASS, SPEED, **more)


def shaft_13_table() -> Rows:
    """First order that Asgari's (13) leaves across the cylinder, over m r omega^2."""
    rows = [["c", "along", "across"]]
    phi = np.linspace(0.0, 2.0 * np.pi, 361)
    for fraction in (0.0, 0.25, 0.5, 0.63, 1.0):
        shaft = float(balance.balance_shaft_mass(fraction, MASS, RADIUS, 1.0))
        gear = running_gear("in-line 1", turning_mass=-fraction * MASS, shaft=shaft)
        left = gear.force_of_order(1, phi) / (MASS * RADIUS * SPEED**2)
        along, across = float(np.abs(left.real).max()), float(np.abs(left.imag).max())
        rows.append([f"{fraction:g}", f"{abs(round(along, 9)):.3f}", f"{across:.3f}"])
    return rows


def shaft_torque_table(archive: Any) -> Rows:
    """Asgari's Table 2 beside both torques of the rigid shaft, of which docs/flywheel.md tells."""
    rows = [["flywheel (kg m²)", "speed (rpm)", "printed", "before the flywheel", "behind it"]]
    for inertia in archive["flywheel_inertia"].values:
        for speed in archive["speed"].values[:4]:
            at = archive.sel(flywheel_inertia=inertia, speed=speed)
            both = (at[f"{name}_shaft_torque_rms"] for name in ("flywheel", "load"))
            printed = float(at["load_shaft_torque_rms_published"])
            numbers = (f"{float(torque):.1f}" for torque in both)
            rows.append([f"{inertia:g}", f"{speed:g}", f"{printed:g}", *numbers])
    return rows


# --- lecture 18 -----------------------------------------------------------------------------------

SECOND = float(balance.acceleration_harmonics(2.0, RATIO).real)
"""Second harmonic of the piston's acceleration, which the lecture writes as lambda."""

RESULTANTS = (
    ("one", "in-line 1", (1.0, SECOND, 0.0, 0.0)),
    ("two in line, 180°", "parallel twin 180", (0.0, 2.0 * SECOND, 1.0, 0.0)),
    ("two opposed", "boxer 2", (0.0, 0.0, 1.0, SECOND)),
    ("four in line", "in-line 4", (0.0, 4.0 * SECOND, 0.0, 0.0)),
    ("six in line", "in-line 6", (0.0, 0.0, 0.0, 0.0)),
)
"""The lecture's engines: forces over m r omega^2, moments over that times the spacing."""


def lecture_table() -> Rows:
    """Resultants of the lecture's engines."""
    rows = [["engine", "force, 1st", "force, 2nd", "moment, 1st", "moment, 2nd"]]
    unit = MASS * RADIUS * SPEED**2
    for name, text, printed in RESULTANTS:
        gear = running_gear(text, spacing=SPACING, bank_offset=SPACING)
        found = [float(gear.force_ellipse(n).major) / unit for n in (1.0, 2.0)]
        found += [float(gear.moment_ellipse(n).major) / (unit * SPACING) for n in (1.0, 2.0)]
        np.testing.assert_allclose(found, printed, rtol=0.0, atol=1e-12, err_msg=name)
        rows.append([name, *(f"{0.0 if v < 1e-12 else v:.5f}" for v in found)])
    return rows


def irregularity_table() -> Rows:
    """The lecture's mu by the quantity, by the curves of the torque, and over the brake torque."""
    names = ["torque_irregularity", "torque_irregularity_brake"]
    scene = tomllib.loads((SCENES / "lecture18.toml").read_text(encoding="utf-8"))
    scene["axes"] = {"speed": [700, 1500]}
    scene["output"] = {"quantities": [*names, "gas_torque", "inertia_torque"], "angle_step": 0.1}
    found = sweeps.run(scene)
    curve = found["gas_torque"] + found["inertia_torque"]
    own = (curve.max("crank_angle") - curve.min("crank_angle")) / curve.mean("crank_angle")
    rows = [["engine", "rpm", "mu", "by the curves", "over the brake torque"]]
    for place, case in enumerate(found["case"].values.tolist()):
        for speed in (700, 1500):
            mu, by_curves, brake = (
                float(one.isel(design=place).sel(speed=speed))
                for one in (found[names[0]], own, found[names[1]])
            )
            rows.append([case, str(speed), f"{mu:.3f}", f"{by_curves:.3f}", f"{brake:.3f}"])
    return rows


def characteristic_table() -> Rows:
    """The lecture's curves: torque over that at rated speed."""
    speeds = (0.25, 0.5, 0.75, 1.0)
    rows = [["curve", "A", "C", *(f"M at {s:g}" for s in speeds), "largest M", "at"]]
    for name, curve in CHARACTERISTICS.items():
        x, most = curve.largest_torque
        torques = [f"{float(curve.torque(s, 1.0, 1.0)):.4f}" for s in speeds]
        if curve.square < 0.0:
            shape = [f"{curve.constant:g}", f"{curve.linear:g}"]
            rows.append([name, *shape, *torques, f"{most:.4f}", f"{x:.3f}"])
        else:
            rows.append([name, "", "", *torques, "", ""])
    return rows


# --- kinematic series, forces and orders of the notes ---------------------------------------------

RATIOS = (0.2, 1.0 / 3.0, 0.5)


def coefficient_table() -> Rows:
    """Printed polynomials beside the exact coefficients, at three crank ratios."""
    rows = [["coefficient", "source"]]
    for ratio in RATIOS:
        rows[0] += [f"printed, lambda {ratio:.4g}", "exact"]
    for row in read_reference("kinematic_series.csv"):
        function = getattr(series, f"{row['function']}_coefficients")
        terms = [term.split(": ") for term in row["powers and factors"].split("; ")]
        sign = -1.0 if row["function"] == "position" else 1.0
        cells = [row["name"], row["source"]]
        for ratio in RATIOS:
            printed = sum(float(Fraction(factor)) * ratio ** int(power) for power, factor in terms)
            exact = sign * float(function(int(row["order"]), ratio))
            cells += [f"{printed:.6f}", f"{exact:.6f}"]
        rows.append(cells)
    return rows


def truncation_table() -> Rows:
    """Errors of the truncated series over lambda, and Mosakowski (16) evaluated as printed."""
    rows = [["lambda", "text", "(16)"]]
    for what in ("acceleration", "velocity", "travel"):
        rows[0] += [f"{what}, to order 2", "to order 4"]
    for ratio in np.arange(0.10, 0.71, 0.05):
        printed = ratio / (1.0 + ratio) * (1.0 / math.sqrt(1.0 - ratio**2) - 1.0)
        errors = [
            float(series.truncation_error(ratio, highest, derivative))
            for derivative in (2, 1, 0)
            for highest in (2, 4)
        ]
        bound = {"0.30": "slightly over 1", "0.50": "over 5"}.get(f"{ratio:.2f}", "")
        cells = (f"{100.0 * error:.4f}" for error in (printed, *errors))
        rows.append([f"{ratio:.2f}", bound, *cells])
    return rows


def work_table() -> Rows:
    """Means of the tangential pressure against p_i/pi and p_i/(2 pi), of two engines."""
    rows = [["engine", "notes", "bar", "tangential_pressure_mean", "mean of the curve"]]
    names = ["tangential_pressure", "tangential_pressure_mean", "imep"]
    for engine, turns, text in (("marine_80x345", 1, "p_i/π"), ("ntua", 2, "p_i/(2 π)")):
        found = sweeps.run(engine=engine, output={"quantities": names, "angle_step": 0.25})
        values = (float(found["imep"]) / (math.pi * turns), found[names[1]], found[names[0]].mean())
        rows.append([engine, text, *(f"{float(value):.4f}" for value in values)])
    return rows


def largest_gravity_torques() -> tuple[float, float]:
    """Gravity torque of a cylinder of `ntua` [N m], and with the misprint of the notes in it."""
    found = run("ntua", ["gravity_torque"])
    phi = np.radians(found["crank_angle"].values)
    reciprocating = 4.97 + 6.33 * 0.094 / 0.350
    velocity = slider_crank.velocity(phi, 0.09 / 0.350)
    printed = 9.80665 * 0.09 * reciprocating * (velocity + np.sin(phi))
    return float(np.abs(found["gravity_torque"]).max()), float(np.abs(printed).max())


def rod_table() -> Rows:
    """Error of the two-mass rod over the rod's moment of inertia, for the NTUA engine."""
    two, shares = 6.33 * 0.094 * 0.256, (0.7, 0.8, 0.9, 1.0, 1.1)
    names = ["rod_torque_error", "rod_thrust_error"]
    found = run("ntua", names, axes={"rod_inertia": [share * two for share in shares]})
    rows = [["rod over two masses", "kg m2", "inertia torque, %", "wall thrust of inertia, %"]]
    for share, *errors in zip(shares, *(found[name].values for name in names), strict=True):
        cells = (f"{100.0 * error:.2f}" for error in errors)
        rows.append([f"{share:.1f}", f"{share * two:.4f}", *cells])
    return rows


def kinematics_errors() -> Rows:
    """Errors of other sources in formulas that the code uses, against finite differences."""
    phi, ratio, step = math.radians(60.0), load_engine("ntua").values["crank_ratio"], 1e-4
    ahead, here, behind = (
        float(slider_crank.position(phi + shift, ratio)) for shift in (step, 0.0, -step)
    )
    first, second = (ahead - behind) / (2.0 * step), (ahead - 2.0 * here + behind) / step**2
    sine, cosine, double = math.sin(phi), math.cos(phi), math.cos(2.0 * phi)
    root = math.sqrt(1.0 - (ratio * sine) ** 2)
    half = 0.25 * ratio**2 * math.sin(2.0 * phi) ** 2
    share = ratio / (1.0 + ratio)
    found = {
        "piston velocity, Rakopoulos notes": (
            first, float(slider_crank.velocity(phi, ratio)), sine * (1.0 + ratio * cosine) / root,
        ),
        "piston acceleration, Rakopoulos notes": (
            second, float(slider_crank.acceleration(phi, ratio)),
            cosine + ratio * (double + ratio**2 * sine**2) / root**3,
        ),
        "harmonics above the second over the greatest acceleration, Mosakowski (14)": (
            (second - cosine - ratio * double) / (1.0 + ratio),
            share * (double / root + half / root**3 - double),
            share * (double / root + half / root - double),
        ),
    }  # fmt: skip
    heads = [f"at 60°, lambda = {ratio:.4f}", "finite differences", "right", "printed"]
    return [heads, *([name, *(f"{value:.5f}" for value in one)] for name, one in found.items())]


# --- textbook cycles ------------------------------------------------------------------------------

HEAT_OF_OTTO = (2000.0 / 300.0 - 8.0 ** (GAMMA - 1.0)) / (GAMMA - 1.0)
"""Heats from 300 K and a ratio of 8 up to 2000 K: Moran and Shapiro's engine of 540 and 3600 R."""


def ideal(ratio: float, heat: float, start: float, duration: float, form: float) -> Textbook:
    """Our cycle: closed from dead centre to dead centre, constant gamma, no loss.

    The rod is so long that the piston's way is a cosine, within 3e-5 of the stroke. `heat` is over
    pressure and volume at the start of the compression; start and duration are in degrees.
    """
    model = FourStrokeCycle(
        compression_ratio=ratio, crank_ratio=1e-4, intake_pressure=1e5,
        exhaust_pressure=1e5, charge_temperature=300.0, heat=0.0,
        combustion_start=start * DEGREE, combustion_duration=duration * DEGREE,
        combustion_form=form, wiebe_factor=5.0, gamma_300=GAMMA, gamma_slope=0.0,
        valve_ramp=20.0 * DEGREE, valve_lag=2.0 * DEGREE, intake_loss=0.0, exhaust_loss=0.0,
        intake_closing=-179.999 * DEGREE, exhaust_opening=179.999 * DEGREE,
    )  # fmt: skip

    def tabulated(one: FourStrokeCycle) -> Any:
        return tabulate(FourStrokeCycle, {f.name: getattr(one, f.name) for f in fields(one)}, 0.25)

    first = float(tabulated(model).trapped_pressure)
    found = tabulated(replace(model, heat=heat * first * ratio / (ratio - 1.0)))
    trapped, work = float(found.trapped_pressure), float(found.work)
    largest = float(found.pressure.max())
    return Textbook(largest / trapped, work / trapped, work / float(found.heat))


def textbook_table() -> Rows:
    """Textbook results of ideal cycles, with the computed ones."""
    rows = [["cycle", "p_max/p_1", "computed", "mean/p_1", "computed", "efficiency", "computed"]]
    cases = [
        (f"constant volume; ours burns over {duration:g}°", otto(8.0, HEAT_OF_OTTO),
         (8.0, HEAT_OF_OTTO, -0.5 * duration, duration, 2.0))
        for duration in (16.0, 8.0, 4.0)
    ]  # fmt: skip
    for start in (-20.0, 0.0):
        case = (10.0, 20.0, start, 40.0, 2.0)
        cases.append((f"finite release from {start:g}°", finite_release(*case), case))
    for what, given, case in cases:
        pairs = zip(given, ideal(*case), strict=True)
        rows.append([what, *(f"{value:.5g}" for pair in pairs for value in pair)])
    return rows


# --- all sources ----------------------------------------------------------------------------------


def tables() -> dict[str, Rows]:
    """Tables of docs/validation.md by the names of their files."""
    archive = sweeps.run("asgari")
    return {
        "asgari": asgari_table(archive),
        "asgari_shafts": shaft_table(archive),
        "asgari_inertia": flywheel_table(archive),
        "asgari_shaft_13": shaft_13_table(),
        "asgari_table_2": shaft_torque_table(sweeps.run("asgari_flywheel")),
        "lecture_resultants": lecture_table(),
        "lecture_irregularity": irregularity_table(),
        "lecture_characteristic": characteristic_table(),
        "series_coefficients": coefficient_table(),
        "series_errors": truncation_table(),
        "tangential_means": work_table(),
        "rod": rod_table(),
        "kinematics_errors": kinematics_errors(),
        "textbook_cycles": textbook_table(),
    }


def values() -> dict[str, str]:
    """Numbers of docs/validation.md."""
    gear = balance.running_gear(
        even_cylinders(1, 4.0 * math.pi), 0.0355 / 0.1175, 0.0355, 0.841, SPEED
    )
    truncated = run(
        "marine_80x345",
        ["acceleration_truncation_error", "acceleration"],
        axes={"truncation": [2, 4]},
    )
    two, four = (100.0 * float(e) for e in truncated["acceleration_truncation_error"])
    gravity, misprinted = largest_gravity_torques()
    engine = load_engine("diesel_105x137")
    diagram = engine.family.diagrams[-1]
    angle = np.arange(7200) * (diagram.period / 7200) - 0.5 * diagram.period
    speed = slider_crank.velocity(angle, engine.values["crank_ratio"])
    imep = 0.5 * diagram.period * float((diagram(angle) * speed).mean())
    triangle = flywheel.triangular_torque(7000.0, SPEED, 0.04)
    return {
        "triangle_swing": f"{float(triangle.energy_swing):.1f}",
        "second_harmonic": f"{SECOND:.5f}",
        "best_rms": f"{float(gear.best_fraction('rms')):.3f}",
        "best_peak": f"{float(gear.best_fraction('peak')):.3f}",
        "marine_two": f"{two:.2f}",
        "marine_four": f"{four:.2f}",
        "gravity": f"{gravity:.3f}",
        "gravity_misprinted": f"{misprinted:.3f}",
        "measured_peak": f"{diagram.peak / 1e5:.4g}",
        "measured_imep": f"{imep / 1e5:.4g}",
    }
