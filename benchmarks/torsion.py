"""Rates of the torsional vibration of a shaft, beside NumPy and openTorsion on the same matrices.

python -m benchmarks.torsion [--quick]    writes docs/benchmarks/torsion.csv

The measured diesel of the catalogue: nine discs, orders 1/2 to 12, and a torque on each of six
throws. Every case has its own inertias and speed. The peers take turns with the project in one
process; times are medians of warm runs.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from benchmarks.command import CPUS, ROOT, log, settings
from benchmarks.tables import number, save, small
from engine_dyn.torsion.forced import forced_response
from engine_dyn.torsion.modes import natural_modes
from engine_dyn.torsion.system import matrices, shaft_system
from sweeps.reading.shaft_tables import read_shaft

HEAD = ["what", "by", "threads", "cases", "cases/s", "largest difference"]

ORDERS = np.arange(0.5, 12.25, 0.5)

RUNS, AT_ONCE = 5, 2000


class Cases(NamedTuple):
    """Inertias (n, 9) and speeds (n) of cases, torques (6, 24) that all have, and the discs."""

    inertia: Any
    speed: Any
    torque: Any
    stiffness: Any
    loss_factor: Any
    disc_damping: Any
    throws: tuple[int, ...]

    def first(self, count: int) -> Cases:
        """The first cases."""
        return self._replace(inertia=self.inertia[:count], speed=self.speed[:count])

    @property
    def system(self) -> Any:
        """All shafts."""
        return shaft_system(
            self.inertia, self.stiffness, loss_factor=self.loss_factor,
            disc_damping=self.disc_damping,
        )  # fmt: skip


def cases(count: int) -> Cases:
    """The diesel with inertias drawn within a tenth."""
    given = read_shaft("diesel_105x137", ROOT, "")
    assert given is not None
    shaft, values = given.shaft, given.values
    draw = np.random.default_rng(1)
    inertia = np.array(shaft.inertias(values)) * draw.uniform(0.9, 1.1, (count, len(shaft.discs)))
    torque = draw.normal(size=(2, 6, ORDERS.size)) * 400.0 / (1.0 + ORDERS**2)
    return Cases(
        inertia, draw.uniform(100.0, 250.0, count), torque[0] + 1j * torque[1],
        shaft.stiffnesses(values), shaft.along("shaft_loss_factor", values, 0.0),
        shaft.along("disc_damping", values, 0.0), shaft.throws,
    )  # fmt: skip


def ours(of: Cases, threads: int, *wanted: str) -> Any:
    """By elimination."""
    pairs = [(i, i + 1) for i in range(8)] if "twist_extremes" in wanted else ()
    return forced_response(
        of.system, ORDERS, of.speed, of.throws, of.torque, wanted=wanted, twist=pairs,
        threads=threads,
    )  # fmt: skip


def by_numpy(of: Cases) -> Any:
    """Torques in the shafts by a dense solution of all orders at once."""
    found = []
    for begin in range(0, of.speed.size, AT_ONCE):
        some = of._replace(
            inertia=of.inertia[begin : begin + AT_ONCE], speed=of.speed[begin : begin + AT_ONCE]
        )
        inertia, stiffness, loss, damping = matrices(some.system)
        w = some.speed[:, None] * ORDERS
        dynamic = (stiffness + 1j * loss)[:, None] + 1j * w[..., None, None] * damping[:, None]
        diagonal = np.einsum("...ii->...i", dynamic)
        diagonal -= w[..., None] ** 2 * inertia[:, None]
        force = np.zeros((*w.shape, 9), dtype=complex)
        force[..., list(of.throws)] = of.torque.T
        angle = np.linalg.solve(dynamic, force[..., None])[..., 0]
        held = np.array(of.stiffness) * (1.0 + 1j * np.array(of.loss_factor))
        found.append(held[:, None] * np.diff(np.swapaxes(angle, -1, -2), axis=-2))
    return np.concatenate(found)


def by_opentorsion(of: Cases) -> Any:
    """Torques in the shafts by openTorsion, which knows no loss factor: without it."""
    import opentorsion

    found = []
    for inertia, speed in zip(of.inertia, of.speed, strict=True):
        shafts = [
            opentorsion.Shaft(i, i + 1, None, None, k=k, I=0) for i, k in enumerate(of.stiffness)
        ]
        discs = [opentorsion.Disk(i, inertia[i], c=of.disc_damping[i]) for i in range(inertia.size)]
        acting = opentorsion.PeriodicExcitation(9, ORDERS * speed)
        for throw, line in zip(of.throws, of.torque, strict=True):
            acting.add_sines(throw, ORDERS * speed, np.abs(line), np.angle(line))
        assembly = opentorsion.Assembly(shafts, disk_elements=discs)
        found.append(-assembly.vibratory_torque(acting)[0])  # it is that on the second disc
    return np.array(found)


def seconds(work: Callable[[], Any], runs: int) -> float:
    """Median of warm runs."""
    work()
    found = []
    for _ in range(runs):
        began = time.perf_counter()
        work()
        found.append(time.perf_counter() - began)
    return statistics.median(found)


def apart(one: Any, other: Any) -> str:
    """Largest difference over the largest of each case and shaft."""
    scale = np.abs(other).max(axis=-1, keepdims=True)
    return small(float((np.abs(one - other) / scale).max()))


def rows(size: int, runs: int) -> list[list[str]]:
    """The table."""
    of = cases(size)
    few, fewer = of.first(max(size // 50, 20)), of.first(max(size // 1000, 5))
    undamped = fewer._replace(loss_factor=[0.0] * 8)
    dense, theirs = by_numpy(few), by_opentorsion(undamped)
    found = []

    def row(what: str, by: str, threads: int, some: Cases, work: Callable[[], Any],
            difference: str = "-") -> None:  # fmt: skip
        log(f"{what}, {by}, {threads}")
        count = some.speed.size
        rate = count / seconds(work, runs)
        found.append([what, by, str(threads), number(count), number(rate), difference])

    forced, cycle = "each order", "half ranges of all shafts"
    for threads in sorted({1, CPUS}):
        row(forced, "engine_dyn", threads, of, partial(ours, of, threads, "shaft_loss"))
        row(
            "torques of each order stored",
            "engine_dyn",
            threads,
            of,
            partial(ours, of, threads, "torque"),
            apart(ours(few, 1, "torque")["torque"], dense),
        )
        row(cycle, "engine_dyn", threads, of, partial(ours, of, threads, "torque_extremes"))
    row("torques of each order stored", "NumPy, dense", 1, few, lambda: by_numpy(few))
    row(
        "torques of each order stored",
        "openTorsion, no loss factor",
        1,
        undamped,
        lambda: by_opentorsion(undamped),
        apart(ours(undamped, 1, "torque")["torque"], theirs),
    )
    row(
        "natural frequencies and shapes",
        "engine_dyn (NumPy)",
        1,
        few,
        lambda: natural_modes(few.system),
    )
    return found


def main() -> None:
    """Measure and write."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    given = settings("benchmarks.torsion", __doc__, quick=False)
    folder = ROOT / ("out/bench" if given.quick else "docs") / "benchmarks"
    body = rows(2_000 if given.quick else 100_000, 1 if given.quick else RUNS)
    save(folder / "torsion.csv", HEAD, body)
    for line in body:
        print("  ".join(line))


if __name__ == "__main__":
    main()
