"""Write docs/misfire_detection.md: where single missed cycles and dead cylinders show in the speed.

Two engines of the catalogue on a rigid crank, their speed seen through a 60-2 wheel whose teeth
have errors. The map follows from formulas (docs/method.md (139) to (148)); at some points of it the
formulas are held against speeds that are integrated over the angle with cycles drawn at random, and
judged as a recording would be. Run it from the project's root: `python tools/misfire_map.py`;
`--no-figures` leaves the figures alone. It takes two to four minutes.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from copy import copy
from functools import partial
from pathlib import Path
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from pages import DOCS, csv_text, figures_wanted, filled, keep_figure, sheet, write
from scipy.interpolate import CubicHermiteSpline

import sweeps
from engine_dyn.engine import Engine
from engine_dyn.forces.torque import pressure
from engine_dyn.geometry.toothed_wheel import TURN, wheel_from_text
from engine_dyn.recordings.cylinder_geometry import CylinderGeometry
from engine_dyn.recordings.cylinder_work import (
    MeanCycle,
    WheelNoise,
    WorkEstimator,
    combustion_torque,
    detection,
    energy_deviation,
    work_estimator,
)
from engine_dyn.recordings.tooth_errors import speed_through_wheel
from engine_dyn.types import Floats
from engine_dyn.units import BAR, DEGREE, RPM
from oracle.teeth import write_times
from sweeps.scene.engine.engine_files import load_engine
from sweeps.view.figures.marks import DASHES, shade
from sweeps.view.texts.lab_texts import deviations_text

TEMPLATE = Path(__file__).with_suffix(".md.in")
DOCUMENT = DOCS / "misfire_detection.md"
BESIDE = DOCS / "misfire"

ENGINES = {"si_four_87x101": "four cylinders", "v6_96x81": "six cylinders"}
WHEEL = wheel_from_text("60-2")
GAP = 78.0 * DEGREE
"""Crank angle after dead centre of cylinder 1 at which the first tooth passes; any would do."""

SAMPLES = 1440
PERIOD = 4.0 * np.pi
IDLE, IDLE_DISPERSION, FULL_DISPERSION = 1.0 * BAR, 0.10, 0.03
FALSE_ALARMS, WANTED = 1e-4, 0.99
EARLIER = 100
"""Number of cycles in the engine's own mean, and in which a dead cylinder is searched."""

EARLIER_DRAWN = 20
"""Number of such cycles with drawn speeds, less to save time."""

HEAVIER = (2.0, 4.0)
"""Factors on the inertia whose limits the figure shows too."""

NORMAL = NormalDist()
SEED = 21


class Case(NamedTuple):
    """A case: the misfires to detect, and the known errors of the wheel."""

    title: str  # title in figure and tables
    constant: float  # errors of intervals that repeat every turn, unknown, over the size
    passage: float  # errors of each passing tooth, over the size that the map gives
    reference_cycles: float = np.inf  # see `work_estimator`
    averaged: int | None = None  # see `work_estimator`

    def noise(self, size: float) -> WheelNoise:
        """Errors of the wheel at a size, in shares of a pitch."""
        return WheelNoise(self.constant * size, 0.0, self.passage * size)


UNKNOWN = Case("missed cycle, teeth not learned", 1.0, 0.2)
LEARNED = Case("missed cycle, teeth learned", 0.0, 1.0, EARLIER)
DEAD = Case("dead cylinder, teeth not learned", 1.0, 0.2, averaged=EARLIER)
CASES = (UNKNOWN, LEARNED, DEAD)
WANTED_SIZE = 0.001
SIZES = 1e-3 * np.array([0.25, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 5.0, 8.0, 14.0, 25.0])


