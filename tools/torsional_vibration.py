"""Write docs/torsional_response.md: the measured diesel's shaft, and published shafts.

Run it from the project's root: `python tools/torsional_vibration.py`; `--no-figures` leaves the
figure alone.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from pages import (
    DOCS,
    csv_text,
    figures_wanted,
    filled,
    keep_figure,
    markdown,
    sheet,
    write,
)
from published_shafts import SYSTEMS, comparisons, exceptions, sources, table

import sweeps
from engine_dyn.torsion.passing import passing_history
from engine_dyn.units import RPM
from sweeps.view.figures.marks import DASHES, shade

TEMPLATE = Path(__file__).with_name("torsional_response.md.in")
DOCUMENT = DOCS / "torsional_response.md"
ENGINE = "diesel_105x137"
CAR_SPEEDS = [800, 1200, 1600, 2000, 3000]
SPEEDS = np.arange(1000.0, 2501.0, 5.0)  # speeds in rpm
Rows = list[list[str]]


def run(quantities: list[str], shaft: str = ENGINE, **axes: Any) -> xr.Dataset:
    return sweeps.run(
        engine=ENGINE, shaft=shaft, axes=axes, silenced_warnings=["all"],
        output={"quantities": quantities},
    )  # fmt: skip


def diesel() -> xr.Dataset:
    """The engine over speed, healthy and with each cylinder dead."""
    names = [
        "natural_frequency", "critical_speed", "mode_vector_sum", "shaft_torque_half_range",
        "shaft_torque_largest_order", "shaft_torque_order", "shaft_stress_half_range", "delta",
        "delta_elastic", "shaft_torque_mean",
    ]  # fmt: skip
    return run(names, misfire=range(7), speed=SPEEDS.tolist())


def natural(found: xr.Dataset) -> str:
    """Natural frequencies, and where the strongest orders meet the first within the speeds."""
    one = found.sel(misfire=0, mode=1)
    met = (one.critical_speed >= SPEEDS[0]) & (one.critical_speed <= SPEEDS[-1])
    strong = one.order.values[met & (one.mode_vector_sum > 1.0)]
    meets = [
        f"{order:g} at {float(one.critical_speed.sel(order=order)):.0f} rpm "
        f"({float(one.mode_vector_sum.sel(order=order)):.1f})"
        for order in strong
    ]
    hertz = ", ".join(f"{float(value):.1f}" for value in found.natural_frequency[:3])
    return f"{hertz} Hz. Strong orders (vector sum) meet the first: {', '.join(meets)}"


def shafts(found: xr.Dataset) -> Rows:
    """Largest torque and stress of each shaft over speed, healthy and of the worst misfire."""
    rows = [[
        "shaft", "torque N m", "at rpm", "largest order", "stress MPa", "worst misfire",
        "its torque N m", "its rpm",
    ]]  # fmt: skip
    for number, name in zip(found["shaft"].values, found.shaft_name.values, strict=True):
        one = found.sel(shaft=number)
        torque = one.shaft_torque_half_range
        speed = torque.sel(misfire=0).idxmax()
        peak = one.sel(misfire=0, speed=speed)
        dead = torque.sel(misfire=slice(1, None)).max("speed").idxmax()
        stress = float(peak.shaft_stress_half_range)
        rows.append([
            str(name), f"{float(peak.shaft_torque_half_range):.0f}", f"{float(speed):.0f}",
            f"{float(peak.shaft_torque_largest_order):g}",
            f"{stress:.1f}" if np.isfinite(stress) else "", f"{float(dead):.0f}",
            f"{float(torque.sel(misfire=dead).max()):.0f}",
            f"{float(torque.sel(misfire=dead).idxmax()):.0f}",
        ])  # fmt: skip
    return rows


def deltas(found: xr.Dataset) -> Rows:
    rows = [["rpm", "δ rigid", "δ elastic", "ratio"]]
    for speed in (1000.0, 1500.0, 2000.0, 2165.0):
        one = found.sel(misfire=0, speed=speed)
        rigid, elastic = float(one.delta), float(one.delta_elastic)
        rows.append([f"{speed:.0f}", f"{rigid:.4f}", f"{elastic:.4f}", f"{elastic / rigid:.2f}"])
    return rows


def generator_set(found: xr.Dataset) -> Rows:
    """Coupling, healthy and of the worst misfire."""
    rows = [
        ["rpm", "misfire", "mean torque, N m", "vibratory", "least", "twist, degree", "heat, W"]
    ]
    for speed in found.speed.values:
        one = found.isel(shaft=-1).sel(speed=speed)
        dead = one.shaft_torque_half_range.sel(misfire=slice(1, None)).idxmax()
        for case in (one.sel(misfire=0), one.sel(misfire=dead)):
            numbers = (
                abs(case.shaft_torque_mean), case.shaft_torque_half_range, case.shaft_torque_min
            )  # fmt: skip
            rows.append([
                f"{speed:.0f}", f"cylinder {int(case.misfire)}" if case.misfire else "none",
                *(f"{float(number):.0f}" for number in numbers),
                f"{float(case.shaft_twist_half_range):.2f}", f"{float(case.shaft_loss):.0f}",
            ])  # fmt: skip
    return rows


def flywheels() -> Rows:
    """Speed fluctuation of order 2 at the gearbox behind three flywheels."""
    shafts = tomllib.loads(TEMPLATE.with_name("car_shafts.toml").read_text(encoding="utf-8"))
    rows = [["flywheel", *(f"{speed} rpm" for speed in CAR_SPEEDS)]]
    for name, shaft in shafts.items():
        place = [disc["name"] for disc in shaft["discs"]].index("gearbox")
        found = sweeps.run(
            engine="si_four_87x101", shaft=shaft, silenced_warnings=["all"], set={"load": 100},
            axes={"speed": CAR_SPEEDS},
            output={"quantities": ["disc_angle_order", "shaft_twist_half_range"]},
        )  # fmt: skip
        angle = found.disc_angle_order.isel(disc=place).sel(order=2)
        ripple = 2.0 * found.speed * np.radians(angle)
        rows.append([name, *(f"{float(one):.1f}" for one in ripple)])
    return rows


def damper() -> str:
    """Effect of the built-in scene's dampers on the largest stress of the crankshaft."""
    found = sweeps.run("torsion")
    stress = found.shaft_stress_half_range.max(["shaft", "speed"]).values
    cases = [str(case) for case in found.case.values]
    told = [f"{stress[cases.index('no damper')]:.0f} MPa without a damper"]
    for kind in ("viscous", "rubber"):
        each = [(value, case) for value, case in zip(stress, cases, strict=True) if kind in case]
        told.append("{:.0f} MPa with '{}'".format(*min(each)))
    return ", ".join(told)


