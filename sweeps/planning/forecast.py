"""What a plan would do, in words: stages, shared work, what is skipped, and the estimated time."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import psutil

from engine_dyn.loads.driven_machine import repeats_of
from engine_dyn.quantities.graph import DIMENSIONS, QUANTITIES
from engine_dyn.speed.fields import TABLE_QUANTITIES
from engine_dyn.speed.methods import STEPPING
from sweeps.dimensions import DESIGN
from sweeps.errors import counted, size_text
from sweeps.planning.blocks import block_count, cut
from sweeps.planning.memory import memory_bytes
from sweeps.planning.plan import Plan, Stage
from sweeps.scene.driven import driven_machine
from sweeps.scene.variants import variant_words

__all__ = ["RATES", "seconds", "table_count", "text"]

RATES = {
    "start": 1.0,  # s, to load what a run needs
    "tables": 7e5,  # tables of work; of many, most are interpolated
    "no iteration": 4e6,  # designs, load exponents in DIRECT
    "iteration": 3.5e6,  # designs, other exponents
    "variable": 3.5e6,  # designs with variable inertia
    "driven": 1e4,  # designs with a load over angle, a table over speed or a driver
    "thesis": 1e2,  # designs
    "picard": 1e1,  # designs
    "torque": 1e6,  # designs, extremes of torque and work
    "curves": 2e7,  # points
    "revolutions": 1e4,  # designs, largest shaking force and the like
    "bytes": 3e8,  # written
}
"""Work a second and core (curves and bytes: a second), for the estimate of time and for nothing
else. A test keeps them near what docs/benchmarks_machines.csv and docs/benchmarks.md measured."""

SHARED_BY = (*TABLE_QUANTITIES, "cylinder_set")
"""Designs that agree in all of these share a table of work."""

DIRECT = {
    2.0: "in closed form, never iterates",
    0.0: "from the moments of the table, one sweep, never iterates",
}
"""Load exponents that the kernel solves without iterating, at constant inertia, and how."""

SEARCH_STEPS = 5
"""Solutions on the way to the inertia for a wanted delta."""

WIDTH = 100


def text(plan: Plan) -> str:
    """Describe a plan for people: how often each stage is computed, what is skipped and why."""
    scene = plan.scene
    axes = ", ".join(f"{d} ({plan.sizes[d]})" for d in scene.dimensions) or "none"
    wide = max(22, *(len(stage.node.name) + 1 for stage in plan.stages))
    lines = [
        f"{scene.title}: {counted(plan.designs, 'design')} of engine {scene.engine.name}",
        f"axes: {axes}",
        "",
        f"{'stage':<{wide}}{'over':<34}{'times':>11}{'designs each':>14}  kept",
        *(_stage_line(plan, stage, wide) for stage in plan.stages),
    ]
    for stage in plan.stages:
        if stage.node.kind == "stage":
            lines += ["", f"{stage.node.name}, {stage.node.long_name}", *_kernel_lines(plan, stage)]
    lines += ["", *_no_cycles(plan), *_skipped(plan)]
    pieces = block_count(plan, cut(plan))
    block = f" in {pieces} blocks" if pieces > 1 else ""
    lines += [
        "",
        f"archive about {size_text(plan.output_bytes)} uncompressed, "
        f"memory for all of it at once about {size_text(memory_bytes(plan))}{block}, "
        f"time about {seconds(plan):.1g} s (first run of this version: compiling besides)",
    ]
    return "\n".join(lines)


def _no_cycles(plan: Plan) -> list[str]:
    """Line on the combinations of parameters that are no possible cycle; empty without any."""
    known = np.asarray(plan.leaves["cycle_known"].data)
    impossible = int(np.isnan(known).sum())
    if not impossible:
        return []
    keys = ", ".join(plan.scene.cycle_keys)
    return [f"no cycle: {impossible} of {known.size} combinations of {keys} (status 4)"]


def seconds(plan: Plan) -> float:
    """Estimated time on this machine, compiling aside; good to a factor of a few."""
    cores = psutil.cpu_count() or 1
    total = RATES["start"] + plan.output_bytes / RATES["bytes"]
    for stage in plan.stages:
        if stage.node.kind == "stage":
            times = SEARCH_STEPS if stage.node.name == "inertia_search" else 1
            total += times * table_count(plan, stage) / (RATES["tables"] * cores)
            total += times * sum(n / (rate * cores) for n, rate in _solutions(plan, stage))
        elif "crank_angle" in stage.dims:
            total += stage.size / RATES["curves"]
        elif stage.node.throws:
            total += stage.size / RATES["revolutions"]
    return total


def table_count(plan: Plan, stage: Stage) -> int:
    """Tables of work that a kernel needs: one for each combination of what they depend on."""
    dims = {s.node.name: s.dims for s in plan.stages}
    dims |= {name: value.dims for name, value in plan.leaves.items()}
    along = {d for name in SHARED_BY if name in stage.node.needs for d in dims[name]}
    return math.prod(plan.sizes[d] for d in along)


def _solutions(plan: Plan, stage: Stage) -> Iterator[tuple[float, float]]:
    """Numbers of designs that are solved alike, and their rate."""
    if not stage.node.can_fail:
        yield stage.size, RATES["torque"]
        return
    scene = plan.scene
    direct = 0.0
    if "power_law" in variant_words(scene):
        exponents = np.asarray(plan.leaves["load_exponent"].data)
        direct = float(np.mean(np.isin(exponents, list(DIRECT))))
    each = stage.size / (len(scene.methods) * len(scene.inertia_models))
    for method in scene.methods:
        for model in scene.inertia_models:
            slowest = RATES["variable"] if model == "variable" else math.inf
            if method in STEPPING:
                yield each, RATES[method]
                continue
            if not driven_machine(scene).plain:
                yield each, RATES["driven"]
                continue
            fraction = 0.0 if method == "newton" or scene.closure == "cycle_time" else direct
            yield each * fraction, min(RATES["no iteration"], slowest)
            yield each * (1.0 - fraction), min(RATES["iteration"], slowest)


def _stage_line(plan: Plan, stage: Stage, wide: int) -> str:
    """One stage: on which axes, how often, how many designs share it, and where it goes."""
    node = stage.node
    times = math.prod(plan.sizes[d] for d in stage.axes)
    curve = [f"{plan.sizes[d]} {d}s" for d in stage.dims if d in DIMENSIONS]
    kept = ""
    if node.kind == "stage":
        kept = "gives " + ", ".join(plan.wanted(stage))
    elif node.name in plan.outputs:
        asked = node.name in plan.scene.quantities
        kept = "in the archive" + ("" if asked else " (outcome)")
        if curve:
            kept += ", each over " + " and ".join(curve).replace("_", " ")
    over = ", ".join(stage.axes) or "one value"
    if len(over) > 33:
        over = f"{over[:30]}..."
    shared = plan.designs // times
    return f"{node.name:<{wide}}{over:<34}{times:>11}{shared:>14}  {kept}".rstrip()


def _kernel_lines(plan: Plan, stage: Stage) -> list[str]:
    """How a kernel does its work: tables, part of the cycle, iteration, traces."""
    speed = stage.node.can_fail
    solved = [m for m in plan.scene.methods if m not in STEPPING] if speed else ["direct"]
    repeated = [m for m in plan.scene.methods if m in STEPPING] if speed else []
    lines = []
    if solved:
        tables = table_count(plan, stage)
        shared = stage.size // tables
        # Designs of a list may agree by chance: what they share is not counted beforehand.
        count = f"{'up to ' if DESIGN in stage.dims else ''}{counted(tables, 'table')}"
        each = f", each shared by {shared}" if shared > 1 else ""
        lines.append(f"  {count} of work for {counted(stage.size, 'design')}{each}")
        lines += [f"  {line}" for line in _part_of_cycle(plan)]
    if speed:
        if solved:
            lines += [f"  method {', '.join(solved)}: {how}" for how in _iteration(plan, solved)]
        if repeated:
            lines.append(f"  method {', '.join(repeated)}: whole cycles, repeated from a start")
        traces = [name for name in ("omega", "angular_acceleration") if plan.has(name)]
        kept = f"{', '.join(traces)}, {plan.sizes['crank_angle']} angles each" if traces else "none"
        lines.append(f"  traces over crank angle kept: {kept}")
    return lines


def _part_of_cycle(plan: Plan) -> list[str]:
    """Even firing repeats the torque Z times a cycle: one firing period is solved."""
    cycle = round(math.degrees(plan.scene.engine.period))
    engines = plan.leaves["cylinders_by_count"].data
    load = driven_machine(plan.scene).over_angle
    repeats = [0]  # what every number divides
    if load is not None:
        gear = np.unique(plan.leaves["gear_ratio"].data)
        repeats = np.unique(repeats_of(load, gear, plan.scene.engine.period)).tolist()
    solved_parts: dict[str, None] = {}
    periods: dict[str, None] = {}
    for engine in engines.values():
        number = str(engine.count) if solved_parts else counted(engine.count, "cylinder")
        together = sorted({math.gcd(engine.symmetry, times) for times in repeats})
        solved = " or ".join(f"{cycle / times:.4g}" for times in together)
        solved_parts.setdefault(f"{solved} ({number})")
        periods.setdefault(f"{number}: {engine.solved}")
    lines = [
        f"part of the cycle of {cycle} degrees that is solved: {', '.join(solved_parts)}",
        f"period of the torque: {'; '.join(periods)}",
    ]
    if load is not None:
        times = ", ".join(str(number) for number in repeats)
        lines.append(f"load over angle: repeats {times} times a cycle")
    return lines


def _iteration(plan: Plan, methods: list[str]) -> list[str]:
    """What each load exponent costs."""
    if methods == ["newton"]:
        return ["iterates"]
    if plan.scene.closure == "cycle_time":
        return ["iterates: closure cycle_time solves for the load coefficient too"]
    if plan.scene.inertia_models == ("variable",):
        return ["iterates: variable inertia"]
    if "power_law" not in variant_words(plan.scene):
        return [
            f"{'driver' if driven_machine(plan.scene).has_driver else 'load'} over speed iterates"
        ]
    exponents = np.unique(plan.leaves["load_exponent"].data)
    lines = [f"load exponent {e:g} {how}" for e, how in DIRECT.items() if e in exponents]
    others = [e for e in exponents if e not in DIRECT]
    if others:
        which = ", ".join(f"{e:g}" for e in others[:4]) + (", ..." if len(others) > 4 else "")
        lines.append(f"load exponent {which} iterates")
    if "variable" in plan.scene.inertia_models:
        lines.append("variable inertia iterates")
    return lines


def _skipped(plan: Plan) -> list[str]:
    """What is not computed, and why."""
    nothing = "nothing that is asked for needs"
    lines = []
    uses_pressure = any("family" in stage.node.needs for stage in plan.stages)
    if not uses_pressure:
        lines.append(f"skipped: cylinder pressure and gas work, {nothing} them")
    if not plan.has("speed_solution"):
        lines.append(f"skipped: the periodic speed, {nothing} it")
    if not plan.has("torque_solution"):
        lines.append(f"skipped: extremes of torque and work, {nothing} them")
    names = [name for name in QUANTITIES if not plan.has(name)]
    if names:
        lines += _wrapped("skipped, because nothing asked for it: ", names)
    lines += [f"axis {name}: nothing that is asked for depends on it" for name in plan.unused]
    return lines


def _wrapped(start: str, names: list[str]) -> list[str]:
    lines = [start]
    for i, name in enumerate(names):
        word = name + (", " if i < len(names) - 1 else "")
        if len(lines[-1]) + len(word) > WIDTH:
            lines.append("  ")
        lines[-1] += word
    return [line.rstrip() for line in lines]
