"""Ordinary engines with too little inertia: what the fast kernels call converged.

The batch solver, `engine_dyn.speed.batch`, answers with an estimate of its own whether the
tolerance is met. Here it is held against the general method with four times as many nodes, up to
where the speed falls to nothing: absurd designs rarely lie in that corner.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from benchmarks import problem
from benchmarks.stress.findings import Findings, Say, count
from benchmarks.stress.judging import QUANTITIES, TOLERANCE, differing
from engine_dyn.speed import dispatch
from engine_dyn.status import CONVERGED

PART = "Light flywheels"

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


def run(seed: int, rounds: int, say: Say) -> Findings:
    """Every second round has a table of designs that share nothing."""
    result = Findings()
    random = np.random.default_rng([seed, 2000])
    for model, name in product(MODELS, EXPONENTS):
        for number in range(rounds * MOST_CYLINDERS):
            cylinders = 1 + number % MOST_CYLINDERS
            source = scene(random, EXPONENTS[name], cylinders, model == "variable")
            if number // MOST_CYLINDERS % 2:
                source = unlike(random, source)
            inputs, wanted = problem.own_inputs(source), (*QUANTITIES, "status")
            found = dispatch.solve(wanted=wanted, **inputs)
            exact = dispatch.solve(wanted=wanted, method="newton", finer=4, **inputs)
            good = (found["status"] == CONVERGED) & (exact["status"] == CONVERGED)
            differs = differing(found, exact)
            most = np.where(good, np.maximum(differs["delta"], differs["speeds"]), 0.0)

            def tell(place: int, inputs: Any = inputs, most: Any = most) -> dict[str, Any]:
                values = {
                    key: float(np.broadcast_to(value, most.shape).flat[place])
                    for key, value in inputs.items()
                    if not isinstance(value, str) and key != "family"
                }
                return {"differs": float(most.flat[place]), **values}

            result.counts["agrees", model, name] += int((good & (most <= TOLERANCE)).sum())
            result.mark("off", model, name, mask=most > TOLERANCE, tell=tell)
            result.note((model, name), float(most.max(initial=0.0)))
    say(f"light flywheels: {result.of('off')} off")
    return result


def words(found: Findings) -> dict[str, str]:
    """Sentences with figures, by their names."""
    return {
        "light": f"{count(found.total(('agrees', 'off')))} ordinary engines with light flywheels "
        f"that the fast kernels report as converged: {count(found.of('off'))} beyond the tolerance."
    }