def documents(found: xr.Dataset) -> dict[Path, str]:
    """The page, and the files beside it."""
    every, of_shafts = comparisons(), shafts(found)
    # The shaft in front of the flywheel is what a maker's calculation names first.
    name, torque, speed, order, stress, dead, of_dead, _ = of_shafts[-1]
    mean = float(abs(found.shaft_torque_mean.sel(misfire=0, speed=float(speed))[-1]))
    names = ["natural_frequency", "critical_speed", "shaft_torque_half_range", "shaft_torque_mean",
             "shaft_torque_min", "shaft_twist_half_range", "shaft_loss"]  # fmt: skip
    coupled = run(names, f"{ENGINE}_generator_set", misfire=range(7), speed=[1500, 1800])
    rows = [one for one in every if np.isfinite(one.ours)]
    values = {
        "range": f"{SPEEDS[0]:.0f} to {SPEEDS[-1]:.0f}",
        "natural": natural(found),
        "largest": f"between {name.replace(' - ', ' and ')} is {torque} N m at {speed} rpm "
        f"({stress} MPa), mostly order {order}, beside a mean of {mean:.0f} N m; with cylinder "
        f"{dead} dead it is {of_dead} N m",
        "delta": markdown(deltas(found), 1),
        "coupling_frequency": f"{float(coupled.natural_frequency[0]):.1f}",
        "coupling_critical": f"{float(coupled.critical_speed.sel(mode=1, order=0.5)):.0f}",
        "generator_set": markdown(generator_set(coupled), 2),
        "damper": damper(),
        "flywheels": markdown(flywheels(), 1),
        "counts": f"{len(rows)} values of {len(SYSTEMS)} systems were compared: printed ones, "
        "closed forms, and those of an independent program",
        "exceptions": markdown(exceptions(rows)),
    }
    tables = {"shafts": of_shafts, "published": table(every), "sources": sources(every)}
    return {DOCUMENT: filled(TEMPLATE.read_text(encoding="utf-8"), values)} | {
        DOCUMENT.with_name(f"torsional_vibration_{name}.csv"): csv_text(table)
        for name, table in tables.items()
    }


def draw(found: xr.Dataset) -> None:
    with sheet("torsional_vibration", (7.0, 3.4), columns=2) as (_, ((left, right),)):
        one = found.sel(misfire=0)
        last = one.isel(shaft=-1)
        left.plot(
            SPEEDS, last.shaft_torque_half_range, color="black", label="half range, all orders"
        )
        largest = np.argsort(last.shaft_torque_order.max("speed").values)[:-5:-1]
        for rank, order in enumerate(last.order.values[largest]):
            left.plot(
                SPEEDS, last.shaft_torque_order.sel(order=order), color=shade(rank / 4 + 0.1),
                linestyle=DASHES[rank + 1], label=f"order {order:g}",
            )  # fmt: skip
        left.set_title(f"between {str(last.shaft_name.values).replace(' - ', ' and ')}")
        left.set_ylabel("Vibratory torque (N m)")
        right.plot(SPEEDS, one.delta_elastic, color="black", label="elastic shaft")
        right.plot(SPEEDS, one.delta, color=shade(0.5), linestyle=DASHES[1], label="rigid engine")
        right.set_title("at the flywheel")
        right.set_ylabel("Coefficient of speed fluctuation (1)")
        for panel in (left, right):
            panel.set_xlabel("Engine speed (rpm)")
            panel.set_ylim(bottom=0.0)
            panel.legend()


