"""Run time against error of the methods, on designs that share nothing.

    python benchmarks/methods.py [--designs N] [--threads N]

Every method solves the same designs, each with a crank ratio, masses, inertia and load of its own,
in one process; times are medians of several warm runs, compile time is reported apart. The error is
that of delta against method newton at sixteen times the nodes, which itself agrees with the
independent solver of tests/oracle to about 1e-9 (docs/validation.md). A plain loop in Numba that
integrates domega/dphi with the classical Runge-Kutta method, cycle after cycle, stands for the
obvious program (a clever one is faster: it need not repeat cycles); SciPy's solve_ivp for the
usual script. The machine is rarely quiet:
compare ratios.
"""

from __future__ import annotations

import argparse
import math
import os
import platform
import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numba
import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

from engine_dyn import Diagram, diagram_from_points, family_from_diagrams
from engine_dyn.speed import sweep

PERIOD = 4.0 * math.pi
BORE, STROKE, CRANKCASE = 0.14, 0.18, 1.0e5
LEVER = 0.25 * math.pi * BORE**2 * 0.5 * STROKE


def smooth_diagram() -> Diagram:
    """Compression and one combustion hump in closed form, at half degrees."""
    phi = np.radians(np.arange(-360.0, 360.0, 0.5))
    volume = 1.0 + 14.0 * np.sin(0.5 * phi) ** 2
    hump = np.cos(0.25 * phi) ** 8
    burnt = np.cos(0.25 * (phi - 0.2)) ** 240
    return diagram_from_points(phi, 1e5 + 1e5 * ((15.0 / volume) ** 1.33 - 1.0) * hump
                               + 35e5 * burnt, PERIOD)  # fmt: skip


def random_designs(count: int, diagram: Diagram) -> dict[str, Any]:
    """Designs with everything of their own, exponent 2, loaded."""
    random = np.random.default_rng(1)
    ratio = random.uniform(0.2, 0.33, count)
    family = family_from_diagrams([0.0], [diagram])
    gas = LEVER * sweep.mean_gas_torque(ratio, np.zeros(count), family)
    return {
        "family": family, "crank_ratio": ratio, "row": np.zeros(count), "scale": 1.0,
        "crankcase_pressure": CRANKCASE, "bore": BORE, "stroke": STROKE,
        "mass": random.uniform(3.0, 9.0, count), "speed": random.uniform(90.0, 200.0, count),
        "inertia": random.uniform(1.0, 6.0, count), "exponent": 2.0, "offset": 0.0,
        "mean_torque": gas * random.uniform(0.75, 0.95, count), "friction_torque": 0.0,
    }  # fmt: skip


@numba.njit(nogil=True, fastmath=True, error_model="numpy")
def runge_kutta(
    pressure: npt.NDArray[np.float64], ratio: float, mass: float, speed: float, inertia: float,
    torque_mean: float, friction: float, steps: int, cycles: int,
) -> float:  # fmt: skip
    """Return delta by cycle repetition with RK4; pressure is tabulated at half steps."""
    width = PERIOD / steps
    torque = np.empty(2 * steps)
    for j in range(2 * steps):
        phi = 0.5 * width * j
        sine, cosine = math.sin(phi), math.cos(phi)
        root = math.sqrt(1.0 - (ratio * sine) ** 2)
        v = sine * (1.0 + ratio * cosine / root)
        b = cosine + ratio * (cosine**2 - sine**2 + ratio**2 * sine**4) / root**3
        inertial = mass * (0.5 * STROKE * speed) ** 2 * b * v
        torque[j] = LEVER * (pressure[j] - CRANKCASE) * v - inertial - friction
    k = torque_mean / speed**2
    omega = speed
    delta = 0.0
    for _ in range(cycles):
        begin = omega
        high, low, total = omega, omega, 0.0
        for j in range(steps):
            m0, m1 = torque[2 * j], torque[2 * j + 1]
            m2 = torque[2 * j + 2] if j + 1 < steps else torque[0]
            total += omega
            k1 = (m0 - k * omega * omega) / (inertia * omega)
            w = omega + 0.5 * width * k1
            k2 = (m1 - k * w * w) / (inertia * w)
            w = omega + 0.5 * width * k2
            k3 = (m1 - k * w * w) / (inertia * w)
            w = omega + width * k3
            k4 = (m2 - k * w * w) / (inertia * w)
            omega += width / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
            high, low = max(high, omega), min(low, omega)
        delta = (high - low) / (total / steps)
        if abs(omega - begin) < 1e-9 * speed:
            break
    return delta


@numba.njit(nogil=True)
def loop(
    pressure: npt.NDArray[np.float64], ratio: npt.NDArray[np.float64],
    mass: npt.NDArray[np.float64], speed: npt.NDArray[np.float64],
    inertia: npt.NDArray[np.float64], torque_mean: npt.NDArray[np.float64],
    friction: npt.NDArray[np.float64], steps: int, delta: npt.NDArray[np.float64],
) -> None:  # fmt: skip
    """All designs, one after the other."""
    for i in range(ratio.size):
        delta[i] = runge_kutta(
            pressure, ratio[i], mass[i], speed[i], inertia[i], torque_mean[i], friction[i], steps,
            20000,
        )  # fmt: skip


