"""Rates of single quantities: scenes that ask for one of them, of designs sampled at random.

python -m benchmarks quantities [--all] [--kinds NAME ...] [--only NAME ...] [--seconds S] [--quick]

prints a table; `python -m benchmarks` writes it into docs/benchmarks/quantities.csv.
Every kind has fixed seeds. Of quantities that are made together, such as peak, mean and angle of a
load or amplitude and phase of an order, one stands for all unless `--all` is given.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import sweeps
from benchmarks import measure, peers, problem
from benchmarks.command import CPUS, settings
from benchmarks.measure import Timing
from benchmarks.studies import FOUR, OF_CYCLE, OF_V6, RANGES, Scene, columns
from benchmarks.study_times import LOOP_STEPS
from benchmarks.tables import number, rows
from engine_dyn.quantities.graph import QUANTITIES
from sweeps.errors import SceneError
from sweeps.planning.plan import make_plan
from sweeps.scene.reading import read_scene

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

OF_MISFIRE = {**OF_V6, "crank_ratio": (0.22, 0.33), "misfire": (0, 6)}

SHARE = {"characteristic_share": (0.3, 0.9)}


class Kind(NamedTuple):
    """A way to sample designs."""

    name: str
    words: str  # what tables say
    engine: str
    ranges: Mapping[str, tuple[float, float]]  # of parameters, each drawn evenly
    aim: float = AIM  # designs a second
    characteristic: tuple[str, float, float] | None = None  # curve, rated power [W], speed [rpm]


KINDS = (
    Kind("sampled", "`ntua`, the six sampled", "ntua", RANGES),
    Kind("offset", "`ntua`, the six and the pin's offset sampled", "ntua",
         {**RANGES, "pin_offset": (-0.018, 0.018)}),
    Kind("misfire", "`v6_96x81`, misfire and load sampled", "v6_96x81", OF_MISFIRE),
    Kind("characteristic", "`ntua`, share of a characteristic sampled", "ntua",
         FOUR | SHARE, AIM, ("diesel", 20e3, 2000.0)),
    Kind("modelled", "`si_four_87x101`, modelled cycles", "si_four_87x101", OF_CYCLE,
         CURVES_NEEDED),
    Kind("modelled_load", "`si_four_87x101`, modelled cycles and load sampled", "si_four_87x101",
         {**OF_CYCLE, "load": (30.0, 100.0)}, CURVES_NEEDED),
    Kind("modelled_characteristic", "`si_four_87x101`, modelled cycles, share of a characteristic",
         "si_four_87x101",
         {name: OF_CYCLE[name] for name in list(OF_CYCLE)[:2]} | SHARE, CURVES_NEEDED,
         ("spark ignition", 120e3, 5500.0)),
)  # fmt: skip


class Rate(NamedTuple):
    """A quantity of one kind of sample, and its warm runs."""

    kind: Kind
    quantity: str
    timing: Timing


class Rates(NamedTuple):
    """All of one run, and the rate of the loop that they are compared with."""

    rows: list[Rate]
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
    designs = problem.table(200_000, (2.0,))
    loop = measure.warm(partial(peers.numba_loop(LOOP_STEPS, threads), designs), 200_000, runs)
    found = []
    for kind in kinds:
        for quantity in quantities:
            if not depends(kind, quantity):
                continue

            def work(size: int, kind: Kind = kind, quantity: str = quantity) -> None:
                sweeps.run(scene_of(kind, quantity, size), threads=threads)

            try:
                count = measure.enough(work, seconds, MOST, FIRST)
            except SceneError as refused:  # what only the physics refuses, in its own words
                log(f"{kind.name:<24}{quantity:<28}{refused}")
                continue
            run = partial(sweeps.run, scene_of(kind, quantity, count), threads=threads)
            found.append(Rate(kind, quantity, measure.warm(run, count, runs)))
            log(f"{kind.name:<24}{quantity:<28}{found[-1].timing.rate:>14,.0f} designs/s")
    return Rates(found, loop)


HEAD = ["quantity", "designs/s", "aim", "over the loop", "designs"]


def body(found: Rates) -> list[list[str]]:
    """One row a quantity and kind; rates below their aim are bold."""
    lines = []
    for row in found.rows:
        rate = row.timing.rate
        lines.append([
            f"{row.kind.words}: `{row.quantity}`",
            number(rate) if rate >= row.kind.aim else f"**{number(rate)}**",
            number(row.kind.aim), number(rate / found.loop.rate), number(row.timing.count, 6),
        ])  # fmt: skip
    return lines


def main(arguments: Sequence[str]) -> None:
    """Measure and print."""
    given = settings(
        "benchmarks quantities", __doc__, arguments, all=False, kinds=[kind.name for kind in KINDS],
        only=sorted(QUANTITIES), seconds=1.0, quick=False, threads=CPUS,
    )  # fmt: skip
    chosen = given.only or CHOSEN
    if given.all:
        chosen = [name for name, node in QUANTITIES.items() if node.kind != "curve"]
    kinds = [kind for kind in KINDS if given.kinds is None or kind.name in given.kinds]
    seconds, runs = (0.05, 1) if given.quick else (given.seconds, 3)
    print("\n".join(rows(HEAD, body(measured(kinds, chosen, given.threads, seconds, runs)))))
