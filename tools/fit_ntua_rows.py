"""Fit one free pressure curve of the NTUA engine to all of Kakaitsas's rows at 50 % load.

The engine `ntua` has a modelled cycle that is fitted to six figures; what it gives for the other
rows is a prediction. This script answers another question: is there one pressure curve that gives
all rows? It writes the engine `ntua_all_rows`, which is a fit, and no prediction, of these rows.

The curve is the modelled one plus a periodic cubic spline with a knot every 10 degrees. Its 72
values are found by least squares: each printed number has the tolerance that its printed digits
leave, and the correction is held small (`allowed`) and smooth (`ROUGHNESS`). What is aimed at:

    delta of the printed omegas (3.6) in the 20 rows at 50 % load;
    M_max/M_mean and M_max - M_min with 1, 2, 4, 6 and 8 cylinders (section 5.4);
    p_max (from the friction torque), p_max/p_min "about 65", the mean torque (from k).

Run it from the project's root after tools/calibrate_ntua.py: `python tools/fit_ntua_rows.py`. It is
deterministic and writes `ntua_all_rows.toml` and its table of points beside `ntua.toml`.
"""

from __future__ import annotations

import math
from typing import Any

import calibrate_ntua
import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from thesis_study import (
    Printed,
    displacement,
    ntua,
    range_of,
    range_of_delta,
    read_printed,
    thesis_scene,
)

from engine_dyn import Diagram, diagram_from_points, family_from_diagrams, periodic_speed
from engine_dyn.forces.superposition import CrankTrain
from engine_dyn.forces.torque import GasPressure, gas_torque, inertia_torque
from engine_dyn.loads import friction
from engine_dyn.types import Floats
from engine_dyn.units import BAR, DEGREE, RPM

FOLDER = calibrate_ntua.ROOT / "sweeps" / "catalogue" / "engines"
NAME = "ntua_all_rows"
LOAD = 50

KNOTS = np.arange(-360.0, 360.0, 10.0)
"""Degrees at which the correction has a value of its own."""

ROUGHNESS = 0.005
"""Usual second derivative of the correction [bar/degree^2]. With 0.003 the row of four cylinders
stays 0.18 % off, with 0.01 the expansion gets a second wave; between them little changes."""

BLOW_DOWN = (130.0, 200.0)
"""Degrees between which the pressure depends on valves that nothing is known of."""

CYLINDERS = (1, 2, 4, 6, 8)
SHARP = 0.2
"""Width [N m] within which two extremes that tie both count, so that steps do not jump."""

STEPS = 14


def allowed(pressure: Floats) -> Floats:
    """Usual size of the correction [bar] at the knots: 5 % of the pressure, 1 bar at blow-down."""
    first, last = BLOW_DOWN
    return np.where((first <= KNOTS) & (last >= KNOTS), 1.0, 0.05 * pressure)


class Rows:
    """What is printed of the rows at 50 % load, and the same computed from a pressure curve."""

    def __init__(self, printed: Printed) -> None:
        designs = thesis_scene()["designs"]
        self.designs = [
            {name: column[place] for name, column in designs.items()}
            for place, load in enumerate(designs["load"])
            if load == LOAD
        ]
        self.names: list[str] = []
        self.aims: list[float] = []
        self.tolerances: list[float] = []
        for row in self.designs:
            low, high = range_of_delta(printed.rows[row["case"]])
            self._add(f"delta, {row['case']}", printed.number(row["case"], "delta"), high - low)
        for count in CYLINDERS:
            case = "nominal" if count == 1 else f"{count} cylinders"
            for quantity in ("torque_ratio", "torque_range"):
                low, high = range_of(printed.rows[case][quantity])
                self._add(f"{quantity}, {case}", printed.number(case, quantity), high - low)
        goals = calibrate_ntua.targets()[LOAD]
        for name, aim, tolerance in (
            ("p_max", goals[0], 0.002),
            ("p_min", goals[5], 0.01),
            ("torque_mean", goals[1], 0.05),
        ):
            self.names.append(name)
            self.aims.append(float(aim))
            self.tolerances.append(tolerance)

    def _add(self, name: str, aim: float, width: float) -> None:
        """Add a printed number: a quarter of what its digits leave, or 0.02 % for extremes."""
        least = 2e-4 if "torque" in name else 2e-5
        self.names.append(name)
        self.aims.append(aim)
        self.tolerances.append(max(0.25 * width, least * aim))

    def computed(self, diagram: Diagram, sharp: float = SHARP) -> Floats:
        """The same numbers of a diagram; `sharp` = 0 takes extremes as they are."""
        found = [_delta(row, diagram) for row in self.designs]
        for count in CYLINDERS:
            total = _torque(diagram, count)
            highest, lowest = _largest(total, sharp), -_largest(-total, sharp)
            found += [highest / float(total.mean()), highest - lowest]
        mean = float(_torque(diagram, 1).mean())
        return np.array([*found, diagram.peak / BAR, diagram.pressure.min() / BAR, mean])


