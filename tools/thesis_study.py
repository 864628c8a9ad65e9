"""Kakaitsas's study as printed and as computed: what tools/validation.py writes about.

Published values come from tests/reference with the digits that are printed, the designs from the
built-in scene `thesis`.
"""

from __future__ import annotations

import copy
import functools
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pages import ROOT, csv_rows

import engine_dyn
import sweeps
from engine_dyn import Diagram
from engine_dyn.status import CONVERGED, MEANINGS
from engine_dyn.units import BAR, DEGREE, RPM
from oracle import designs, golden
from sweeps.scene.engine.engine_files import load_engine
from sweeps.scene.reading import built_in_scenes

if TYPE_CHECKING:
    import xarray as xr

SLIP = 57.32  # printed in (4.2b) in place of 180/pi
CUT_SPEED = 125.6  # omega_n of 1200 rpm as the thesis cuts it, rad/s

SPEEDS = ("omega_max", "omega_min", "omega_mean")
TORQUES = ("torque_ratio", "torque_range")

LIMITS = (
    (("inertia", "mass", "lambda", "alpha", "speed 1000", "speed 2000"), 0.5),
    (("speed 3000", "speed 4000"), 1.2),
    (("2 cylinders",), 2.0),
    (("4 cylinders", "6 cylinders", "8 cylinders"), 3.0),
)
"""Beginning of the names of predicted rows, and largest error of the published delta [percent]:
fixed before the diagrams were calibrated."""

AGREEMENT = {
    "delta": 1e-5,
    "omega_max": 1e-5,
    "omega_min": 1e-5,
    "omega_mean": 1e-7,
    "torque_mean": 2e-6,
}
"""Largest relative differences from the independent solver, fixed before it was written."""

WITHOUT_SPEED = "without a speed"

FITTED = {
    *(("nominal", name) for name in ("delta", *TORQUES, "load_coefficient", "pressure_ratio")),
    *(("nominal", f"friction_torque_{load}") for load in (0, 50, 90)),
    *((case, name) for case in ("load 0", "load 90") for name in ("delta", *SPEEDS)),
}
"""Case and printed quantity that tools/calibrate_ntua.py fits the diagrams to. Of the nominal row
only the swing is fitted, and with it delta."""

Row = Mapping[str, str]


# --- printed --------------------------------------------------------------------------------------


def read_reference(name: str) -> list[dict[str, str]]:
    """Rows of a table in tests/reference, as text, so that the printed digits stay."""
    return csv_rows(ROOT / "tests" / "reference" / name)


