"""Kakaitsas's study as printed and as computed: what tools/validation.py writes about.

Published values come from tests/reference with the digits that are printed, the designs from the
built-in scene `thesis`, what was fitted from tools/calibrate_ntua.py.
"""

from __future__ import annotations

import copy
import csv
import importlib
import math
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import calibrate_ntua
import numpy as np
import numpy.typing as npt

import engine_dyn
import sweeps
from engine_dyn.engine import Engine
from engine_dyn.geometry import masses
from engine_dyn.loads import friction
from engine_dyn.status import CONVERGED, MEANINGS
from engine_dyn.units import BAR, DEGREE, RPM
from sweeps.reading.engine_files import load_engine
from sweeps.scene.reading import built_in_scenes

if TYPE_CHECKING:
    import xarray as xr

ROOT = Path(__file__).resolve().parents[1]
REFERENCE = ROOT / "tests" / "reference"

PERIOD = 4.0 * math.pi
SLIP = 57.32  # printed in (4.2b) for 180/pi
CUT_SPEED = 125.6  # omega_n of 1200 rpm as the thesis cuts it, rad/s

SPEEDS = ("omega_max", "omega_min", "omega_mean")

LIMITS = (
    (("inertia", "mass", "lambda", "alpha", "speed 1000", "speed 2000"), 0.5),
    (("speed 3000", "speed 4000"), 1.2),
    (("2 cylinders",), 2.0),
    (("4 cylinders", "6 cylinders", "8 cylinders"), 3.0),
)
"""How the names of predicted rows begin, and how far delta as published may be off [percent]:
fixed before the diagrams were calibrated."""

AGREEMENT = {
    "delta": 1e-5,
    "omega_max": 1e-5,
    "omega_min": 1e-5,
    "omega_mean": 1e-7,
    "torque_mean": 2e-6,
}
"""Relative differences allowed to the independent solver, fixed before it was written."""

MOST_CYCLES = 60
"""Cycles tried for the rows with several cylinders."""

WITHOUT_SPEED = "without a speed"

Row = Mapping[str, str]


# --- printed --------------------------------------------------------------------------------------


def read_reference(name: str) -> list[dict[str, str]]:
    """Rows of a table in tests/reference, as text, so that the printed digits stay."""
    lines = (REFERENCE / name).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


@dataclass(frozen=True)
class Printed:
    """Numbers that Kakaitsas prints, and which of them were fitted.

    Attributes
    ----------
    rows : dict
        Section 5.2, Table 5.3 and section 5.4 by the names of the scene's designs, as text; blank
        or missing where nothing is printed.
    fitted : set of (str, str)
        Case and quantity that the diagrams were calibrated to.
    """

    rows: dict[str, dict[str, str]]
    fitted: set[tuple[str, str]]

    def number(self, case: str, name: str) -> float:
        """Return a printed number; delta is that of the printed omegas, (3.6)."""
        row = self.rows[case]
        if name == "delta":
            top, bottom, mean = (float(row[speed]) for speed in SPEEDS)
            return (top - bottom) / mean
        return float(row[name])