def _largest(values: Floats, sharp: float) -> float:
    """Largest value; within `sharp` of it, others count as well (logarithm of a sum)."""
    top = float(values.max())
    if sharp == 0.0:
        return top
    return top + sharp * math.log(float(np.exp((values - top) / sharp).sum()))


def _friction(diagram: Diagram, speed: float) -> float:
    """Friction torque [N m] of one cylinder, (3.8) and (3.9)."""
    constant, share, speed_share = calibrate_ntua.FRICTION
    fmep = friction.friction_mean_effective_pressure(
        constant * BAR,
        share,
        speed_share * BAR,
        diagram.peak,
        friction.mean_piston_speed(calibrate_ntua.STROKE, speed),
    )
    return float(friction.friction_torque(fmep, displacement(), calibrate_ntua.PERIOD))


def _delta(row: dict[str, Any], diagram: Diagram) -> float:
    """Coefficient of speed fluctuation of a row of the scene `thesis`, as published."""
    speed = row["speed"] * RPM
    return periodic_speed(
        diagram,
        bore=calibrate_ntua.BORE,
        stroke=calibrate_ntua.STROKE,
        crank_ratio=row["crank_ratio"],
        reciprocating_mass=row["reciprocating_mass"],
        inertia=row["inertia"],
        speed=speed,
        cylinders=row["cylinders"],
        load_exponent=row["load_exponent"],
        friction_torque=row["cylinders"] * _friction(diagram, speed),
        crankcase_pressure=0.0,
        method="thesis",
        passes=row["passes"],
        start_speed=row["start_speed"],
        start_angle=row["start_angle"] * DEGREE,
    ).delta


def _torque(diagram: Diagram, cylinders: int) -> Floats:
    """Total torque [N m] at 1 degree, 1200 rpm, absolute pressure on the piston."""
    phi = np.deg2rad(np.arange(-360.0, 360.0))
    family = family_from_diagrams([0.0], [diagram])
    train = CrankTrain(
        calibrate_ntua.CRANK_RATIO, calibrate_ntua.STROKE, cylinders, calibrate_ntua.PERIOD
    )
    gas = gas_torque(phi, train, calibrate_ntua.BORE, GasPressure(family, 0.0, 1.0, 0.0))
    inertia = inertia_torque(phi, train, 6.67, calibrate_ntua.OMEGA)
    lost = cylinders * _friction(diagram, calibrate_ntua.OMEGA)
    return np.asarray(gas + inertia - lost, dtype=np.float64)


def modelled() -> Diagram:
    """The modelled cycle of the engine `ntua` at 50 % load."""
    family = ntua().family
    return family.diagrams[list(family.loads).index(float(LOAD))]


def splines(degrees: Floats) -> Floats:
    """Values of the periodic spline that is 1 at one knot and 0 at the others, by columns."""
    ends = np.append(KNOTS, 360.0)
    units = np.vstack([np.eye(len(KNOTS)), np.eye(len(KNOTS))[:1]])
    return np.asarray(CubicSpline(ends, units, bc_type="periodic")(degrees), dtype=np.float64)


