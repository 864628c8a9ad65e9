"""Write docs/validation.md: what the sources print beside what this project computes.

Every number that Kakaitsas (2015) prints stands beside ours twice: as published (the thesis's own
procedure, start and number of cycles) and as it is (the periodic solution). Then come the errors
printed in the sources, what the thesis's procedure does when it is run for longer, and how far the
solver is from an independent one. The words are in tools/validation.md.in; the tables are made
here and in tools/other_sources.py and written as CSV files into docs/validation; the numbers of the
thesis come from tools/thesis_study.py.

Run it from the project's root: `python tools/validation.py`. It is deterministic. It also draws
docs/figures; `--no-figures` leaves them alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import calibrate_ntua
import numpy as np
import other_sources
import thesis_study as thesis
from other_sources import Rows, signed
from pages import DOCS, csv_rows, csv_text, figures_wanted, filled, sheet, write
from thesis_study import (
    AGREEMENT,
    CUT_SPEED,
    SPEEDS,
    TORQUES,
    Study,
    nominal,
    percent,
    printed,
    printed_rows,
)  # fmt: skip

from engine_dyn.geometry import slider_crank
from engine_dyn.units import BAR, DEGREE, RPM
from sweeps.scene.engine.engine_files import load_engine

TEMPLATE = Path(__file__).with_suffix(".md.in")
ERRORS = Path(__file__).with_name("thesis_errors.csv.in")
DOCUMENT = DOCS / "validation.md"
ROWS = DOCS / "validation"
ITEMS = ROWS / "items.csv"
"""Every item of the sources, with what covers it: the one table that is written by hand."""

MARK = " †"
"""Mark of numbers that are fitted."""

CYCLES = (1, 10, 100, 1000, 5000, 10000, 20000)
NAMED = 0.5  # percent: larger differences are listed
WAYS = {
    "published": "as published",
    "periodic": "periodic",
    "gauge": "periodic, gauge pressure",
}

FIGURES_OF_FIT = {
    0: ("p_max, bar", "mean torque, N m", *(f"{name}, rad/s" for name in SPEEDS)),
    50: ("p_max, bar", "mean torque, N m", "M_max, N m", "M_max - M_min, N m",
         "omega_max - omega_min, rad/s", "p_min, bar"),
    90: ("p_max, bar", *(f"{name}, rad/s" for name in SPEEDS)),
}  # fmt: skip
"""Names here of the calibration script's figures, in its order."""

REASONS = {
    "torque_ratio": "the diagram's shape; the mean torque is fitted",
    "torque_range": "the diagram's shape",
    "delta": "the diagram's shape, as for the torque range of the same engine",
}
"""Known reasons for differences of a quantity in rows with several cylinders."""

# --- text -----------------------------------------------------------------------------------------


def decimals_of(text: str) -> int:
    """Return how many decimals a printed number has."""
    return len(text.partition(".")[2])


def mark(case: str, quantity: str) -> str:
    """Return the mark of a fitted number."""
    return MARK if (case, quantity) in thesis.FITTED else ""


def ours(study: Study, way: str, quantity: str, case: str, form: str, places: int = 2) -> list[str]:
    """A number that we compute, marked where it was fitted, and its difference in percent."""
    text = f"{study.at(way, quantity, case):{form}}"
    fitted = mark(case, quantity) if way == "published" else ""
    return [text + fitted, signed(study.off(way, quantity, case), places)]


def numbers_of(name: str, rows: Rows) -> dict[str, str]:
    """Numbers of a table that the page may use, by name.

    `rows_NAME` says how many rows it has; `count_NAME_1`, how many differences its first column of
    them; `count_NAME`, all of them. `worst_NAME_1` and `worst_NAME` are the largest difference,
    with the row it is in; differences of fitted numbers count only where a column has no others.
    """
    heads, *body = rows
    columns = [place for place, head in enumerate(heads) if head == "%"]
    parts = {f"{name}_{k}": [column] for k, column in enumerate(columns, start=1)}
    found = {f"rows_{name}": str(len(body))}
    for part, places in {name: columns, **parts}.items():
        told = [(row, place) for row in body for place in places if row[place]]
        found[f"count_{part}"] = str(len(told))
        free = [(row, place) for row, place in told if MARK not in row[place - 1]] or told
        if free:
            row, place = max(free, key=lambda one: (abs(float(one[0][one[1]])), one[0][one[1]]))
            label = f"`{row[0]}`" if "_" in row[0] else row[0]
            found[f"worst_{part}"] = f"{row[place]} % ({label})"
    return found


