"""Ordinary engines with too little inertia: what the fast kernels call converged.

The batch solver, `engine_dyn.speed.batch`, answers with an estimate of its own whether the
tolerance is met. Here it is held against the general method with four times as many nodes, up to
where the speed falls to nothing: absurd designs rarely lie in that corner.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np

from benchmarks import problem
from benchmarks.stress.findings import Findings
from benchmarks.stress.sample import QUANTITIES, TOLERANCE
from engine_dyn.speed import dispatch
from engine_dyn.status import CONVERGED

MODELS = ("constant", "variable")
EXPONENTS = {"0": (0.0, 0.0), "1": (1.0, 1.0), "2": (2.0, 2.0), "0.1 to 4": (0.1, 4.0)}
MOST_CYLINDERS = 8


def scene(
    random: np.random.Generator, exponents: tuple[float, float], cylinders: int, variable: bool
) -> problem.Designs:
    """Inertia x speed x mass of one engine."""
    return problem.product(
        cylinders * 10.0 ** random.uniform(-1.3, 1.6, 12), 10.0 ** random.uniform(1.0, 2.6, 12),
        random.uniform(0.5, 9.0, 4), exponent=random.uniform(*exponents), cylinders=cylinders,
        variable=variable, ratio=random.uniform(0.05, 0.6), friction=random.uniform(0.0, 40.0),
    )  # fmt: skip


def unlike(random: np.random.Generator, source: problem.Designs) -> problem.Designs:
    """As many designs that share nothing but their cylinders and their exponent."""
    designs = source.take(slice(None))
    for name, (low, high) in {"ratio": (0.05, 0.6), "friction": (0.0, 40.0)}.items():
        getattr(designs, name)[:] = random.uniform(low, high, len(source))
    return designs


def run(seed: int, rounds: int, say: Callable[[str], None]) -> Findings:
    """Every second round has a table of designs that share nothing."""
    result = Findings()
    random = np.random.default_rng([seed, 2000])
    for model, name in product(MODELS, EXPONENTS):
        key = model, name
        for number in range(rounds * MOST_CYLINDERS):
            cylinders = 1 + number % MOST_CYLINDERS
            source: Any = scene(random, EXPONENTS[name], cylinders, model == "variable")
            if number // MOST_CYLINDERS % 2:
                source = unlike(random, source)
            inputs = problem.own_inputs(source)
            wanted = (*QUANTITIES, "status")
            found = dispatch.solve(wanted=wanted, **inputs)
            exact = dispatch.solve(wanted=wanted, method="newton", finer=4, **inputs)
            good = (found["status"] == CONVERGED) & (exact["status"] == CONVERGED)
            errors = [np.abs(found[q] / exact[q] - 1.0)[good] for q in QUANTITIES]
            most = np.max(errors, axis=0, initial=0.0)
            off = np.flatnonzero(most > TOLERANCE)
            result.counts[key, "off"] += off.size
            result.counts[key, "agrees"] += int(good.sum()) - off.size
            result.note(key, float(most.max(initial=0.0)))
            for place in off[:1]:
                values = {
                    name: float(np.broadcast_to(value, good.shape)[good][place])
                    for name, value in inputs.items()
                    if not isinstance(value, str) and name != "family"
                }
                result.examples.append(
                    {"inertia_model": model, "differs": float(most[place]), **values}
                )
    say(f"light flywheels: {result.wrong} of {result.size} off")
    return result
