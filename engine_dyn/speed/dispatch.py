"""Broadcasting front of the kernels: arrays of parameters in, arrays of results out.

Inputs are NumPy arrays that broadcast against each other: an input does not depend on an axis along
which its size is 1. What designs have in common follows from these shapes; names of axes are not
known here. A sweep is split into parts whose designs can be treated alike; each part goes to the
batch solver, which defers what it cannot solve, or to the general solver.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.driven_machine import NOTHING_DRIVEN, DrivenMachine, whole_ratio
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.pressure.family import Family
from engine_dyn.speed.arguments import ANY_EXPONENT, MOTOR, AngleLoad, Choice, Problem, kind_of_law
from engine_dyn.speed.batch.front import BatchSolver, is_steep, refinement_for
from engine_dyn.speed.batch.two_grid import CHUNK
from engine_dyn.speed.broadcasting import (
    along_axes,
    codes,
    cylinders_of,
    shape_of,
    without_unknown,
)
from engine_dyn.speed.error_estimate import ITERATED, ITERATED_FINER, compare
from engine_dyn.speed.fields import DEFAULTS, FRICTION_NAMES, TABLE_NAMES
from engine_dyn.speed.general.front import GeneralSolver, samples_of
from engine_dyn.speed.general.segments import SEGMENTS
from engine_dyn.speed.mechanisms import (
    GENERAL,
    OWN_CURVES,
    are_shared,
    is_common,
    mechanism_of,
    tally_in_use,
)
from engine_dyn.speed.methods import CLOSURES, INERTIA_MODELS, METHOD_NAMES, METHODS
from engine_dyn.speed.packing import Packed, Part, aligned, split
from engine_dyn.speed.pieces import Progress
from engine_dyn.speed.results import COMPARED, CURVE_NAMES, SCALAR_NAMES, Results
from engine_dyn.speed.tables.node_counts import (
    fewest_nodes,
    fewest_nodes_of_load,
    may_be,
    repeats_of_load,
    row_map,
    rows_needed,
)
from engine_dyn.speed.tables.work_tables import steps_per_cycle
from engine_dyn.status import CONVERGED, NOT_CONVERGED, TOLERANCE_NOT_MET
from engine_dyn.types import Booleans, Floats, Integers

__all__ = ["SOLVERS", "solve"]

NOWHERE = np.zeros(0)

NO_EXPONENT = 5e-8
"""Exponents up to this are solved as their limit 0, docs/method.md (58). The speeds differ by
alpha/2 times the variance of log omega, which is 2e-9 for a speed that nearly falls to 0; rounding
of q^(alpha/2) - 1 would cost as much."""

FINEST = 16
"""Designs that miss the tolerance are solved again with more nodes, up to this factor."""


@dataclass(frozen=True)
class Sweep:
    """All designs of one call of `solve`, as arrays that broadcast to `shape`.

    `methods` and `models` are codes, `row` is the place of the diagrams in the family, `sets` are
    the keys of `cylinders_by_count`. `shared` says that tables are common to many designs, or
    depend on inputs that harmonics know nothing of. `load` is a load over angle that own curves
    can contain. With `general` the batch solver is not
    used. The other fields are those of `solve`.
    """

    shape: tuple[int, ...]
    inputs: Mapping[str, Any]
    packed: Packed
    family: Family
    methods: npt.NDArray[Any]
    models: npt.NDArray[Any]
    row: npt.NDArray[Any]
    sets: npt.NDArray[Any]
    cylinders_by_count: Mapping[int, Cylinders] | None
    closure: int
    tolerance: float
    driven: DrivenMachine
    general: bool
    shared: bool
    load: AngleLoad | None
    angles: Floats
    threads: int

    def check_methods(self) -> None:
        """Refuse methods that cannot solve the law of load or driver.

        Raises
        ------
        ValueError
            Naming the method.
        """
        for code in np.unique(self.methods):
            method = METHODS[code]
            if not method.can_solve(self.driven.law, self.driven.over_angle is not None):
                raise ValueError(
                    f"method {method.name!r} supports only the load law a + k omega^alpha: take "
                    "another"
                )

    def stepping(self) -> Booleans:
        """Which designs, flat, have a method that repeats cycles."""
        steps = np.array([method.steps for method in METHODS])[self.methods]
        return np.broadcast_to(steps, self.shape).reshape(-1)

    def keys(self) -> list[npt.NDArray[Any]]:
        """What must be the same for all designs of a part: see `_problem_of`."""
        rank, driven = len(self.shape), self.driven
        period = self.family.period
        gear = aligned(np.asarray(self.inputs["gear_ratio"], dtype=float), rank)
        exponent = aligned(np.asarray(self.inputs["exponent"], dtype=float), rank)
        return [
            self.methods,
            self.models,
            _kinds(exponent) if driven.power_law else np.full((1,) * rank, kind_of_law(driven.law)),
            is_steep(exponent),
            fewest_nodes(self.family, self.row, self.tolerance),
            repeats_of_load(driven.over_angle, gear, period),
            fewest_nodes_of_load(driven.over_angle, gear, period, self.tolerance),
            *along_axes(self.sets),
        ]


# Longer than usual by its docstring; its parameters are the keywords of every caller.
@without_unknown
def solve(
    *,
    family: Family,
    wanted: Sequence[str],
    method: Any = "auto",
    inertia_model: Any = "constant",
    closure: str = "power_mean",
    tolerance: float = 1e-6,
    cylinders: Any = 1,
    cylinders_by_count: Mapping[int, Cylinders] | None = None,
    crank_angle: Floats | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    finer: int = 1,
    iterated: float | None = None,
    general: bool = False,
    sharing: tuple[int, ...] | None = None,
    driven: DrivenMachine = NOTHING_DRIVEN,
    **inputs: Any,
) -> dict[str, Any]:
    """Solve the periodic speed of every design of a product of axes.

    Designs that miss the tolerance are solved again with four, then sixteen times the nodes. Where
    "delta_error" is wanted, all are solved a second time with four times the nodes, and with
    as many harmonics as there are. The error follows from the difference,
    docs/method.md (97), and `status` says whether it is within the tolerance. It is the error of
    delta or of the smallest speed, whichever is larger; the latter where a design nearly stalls.

    Parameters
    ----------
    family : Family
        Indicator diagrams.
    wanted : sequence of str
        Of `SCALAR_NAMES`, "omega" and "angular_acceleration" (these with a last dimension
        `crank_angle`); "status" always comes.
    method, inertia_model : str or array of str
        Names of `engine_dyn.speed.methods`; arrays broadcast like the inputs.
    closure : str
        Of `engine_dyn.speed.methods.CLOSURES`.
    tolerance : float
        Relative error of delta and of the speeds aimed at.
    cylinders : array_like of int
        Number of cylinders, or keys of `cylinders_by_count`.
    cylinders_by_count : mapping, optional
        Cylinders of each key. A key that is missing is a number of evenly firing equal cylinders.
    crank_angle : ndarray, optional
        Angles [rad] for curves.
    threads : int, optional
        Largest number of threads; the number of processors unless given.
    progress : callable, optional
        Called with the number of designs done since the last call.
    finer : int
        Factor on the number of nodes.
    iterated : float, optional
        Error that iterations may leave, relative to the range of the speed; a hundredth of the
        tolerance unless given.
    general : bool
        Do not use the batch solver.
    sharing : tuple of int, optional
        Number of tables of the whole sweep, of designs for each, and of angles of a load over
        angle, where these designs are a block of it, because blocks must not decide for themselves
        how tables are made. The numbers of these designs unless given; the last may be missing.
    driven : DrivenMachine
        Load over angle, load over speed or driver; tables over speed need the general solver.
    **inputs : array_like
        SI values, all broadcasting, of the names in `engine_dyn.speed.fields`, which has their
        units, meanings and defaults. Where `scale`, the factor on the pressure, is NaN, a design
        has no diagram: its status is "invalid input". The mean of a load over angle is part of
        `offset`.

    Returns
    -------
    dict
        Arrays of the broadcast shape; "status" holds the codes of `engine_dyn.status`.
    """
    inputs = {**DEFAULTS, **inputs}
    chosen = codes(METHOD_NAMES, method), codes(INERTIA_MODELS, inertia_model)
    shape = shape_of(*inputs.values(), *chosen, cylinders)
    rank, size = len(shape), math.prod(shape)
    if driven.over_angle is not None:
        period = family.period
        inputs["gear_ratio"] = whole_ratio(driven.over_angle, inputs["gear_ratio"], period)
    if sharing is None:
        tables = math.prod(shape_of(*(inputs[name] for name in TABLE_NAMES)))
        sharing = tables, size // max(tables, 1)
    special = _own_tables(inputs) or isinstance(family, CycleTable)
    sweep = Sweep(
        shape=shape,
        inputs=inputs,
        packed=Packed.of(inputs, shape),
        family=family,
        methods=aligned(chosen[0], rank),
        models=aligned(chosen[1], rank),
        row=aligned(np.asarray(inputs["row"], dtype=float), rank),
        sets=aligned(np.asarray(cylinders, dtype=np.int64), rank),
        cylinders_by_count=cylinders_by_count,
        closure=CLOSURES.index(closure),
        tolerance=float(tolerance),
        driven=driven,
        general=general,
        shared=are_shared(sharing[0], sharing[1], special=special),
        load=_common_load(driven, inputs, sharing, special),
        angles=NOWHERE if crank_angle is None else np.asarray(crank_angle, dtype=float),
        threads=threads or os.cpu_count() or 1,
    )
    sweep.check_methods()
    compared = [name for name in COMPARED if "delta_error" in wanted and name not in wanted]
    wanted = (*wanted, *compared)
    found, deferred = _solve_once(sweep, wanted, finer, iterated, progress)
    status = found["status"]
    # More nodes help where the tolerance is missed; they are tried once where nothing converged.
    failed = status == TOLERANCE_NOT_MET
    if finer == 1:
        failed |= status == NOT_CONVERGED
    missed = np.flatnonzero(failed)
    if iterated is not None:  # the finer one of two solutions is taken as it is
        missed = missed[:0]
    stepping = sweep.stepping()
    if missed.size and finer < FINEST:
        # Repeating cycles from a start has an error of its own, which more nodes do not reduce.
        missed = missed[~stepping[missed]]
    if missed.size and finer < FINEST:
        again = solve(
            family=family, wanted=wanted, closure=closure, tolerance=tolerance,
            cylinders_by_count=cylinders_by_count, crank_angle=crank_angle, threads=threads,
            finer=4 * finer, general=True, driven=driven,
            **{
                name: _chosen(value, missed, shape)
                for name, value in {
                    **inputs, "method": method, "inertia_model": inertia_model,
                    "cylinders": cylinders,
                }.items()
            },
        )  # fmt: skip
        for name, array in found.items():
            array[missed] = again[name]
    if "delta_error" in wanted and iterated is None:
        known = (status == CONVERGED) | (status == TOLERANCE_NOT_MET)
        # The error of these is known from solutions with more nodes, or from the periodic one.
        known[missed] = False
        known &= ~stepping
        if known.any():
            refined, _ = _solve_once(
                replace(sweep, angles=NOWHERE), COMPARED, 4 * finer,
                min(0.01 * ITERATED * tolerance, ITERATED_FINER), None, deferred,
            )  # fmt: skip
            compare(found, known, refined, tolerance, inputs, shape)
    return {
        name: array.reshape((*shape, *array.shape[1:]))
        for name, array in found.items() if name not in compared
    }  # fmt: skip


def _chosen(value: Any, places: Integers, shape: tuple[int, ...]) -> Any:
    """Values at some flat places of a broadcasting array."""
    index = np.unravel_index(places, shape) if shape else ()
    return np.broadcast_to(np.asarray(value), shape)[index].reshape(-1)


def _solve_once(
    sweep: Sweep, wanted: Sequence[str], finer: int, iterated: float | None,
    progress: Progress | None, deferred: Booleans | None = None,
) -> tuple[dict[str, Any], Booleans]:  # fmt: skip
    """Solve all parts of a sweep once, with `finer` times the nodes; flat results by name.

    `iterated` as in `solve`. `deferred` marks the designs that the batch solver deferred to the
    general solver in the coarser of two solutions: the finer one would not be finer by the batch
    solver, whose coarse nodes may miss more than the general solver does with fewer in all. The
    marks are returned too, empty where no error is wanted.
    """
    results, found = _results_for(sweep, wanted, deferred)
    tally = tally_in_use()
    if results.omega.shape[1] == results.acceleration.shape[1] == 0:
        sweep = replace(sweep, angles=NOWHERE)
    for part in split(sweep.shape, sweep.keys()):
        problem, refinement, mechanism = _problem_of(sweep, part, results, finer, iterated)
        if tally is not None:
            tally.designs[mechanism] += problem.size
        method = METHOD_NAMES[problem.choice.method]
        solver = SOLVERS[method](sweep, problem)
        if mechanism == GENERAL:
            solver.solve_all(progress)
            continue
        rest = solver.solve_chosen if tally is None else tally.noting(solver.solve_chosen)
        batch = BatchSolver(problem, refinement, rest)
        if mechanism == OWN_CURVES:
            batch.solve_by_harmonics(progress, finer=iterated is not None)
        else:
            batch.solve_by_tables(progress)
    return found, results.deferred


def _results_for(
    sweep: Sweep, wanted: Sequence[str], deferred: Booleans | None
) -> tuple[Results, dict[str, Any]]:
    """Arrays for the results that are wanted, as kernels take them and by name."""
    size = math.prod(sweep.shape)
    names = [name for name in SCALAR_NAMES if name in wanted]
    if deferred is None:
        deferred = np.zeros(size if "delta_error" in names else 0, dtype=np.bool_)
    curves = {
        name: np.empty((size, sweep.angles.size) if name in wanted else (1, 0))
        for name in CURVE_NAMES
    }
    results = Results(
        wanted=np.array([names.index(n) if n in names else -1 for n in SCALAR_NAMES]),
        scalars=np.empty((max(len(names), 1), size if names else 0)),
        status=np.empty(size, dtype=np.int8),
        omega=curves["omega"],
        acceleration=curves["angular_acceleration"],
        deferred=deferred,
    )
    found: dict[str, Any] = {name: results.scalars[i] for i, name in enumerate(names)}
    found["status"] = results.status
    found |= {name: curve for name, curve in curves.items() if curve.shape[1] > 0}
    return results, found


def _problem_of(
    sweep: Sweep, part: Part, results: Results, finer: int, iterated: float | None
) -> tuple[Problem, int, str]:
    """One part as a problem, the refinement of the batch solver, and the mechanism that solves it.

    The refinement is 0 where the batch solver is not used.
    """
    method, variable, kind, steep, nodes, repeats, nodes_of_load = map(int, part.keys[:7])
    choice = Choice(
        method, kind, bool(variable), sweep.closure, sweep.tolerance,
        ITERATED * sweep.tolerance if iterated is None else iterated,
    )  # fmt: skip
    period = sweep.family.period
    cylinders = cylinders_of(int(part.take(sweep.sets).flat[0]), period, sweep.cylinders_by_count)
    fewest = finer * max(nodes, nodes_of_load)
    # Torque and load repeat together as often as both do.
    times = math.gcd(cylinders.symmetry, repeats)
    mechanism = GENERAL
    # The second of two solutions has to be finer, which for other exponents and laws only the
    # general solver is.
    if not sweep.general and (iterated is None or kind < ANY_EXPONENT):
        mechanism = mechanism_of(
            choice, sweep.driven.over_angle is not None, sweep.shared, sweep.angles.size > 0,
            cylinders.equal_throws, sweep.load is not None,
        )  # fmt: skip
    refinement = 0
    if mechanism != GENERAL:
        own = mechanism == OWN_CURVES
        # Loads over angle have corners, and the torque of a motor is steep.
        steep_curve = bool(steep) or sweep.load is not None or kind == MOTOR
        refinement = refinement_for(cylinders, steep_curve, kind, own, times, fewest)
    if not refinement:
        mechanism = GENERAL
    multiple = math.lcm(SEGMENTS, refinement * CHUNK) if refinement else SEGMENTS
    steps = steps_per_cycle(times, fewest, multiple)
    rows = rows_needed(part.take(sweep.row))
    problem = Problem(
        size=part.size,
        family=sweep.family,
        cylinders=cylinders,
        choice=choice,
        product=sweep.packed.product(part),
        rows=rows,
        row_of=row_map(sweep.family, rows),
        nodes=steps // times,
        repeats=times,
        width=period / steps,
        angles=sweep.angles,
        results=results,
        load=sweep.load,
        threads=sweep.threads,
        last=finer >= FINEST,
    )
    return problem, refinement, mechanism


def _general(sweep: Sweep, problem: Problem) -> GeneralSolver:
    """Solve the periodic curve, or repeat cycles in the energy form."""
    return GeneralSolver(problem, sweep.driven.form, sweep.driven.angle_table)


def _with_samples(sweep: Sweep, problem: Problem) -> GeneralSolver:
    """Step through samples of the pressure, as the thesis does."""
    samples = samples_of(sweep.family, problem.rows, problem.cylinders)
    return GeneralSolver(problem, sweep.driven.form, sweep.driven.angle_table, samples)


SOLVERS: dict[str, Callable[[Sweep, Problem], GeneralSolver]] = {
    "auto": _general,
    "thesis": _with_samples,
    "picard": _general,
    "newton": _general,
    "closed": _general,
}
"""Solver of the designs of each method, including those that the batch solver defers."""


def _kinds(exponent: Floats) -> Integers:
    """Classes of the load exponent, see `Choice`."""
    power = np.where(exponent == 2.0, 2, 3)
    return np.where(exponent <= NO_EXPONENT, 0, np.where(exponent == 1.0, 1, power))


def _own_tables(inputs: Mapping[str, Any]) -> bool:
    """Whether friction over the stroke is a part of the tables, so that each must be built."""
    return any(may_be(inputs[name]) for name in FRICTION_NAMES)


def _common_load(
    driven: DrivenMachine, inputs: Mapping[str, Any], sharing: tuple[int, ...], special: bool
) -> AngleLoad | None:
    """A load over angle that is the same for all designs but for its scale."""
    if driven.over_angle is None:
        return None
    gear_ratio, phase = np.asarray(inputs["gear_ratio"]), np.asarray(inputs["load_phase"])
    tables, designs, angles = (*sharing, gear_ratio.size * phase.size)[:3]
    if not is_common(driven.over_speed is None, angles, tables, designs, special):
        return None
    return AngleLoad(driven.angle_table, float(gear_ratio.flat[0]), float(phase.flat[0]))