# --- the thesis's tables --------------------------------------------------------------------------


def fitted_table() -> Rows:
    """Figures that the diagrams were calibrated to, and what the catalogue engine gives."""
    family = load_engine("ntua").family
    rows = [["load", "figure", "target", "fitted"]]
    for load, diagram in zip(map(round, family.loads), family.diagrams, strict=True):
        pairs = (calibrate_ntua.targets()[load], calibrate_ntua.MEASURES[load](diagram))
        for name, *values in zip(FIGURES_OF_FIT[load], *pairs, strict=True):
            # The mean torque at idle is zero to rounding, of either sign.
            texts = (f"{value:.4f}".replace("-0.0000", "0.0000") for value in values)
            rows.append([f"{load} %", name, *texts])
    return rows


def delta_table(study: Study) -> Rows:
    rows = [["design", "printed", "from printed omegas"]]
    rows[0] += [head for way in WAYS.values() for head in (way, "%")]
    for case in study.cases:
        cells = [case, printed_rows()[case]["delta"], f"{printed(case, 'delta'):.5f}"]
        for way in WAYS:
            cells += ours(study, way, "delta", case, ".5f")
        rows.append(cells)
    return rows


def speed_table(study: Study, way: str) -> Rows:
    rows = [["design", *(h for name in SPEEDS for h in (f"{name} printed", "computed", "%"))]]
    for case in study.cases:
        cells = [case]
        for name in SPEEDS:
            cells += [printed_rows()[case][name], *ours(study, way, name, case, ".3f", 3)]
        rows.append(cells)
    return rows


def start_table(study: Study) -> Rows:
    """Printed speed at the start of the last cycle: ours at the firing dead centre."""
    omega = study.ways["published"]["omega"].sel(crank_angle=0.0).values
    rows = [["design", "printed", "as published", "%"]]
    for case in study.several():
        if text := printed_rows()[case].get("omega_start"):
            value = float(omega[study.cases.index(case)])
            rows.append([case, text, f"{value:.3f}", signed(percent(value, float(text)), 3)])
    return rows


def change_table(study: Study) -> Rows:
    """Tables 5.3 and 5.4: changes against the nominal design [percent]."""
    rows = [["design", "delta printed", "from printed omegas", "as published", "periodic"]]
    for name in ("omega_max", "omega_mean"):
        rows[0] += [f"{name} printed", "as published", "periodic"]
    for case in study.cases:
        cells = [case]
        for quantity in ("delta", "omega_max", "omega_mean"):
            text = printed_rows()[case].get(f"d_{quantity}_percent", "")
            pairs = [
                (study.at(way, quantity, case), study.at(way, quantity, "nominal"))
                for way in ("published", "periodic")
            ]
            if quantity == "delta":
                pairs.insert(0, (printed(case, quantity), printed("nominal", quantity)))
            shown = [signed(percent(*pair), decimals_of(text)) if text else "" for pair in pairs]
            if text:
                shown[-2] += mark(case, quantity)
            cells += [text and signed(float(text), decimals_of(text)), *shown]
        if any(cells[1:]):
            rows.append(cells)
    return rows


