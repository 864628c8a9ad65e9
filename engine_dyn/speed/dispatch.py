"""Broadcasting front of the solvers: arrays of parameters in, arrays of results out.

Each group of designs is solved in pieces: by the batch solver, and what this leaves by the general
one. Nothing that a design gets depends on the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.driven_machine import NOTHING_DRIVEN, DrivenMachine, whole_ratio
from engine_dyn.loads.laws import POWER
from engine_dyn.pressure.family import Family
from engine_dyn.speed.batch.in_blocks import solve_in_blocks
from engine_dyn.speed.designs import Designs, Inputs, Task, angles_of, codes, discard, take_unknown
from engine_dyn.speed.fields import (
    CANCELLED,
    CLOSED,
    CLOSURES,
    COMPARED,
    CURVE_NAMES,
    DEFAULTS,
    INERTIA_MODELS,
    METHOD_NAMES,
    METHODS,
    ROUNDING,
    SCALAR_NAMES,
    THESIS,
    Results,
)
from engine_dyn.speed.general.one_by_one import solve_one_by_one
from engine_dyn.speed.grouping import PIECE, Grouping, Piece
from engine_dyn.speed.mechanisms import (
    BATCH,
    GENERAL,
    Progress,
    Tally,
    map_on_threads,
    tally_in_use,
)
from engine_dyn.speed.work.columns import Columns
from engine_dyn.status import CONVERGED, NOT_CONVERGED, TOLERANCE_NOT_MET
from engine_dyn.types import Booleans, Floats, Integers

SAFETY, LEAST_ERROR = 7.0, 9e-10
"""Estimate of the error: a factor on the difference to a solution with four times the nodes,
plus a constant, because both solutions see a tabulated diagram's knots alike and have the same
columns. Both were measured with benchmarks.stress: no error of 800 rough diagrams exceeded the
estimate, and columns missed up to 7.7e-10 of delta, most with 10 and 12 cylinders."""

CHUNK_OF_ARRAYS = 1 << 16


def compare(
    coarse: dict[str, Any], known: npt.NDArray[np.bool_], refined: dict[str, Any], tolerance: float,
    inputs: Mapping[str, Any], shape: tuple[int, ...],
) -> None:  # fmt: skip
    """Replace error and status by those from the difference to a solution with more nodes.

    docs/method.md (105). The status says whether this estimate, which is better than the kernel's,
    meets the tolerance. The work is done in pieces, so that no array has the size of the sweep.
    """

    def at(name: str) -> Any:
        return np.broadcast_to(inputs[name], shape).flat[here]

    for begin in range(0, known.size, CHUNK_OF_ARRAYS):
        here = slice(begin, begin + CHUNK_OF_ARRAYS)
        delta = coarse["delta"][here]
        with np.errstate(divide="ignore", invalid="ignore"):
            error = SAFETY * np.abs(delta / refined["delta"][here] - 1.0)
            slowest = np.abs(coarse["omega_min"][here] / refined["omega_min"][here] - 1.0)
            # Twice the difference of the smallest speeds: at first order, 4/3 of it is the error;
            # the rest is for rounding, which near a stall is alike in both solutions.
            error = np.maximum(error, 2.0 * slowest) + LEAST_ERROR
            eta = 0.25 * np.square(at("double_radius")) * np.divide(at("mass"), at("inertia"))
            error += ROUNDING * (1.0 + CANCELLED * eta) / delta
        good = known[here] & np.isfinite(error)
        met = np.where(error <= tolerance, CONVERGED, TOLERANCE_NOT_MET).astype(np.int8)
        np.copyto(coarse["delta_error"][here], error, where=good)
        np.copyto(coarse["status"][here], met, where=good)


NOWHERE = np.zeros(0)

FINEST = 16  # Designs that miss the tolerance are solved again with more nodes, up to this factor

FINER = 4  # Factor on the nodes for the second solution, from which the error follows


class Card(Protocol):
    """The part of a sweep that `engine_dyn.card` does: the designs that it can solve."""

    piece: int

    def can_solve(self, task: Task) -> bool:
        """Whether it knows all that the designs have."""

    def solve(
        self, task: Task, columns: Columns, designs: Designs, results: Results, left: Booleans
    ) -> bool:
        """Solve designs as `solve_in_blocks`; False where memory is short."""


@dataclass(frozen=True)
class Sweep:
    """All designs of one call of `solve`, how they are solved, and where the results go.

    `alone` says that each crank has columns of its own, which miss nothing; `second` that these are
    solutions with more nodes, for the error of those before; `card` solves what it can. The other
    fields are those of `solve`; methods and inertia models are codes among the inputs.
    """

    grouping: Grouping
    closure: int
    iterated: float
    angles: Floats
    threads: int | None
    results: Results
    tally: Tally | None
    finer: int
    general: bool
    card: Card | None = None
    alone: bool = False
    second: bool = False

    @property
    def periodic(self) -> Booleans:
        """Whether a method looks for the periodic solution, of which more nodes tell the error."""
        inputs = self.grouping.inputs
        periodic = inputs.arrays["method"] != THESIS
        return np.broadcast_to(periodic, inputs.shape).reshape(-1)

    def solve_at(self, places: Integers | None = None) -> Iterator[int]:
        """Solve the designs at some flat places, or all, while the numbers of them are taken."""
        pieces = self.grouping.pieces(places, self.finer, self.alone)
        return map_on_threads(partial(_solve_piece, self), pieces, self.threads)


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
    driven: DrivenMachine = NOTHING_DRIVEN,
    card: Card | None = None,
    **inputs: Any,
) -> dict[str, Any]:
    """Solve the periodic speed of every design of a product of axes.

    Designs that miss the tolerance are solved again with four, then sixteen times the nodes. Where
    "delta_error" is wanted, all are solved a second time with four times the nodes. The error
    follows from the difference, docs/method.md (105), and `status` says whether it is within the
    tolerance. It is the error of delta or of the smallest speed, whichever is larger; the latter
    where a design nearly stalls.

    Parameters
    ----------
    family : Family
        Indicator diagrams.
    wanted : sequence of str
        Of `SCALAR_NAMES`, "omega" and "angular_acceleration" (these with a last dimension
        `crank_angle`); "status" always comes.
    method, inertia_model : str or array of str
        Names of `engine_dyn.speed.fields`; arrays broadcast like the inputs.
    closure : str
        Of `engine_dyn.speed.fields.CLOSURES`.
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
    driven : DrivenMachine
        Load over angle, load over speed or driver, and the torque of an engine that has no
        diagrams: `family` and cylinders then give its cycle alone, and `scale` is 0.
    card : Card, optional
        Solves what it can: `engine_dyn.card.card_of`.
    **inputs : array_like
        SI values, all broadcasting, of the names in `engine_dyn.speed.fields`, which has their
        units, meanings and defaults. Where `scale`, the factor on the pressure, is NaN, a design
        has no diagram: its status is "invalid input". The mean of a load over angle is part of
        `offset`.

    Returns
    -------
    dict
        Arrays of the broadcast shape; "status" holds the codes of `engine_dyn.status`.

    Raises
    ------
    ValueError
        For a method that cannot solve the law.
    """
    inputs = {**DEFAULTS, **inputs}
    inputs["gear_ratio"] = whole_ratio(driven.over_angle, inputs["gear_ratio"], family.period)
    inputs |= {
        "cylinders": np.asarray(cylinders, dtype=np.int64),
        "method": codes(METHOD_NAMES, method),
        "inertia_model": codes(INERTIA_MODELS, inertia_model),
    }
    unknown, designs = take_unknown(inputs), Inputs.of(inputs)
    _check_methods(np.unique(inputs["method"]), driven)
    compared = [name for name in COMPARED if "delta_error" in wanted and name not in wanted]
    angles = NOWHERE
    if crank_angle is not None and set(CURVE_NAMES) & set(wanted):
        angles = np.asarray(crank_angle, dtype=float)
    results, named = _results_for(designs.size, (*wanted, *compared), angles.size)
    grouping = Grouping(
        designs, family, cylinders_by_count, driven, float(tolerance),
        ("cylinders", "method", "inertia_model"), angles.size > 0,
        PIECE if card is None else card.piece,
    )  # fmt: skip
    # Iterations may leave an error of a hundredth of the tolerance, over the range of q.
    sweep = Sweep(
        grouping, CLOSURES.index(closure), 1e-2 * tolerance if iterated is None else iterated,
        angles, threads, results, tally_in_use(), finer, general, card,
    )  # fmt: skip
    for done in sweep.solve_at():
        if progress:
            progress(done)
    missed = _repeat_missed(sweep)
    if "delta_error" in wanted and iterated is None:
        _estimate_errors(sweep, named, missed)
    shaped = {
        name: array.reshape((*designs.shape, *array.shape[1:]))
        for name, array in named.items()
        if name not in compared
    }
    return discard(shaped, unknown)


def _check_methods(used: Integers, driven: DrivenMachine) -> None:
    """Refuse methods that cannot solve the law of load or driver; the message names the method."""
    for method in (METHODS[code] for code in used):
        if not method.can_solve(driven.law, driven.over_angles):
            raise ValueError(
                f"method {method.name!r} supports only the load law a + k omega^alpha: take another"
            )


def _results_for(size: int, wanted: Sequence[str], angles: int) -> tuple[Results, dict[str, Any]]:
    """Arrays for the requested results, as kernels take them and by name."""
    names = [name for name in SCALAR_NAMES if name in wanted]
    curves = {name: np.empty((size, angles) if name in wanted else (1, 0)) for name in CURVE_NAMES}
    results = Results(
        wanted=np.array([names.index(n) if n in names else -1 for n in SCALAR_NAMES]),
        scalars=np.empty((max(len(names), 1), size if names else 0)),
        status=np.empty(size, dtype=np.int8),
        omega=curves["omega"],
        acceleration=curves["angular_acceleration"],
        deferred=np.zeros(size if "delta_error" in names else 0, dtype=np.bool_),
    )
    named: dict[str, Any] = {name: results.scalars[i] for i, name in enumerate(names)}
    named["status"] = results.status
    named |= {name: curve for name, curve in curves.items() if curve.shape[1] > 0}
    return results, named


# --- solving: all designs, again where nodes did not suffice, and for the error -------------------


def _repeat_missed(sweep: Sweep) -> Integers:
    """Solve designs that miss the tolerance again with more nodes; return their places.

    More nodes help where the tolerance is missed and where nothing converged; there, the last
    number of nodes is where cycles are followed in time. Repeated cycles have an error that more
    nodes do not reduce.
    """
    if sweep.finer > 1:
        return np.zeros(0, dtype=np.int64)
    status = sweep.results.status
    failed = (status == TOLERANCE_NOT_MET) | (status == NOT_CONVERGED)
    all_missed = missed = np.flatnonzero(failed & sweep.periodic)
    for finer in (FINER, FINEST):
        if missed.size:
            list(replace(sweep, finer=finer, general=True, alone=True).solve_at(missed))
        missed = missed[np.isin(status[missed], (TOLERANCE_NOT_MET, NOT_CONVERGED))]
    return all_missed


def _estimate_errors(sweep: Sweep, named: dict[str, Any], missed: Integers) -> None:
    """Solve the other designs a second time with more nodes; the difference gives the error."""
    status, inputs = sweep.results.status, sweep.grouping.inputs
    known = ((status == CONVERGED) | (status == TOLERANCE_NOT_MET)) & sweep.periodic
    known[missed] = False
    if not known.any():
        return
    results, refined = _results_for(known.size, COMPARED, 0)
    results.scalars.fill(np.nan)
    # The finer solution's iteration may leave this error. Both solutions may stop after the same
    # number of passes; an error that they share is no part of their difference.
    second = replace(
        sweep, second=True, finer=FINER, general=False, angles=NOWHERE,
        results=results._replace(deferred=sweep.results.deferred),
        iterated=min(0.01 * sweep.iterated, 0.025 * LEAST_ERROR),
    )  # fmt: skip
    list(second.solve_at(None if known.all() else np.flatnonzero(known)))
    compare(named, known, refined, sweep.grouping.tolerance, inputs.arrays, inputs.shape)


def _solve_piece(sweep: Sweep, piece: Piece) -> int:
    """Solve designs by batch solver or card, what is left by the general; return their number."""
    results, tolerance, form = sweep.results, sweep.grouping.tolerance, sweep.grouping.driven.form
    count, code, model = piece.key
    in_batch = METHODS[code].in_batch and not sweep.general
    card = None if sweep.general else sweep.card
    for call in piece.calls():
        columns = call.columns
        seen = sweep.angles + sweep.grouping.turned(count)[1]
        angles = angles_of(seen, columns.width, call.piece.source.nodes.number)
        task = Task(code, bool(model), sweep.closure, tolerance, sweep.iterated, form, angles)
        able = card is not None and card.can_solve(task)
        if code == THESIS:
            from engine_dyn.speed.thesis import solve_as_printed  # loaded for this method alone

            solve_as_printed(call, task, sweep.angles, results)
            continue
        designs = call.designs()
        if form.kind == POWER and code != CLOSED:
            # Smaller exponents are solved as their limit 0, docs/method.md (65). The speeds differ
            # by alpha/2 times the variance of log omega, 2e-9 for a speed that nearly falls to 0;
            # rounding of q^(alpha/2) - 1 would cost as much.
            limited = np.where(designs.first <= 5e-8, 0.0, designs.first)
            designs = designs._replace(first=limited)
        left = np.ones(call.piece.size, dtype=np.bool_)
        if in_batch:
            if not (able and card and card.solve(task, columns, designs, results, left)):
                solve_in_blocks(task, columns, designs, results, left)
            if sweep.second:
                # A second solution comes from the same solver as the first, to be comparable.
                left |= results.deferred[call.piece.chosen.places]
            elif results.deferred.size:
                results.deferred[call.piece.chosen.places] = left
        if sweep.tally is not None:
            solver, to_general = (BATCH, int(left.sum())) if in_batch else (GENERAL, 0)
            sweep.tally.notes.append((solver, call.piece.size, to_general))
        rest = np.flatnonzero(left)
        if rest.size:
            solve_one_by_one(rest, task, columns, designs, results, last=sweep.finer >= FINEST)
    return piece.size