def read_printed() -> Printed:
    """Read the printed tables, and from the calibration script what was fitted.

    Raises
    ------
    RuntimeError
        If the calibration script aims at other numbers than are printed.
    """
    rows = {row["case"]: row for row in read_reference("kakaitsas_table_5_3.csv")}
    for row in read_reference("kakaitsas_table_5_4.csv"):
        row["torque_ratio"] = row.pop("torque_max_over_mean")
        row["torque_range"] = row.pop("torque_range_Nm")
        case = f"{row['cylinders']} cylinders"
        if row["cylinders"] == "1":
            case = "nominal"
        elif row["inertia_kgm2"] != "2":
            case += f", inertia {row['inertia_kgm2']}"
        rows[case] = {**rows.get(case, {}), **{key: text for key, text in row.items() if text}}
    other = {row["name"]: row["printed"] for row in read_reference("kakaitsas_other_numbers.csv")}

    nominal = rows["nominal"]
    # Case and quantity: what the script aims at, what is printed. Of the nominal row only the
    # swing is fitted, and with it delta.
    aims: dict[tuple[str, str], tuple[float, str]] = {
        ("nominal", "torque_ratio"): (calibrate_ntua.TORQUE_RATIO, nominal["torque_ratio"]),
        ("nominal", "torque_range"): (calibrate_ntua.TORQUE_RANGE, nominal["torque_range"]),
        ("nominal", "delta"): (
            calibrate_ntua.OMEGA_NOMINAL[0] - calibrate_ntua.OMEGA_NOMINAL[1],
            str(float(nominal["omega_max"]) - float(other["omega_min"])),
        ),
        ("nominal", "load_coefficient"): (
            calibrate_ntua.LOAD_COEFFICIENT,
            other["load_coefficient"],
        ),
        ("nominal", "pressure_ratio"): (calibrate_ntua.PRESSURE_RATIO, other["pressure_ratio"]),
    }
    for load, torque in calibrate_ntua.FRICTION_TORQUE.items():
        name = f"friction_torque_{load}"
        aims["nominal", name] = (torque, other[name])
    for case, omegas in (
        ("load 0", calibrate_ntua.OMEGA_IDLE),
        ("load 90", calibrate_ntua.OMEGA_90),
    ):
        for name, omega in zip(SPEEDS, omegas, strict=True):
            aims[case, name] = (omega, rows[case][name])
        aims[case, "delta"] = aims[case, "omega_mean"]
    wrong = [key for key, (aim, text) in aims.items() if aim != float(text)]
    if wrong:
        raise RuntimeError(f"tools/calibrate_ntua.py aims at other numbers than printed: {wrong}")
    return Printed(rows, set(aims))


def range_of(text: str) -> tuple[float, float]:
    """Values that a printed number may stand for, whether it was cut or rounded."""
    unit = 10.0 ** -len(text.partition(".")[2])
    value = float(text)
    # Cutting goes towards zero.
    low, high = (-1.0, 0.5) if text.startswith("-") else (-0.5, 1.0)
    return value + low * unit, value + high * unit


def range_of_delta(row: Row) -> tuple[float, float]:
    """Values of (3.6) that the printed omegas of a row leave open."""
    top, bottom, mean = (range_of(row[name]) for name in SPEEDS)
    return (top[0] - bottom[1]) / mean[1], (top[1] - bottom[0]) / mean[0]


# --- computed -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Study:
    """The 22 designs of the built-in scene `thesis`, computed in several ways.

    Attributes
    ----------
    cases : list of str
        Names of the designs.
    published : xarray.Dataset
        The scene as it stands: the thesis's procedure.
    as_made : xarray.Dataset
        The same with omega_n cut everywhere and with the slip of (4.2b).
    repeated : xarray.Dataset
        Explicit Euler until a cycle closes within 1e-6 rad/s.
    periodic, gauge : xarray.Dataset
        The periodic solution, without and with the pressure of the crankcase.
    """

    cases: list[str]
    published: xr.Dataset
    as_made: xr.Dataset
    repeated: xr.Dataset
    periodic: xr.Dataset
    gauge: xr.Dataset

    def at(self, which: str, quantity: str, case: str) -> float:
        """One number of one of the datasets."""
        return float(getattr(self, which)[quantity].values[self.cases.index(case)])

    def several(self) -> list[str]:
        """Names of the designs with more than one cylinder."""
        return [case for case in self.cases if "cylinders" in case]

    def sampled_torque(self, case: str) -> dict[str, float]:
        """M_max/M_mean and M_max - M_min [N m] of samples at one degree, as the thesis has them."""
        place = self.cases.index(case)
        curve = self.published["torque"].values[place]
        mean = float(self.published["torque_mean"].values[place])
        return {"torque_ratio": float(curve.max()) / mean, "torque_range": float(np.ptp(curve))}


