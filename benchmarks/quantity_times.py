"""Rates of single quantities: scenes that ask for one of them, of designs sampled at random.

python -m benchmarks quantities [--all] [--kinds NAME ...] [--only NAME ...] [--seconds S] [--quick]

prints a table; `python -m benchmarks` writes it into docs/benchmarks/quantities.csv.
Every kind has fixed seeds. Of quantities that are made together, such as peak, mean and angle of a
load or amplitude and phase of an order, one stands for all unless `--all` is given.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import sweeps
from benchmarks import measure, peers, problem
from benchmarks.measure import Timing
from benchmarks.studies import RANGES, SIX, Scene, columns, ranges_of
from benchmarks.study_times import LOOP_STEPS
from benchmarks.wording import number, rows
from engine_dyn.quantities.graph import QUANTITIES
from sweeps.errors import SceneError
from sweeps.planning.plan import make_plan
from sweeps.scene.reading import read_scene

__all__ = ["BEFORE", "KINDS", "Kind", "Rate", "Rates", "measured", "scene_of", "table"]

MOST = 1_000_000
"""Designs of a run, at most."""

FIRST = 300
"""Designs of the first runs, which compile."""

CHOSEN = (
    "imep", "torque_mean", "engine_inertia", "torque_max", "energy_swing", "inertia_required",
    "gas_torque_order", "inertia_torque_order", "gravity_torque_order", "torque_order",
    "cylinder_torque_order", "throw_torque_order", "crank_pin_load_max", "piston_pin_load_max",
    "main_journal_load_max", "shaking_force_max", "shaking_force_rms", "shaking_moment_max",
    "shaking_force_major", "best_fraction_rms", "best_fraction_peak", "rod_torque_error",
    "rod_thrust_error", "velocity_truncation_error", "characteristic_load",
)  # fmt: skip
"""One quantity of each way to compute any."""

CURVES_NEEDED = 2000.0
"""Aim [designs/s] where every design has a modelled cycle of its own."""

AIM = 20_000.0
"""Aim [designs/s] otherwise."""

SETTINGS: dict[str, Any] = {
    "cylinder_spacing": 0.2, "counterweight_fraction": 0.4, "counterweight_radius": 0.1,
    "balance_shaft_mass": 0.5, "balance_shaft_radius": 0.02, "second_shaft_mass": 0.2,
    "second_shaft_radius": 0.02, "flywheel_outer_diameter": 0.5, "flywheel_inner_diameter": 0.3,
    "flywheel_density": 7800.0, "rim_speed_limit": 40.0, "rod_inertia": 0.1,
}  # fmt: skip
"""What balance and flywheel need to be known; the shafts stand in the forces."""

OF_V6 = {"inertia": (0.15, 0.6), "speed": (2500.0, 6400.0), "load": (30.0, 100.0),
         "crank_ratio": (0.22, 0.33), "misfire": (0, 6)}  # fmt: skip

OF_CYCLE = {"combustion_start": (-35.0, -15.0), "compression_ratio": (8.5, 10.5),
            "heat": (14.0, 32.0)}  # fmt: skip

SHARE = {"characteristic_share": (0.3, 0.9)}


@dataclass(frozen=True)
class Kind:
    """A way to sample designs.

    Attributes
    ----------
    name, words : str
        Short name, and what tables say.
    engine : str
        Engine of the catalogue.
    ranges : mapping
        Parameters drawn, each evenly from its range.
    aim : float
        Designs a second.
    characteristic : tuple, optional
        Curve, rated power [W] and speed [rpm]; the load follows from it.
    """

    name: str
    words: str
    engine: str
    ranges: Mapping[str, tuple[float, float]]
    aim: float = AIM
    characteristic: tuple[str, float, float] | None = None


KINDS = (
    Kind("sampled", "`ntua`, the six sampled", "ntua", RANGES),
    Kind("offset", "`ntua`, the six and the pin's offset sampled", "ntua",
         {**ranges_of(*SIX), "pin_offset": (-0.018, 0.018)}),
    Kind("misfire", "`v6_96x81`, misfire and load sampled", "v6_96x81", OF_V6),
    Kind("characteristic", "`ntua`, share of a characteristic sampled", "ntua",
         {name: RANGES[name] for name in SIX[:4]} | SHARE, AIM, ("diesel", 20e3, 2000.0)),
    Kind("modelled", "`si_four_87x101`, modelled cycles", "si_four_87x101", OF_CYCLE,
         CURVES_NEEDED),
    Kind("modelled_load", "`si_four_87x101`, modelled cycles and load sampled", "si_four_87x101",
         {**OF_CYCLE, "load": (30.0, 100.0)}, CURVES_NEEDED),
    Kind("modelled_characteristic", "`si_four_87x101`, modelled cycles, share of a characteristic",
         "si_four_87x101",
         {name: OF_CYCLE[name] for name in list(OF_CYCLE)[:2]} | SHARE, CURVES_NEEDED,
         ("spark ignition", 120e3, 5500.0)),
)  # fmt: skip

BEFORE: Mapping[str, Mapping[str, float]] = {
    "sampled": {
        "engine_inertia": 18_500, "torque_max": 46_500, "energy_swing": 46_900,
        "inertia_required": 49_000, "gas_torque_order": 4_120, "torque_order": 3_860,
        "cylinder_torque_order": 8_380, "throw_torque_order": 419, "crank_pin_load_max": 2_060,
        "piston_pin_load_max": 3_130, "main_journal_load_max": 300, "shaking_force_max": 5_190,
        "shaking_force_rms": 8_570, "shaking_moment_max": 6_170, "shaking_force_major": 68_300,
        "best_fraction_rms": 6_250, "best_fraction_peak": 2_780, "rod_torque_error": 11_800,
        "rod_thrust_error": 13_200, "velocity_truncation_error": 75_200,
    },
    "offset": {"shaking_force_major": 257, "rod_torque_error": 4_320},
    "misfire": {
        "crank_pin_load_max": 2_740, "main_journal_load_max": 256, "gas_torque_order": 304,
        "cylinder_torque_order": 492, "throw_torque_order": 30, "shaking_force_max": 5_030,
        "shaking_force_rms": 8_100, "best_fraction_rms": 7_180, "best_fraction_peak": 2_790,
        "energy_swing": 6_590,
    },
    "characteristic": {"characteristic_load": 42_400},
    "modelled": {
        "imep": 5_260, "torque_max": 4_510, "gas_torque_order": 3_090, "torque_order": 2_180,
        "throw_torque_order": 3_410, "crank_pin_load_max": 3_090, "main_journal_load_max": 2_320,
        "piston_pin_load_max": 4_050, "inertia_required": 2_590,
    },
    "modelled_characteristic": {"characteristic_load": 255},
}  # fmt: skip
"""Designs a second of one core before kernels took over, measured once (2026-11-23, beside other
work), so that the tables show what changed."""


@dataclass(frozen=True)
class Rate:
    """A quantity of one kind of sample, and its warm runs."""

    kind: Kind
    quantity: str
    timing: Timing


@dataclass(frozen=True)
class Rates:
    """All of one run, and the rate of the loop that they are compared with."""

    threads: int
    rows: tuple[Rate, ...]
    loop: Timing


def scene_of(kind: Kind, quantity: str, size: int) -> Scene:
    """Scene of so many designs that asks for one quantity."""
    designs, given = columns(size, kind.ranges), dict(SETTINGS)
    follows = quantity.startswith(("flywheel", "triangle")) or quantity in (
        "inertia_energy_swing", "inertia_energy_swing_error", "inertia_required", "inertia_share",
        "inertia_triangular", "inertia_triangular_error", "cycle_work",
    )  # fmt: skip
    if follows:  # the inertia, from the fluctuation that is wanted
        designs.pop("inertia", None)
        given["wanted_delta"] = 0.02
    scene: Scene = {
        "engine": kind.engine, "designs": designs, "set": given,
        "output": {"quantities": [quantity], "highest_order": 6},
    }  # fmt: skip
    if kind.characteristic is not None:
        scene["characteristic"] = {"kind": kind.characteristic[0]}
        given["rated_power"], given["rated_speed"] = kind.characteristic[1:]
    return scene


def depends(kind: Kind, quantity: str) -> bool:
    """Whether a quantity is known of these designs and differs between them."""
    try:
        plan = make_plan(read_scene(scene_of(kind, quantity, 2)))
    except SceneError:
        return False
    return "design" in plan.dims(quantity)


def measured(
    kinds: Sequence[Kind], quantities: Sequence[str], threads: int, seconds: float, runs: int = 3,
    log: Callable[[str], None] = print,
) -> Rates:  # fmt: skip
    """Time quantities of some kinds of samples, warm; each run takes about `seconds`."""
    loop, designs = peers.numba_loop(LOOP_STEPS, threads), problem.table(200_000, (2.0,))
    loop(designs)
    of_loop = [measure.seconds_of(loop, designs) for _ in range(runs)]
    found = []
    for kind in kinds:
        for quantity in quantities:
            if not depends(kind, quantity):
                continue

            def work(size: int, kind: Kind = kind, quantity: str = quantity) -> None:
                sweeps.run(scene_of(kind, quantity, size), threads=threads)

            try:
                work(FIRST)
            except SceneError as refused:  # what only the physics refuses, in its own words
                log(f"{kind.name:<24}{quantity:<28}{refused}")
                continue
            count = measure.enough(work, seconds, MOST, FIRST)
            scene = scene_of(kind, quantity, count)
            run = partial(sweeps.run, scene, threads=threads)
            run()
            times = tuple(measure.seconds_of(run) for _ in range(runs))
            found.append(Rate(kind, quantity, Timing(count, times)))
            log(f"{kind.name:<24}{quantity:<28}{found[-1].timing.rate:>14,.0f} designs/s")
    return Rates(threads, tuple(found), Timing(len(designs), tuple(of_loop)))


HEAD = ["quantity", "designs/s", "aim", "over the loop", "before", "designs"]


def body(found: Rates) -> list[list[str]]:
    """One row a quantity and kind; rates below their aim are bold."""
    lines = []
    for row in found.rows:
        rate, before = row.timing.rate, BEFORE.get(row.kind.name, {}).get(row.quantity)
        shown = number(rate) if rate >= row.kind.aim else f"**{number(rate)}**"
        lines.append([
            f"{row.kind.words}: `{row.quantity}`", shown,
            number(row.kind.aim), number(rate / found.loop.rate),
            "-" if before is None else number(before), number(row.timing.count, 6),
        ])  # fmt: skip
    return lines


def table(found: Rates) -> list[str]:
    """The rows in Markdown."""
    return rows(HEAD, body(found))


def main(arguments: Sequence[str]) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks quantities", description=__doc__)
    parser.add_argument("--all", action="store_true", help="every quantity that is no curve")
    parser.add_argument("--kinds", nargs="+", choices=[kind.name for kind in KINDS])
    parser.add_argument("--only", nargs="+", choices=sorted(QUANTITIES), metavar="NAME")
    parser.add_argument("--seconds", type=float, default=1.0, help="of a run (1)")
    parser.add_argument("--quick", action="store_true", help="short runs, one each")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args(arguments)
    chosen = options.only or CHOSEN
    if options.all:
        chosen = [name for name, node in QUANTITIES.items() if node.kind != "curve"]
    kinds = [kind for kind in KINDS if options.kinds is None or kind.name in options.kinds]
    seconds, runs = (0.05, 1) if options.quick else (options.seconds, 3)
    found = measured(kinds, chosen, options.threads, seconds, runs)
    print("\n".join(table(found)))
