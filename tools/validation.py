"""Write docs/validation.md: what the sources print beside what this project computes.

Every number that Kakaitsas (2015) prints stands beside ours twice: as published (the thesis's own
procedure, start and number of cycles) and as it is (the periodic solution). Then come the errors
printed in the sources, what the thesis's procedure does when it is run for longer, and how far the
solver is from an independent one. The words are in tools/validation.md.in, the tables are made
here and written as CSV files into docs/validation, the numbers come from tools/thesis_study.py.

Run it from the project's root: `python tools/validation.py`. It is deterministic. It also draws
docs/figures; `--no-figures` leaves them alone.
"""

from __future__ import annotations

import argparse
import math
import re
import shutil
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import balance_study
import calibrate_ntua
import cycle_study
import mechanism_study
import numpy as np
import smooth_digitised
from csv_tables import as_csv, rows_of
from thesis_study import (
    AGREEMENT,
    CUT_SPEED,
    MOST_CYCLES,
    PERIOD,
    ROOT,
    SLIP,
    SPEEDS,
    WITHOUT_SPEED,
    Agreement,
    Drift,
    Printed,
    Study,
    differences,
    displacement,
    misfit_over_cycles,
    nominal_speed,
    ntua,
    other_values,
    percent,
    range_of,
    range_of_delta,
    read_printed,
    read_reference,
    run_agreement,
    run_all_rows,
    run_drift,
    run_study,
    thesis_scene,
    worst_of_limits,
)

import sweeps
from engine_dyn.geometry import slider_crank
from engine_dyn.units import BAR, DEGREE, RPM
from sweeps.reading.engine_files import load_engine

TEMPLATE = Path(__file__).with_suffix(".md.in")
ITEMS = Path(__file__).with_name("source_items.md")
DOCUMENT = ROOT / "docs" / "validation.md"
ROWS = ROOT / "docs" / "validation"
FIGURES = ROOT / "docs" / "figures"

FITTED = " †"
CYCLES = (1, 10, 100, 1000, 5000, 10000, 20000)
NAMED = 0.5  # percent: larger differences are listed

FIGURES_OF_FIT = {
    0: ("p_max, bar", "mean torque, N m", *(f"{name}, rad/s" for name in SPEEDS)),
    50: ("p_max, bar", "mean torque, N m", "M_max, N m", "M_max - M_min, N m",
         "omega_max - omega_min, rad/s", "p_min, bar"),
    90: ("p_max, bar", *(f"{name}, rad/s" for name in SPEEDS)),
}  # fmt: skip
"""What the calibration script's figures are called here, in its order."""

TEXTBOOK_HEADS = (
    "cycle", "p_max/p_1", "computed", "mean/p_1", "computed", "efficiency", "computed",
)  # fmt: skip

REASONS = {
    "torque_ratio": "the diagram's shape; the mean torque is fitted",
    "torque_range": "the diagram's shape",
    "delta": "the diagram's shape, as for the torque range of the same engine",
}
"""What is known about differences of a quantity in the rows with several cylinders."""

# --- text -----------------------------------------------------------------------------------------


def signed(value: float, decimals: int = 2) -> str:
    """Write a number with its sign; a zero has none."""
    text = f"{value:+.{decimals}f}"
    return f"{abs(float(text)):.{decimals}f}" if float(text) == 0.0 else text