def thesis_scene() -> dict[str, Any]:
    """Return the built-in scene as a dict, without its published values."""
    scene = tomllib.loads(built_in_scenes()["thesis"].read_text(encoding="utf-8"))
    del scene["reference"]
    return scene


def make_as_made(designs: dict[str, Any]) -> None:
    """Change columns of the scene so that omega_n is the cut one everywhere, and the slip 57.32.

    A step of 1/57.32 rad instead of one degree does what a larger inertia does.
    """
    designs["inertia"] = [value * SLIP * DEGREE for value in designs["inertia"]]
    designs["speed"] = [omega / RPM for omega in designs["start_speed"]]


def run_study() -> Study:
    """Compute the thesis's designs in all ways that the document shows."""
    base = thesis_scene()
    asked = ["delta", *SPEEDS, "torque_ratio", "torque_range"]

    def variant(change: Callable[[dict[str, Any]], object]) -> xr.Dataset:
        scene = copy.deepcopy(base)
        scene["output"] = {"quantities": asked}
        change(scene)
        return sweeps.run(scene)

    def periodic(scene: dict[str, Any]) -> None:
        scene["solver"]["method"] = "auto"
        for column in ("passes", "start_speed", "start_angle"):
            del scene["designs"][column]

    def gauge(scene: dict[str, Any]) -> None:
        periodic(scene)
        del scene["set"]["crankcase_pressure"]

    return Study(
        cases=list(base["designs"]["case"]),
        published=sweeps.run("thesis"),
        as_made=variant(lambda scene: make_as_made(scene["designs"])),
        repeated=variant(lambda scene: scene["designs"].pop("passes")),
        periodic=variant(periodic),
        gauge=variant(gauge),
    )


def run_all_rows() -> Study:
    """The same study at 50 % load with the engine whose pressure is fitted to all these rows."""
    base = thesis_scene()
    designs = base["designs"]
    kept = [place for place, load in enumerate(designs["load"]) if load == 50]
    base["designs"] = {name: [column[k] for k in kept] for name, column in designs.items()}
    base["engine"] = "ntua_all_rows"
    published = sweeps.run(base)
    return Study(list(base["designs"]["case"]), published, *[published] * 4)


def misfit_over_cycles(case: str, printed: Printed, *, cut_speed: bool) -> npt.NDArray[np.float64]:
    """Root mean square difference of the three printed omegas [rad/s] after 1, 2, ... cycles."""
    scene = thesis_scene()
    place = scene["designs"].pop("case").index(case)
    scene["designs"] = {
        key: [column[place]] * MOST_CYCLES for key, column in scene["designs"].items()
    }
    scene["designs"]["passes"] = list(range(1, MOST_CYCLES + 1))
    if cut_speed:
        make_as_made(scene["designs"])
    scene["output"] = {"quantities": list(SPEEDS)}
    computed = sweeps.run(scene)
    squares = [(computed[name].values - printed.number(case, name)) ** 2 for name in SPEEDS]
    return np.asarray(np.sqrt(np.mean(squares, axis=0)), dtype=np.float64)


# --- the nominal engine ---------------------------------------------------------------------------


def ntua() -> Engine:
    """Return the catalogue engine."""
    return load_engine("ntua", Path())


def displacement() -> float:
    """Displacement of one cylinder [m3]."""
    own = ntua().values
    return 0.25 * math.pi * own["bore"] ** 2 * own["stroke"]