@functools.cache
def printed_rows() -> dict[str, dict[str, str]]:
    """Section 5.2, Table 5.3 and section 5.4 by the names of the scene's designs, as text.

    What is not printed is blank or missing.
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
    return rows


@functools.cache
def other_numbers() -> dict[str, float]:
    """Numbers that the thesis prints outside its tables, by name."""
    rows = read_reference("kakaitsas_other_numbers.csv")
    return {row["name"]: float(row["printed"]) for row in rows}


def printed(case: str, name: str) -> float:
    """Return a printed number; delta is that of the printed omegas, (3.6)."""
    row = printed_rows()[case]
    if name == "delta":
        top, bottom, mean = (float(row[speed]) for speed in SPEEDS)
        return (top - bottom) / mean
    return float(row[name])


def range_of(text: str) -> tuple[float, float]:
    """Values that a printed number may stand for, whether it was cut or rounded."""
    unit = 10.0 ** -len(text.partition(".")[2])
    value = float(text)
    # Cutting digits goes towards zero.
    low, high = (-1.0, 0.5) if text.startswith("-") else (-0.5, 1.0)
    return value + low * unit, value + high * unit


def range_of_delta(row: Row) -> tuple[float, float]:
    """Values of (3.6) that the printed omegas of a row leave open."""
    top, bottom, mean = (range_of(row[name]) for name in SPEEDS)
    return (top[0] - bottom[1]) / mean[1], (top[1] - bottom[0]) / mean[0]


# --- computed -------------------------------------------------------------------------------------


def percent(value: float, reference: float) -> float:
    """Difference in percent of a reference."""
    return 100.0 * (value / reference - 1.0)


@dataclass(frozen=True)
class Study:
    """The 22 designs of the built-in scene `thesis`, computed in several ways.

    Attributes
    ----------
    cases : list of str
        Names of the designs.
    ways : dict of xarray.Dataset
        `published`: the scene as it stands, the thesis's procedure; `as_made`: the same with
        omega_n cut everywhere and with the slip of (4.2b); `repeated`: explicit Euler until a
        cycle closes within 1e-6 rad/s; `periodic`, `gauge`: the periodic solution, without and
        with the pressure of the crankcase.
    """

    cases: list[str]
    ways: dict[str, xr.Dataset]

    def at(self, way: str, quantity: str, case: str) -> float:
        """One number; torques as published are those of samples at one degree, as printed."""
        one = self.ways[way].isel(design=self.cases.index(case))
        if way != "published" or quantity not in TORQUES:
            return float(one[quantity])
        curve, mean = one["torque"].values, float(one["torque_mean"])
        return float(curve.max()) / mean if quantity == "torque_ratio" else float(np.ptp(curve))

    def off(self, way: str, quantity: str, case: str) -> float:
        """Its difference from the printed one [percent]."""
        return percent(self.at(way, quantity, case), printed(case, quantity))

    def several(self) -> list[str]:
        """Names of the designs with more than one cylinder."""
        return [case for case in self.cases if "cylinders" in case]


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

    def variant(change: Callable[[dict[str, Any]], object]) -> xr.Dataset:
        scene = copy.deepcopy(base)
        scene["output"] = {"quantities": ["delta", *SPEEDS, *TORQUES]}
        change(scene)
        return sweeps.run(scene)

    def periodic(scene: dict[str, Any]) -> None:
        scene["solver"]["method"] = "auto"
        for column in ("passes", "start_speed", "start_angle"):
            del scene["designs"][column]

    def gauge(scene: dict[str, Any]) -> None:
        periodic(scene)
        del scene["set"]["crankcase_pressure"]

    ways = {
        "published": sweeps.run("thesis"),
        "as_made": variant(lambda scene: make_as_made(scene["designs"])),
        "repeated": variant(lambda scene: scene["designs"].pop("passes")),
        "periodic": variant(periodic),
        "gauge": variant(gauge),
    }
    return Study(list(base["designs"]["case"]), ways)


def run_all_rows() -> Study:
    """The same study at 50 % load with the engine whose pressure is fitted to all these rows."""
    base = thesis_scene()
    designs = base["designs"]
    kept = [place for place, load in enumerate(designs["load"]) if load == 50]
    base["designs"] = {name: [column[k] for k in kept] for name, column in designs.items()}
    base["engine"] = "ntua_all_rows"
    return Study(list(base["designs"]["case"]), {"published": sweeps.run(base)})


# --- the nominal engine ---------------------------------------------------------------------------


def diagram_of(engine: str) -> Diagram:
    """Diagram of an engine of the catalogue at 50 % load."""
    family = load_engine(engine).family
    return family.diagrams[list(family.loads).index(50.0)]


def nominal(method: str = "auto", **columns: Any) -> xr.Dataset:
    """Speeds of the nominal engine of the thesis, absolute pressure on the piston.

    `columns` are keys of scenes: of each a number, or one number for each design.
    """
    count = max((np.size(column) for column in columns.values()), default=1)
    given = {"reciprocating_mass": 6.67, **columns}  # rounded to two decimals, as in the thesis
    return sweeps.run(
        engine="ntua",
        set={"crankcase_pressure": 0.0},
        silenced_warnings=["crankcase_pressure"],
        designs={key: np.broadcast_to(one, count).tolist() for key, one in given.items()},
        solver={"method": method},
        output={"quantities": ["delta", "omega_mean", "iterations"]},
    )


def other_values(study: Study) -> dict[str, float]:
    """Ours for every number of kakaitsas_other_numbers.csv, by its name."""
    own = load_engine("ntua").values
    rods = sweeps.run(
        engine="ntua",
        axes={"rod_length": [0.30, 0.35, 0.45]},
        output={
            "quantities": ["rod_mass_at_piston", "rod_mass_at_crank", "rotating_mass",
                           "displacement"],
        },
    )  # fmt: skip
    middle = rods.isel(rod_length=1)
    nominal_row = study.ways["published"].isel(design=0)

    def change(case: str, base: str) -> float:
        return percent(study.at("published", "delta", case), study.at("published", "delta", base))

    found = {
        "rod_mass_at_crank": float(middle["rod_mass_at_crank"]),
        "rotating_mass": float(middle["rotating_mass"]),
        "crank_ratio": own["crank_ratio"],
        "displacement": 6.0 * float(middle["displacement"]) * 1e3,
        "pressure_ratio": float(nominal_row["pressure"].max() / nominal_row["pressure"].min()),
        "torque_max": float(nominal_row["torque"].max()),
        "load_coefficient": float(nominal_row["torque_mean"]) / CUT_SPEED**2,
        **{name: float(nominal_row[name]) for name in ("fmep", "imep", "omega_min")},
        "change_inertia_12": change("inertia 12", "nominal"),
        "change_8_inertia_12": change("8 cylinders, inertia 12", "8 cylinders"),
    }
    for load, case in ((0, "load 0"), (50, "nominal"), (90, "load 90")):
        found[f"friction_torque_{load}"] = study.at("published", "friction_torque", case)
    for which, share in zip(("_300", "", "_450"), rods["rod_mass_at_piston"].values, strict=True):
        found[f"rod_mass_at_piston{which}"] = float(share)
        found[f"reciprocating_mass{which}"] = own["piston_mass"] + float(share)
    return found


class Difference(NamedTuple):
    """A number of chapter 5 as published: ours less printed, in percent."""

    case: str
    quantity: str
    percent: float
    fitted: bool


def differences(study: Study) -> list[Difference]:
    """All numbers of section 5.2 and 5.4, as published."""
    return [
        Difference(case, name, study.off("published", name, case), (case, name) in FITTED)
        for case in study.cases
        for name in ("delta", *SPEEDS, *TORQUES)
        if name == "delta" or name in printed_rows()[case]
    ]


def predicted_deltas(study: Study) -> dict[str, float]:
    """Differences of the deltas that follow from no fitted figure [percent], by case."""
    found = differences(study)
    return {one.case: one.percent for one in found if one.quantity == "delta" and not one.fitted}


def worst_of_limits(study: Study) -> list[tuple[list[str], float, float]]:
    """Cases, limit and largest difference of delta [percent] of the predicted rows."""
    off = predicted_deltas(study)
    groups = [([case for case in off if case.startswith(begins)], most) for begins, most in LIMITS]
    return [(cases, most, max((off[case] for case in cases), key=abs)) for cases, most in groups]


# --- the thesis's procedure run for longer --------------------------------------------------------


class Drift(NamedTuple):
    """Explicit Euler at a constant load torque (alpha = 0), nominal engine, from 125.6 rad/s.

    After each number of cycles: mean speed [rad/s], that by the energy that the steps add, and
    coefficient of speed fluctuation.
    """

    cycles: list[int]
    mean: list[float]
    predicted: list[float]
    delta: list[float]


def run_drift(cycles: Sequence[int]) -> Drift:
    """March the thesis's procedure for long; the first number of cycles must be 1.

    What to expect: a step adds (e dphi/omega)^2 to omega^2, with e = (M - M_mean)/Theta, so that
    y = omega^2 grows by C/y in a cycle, C = sum of (e dphi)^2, and y^2 by 2 C.
    """
    marched = nominal("thesis", load_exponent=0.0, passes=cycles, start_speed=CUT_SPEED)
    torque = sweeps.run(
        engine="ntua",
        set={"crankcase_pressure": 0.0},
        silenced_warnings=["crankcase_pressure"],
        output={"quantities": ["torque", "torque_mean"]},
    )
    excess = torque["torque"].values - float(torque["torque_mean"])
    added = float(np.sum((excess / load_engine("ntua").values["inertia"] * DEGREE) ** 2))
    mean, delta = (marched[name].values.tolist() for name in ("omega_mean", "delta"))
    predicted = [(mean[0] ** 4 + 2.0 * added * (count - 1)) ** 0.25 for count in cycles]
    return Drift(list(cycles), mean, predicted, delta)


# --- the independent solver -----------------------------------------------------------------------


class Agreement(NamedTuple):
    """Worst relative differences to the independent solver in one group of designs."""

    group: str
    designs: int
    same_outcome: int
    worst: dict[str, float]


SAME_NAMES = (
    "bore", "stroke", "crank_ratio", "reciprocating_mass", "inertia", "cylinders", "load_exponent",
    "load_offset", "friction_torque", "crankcase_pressure", "inertia_model", "closure",
)  # fmt: skip
"""Keywords of `periodic_speed` that the independent solver's designs have too."""


