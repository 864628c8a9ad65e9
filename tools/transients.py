"""Write docs/transients.md: load steps, governors, start and stop.

The scenes of the page and its example are run, and what is changed in it; checks and rates are
measured. It takes some minutes. Run it from the project's root: `python tools/transients.py`;
`--no-figures` leaves the figure alone.
"""

from __future__ import annotations

import contextlib
import io
import os
import platform
import re
import resource
import subprocess
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from pages import DOCS, figures_wanted, filled, markdown, run_command, sheet, write

from engine_dyn import periodic_speed
from engine_dyn.pressure.motored import motored
from engine_dyn.transient import ISO_8528_5_G2, Transients, follow_designs, transient_engine
from engine_dyn.transient.fields import (
    CURVES,
    CYCLE_RESULTS,
    FIELDS,
    MARK_RESULTS,
    OF_SPEED,
    RUN_RESULTS,
)
from engine_dyn.transient.kernel import FASTEST
from engine_dyn.transient.tables import ROW_STEP, STEPS
from engine_dyn.types import Floats
from oracle.transients import Reference

TEMPLATE = Path(__file__).with_suffix(".md.in")
DOCUMENT = DOCS / "transients.md"
CYCLE = 4.0 * np.pi
MARKS = (2.0, 12.0)  # Changes of load of the example [s]

EXAMPLE = """\
import math

import numpy as np

from engine_dyn import status
from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.transient import ISO_8528_5_G2, follow_designs, kept, transient_engine
from sweeps.scene.engine.engine_files import load_engine

file = load_engine("ntua")
bore, stroke, ratio = (file.values[name] for name in ("bore", "stroke", "crank_ratio"))
speed, radius, area = 1500.0 * math.pi / 30.0, stroke / 2.0, math.pi / 4.0 * bore**2
per_pressure = 6 * area * stroke / (4.0 * math.pi)  # torque of six cylinders over a mean pressure

engine = transient_engine(
    file.family,
    even_cylinders(6, 4.0 * math.pi),
    crank_ratio=ratio,
    command_angle=math.radians(-15.0),  # diesel: the fuel of each firing just before it
)
inertia, gain = np.meshgrid(np.arange(2.0, 20.0, 0.25), [400.0, 800.0, 1200.0, 1600.0])
numbers = {
    "speed": speed,
    "inertia": inertia.ravel(),
    "reciprocating_inertia": 6.67 * radius**2,
    "lever": area * radius,
    "load_exponent": -1.0,
    "friction_constant": 0.137e5 * per_pressure,
    "friction_peak_share": 0.005 * per_pressure,
    "friction_linear": 0.142e5 * stroke / math.pi * per_pressure,
    "governed": 1.0,
    "reference_speed": speed,
    "gain": gain.ravel(),
    "integral_gain": 2.0 * gain.ravel(),
    "actuator_lag": 0.05,
    "lowest_command": -20.0,
    "highest_command": 90.0,
    "duration": 20.0,
    "recovery_band": ISO_8528_5_G2.band / 2.0,
}
steps = ([0.0, 2.0, 2.0, 12.0, 12.0], [0.0, 0.0, 1000.0, 1000.0, 0.0])  # s, N m


def lightest(**more):
    found = follow_designs(engine, 300, load=steps, marks=[2.0, 12.0], **numbers, **more)
    full_load = found.delta[:, 140]  # delta of a cycle between 11 and 12 s
    print("stopped:", np.count_nonzero(found.outcome == status.STOPPED))
    for words, good in (
        ("G2", kept(found, speed, ISO_8528_5_G2).all(axis=1)),
        ("delta 1/200", full_load <= 1.0 / 200.0),
    ):
        best = np.flatnonzero(good)[np.argmin(numbers["inertia"][good])]
        dip = 1.0 - found.marks["speed_lowest"][best, 0] / speed
        print(
            f"{words}: {numbers['inertia'][best]:.2f} kg m2 with gain {numbers['gain'][best]:.0f},"
            f" falls by {100.0 * dip:.1f} %, recovers in"
            f" {found.marks['recovery_time'][best, 0]:.1f} s, delta 1/{1.0 / full_load[best]:.0f}"
        )


lightest()
print("turbocharged:")
lightest(boost_lag=0.5, boost_margin=40.0)
"""