def nominal_speed(**changes: Any) -> engine_dyn.PeriodicSpeed:
    """Speed of the nominal engine of the thesis, absolute pressure on the piston.

    `rpm` changes the speed and the friction with it; all else goes to `periodic_speed`.
    """
    engine = ntua()
    own = engine.values
    diagram = engine.family.diagrams[list(engine.family.loads).index(50.0)]
    speed = changes.pop("rpm", own["speed"]) * RPM
    fmep = friction.friction_mean_effective_pressure(
        own["friction_constant"] * BAR,
        own["friction_peak_pressure"],
        own["friction_mean_piston_speed"] * BAR,
        diagram.peak,
        friction.mean_piston_speed(own["stroke"], speed),
    )
    given: dict[str, Any] = {
        "bore": own["bore"],
        "stroke": own["stroke"],
        "crank_ratio": own["crank_ratio"],
        "reciprocating_mass": 6.67,  # rounded, as in the thesis
        "inertia": own["inertia"],
        "speed": speed,
        "load_exponent": own["load_exponent"],
        "friction_torque": float(friction.friction_torque(fmep, displacement(), PERIOD)),
        "crankcase_pressure": 0.0,
    }
    return engine_dyn.periodic_speed(diagram, **{**given, **changes})


def other_values(study: Study) -> dict[str, float]:
    """Ours for every number of kakaitsas_other_numbers.csv, by its name."""
    own = ntua().values
    rod, centre = own["rod_mass"], own["rod_centre_of_gravity"]
    length = 0.5 * own["stroke"] / own["crank_ratio"]
    nominal = study.published.isel(design=0)

    def at_piston(rod_length: float) -> float:
        return float(masses.rod_mass_at_piston(rod, centre, rod_length))

    def change(case: str, base: str) -> float:
        return percent(study.at("published", "delta", case), study.at("published", "delta", base))

    found = {
        "rod_mass_at_piston": at_piston(length),
        "reciprocating_mass": own["piston_mass"] + at_piston(length),
        "rod_mass_at_crank": float(masses.rod_mass_at_crank(rod, centre, length)),
        "rotating_mass": float(masses.rotating_mass(own["crank_mass"], rod, centre, length)),
        "crank_ratio": own["crank_ratio"],
        "displacement": 6.0 * displacement() * 1e3,
        "pressure_ratio": float(nominal["pressure"].max() / nominal["pressure"].min()),
        "fmep": float(nominal["fmep"]),
        "friction_torque_0": study.at("published", "friction_torque", "load 0"),
        "friction_torque_50": study.at("published", "friction_torque", "nominal"),
        "friction_torque_90": study.at("published", "friction_torque", "load 90"),
        "torque_max": float(nominal["torque"].max()),
        "load_coefficient": float(nominal["torque_mean"]) / CUT_SPEED**2,
        "imep": float(nominal["imep"]),
        "omega_min": float(nominal["omega_min"]),
        "change_inertia_12": change("inertia 12", "nominal"),
        "change_8_inertia_12": change("8 cylinders, inertia 12", "8 cylinders"),
    }
    for millimetres in (300, 450):
        share = at_piston(millimetres / 1000.0)
        found[f"rod_mass_at_piston_{millimetres}"] = share
        found[f"reciprocating_mass_{millimetres}"] = own["piston_mass"] + share
    return found


@dataclass(frozen=True)
class Difference:
    """A number of chapter 5 as published: ours less printed, in percent."""

    case: str
    quantity: str
    percent: float
    fitted: bool


def percent(value: float, reference: float) -> float:
    """Difference in percent of a reference."""
    return 100.0 * (value / reference - 1.0)


def differences(study: Study, printed: Printed) -> list[Difference]:
    """All numbers of section 5.2 and 5.4, as published."""
    found = []
    for case in study.cases:
        ours = {name: study.at("published", name, case) for name in ("delta", *SPEEDS)}
        if "torque_range" in printed.rows[case]:
            ours |= study.sampled_torque(case)
        for name, value in ours.items():
            off = percent(value, printed.number(case, name))
            found.append(Difference(case, name, off, (case, name) in printed.fitted))
    return found


def worst_of_limits(study: Study, printed: Printed) -> list[tuple[list[str], float, float]]:
    """Cases, limit and largest difference of delta [percent] of the predicted rows."""
    off = {
        one.case: one.percent
        for one in differences(study, printed)
        if one.quantity == "delta" and not one.fitted
    }
    found = []
    for begins, limit in LIMITS:
        cases = [case for case in off if case.startswith(begins)]
        found.append((cases, limit, max((off[case] for case in cases), key=abs)))
    return found