def fit(rows: Rows) -> tuple[Floats, Floats, Floats]:
    """Find the correction that gives the rows.

    Gauss-Newton steps; of the curves that they pass, the one with the least sum of squares counts,
    because the largest torque of two cylinders changes from one crest to another.

    Returns
    -------
    degrees : ndarray
    pressure, correction : ndarray
        In bar.
    """
    base = modelled()
    degrees = np.rad2deg(base.angle)
    own = base.pressure / BAR
    shapes = splines(degrees)
    step = KNOTS[1] - KNOTS[0]
    identity = np.eye(len(KNOTS))
    second = np.roll(identity, 1, 1) - 2.0 * identity + np.roll(identity, -1, 1)
    size = np.diag(1.0 / allowed(np.interp(KNOTS, degrees, own)))
    prior = np.vstack([second / step**2 / ROUGHNESS, size])
    aims, tolerances = np.array(rows.aims), np.array(rows.tolerances)

    def computed(values: Floats) -> Floats:
        return rows.computed(diagram_from_points(base.angle, (own + shapes @ values) * BAR))

    values = np.zeros(len(KNOTS))
    best, least = values, math.inf
    for number in range(STEPS):
        off = (computed(values) - aims) / tolerances
        squares = float(np.sum((prior @ values) ** 2) + np.sum(off**2))
        if squares < least:
            best, least = values, squares
        half = 1e-3
        changes = [
            (computed(values + half * unit) - computed(values - half * unit)) / (2.0 * half)
            for unit in identity
        ]
        jacobian = np.stack(changes, axis=1) / tolerances[:, None]
        found = np.linalg.lstsq(
            np.vstack([prior, jacobian]), -np.concatenate([prior @ values, off]), rcond=None
        )[0]
        values = values + (1.0 if number < 2 else 0.5) * found
    correction = shapes @ best
    return degrees, own + correction, correction


HEADER = """\
# Written by tools/fit_ntua_rows.py; change that, not this.
# The engine `ntua` with one free pressure curve that is fitted to all 20 rows at 50 % load of
# Kakaitsas's tables and to the torques of section 5.4. The curve answers whether one diagram gives
# them all; nothing that it gives at 50 % load is a prediction. The predictions are those of `ntua`.
"""

POINTS_HEADER = """\
# Cylinder pressure of the engine ntua_all_rows. Written by tools/fit_ntua_rows.py; change that.
# Not measured and not printed: the modelled cycle of ntua at 50 % load plus a correction that is
# fitted to Kakaitsas's rows at that load (see the script and docs/validation.md).
crank_angle_deg,pressure_bar
"""


def engine_file() -> str:
    """The engine file: that of `ntua` with another name, title and diagram."""
    lines = calibrate_ntua.HEADER.split('name = "ntua"', 1)[1].splitlines()
    lines[1] = 'title = "NTUA engine 140/180 mm, pressure fitted to all rows at 50 % load"'
    values = "\n".join([HEADER, f'name = "{NAME}"', *lines[1:]])
    diagram = f'\n\n[[diagram]]\nload = {LOAD}\nkind = "points"\nfile = "{NAME}_pressure.csv"\n\n'
    assumed = '[assumed]\ndiagram = "Not printed: fitted to printed rows (tools/fit_ntua_rows.py)."'
    kept = calibrate_ntua.FOOTER.splitlines()
    offset, crankcase = (next(x for x in kept if x.startswith(k)) for k in ("load_o", "crankc"))
    source = calibrate_ntua.FOOTER.split("[[source]]")[1]
    return f"{values}{diagram}{assumed}\n{offset}\n{crankcase}\n\n[[source]]{source.rstrip()}\n"


def main() -> None:
    rows = Rows(read_printed())
    degrees, pressure, correction = fit(rows)
    (FOLDER / f"{NAME}.toml").write_text(engine_file(), encoding="utf-8")
    points = [f"{a:.1f},{p:.5f}" for a, p in zip(degrees, pressure, strict=True)]
    text = POINTS_HEADER + "\n".join(points) + "\n"
    (FOLDER / f"{NAME}_pressure.csv").write_text(text, encoding="utf-8")
    diagram = diagram_from_points(np.deg2rad(degrees), np.round(pressure, 5) * BAR)
    before, after = rows.computed(modelled(), 0.0), rows.computed(diagram, 0.0)
    for name, aim, own, found in zip(rows.names, rows.aims, before, after, strict=True):
        print(
            f"{name:32s} printed {aim:11.5f}  ntua {100 * (own / aim - 1):+7.3f} %"
            f"  fitted {100 * (found / aim - 1):+7.3f} %"
        )
    places: npt.NDArray[np.intp] = np.flatnonzero(np.isin(degrees, KNOTS))
    for place in places:
        print(f"{degrees[place]:6.0f} degrees: {correction[place]:+.3f} bar")


if __name__ == "__main__":
    main()