SAID = re.compile(r"```(toml|console)\n(.*?)```(?=\n\n```text\n{{ (\w+) }})?", re.DOTALL)
"""Scenes and commands of the template, and the name of what is printed, where the page shows it."""


def run_commands(template: str) -> dict[str, str]:
    """What the commands of the template print, after they ran with its scenes."""
    parts = {}
    with tempfile.TemporaryDirectory() as folder:
        for kind, text, name in SAID.findall(template):
            if kind == "toml":
                Path(folder, text.splitlines()[0].removeprefix("# ")).write_text(text, "utf-8")
            elif name:
                lines = text.splitlines()
                said = [run_command(line, Path(folder))[0].strip("\n") for line in lines]
                # The table of `run` is that of the first `show`
                first = [line for line in said[0].splitlines() if line.startswith("outcomes")]
                parts[name] = "\n\n".join([*first, *said[1:]])
    return parts


def run_example() -> tuple[dict[str, Any], str]:
    """Names of the example, and what it prints."""
    names: dict[str, Any] = {}
    with contextlib.redirect_stdout(io.StringIO()) as said:
        exec(EXAMPLE, names)
    return names, said.getvalue().rstrip()


def processor_time() -> float:
    own = resource.getrusage(resource.RUSAGE_CHILDREN)
    return own.ru_utime + own.ru_stime


# --- checks ---------------------------------------------------------------------------------------


