"""Scenes of generators: the angle, the grid and times, each by another way; what is refused."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import sweeps
from engine_dyn.status import CONVERGED
from engine_dyn.units import RPM
from tests.support.scenes import asking, refusal

pytestmark = pytest.mark.compiled

ENGINE = "diesel_105x137"
SET = {
    "load_exponent": 1, "inertia": 3.5, "speed": 1500, "pole_pairs": 2, "angle_deviation_limit": 3.0
}  # fmt: skip
STROKES = ["intake_duration", "compression_duration", "expansion_duration", "exhaust_duration"]


def run(quantities: list[str], engine: Any = ENGINE, **tables: Any) -> xr.Dataset:
    own = {**SET, **tables.pop("set", {})}
    for table in ("axes", "designs"):
        own = {key: value for key, value in own.items() if key not in tables.get(table, {})}
    return sweeps.run(asking(quantities, engine, set=own, **tables))


@pytest.mark.filterwarnings("ignore::engine_dyn.ImplausibleWarning")
def test_the_angle_is_the_integral_of_the_speed() -> None:
    """By a spline through omega and its integral, with a misfire, which makes omega uneven."""
    names = ["max", "min", "largest", "half_range", "electrical_largest", "over_limit", "order"]
    found = run(
        ["omega", "angle_deviation", *(f"angle_deviation_{name}" for name in names), "cycle_time",
         *STROKES, "interval_duration"],
        set={"misfire": 2, "interval_begin": 300.0, "interval_end": -337.5, "gear_ratio": 0.5},
    )  # fmt: skip
    degree, omega = found.crank_angle.values, found.omega.values
    angle = np.radians(np.append(degree, 360.0))
    slowness = CubicSpline(angle, 1.0 / np.append(omega, omega[0]), bc_type="periodic")
    time = slowness.antiderivative()
    whole = time(angle[-1]) - time(angle[0])
    fine = np.linspace(angle[0], angle[-1], 72001)
    deviation = fine - 4.0 * np.pi * time(fine) / whole
    deviation -= np.trapezoid(deviation * slowness(fine), fine) / whole
    deviation = np.degrees(deviation)
    assert found.angle_deviation.values == pytest.approx(deviation[:-1:100], abs=1e-6)
    half = 0.5 * np.ptp(deviation)
    least, most = deviation.min(), deviation.max()
    largest = max(most, -least)
    expected = [most, least, largest, half, largest, largest / 3.0]  # electrical: 2 times 1/2
    values = [found[f"angle_deviation_{name}"].item() for name in names[:-1]]
    assert values == pytest.approx(expected, rel=1e-5)
    assert half > 0.4  # the misfire is seen
    # The harmonic of the lowest order over the time, at equal steps of it.
    steps = np.linspace(0.0, whole, 7200, endpoint=False)
    angles = np.interp(steps, time(fine) - time(fine[0]), fine)
    curve = np.interp(angles, fine, deviation)
    harmonic = 2.0 * np.mean(curve * np.exp(-2j * np.pi * steps / whole))
    assert found.angle_deviation_order.sel(order=0.5).item() == pytest.approx(
        abs(harmonic), rel=1e-5
    )
    ends = np.radians([-360, -180, 0, 180, 360])
    assert [found[name].item() for name in STROKES] == pytest.approx(np.diff(time(ends)), rel=1e-6)
    assert found.cycle_time.item() == pytest.approx(whole, rel=1e-9)
    interval = time(angle[-1]) - time(np.radians(300.0)) + time(np.radians(-337.5)) - time(angle[0])
    assert found.interval_duration.item() == pytest.approx(interval, rel=1e-6)


def test_a_uniform_rotation_has_the_times_of_a_clock() -> None:
    found = run(
        ["cycle_time", "interval_duration", "angle_deviation_half_range"],
        set={"inertia": 1e9, "interval_begin": 0.0},
        axes={"interval_end": [90.0, 360.0, 0.0], "speed": [1000.0, 1500.0]},
        silenced_warnings=["all"],
    )
    assert found.cycle_time.values == pytest.approx([0.12, 0.08], rel=1e-6)
    turns = np.array([[0.25], [1.0], [2.0]])  # of the same angle, a whole cycle
    expected = turns * [0.06, 0.04]
    assert found.interval_duration.transpose("interval_end", "speed").values == pytest.approx(
        expected, rel=1e-6
    )
    assert (found.angle_deviation_half_range < 1e-8).all()


@pytest.mark.filterwarnings("ignore::engine_dyn.ImplausibleWarning")
def test_the_swing_against_the_grid_is_the_motion_followed_in_time() -> None:
    """J theta'' + d theta' + c theta = M(omega t) less its mean, integrated until it repeats."""
    gear = 1.2
    stiffness, damping = gear**2 * 6000.0, gear**2 * 90.0
    found = run(
        ["gas_torque", "inertia_torque", "grid_angle", "grid_angle_half_range", "grid_power",
         "grid_angle_electrical_half_range", "grid_power_half_range", "grid_natural_frequency"],
        set={"misfire": 2, "synchronising_torque": 6000.0, "damping_torque": 90.0,
             "gear_ratio": gear},
        output={"highest_order": 40},
    )  # fmt: skip
    speed, inertia = 1500.0 * RPM, 3.5
    angle = np.radians(np.append(found.crank_angle.values, 360.0))
    torque = (found.gas_torque + found.inertia_torque).values
    acting = CubicSpline(angle, np.append(torque, torque[0]) - torque.mean(), bc_type="periodic")

    def motion(phi: float, state: np.ndarray) -> list[float]:
        force = acting(phi) - damping * state[1] - stiffness * state[0]
        return [state[1] / speed, force / inertia / speed]

    cycles = 14  # exp(-zeta omega_0 t) is then below 1e-9
    first, last = angle[0] - 4.0 * np.pi * cycles, angle[-1]
    solved = solve_ivp(motion, (first, last), [0.0, 0.0], t_eval=angle, rtol=1e-9, atol=1e-12)
    theta = solved.y[0]
    assert np.radians(found.grid_angle.values) == pytest.approx(
        theta[:-1], abs=2e-3 * np.ptp(theta)
    )
    half = np.degrees(0.5 * np.ptp(theta))
    assert found.grid_angle_half_range.item() == pytest.approx(half, rel=1e-3)
    assert found.grid_angle_electrical_half_range.item() == pytest.approx(2 * gear * half, rel=1e-3)
    power = speed * (stiffness * theta + damping * solved.y[1])
    assert found.grid_power.values == pytest.approx(power[:-1], abs=2e-3 * np.ptp(power))
    assert found.grid_power_half_range.item() == pytest.approx(0.5 * np.ptp(power), rel=2e-3)
    natural = np.sqrt(stiffness / inertia) / (2.0 * np.pi)
    assert found.grid_natural_frequency.item() == pytest.approx(natural, rel=1e-12)