def torque_table(study: Study) -> Rows:
    rows = [["design"]]
    for name in ("M_max/M_mean", "M_max - M_min (N m)"):
        rows[0] += [f"{name} printed", "as published", "%", "of the curve", "gauge pressure"]
    for case in study.cases:
        if "torque_range" in printed_rows()[case]:
            cells = [case]
            for name, form in zip(TORQUES, (".3f", ".2f"), strict=True):
                curves = (study.at(way, name, case) for way in ("periodic", "gauge"))
                cells += [printed_rows()[case][name], *ours(study, "published", name, case, form)]
                cells += [f"{value:{form}}" for value in curves]
            rows.append(cells)
    return rows


def all_rows_table(study: Study, fitted: Study) -> Rows:
    """Rows at 50 % load: what the modelled cycle predicts, and what the fitted curve gives."""
    rows = [["design", "number", "printed", "ntua", "%", "ntua_all_rows", "%"]]
    for case in fitted.cases:
        for quantity in ("delta", *TORQUES):
            if quantity == "delta" or quantity in printed_rows()[case]:
                own = ours(study, "published", quantity, case, ".6g")
                text, off = ours(fitted, "published", quantity, case, ".6g")
                marked = text.removesuffix(MARK) + MARK
                number = f"{printed(case, quantity):.6g}"
                rows.append([case, quantity, number, *own, marked, off])
    return rows


def correction_table() -> Rows:
    """Correction of the pressure that the fit to all rows needs [bar]."""
    degrees = (-150, -90, -60, -30, -10, 0, 10, 20, 40, 60, 90, 130, 150, 160, 170, 180, 190)
    engines = ("ntua", "ntua_all_rows")
    diagrams = [thesis.diagram_of(name) for name in engines]
    rows = [["degrees", *engines, "difference"]]
    for place in degrees:
        one, other = (float(np.interp(place * DEGREE, d.angle, d.pressure)) / BAR for d in diagrams)
        rows.append([str(place), f"{one:.2f}", f"{other:.2f}", f"{other - one:+.2f}"])
    return rows


def other_table(study: Study) -> Rows:
    values = thesis.other_values(study)
    rows = [["number", "section", "printed", "computed", "unit", "%"]]
    for row in thesis.read_reference("kakaitsas_other_numbers.csv"):
        text, value = row["printed"], values[row["name"]]
        # One digit more than is printed, so that cutting and rounding can be told apart.
        own = f"{value:.{decimals_of(text) + 1}f}{mark('nominal', row['name'])}"
        unit = "" if row["unit"] == "1" else row["unit"]
        off = signed(percent(value, float(text)))
        rows.append([row["what"], row["section"], text, own, unit, off])
    return rows


# --- what does not agree --------------------------------------------------------------------------


