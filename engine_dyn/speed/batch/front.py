"""The batch solver for a part of a sweep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.speed.arguments import Choice, Problem
from engine_dyn.speed.batch import own_curves, traces, work_harmonics
from engine_dyn.speed.batch.angles import Angles, make_angles
from engine_dyn.speed.batch.driver import keys_of, solve_by_harmonics, solve_by_table, write_traces
from engine_dyn.speed.batch.forms import (
    FORM_OF_KIND,
    ITERATED,
    RATIONAL,
    Form,
    Inertia,
    form_of,
    inertia_of,
)
from engine_dyn.speed.batch.scratch import make_block, make_block_scratch
from engine_dyn.speed.batch.state import LANES, MOST_NODES
from engine_dyn.speed.methods import POWER_MEAN
from engine_dyn.speed.pieces import FEWEST, PIECE, Progress, run_pieces, shared_by
from engine_dyn.types import Floats, Integers

__all__ = ["FEWEST_IN_LANES", "REFINEMENTS", "BatchSolver", "can_solve", "refinement_for"]

FEW_CYLINDERS, SMALL_EXPONENT, REFINEMENTS = 2, 2.0, (8, 4)
"""Nodes of a table for each coarse node of `lanes`, up to that many cylinders and that exponent,
and beyond either: the load counts by its fraction of the period over one coarse interval, and by
how steeply it grows. Twice as many would do for most designs with a linear load, but leave errors
of 2e-6 where it is strong."""

PIECE_IN_LANES = 65536
"""Designs of one call at most in lanes: each begins with a table, as long as a thousand designs, or
sorts them by their shared ones."""

MOST_SORTED = 262144
"""Designs that are sorted at a time: more would lie too far apart to be read fast."""

FEWEST_IN_LANES, ANGLES_OF_DESIGN = 4096, 32
"""Designs that are worth a thread in lanes, a fraction of a microsecond each, and the angles of a
curve that take as long."""

LANES_TOLERANCE = 1e-7
"""Smaller tolerances go to the general solver at once, whose error is smaller."""

Deferred = Callable[[Integers, int], None]
"""Solves the designs that are deferred, with so many threads at most."""


def can_solve(choice: Choice, curves: bool) -> bool:
    """Whether the batch solver knows the law and reaches the tolerance.

    The cycle time it closes for powers alone, and curves it writes for the power mean alone.
    """
    if choice.kind >= len(FORM_OF_KIND) or choice.tolerance < LANES_TOLERANCE:
        return False
    power = FORM_OF_KIND[choice.kind] < RATIONAL
    return choice.closure == POWER_MEAN or (power and not curves)


def is_steep(exponent: Floats) -> Integers:
    """Whether an exponent asks for the finer of the two refinements, as whole numbers."""
    return np.asarray(exponent > SMALL_EXPONENT, dtype=np.int64)


def refinement_for(
    cylinders: Cylinders, steep: bool, kind: int, own: bool, repeats: int, nodes: int
) -> int:
    """Nodes of a table for each coarse node; 0 where the tables would be too large.

    `nodes` are those that a whole cycle needs at least.
    """
    # Curves of each design do not know what coarse nodes see wrongly of the logarithm.
    fine = cylinders.count > FEW_CYLINDERS or steep or (own and kind == 0)
    refinement = REFINEMENTS[fine]
    return refinement if nodes <= MOST_NODES * refinement * repeats else 0


@dataclass(frozen=True)
class BatchSolver:
    """Solves many designs at once, in lanes, and defers those that it cannot.

    Attributes
    ----------
    problem : Problem
    refinement : int
        Nodes of a table for each coarse node.
    deferred : callable
        Takes designs, ascending, and a number of threads, and solves them by the general solver.
    """

    problem: Problem
    refinement: int
    deferred: Deferred

    def solve_by_tables(self, progress: Progress | None) -> None:
        """Solve all designs, with a table for all that share one."""
        problem, angles = self.problem, self.problem.angles
        fewest = max(FEWEST, FEWEST_IN_LANES // (1 + angles.size // ANGLES_OF_DESIGN))
        threads = problem.threads // shared_by(problem.size, problem.threads, fewest)
        wanted = None
        if angles.size:
            wanted = make_angles(
                angles, problem.family, problem.rows, problem.cylinders, problem.nodes,
                self.refinement,
            )  # fmt: skip

        def job(begin: int, end: int) -> None:
            self._solve_piece(begin, end, wanted, threads)

        largest = PIECE if angles.size else PIECE_IN_LANES
        run_pieces(problem.size, job, problem.threads, progress, largest, fewest)

    def _form(self) -> tuple[Form, Inertia]:
        """What solves a block of these designs, and whether their inertia varies."""
        choice = self.problem.choice
        return form_of(choice.kind, choice.variable), inertia_of(choice.variable)

    def _solve_piece(self, begin: int, end: int, angles: Angles | None, threads: int) -> None:
        """Solve the designs begin .. end - 1; `threads` are those for what is deferred."""
        problem = self.problem
        scratch = make_block_scratch(problem.nodes, problem.points, self.refinement)
        deferred = np.empty(end - begin, dtype=np.int64)
        size, blocks = end - begin, 0
        if angles is not None:
            size, blocks = traces.blocks_of(end - begin, problem.designs_of_table)
        form, inertia = self._form()
        iterated = len(form) >= ITERATED
        nodes = problem.nodes // self.refinement
        block = make_block(nodes, iterated)
        kept = traces.make_kept(blocks, nodes, iterated)
        curves = None if angles is None else traces.make_working(angles, kept)
        count = 0
        for first in range(begin, end, size):
            of_lanes = (
                first, min(first + size, end), LANES, self.refinement, problem.product,
                problem.row_of, problem.width, problem.grid, problem.choice, problem.results,
            )  # fmt: skip
            count += solve_by_table(
                form, inertia, *of_lanes, scratch, block, deferred[count:], kept
            )
            if angles is not None and curves is not None:
                write_traces(inertia, *of_lanes, scratch, angles, kept, *curves)
        self.deferred(deferred[:count], threads)

    def solve_by_harmonics(self, progress: Progress | None, finer: bool) -> None:
        """Solve all designs, each with a curve of its own, added up from works against harmonics.

        With `finer`, from as many harmonics as there are.
        """
        problem = self.problem
        for begin in range(0, problem.size, MOST_SORTED):
            end = min(begin + MOST_SORTED, problem.size)
            self._solve_sorted(begin, end, progress, finer)

    def _solve_sorted(self, begin: int, end: int, progress: Progress | None, finer: bool) -> None:
        """Solve the designs begin .. end - 1, in the order of their diagrams.

        So the designs of a block lie between the same two diagrams, and few blocks are not full.
        """
        problem, product = self.problem, self.problem.product
        rows = problem.family.row_count
        keys = np.empty(end - begin, dtype=np.int64)

        def look(first: int, last: int) -> None:
            keys_of(begin + first, begin + last, rows, product, keys[first:last])

        run_pieces(keys.size, look, problem.threads, None, PIECE_IN_LANES, PIECE_IN_LANES)
        # Short numbers sort faster; the designs beyond all intervals, with key -1, come last.
        small = np.min_scalar_type(work_harmonics.INTERVAL_COUNT * rows)
        order = np.argsort(keys.astype(small), kind="stable")
        few = 0 if finer else work_harmonics.FEW_INTERVALS * rows
        beyond_all = int(np.count_nonzero(keys < 0))
        centred = work_harmonics.CENTRED_INTERVALS * rows
        first = 0
        for terms, limit in (
            (work_harmonics.FEW_TERMS, few), (work_harmonics.MANY_TERMS, centred),
            (work_harmonics.OFFSET_TERMS, work_harmonics.INTERVAL_COUNT * rows),
        ):  # fmt: skip
            last = int(np.count_nonzero(keys < limit)) - beyond_all
            if first < last:
                self._solve_with_terms(terms, begin, order[first:last], keys, progress)
            first = max(first, last)
        if beyond_all:
            beyond = np.sort(order[first:])
            self.deferred(begin + beyond, problem.threads)
            if progress:
                progress(beyond.size)

    def _solve_with_terms(
        self, terms: int, begin: int, order: Integers, keys: Integers, progress: Progress | None
    ) -> None:
        """Solve designs in this order, for which so many harmonics suffice."""
        problem = self.problem
        rows = problem.family.row_count
        members = problem.cylinders.representatives_of(problem.repeats)
        form, inertia = self._form()
        iterated = len(form) >= ITERATED
        all_deferred: list[Integers] = []
        with work_harmonics.curves_of(
            problem.family, members, problem.nodes * problem.repeats, problem.nodes, problem.width,
            self.refinement, terms, problem.load,
        ) as curves:  # fmt: skip
            sorted_keys = keys[order]
            for first, last in curves.groups_of(sorted_keys, rows):
                curves.provide(
                    problem.family, np.unique(sorted_keys[first:last]), rows, problem.threads
                )
                chosen = order[first:last]

                def job(
                    one: int, other: int, chosen: Integers = chosen,
                    curves: work_harmonics.Curves = curves,
                ) -> None:  # fmt: skip
                    deferred = np.empty(other - one, dtype=np.int64)
                    without_table = make_block_scratch(0, 0, 1)
                    block = make_block(problem.nodes // self.refinement, iterated)
                    count = solve_by_harmonics(
                        form, inertia, begin, chosen[one:other], keys, rows, curves.place_of,
                        rows - 1, LANES, self.refinement, problem.width, problem.product,
                        curves.works, problem.choice, problem.results, without_table, block,
                        own_curves.make_own(
                            problem.nodes, self.refinement, curves.works, problem.load is not None
                        ),
                        deferred,
                    )  # fmt: skip
                    all_deferred.append(deferred[:count])

                run_pieces(
                    chosen.size, job, problem.threads, progress, PIECE_IN_LANES, FEWEST_IN_LANES
                )
        self.deferred(np.sort(np.concatenate(all_deferred)), problem.threads)