def test_the_free_rotor_and_its_amplification_make_the_swing() -> None:
    found = run(
        ["torque_order", "grid_angle_order", "grid_amplification", "grid_natural_order",
         "electrical_frequency"],
        set={"synchronising_power": 6e5},
    )  # fmt: skip
    assert found.electrical_frequency.item() == pytest.approx(50.0)
    # c = P_s p/omega = 7639.4 N m/rad and J = 3.5 kg m2, by hand: 46.71934 rad/s of 157.08.
    assert found.grid_natural_order.item() == pytest.approx(46.71934 / 157.0796, rel=1e-5)
    order, speed = found.order.values, 1500.0 * RPM
    free = np.degrees(found.torque_order.values / (3.5 * (order * speed) ** 2))
    assert found.grid_angle_order.values == pytest.approx(
        free * found.grid_amplification.values, rel=1e-12
    )
    by_hand = 1.0 / np.abs(1.0 - (46.71934 / 157.0796 / order) ** 2)
    assert found.grid_amplification.values == pytest.approx(by_hand, rel=1e-5)


def test_an_excited_order_near_the_natural_one_is_warned_of() -> None:
    """At 1000 rpm the natural order is 0.546: only a misfire excites 1/2, beside 3."""
    tables: dict[str, Any] = {
        "set": {"synchronising_torque": 11459.0},
        "axes": {"speed": [1000.0, 1500.0], "misfire": [0, 1]},
    }
    # c/J = 11459/3.5: 57.2189 rad/s of 104.7198, order 0.546400; 0.2/(1 - 0.5/0.546400) = 2.355.
    with pytest.warns(match="^grid_resonance_nearness: .* is 2.36; usual is 0 to 1; .*; 1 of 4 "
                      "values, the worst at speed = 1000 rpm, misfire = 1$"):  # fmt: skip
        found = run(["delta", "grid_power_half_range", "grid_nearest_order"], **tables)
    assert (found.status == CONVERGED).all()
    assert found.grid_nearest_order.sel(misfire=1).values == pytest.approx(0.5)
    assert found.grid_nearest_order.sel(misfire=0).values == pytest.approx(3.0)
    narrow = {**tables, "set": {**tables["set"], "resonance_band": 0.05}}
    assert not run(["grid_power_half_range"], **narrow).attrs["warnings"]
    silent = run(["grid_power_half_range"], silenced_warnings=["grid_resonance_nearness"], **tables)
    assert not silent.attrs["warnings"]


