"""Peers that need a library: SciPy, JAX, Diffrax, heyoka; see `peers`."""

from __future__ import annotations

import importlib
import math
import operator
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.peers import (
    MOST_SWEEPS,
    Case,
    Coefficients,
    Curves,
    Processes,
    compiled,
    drive_of,
    drives,
    runge_kutta,
    solve_curves,
)
from benchmarks.problem import CRANKCASE, CYCLE, PRESSURE
from engine_dyn.types import Floats


def drive_at(xp: Any, power: Any = operator.pow, prepare: Any = lambda work: work) -> Any:
    """Drive at an angle, from the closed form of the pressure, by functions of a library."""
    p, one = PRESSURE, prepare(drive_of(xp))
    charge, compression, ratio, polytropic = p.charge, p.compression, p.ratio, p.polytropic
    burns = ((p.burn, p.burn_angle, 2 * p.burn_order), (p.after, p.after_angle, 2 * p.after_order))

    def drive(angle: Any, numbers: Any, cylinders: int) -> Any:
        total = -1.0 * numbers[3]
        for cylinder in range(cylinders):
            phi = angle + cylinder * CYCLE / cylinders
            volume = 1.0 + (ratio - 1.0) * power(xp.sin(0.5 * phi), 2)
            compressed = (ratio / volume) ** polytropic - 1.0
            bar = charge + compression * compressed * power(xp.cos(0.25 * phi), 8)
            for height, shift, order in burns:
                bar += numbers[5] * height * power(xp.cos(0.25 * (phi - shift)), order)
            total += one(xp.sin(phi), xp.cos(phi), 1e5 * bar - CRANKCASE, numbers)
        return total

    return prepare(drive)


# SciPy --------------------------------------------------------------------------------------------

_drive = drive_at(math, prepare=compiled)


@compiled
def right_side(
    phi: float, state: Floats, numbers: tuple[float, ...], half: float, cylinders: int
) -> Floats:
    """The value q and its tangent; compiled, because SciPy calls it thousands of times."""
    load = numbers[4] * state[0] ** half if half > 0.0 else numbers[4]
    out = np.empty(2)
    out[0] = _drive(phi, numbers, cylinders) - load
    out[1] = -half * load / state[0] * state[1] if half > 0.0 else 0.0
    return out


def scipy_ivp(c: Coefficients, phi: Floats, tolerance: float) -> tuple[Any, Any]:
    """DOP853, shooting for the start, one design after the other."""
    found = []
    for numbers in zip(*(each.tolist() for each in c.numbers), strict=True):

        def run(start: float, where: Floats | None, numbers: Any = numbers) -> Any:
            return solve_ivp(
                right_side, (0.0, CYCLE / c.cylinders), [start, 1.0], method="DOP853",
                t_eval=where, args=(numbers, c.half, c.cylinders), rtol=tolerance, atol=tolerance,
                max_step=0.35,
            ).y  # fmt: skip

        start = 1.0 if c.half > 0.0 else 0.0
        for _ in range(MOST_SWEEPS if c.half > 0.0 else 0):
            end = run(start, None)[:, -1]
            step = (end[0] - start) / (1.0 - end[1])
            start += step
            if c.half == 1.0 or abs(step) < 0.1 * tolerance:
                break
        found.append(run(start, phi)[0])
    q = np.stack(found, axis=1)
    return q, c.slope(phi, q)


# JAX and Diffrax ----------------------------------------------------------------------------------


def by_xla(some: Any, static: tuple[int, ...]) -> Curves:
    """Curves by a function of exponent, cylinders, nodes and numbers that XLA compiles."""
    jax: Any = importlib.import_module("jax")
    made = jax.jit(some, static_argnums=static)

    def curves(c: Coefficients, phi: Floats) -> tuple[Any, Any]:
        with jax.enable_x64(True):
            found = made(c.half, c.cylinders, phi.size, c.numbers)
            return tuple(np.asarray(each) for each in found)  # type: ignore[return-value]

    return curves


