"""The batch solver for a part of a sweep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.speed.arguments import Choice, Problem
from engine_dyn.speed.batch import lanes, panels, traces
from engine_dyn.speed.batch.driver import keys_of, march_lanes, march_panels, write_traces
from engine_dyn.speed.batch.scratch import BlockScratch, make_block_scratch
from engine_dyn.speed.methods import POWER_MEAN
from engine_dyn.speed.pieces import FEWEST, PIECE, Progress, run_pieces, shared_by
from engine_dyn.types import Floats, Integers

__all__ = ["FEWEST_IN_LANES", "REFINEMENTS", "BatchSolver", "can_solve", "refinement_for"]

FEW_CYLINDERS, SMALL_EXPONENT, REFINEMENTS = 2, 2.0, (8, 4)
"""Nodes of a table for each coarse node of `lanes`, up to that many cylinders and that exponent,
and beyond either: the load counts by its fraction of the period over one coarse interval, and by
how steeply it grows. Twice as many would do for most designs with a linear load, but leave errors
of 2e-6 where it is strong."""

PANEL_BYTES = 64_000_000
"""Shared tables that are kept at a time."""

PIECE_IN_LANES = 65536
"""Designs of one call at most in lanes: each begins with a table, as long as a thousand designs, or
sorts them by their shared ones."""

FEWEST_IN_LANES, ANGLES_OF_DESIGN = 4096, 32
"""Designs that are worth a thread in lanes, a fraction of a microsecond each, and the angles of a
curve that take as long."""

LANES_TOLERANCE = 1e-7
"""Smaller tolerances go to the general solver at once, whose error is smaller."""

FORM_OF_KIND = (lanes.FREE, lanes.ROOT, lanes.SQUARE, lanes.POWER)
"""What solves a block, for each kind of exponent (see `Choice`)."""

Deferred = Callable[[Integers, int], None]
"""Solves the designs that are deferred, with so many threads at most."""


def can_solve(choice: Choice) -> bool:
    """Whether the batch solver knows the closure, and reaches the tolerance."""
    return choice.closure == POWER_MEAN and choice.tolerance >= LANES_TOLERANCE


def is_steep(exponent: Floats) -> Integers:
    """Whether an exponent asks for the finer of the two refinements, as whole numbers."""
    return np.asarray(exponent > SMALL_EXPONENT, dtype=np.int64)


def refinement_for(
    cylinders: Cylinders, steep: bool, kind: int, interpolated: bool, repeats: int, nodes: int
) -> int:
    """Nodes of a table for each coarse node; 0 where the tables would be too large.

    `nodes` are those that a whole cycle needs at least.
    """
    # Interpolated tables do not know what coarse nodes see wrongly of the logarithm.
    fine = cylinders.count > FEW_CYLINDERS or steep or (interpolated and kind == 0)
    refinement = REFINEMENTS[fine]
    return refinement if nodes <= lanes.MOST_NODES * refinement * repeats else 0


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
            wanted = traces.make_angles(
                angles, problem.family, problem.rows, problem.cylinders, problem.nodes,
                self.refinement,
            )  # fmt: skip

        def job(begin: int, end: int) -> None:
            self._solve_piece(begin, end, wanted, threads)

        largest = PIECE if angles.size else PIECE_IN_LANES
        run_pieces(problem.size, job, problem.threads, progress, largest, fewest)

    def _scratch(self) -> BlockScratch:
        steps = self.problem.grid.node_sine.size
        return make_block_scratch(self.problem.nodes, steps, self.refinement)

    def _form(self) -> tuple[lanes.Form, lanes.Inertia]:
        """What solves a block of these designs, and whether their inertia varies."""
        choice = self.problem.choice
        if choice.kind == 2 and not choice.variable:
            return lanes.LINEAR, lanes.CONSTANT
        return FORM_OF_KIND[choice.kind], lanes.VARIABLE if choice.variable else lanes.CONSTANT

    def _solve_piece(
        self, begin: int, end: int, angles: traces.Angles | None, threads: int
    ) -> None:
        """Solve the designs begin .. end - 1; `threads` are those for what is deferred."""
        problem, scratch = self.problem, self._scratch()
        deferred = np.empty(end - begin, dtype=np.int64)
        size, blocks = end - begin, 0
        if angles is not None:
            size, blocks = traces.blocks_of(end - begin, problem.designs_of_table)
        form, inertia = self._form()
        iterated = form not in (lanes.LINEAR, lanes.FREE)
        kept = traces.make_kept(blocks, scratch.levels.coarse.shape[0], iterated)
        curves = None if angles is None else traces.make_working(angles, kept)
        count = 0
        for first in range(begin, end, size):
            of_lanes = (
                first, min(first + size, end), lanes.LANES, self.refinement, problem.product,
                problem.row_of, problem.width, problem.grid, problem.choice, problem.results,
            )  # fmt: skip
            count += march_lanes(form, inertia, *of_lanes, scratch, deferred[count:], kept)
            if angles is not None and curves is not None:
                write_traces(inertia, *of_lanes, scratch, angles, kept, *curves)
        self.deferred(deferred[:count], threads)

    def solve_by_interpolation(self, progress: Progress | None, parts: int) -> None:
        """Solve all designs, with tables of their own that are interpolated between shared ones.

        These are built for as many panels and rows at a time as PANEL_BYTES hold. `parts` as in
        `panels.panel_at`.
        """
        problem, product = self.problem, self.problem.product
        rows = problem.family.row_count + 1
        seen = np.zeros(panels.MOST_PANELS * rows, dtype=np.bool_)

        def look(begin: int, end: int) -> None:
            keys = np.empty(end - begin, dtype=np.int64)
            keys_of(begin, end, rows, parts, product, keys)
            seen[keys] = True

        run_pieces(problem.size, look, problem.threads, None, PIECE_IN_LANES, PIECE_IN_LANES)
        wanted = np.flatnonzero(seen)
        threads = problem.threads // shared_by(problem.size, problem.threads, FEWEST_IN_LANES)
        small = np.min_scalar_type(wanted[-1])  # short numbers sort in one pass
        most = max(4, PANEL_BYTES // panels.bytes_of_table(problem.nodes, self.refinement) // 3)
        for group in np.array_split(wanted, -(-wanted.size // most)):
            low, high = int(group[0]), int(group[-1])
            tables = self._shared_tables(group, rows, parts)

            def job(
                begin: int, end: int, low: int = low, high: int = high,
                tables: tuple[Integers, Integers, Floats, panels.Panels] = tables,
            ) -> None:  # fmt: skip
                bases = tables[-1]
                levels = panels.make_own(problem.nodes, self.refinement, bases.fine)
                keys = np.empty(end - begin, dtype=np.int64)
                keys_of(begin, end, rows, parts, product, keys)
                order = np.argsort(keys.astype(small), kind="stable")
                first, last = np.searchsorted(keys, [low, high + 1], sorter=order)
                deferred = np.empty(last - first, dtype=np.int64)
                count = march_panels(
                    *self._form(), begin, order[first:last], keys, rows, *tables[:-1],
                    lanes.LANES, self.refinement, problem.width, product, bases, problem.choice,
                    problem.results, self._scratch(), levels, deferred,
                )  # fmt: skip
                self.deferred(np.sort(deferred[:count]), threads)

            told = progress if high == wanted[-1] else None
            run_pieces(problem.size, job, problem.threads, told, PIECE_IN_LANES, FEWEST_IN_LANES)

    def _shared_tables(
        self, keys: Integers, rows: int, parts: int
    ) -> tuple[Integers, Integers, Floats, panels.Panels]:
        """Shared tables of some keys: number of each key's and each panel's, points, tables."""
        problem, nodes, refinement = self.problem, self.problem.nodes, self.refinement
        row_of, steps = problem.row_of, problem.grid.node_sine.size
        # The row behind a key's is the other end of what designs blend; the last one has none.
        both = np.union1d(keys, keys[row_of[keys % rows + 1] >= 0] + 1)
        used = np.unique(keys // rows)
        of_key = np.full(panels.MOST_PANELS * rows + 1, -1, dtype=np.int64)
        of_key[both] = np.arange(both.size)
        of_panel = np.full(panels.MOST_PANELS, -1, dtype=np.int64)
        of_panel[used] = both.size + 2 * np.arange(used.size)
        points = panels.points_of(used, lanes.POINTS, parts)
        bases = panels.make_panels(both.size + 2 * used.size, nodes, refinement)
        work = [(int(of_key[k]), int(row_of[k % rows]), int(k // rows)) for k in both]
        work += [(int(of_panel[p]), -1, int(p)) for p in used]

        def build(begin: int, end: int) -> None:
            memory = panels.make_build(nodes, steps, refinement)
            for number, row, panel in work[begin:end]:
                panels.build_panel(
                    number, row, points[panel, 0], problem.width, refinement, problem.grid, bases,
                    *memory,
                )  # fmt: skip

        run_pieces(len(work), build, problem.threads, None, fewest=8)
        return of_key, of_panel, points, bases
