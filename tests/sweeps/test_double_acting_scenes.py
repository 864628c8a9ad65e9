"""Scenes with double-acting compressors: torque, speed and rod loads of one to six throws."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from engine_dyn.pressure.double_acting import FILE_FIELDS, DoubleActingCycle, DoubleActingDiagram
from engine_dyn.units import BAR
from sweeps.scene.engine.engine_files import load_engine
from sweeps.scene.reading import read_scene
from tests.support.scenes import computed, refusal

BORE, STROKE, ROD, SPEED, OUTSIDE = 0.3, 0.15, 0.375, 750.0, 1.01325
PISTON, SMALL_END = 60.0, 60.0 * 0.12 / 0.375
SLIP, BREAKDOWN = 0.01, 0.06
DIAGRAM: dict[str, Any] = {
    "kind": "double_acting_compressor", "clearance_ratio": 0.12,
    "crank_end_clearance_ratio": 0.15, "piston_rod_diameter": 0.06, "suction_pressure": 5.0,
    "delivery_pressure": 15.0, "suction_loss": 0.1, "delivery_loss": 0.2,
    "compression_exponent": 1.3, "expansion_exponent": 1.25, "valve_ramp": 8.0, "valve_lag": 2.0,
}  # fmt: skip
VALUES: dict[str, Any] = {
    "bore": BORE, "stroke": STROKE, "rod_length": ROD, "piston_mass": PISTON, "rod_mass": 60,
    "rod_centre_of_gravity": 0.12, "crank_mass": 40, "inertia": 60, "speed": SPEED, "cylinders": 1,
    "crankcase_pressure": OUTSIDE, "friction_constant": 0.3, "friction_peak_pressure": 0.01,
    "friction_mean_piston_speed": 0, "load_offset": 0, "motor_slip": SLIP,
    "motor_breakdown_slip": BREAKDOWN, "motor_breakdown_torque": 30000,
}  # fmt: skip
FOUR = {
    "throws": [{"angle": a} for a in (0, 180, 90, 270)], "banks": [-90.0, 90.0], "uneven": True,
    "cylinders": [{"throw": t, "bank": b, "firing_angle": f}
                  for t, b, f in ((1, 1, 0), (2, 2, 0), (3, 1, 270), (4, 2, 270))],
}  # fmt: skip
"""Two pairs of opposed throws, a quarter of a turn apart."""

THROWS: list[tuple[Any, list[float]]] = [
    ("in-line 1", [0.0]), ("boxer 2", [0.0, 0.0]), (FOUR, [0.0, 0.0, 270.0, 270.0]),
    ("boxer 6", [0.0, 0.0, 120.0, 120.0, 240.0, 240.0]), ("in-line 3", [0.0, 120.0, 240.0]),
]  # fmt: skip


def written(folder: Path, *tables: dict[str, Any], head: str = "", **changes: Any) -> str:
    """Path of an engine file; changes are to [values], None leaves one out."""
    values = {k: v for k, v in {**VALUES, **changes}.items() if v is not None}
    lines = ['title = "x"', 'cycle = "two-stroke"', head, "[values]"]
    lines += [f"{key} = {value}" for key, value in values.items()]
    for table in tables or (DIAGRAM,):
        lines.append("[[diagram]]")
        for key, value in {"load": 100, **table}.items():
            lines.append(f"{key} = {value!r}" if isinstance(value, str) else f"{key} = {value}")
    path = folder / "machine.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def travel(phi: Any) -> Any:
    """Travel of the piston [m]."""
    radius = 0.5 * STROKE
    return radius * (1.0 - np.cos(phi)) + ROD - np.sqrt(ROD**2 - (radius * np.sin(phi)) ** 2)


def derivative(curve: Any, phi: Any) -> Any:
    """By differences of fourth order."""
    h = 1e-3
    near, far = curve(phi + h) - curve(phi - h), curve(phi + 2 * h) - curve(phi - 2 * h)
    return (8.0 * near - far) / (12.0 * h)


def velocity(phi: Any) -> Any:
    return derivative(travel, phi)


def gas(phi: Any) -> Any:
    """Force of the gas on the piston [N], from the pressures of both ends and their areas."""
    values = {k: v * FILE_FIELDS[k].size for k, v in DIAGRAM.items() if k != "kind"}
    ends = DoubleActingCycle(
        **values, crank_ratio=0.5 * STROKE / ROD, bore=BORE, crankcase_pressure=OUTSIDE * BAR
    ).diagram()
    area, rod = 0.25 * np.pi * BORE**2, 0.25 * np.pi * DIAGRAM["piston_rod_diameter"] ** 2
    return ends.head_end(phi) * area - ends.crank_end(phi) * (area - rod) - OUTSIDE * BAR * rod


def inertia(phi: Any, mass: float, speed: float = SPEED) -> Any:
    return -mass * derivative(velocity, phi) * (speed * np.pi / 30.0) ** 2


def torque(phi: Any, firing: list[float]) -> Any:
    """Of gas and reciprocating masses by virtual work, all throws [N m]."""
    whole: Any = 0.0
    for angle in np.radians(firing):
        own = phi - angle
        whole = whole + (gas(own) + inertia(own, PISTON + SMALL_END)) * velocity(own)
    return whole


def independent_delta(torque_of: Any, inertia: float = 60.0) -> float:
    """Delta of a machine that a motor drives, by shooting with a general integrator."""
    nominal = SPEED * np.pi / 30.0
    synchronous = nominal / (1.0 - SLIP)

    def kloss(omega: float) -> float:
        slip = 1.0 - omega / synchronous
        return 2.0 / (slip / BREAKDOWN + BREAKDOWN / slip)

    phi = np.arange(7200) * (2.0 * np.pi / 7200)
    factor = -torque_of(phi).mean() / kloss(nominal)  # the mean of the motor's torque balances
    table = torque_of(np.append(phi, 2.0 * np.pi))

    def right(angle: float, y: Any) -> Any:
        moment = np.interp(angle, np.append(phi, 2.0 * np.pi), table)
        return [(moment + factor * kloss(y[0])) / (inertia * y[0])]

    def turn(start: float) -> Any:
        return solve_ivp(
            right, (0.0, 2.0 * np.pi), [start], method="DOP853", rtol=1e-11, max_step=0.02,
            t_eval=phi,
        ).y[0]  # fmt: skip

    def missed(start: float) -> float:
        run = solve_ivp(right, (0.0, 2.0 * np.pi), [start], rtol=1e-11, max_step=0.02)
        return float(run.y[0, -1] - start)

    omega = turn(brentq(missed, 0.95 * nominal, 0.9999 * synchronous, xtol=1e-12))
    return float(np.ptp(omega) / omega.mean())


@pytest.mark.parametrize(("layout", "firing"), THROWS)
def test_torque_and_speed_of_any_throws(tmp_path: Path, layout: Any, firing: list[float]) -> None:
    count = len(firing)
    path = written(tmp_path, cylinders=count)
    found = computed(
        ["gas_torque", "inertia_torque", "torque", "torque_mean", "delta", "friction_torque"],
        path, set={"arrangement": layout},
    )  # fmt: skip
    phi = np.radians(found["crank_angle"].values)
    expected = torque(phi, firing)
    both = (found["gas_torque"] + found["inertia_torque"]).values
    assert_allclose(both, expected, rtol=0.0, atol=2e-8 * np.abs(expected).max())
    # The friction takes the largest tabulated pressure at either end, not the effective one.
    diagram = load_engine(path).family.diagrams[0]
    assert isinstance(diagram, DoubleActingDiagram)
    largest = max(end.pressure.max() for end in (diagram.head_end, diagram.crank_end))
    lost = (0.3 * BAR + 0.01 * largest) * count * 0.25 * np.pi * BORE**2 * STROKE / (2.0 * np.pi)
    assert float(found["friction_torque"]) == pytest.approx(lost, rel=1e-12)

    def whole(angle: Any) -> Any:
        return torque(angle, firing) - lost

    fine = np.arange(3600) * (2.0 * np.pi / 3600)
    assert float(found["torque_mean"]) == pytest.approx(whole(fine).mean(), rel=1e-6)
    assert float(found["delta"]) == pytest.approx(independent_delta(whole), rel=2e-5)


def test_the_general_solver_agrees(tmp_path: Path) -> None:
    path = written(tmp_path)
    found = computed(
        ["delta"], path, set={"arrangement": "in-line 1"}, solver={"method": ["auto", "newton"]}
    )
    auto, newton = found["delta"].values
    assert auto == pytest.approx(newton, rel=1e-6)


@pytest.mark.parametrize("speed", [300.0, 750.0, 1100.0])
def test_rod_loads(tmp_path: Path, speed: float) -> None:
    names = ["gas_force", "crosshead_inertia_load", "combined_rod_load", "gas_load_compression",
             "gas_load_tension", "combined_rod_load_compression", "combined_rod_load_tension",
             "rod_load_reversal", "rod_load_reversal_ratio"]  # fmt: skip
    found = computed(names, written(tmp_path), set={"speed": speed}, output={"angle_step": 1.0})
    phi = np.radians(found["crank_angle"].values)
    parts = {"gas_force": gas(phi), "crosshead_inertia_load": inertia(phi, PISTON, speed)}
    parts["combined_rod_load"] = sum(parts.values())
    for name, expected in parts.items():
        size = np.abs(expected).max()
        assert_allclose(found[name].values, expected, rtol=0.0, atol=1e-7 * size)
    fine = np.arange(36000) * (2.0 * np.pi / 36000)
    load = gas(fine) + inertia(fine, PISTON, speed)
    most = max(load.max(), -load.min())
    for name, expected in (
        ("gas_load_compression", gas(fine).max()), ("gas_load_tension", -gas(fine).min()),
        ("combined_rod_load_compression", load.max()), ("combined_rod_load_tension", -load.min()),
    ):  # fmt: skip
        assert float(found[name]) == pytest.approx(expected, rel=2e-4)
    assert float(found["rod_load_reversal_ratio"]) == pytest.approx(
        min(load.max(), -load.min()) / most, rel=4e-4
    )
    assert float(found["rod_load_reversal"]) == pytest.approx(shorter_stretch(load > 0), abs=0.05)


def shorter_stretch(pushed: Any) -> float:
    """Of the longest uninterrupted ones in either direction, in degrees."""
    pushed = np.roll(pushed, -int(np.flatnonzero(pushed != np.roll(pushed, 1))[0]))
    edges = np.flatnonzero(np.diff(pushed)) + 1
    runs = np.diff([0, *edges, pushed.size])
    longest = [max(runs[start::2], default=0) for start in (0, 1)]
    return float(min(longest)) * 360.0 / pushed.size


def test_a_worked_example_of_rod_loads(tmp_path: Path) -> None:
    """Bloch and Geitner, Practical Machinery Management for Process Plants, volume 4, figure 5-5B.

    A cylinder of 34 in with a rod of 4 in: from 10 psi (gauge) to 147.5 psi the compression is
    125,000 lb, and to 138.5 psi the tension is 115,000 lb; from 40 psi to 177 psi and 169 psi.
    Gauge pressures leave out the atmosphere on the rod, as its area here feels the atmosphere. The
    printed pressures are rounded to 0.5 psi, which is 450 lb. Where the piston stands still, valves
    without losses give the pressures of the lines.
    """
    inch, psi, pound = 0.0254, 6894.757, 4.4482216
    for suction, delivery, angle, load in (
        (10.0, 147.5, 0.0, 125e3), (40.0, 177.0, 0.0, 125e3), (10.0, 138.5, -180.0, -115e3),
        (40.0, 169.0, -180.0, -115e3),
    ):  # fmt: skip
        gauge = {"suction_pressure": suction, "delivery_pressure": delivery}
        diagram = {
            **DIAGRAM, **{k: v * psi / BAR + OUTSIDE for k, v in gauge.items()},
            "piston_rod_diameter": 4.0 * inch, "suction_loss": 0.0, "delivery_loss": 0.0,
            "valve_ramp": 3.0, "valve_lag": 0.5, "clearance_ratio": 0.08,
            "crank_end_clearance_ratio": 0.08,
        }  # fmt: skip
        bore: dict[str, Any] = {
            "bore": 34.0 * inch,
            "stroke": 11.0 * inch,
            "rod_length": 27.5 * inch,
        }
        found = computed(
            ["gas_force", "gas_load_compression", "gas_load_tension"],
            written(tmp_path, diagram, **bore),
        )
        here = float(found["gas_force"].sel(crank_angle=angle)) / pound
        assert here == pytest.approx(load, abs=500.0)
        largest = found["gas_load_compression" if load > 0 else "gas_load_tension"]
        # Valves that open late let the pressure overshoot.
        assert abs(load) - 500.0 < float(largest) / pound < 1.12 * abs(load)


def test_a_mass_of_its_own_counts_in_the_worst_of_all_cylinders(tmp_path: Path) -> None:
    path, worst = written(tmp_path, cylinders=2), "combined_rod_load_tension"
    layout = {"arrangement": "boxer 2"}
    found = computed([worst, "rod_load_reversal"], path, set={**layout, "mass_factor_2": 1.5})
    heavy = computed(
        [worst, "rod_load_reversal"], path, set={**layout, "piston_mass": 1.5 * PISTON}
    )
    light = computed([worst, "rod_load_reversal"], path, set=layout)
    assert float(found[worst]) == max(float(heavy[worst]), float(light[worst]))
    assert float(found["rod_load_reversal"]) == min(
        float(heavy["rod_load_reversal"]), float(light["rod_load_reversal"])
    )


def test_gas_shakes_no_frame(tmp_path: Path) -> None:
    """The free forces and moments of opposed throws, with gas at both ends or at one."""
    names = ["shaking_force_max", "overturning_moment"]
    two = {"arrangement": "boxer 2", "cylinder_spacing": 0.5}
    single = {k: v for k, v in DIAGRAM.items() if k not in ("crank_end_clearance_ratio",
              "piston_rod_diameter")} | {"kind": "compressor"}  # fmt: skip
    double = computed(names, written(tmp_path, cylinders=2), set=two)
    alone = computed(names, written(tmp_path, single, cylinders=2), set=two)
    assert float(double["shaking_force_max"]) == float(alone["shaking_force_max"])
    phi = np.radians(double["crank_angle"].values)
    moment = -torque(phi, [0.0, 0.0])
    assert_allclose(double["overturning_moment"].values, moment, atol=2e-8 * np.abs(moment).max())


@pytest.mark.parametrize(
    ("tables", "changes", "message"),
    [
        ([{**DIAGRAM, "piston_rod_diameter": 0.31}], {},
         "number 1: piston_rod_diameter = 0.31 m: must be below the bore, 0.3 m"),
        ([{**DIAGRAM, "bore": 0.4}], {}, "number 1 bore: unknown key"),
        ([{**DIAGRAM, "crank_end_clearance_ratio": 0.6}], {}, "must be below 0.5"),
        ([{k: v for k, v in DIAGRAM.items() if k != "piston_rod_diameter"}], {},
         "number 1 piston_rod_diameter: missing; must be a number in m"),
        ([DIAGRAM], {"bore": None}, "number 1 bore: missing; must be a number in m, in [values]"),
        ([DIAGRAM], {"crankcase_pressure": None},
         "crankcase_pressure: missing; must be a number in bar, in [values]"),
        ([DIAGRAM], {"crank_offset": 0.01}, "modelled without offset"),
        ([DIAGRAM, {**DIAGRAM, "load": 50}], {}, "must be the only [[diagram]]"),
        ([{**DIAGRAM, "step": 8}], {}, "step = 8 degree: 180 must be a multiple of it"),
        ([{**DIAGRAM, "kind": "compressor"}], {}, "crank_end_clearance_ratio: unknown key"),
    ],
)  # fmt: skip
def test_files_that_are_refused(
    tmp_path: Path, tables: Any, changes: dict[str, Any], message: str
) -> None:
    path = written(tmp_path, *tables, **changes)
    assert message in refusal({"engine": path, "output": {"quantities": ["delta"]}})


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"set": {"bore": 0.35}}, "[set] bore: not allowed: the double-acting cylinders of engine"),
        ({"axes": {"crankcase_pressure": [1, 2]}}, "[axes] crankcase_pressure: not allowed"),
        ({"set": {"misfire": 1}}, "[set] misfire: a compressor or pump has no diagram without"),
        ({"set": {"pressure_factor_1": 0.5}}, "pressure_factor_1: a compressor or pump has"),
        ({"set": {"friction_boundary": 0.5, "ring_pressure": 1}}, "must be 0: engine"),
        ({"set": {"heat": 20}}, "heat: not allowed"),
        ({"output": {"quantities": ["intake_duration"]}}, "needs a four-stroke engine"),
    ],
)  # fmt: skip
def test_scenes_that_are_refused(tmp_path: Path, tables: dict[str, Any], message: str) -> None:
    scene = {"engine": written(tmp_path), "output": {"quantities": ["delta"]}, **tables}
    assert message in refusal(scene)


OF_BOTH = ("crank_end_clearance_ratio", "piston_rod_diameter")
PUMP = ("suction_pressure", "delivery_pressure", "suction_loss", "delivery_loss", "valve_ramp")
NOT_BURNING: dict[str, dict[str, Any]] = {
    "double-acting": DIAGRAM,
    "compressor": {**{k: v for k, v in DIAGRAM.items() if k not in OF_BOTH}, "kind": "compressor"},
    "pump": {"kind": "pump", **{key: DIAGRAM[key] for key in PUMP}},
    "torque": {"kind": "torque", "mean": -900.0, "harmonics": []},
}


@pytest.mark.parametrize("table", [
    {"pressure_factor": [0.7]}, {"pressure_factor_1": 0.5}, {"misfire": 1},
    {"firing_pattern": "10"},
])  # fmt: skip
@pytest.mark.parametrize("kind", NOT_BURNING)
def test_what_does_not_burn_takes_no_factor_on_its_pressure(
    kind: str, table: dict[str, Any], tmp_path: Path
) -> None:
    """Compressors and pumps have no diagram without combustion, given torques no cylinders."""
    path = Path(written(tmp_path, NOT_BURNING[kind]))
    if kind == "torque":  # which is of no load
        path.write_text(path.read_text().replace("load = 100\n", ""))
    asked = {"engine": str(path), "output": {"quantities": ["torque_mean"]}}
    read_scene({**asked, "set": {"mass_factor": [1.0]}})
    said = refusal({**asked, "set": table})
    assert next(iter(table)) in said
    assert "compressor or pump has no" in said or "gives its torque" in said