class Motor:
    """An engine of the catalogue over speed and imep, on a rigid crank."""

    def __init__(self, name: str) -> None:
        """Read the engine and find the imep of its diagrams."""
        self.engine: Engine = load_engine(name)
        values = self.engine.values
        self.geometry = CylinderGeometry(values["bore"], values["stroke"], values["crank_ratio"])
        arrangement = self.engine.own_cylinders.arrangement  # type: ignore[union-attr]
        self.firing = tuple(float(a) for a in arrangement.firing_angles)  # type: ignore[union-attr]
        self.angle = (np.arange(SAMPLES) / SAMPLES - 0.5) * PERIOD
        self.rows = np.linspace(0, self.engine.family.row_count - 1, 15)
        self.diagrams = [self._pressures(row) for row in self.rows]
        self.imeps = np.array([self.imep(fired) for fired, _ in self.diagrams])
        share = values["rod_mass"] * values["rod_centre_of_gravity"]
        rod = values["stroke"] / 2.0 / values["crank_ratio"]
        mass = values["piston_mass"] + share / rod
        single = mass * (self.geometry.volume_slope(self.angle) / self.geometry.area) ** 2
        swing = self.of_all(single)
        self.inertia = values["inertia"] + swing - swing.mean()

    def _pressures(self, row: float) -> tuple[Floats, Floats]:
        family: Any = self.engine.family
        fired, motored = (pressure(self.angle, family, row, 1.0, f) for f in (1.0, 0.0))
        return fired, motored

    def imep(self, fired: Floats) -> float:
        """Indicated mean effective pressure of the whole cycle [Pa]."""
        torque = fired * self.geometry.volume_slope(self.angle)
        return float(torque.mean() * PERIOD / self.geometry.swept_volume)

    @property
    def highest(self) -> float:
        """Imep at full load [Pa]."""
        return float(self.imeps[-1])

    def dispersion(self, imep: float) -> float:
        """Relative standard deviation: a power of imep between idle and full load."""
        slope = np.log(FULL_DISPERSION / IDLE_DISPERSION) / np.log(self.highest / IDLE)
        return float(IDLE_DISPERSION * (imep / IDLE) ** slope)

    def pressures(self, imep: float) -> tuple[Floats, Floats]:
        """Fired and motored at an imep; below the lowest load, with less of its combustion."""
        if imep < self.imeps[0]:
            fired, motored = self.diagrams[0]
            none = self.imep(motored)
            return motored + (imep - none) / (self.imeps[0] - none) * (fired - motored), motored
        upper = int(np.clip(np.searchsorted(self.imeps, imep), 1, len(self.rows) - 1))
        share = (imep - self.imeps[upper - 1]) / (self.imeps[upper] - self.imeps[upper - 1])
        low, high = self.diagrams[upper - 1 : upper + 1]
        fired, motored = ((1.0 - share) * a + share * b for a, b in zip(low, high, strict=True))
        return fired, motored

    def of_all(self, single: Floats) -> Floats:
        """Sum over the cylinders of what one does over the angle from its own dead centre."""
        shifts = [round(firing / PERIOD * SAMPLES) for firing in self.firing]
        return np.asarray(sum(np.roll(single, shift) for shift in shifts))

    def cycle(self, speed: float, imep: float) -> tuple[MeanCycle, float]:
        """Mean cycle, and the imep that a missed one lacks [Pa].

        The load torque is constant over the cycle: that of a car, which its driveline parts from
        the engine at these frequencies. Where the crank would stop within the cycle, the speed
        is refused with ValueError.
        """
        fired, motored = self.pressures(imep)
        torque = self.of_all(fired * self.geometry.volume_slope(self.angle))
        torque = torque - torque.mean()
        work = np.cumsum(torque + np.roll(torque, 1)) * (0.5 * PERIOD / SAMPLES)
        energy = 0.5 * self.inertia.mean() * speed**2
        for _ in range(60):  # the mean speed is given instead of the energy
            with np.errstate(invalid="ignore"):
                omega = np.sqrt(2.0 * (energy + work - work.mean()) / self.inertia)
            if not np.all(omega > 0.1 * speed):
                raise ValueError(f"the crank stops within the cycle at {speed / RPM:.0f} rpm")
            energy *= (speed / omega.mean()) ** 2
        lacking = self.imep(fired) - self.imep(motored)
        combustion = combustion_torque(self.angle, fired, motored, self.geometry)
        return (
            MeanCycle(self.angle, omega, self.inertia, combustion, self.firing, PERIOD), lacking
        )  # fmt: skip


def estimator_at(
    motor: Motor, speed: float, imep: float, case: Case, size: float = WANTED_SIZE
) -> tuple[WorkEstimator, float]:
    """Estimator at one point of the map, and the imep missing in a misfire [Pa]."""
    cycle, lacking = motor.cycle(speed, imep)
    found = work_estimator(
        cycle, WHEEL, GAP, case.noise(size), dispersion=motor.dispersion(imep) * imep,
        reference_cycles=case.reference_cycles, averaged=case.averaged,
    )  # fmt: skip
    return found, lacking