ARC_SPRINGS: dict[str, Any] = {
    "name": "arc springs", "loss_factor": 0.05,
    "torque_over_twist": {"twist": [0, 20, 45, 60], "torque": [0, 100, 350, 800]},
    "friction_torque": 8.0, "friction_stiffness": 2000.0,
}  # fmt: skip
"""Two stages and a stop, with dry friction; all values are assumed."""


def draw_nonlinear() -> None:
    """The torque in the arc springs of a car's dual-mass flywheel, linearised and as it is."""
    known = tomllib.loads(Path(__file__).with_name("car_shafts.toml").read_text(encoding="utf-8"))
    shaft = known["dual-mass flywheel"]
    shaft["shafts"][5] = ARC_SPRINGS
    speeds = np.arange(500.0, 2501.0, 20.0)
    found = sweeps.run(
        engine="si_four_87x101", shaft=shaft, axes={"speed": speeds.tolist()},
        silenced_warnings=["all"], set={"load": 100},
        output={"quantities": ["shaft_torque_nonlinear", "shaft_torque_half_range"]},
    ).isel(shaft=5)  # fmt: skip
    with sheet("torsional_nonlinear", (5.0, 3.2)) as (_, ((panel,),)):
        panel.plot(speeds, found.shaft_torque_nonlinear, color="black", label="as it is")
        panel.plot(
            speeds, found.shaft_torque_half_range, color=shade(0.5), linestyle=DASHES[1],
            label="linearised",
        )  # fmt: skip
        panel.set_xlabel("Engine speed (rpm)")
        panel.set_ylabel("Vibratory torque (N m)")
        panel.set_ylim(0.0, 500.0)
        panel.legend()


def passed() -> tuple[xr.Dataset, Any]:
    """The built-in scene of a run-up, and the orders of its coupling's torque over time."""
    scene = sweeps.read_scene("torsion_passing")
    shaft = scene.engine.shaft
    assert shaft is not None
    system = shaft.system({key: scene.known[key].si for key in scene.shaft_keys})
    one = sweeps.run(
        engine=ENGINE, set={"speed": 1000}, silenced_warnings=["all"],
        output={"quantities": ["throw_torque_order", "throw_torque_phase"]},
    )  # fmt: skip
    torque = one.throw_torque_order * np.exp(1j * np.radians(one.throw_torque_phase))
    start = float(scene.known["passing_start"].si)
    history = passing_history(
        system, one.order.values, start, 600.0 * RPM, 100.0 * RPM, shaft.throws, torque
    )
    return one, history


def draw_passing() -> None:
    """Torque of the coupling over time while the engine runs up, and its envelope."""
    one, history = passed()
    orders, lines = one.order.values, history.torque[:, -1]
    cycle = (lines @ np.exp(1j * orders[:, None] * np.linspace(0.0, 4.0 * np.pi, 721))).real
    time = np.linspace(0.0, history.time[-1], 6000)
    start, rate = history.speed[0], (history.speed[-1] - history.speed[0]) / history.time[-1]
    angle = (start + 0.5 * rate * time) * time
    part = np.array([np.interp(time, history.time, line.real) for line in lines.T])
    part = part + 1j * np.array([np.interp(time, history.time, line.imag) for line in lines.T])
    torque = (part * np.exp(1j * orders[:, None] * angle)).real.sum(axis=0)
    with sheet("torsion_passing", (7.0, 3.0)) as (_, ((panel,),)):
        panel.plot(time, torque, color=shade(0.6), linewidth=0.4, label="torque over time")
        for edge, label in ((cycle.max(axis=1), "extremes of the cycle"), (cycle.min(axis=1), "")):
            panel.plot(history.time, edge, color="black", label=label or None)
        panel.set_xlabel("Time from 150 rpm on, at 100 rpm/s (s)")
        panel.set_ylabel("Vibratory torque of the coupling (N m)")
        panel.legend()


if __name__ == "__main__":
    wanted = figures_wanted("Write docs/torsional_response.md.")
    over_speed = diesel()
    write(documents(over_speed))
    if wanted:
        draw(over_speed)
        draw_nonlinear()
        draw_passing()
        handed_in = ["system_inertia", "system_stiffness", "system_speed_ratio"]
        keep_figure(sweeps.run("torsion_hand_in")[handed_in], "mass_elastic")