def jax_scan() -> Curves:
    """`lax.scan` over Runge-Kutta steps, compiled by XLA."""
    jax: Any = importlib.import_module("jax")

    def some(half: float, cylinders: int, nodes: int, numbers: Any) -> Any:
        phi = np.arange(nodes) * CYCLE / cylinders / nodes
        scan = partial(jax.lax.scan, unroll=8)
        return runge_kutta(jax.numpy, scan, lambda step: False, numbers, half, phi, cylinders)

    return by_xla(some, (0, 1, 2))


def diffrax_adaptive(tolerance: float) -> Curves:
    """Dopri8 with adaptive steps, designs under `vmap`."""
    jax: Any = importlib.import_module("jax")
    diffrax: Any = importlib.import_module("diffrax")
    jnp, drive = jax.numpy, drive_at(jax.numpy)

    def one(half: float, cylinders: int, nodes: int, numbers: Any) -> Any:
        period = CYCLE / cylinders
        phi = np.linspace(0.0, period, nodes + 1)

        def slope(angle: Any, state: Any, _: Any) -> Any:
            load = numbers[4] * state[0] ** half if half else numbers[4]
            rate = drive(angle, numbers, cylinders) - load
            return jnp.stack([rate, -half * load / state[0] * state[1]])

        def run(start: Any, saved: Any) -> Any:
            return diffrax.diffeqsolve(
                diffrax.ODETerm(slope), diffrax.Dopri8(), 0.0, period, None,
                jnp.stack([start, jnp.ones_like(start)]), saveat=saved, max_steps=4096,
                stepsize_controller=diffrax.PIDController(
                    rtol=tolerance, atol=tolerance, dtmax=0.35
                ),
            ).ys  # fmt: skip

        start = jnp.ones_like(numbers[4])
        for _ in range(0 if half == 0.0 else 1 if half == 1.0 else 3):
            end = run(start, diffrax.SaveAt(t1=True))[-1]
            start = start + (end[0] - start) / (1.0 - end[1])
        return run(start, diffrax.SaveAt(ts=jnp.asarray(phi)))[:-1, 0]

    def some(half: float, cylinders: int, nodes: int, numbers: Any) -> Any:
        q = jax.vmap(partial(one, half, cylinders, nodes), out_axes=1)(numbers)
        phi = np.arange(nodes) * CYCLE / cylinders / nodes
        return q, drives(jnp, numbers, phi, cylinders) - numbers[4] * q**half

    return by_xla(some, (0, 1, 2))


# heyoka -------------------------------------------------------------------------------------------


