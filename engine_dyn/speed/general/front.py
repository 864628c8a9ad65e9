"""The general solver for a part of a sweep: what its driver needs beside the designs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from engine_dyn.geometry.cylinders import Cylinders
from engine_dyn.loads.laws import Form, PowerForm
from engine_dyn.pressure.family import Family
from engine_dyn.pressure.motored import row_with_factor
from engine_dyn.speed.arguments import Curves, Problem
from engine_dyn.speed.general.cycles import Samples
from engine_dyn.speed.general.driver import solve_designs
from engine_dyn.speed.general.scratch import Scratch, make_scratch
from engine_dyn.speed.general.second_driver import solve_left_designs
from engine_dyn.speed.general.segments import SEGMENTS
from engine_dyn.speed.methods import THESIS
from engine_dyn.speed.pieces import Progress, run_pieces
from engine_dyn.speed.product import places_of_results
from engine_dyn.status import NO_STEADY_STATE, NOT_CONVERGED, STALLED, TOLERANCE_NOT_MET
from engine_dyn.types import Floats, Integers
from engine_dyn.units import DEGREE

__all__ = ["NO_SAMPLES", "GeneralSolver", "samples_of"]

SAMPLE_WIDTH = DEGREE
"""Step of the thesis's method."""

NOWHERE = np.zeros(0)
NO_CURVES = Curves(np.zeros(0, dtype=np.int64), NOWHERE, NOWHERE)
NO_SAMPLES = Samples(
    np.zeros((1, 1, 1)), np.zeros((1, 1)), np.zeros((1, 1)), np.ones(1), np.ones(1)
)
"""Arguments of the driver where no curves, or no samples of the thesis's method, are wanted."""


@dataclass(frozen=True)
class GeneralSolver:
    """Solves any designs of a problem, each by itself.

    Attributes
    ----------
    problem : Problem
    form : Form
        Form of the law over speed.
    over_angle : ndarray
        Table of a load over an angle, empty where there is none.
    samples : Samples
        Samples of the thesis's method, `NO_SAMPLES` for the others.
    """

    problem: Problem
    form: Form
    over_angle: Floats
    samples: Samples = NO_SAMPLES

    def solve_all(self, progress: Progress | None) -> None:
        """Solve all designs, in pieces on threads."""
        curves = self._curves()

        def job(begin: int, end: int) -> None:
            self._solve(np.arange(begin, end), curves, self._scratch())

        run_pieces(self.problem.size, job, self.problem.threads, progress)

    def solve_chosen(self, chosen: Integers, threads: int) -> None:
        """Solve the designs `chosen`, ascending, such as those that the batch solver defers."""
        curves = self._curves()

        def job(begin: int, end: int) -> None:
            self._solve(chosen[begin:end], curves, self._scratch())

        run_pieces(chosen.size, job, threads, None)

    def _scratch(self) -> Scratch:
        problem = self.problem
        return make_scratch(problem.nodes, problem.grid.node_sine.size, self.samples.sine.shape[1])

    def _solve(self, chosen: Integers, curves: Curves, scratch: Scratch) -> None:
        problem = self.problem
        solve_designs(
            chosen, SEGMENTS, problem.product, problem.row_of, problem.width, problem.grid,
            self.samples, problem.choice, self.form, self.over_angle, curves, problem.results,
            scratch,
        )  # fmt: skip

        left = self._left_of(chosen)
        if left.size:
            solve_left_designs(
                left, SEGMENTS, problem.product, problem.row_of, problem.width, problem.grid,
                problem.choice, self.form, self.over_angle, curves, problem.results, scratch,
            )  # fmt: skip

    def _left_of(self, chosen: Integers) -> Integers:
        """Those of the designs `chosen` for which a cycle has still to be looked for in time.

        None with a power of the speed, whose stalls Newton's method tells by itself; with other
        laws it may start too far away. The last number of nodes is where a missed tolerance counts.
        """
        problem = self.problem
        if problem.choice.method == THESIS or isinstance(self.form, PowerForm):
            return chosen[:0]
        outcomes = [NOT_CONVERGED, STALLED, NO_STEADY_STATE]
        if problem.last:
            outcomes.append(TOLERANCE_NOT_MET)
        status = problem.results.status[places_of_results(chosen, problem.product)]
        return chosen[np.isin(status, outcomes)]

    def _curves(self) -> Curves:
        """Where the angles lie at which curves are wanted."""
        problem, angles = self.problem, self.problem.angles
        if not angles.size:
            return NO_CURVES
        torque_period = problem.family.period / problem.repeats
        place = np.mod(angles, torque_period) / problem.width
        node = np.minimum(np.floor(place + 1e-9).astype(np.int64), problem.nodes - 1)
        period = problem.family.period
        return Curves(
            node=node,
            fraction=np.maximum(place - node, 0.0),
            sample=np.mod(angles + 0.5 * period, period) / SAMPLE_WIDTH,
        )


def samples_of(family: Family, rows: Integers, engine: Cylinders) -> Samples:
    """Pressure at each cylinder's own angle for every sample of the thesis's method."""
    period = family.period
    angle = -0.5 * period + np.arange(round(period / SAMPLE_WIDTH)) * SAMPLE_WIDTH
    count = len(engine.members)
    if engine.plain:  # in the order of firing
        angle = angle[None, :] - np.arange(count)[:, None] * (period / count)
    else:
        angle = angle[None, :] + np.array([[member.phase] for member in engine.members])
    pressure = [
        [
            row_with_factor(family, int(row), member.pressure_factor)(here)
            for member, here in zip(engine.members, angle, strict=True)
        ]
        for row in rows
    ]
    return Samples(
        np.array(pressure), np.sin(angle), np.cos(angle), np.array(engine.mass_factors),
        np.array(engine.radius_factors),
    )  # fmt: skip