# --- the thesis's procedure run for longer --------------------------------------------------------


@dataclass(frozen=True)
class Drift:
    """Explicit Euler at a constant load torque (alpha = 0), nominal engine, from 125.6 rad/s.

    Attributes
    ----------
    cycles : list of int
        Cycles marched.
    mean, delta : list of float
        Mean speed [rad/s] and coefficient of speed fluctuation of the last one.
    predicted : list of float
        Mean speed by the energy that the steps add.
    """

    cycles: list[int]
    mean: list[float]
    delta: list[float]
    predicted: list[float]


def run_drift(cycles: Sequence[int]) -> Drift:
    """March the thesis's procedure for long; the first number of cycles must be 1.

    What to expect: a step adds (e dphi/omega)^2 to omega^2, with e = (M - M_mean)/Theta, so that
    y = omega^2 grows by C/y in a cycle, C = sum of (e dphi)^2, and y^2 by 2 C.
    """
    marched = [
        nominal_speed(load_exponent=0.0, method="thesis", passes=count, start_speed=CUT_SPEED)
        for count in cycles
    ]
    torque = sweeps.run(
        {
            "engine": "ntua",
            "set": {"crankcase_pressure": 0.0},
            "output": {"quantities": ["torque", "torque_mean"]},
        }
    )
    excess = torque["torque"].values - float(torque["torque_mean"])
    added = float(np.sum((excess / ntua().values["inertia"] * DEGREE) ** 2))
    first = marched[0].omega_mean
    return Drift(
        list(cycles),
        [one.omega_mean for one in marched],
        [one.delta for one in marched],
        [(first**4 + 2.0 * added * (count - 1)) ** 0.25 for count in cycles],
    )


# --- the independent solver -----------------------------------------------------------------------


@dataclass(frozen=True)
class Agreement:
    """Worst relative differences to the independent solver in one group of designs."""

    group: str
    designs: int
    same_outcome: int
    worst: dict[str, float]


def run_agreement() -> list[Agreement]:
    """Solve the held-out designs, pressure given at 0.5 degree, default tolerance."""
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    designs = importlib.import_module("oracle.designs")
    golden = importlib.import_module("oracle.golden").read()
    groups: dict[str, list[Any]] = {}
    for item in designs.held_out():
        # Idle to nine digits makes sense with the curve in closed form only.
        if item.exact:
            continue
        name = f"{item.design.inertia_model} inertia, {item.design.closure}"
        groups.setdefault(name if item.status == MEANINGS[CONVERGED] else WITHOUT_SPEED, []).append(
            item
        )
    found = []
    for name, items in sorted(groups.items()):
        worst = dict.fromkeys(AGREEMENT, 0.0)
        same = 0
        for item in items:
            ours = _solved(item)
            same += MEANINGS[ours.status] == item.status
            if item.status == MEANINGS[CONVERGED]:
                for quantity in AGREEMENT:
                    off = abs(getattr(ours, quantity) / golden[item.name][quantity] - 1.0)
                    worst[quantity] = max(worst[quantity], off)
        found.append(Agreement(name, len(items), same, worst))
    return found


def _solved(item: Any) -> engine_dyn.PeriodicSpeed:
    """Solve a held-out design with our solver."""
    one = item.design
    degrees, bar = item.table(0.5)
    return engine_dyn.periodic_speed(
        engine_dyn.diagram_from_points(np.radians(degrees), bar * BAR),
        bore=one.bore,
        stroke=one.stroke,
        crank_ratio=one.crank_ratio,
        reciprocating_mass=one.reciprocating_mass,
        inertia=one.inertia,
        speed=one.omega_n,
        cylinders=one.cylinders,
        load_exponent=one.load_exponent,
        load_offset=one.load_offset,
        friction_torque=one.friction_torque,
        crankcase_pressure=one.crankcase_pressure,
        inertia_model=one.inertia_model,
        closure=one.closure,
    )
