"""The text of `engine-dyn plan`: stages, shared work, what is skipped, and the estimated time."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import psutil

from engine_dyn.loads.driven_machine import repeats_of
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.quantities.graph import DIMENSIONS, QUANTITIES
from engine_dyn.quantities.speed import CLOSE_CURVES
from engine_dyn.speed.fields import CURVE_NAMES, METHOD_NAMES, METHODS, STEPPING
from engine_dyn.speed.mechanisms import BATCH, GENERAL
from sweeps.base.dimensions import ARRANGEMENT, DESIGN, ENGINE, NONLINEAR_STATUS, TORSION_STATUS
from sweeps.base.errors import counted, size_text
from sweeps.scene.consistency.transient import impossible
from sweeps.scene.plan.blocks import block_count, divided
from sweeps.scene.plan.leaves import LOOKED_AT, cycles_known, modes_kept
from sweeps.scene.plan.plan import Plan, Stage
from sweeps.scene.plan.rates import SECONDS, SERIAL, START, WRITING

DIRECT = {2.0: "in closed form, without iteration"}
"""Load exponents that the kernel solves without iteration at constant inertia, and how."""

FRONT = "fronts of three"

FOLLOWED = "transient_status"
"""What the stage of a speed that does not repeat gives."""


def text(plan: Plan) -> str:
    """Describe a plan for people: how often each stage is computed, what is skipped and why."""
    if plan.parts:
        return _text_of_several(plan)
    drawn, plan = plan, _in_one(plan)
    scene = plan.scene
    axes = ", ".join(f"{d} ({plan.sizes[d]})" for d in scene.dimensions) or "none"
    wide = max(22, *(len(stage.node.name) + 1 for stage in plan.stages))
    lines = [
        f"{scene.title}: {plan.designs_text} of engine {scene.engine.name}",
        f"axes: {axes}",
        "",
        f"{'stage':<{wide}}{'over':<34}{'times':>11}{'designs each':>14}  kept",
        *(_stage_line(plan, stage, wide) for stage in plan.stages),
    ]
    for stage in plan.stages:
        if stage.node.kind == "stage":
            lines += ["", f"{stage.node.name}, {stage.node.long_name}", *_kernel_lines(plan, stage)]
    lines += ["", *_no_cycles(plan), *_no_designs(plan), *_skipped(plan)]
    return "\n".join([*lines, "", _room_and_time(drawn)])


def _in_one(plan: Plan) -> Plan:
    """A plan as if the designs of all its portions were drawn at once."""
    many = len(plan.portions)
    sizes = {d: n * (many if d == DESIGN else 1) for d, n in plan.sizes.items()}
    stages = tuple(
        replace(stage, size=math.prod(sizes[d] for d in stage.dims)) for stage in plan.stages
    )
    return replace(plan, sizes=sizes, stages=stages, portions=range(1))


def _room_and_time(plan: Plan) -> str:
    """Memory and time of a plan; the seconds have one significant digit: 10, not 1e+01."""
    if plan.scene.reduce is not None:
        return _of_reduced(plan)
    lengths, memory = divided(plan)
    pieces = block_count(plan, lengths)
    in_blocks = f" in {pieces} blocks" if pieces > 1 else ""
    return (
        f"archive about {size_text(plan.output_bytes)} uncompressed, memory for all of it at once "
        f"about {size_text(memory)}{in_blocks}, time about "
        f"{float(f'{seconds(plan):.1g}'):.12g} s (plus compilation on the first run of this kind)"
    )


def _of_reduced(plan: Plan) -> str:
    """Memory and time of a plan whose designs are reduced as they are computed."""
    whole = len(plan.portions)
    drawn = f" drawn in {whole} portions" if whole > 1 else ""
    time = START + whole * seconds_of_computing(plan)
    return (
        f"reduced as they are computed: {plan.designs_text}{drawn}, of which the "
        f"archive holds what [reduce] asks for; time about {float(f'{time:.1g}'):.12g} s (plus "
        "compilation on the first run of this kind)"
    )


def _text_of_several(plan: Plan) -> str:
    """Text on a plan of several engines: cost of each, and of all together."""
    scene = plan.scene
    axes = ", ".join(f"{d} ({plan.sizes[d]})" for d in scene.dimensions)
    lines = [
        f"{scene.title}: {plan.designs_text} of {len(plan.parts)} engines or "
        "arrangements, each computed separately",
        f"axes: {axes}",
    ]
    for part in plan.parts:
        words = {key: scene.axes[key] for key in (ENGINE, ARRANGEMENT) if key in part.places}
        place = [f"{key} {texts[part.places[key][0]]}" for key, texts in words.items()]
        words = {key: scene.labels[key] for key in (ENGINE, ARRANGEMENT) if key in scene.labels}
        place += [f"{key} {texts[part.places[DESIGN][0]]}" for key, texts in words.items()]
        lines += ["", f"{', '.join(place)}:", *(f"  {line}".rstrip() for line in
                                                text(part.plan).splitlines()[1:])]  # fmt: skip
        lacking = [name for name in plan.outputs if name not in part.plan.outputs]
        if lacking:
            lines.append(f"  not available, because this engine lacks input for them: "
                         f"{', '.join(lacking)}")  # fmt: skip
    return "\n".join([*lines, "", f"total: {_room_and_time(plan)}"])


def _no_cycles(plan: Plan) -> list[str]:
    """Line on the combinations of parameters that give no possible cycle; empty without any."""
    table = plan.leaves["family"].data
    if not isinstance(table, CycleTable) or table.combinations > LOOKED_AT:
        return []
    known = cycles_known(table, plan.leaves, np.arange(table.combinations))
    impossible = int((~known).sum())
    if not impossible:
        return []
    keys = ", ".join(plan.scene.cycle_keys)
    return [f"no cycle: {impossible} of {known.size} combinations of {keys} (status 4)"]


def _no_designs(plan: Plan) -> list[str]:
    """Lines on numbers with which a speed is not followed in time."""
    return [
        f"not followed: {round(share * plan.designs)} of {plan.designs_text}: {text} (status 4)"
        for text, share in impossible(plan.scene)
    ]


def seconds(plan: Plan) -> float:
    """Estimated time of the command on this machine, compiling aside; good to a factor of two."""
    return START + seconds_of_computing(plan) + plan.output_bytes * WRITING


def seconds_of_computing(plan: Plan, cores: int | None = None) -> float:
    """Estimated time of `sweeps.run`, warm, with as many threads as cores; those here unless given.

    The work of a plan times the seconds that a piece of it takes, see `sweeps.scene.plan.rates`.
    """
    cores = cores or psutil.cpu_count() or 1
    plans = [part.plan for part in plan.parts] or [plan]
    # Seconds for each candidate design of a Pareto front of three objectives: from 3e-7 where few
    # candidates are in the front to 2.6e-6 where all are, measured with 2^20 designs on one machine
    of_fronts = {FRONT: 1e-6}
    serial = {*SERIAL, *of_fronts}
    # Seconds that one core takes for a shaft of nine discs and 180 orders: measured on one machine
    # with scenes of 16,384 designs or more, not fitted as those of `sweeps.scene.plan.rates`
    of_shafts = {
        "modes of shafts": 1e-5,
        "damped modes of shafts": 1e-4,
        "responses of shafts": 1.5e-5,
        "responses in modes of shafts": 6e-4,
        "cycles of shafts": 4e-5,
        "nonlinear responses of shafts": 5e-2,
        "passes of shafts, for each order and disc": 1.5e-5,
    }
    # A cycle of six cylinders with the estimate of its error, likewise; curves take longer
    of_transients = {"cycles of transients": 2.5e-5}
    # Extremes of the load of one pin or journal of a four, likewise: 2.0e-5 and 2.6e-5 s
    of_loads = {"extremes of loads": 2.2e-5}
    return sum(
        count
        * {**SECONDS, **of_shafts, **of_loads, **of_fronts, **of_transients}[name]
        / (1 if name in serial else cores)
        for one in plans
        for name, count in work_of(one).items()
    )


def work_of(plan: Plan) -> dict[str, float]:
    """Pieces of work of a plan, by their names in `sweeps.scene.plan.rates`."""
    work = _work_once(plan)
    for variation in plan.variations:  # All plans of a variation have the same work
        for name, count in _work_once(variation.plans[0]).items():
            work[name] = work.get(name, 0.0) + len(variation.plans) * count
    return work


def _work_once(plan: Plan) -> dict[str, float]:
    """Pieces of work of a plan without its variations."""
    work: defaultdict[str, float] = defaultdict(float, calls=1.0)
    if plan.scene.reduce is not None:
        fronts = [one for one in plan.scene.reduce.kept if not one.number and len(one.wanted) == 3]
        work[FRONT] = float(len(fronts) * math.prod(plan.sizes[d] for d in plan.scene.dimensions))
    if plan.scene.cycle_keys:
        work["modelled cycles"] = float(np.size(plan.leaves["cycle"].data))
    for stage in plan.stages:
        if stage.node.of_shaft and stage.node.kind == "stage":
            work |= _of_shaft(plan, stage)
        elif FOLLOWED in stage.node.gives:
            cycles = math.prod(plan.sizes[d] for d in stage.axes) * plan.sizes["run_cycle"]
            work["cycles of transients"] = float(cycles)
        elif stage.node.kind == "stage":
            # A search for an inertia solves the speed some five times.
            times = 5.0 if stage.node.name == "inertia_search" else 1.0
            if "delta_error" in plan.wanted(stage):
                times *= 3.0  # The second solution, for `delta_error`, takes twice the work
            work["columns of diagrams"] += times * _cylinders(plan) * diagram_count(plan)
            for piece, count in _designs(plan, stage):
                work[piece] += times * count
        elif stage.node.throws:
            work["revolutions"] += stage.size
        elif stage.node.threaded:
            work["extremes of loads"] += stage.size
        elif stage.node.make is not None:  # Without `make`, another stage gives the values
            work["values"] += stage.size
    return {name: count for name, count in work.items() if count}


def _of_shaft(plan: Plan, stage: Stage) -> dict[str, float]:
    """Pieces of work of a stage of torsional vibration."""
    count = float(math.prod(plan.sizes[d] for d in stage.axes))
    if NONLINEAR_STATUS in stage.node.gives:
        return {"nonlinear responses of shafts": count}
    if not stage.node.outcome:
        damped = any(name.startswith("damp") for name in plan.wanted(stage))
        return {"damped modes of shafts" if damped else "modes of shafts": count}
    if "speed_ramp" in stage.node.needs:
        parts = plan.sizes["every_order"] * plan.sizes["disc"]
        return {"passes of shafts, for each order and disc": count * parts}
    cycles = any(
        not plan.dims(name) or "order" not in plan.dims(name)
        for name in plan.wanted(stage)
        if name not in ("shaft_loss", TORSION_STATUS)
    )
    shaft = plan.scene.engine.shaft
    in_modes = shaft is not None and shaft.modes
    responses = "responses in modes of shafts" if in_modes else "responses of shafts"
    return {responses: count, "cycles of shafts": count * cycles}


def _cylinders(plan: Plan) -> int:
    """Different cylinders in all sets of them, once for each of their cycles."""
    sets = {cylinders.turned[0] for cylinders in plan.leaves["cylinders_by_count"].data.values()}
    return sum(len(cylinders.representatives) * cylinders.cycles for cylinders in sets)


def mechanism(method: str) -> str:
    """Return what solves the designs of a method, one of `engine_dyn.speed.mechanisms`."""
    return BATCH if METHODS[METHOD_NAMES.index(method)].in_batch else GENERAL


def diagram_count(plan: Plan) -> int:
    """Diagrams that designs need, at most: each lies on one row of the family, or between two."""
    if plan.scene.engine.torque is not None:
        return 1
    needed = 2 * math.prod(plan.sizes[d] for d in plan.dims("row"))
    load = plan.leaves.get("load")
    if load is not None and plan.dims("row") == load.dims and not plan.scene.load_follows:
        needed = 2 * np.unique(load.data).size
    return int(min(plan.leaves["family"].data.row_count, needed))


def _designs(plan: Plan, stage: Stage) -> Iterator[tuple[str, float]]:
    """Designs that a stage of torques or of the periodic speed solves, by their cost."""
    if not stage.node.outcome:
        yield "torques", float(stage.size)
        return
    scene = plan.scene
    linear = 0.0
    if "power_law" in scene.words and scene.closure == "power_mean":
        linear = float(np.mean(np.isin(plan.leaves["load_exponent"].data, list(DIRECT))))
    each = stage.size / (len(scene.methods) * len(scene.inertia_models))
    curves = any(name in (*CURVE_NAMES, *CLOSE_CURVES) for name in plan.wanted(stage))
    for method in scene.methods:
        for model in scene.inertia_models:
            if method in STEPPING:
                yield f"designs by {method}", each
                continue
            if mechanism(method) == GENERAL:
                yield f"{GENERAL}: designs", each
                continue
            straight = linear if model == "constant" else 0.0
            yield f"{BATCH}: designs of exponent 2", each * straight
            yield f"{BATCH}: designs that iterate", each * (1.0 - straight)
            yield f"{BATCH}: designs with curves", each * curves


def _stage_line(plan: Plan, stage: Stage, wide: int) -> str:
    """Line on a stage: axes, repetitions, designs that share it, and destination."""
    node = stage.node
    times = math.prod(plan.sizes[d] for d in stage.axes)
    curve = [f"{plan.sizes[d]} {d}s" for d in stage.dims if d in DIMENSIONS]
    kept = ""
    if node.kind == "stage":
        kept = "gives " + ", ".join(plan.wanted(stage))
    elif node.name in plan.outputs:
        kept = "in the archive" if plan.scene.reduce is None else "reduced"
        kept += " (outcome)" if node.name == "status" else ""
        if curve:
            kept += ", each over " + " and ".join(curve).replace("_", " ")
    over = ", ".join(stage.axes) or "one value"
    if len(over) > 33:
        over = f"{over[:30]}..."
    shared = plan.designs // times
    return f"{node.name:<{wide}}{over:<34}{times:>11}{shared:>14}  {kept}".rstrip()


def _work_line(plan: Plan) -> str:
    """Parameters that the work over the angle depends on."""
    if plan.scene.engine.torque is not None:
        return "work over the angle of the torque that is given"
    diagrams, sets = diagram_count(plan), len(plan.leaves["cylinders_by_count"].data)
    # A load on a row of the table needs no second diagram; the number of diagrams ignores that, and
    # is the largest possible.
    most = "" if plan.leaves["family"].data.row_count == 1 else "up to "
    return (
        f"work over the angle of {most}{counted(diagrams, 'diagram')} and "
        f"{counted(sets, 'set')} of cylinders"
    )


def _kernel_lines(plan: Plan, stage: Stage) -> list[str]:
    """Lines on the work of a kernel: diagrams, part of the cycle, iteration, traces."""
    if stage.node.of_shaft:
        discs, orders = plan.sizes["disc"], plan.sizes["every_order"]
        if not stage.node.outcome:
            return [
                f"  eigenvalues of {discs} discs, for {counted(stage.size, 'design')}",
                f"  {modes_kept(plan.scene, plan.leaves)}",
            ]
        if NONLINEAR_STATUS in stage.node.gives:
            return [f"  integration in time, and balance of the harmonics of couplings that are "
                    f"not linear, for {counted(stage.size, 'design')}"]  # fmt: skip
        pieces = ", and the sum of all orders over the cycle"
        shaft = plan.scene.engine.shaft
        how = "modes of" if shaft is not None and shaft.modes else "elimination along"
        return [
            f"  {how} {discs} discs for each of {orders} orders"
            f"{pieces if 'cycles of shafts' in work_of(plan) else ''}, for "
            f"{counted(stage.size, 'design')}"
        ]
    if FOLLOWED in stage.node.gives:
        cycles, designs = plan.sizes["run_cycle"], counted(stage.size, "design")
        return [f"  up to {counted(cycles, 'cycle')} one after another, for {designs}"]
    speed = bool(stage.node.outcome)
    solved = [m for m in plan.scene.methods if m not in STEPPING] if speed else ["direct"]
    repeated = [m for m in plan.scene.methods if m in STEPPING] if speed else []
    lines = []
    if solved:
        lines.append(f"  {_work_line(plan)}, for {counted(stage.size, 'design')}")
        lines += [f"  {line}" for line in _part_of_cycle(plan)]
    if speed:
        if solved:
            lines += [f"  method {', '.join(solved)}: {how}" for how in _iteration(plan, solved)]
            lines.append(f"  solved by: {', '.join(dict.fromkeys(map(mechanism, solved)))}")
        if repeated:
            lines.append(f"  method {', '.join(repeated)}: whole cycles, repeated from a start")
        traces = [name for name in ("omega", "angular_acceleration") if name in plan.computed]
        kept = f"{', '.join(traces)}, {plan.sizes['crank_angle']} angles each" if traces else "none"
        lines.append(f"  traces over crank angle kept: {kept}")
    return lines


def _part_of_cycle(plan: Plan) -> list[str]:
    """Even firing repeats the torque Z times a cycle, so that one firing period is solved."""
    cycle = round(math.degrees(plan.scene.engine.period))
    engines = plan.leaves["cylinders_by_count"].data
    load = plan.scene.driven.over_angle
    repeats = [0]  # No load over angle: gcd(n, 0) is n
    if load is not None:
        gear = np.unique(plan.leaves["gear_ratio"].data)
        repeats = np.unique(repeats_of(load, gear, plan.scene.engine.period)).tolist()
    solved_parts: dict[str, None] = {}
    periods: dict[str, None] = {}
    for engine in engines.values():
        number = str(engine.count) if solved_parts else counted(engine.count, "cylinder")
        cycles = engine.cycles
        together = sorted({math.gcd(engine.symmetry, times * cycles) for times in repeats})
        solved = " or ".join(f"{cycles * cycle / times:.4g}" for times in together)
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
    """Cost of each load exponent."""
    if methods == ["newton"]:
        return ["iterates"]
    if plan.scene.closure == "cycle_time":
        return ["iterates: closure cycle_time solves for the load coefficient too"]
    if plan.scene.inertia_models == ("variable",):
        return ["iterates: variable inertia"]
    if "power_law" not in plan.scene.words:
        return [f"{'driver' if plan.scene.driven.has_driver else 'load'} over speed iterates"]
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
    """Quantities that are not computed, with reasons."""
    nothing = "no requested quantity needs"
    lines = []
    uses_pressure = any("family" in stage.node.needs for stage in plan.stages)
    if not uses_pressure:
        lines.append(f"skipped: cylinder pressure and gas work, {nothing} them")
    if "speed_solution" not in plan.computed:
        lines.append(f"skipped: the periodic speed, {nothing} it")
    if "torque_solution" not in plan.computed:
        lines.append(f"skipped: extremes of torque and work, {nothing} them")
    left = sum(name not in plan.computed for name in QUANTITIES)
    if left:
        lines.append(f"not requested: {left} more quantities; engine-dyn list quantities names all")
    lines += filter(None, (plan.scene.other_cylinders, plan.scene.left_out))
    lines += [f"axis {name}: no requested quantity depends on it" for name in plan.unused]
    lines += [
        f"{n if n.startswith('[') else f'[set] {n}'}: no requested quantity depends on it"
        for n in plan.unused_settings
    ]
    return lines