def with_scipy(designs: dict[str, Any], friction: npt.NDArray[np.float64], diagram: Diagram,
               count: int) -> npt.NDArray[np.float64]:  # fmt: skip
    """solve_ivp over one cycle in omega^2, with secant steps on its start; `count` designs."""
    from engine_dyn import acceleration, velocity

    deltas = np.empty(count)
    for i in range(count):
        ratio, speed = designs["crank_ratio"][i], designs["speed"][i]
        inertia, mean = designs["inertia"][i], designs["mean_torque"][i]
        moment = designs["mass"][i] * (0.5 * STROKE * speed) ** 2

        def slope(phi: float, y: Any, ratio: float = ratio, speed: float = speed,
                  inertia: float = inertia, mean: float = mean, moment: float = moment,
                  i: int = i) -> Any:  # fmt: skip
            v, b = velocity(phi, ratio), acceleration(phi, ratio)
            torque = LEVER * (diagram(np.array([phi]))[0] - CRANKCASE) * v - moment * b * v
            return 2.0 / inertia * (torque - friction[i] - mean / speed**2 * y)

        def run(start: float, slope: Any = slope) -> Any:
            return solve_ivp(slope, (0.0, PERIOD), [start], rtol=1e-6, atol=1e-6 * start,
                             dense_output=True, max_step=0.1)  # fmt: skip

        a = speed**2
        fa = run(a).y[0, -1] - a
        b = a + fa
        fb = run(b).y[0, -1] - b
        solution = run(b - fb * (b - a) / (fb - fa))  # linear in y: one secant step is exact
        omega = np.sqrt(solution.sol(np.linspace(0.0, PERIOD, 7201))[0])
        deltas[i] = (omega.max() - omega.min()) / omega[:-1].mean()
    return deltas


def timed(work: Callable[[], Any], runs: int) -> tuple[float, Any]:
    """Median time of warm runs, and the last result."""
    times = []
    result = None
    for _ in range(runs):
        begin = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - begin)
    return statistics.median(times), result


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="run time against error of the methods")
    parser.add_argument("--designs", type=int, default=2000)
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    diagram = smooth_diagram()
    few = min(options.designs, 200)
    designs = random_designs(options.designs, diagram)
    friction = (
        LEVER * sweep.mean_gas_torque(designs["crank_ratio"], designs["row"], designs["family"])
        - designs["mean_torque"]
    )

    def part(count: int) -> dict[str, Any]:
        return {name: value[:count] if isinstance(value, np.ndarray) else value
                for name, value in designs.items()}  # fmt: skip

    def solve(count: int, **more: Any) -> Any:
        inputs = {**part(count), "friction_torque": friction[:count]}
        return sweep.solve(wanted=("delta",), threads=options.threads, **more, **inputs)["delta"]

    begin = time.perf_counter()
    solve(1)
    compiling = time.perf_counter() - begin
    reference = solve(options.designs, method="newton", finer=16)
    pressures = {n: diagram(0.5 * PERIOD / n * np.arange(2 * n)) for n in (360, 1440)}

    def plain(steps: int, count: int) -> npt.NDArray[np.float64]:
        delta = np.empty(count)
        columns = [designs[n][:count] for n in ("crank_ratio", "mass", "speed", "inertia",
                                                "mean_torque")]  # fmt: skip
        loop(pressures[steps], *columns, friction[:count], steps, delta)
        return delta

    plain(360, 1)
    cases: list[tuple[str, int, int, Callable[[int], Any]]] = [
        ("auto", options.designs, 5, lambda n: solve(n)),
        ("newton", options.designs, 3, lambda n: solve(n, method="newton")),
        ("picard", few, 3, lambda n: solve(n, method="picard")),
        ("thesis (Euler, 1 degree)", few, 3, lambda n: solve(n, method="thesis")),
        ("Numba loop, RK4, 360 steps, 1 thread", few, 3, lambda n: plain(360, n)),
        ("Numba loop, RK4, 1440 steps, 1 thread", few, 3, lambda n: plain(1440, n)),
        ("SciPy solve_ivp, 1e-6", 20, 1,
         lambda n: with_scipy(designs, friction, diagram, n)),
    ]  # fmt: skip
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} processors, "
          f"{options.threads} threads, Python {platform.python_version()}, "
          f"numba {numba.__version__}; first call {compiling:.1f} s")  # fmt: skip
    print(f"{'method':<40}{'designs/s':>12}{'of auto':>10}{'median error':>15}{'worst':>10}")
    auto = 0.0
    for name, count, runs, work in cases:
        work(min(count, 2))
        seconds, delta = timed(partial(work, count), runs)
        rate = count / seconds
        auto = auto or rate
        error = np.abs(delta / reference[:count] - 1.0)
        print(f"{name:<40}{rate:>12.0f}{rate / auto:>10.2g}{np.median(error):>15.1e}"
              f"{np.max(error):>10.1e}")  # fmt: skip


if __name__ == "__main__":
    main()
