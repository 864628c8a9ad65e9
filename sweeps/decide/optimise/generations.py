"""Generations of designs, each made from the better ones of those before, in the unit cube.

One quantity: differential evolution (R. Storn and K. Price 1997). Two: NSGA-II (K. Deb, A. Pratap,
S. Agarwal and T. Meyarivan 2002). Three and more: NSGA-III (K. Deb and H. Jain 2014). All compare
by the rules of Deb (2000): a design that fulfils the conditions is better than one that does not,
and of two that do not, the one that fails by less. The library is pymoo (J. Blank and K. Deb 2020).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.files.libraries import library
from sweeps.decide.optimise.evaluation import Judgement

WHERE = "optimise"


def first_positions(parameters: int, designs: int, seed: int) -> Floats:
    """Positions of the first generation: the first points of a scrambled Sobol' sequence."""
    qmc = library("scipy.stats.qmc", "SciPy", WHERE, extra="optimise")
    sequence = qmc.Sobol(parameters, scramble=True, rng=seed)
    return np.asarray(sequence.random_base2(max(1, math.ceil(math.log2(designs))))[:designs])


def search_generations(
    judge: Callable[[Floats, int], Judgement], start: Floats, names: int, conditions: int,
    generations: int, seed: int,
) -> None:  # fmt: skip
    """Search from some first designs on.

    Parameters
    ----------
    judge : callable
        Takes positions in the unit cube, shape (designs, parameters), and the number of the
        generation from 1; returns what is known of these designs.
    start : ndarray, shape (designs, parameters)
        Positions of the first generation.
    names, conditions : int
        Quantities of which less is wanted, and violations of each design.
    generations : int
        How many, with the first.
    seed : int
        Of the random numbers.
    """
    problem_of = library("pymoo.core.problem", "pymoo", WHERE, extra="optimise").Problem
    static = library("pymoo.problems.static", "pymoo", WHERE, extra="optimise").StaticProblem
    evaluator = library("pymoo.core.evaluator", "pymoo", WHERE, extra="optimise").Evaluator
    problem = problem_of(n_var=start.shape[1], n_obj=names, n_ieq_constr=conditions, xl=0.0, xu=1.0)
    algorithm = _algorithm(start, names)
    algorithm.setup(problem, termination=("n_gen", generations), seed=seed, verbose=False)
    number = 0
    while algorithm.has_next():
        number += 1
        designs = algorithm.ask()
        judgement = judge(np.clip(designs.get("X"), 0.0, 1.0), number)
        known = static(problem, F=judgement.wanted, G=judgement.violation)
        evaluator().eval(known, designs)
        algorithm.tell(infills=designs)


def _algorithm(start: Floats, names: int) -> Any:
    settings: dict[str, Any] = {"pop_size": len(start), "sampling": start}
    if names == 1:
        return library("pymoo.algorithms.soo.nonconvex.de", "pymoo", WHERE, extra="optimise").DE(
            **settings
        )
    # Equal designs are computed once in any case; comparing all with all takes longer than that.
    settings["eliminate_duplicates"] = False
    if names == 2:
        return library("pymoo.algorithms.moo.nsga2", "pymoo", WHERE, extra="optimise").NSGA2(
            **settings
        )
    directions = library("pymoo.util.ref_dirs", "pymoo", WHERE, extra="optimise")
    spread = directions.get_reference_directions(
        "das-dennis", names, n_partitions=_partitions(names, len(start))
    )
    return library("pymoo.algorithms.moo.nsga3", "pymoo", WHERE, extra="optimise").NSGA3(
        spread, **settings
    )


def _partitions(names: int, designs: int) -> int:
    """Parts of each edge of the simplex, so that there are at most as many directions as designs.

    Source: I. Das and J. E. Dennis (1998), whose points are C(names + parts - 1, parts).
    """
    parts = 1
    while math.comb(names + parts, parts + 1) <= designs:
        parts += 1
    return parts