@pytest.mark.parametrize(
    ("quantity", "given", "words"),
    [
        ("angle_deviation_electrical", {"pole_pairs": 0}, "[set] pole_pairs = 0: must be"),
        ("angle_deviation_electrical", {"pole_pairs": 1.5}, "[set] pole_pairs = 1.5: must be"),
        ("angle_deviation_electrical", {}, "needs pole_pairs (pairs of poles of the generator)"),
        ("angle_deviation_over_limit", {"pole_pairs": 2}, "needs angle_deviation_limit (largest"),
        ("angle_deviation_over_limit", {"angle_deviation_limit": 0.0},
         "[set] angle_deviation_limit = 0: must be"),
        ("grid_power", {}, "needs pole_pairs (pairs of poles of the generator), "
         "synchronising_power (synchronising power of the generator per electrical radian, in "
         "place of synchronising_torque)"),
        ("grid_power", {"synchronising_torque": -1.0}, "[set] synchronising_torque = -1: must be"),
        ("grid_power", {"synchronising_torque": 1.0, "synchronising_power": 1.0},
         "both determine the synchronising torque; give one of them"),
        ("grid_power", {"damping_torque": -0.1}, "[set] damping_torque = -0.1: must be"),
        ("grid_power", {"resonance_band": 0.0}, "[set] resonance_band = 0: must be"),
        ("interval_duration", {"interval_begin": 0.0}, "needs interval_end (crank angle"),
        ("interval_duration", {"interval_begin": -721.0}, "[set] interval_begin = -721: must be"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_in_one_line(quantity: str, given: Any, words: str) -> None:
    assert words in refusal(asking([quantity], ENGINE, set=given))


@pytest.mark.filterwarnings("ignore::engine_dyn.ImplausibleWarning")
def test_the_table_of_the_page_is_what_its_scene_gives() -> None:
    page = (Path(__file__).parents[2] / "docs" / "generator.md").read_text("utf-8")
    (block,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    scene = tomllib.loads(block)
    found = sweeps.run(scene)
    rows = [[cell.strip() for cell in line.strip("|").split("|")]
            for line in page.splitlines() if line.startswith("| 1")]  # fmt: skip
    columns = {"speed": 1.0, "misfire": 1.0, **dict.fromkeys(scene["output"]["quantities"], 1.0)}
    columns["grid_power_half_range"] = 1e-3  # printed in kW
    flat = found[list(columns)].to_dataframe().reset_index()
    assert len(rows) == len(flat) == 4
    for row, (_, computed) in zip(rows, flat.iterrows(), strict=True):
        for cell, (name, unit) in zip(row, columns.items(), strict=True):
            digits = len(cell.partition(".")[2])
            assert float(cell) == pytest.approx(computed[name] * unit, abs=0.6 * 10.0**-digits), (
                name
            )