def overlap(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether two ranges have a value in common."""
    return one[0] <= other[1] and other[0] <= one[1]


def contradictions() -> Rows:
    """Rows whose printed numbers contradict each other, whatever was cut or rounded."""
    nominal_row = printed_rows()["nominal"]
    rows = [["row", "number", "printed", "should be", "according to"]]
    for case, row in printed_rows().items():
        own = printed(case, "delta")
        if not overlap(thesis.range_of(row["delta"]), thesis.range_of_delta(row)):
            rows.append([case, "delta", row["delta"], f"{own:.5f}", "its own omegas, (3.6)"])
        for name in ("delta", "omega_max", "omega_mean"):
            text = row.get(f"d_{name}_percent")
            if not text:
                continue
            one, base = (
                thesis.range_of_delta(r) if name == "delta" else thesis.range_of(r[name])
                for r in (row, nominal_row)
            )
            if overlap(thesis.range_of(text), (percent(one[0], base[1]), percent(one[1], base[0]))):
                continue
            right = percent(printed(case, name), printed("nominal", name))
            why = "the printed omegas"
            short = percent(float(row[name]), float(nominal_row[name]))
            if name == "delta" and signed(short) == signed(float(text)):
                why += f"; the deltas as printed give {signed(short)}"
            rows.append([case, f"change of {name}, %", text, signed(right), why])
    return rows


def large_differences(study: Study) -> Rows:
    rows = [["row", "number", "%", "cause"]]
    for one in thesis.differences(study):
        if abs(one.percent) > NAMED:
            known = REASONS.get(one.quantity) if one.case in study.several() else None
            rows.append([one.case, one.quantity, signed(one.percent), known or "not explained"])
    return rows


def limit_table(study: Study) -> Rows:
    heads = ["predicted rows", "limit, %", "largest difference of delta, %", "met"]
    return [heads] + [
        ["; ".join(cases), f"{limit:g}", signed(worst), "yes" if abs(worst) <= limit else "no"]
        for cases, limit, worst in thesis.worst_of_limits(study)
    ]


def procedure_table(study: Study) -> Rows:
    """Effect of each part of the thesis's procedure on delta."""
    cases = ["nominal", "inertia 0.5", "inertia 12", "speed 4000", "2 cylinders", "8 cylinders"]
    labels = {
        "as_made": "as made",
        "published": "as published: the scene thesis",
        "repeated": "explicit Euler until a cycle closes within 1e-6 rad/s",
        "periodic": "periodic",
        "gauge": "periodic, gauge pressure",
    }
    return [["delta", *cases]] + [
        [label, *(f"{study.at(way, 'delta', case):.5f}" for case in cases)]
        for way, label in labels.items()
    ]


def span(values: Iterable[float], decimals: int = 2) -> str:
    """Smallest to largest difference."""
    found = sorted(values)
    return f"{signed(found[0], decimals)} to {signed(found[-1], decimals)} %"


def error_table(study: Study) -> str:
    """Formulas of Kakaitsas that this project uses: right against printed, with numbers."""
    own, values = load_engine("ntua").values, thesis.other_values(study)
    one_pass = nominal(
        "thesis",
        passes=1,
        start_speed=CUT_SPEED,
        crank_ratio=[own["crank_ratio"], own["crank_ratio"], 0.300, 1.0 / 3.0],
        reciprocating_mass=[6.67, 6.67, 6.95, 6.95],
        inertia=own["inertia"] * np.array([1.0, thesis.SLIP * DEGREE, 1.0, 1.0]),
    )
    straight, slipped, short, third = one_pass["delta"].values.tolist()
    top = float(slider_crank.acceleration(0.0, own["crank_ratio"]))
    radius, phi = 0.5 * own["stroke"], math.radians(60.0)
    rod_angle = math.asin(own["crank_ratio"] * math.sin(phi))
    height = radius * (math.cos(phi) + math.cos(rod_angle) / own["crank_ratio"])
    tangential = 1e3 * float(slider_crank.velocity(phi, own["crank_ratio"]))
    force = values["reciprocating_mass"] * radius * (own["speed"] * RPM) ** 2 * top
    volume = 1e-3 * values["displacement"] / 6.0
    text = filled(ERRORS.read_text(encoding="utf-8"), {
        "mass_difference": f"{own['crank_mass'] - values['rod_mass_at_crank']:.2f}",
        "mass_sum": f"{values['rotating_mass']:.2f}",
        "slip": f"{thesis.SLIP}",
        "degrees": f"{1.0 / DEGREE:.4f}", "cut_degrees": f"{180.0 / 3.14:.4f}",
        "step": signed(percent(1.0 / thesis.SLIP, DEGREE), 4),
        "slipped": f"{slipped:.5f}", "straight": f"{straight:.5f}",
        "slip_off": signed(percent(slipped, straight), 3),
        "delta_short": f"{short:.5f}", "delta_third": f"{third:.5f}",
        "delta_printed": f"{printed('lambda 1/3', 'delta'):.5f}",
        "force": f"{force / 1e3:.2f}",
        "thrust": f"{1e3 * math.tan(rod_angle) * height:.3f}",
        "tangential": f"{tangential * radius:.3f}",
        "load": f"{values['load_coefficient'] * CUT_SPEED**2:.1f}", "cut_speed": f"{CUT_SPEED:g}",
        "linear": f"{values['load_coefficient'] * CUT_SPEED:.3f}",
        "friction_printed": f"{1.486 * 0.0027 / (4.0 * 3.14):.3e}", "volume": f"{volume:.7f}",
        "friction_rounded": f"{1.486 * BAR * volume / (4.0 * math.pi):.3f}",
        "friction": f"{values['friction_torque_50']:.3f}",
    })  # fmt: skip
    rows = []
    for case in ("6 cylinders", "8 cylinders", "8 cylinders, inertia 5"):
        row = printed_rows()[case]
        low, high = thesis.range_of_delta(row)
        cut = overlap(thesis.range_of(row["delta"]), (low, high))
        verdict = "the printed value is cut" if cut else "neither cut nor rounded"
        said = f"the omegas of the same line give {low:.5f} to {high:.5f}: {verdict}"
        right = f"{printed(case, 'delta'):.5f}"
        rows.append([f"section 5.4, {case}", f"delta = {row['delta']}", right, said])
    return text + csv_text(rows)


def errata_table() -> Rows:
    rows = [["document", "where", "printed", "right", "used here by"]]
    for row in thesis.read_reference("errata.csv"):
        cells = [row[key] for key in ("document", "place", "printed", "right")]
        rows.append([*cells, row["used"].replace("`", "") or "later work"])
    return rows


# --- the procedure for longer, and the independent solver -----------------------------------------


def repetition_table() -> Rows:
    """Cycles until explicit Euler closes within 1e-6 rad/s, and what it closes at."""
    labels = ("nominal", "inertia 0.5 kg m2", "inertia 12 kg m2", "4000 rpm", "load exponent 1")
    columns: dict[str, Any] = {
        "inertia": [2.0, 0.5, 12.0, 2.0, 2.0],
        "speed": [1200.0, 1200.0, 1200.0, 4000.0, 1200.0],
        "load_exponent": [2.0, 2.0, 2.0, 2.0, 1.0],
    }
    euler, exact = nominal("thesis", **columns), nominal(**columns)
    rows = [["design", "cycles", "omega_mean, Euler", "periodic", "delta, Euler", "periodic", "%"]]
    for place, label in enumerate(labels):
        one, other = euler.isel(design=place), exact.isel(design=place)
        cells = [label, f"{float(one['iterations']):.0f}"]
        for name, form in (("omega_mean", ".3f"), ("delta", ".5f")):
            cells += [f"{float(data[name]):{form}}" for data in (one, other)]
        rows.append([*cells, signed(percent(float(one["delta"]), float(other["delta"])))])
    return rows


def drift_table(drift: thesis.Drift) -> Rows:
    heads = ["cycles", "omega_mean (rad/s)", "by the energy added (rad/s)", "delta"]
    return [heads] + [
        [str(count), f"{mean:.2f}", f"{expected:.2f}", f"{delta:.4f}"]
        for count, mean, expected, delta in zip(*drift, strict=True)
    ]


def agreement_table(groups: Sequence[thesis.Agreement]) -> Rows:
    rows = [["designs", "number", "same outcome", *AGREEMENT]]
    for group in groups:
        worst = [
            f"{group.worst[q]:.0e}" if group.group != thesis.WITHOUT_SPEED else ""
            for q in AGREEMENT
        ]
        rows.append([group.group, str(group.designs), str(group.same_outcome), *worst])
    rows.append(["allowed", "", "all", *(f"{limit:.0e}" for limit in AGREEMENT.values())])
    return rows


# --- the document ---------------------------------------------------------------------------------


def tables(
    study: Study, drift: thesis.Drift, agreement: Sequence[thesis.Agreement]
) -> dict[str, Rows]:
    """Tables by the names of their files."""
    return {
        "fitted": fitted_table(),
        "delta": delta_table(study),
        "limits": limit_table(study),
        "speeds": speed_table(study, "published"),
        "start_speeds": start_table(study),
        "periodic_speeds": speed_table(study, "periodic"),
        "changes": change_table(study),
        "torques": torque_table(study),
        "other_numbers": other_table(study),
        "contradictions": contradictions(),
        "large_differences": large_differences(study),
        "all_rows": all_rows_table(study, thesis.run_all_rows()),
        "correction": correction_table(),
        "procedure": procedure_table(study),
        "errata": errata_table(),
        "repetition": repetition_table(),
        "drift": drift_table(drift),
        "independent_solver": agreement_table(agreement),
        **other_sources.tables(),
    }


def documents(
    study: Study, drift: thesis.Drift, agreement: Sequence[thesis.Agreement]
) -> dict[Path, str]:
    """Return the text of docs/validation.md and of the files beside it."""
    template = TEMPLATE.read_text(encoding="utf-8")
    made = tables(study, drift, agreement)
    errors = error_table(study)
    told = {k: v for name, rows in made.items() for k, v in numbers_of(name, rows).items()}
    predicted = thesis.predicted_deltas(study)
    largest = {
        one: max(abs(off) for case, off in predicted.items() if (case in study.several()) == one)
        for one in (False, True)
    }
    widest = {q: max(group.worst[q] for group in agreement) for q in AGREEMENT}
    met = all(abs(off) <= limit for _, limit, off in thesis.worst_of_limits(study))
    repeated = [int(row[1]) for row in made["repetition"][1:]]
    release = [row for row in made["textbook_cycles"] if "release" in row[0]]
    apart = max(
        abs(percent(float(row[n + 1]), float(row[n]))) for row in release for n in (1, 3, 5)
    )
    many = [case for case in study.several() if int(case[0]) >= 4]
    stopped = {
        way: span(percent(study.at("published", "delta", case), study.at(way, "delta", case))
                  for case in many)
        for way in ("repeated", "periodic")
    }  # fmt: skip
    cut, whole = (
        span((study.off(way, "omega_mean", case) for case in study.several()), 3)
        for way in ("as_made", "published")
    )
    volume = 1e-3 * thesis.other_values(study)["displacement"] / 6.0
    torque = sum(study.at("published", n, "nominal") for n in ("torque_mean", "friction_torque"))
    values = {
        "worst_single": f"{largest[False]:.2f}",
        "worst_several": f"{largest[True]:.2f}",
        "limits_met": "met" if met else "**not met**",
        "nominal_periodic": f"{study.at('periodic', 'delta', 'nominal'):.4f}",
        "nominal_printed": printed_rows()["nominal"]["delta"],
        "nominal_gauge": f"{study.at('gauge', 'delta', 'nominal'):.4f}",
        "held_out": str(sum(group.designs for group in agreement)),
        "same_outcome": str(sum(group.same_outcome for group in agreement)),
        "off_delta": f"{widest['delta']:.0e}",
        "off_mean": f"{widest['omega_mean']:.0e}",
        "rows_thesis_errors": str(len(errors.splitlines()) - 1),
        "rows_items": str(len(csv_rows(ITEMS))),
        "mean_cut": cut,
        "mean_whole": whole,
        "named": f"{NAMED:g}",
        "stopped_repeated": stopped["repeated"],
        "stopped_periodic": stopped["periodic"],
        "worst_rod": " and ".join(
            f"{max(float(row[n]) for row in made['rod'][1:]):g} %" for n in (2, 3)
        ),
        "worst_release": f"{apart:.3f} %",
        "work": f"{study.at('published', 'imep', 'nominal') * BAR * volume:.1f}",
        "work_by_torque": f"{torque * 4.0 * math.pi:.1f}",
        "work_misprinted": f"{torque * 2.0 * math.pi:.1f}",
        "fewest_cycles": str(min(repeated)),
        "most_repeated": str(max(repeated)),
        "drift_start": f"{CUT_SPEED:g}",
        "drift_first": f"{drift.mean[0]:.1f}",
        "drift_last": f"{drift.mean[-1]:.1f}",
        "drift_cycles": str(drift.cycles[-1]),
        "no_drift": f"{float(nominal(load_exponent=0.0)['omega_mean'].item()):.2f}",
        **other_sources.values(),
        **{name: text for name, text in told.items() if f"{{{{ {name} }}}}" in template},
    }
    return {
        DOCUMENT: filled(template, values),
        **{ROWS / f"{name}.csv": csv_text(rows) for name, rows in made.items()},
        ROWS / "thesis_errors.csv": errors,
    }


# --- figures --------------------------------------------------------------------------------------


def draw_two_diagrams() -> None:
    """Draw the modelled pressure at 50 % load, the one fitted to all rows, and their difference."""
    modelled, fitted = thesis.diagram_of("ntua"), thesis.diagram_of("ntua_all_rows")
    degrees = np.rad2deg(modelled.angle)
    with sheet("ntua_diagrams", (7.0, 5.2), rows=2, sharex=True, height_ratios=(3, 2)) as (_, axes):
        above, below = axes[:, 0]
        above.plot(degrees, modelled.pressure / BAR, color="black", label="ntua: modelled cycle")
        label = "ntua_all_rows: fitted to all rows at 50 % load"
        above.plot(degrees, fitted.pressure / BAR, color="#b35806", linestyle="--", label=label)
        above.set(ylabel="pressure in bar", ylim=(0.0, 90.0))
        above.legend(loc="upper left")
        below.plot(degrees, (fitted.pressure - modelled.pressure) / BAR, color="#b35806")
        below.axhline(0.0, color="0.4", linewidth=0.8)
        below.set(
            ylabel="difference in bar", xlim=(-360.0, 360.0), xticks=range(-360, 361, 90),
            xlabel="crank angle in degrees from firing dead centre",
        )  # fmt: skip


def draw_drift() -> None:
    """Draw the mean speed over cycles of explicit Euler, constant load torque."""
    drift = thesis.run_drift([1, *range(500, CYCLES[-1] + 1, 500)])
    square = nominal("thesis", passes=drift.cycles, start_speed=CUT_SPEED)["omega_mean"]
    with sheet("euler_drift", (7.0, 3.8)) as (_, axes):
        panel = axes[0, 0]
        for values, style, label in (
            (drift.mean, "k.-", "explicit Euler, constant load torque (α = 0)"),
            (drift.predicted, "C1:", "predicted from the energy that each step adds"),
            (square, "C4--", "explicit Euler, load torque as speed squared (α = 2)"),
        ):
            panel.plot(drift.cycles, values, style, label=label)
        steady = float(nominal(load_exponent=0.0)["omega_mean"].item())
        panel.axhline(steady, color="0.45", linestyle="-.", label="periodic solution, α = 0")
        panel.set(
            xlabel="cycles", ylabel="mean speed $\\omega_m$ (rad/s)", xlim=(0.0, 1.02 * CYCLES[-1])
        )
        panel.legend(loc="upper left")


def draw_differences(study: Study) -> None:
    """Draw the differences of delta from the published one, in three ways."""
    with sheet("delta_differences", (7.0, 5.6)) as (figure, axes):
        panel = axes[0, 0]
        for (way, label), style in zip(WAYS.items(), ("ko", "C4s", "C1^"), strict=True):
            off = [study.off(way, "delta", case) for case in study.cases]
            more = {"markerfacecolor": "none"} if way == "periodic" else {}
            panel.plot(off, range(len(off)), style, markersize=6.0, label=label, **more)
        panel.axvline(0.0, color="black", linewidth=0.8)
        labels = [case + mark(case, "delta") for case in study.cases]
        panel.set_yticks(range(len(labels)), labels)
        panel.invert_yaxis()
        panel.set_xlabel("difference of delta from that of the printed omegas (%);  † fitted")
        figure.legend(loc="outside upper center", ncols=3)


def main() -> None:
    with_figures = figures_wanted(__doc__.splitlines()[0])
    study = thesis.run_study()
    made = documents(study, thesis.run_drift(CYCLES), thesis.run_agreement())
    for file in set(ROWS.iterdir()) - {ITEMS, *made}:
        file.unlink()
    write(made)
    if with_figures:
        draw_drift()
        draw_differences(study)
        draw_two_diagrams()


if __name__ == "__main__":
    main()