def raised(base: Any, order: int) -> Any:
    """Power as products: the series of a general power divides by its base, which is zero here."""
    if order == 1:
        return base
    lower = raised(base, order // 2)
    return lower * lower * base if order % 2 else lower * lower


def heyoka_batch(tolerance: float) -> Curves:
    """Taylor series of the differential equation, a batch of designs as SIMD lanes."""
    hy: Any = importlib.import_module("heyoka")
    batch = int(hy.recommended_simd_size())
    made: dict[tuple[float, int], list[Any]] = {}
    lock = threading.Lock()

    def integrator(half: float, cylinders: int) -> Any:
        numbers = [hy.par[i] for i in range(6)]
        q, s = hy.make_vars("q", "s")
        load = numbers[4] * q**half if half > 0.0 else numbers[4]
        system = [(q, drive_at(hy, raised)(hy.time, numbers, cylinders) - load)]
        if half > 0.0:
            system.append((s, -half * load / q * s))
        state = np.ones((len(system), batch))
        return hy.taylor_adaptive_batch(
            system, state, pars=np.zeros((6, batch)), tol=tolerance, compact_mode=True
        )

    def lanes(solver: Any, numbers: Any, half: float, phi: Floats, period: float) -> Floats:
        """Curves of a batch at nodes, shape (nodes, lanes)."""
        for row, values in enumerate(numbers):
            solver.pars[row] = values
        start = np.ones(batch) if half > 0.0 else np.zeros(batch)
        for _ in range(MOST_SWEEPS if half > 0.0 else 0):
            solver.set_time(0.0)
            solver.state[0], solver.state[1] = start, 1.0
            solver.propagate_until(period)
            step = (solver.state[0] - start) / (1.0 - solver.state[1])
            start = start + step
            if half == 1.0 or np.abs(step).max() < 0.1 * tolerance:
                break
        solver.set_time(0.0)
        solver.state[:] = 1.0
        solver.state[0] = start
        result = solver.propagate_grid(np.repeat(phi[:, None], batch, axis=1))
        return np.asarray(result[-1] if isinstance(result, tuple) else result)[:, 0]

    def curves(c: Coefficients, phi: Floats) -> tuple[Any, Any]:
        key, count = (c.half, c.cylinders), c.kappa.size
        with lock:  # the first one is compiled, and copied for other threads at the same time
            free = made.setdefault(key, []) or [integrator(*key)]
            solver = free.pop() if len(free) > 1 else free[0].__deepcopy__({})
            made[key] = free
        parts = []
        for begin in range(0, count, batch):
            index = np.resize(np.arange(begin, min(begin + batch, count)), batch)
            numbers = [each[index] for each in c.numbers]
            parts.append(lanes(solver, numbers, c.half, phi, CYCLE / c.cylinders))
        made[key].append(solver)
        q = np.concatenate(parts, axis=1)[:, :count]
        return q, c.slope(phi, q)

    return curves


# All of them --------------------------------------------------------------------------------------


def cases(threads: int, processes: Processes, quick: bool) -> tuple[list[Case], list[str]]:
    """Peers whose library is here, and a line about each that is not."""
    many, some = (64, 64) if quick else (2048, 256)

    def alone(curves: Any, nodes: int, **options: Any) -> Any:
        """Bound by Python: in processes."""
        return partial(
            processes, partial(solve_curves, curves=partial(curves, **options), nodes=nodes)
        )

    found = [
        Case("SciPy solve_ivp", f"DOP853, {t:.0e}", alone(scipy_ivp, n, tolerance=t), runs=3)
        for t, n in (((1e-6, 720),) if quick else ((1e-5, 360), (1e-7, 720), (1e-10, 2880)))
    ]
    # Module, series, why it may be absent, designs of a block and of a run, settings, their words.
    optional: list[tuple[str, str, str, int, int, Callable[..., Curves], Any]] = [
        ("jax", "JAX scan", "", 256, many, jax_scan,
         [(f"{n} steps", (), n) for n in ((360,) if quick else (180, 360, 720, 1440))]),
        ("diffrax", "Diffrax", "", 64, some, diffrax_adaptive,
         [] if quick else [(f"Dopri8, {t:.0e}", (t,), n)
                           for t, n in ((1e-5, 360), (1e-7, 720), (1e-9, 1440))]),
        ("heyoka", "heyoka", " (wheels for Linux only)", 64, some, heyoka_batch,
         [(f"batch, {t:.0e}", (t,), n)
          for t, n in (((1e-7, 720),) if quick else ((1e-6, 360), (1e-8, 720), (1e-11, 2880)))]),
    ]  # fmt: skip
    absent = []
    for module, series, why, block, least, make, settings in optional:
        try:
            importlib.import_module(module)
        except (ImportError, OSError):
            absent.append(f"{series}: not installed here{why}")
            continue
        for words, options, nodes in settings:
            solver = partial(
                solve_curves, curves=make(*options), nodes=nodes, threads=threads, block=block,
                padded=module != "heyoka",
            )  # fmt: skip
            found.append(Case(series, words, solver, runs=3, least=least))
    return found, absent