def decimals_of(text: str) -> int:
    """Return how many decimals a printed number has."""
    return len(text.partition(".")[2])


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], *, numbers: bool = True) -> str:
    """Write a Markdown table; columns of numbers, all but the first, stand to the right."""
    lines = [heads, ["---", *["---:" if numbers else "---"] * (len(heads) - 1)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def worst(text: str, *columns: int, fitted: bool = False) -> str:
    """Largest difference of a table, with the row it is in.

    Columns are counted among those of differences, all by default. Numbers that are marked as
    fitted are left out unless they are asked for.
    """
    heads, *rows = rows_of(text)
    percents = [place for place, head in enumerate(heads) if head == "%"]
    percents = [percents[column] for column in columns] or percents
    found = [
        (abs(float(row[place])), row[place], row[0])
        for row in rows
        for place in percents
        if row[place] and (fitted or FITTED not in row[place - 1])
    ]
    _, value, name = max(found)
    return f"{value} % ({name})"


def count(text: str, *columns: int) -> str:
    """How many differences a table has in these columns of them, all by default."""
    heads, *rows = rows_of(text)
    percents = [place for place, head in enumerate(heads) if head == "%"]
    percents = [percents[column] for column in columns] or percents
    return str(sum(bool(row[place]) for row in rows for place in percents))


def row_count(text: str) -> str:
    """How many rows a table has."""
    return str(len(rows_of(text)) - 1)


def mark(printed: Printed, case: str, quantity: str) -> str:
    """Return the mark of a fitted number."""
    return FITTED if (case, quantity) in printed.fitted else ""


# --- the thesis's tables --------------------------------------------------------------------------


def fitted_table() -> str:
    """Figures that the diagrams were calibrated to, and what the catalogue engine gives."""
    family = ntua().family
    goals = calibrate_ntua.targets()
    rows = []
    for load, diagram in zip(family.loads, family.diagrams, strict=True):
        names = FIGURES_OF_FIT[round(load)]
        got = calibrate_ntua.MEASURES[round(load)](diagram)
        for name, goal, value in zip(names, goals[round(load)], got, strict=True):
            # The mean torque at idle is zero to rounding, of either sign.
            rows.append(
                [f"{load:g} %", name, f"{goal:.4f}", f"{value:.4f}".replace("-0.0000", "0.0000")]
            )
    return table(["load", "figure", "target", "fitted"], rows)


def delta_table(study: Study, printed: Printed) -> str:
    rows = []
    for case in study.cases:
        reference = printed.number(case, "delta")
        cells = [case, printed.rows[case]["delta"], f"{reference:.5f}"]
        for which in ("published", "periodic", "gauge"):
            value = study.at(which, "delta", case)
            fitted = mark(printed, case, "delta") if which == "published" else ""
            cells += [f"{value:.5f}{fitted}", signed(percent(value, reference))]
        rows.append(cells)
    heads = ["design", "printed", "from printed omegas", "as published", "%", "periodic", "%"]
    return table([*heads, "periodic, gauge pressure", "%"], rows)


def speed_table(study: Study, printed: Printed, which: str) -> str:
    rows = []
    for case in study.cases:
        cells = [case]
        for name in SPEEDS:
            value = study.at(which, name, case)
            fitted = mark(printed, case, name) if which == "published" else ""
            off = percent(value, printed.number(case, name))
            cells += [printed.rows[case][name], f"{value:.3f}{fitted}", signed(off, 3)]
        rows.append(cells)
    return table(
        ["design", *(h for name in SPEEDS for h in (f"{name} printed", "computed", "%"))], rows
    )


def start_table(study: Study, printed: Printed) -> str:
    """Printed speed at the start of the last cycle: ours at the firing dead centre."""
    omega = study.published["omega"].sel(crank_angle=0.0).values
    rows = []
    for case in study.several():
        text = printed.rows[case].get("omega_start")
        if text:
            value = float(omega[study.cases.index(case)])
            rows.append([case, text, f"{value:.3f}", signed(percent(value, float(text)), 3)])
    return table(["design", "printed", "as published", "%"], rows)


def change_table(study: Study, printed: Printed) -> str:
    """Tables 5.3 and 5.4: changes against the nominal design [percent]."""
    rows = []
    for case in study.cases:
        cells = [case]
        for quantity in ("delta", "omega_max", "omega_mean"):
            text = printed.rows[case].get(f"d_{quantity}_percent", "")
            values = [
                percent(study.at(which, quantity, case), study.at(which, quantity, "nominal"))
                for which in ("published", "periodic")
            ]
            if quantity == "delta":
                own = (printed.number(one, quantity) for one in (case, "nominal"))
                values.insert(0, percent(*own))
            shown = [signed(value, decimals_of(text)) if text else "" for value in values]
            if text:
                shown[-2] += mark(printed, case, quantity)
            cells += [text and signed(float(text), decimals_of(text)), *shown]
        if any(cells[1:]):
            rows.append(cells)
    heads = ["design", "delta printed", "from printed omegas", "as published", "periodic"]
    for name in ("omega_max", "omega_mean"):
        heads += [f"{name} printed", "as published", "periodic"]
    return table(heads, rows)


def torque_table(study: Study, printed: Printed) -> str:
    rows = []
    for case in study.cases:
        if "torque_range" not in printed.rows[case]:
            continue
        cells = [case]
        sampled = study.sampled_torque(case)
        for name, decimals in (("torque_ratio", 3), ("torque_range", 2)):
            curve, gauge = (study.at(which, name, case) for which in ("periodic", "gauge"))
            off = percent(sampled[name], printed.number(case, name))
            cells += [
                printed.rows[case][name],
                f"{sampled[name]:.{decimals}f}{mark(printed, case, name)}",
                signed(off),
                f"{curve:.{decimals}f}",
                f"{gauge:.{decimals}f}",
            ]
        rows.append(cells)
    heads = ["design"]
    for name in ("M_max/M_mean", "M_max - M_min (N m)"):
        heads += [f"{name} printed", "as published", "%", "of the curve", "gauge pressure"]
    return table(heads, rows)


def all_rows_table(study: Study, fitted: Study, printed: Printed) -> str:
    """Rows at 50 % load: what the modelled cycle predicts, and what the fitted curve gives."""
    rows = []
    for case in fitted.cases:
        for quantity in ("delta", "torque_ratio", "torque_range"):
            if quantity != "delta" and quantity not in printed.rows[case]:
                continue
            reference = printed.number(case, quantity)
            cells = [case, f"`{quantity}`", f"{reference:.6g}"]
            for one in (study, fitted):
                value = (
                    one.at("published", quantity, case)
                    if quantity == "delta"
                    else one.sampled_torque(case)[quantity]
                )
                own = mark(printed, case, quantity) if one is study else FITTED
                cells += [f"{value:.6g}{own}", signed(percent(value, reference))]
            rows.append(cells)
    heads = ["design", "number", "printed", "`ntua`", "%", "`ntua_all_rows`", "%"]
    return table(heads, rows)


def correction_table() -> str:
    """Correction of the pressure that the fit to all rows needs [bar]."""
    (fitted,) = load_engine("ntua_all_rows", Path()).family.diagrams
    modelled = ntua().family.diagrams[list(ntua().family.loads).index(50.0)]
    rows = []
    for degrees in (-150, -90, -60, -30, -10, 0, 10, 20, 40, 60, 90, 130, 150, 160, 170, 180, 190):
        one, other = (
            float(np.interp(degrees * DEGREE, d.angle, d.pressure)) / BAR
            for d in (modelled, fitted)
        )
        rows.append([str(degrees), f"{one:.2f}", f"{other:.2f}", f"{other - one:+.2f}"])
    return table(["degrees", "`ntua`", "`ntua_all_rows`", "difference"], rows)


def other_table(study: Study, printed: Printed) -> str:
    values = other_values(study)
    rows = []
    for row in read_reference("kakaitsas_other_numbers.csv"):
        text, value = row["printed"], values[row["name"]]
        # One digit more than is printed, so that cutting and rounding can be told apart.
        ours = f"{value:.{decimals_of(text) + 1}f}{mark(printed, 'nominal', row['name'])}"
        unit = "" if row["unit"] == "1" else row["unit"]
        off = signed(percent(value, float(text)))
        rows.append([row["what"], row["section"], text, ours, unit, off])
    return table(["number", "section", "printed", "computed", "unit", "%"], rows)


# --- what does not agree --------------------------------------------------------------------------


def overlap(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether two ranges have a value in common."""
    return one[0] <= other[1] and other[0] <= one[1]


def contradictions(printed: Printed) -> str:
    """Rows whose printed numbers contradict each other, whatever was cut or rounded."""
    nominal = printed.rows["nominal"]
    rows = []
    for case, row in printed.rows.items():
        own = printed.number(case, "delta")
        if not overlap(range_of(row["delta"]), range_of_delta(row)):
            rows.append([case, "delta", row["delta"], f"{own:.5f}", "its own omegas, (3.6)"])
        for name in ("delta", "omega_max", "omega_mean"):
            text = row.get(f"d_{name}_percent")
            if not text:
                continue
            one, base = (
                range_of_delta(r) if name == "delta" else range_of(r[name]) for r in (row, nominal)
            )
            if overlap(range_of(text), (percent(one[0], base[1]), percent(one[1], base[0]))):
                continue
            right = percent(printed.number(case, name), printed.number("nominal", name))
            why = "the printed omegas"
            short = percent(float(row[name]), float(nominal[name]))
            if name == "delta" and signed(short) == signed(float(text)):
                why += f"; the deltas as printed give {signed(short)}"
            rows.append([case, f"change of {name}, %", text, signed(right), why])
    return table(["row", "number", "printed", "should be", "according to"], rows, numbers=False)


def large_differences(study: Study, printed: Printed) -> str:
    rows = []
    for one in differences(study, printed):
        if abs(one.percent) > NAMED:
            known = REASONS.get(one.quantity) if one.case in study.several() else None
            rows.append(
                [one.case, f"`{one.quantity}`", signed(one.percent), known or "not explained"]
            )
    return table(["row", "number", "%", "cause"], rows, numbers=False)


def limit_table(study: Study, printed: Printed) -> str:
    rows = [
        ["; ".join(cases), f"{limit:g}", signed(worst), "yes" if abs(worst) <= limit else "**no**"]
        for cases, limit, worst in worst_of_limits(study, printed)
    ]
    heads = ["predicted rows", "limit, %", "largest difference of delta, %", "met"]
    return table(heads, rows, numbers=False)


def procedure_table(study: Study) -> str:
    """What each part of the thesis's procedure does to delta."""
    cases = ("nominal", "inertia 0.5", "inertia 12", "speed 4000", "2 cylinders", "8 cylinders")
    ways = (
        ("as made", "as_made"),
        ("as published: the scene `thesis`", "published"),
        ("explicit Euler until a cycle closes within 1e-6 rad/s", "repeated"),
        ("periodic", "periodic"),
        ("periodic, gauge pressure", "gauge"),
    )
    rows = [
        [label, *(f"{study.at(which, 'delta', case):.5f}" for case in cases)]
        for label, which in ways
    ]
    return table(["delta", *cases], rows)


def cycles_table(study: Study, printed: Printed) -> str:
    """Find the number of cycles that meets the printed omegas of several cylinders best."""
    rows = []
    for case in study.several():
        used = int(study.at("published", "passes", case))
        cells = [case, str(used)]
        for cut_speed in (True, False):
            misfit = misfit_over_cycles(case, printed, cut_speed=cut_speed)
            best = int(np.argmin(misfit)) + 1
            count = f"{best} or more" if best == MOST_CYCLES else str(best)
            cells += [count, f"{misfit[best - 1]:.3f}", f"{misfit[used - 1]:.3f}"]
        rows.append(cells)
    heads = ["design", "in the scene"]
    for way in ("as made", "as published"):
        heads += [f"{way}: best", "difference", "with the scene's"]
    return table(heads, rows)


def worth_of_cycles(study: Study) -> str:
    """Say what stopping after the scene's number of cycles does to delta of 4 to 8 cylinders."""
    cases = [case for case in study.several() if int(case[0]) >= 4]
    off = {
        which: [
            percent(study.at("published", "delta", case), study.at(which, "delta", case))
            for case in cases
        ]
        for which in ("repeated", "periodic")
    }
    ranges = {which: f"{signed(min(o))} to {signed(max(o))} %" for which, o in off.items()}
    return (
        f"it differs by {ranges['repeated']} from the same procedure repeated until the cycle "
        f"closes, and by {ranges['periodic']} from the steady state"
    )


def cut_means(study: Study, printed: Printed) -> str:
    """Say how far mean speeds of several cylinders are off, with omega_n as it is and cut."""
    found = []
    for which in ("published", "as_made"):
        off = [
            percent(study.at(which, "omega_mean", c), printed.number(c, "omega_mean"))
            for c in study.several()
        ]
        found.append(f"{signed(min(off), 3)} to {signed(max(off), 3)} %")
    return f"{found[1]} instead of {found[0]}"


# --- errors printed in the sources ----------------------------------------------------------------


def thesis_errors(study: Study, printed: Printed) -> str:
    """Formulas of Kakaitsas that this project uses: right against printed, with numbers."""
    own, values = ntua().values, other_values(study)
    one_pass: dict[str, Any] = {"method": "thesis", "passes": 1, "start_speed": CUT_SPEED}
    short, third = (
        nominal_speed(crank_ratio=ratio, reciprocating_mass=6.95, **one_pass).delta
        for ratio in (0.300, 1.0 / 3.0)
    )
    straight = nominal_speed(**one_pass).delta
    slipped = nominal_speed(inertia=own["inertia"] * SLIP * DEGREE, **one_pass).delta
    top = float(slider_crank.acceleration(0.0, own["crank_ratio"]))
    radius, phi = 0.5 * own["stroke"], math.radians(60.0)
    rod_angle = math.asin(own["crank_ratio"] * math.sin(phi))
    thrust = 1e3 * math.tan(rod_angle)
    height = radius * (math.cos(phi) + math.cos(rod_angle) / own["crank_ratio"])
    tangential = 1e3 * float(slider_crank.velocity(phi, own["crank_ratio"]))
    force = values["reciprocating_mass"] * 0.5 * own["stroke"] * (own["speed"] * RPM) ** 2 * top
    rows = [
        (
            "section 4.1, rotating mass",
            "m_r = 1.00 - 4.63 = 5.63 kg",
            "m_r = 1.00 + 4.63",
            f"the difference is {own['crank_mass'] - values['rod_mass_at_crank']:.2f} kg, the sum "
            f"{values['rotating_mass']:.2f} kg",
        ),
        (
            "(4.2b)",
            f"{SLIP}",
            f"180/π = {1.0 / DEGREE:.4f}",
            f"{SLIP} is 180/3.14 = {180.0 / 3.14:.4f}; the step becomes "
            f"{signed(percent(1.0 / SLIP, DEGREE), 4)} %, delta of the nominal row {slipped:.5f} "
            f"instead of {straight:.5f} ({signed(percent(slipped, straight), 3)} %)",
        ),
        (
            "section 5.2.3, rod of 300 mm",
            "lambda = 1/3",
            "90/300 = 0.300",
            f"delta {short:.5f} with 0.300 and {third:.5f} with 1/3, both with 6.95 kg; the "
            f"printed omegas give {printed.number('lambda 1/3', 'delta'):.5f}: they were "
            "computed with 1/3 and 6.95 kg, which belong to different rods",
        ),
        (
            "section 2.2.1",
            "P'_l = P_l = m b",
            "P'_l = m b = -P_l",
            f"at top dead centre the piston is pulled with {force / 1e3:.2f} kN and pulls with "
            f"{-force / 1e3:.2f} kN; (2.12) itself has the right sign",
        ),
        (
            "(2.8)",
            "M_a = N H = -M_σ",
            "M_a = -N H = -M_σ",
            f"(2.7) with (2.2) gives N H = M_σ: at 60° a force of 1 kN on the piston has "
            f"N H = {thrust * height:.3f} N m and T r = {tangential * radius:.3f} N m",
        ),
        (
            "(3.5) and section 4.3.2",
            "k = 0.00741 N m s",
            "0.00741 N m s²",
            f"{values['load_coefficient'] * CUT_SPEED**2:.1f} N m over {CUT_SPEED:g}², because "
            f"α = 2; N m s is the unit for α = 1, where k is "
            f"{values['load_coefficient'] * CUT_SPEED:.3f}",
        ),
        (
            "section 5.4.2",
            "refers to (5.5)",
            "(5.1)",
            "720°/4; the last equation of the chapter is (5.3)",
        ),
        (
            "(3.8) evaluated in 4.3",
            "1.486 · 0.0027/(4 · 3.14) = 32.776",
            "1.486e5 · 0.0027709/(4 π)",
            f"as printed {1.486 * 0.0027 / (4.0 * 3.14):.3e}; with V_h = {displacement():.7f} m³ "
            f"and 1e5 Pa/bar {1.486 * BAR * displacement() / PERIOD:.3f} N m, with the unrounded "
            f"fmep {values['friction_torque_50']:.3f} N m",
        ),
    ]
    for case in ("6 cylinders", "8 cylinders", "8 cylinders, inertia 5"):
        row = printed.rows[case]
        low, high = range_of_delta(row)
        cut = overlap(range_of(row["delta"]), (low, high))
        verdict = "the printed value is cut" if cut else "neither cut nor rounded"
        rows.append(
            (
                f"section 5.4, {case}",
                f"delta = {row['delta']}",
                f"{printed.number(case, 'delta'):.5f}",
                f"the omegas of the same line give {low:.5f} to {high:.5f}: {verdict}",
            )
        )
    return table(["where", "printed", "right", "numbers"], rows, numbers=False)


def kinematics_errors() -> str:
    """Errors of other sources in formulas that the code uses, against finite differences."""
    phi, ratio, step = math.radians(60.0), ntua().values["crank_ratio"], 1e-4
    ahead, here, behind = (
        float(slider_crank.position(phi + shift, ratio)) for shift in (step, 0.0, -step)
    )
    first, second = (ahead - behind) / (2.0 * step), (ahead - 2.0 * here + behind) / step**2
    sine, cosine, double = math.sin(phi), math.cos(phi), math.cos(2.0 * phi)
    root = math.sqrt(1.0 - (ratio * sine) ** 2)
    half = 0.25 * ratio**2 * math.sin(2.0 * phi) ** 2
    share = ratio / (1.0 + ratio)
    rows = [
        (
            "piston velocity, Rakopoulos notes",
            first,
            float(slider_crank.velocity(phi, ratio)),
            sine * (1.0 + ratio * cosine) / root,
        ),
        (
            "piston acceleration, Rakopoulos notes",
            second,
            float(slider_crank.acceleration(phi, ratio)),
            cosine + ratio * (double + ratio**2 * sine**2) / root**3,
        ),
        (
            "harmonics above the second over the greatest acceleration, Mosakowski (14)",
            (second - cosine - ratio * double) / (1.0 + ratio),
            share * (double / root + half / root**3 - double),
            share * (double / root + half / root - double),
        ),
    ]
    heads = [f"at 60°, lambda = {ratio:.4f}", "finite differences", "right", "printed"]
    return table(heads, [[name, *(f"{value:.5f}" for value in found)] for name, *found in rows])


def work_of_a_cycle(study: Study) -> str:
    """Say what the work of a cycle tells about the error of the Rakopoulos notes in it."""
    work = study.at("published", "imep", "nominal") * BAR * displacement()
    torque = sum(study.at("published", n, "nominal") for n in ("torque_mean", "friction_torque"))
    return (
        f"The work of a cycle of the nominal row is p_i V_h = {work:.1f} J. The mean indicated "
        f"torque times 4 π gives {torque * PERIOD:.1f} J. Times 2 π, as printed in the Rakopoulos "
        f"notes, it would give {torque * 0.5 * PERIOD:.1f} J."
    )


def other_errors() -> str:
    rows = [
        [row["document"], row["place"], row["printed"], row["right"], row["used"] or "later work"]
        for row in read_reference("errata.csv")
    ]
    return table(["document", "where", "printed", "right", "used here by"], rows, numbers=False)


# --- the procedure for longer, and the independent solver -----------------------------------------


def repetition_table() -> str:
    """Cycles until explicit Euler closes within 1e-6 rad/s, and what it closes at."""
    designs: dict[str, dict[str, float]] = {
        "nominal": {},
        "inertia 0.5 kg m2": {"inertia": 0.5},
        "inertia 12 kg m2": {"inertia": 12.0},
        "4000 rpm": {"rpm": 4000.0},
        "load exponent 1": {"load_exponent": 1.0},
    }
    rows = []
    for label, changes in designs.items():
        euler, exact = nominal_speed(method="thesis", **changes), nominal_speed(**changes)
        cells = [label, str(euler.iterations)]
        cells += [f"{one.omega_mean:.3f}" for one in (euler, exact)]
        cells += [f"{one.delta:.5f}" for one in (euler, exact)]
        rows.append([*cells, signed(percent(euler.delta, exact.delta))])
    heads = ["design", "cycles", "omega_mean, Euler", "periodic", "delta, Euler", "periodic", "%"]
    return table(heads, rows)


def drift_table(drift: Drift) -> str:
    columns = (drift.cycles, drift.mean, drift.predicted, drift.delta)
    rows = [
        [str(count), f"{mean:.2f}", f"{expected:.2f}", f"{delta:.4f}"]
        for count, mean, expected, delta in zip(*columns, strict=True)
    ]
    return table(["cycles", "omega_mean (rad/s)", "by the energy added (rad/s)", "delta"], rows)


def agreement_table(groups: Sequence[Agreement]) -> str:
    rows = []
    for group in groups:
        worst = [f"{group.worst[q]:.0e}" if group.group != WITHOUT_SPEED else "" for q in AGREEMENT]
        rows.append([group.group, str(group.designs), str(group.same_outcome), *worst])
    rows.append(["allowed", "", "all", *(f"{limit:.0e}" for limit in AGREEMENT.values())])
    return table(["designs", "number", "same outcome", *(f"`{q}`" for q in AGREEMENT)], rows)


# --- the document ---------------------------------------------------------------------------------


def filled(template: str, values: Mapping[str, str]) -> str:
    """Put values in the places of a template, all of them and each at least once."""
    text = re.sub(r"\{\{ (\w+) \}\}", lambda place: values[place[1]], template)
    unused = set(values) - set(re.findall(r"\{\{ (\w+) \}\}", template))
    if unused:
        raise KeyError(f"no place in the template for {', '.join(sorted(unused))}")
    return text


def tables(
    study: Study, printed: Printed, drift: Drift, agreement: Sequence[Agreement]
) -> dict[str, str]:
    """Tables by the names of their files, in Markdown."""
    return {
        "fitted": fitted_table(),
        "delta": delta_table(study, printed),
        "limits": limit_table(study, printed),
        "speeds": speed_table(study, printed, "published"),
        "start_speeds": start_table(study, printed),
        "periodic_speeds": speed_table(study, printed, "periodic"),
        "changes": change_table(study, printed),
        "torques": torque_table(study, printed),
        "other_numbers": other_table(study, printed),
        "contradictions": contradictions(printed),
        "large_differences": large_differences(study, printed),
        "all_rows": all_rows_table(study, run_all_rows(), printed),
        "correction": correction_table(),
        "cycles": cycles_table(study, printed),
        "procedure": procedure_table(study),
        "thesis_errors": thesis_errors(study, printed),
        "series_coefficients": mechanism_study.coefficient_table(),
        "series_errors": mechanism_study.truncation_table(),
        "tangential_means": mechanism_study.work_table(),
        "smoothing": smooth_digitised.effect_table(),
        "rod": mechanism_study.rod_table(),
        "textbook_cycles": table(TEXTBOOK_HEADS, cycle_study.rows()),
        "kinematics_errors": kinematics_errors(),
        "errata": other_errors(),
        "repetition": repetition_table(),
        "drift": drift_table(drift),
        "independent_solver": agreement_table(agreement),
        **balance_study.tables(),
    }


def source_items() -> str:
    """Every item of the sources as a CSV file; a link stands as its text and where it leads."""
    heads = ["item", "what the source describes", "covered by", "numbers"]
    text = re.sub(r"\[([^]]+)\]\(([^)]+)\)", r"\1 (\2)", ITEMS.read_text(encoding="utf-8"))
    rows = [line for line in text.splitlines() if re.match(r"\| [KARML]\d", line)]
    return as_csv("\n".join(["| " + " | ".join(heads) + " |", "", *rows]))


def documents(
    study: Study, printed: Printed, drift: Drift, agreement: Sequence[Agreement]
) -> dict[Path, str]:
    """Return the text of docs/validation.md and of the files beside it."""
    predicted = [
        one for one in differences(study, printed) if one.quantity == "delta" and not one.fitted
    ]
    largest = {
        is_several: max(
            abs(one.percent) for one in predicted if (one.case in study.several()) == is_several
        )
        for is_several in (False, True)
    }
    widest = {q: max(group.worst[q] for group in agreement) for q in AGREEMENT}
    met = all(abs(off) <= limit for _, limit, off in worst_of_limits(study, printed))
    made = tables(study, printed, drift, agreement)
    items = source_items()
    repeated = [int(row[1]) for row in rows_of(made["repetition"])[1:]]
    release = [row for row in rows_of(made["textbook_cycles"])[1:] if "release" in row[0]]
    apart = max(
        abs(percent(float(row[n + 1]), float(row[n]))) for row in release for n in (1, 3, 5)
    )
    rod = rows_of(made["rod"])[1:]
    values = {
        "worst_single": f"{largest[False]:.2f}",
        "worst_several": f"{largest[True]:.2f}",
        "limits_met": "met" if met else "**not met**",
        "nominal_periodic": f"{study.at('periodic', 'delta', 'nominal'):.4f}",
        "nominal_printed": printed.rows["nominal"]["delta"],
        "nominal_gauge": f"{study.at('gauge', 'delta', 'nominal'):.4f}",
        "held_out": str(sum(group.designs for group in agreement)),
        "same_outcome": str(sum(group.same_outcome for group in agreement)),
        "worst_delta": f"{widest['delta']:.0e}",
        "worst_mean": f"{widest['omega_mean']:.0e}",
        "worst_delta_table": worst(made["delta"], 0),
        "worst_delta_periodic": worst(made["delta"], 1),
        "worst_delta_gauge": worst(made["delta"], 2),
        **{
            f"worst_{name}": worst(made[file])
            for name, file in {
                "speeds": "speeds", "periodic_speeds": "periodic_speeds",
                "start_speeds": "start_speeds", "torques": "torques", "other": "other_numbers",
                "asgari": "asgari", "flywheel": "asgari_inertia", "repetition": "repetition",
            }.items()
        },
        "worst_all_rows": worst(made["all_rows"], 1, fitted=True),
        **{
            f"count_{name}": count(made[name])
            for name in ("speeds", "periodic_speeds", "start_speeds", "torques", "asgari")
        },
        "count_delta": count(made["delta"], 0),
        "count_other": row_count(made["other_numbers"]),
        "count_shafts": row_count(made["asgari_shafts"]),
        "count_large": row_count(made["large_differences"]),
        **{
            f"count_{name}": row_count(made[name])
            for name in (
                "changes", "contradictions", "fitted", "thesis_errors", "kinematics_errors",
                "errata",
            )
        },
        "count_items": str(len(items.splitlines()) - 1),
        "cut_means": cut_means(study, printed),
        "named": f"{NAMED:g}",
        "most_cycles": str(MOST_CYCLES),
        "worth_of_cycles": worth_of_cycles(study),
        "series_error": mechanism_study.largest_disagreement(),
        "marine_remark": mechanism_study.marine_remark(),
        "gravity_remark": mechanism_study.gravity_remark(),
        "smoothing_delta": next(
            row[-1] for row in rows_of(made["smoothing"]) if "speed fluctuation" in row[0]
        ),
        "worst_rod": " and ".join(f"{max(float(row[n]) for row in rod):g} %" for n in (2, 3)),
        "measured_remark": cycle_study.measured_remark(),
        "worst_release": f"{apart:.3f} %",
        "work_of_a_cycle": work_of_a_cycle(study),
        "fewest_cycles": str(min(repeated)),
        "most_repeated": str(max(repeated)),
        "drift_start": f"{CUT_SPEED:g}",
        "drift_first": f"{drift.mean[0]:.1f}",
        "drift_last": f"{drift.mean[-1]:.1f}",
        "drift_cycles": str(drift.cycles[-1]),
        "no_drift": f"{nominal_speed(load_exponent=0.0).omega_mean:.2f}",
        **balance_study.values(),
    }  # fmt: skip
    return {
        DOCUMENT: filled(TEMPLATE.read_text(encoding="utf-8"), values),
        **{ROWS / f"{name}.csv": as_csv(text) for name, text in made.items()},
        ROWS / "items.csv": items,
    }


# --- figures --------------------------------------------------------------------------------------


def _figure(width: float, height: float) -> tuple[Any, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="0.88", linewidth=0.8)
    axes.set_axisbelow(True)
    return figure, axes


def draw_two_diagrams(path: Path) -> None:
    """Draw the modelled pressure at 50 % load, the one fitted to all rows, and their difference."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    (fitted,) = load_engine("ntua_all_rows", Path()).family.diagrams
    modelled = ntua().family.diagrams[list(ntua().family.loads).index(50.0)]
    degrees = np.rad2deg(modelled.angle)
    figure = Figure(figsize=(7.0, 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for axes in (above, below):
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="0.88", linewidth=0.8)
    above.plot(degrees, modelled.pressure / BAR, color="black", label="ntua: modelled cycle")
    above.plot(
        degrees, fitted.pressure / BAR, color="#b35806", linestyle="--",
        label="ntua_all_rows: fitted to all rows at 50 % load",
    )  # fmt: skip
    above.set_ylabel("pressure in bar")
    above.set_ylim(0.0, 90.0)
    above.legend(frameon=False, loc="upper left", fontsize=9)
    below.plot(degrees, (fitted.pressure - modelled.pressure) / BAR, color="#b35806")
    below.axhline(0.0, color="0.4", linewidth=0.8)
    below.set_ylabel("difference in bar")
    below.set_xlabel("crank angle in degrees from firing dead centre")
    below.set_xlim(-360.0, 360.0)
    below.set_xticks(range(-360, 361, 90))
    figure.savefig(path, dpi=150, metadata={"Software": None})


def draw_drift(path: Path) -> None:
    """Draw the mean speed over cycles of explicit Euler, constant load torque."""
    drift = run_drift([1, *range(500, CYCLES[-1] + 1, 500)])
    square = [
        nominal_speed(method="thesis", passes=count, start_speed=CUT_SPEED).omega_mean
        for count in drift.cycles
    ]
    figure, axes = _figure(7.0, 3.8)
    axes.plot(
        drift.cycles, drift.mean, color="black", marker="o", markersize=3.5, linewidth=1.4,
        label="explicit Euler, constant load torque (α = 0)",
    )  # fmt: skip
    axes.plot(
        drift.cycles, drift.predicted, color="#b35806", linestyle=":", linewidth=2.2,
        label="predicted from the energy that each step adds",
    )  # fmt: skip
    axes.plot(
        drift.cycles, square, color="#542788", linestyle="--", linewidth=1.6,
        label="explicit Euler, load torque as speed squared (α = 2)",
    )  # fmt: skip
    axes.axhline(
        nominal_speed(load_exponent=0.0).omega_mean, color="0.45", linewidth=1.2, linestyle="-.",
        label="periodic solution, α = 0",
    )  # fmt: skip
    axes.set_xlabel("cycles")
    axes.set_ylabel("mean speed $\\omega_m$ (rad/s)")
    axes.set_xlim(0.0, 1.02 * CYCLES[-1])
    axes.legend(frameon=False, loc="upper left", fontsize=8.5)
    figure.savefig(path, dpi=150, metadata={"Software": None})


def draw_differences(study: Study, printed: Printed, path: Path) -> None:
    """Draw the differences of delta from the published one, in three ways."""
    figure, axes = _figure(7.0, 5.6)
    places = np.arange(len(study.cases))
    for label, which, marker, face, edge in (
        ("as published", "published", "o", "black", "black"),
        ("periodic", "periodic", "s", "none", "#542788"),
        ("periodic, gauge pressure", "gauge", "^", "#b35806", "#b35806"),
    ):
        values = [
            percent(study.at(which, "delta", case), printed.number(case, "delta"))
            for case in study.cases
        ]
        axes.plot(
            values, places, linestyle="none", marker=marker, markersize=6.0,
            markerfacecolor=face, markeredgecolor=edge, label=label,
        )  # fmt: skip
    axes.axvline(0.0, color="black", linewidth=0.8)
    labels = [case + mark(printed, case, "delta") for case in study.cases]
    axes.set_yticks(places, labels, fontsize=8.5)
    axes.invert_yaxis()
    axes.set_xlabel("difference of delta from that of the printed omegas (%);  † fitted")
    figure.legend(frameon=False, loc="outside upper center", ncols=3, fontsize=8.5)
    figure.savefig(path, dpi=150, metadata={"Software": None})


def draw_thesis(path: Path) -> None:
    """Draw torque, load torque and speed of the nominal row, as `engine-dyn plot` does."""
    from sweeps.figures import draw

    scene = thesis_scene()
    scene["designs"] = {key: column[:1] for key, column in scene["designs"].items()}
    scene["output"] = {"quantities": ["torque", "load_torque", "omega"]}
    with tempfile.TemporaryDirectory() as folder:
        made = {file.stem: file for file in draw(sweeps.run(scene), folder)}
        shutil.copyfile(made["torque_and_speed"], path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--no-figures", action="store_true", help="leave docs/figures alone")
    with_figures = not parser.parse_args().no_figures
    study, printed = run_study(), read_printed()
    made = documents(study, printed, run_drift(CYCLES), run_agreement())
    ROWS.mkdir(parents=True, exist_ok=True)
    for file in set(ROWS.iterdir()) - set(made):
        file.unlink()
    for file, text in made.items():
        file.write_text(text, encoding="utf-8")
    print(f"written: {DOCUMENT.relative_to(ROOT)} and {len(made) - 1} files beside it")
    if with_figures:
        FIGURES.mkdir(parents=True, exist_ok=True)
        draw_drift(FIGURES / "euler_drift.png")
        draw_differences(study, printed, FIGURES / "delta_differences.png")
        draw_two_diagrams(FIGURES / "ntua_diagrams.png")
        draw_thesis(FIGURES / "torque_and_speed.png")
        balance_study.draw_shaft(FIGURES / "shaking_force.png")
        balance_study.draw_shaft_torques(FIGURES)
        print(f"written: {FIGURES.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