def plain_design(names: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Numbers of one design of the example."""
    return names["numbers"] | {"inertia": 8.0, "gain": 800.0, "integral_gain": 1600.0} | more


def largest(one: Floats, other: Floats) -> float:
    return float(np.abs(one / other - 1.0).max())


def of_dop853(names: dict[str, Any]) -> float:
    """Largest difference from DOP853 in a load step of the example."""
    engine, family = names["engine"], names["file"].family
    numbers = plain_design(names, start_command=10.0, start_speed=names["speed"])
    load = ([0.0, 0.3, 0.3], [100.0, 100.0, 1000.0])
    commands = engine.tables(STEPS).commands
    rows = [motored(family.at(0.0)), *(family.at(float(one)) for one in commands[1:])]
    firing = [-member.phase % CYCLE for member in engine.cylinders.members]
    made = Reference(rows, commands, firing, np.radians(-15.0), names["ratio"], numbers, load)
    exact = made.run(8)
    found = follow_designs(engine, 8, load=load, **numbers)
    return largest(found.cycles["speed_end"][0], exact[:, 1])


def convergence(names: dict[str, Any]) -> dict[int, float]:
    """Largest error of one cylinder of the example over the steps of a cycle: it has few events."""
    numbers = plain_design(names, inertia=np.linspace(2.0, 8.0, 7))
    for name in ("friction_constant", "friction_peak_share", "friction_linear"):
        numbers[name] /= 6.0
    family, ratio = names["file"].family, names["ratio"]
    engine = transient_engine(family, names["even_cylinders"](1, CYCLE), crank_ratio=ratio)

    def speeds(steps: int) -> Floats:
        found = follow_designs(engine, 60, load=([0.0, 2.0, 2.0], [0.0, 0.0, 100.0]),
                               steps=steps, estimate=False, **numbers)  # fmt: skip
        return found.cycles["speed_end"]

    exact = speeds(384)
    return {steps: largest(speeds(steps), exact) for steps in (12, 24, STEPS, 48)}


def of_periodic(names: dict[str, Any]) -> tuple[float, float]:
    """Differences of delta and mean speed from the periodic solution, after 400 cycles."""
    friction = 200.0
    steady = periodic_speed(
        names["file"].family.at(50.0), bore=names["bore"], stroke=names["stroke"],
        crank_ratio=names["ratio"], reciprocating_mass=6.67, inertia=8.0, speed=names["speed"],
        cylinders=6, load_exponent=1.6, friction_torque=friction, inertia_model="variable",
        tolerance=1e-8,
    )  # fmt: skip
    kept = {k: names["numbers"][k] for k in ("speed", "reciprocating_inertia", "lever")}
    found = follow_designs(
        names["engine"], 400, load=([0.0], [steady.load_coefficient * names["speed"] ** 1.6]),
        inertia=8.0, load_exponent=1.6, friction_constant=friction, start_command=50.0,
        start_speed=1.1 * names["speed"], estimate=False, **kept,
    )  # fmt: skip
    delta, mean = found.delta[0, -1], found.cycles["speed_mean"][0, -1]
    return abs(delta / steady.delta - 1.0), abs(mean / steady.omega_mean - 1.0)


def of_energy(names: dict[str, Any]) -> float:
    """Largest relative difference between energies gained in cycles without load and friction."""
    kept = {k: names["numbers"][k] for k in ("speed", "reciprocating_inertia", "lever")}
    found = follow_designs(names["engine"], 10, inertia=100.0, start_speed=60.0,
                           start_command=40.0, estimate=False, **kept)  # fmt: skip
    gained = np.diff(found.cycles["speed_end"][0] ** 2)
    return largest(gained, np.full(gained.size, gained.mean()))


def checks(names: dict[str, Any]) -> str:
    errors = convergence(names)
    delta, mean = of_periodic(names)
    order = np.log2(errors[12] / errors[48]) / 2.0
    rows = [["what", "largest relative difference"]]
    rows += [["speed at the end of each cycle, a load step of the example, from DOP853 at 1e-12",
              f"{of_dop853(names):.0e}"]]  # fmt: skip
    rows += [[f"one cylinder with {steps} steps a cycle, from 384", f"{error:.0e}"]
             for steps, error in errors.items()]  # fmt: skip
    rows += [
        [
            "delta after 400 cycles of constant command, from the periodic solution with the exact "
            "inertia",
            f"{delta:.0e}",
        ],
        ["mean speed, the same", f"{mean:.0e}"],
        ["energy gained in each cycle without load and friction", f"{of_energy(names):.0e}"],
    ]
    text = f"With {STEPS} steps a cycle at least, unless another number stands there. From 12 to "
    text += f"48 steps errors fall by order {order:.1f}; with smooth torques it would be 8, but "
    text += "diagrams have knots.\n\n"
    return text + markdown(rows, 1)


# --- rates ----------------------------------------------------------------------------------------

COLD = """
import time
from engine_dyn.transient import follow_designs, transient_engine
from engine_dyn.geometry.cylinders import even_cylinders
from sweeps.scene.engine.engine_files import load_engine
engine = transient_engine(load_engine("ntua").family, even_cylinders(6, 12.566370614359172),
                          crank_ratio=0.257)
begin = time.process_time()
follow_designs(engine, 1, inertia=3.0, lever=0.001, speed=150.0, estimate=False)
print(time.process_time() - begin)
"""


def rates(names: dict[str, Any]) -> str:
    """Rows of the table of rates."""
    rows = []
    numbers = plain_design(names) | {"inertia": np.linspace(8.0, 20.0, 1000), "duration": np.inf}
    for exponent, estimate in ((2.0, False), (1.6, False), (1.6, True)):
        begin = time.process_time()
        follow_designs(names["engine"], 100, load=([0.0, 2.0, 2.0], [0.0, 0.0, 900.0]),
                       estimate=estimate, **(numbers | {"load_exponent": exponent}))  # fmt: skip
        spent = time.process_time() - begin
        more = ", with the estimate of the error" if estimate else ""
        rows.append(f"| 1000 designs of 100 cycles, governor active, load exponent {exponent:g}"
                    f"{more} | {spent:.1f} |")  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        said = subprocess.run(
            [sys.executable, "-c", COLD], check=True, capture_output=True, text=True,
            env={**os.environ, "NUMBA_CACHE_DIR": folder},
        ).stdout  # fmt: skip
    rows.append(f"| compiling, the first time on a machine | {float(said):.0f} |")
    return "\n".join(rows)


# --- what decides ---------------------------------------------------------------------------------

CHANGES: tuple[tuple[str, dict[str, Any], dict[str, float]], ...] = (
    ("air lags by 0.25 s, 40 percent more burnt at once",
     {"boost_lag": 0.25, "boost_margin": 40.0}, {}),
    ("the same, 0.5 s", {"boost_lag": 0.5, "boost_margin": 40.0}, {}),
    ("command taken a turn before the firing (mixture)", {}, {"command_angle": -2.0 * np.pi}),
    ("governor measures over a whole cycle (window 6)", {"window": 6.0}, {}),
    ("actuator 0.1 s", {"actuator_lag": 0.1}, {}),
    ("actuator 0.02 s", {"actuator_lag": 0.02}, {}),
    ("dead time 10 ms", {"dead_time": 0.01}, {}),
    ("load torque constant (exponent 0)", {"load_exponent": 0.0}, {}),
    ("load torque grows with the square of the speed", {"load_exponent": 2.0}, {}),
    ("inertia + 10 %", {"inertia": 1.1}, {}),
    ("work of the gas - 2 %", {"lever": 0.98}, {}),
    ("friction without the share of the peak pressure", {"friction_peak_share": 0.0}, {}),
    ("reciprocating masses left out", {"reciprocating_inertia": 0.0}, {}),
    ("rows of the diagrams as in the file, 40 to 50 percent apart", {}, {"row_step": 50.0}),
)  # fmt: skip
WORTH = {
    "boost": CHANGES[0][0], "later": CHANGES[1][0], "torque": CHANGES[7][0], "peak": CHANGES[11][0],
    "rows": CHANGES[13][0],
}  # fmt: skip
"""Changes that the page's limits tell, too."""
FACTORS = {"inertia", "lever"}
"""Numbers that are changed by a factor."""


def best_design(found: Transients, names: dict[str, Any]) -> int:
    """The lightest design that keeps G2."""
    good = np.flatnonzero(names["kept"](found, names["speed"], ISO_8528_5_G2).all(axis=1))
    return int(good[np.argmin(names["numbers"]["inertia"][good])])


def changes(names: dict[str, Any]) -> tuple[dict[str, str], dict[str, Any]]:
    """Values of the page, and the design whose fall is told."""
    numbers = names["numbers"]
    at = best_design(follow(names, names["engine"], numbers), names)
    design = {k: v[at] if np.ndim(v) else v for k, v in numbers.items()}
    heavier = design | {"inertia": 2.0 * design["inertia"]}

    def fall(engine: Any, design: dict[str, Any]) -> float:
        found = follow(names, engine, design)
        fallen = found.marks["speed_before"] - found.marks["speed_lowest"]
        return float(fallen[0, 0]) / names["speed"]

    first = fall(names["engine"], heavier)
    rows = [["changed", "fall of the speed"]]
    for words, more, of_engine in CHANGES:
        engine, changed = names["engine"], dict(heavier)
        for name, value in more.items():
            changed[name] = changed[name] * value if name in FACTORS else value
        if of_engine:
            given = {"command_angle": np.radians(-15.0)} | of_engine
            engine = transient_engine(engine.family, engine.cylinders,
                                      crank_ratio=names["ratio"], **given)  # fmt: skip
        new = fall(engine, changed)
        told = f"{100.0 * (new / first - 1.0):+.1f} %"
        rows.append([words, told if new < 0.5 else "the engine stops"])
    parts = {"heavier": f"{heavier['inertia']:g}", "gain": f"{heavier['gain']:g}"}
    return parts | {"fall": f"{100.0 * first:.1f}", "changes": markdown(rows, 1)}, design


def follow(names: dict[str, Any], engine: Any, numbers: dict[str, Any], **more: Any) -> Transients:
    """The load steps of the example."""
    return follow_designs(engine, 300, load=names["steps"], marks=MARKS, estimate=False,
                          **numbers, **more)  # fmt: skip


def worth(table: str) -> dict[str, str]:
    """What limits are worth, from the table of changes."""
    cells = [line.strip("| ").split(" | ") for line in table.splitlines()[2:]]
    found = dict(zip((words for words, *_ in CHANGES), (cell[1] for cell in cells), strict=True))
    return {name: found[words] for name, words in WORTH.items()}


# --- the page -------------------------------------------------------------------------------------


def field_rows() -> str:
    rows = [["number", "unit", "meaning", "default"]]
    for one in FIELDS:
        default = "" if one.default is None else f"{one.default:g}"
        if one.name in OF_SPEED:
            default = f"{OF_SPEED[one.name]:g} `speed`".removeprefix("1 ")
        rows.append([f"`{one.name}`", one.unit, one.meaning, default])
    return markdown(rows)


def listed(results: tuple[tuple[str, str, str], ...]) -> str:
    return "; ".join(f"`{name}` [{unit}], {meaning}" for name, unit, meaning in results)


def draw(names: dict[str, Any], design: dict[str, Any]) -> None:
    """Speed with its band, command and load over time, for three flywheels."""
    heavier = np.round(4.0 * design["inertia"] * np.array([1.0, 1.5, 2.5])) / 4.0
    shown = design | {"inertia": heavier}
    found = follow(names, names["engine"], shown, record=(0, 245))
    speed, limit, rpm = names["speed"], ISO_8528_5_G2, 30.0 / np.pi
    heights = {"height_ratios": [3, 2, 1]}
    with sheet("load_step", (8.0, 6.4), 3, sharex=True, gridspec_kw=heights) as (_, panels):
        top, middle, low = panels[:, 0]
        for k, (begin, end) in enumerate(pairwise((*MARKS, 16.0))):
            before, after = (
                float(found.marks[f"speed_{one}"][0, k]) for one in ("before", "after")
            )
            half = 0.5 * limit.band * speed
            top.fill_between([begin, end], rpm * (after - half), rpm * (after + half),
                             color="0.85", lw=0.0)  # fmt: skip
            for share in (-limit.fall, limit.rise):
                top.plot([begin, end], 2 * [rpm * (before + share * speed)], "0.3", ls=":", lw=1.0)
        for i, inertia in enumerate(shown["inertia"]):
            t = found.curves["time"][i]
            label = f"{inertia:g} kg m²"
            top.plot(t, found.curves["omega"][i] * rpm, lw=0.9, label=label)
            middle.plot(t, found.curves["command"][i], lw=0.9)
            low.plot(t, found.curves["load_torque"][i], lw=0.9)
        top.set_ylabel("speed, rpm")
        top.legend(loc="upper center", bbox_to_anchor=(0.4, 0.9))
        middle.set_ylabel("command, percent")
        low.set_ylabel("load, N m")
        low.set_xlabel("time, s")
        low.set_xlim(1.0, 16.0)


def main() -> None:
    figures = figures_wanted(__doc__.splitlines()[0])
    names, said = run_example()
    parts, design = changes(names)
    lines = said.splitlines()
    masses = [float(line.split(":")[1].split()[0]) for line in lines if "kg m2" in line]
    parts |= {
        "load": f"{names['steps'][1][2]:g}",
        "count": f"{names['gain'].size}", "inertias": f"{names['inertia'].shape[1]}",
        "gains": f"{names['inertia'].shape[0]}", "example": EXAMPLE, "printed": said,
        "comparison": f"{masses[0]:.2f} kg m² to keep G2 and {masses[1]:.2f} for δ = 1/200; with "
        f"a turbocharger whose air lags by half a second, {masses[2]:.2f} to keep G2.",
        "row_step": f"{ROW_STEP:g}", "fields": field_rows(),
        "cycle_results": listed(CYCLE_RESULTS), "mark_results": listed(MARK_RESULTS),
        "run_results": listed(RUN_RESULTS), "curves": ", ".join(f"`{name}`" for name in CURVES),
        "fastest": f"{FASTEST:g}", "checks": checks(names), "rates": rates(names),
        "machine": f"Python {platform.python_version()}, {os.cpu_count()} processors shared with "
        "other work",
    }  # fmt: skip
    parts |= worth(parts["changes"])
    if figures:
        draw(names, design)
    template = TEMPLATE.read_text(encoding="utf-8")
    write({DOCUMENT: filled(template, parts | run_commands(template))})


if __name__ == "__main__":
    main()
