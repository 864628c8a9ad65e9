"""Figure and rates of docs/measured_pressure.md: wrong dead centres of fired cycles.

    python tools/measured_pressure.py figure           # docs/figures/recorded_pressure.png
    python tools/measured_pressure.py train            # docs/figures/recorded_train.png
    python tools/measured_pressure.py rates [NUMBER]   # prints the tables

Modelled engines are drawn at random (spark-ignition, diesel with and without charger, two-stroke,
and cycles with constant exponents). Their pressure is shifted, gets an error of pegging and
noise, and is judged with a wrong compression ratio; nothing of this is known to the check. The
others than the engines of `CHOSEN_WITH` are drawn from wider ranges.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from PIL import Image

import sweeps
from engine_dyn.pressure.diagram import diagram_from_points
from engine_dyn.pressure.diesel_cycle import DieselCycle
from engine_dyn.pressure.first_law import FourStrokeCycle, TwoStrokeCycle
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry
from engine_dyn.recordings.dead_centre import DeadCentre, dead_centre_of_fired
from engine_dyn.recordings.heat_release import mean_pressures
from engine_dyn.recordings.recorded_cycles import RecordedCycles
from engine_dyn.recordings.signal_checks import examine
from engine_dyn.units import BAR, DEGREE
from sweeps.figures import draw
from sweeps.presenting.recorded_trains import train_text
from sweeps.reading.engine_files import load_engine
from sweeps.reading.laboratory.evaluation import evaluated

CHOSEN_WITH, HELD_OUT = 1, 2
"""Seeds of the random engines."""

KINDS = ("spark ignition", "diesel", "charged diesel", "two-stroke", "constant exponents")
SHIFTS = (0.0, 2.0, 4.0, 6.0)


class Case(NamedTuple):
    """One engine: what it is, its measures, and its pressure [Pa] at angles [rad]."""

    kind: str
    geometry: CylinderGeometry
    diagram: Any


def engines(number: int, seed: int, wide: float) -> Iterator[Case]:
    """Draw engines; `wide` widens the ranges of what the fit assumes to know."""
    rng = np.random.default_rng(seed)
    while number:
        kind = KINDS[number % len(KINDS)]
        try:
            yield _engine(kind, rng.uniform, wide)
        except ValueError:  # a combination that is no cycle
            continue
        number -= 1


def _engine(kind: str, draw: Any, wide: float) -> Case:
    def around(middle: float, half: float) -> float:
        return float(draw(middle - wide * half, middle + wide * half))

    ratio, bore = draw(0.2, 0.33), draw(0.06, 0.13)
    stroke = bore * draw(0.8, 1.3)
    speed = draw(3.0, 16.0) / stroke * math.pi  # of mean piston speed
    valves: dict[str, Any] = dict(
        crank_ratio=ratio, valve_ramp=draw(25, 45) * DEGREE, valve_lag=draw(5, 9) * DEGREE,
        intake_loss=draw(0.02, 0.1) * BAR, exhaust_loss=draw(0.02, 0.1) * BAR,
        intake_closing=-draw(110, 140) * DEGREE, exhaust_opening=draw(115, 145) * DEGREE,
    )  # fmt: skip
    gas: dict[str, Any] = dict(
        gamma_300=around(1.3825, 0.0125), gamma_slope=around(8e-5, 2e-5), wall="woschni",
        wall_temperature=around(430.0, 45.0), wall_factor=around(1.05, 0.45),
        bore=bore, stroke=stroke, speed=speed,
    )  # fmt: skip
    cycle: Any
    if kind == "spark ignition":
        inlet, compression = draw(0.35, 1.0) * BAR, draw(8.5, 12.5)
        cycle = FourStrokeCycle(
            compression_ratio=compression, intake_pressure=inlet, exhaust_pressure=1.05 * BAR,
            charge_temperature=around(365.0, 35.0), heat=draw(22.0, 30.0) * inlet,
            combustion_start=-draw(8, 35) * DEGREE, combustion_duration=draw(45, 75) * DEGREE,
            combustion_form=draw(1.5, 2.5), **valves, **gas,
        )  # fmt: skip
    elif kind == "two-stroke":
        inlet, compression = draw(1.2, 3.5) * BAR, draw(11.0, 17.0)
        valves = dict(
            crank_ratio=ratio, valve_ramp=draw(15, 25) * DEGREE, valve_lag=draw(5, 9) * DEGREE,
            exhaust_opening=draw(105, 122) * DEGREE, scavenge_opening=draw(128, 140) * DEGREE,
        )  # fmt: skip
        cycle = TwoStrokeCycle(
            compression_ratio=compression, intake_pressure=inlet, exhaust_pressure=0.92 * inlet,
            charge_temperature=around(355.0, 25.0), heat=draw(5.0, 9.0) * inlet,
            combustion_start=-draw(-1, 8) * DEGREE, combustion_duration=draw(45, 75) * DEGREE,
            combustion_form=draw(0.8, 1.5), **valves, **gas,
        )  # fmt: skip
    else:
        charged = kind == "charged diesel"
        inlet = (draw(1.2, 2.6) if charged else draw(0.95, 1.02)) * BAR
        compression, start = draw(14.5, 20.0), -draw(0, 10) * DEGREE
        burning = dict(
            compression_ratio=compression, intake_pressure=inlet,
            exhaust_pressure=max(1.05 * BAR, 0.95 * inlet), heat=draw(3.0, 15.0) * inlet,
            premixed_share=draw(0.0, 0.3), premixed_start=start,
            premixed_duration=draw(8, 12) * DEGREE, premixed_form=2.0,
        )  # fmt: skip
        duration, form = draw(50, 100) * DEGREE, draw(0.8, 1.5)
        if kind == "constant exponents":
            cycle = DieselCycle(
                compression_exponent=around(1.35, 0.03), expansion_exponent=around(1.29, 0.04),
                diffusion_start=start, diffusion_duration=duration, diffusion_form=form,
                **burning, **valves,
            )  # fmt: skip
        else:
            cycle = FourStrokeCycle(
                charge_temperature=around(355.0, 35.0), combustion_start=start,
                combustion_duration=duration, combustion_form=form, **burning, **valves, **gas,
            )  # fmt: skip
    angle, pressure = cycle.points(1.0)
    period = 2.0 * math.pi if kind == "two-stroke" else 4.0 * math.pi
    geometry = CylinderGeometry(bore, stroke, ratio, compression)
    return Case(kind, geometry, diagram_from_points(angle, pressure, period))


def judged(case: Case, shift: float, rng: np.random.Generator) -> tuple[DeadCentre, float]:
    """Judge one engine whose pressure comes `shift` [degree] late; also the error of its imep."""
    period = case.diagram.period
    step = rng.choice([0.5, 1.0])
    angle = (np.arange(0.0, period / DEGREE - 1e-9, step)) * DEGREE - 0.5 * period
    pressure = case.diagram(angle - shift * DEGREE)
    at_start = float(case.diagram(-1.7))
    pressure = pressure + rng.normal(0.0, 0.03 * at_start + 0.02 * BAR)
    count = int(rng.choice([1, 10, 100]))
    # The noise of the mean of so many cycles, at the strength that one cycle has.
    noise = rng.uniform(0.0, 0.05) * BAR / math.sqrt(count)
    recorded = RecordedCycles(
        angle, (pressure + noise * rng.standard_normal(len(angle)))[None], period
    )
    clearance = case.geometry.clearance_volume * math.exp(rng.normal(0.0, 0.02))
    given = case.geometry.with_compression_ratio(1.0 + case.geometry.swept_volume / clearance)
    right = RecordedCycles(angle, case.diagram(angle)[None], period)
    imep, true = (float(mean_pressures(c, given).net[0]) for c in (recorded, right))
    return dead_centre_of_fired(recorded, given), imep / true - 1.0


def table(number: int, seed: int, wide: float) -> str:
    """Rates by kind of engine and size of the shift."""
    rng = np.random.default_rng(1000 + seed)
    found: dict[tuple[str, float], list[tuple[float, float, bool, float]]] = {}
    for case in engines(number, seed, wide):
        for size in SHIFTS:
            shift = size * rng.choice([-1.0, 1.0])
            try:
                one, imep = judged(case, shift, rng)
            except ValueError:  # the pressure is not positive with its pegging error
                continue
            error = one.shift / DEGREE - shift
            ratio = error / (one.uncertainty / DEGREE)
            found.setdefault((case.kind, size), []).append((error, ratio, one.suspected, imep))
            found.setdefault(("all", size), []).append((error, ratio, one.suspected, imep))
    lines = ["| engines | shift | suspected | error of the shift, standard deviation "
             "| within two of its standard uncertainties | error of imep, median |",
             "| --- | ---: | ---: | ---: | ---: | ---: |"]  # fmt: skip
    for (kind, size), rows in sorted(found.items(), key=lambda r: ((*KINDS, "all").index(r[0][0]),
                                                                   r[0][1])):  # fmt: skip
        values = np.array(rows, dtype=float)
        lines.append(
            f"| {kind} ({len(values)}) | {size:g} | {100 * values[:, 2].mean():.1f} % | "
            f"{np.sqrt((values[:, 0] ** 2).mean()):.2f} | "
            f"{100 * (np.abs(values[:, 1]) < 2.0).mean():.0f} % | "
            f"{100 * np.median(np.abs(values[:, 3])):.1f} % |"
        )
    return "\n".join(lines)


def figure() -> None:
    """The sheet of forty noisy cycles of a modelled diesel engine, six degrees late."""
    rng = np.random.default_rng(3)
    angle = np.arange(-360.0, 360.0, 0.5) * DEGREE
    rows = []
    cylinder = CylinderGeometry(0.14, 0.18, 0.18 / 0.7, 17.433233)
    diagrams = load_engine("ntua").family.diagrams[1:]
    for _ in range(40):
        share = rng.normal(0.5, 0.15)
        light, heavy = (one(angle - 6.0 * DEGREE) for one in diagrams)
        rows.append(light + share * (heavy - light) + 0.03 * BAR * rng.standard_normal(angle.size))
    cycles = RecordedCycles(angle, np.array(rows))
    found = examine(cycles, cylinder)
    title = "Recorded pressure, modelled diesel engine 140/180 mm, dead centre wrong by 6 degrees"
    data = evaluated(cycles, cylinder, title=title, findings=found)
    save(data, "recorded_pressure")


def save(data: xr.Dataset, name: str) -> None:
    """One figure of a dataset, at half its size."""
    with tempfile.TemporaryDirectory() as folder:
        paths = {path.stem: path for path in draw(data, folder)}
        with Image.open(paths[name]) as picture:
            small = picture.convert("RGB").resize((picture.width // 2, picture.height // 2))
            target = Path(__file__).parents[1] / "docs" / "figures" / f"{name}.png"
            small.quantize(256).save(target, optimize=True)


def train() -> None:
    """Sixteen cycles in a row of a modelled diesel engine, the sixth of which hardly burns."""
    rng = np.random.default_rng(3)
    angle = np.arange(-360.0, 360.0)
    light, *_, heavy = (one(angle * DEGREE) for one in load_engine("ntua").family.diagrams)
    shares = rng.normal(0.7, 0.06, 16)
    shares[5] = 0.0
    with tempfile.TemporaryDirectory() as folder:
        rows = [f"{k};" + ";".join(f"{p:.5f}" for p in (light + share * (heavy - light)) / BAR)
                for k, share in enumerate(shares, start=1)]  # fmt: skip
        head = "cycle;" + ";".join(f"{a:g}" for a in angle)
        path = Path(folder) / "cycles.csv"
        path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
        found = sweeps.follow_cycles({
            "engine": "ntua",
            "axes": {"recorded_cycle": list(range(1, 17))},
            "indicator": {"file": str(path), "unit": "bar"},
            "output": {"quantities": ["delta"]},
        })  # fmt: skip
    print(train_text(found))
    save(found, "recorded_train")


if __name__ == "__main__":
    if sys.argv[1:2] == ["figure"]:
        figure()
    elif sys.argv[1:2] == ["train"]:
        train()
    else:
        many = int(sys.argv[2]) if len(sys.argv) > 2 else 500
        print(f"engines ({many}):\n")
        print(table(many, CHOSEN_WITH, 1.0))
        print(f"\nothers, ranges half as wide again ({many}):\n")
        print(table(many, HELD_OUT, 1.5))