def run_agreement() -> list[Agreement]:
    """Solve the held-out designs, pressure given at 0.5 degree, default tolerance."""
    known = golden.read()
    groups: dict[str, list[tuple[bool, dict[str, float]]]] = {}
    for item in designs.held_out():
        # Idle to nine digits makes sense with the curve in closed form only.
        if item.exact:
            continue
        one = item.design
        degrees, bar = item.table(0.5)
        given = {name: getattr(one, name) for name in SAME_NAMES}
        diagram = engine_dyn.diagram_from_points(np.radians(degrees), bar * BAR)
        ours = engine_dyn.periodic_speed(diagram, speed=one.omega_n, **given)
        group, off = WITHOUT_SPEED, dict.fromkeys(AGREEMENT, 0.0)
        if item.status == MEANINGS[CONVERGED]:
            group = f"{one.inertia_model} inertia, {one.closure}"
            off = {q: abs(getattr(ours, q) / known[item.name][q] - 1.0) for q in AGREEMENT}
        groups.setdefault(group, []).append((MEANINGS[ours.status] == item.status, off))
    return [
        Agreement(
            name,
            len(found),
            sum(same for same, _ in found),
            {quantity: max(off[quantity] for _, off in found) for quantity in AGREEMENT},
        )
        for name, found in sorted(groups.items())
    ]