def margin(motor: Motor, speed: float, imep: float, case: Case, size: float) -> float:
    """Least distance of a missed cycle from the threshold, in its standard deviations."""
    found, lacking = estimator_at(motor, speed, imep, case, size)
    return float(detection(found, lacking, FALSE_ALARMS).margin.min())


def largest_errors(motor: Motor, speed: float, imep: float, case: Case) -> float:
    """Size of the errors, in shares of a pitch, up to which enough is detected."""
    wanted = NORMAL.inv_cdf(WANTED)
    last, at = np.inf, SIZES[0]
    for size in SIZES:
        now = margin(motor, speed, imep, case, float(size))
        if now < wanted:
            if not np.isfinite(last):
                return float(size)  # below the smallest size that is tried
            share = (last - wanted) / (last - now)
            return float(at * (size / at) ** share)
        last, at = now, float(size)
    return float(SIZES[-1])


# Speeds drawn at random ---------------------------------------------------------------------------


def drawn_speeds(
    motor: Motor, speed: float, imep: float, factors: Floats, noise: WheelNoise,
    rng: np.random.Generator,
) -> Floats:  # fmt: skip
    """Raw speeds of recordings: equation of motion over the angle, then the wheel.

    Nothing is shared with the estimator but the diagrams: Simpson's rule for the energy, which is
    known over the angle, true places of teeth, times between them.

    Parameters
    ----------
    factors : ndarray, shape (recordings, cycles, cylinders)
        On the pressure above the motored one.

    Returns
    -------
    ndarray, shape (recordings, cycles - 1, intervals)
        [rad/s]; the first begins with the first tooth of cycle 0.
    """
    recordings, cycles, _ = factors.shape
    cycle, _ = motor.cycle(speed, imep)
    fired, motored = motor.pressures(imep)
    slope = motor.geometry.volume_slope(motor.angle)
    extra, carried = (fired - motored) * slope, motor.of_all(motored * slope)
    mean = float((carried + motor.of_all(extra)).mean())
    step = PERIOD / SAMPLES
    inertia = np.append(motor.inertia, motor.inertia[0])

    def torque_of(number: int) -> Floats:
        """Torque over one cycle; cylinders that fire late in the one before still work."""
        now, before = factors[:, number], factors[:, max(number - 1, 0)]
        found = np.tile(carried, (recordings, 1))
        for place, firing in enumerate(motor.firing):
            start = round(firing / step)
            rolled = np.roll(extra, start)
            found[:, start:] += now[:, place, None] * rolled[start:]
            found[:, :start] += before[:, place, None] * rolled[:start]
        return found

    energy = np.full(recordings, 0.5 * inertia[0] * cycle.speed[0] ** 2)
    steady, torque = energy, torque_of(0)
    times, speeds = [np.zeros((recordings, 1))], [np.full((recordings, 1), cycle.speed[0])]
    for number in range(cycles):
        following = torque_of(min(number + 1, cycles - 1))
        # The governor is slow: the load follows the energy from cycle to cycle, not within one.
        load = mean + 0.05 * (energy - steady) / PERIOD
        rise = np.hstack([torque, following[:, :1]]) - load[:, None]
        left, middle, right = rise[:, :-1:2], rise[:, 1::2], rise[:, 2::2]
        after = energy[:, None] + np.cumsum(step / 3.0 * (left + 4.0 * middle + right), axis=1)
        before = np.hstack([energy[:, None], after[:, :-1]])
        between = before + step / 12.0 * (5.0 * left + 8.0 * middle - right)
        w0, w1, w2 = (
            np.sqrt(2.0 * part / inertia[first::2][: SAMPLES // 2])
            for first, part in enumerate((before, between, after))
        )
        passing = np.cumsum(step / 3.0 * (1.0 / w0 + 4.0 / w1 + 1.0 / w2), axis=1)
        times.append(times[-1][:, -1:] + passing)
        speeds.append(w2)
        energy, torque = after[:, -1], following
    return _seen(np.hstack(times), np.hstack(speeds), 2.0 * step, noise, rng)


def _seen(
    times: Floats, speeds: Floats, step: float, noise: WheelNoise, rng: np.random.Generator
) -> Floats:
    """Raw speeds from times over the angle, through one wheel with errors for each recording."""
    recordings = len(times)
    pitch = WHEEL.width.min()
    turns = 2 * ((times.shape[1] - 1) * step / PERIOD - 1.0)
    width = WHEEL.width + noise.interval * pitch * rng.standard_normal((recordings, WHEEL.teeth))
    width *= TURN / width.sum(axis=1, keepdims=True)
    within = np.cumsum(width, axis=1) - width
    edges = (TURN * np.arange(round(turns) + 1)[:, None] + within[:, None, :]).reshape(
        recordings, -1
    )[:, : round(turns) * WHEEL.teeth + 1]
    edges = edges + GAP + 0.5 * PERIOD + noise.passage * pitch * rng.standard_normal(edges.shape)
    angle = step * np.arange(times.shape[1])
    at = [
        CubicHermiteSpline(angle, *curves)(edge)
        for *curves, edge in zip(times, 1.0 / speeds, edges, strict=True)
    ]
    raw = np.tile(WHEEL.width, round(turns)) / np.diff(at, axis=1)
    return np.asarray(raw.reshape(recordings, -1, 2 * WHEEL.teeth))


class Counted(NamedTuple):
    """Rates by formula and of drawn speeds, of one cylinder and one cycle."""

    alarms_expected: float
    alarms: float
    found_expected: float
    found: float
    cycles: int


def counted(
    motor: Motor, speed: float, imep: float, case: Case, size: float = WANTED_SIZE,
    *, recordings: int = 240, false_alarms: float = 0.04, seed: int = SEED,
) -> Counted:  # fmt: skip
    """Judge drawn speeds with the thresholds of the formula.

    Rates of one in 10,000 are too rare to be counted in minutes: the threshold is set for four
    false alarms in a hundred cycles, and missed cycles lack only so much of their imep that some
    ninety in a hundred are found.
    """
    rng = np.random.default_rng(seed)
    first = EARLIER_DRAWN if np.isfinite(case.reference_cycles) else 0
    case = case._replace(reference_cycles=first or np.inf)
    estimator, lacking = estimator_at(motor, speed, imep, case, size)
    wanted = detection(estimator, lacking, false_alarms)
    ninety = NORMAL.inv_cdf(0.9) * (lacking + wanted.threshold) / wanted.margin
    share = float(np.max((ninety - wanted.threshold) / lacking))  # share of a cycle's combustion
    wanted = detection(estimator, share * lacking, false_alarms)
    cycles, number = first + 14, len(motor.firing)
    dispersion = motor.dispersion(imep) * imep / lacking
    factors = 1.0 + dispersion * rng.standard_normal((recordings, cycles, number))
    missed = np.zeros(factors.shape, dtype=bool)
    spoilt = range(recordings // 2, recordings)  # the other recordings have normal cycles only
    for one in spoilt:
        missed[one, first + 3 :: 4, rng.integers(number)] = True
    missed[:, -2:] = False
    factors[missed] = 1.0 - share
    raw = drawn_speeds(motor, speed, imep, factors, case.noise(size), rng)
    if first:
        reference = raw[:, :first].mean(axis=1, keepdims=True)
    else:
        cycle, _ = motor.cycle(speed, imep)
        reference = speed_through_wheel(cycle.angle, cycle.speed, WHEEL, GAP, PERIOD)
    relative = energy_deviation(raw, reference)
    found = np.array([estimator.deviations(one) for one in relative])
    below = found < wanted.threshold
    known = np.isfinite(found)
    known[:, : first + 1] = False
    normal = below[: recordings // 2][known[: recordings // 2]]
    hits = missed[:, : found.shape[1]] & known
    each = -np.expm1(np.log1p(-false_alarms) / number)
    expected = np.broadcast_to(wanted.probability, found.shape)[hits].mean()
    return Counted(each, float(normal.mean()), float(expected), float(below[hits].mean()),
                   int(hits.sum()))  # fmt: skip


# Document -----------------------------------------------------------------------------------------

Rows = list[list[str]]
"""A table as rows of cells, heads first."""

Motors = dict[str, Motor]


def heavier(motor: Motor, factor: float) -> Motor:
    """The same engine with a larger flywheel."""
    other = copy(motor)
    other.inertia = motor.inertia + (factor - 1.0) * motor.inertia.mean()
    return other


def draw(motors: Motors) -> None:
    """The map: largest errors over speed and imep, and the limits with heavier flywheels."""
    levels = [0.1, 0.2, 0.5, 1.0, 2.0]
    colours = [shade(0.05 + 0.95 * i / len(levels)) for i in range(len(levels) + 1)]
    speed = np.linspace(800.0, 6000.0, 14) * RPM
    with sheet("misfire_map", (7.0, 4.9), 2, 3, sharex=True, sharey="row") as (figure, panels):
        for row, (name, motor) in zip(panels, motors.items(), strict=True):
            imep = np.geomspace(IDLE, motor.highest, 11)

            def over(found: Callable[[float, float], float], imep: Floats = imep) -> Floats:
                return np.array([[found(float(w), float(p)) for w in speed] for p in imep])

            for panel, case in zip(row, CASES, strict=True):
                errors = over(partial(largest_errors, motor, case=case))
                x, y = speed / RPM, imep / BAR
                filled_in = panel.contourf(
                    x, y, 100.0 * errors, levels, colors=colours, extend="both"
                )
                for factor, dashes in zip(HEAVIER, DASHES, strict=False):
                    other = heavier(motor, factor)
                    margins = over(partial(margin, other, case=case, size=WANTED_SIZE))
                    limit = panel.contour(
                        x, y, margins, [NORMAL.inv_cdf(WANTED)], colors="black",
                        linestyles=[dashes], linewidths=1.3,
                    )  # fmt: skip
                    limit.set(path_effects=[withStroke(linewidth=3.0, foreground="white")])
                panel.set_yscale("log")
                panel.set_yticks([1, 2, 5, 10], labels=["1", "2", "5", "10"])
                panel.minorticks_off()
                panel.grid(visible=False)
                panel.set_title(f"{ENGINES[name]}\n{case.title}")
            row[0].set_ylabel("imep (bar)")
        for panel in panels[-1]:
            panel.set_xlabel("Engine speed (rpm)")
        bar = figure.colorbar(filled_in, ax=panels, shrink=0.8, pad=0.02)
        bar.set_label("Largest tooth errors (% of a pitch)")
        figure.legend(
            handles=[Line2D([], [], color="black", linestyle=dashes, linewidth=1.3,
                            label=f"{factor:g} times the inertia")
                     for factor, dashes in zip(HEAVIER, DASHES, strict=False)],
            loc="outside lower center", ncols=2,
            title="Errors of 0.1 %: below and to the right of the line less than 99 % are detected",
        )  # fmt: skip


def limits_table(motors: Motors) -> Rows:
    rows = [["engine", "rpm", "imep, bar", *(case.title for case in CASES)]]
    for name, motor in motors.items():
        for rpm in (800.0, 2000.0, 4000.0, 6000.0):
            for imep in (1.0, 3.0, motor.highest / BAR):
                sizes = [largest_errors(motor, rpm * RPM, imep * BAR, case) for case in CASES]
                cells = ["above 2.5" if s >= SIZES[-1] else f"{100.0 * s:.2g}" for s in sizes]
                rows.append([ENGINES[name], f"{rpm:.0f}", f"{imep:.3g}", *cells])
    return rows


def corner_table(motors: Motors) -> Rows:
    """Errors that decide at the highest speed and the lowest load."""
    rows = [["engine, 6000 rpm, 1 bar", "error of a deviation, bar",
             "dispersion of the others, bar", "threshold, bar", "detected", "verdict"]]  # fmt: skip
    for name, motor in motors.items():
        variants: list[tuple[str, Motor, WheelNoise, float]] = [
            ("errors of intervals 0.1 %, 0.02 % a passage", motor, UNKNOWN.noise(1e-3), 1.0),
            ("errors of places 0.1 %, 0.02 % a passage", motor, WheelNoise(0, 1e-3, 2e-4), 1.0),
            ("errors known, 0.02 % a passage", motor, WheelNoise(0, 0, 2e-4), 1.0),
            ("errors known, 0.1 % a passage", motor, WheelNoise(0, 0, 1e-3), 1.0),
            ("errors of intervals 0.2 %, 0.04 % a passage", motor, UNKNOWN.noise(2e-3), 1.0),
            ("the first, twice the inertia", heavier(motor, 2.0), UNKNOWN.noise(1e-3), 1.0),
            ("the first, four times the inertia", heavier(motor, 4.0), UNKNOWN.noise(1e-3), 1.0),
            ("the first, dispersion 20 %", motor, UNKNOWN.noise(1e-3), 2.0),
        ]
        for text, one, noise, factor in variants:
            cycle, lacking = one.cycle(6000.0 * RPM, IDLE)
            found = work_estimator(cycle, WHEEL, GAP, noise, dispersion=factor * 0.1 * IDLE)
            judged = detection(found, lacking, FALSE_ALARMS)
            worst = int(judged.margin.argmin())
            share = float(judged.probability[worst])
            detected = "more than 99.9 %" if share > 0.999 else f"{100.0 * share:.1f} %"
            rows.append([
                f"{ENGINES[name]}: {text}", f"{found.noise[worst] / BAR:.3f}",
                f"{found.others[worst] / BAR:.3f}", f"{judged.threshold[worst] / BAR:.2f}",
                detected, "" if share > WANTED else "fails",
            ])  # fmt: skip
    return rows


def counted_table(motors: Motors) -> Rows:
    rows = [["engine", "rpm", "imep, bar", "looked for", "false alarms by formula", "counted",
             "detected by formula", "counted", "missed cycles"]]  # fmt: skip
    four, six = motors
    points = [
        (four, 6000.0, 1.0, UNKNOWN), (four, 1500.0, 8.0, UNKNOWN), (six, 6000.0, 1.0, UNKNOWN),
        (four, 3000.0, 4.0, LEARNED), (six, 6000.0, 1.0, LEARNED),
    ]  # fmt: skip
    for seed, (name, rpm, imep, case) in enumerate(points, SEED):
        one = counted(motors[name], rpm * RPM, imep * BAR, case, recordings=1600, seed=seed)
        alarms = (f"{100 * rate:.2f} %" for rate in (one.alarms_expected, one.alarms))
        found = (f"{100 * rate:.1f} %" for rate in (one.found_expected, one.found))
        point = [ENGINES[name], f"{rpm:.0f}", f"{imep:g}", case.title]
        rows.append([*point, *alarms, *found, str(one.cycles)])
    return rows


def example(motor: Motor) -> xr.Dataset:
    """What the command finds: one weak cylinder and three missed cycles, at 2500 rpm."""
    rng = np.random.default_rng(SEED)
    factors = 1.0 + 0.05 * rng.standard_normal((1, 101, len(motor.firing)))
    factors += np.array([1.0, -3.0, 1.0, 1.0]) * 0.06  # keeps the mean speed
    for cycle, cylinder in ((20, 2), (60, 0), (61, 3)):
        factors[0, cycle, cylinder] = 0.0
    speed, row = 2500.0 * RPM, len(motor.rows) // 2
    (raw,) = drawn_speeds(motor, speed, motor.imeps[row], factors, WheelNoise(), rng)
    times = np.concatenate([[0.0], np.cumsum(np.tile(WHEEL.width, 2 * len(raw)) / raw.ravel())])
    loads: Any = motor.engine.family
    load = float(np.interp(motor.rows[row], range(loads.row_count), loads.row_loads))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "teeth.csv"
        write_times(path, times)
        return sweeps.cylinder_deviations({
            "engine": motor.engine.name,
            "set": {"speed": float(np.mean(raw)) / RPM, "load": load, "load_exponent": 0.0},
            "measured": {"file": str(path), "kind": "teeth", "wheel": WHEEL.text,
                         "gap_angle": GAP / DEGREE},
            "output": {"quantities": ["delta"]},
        })  # fmt: skip


TABLES: dict[str, Callable[[Motors], Rows]] = {
    "limits": limits_table, "corner": corner_table, "counted": counted_table,
}  # fmt: skip


def main() -> None:
    with_figures = figures_wanted("Write docs/misfire_detection.md.")
    motors = {name: Motor(name) for name in ENGINES}
    numbers: dict[str, str] = {}
    for name, motor in motors.items():
        lost = motor.cycle(6000.0 * RPM, motor.highest)[1] * motor.geometry.swept_volume
        stop = np.sqrt(2.0 * lost / motor.inertia.mean()) / RPM
        number = ENGINES[name].split()[0]
        numbers[f"stop_{number}"] = f"{stop:.0f}"
        numbers[f"highest_{number}"] = f"{motor.highest / BAR:.1f}"
    write({
        DOCUMENT: filled(TEMPLATE.read_text(encoding="utf-8"), numbers),
        **{BESIDE / f"{name}.csv": csv_text(make(motors)) for name, make in TABLES.items()},
    })  # fmt: skip
    if with_figures:
        found = example(motors["si_four_87x101"])
        keep_figure(found, "cylinder_deviations")
        print(deviations_text(found))
        draw(motors)


if __name__ == "__main__":
    main()
