"""Ordinary engines with too little inertia: what the fast kernels call converged.

The batch solver, `engine_dyn.speed.batch`, answers with an estimate of its own whether the
tolerance is met. Here it is held against the general method with four times as many nodes, up to
where the speed falls to nothing: absurd designs rarely lie in that corner.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks import problem
from benchmarks.stress.sample import QUANTITIES, TOLERANCE
from engine_dyn.speed import dispatch
from engine_dyn.status import CONVERGED

MODELS = {False: "constant", True: "variable"}
EXPONENTS = {"0": (0.0, 0.0), "1": (1.0, 1.0), "2": (2.0, 2.0), "0.1 to 4": (0.1, 4.0)}
MOST_CYLINDERS = 8


@dataclass
class Strong:
    """Per inertia model and exponent: designs compared, those that are off, largest difference."""

    compared: dict[tuple[str, str], int] = field(default_factory=dict)
    off: dict[tuple[str, str], int] = field(default_factory=dict)
    worst: dict[tuple[str, str], float] = field(default_factory=dict)
    examples: list[dict[str, Any]] = field(default_factory=list)

    @property
    def wrong(self) -> int:
        """Designs whose status is not true."""
        return sum(self.off.values())


def scene(
    random: np.random.Generator, exponents: tuple[float, float], cylinders: int, variable: bool
) -> problem.Scene:
    """Inertia x speed x mass of one engine."""
    return problem.Scene(
        inertia=cylinders * 10.0 ** random.uniform(-1.3, 1.6, 12),
        speed=10.0 ** random.uniform(1.0, 2.6, 12),
        mass=random.uniform(0.5, 9.0, 4),
        exponent=random.uniform(*exponents),
        cylinders=cylinders,
        variable=variable,
        ratio=random.uniform(0.05, 0.6),
        friction=random.uniform(0.0, 40.0),
    )


def unlike(random: np.random.Generator, source: problem.Scene) -> problem.Designs:
    """As many designs that share nothing but their cylinders and their exponent."""
    designs = source.designs(np.arange(source.size))
    for name, (low, high) in {"ratio": (0.05, 0.6), "friction": (0.0, 40.0)}.items():
        getattr(designs, name)[:] = random.uniform(low, high, source.size)
    return designs


def run(seed: int, rounds: int, say: Callable[[str], None]) -> Strong:
    """Every second round has a table of designs that share nothing."""
    result = Strong()
    one = problem.family()
    random = np.random.default_rng([seed, 2000])
    for variable, model in MODELS.items():
        for name, exponents in EXPONENTS.items():
            key = model, name
            result.compared[key], result.off[key], result.worst[key] = 0, 0, 0.0
            for number in range(rounds * MOST_CYLINDERS):
                source: Any = scene(random, exponents, 1 + number % MOST_CYLINDERS, variable)
                if number // MOST_CYLINDERS % 2:
                    source = unlike(random, source)
                inputs = problem.own_inputs(source, one)
                wanted = (*QUANTITIES, "status")
                found = dispatch.solve(wanted=wanted, **inputs)
                exact = dispatch.solve(wanted=wanted, method="newton", finer=4, **inputs)
                good = (found["status"] == CONVERGED) & (exact["status"] == CONVERGED)
                errors = [np.abs(found[q] / exact[q] - 1.0)[good] for q in QUANTITIES]
                most = np.max(errors, axis=0, initial=0.0)
                result.compared[key] += int(good.sum())
                result.worst[key] = max(result.worst[key], float(most.max(initial=0.0)))
                off = np.flatnonzero(most > TOLERANCE)
                result.off[key] += off.size
                for place in off[:1]:
                    values = {
                        name: float(np.broadcast_to(value, good.shape)[good][place])
                        for name, value in inputs.items()
                        if not isinstance(value, str) and name != "family"
                    }
                    result.examples.append(
                        {"inertia_model": model, "differs": float(most[place]), **values}
                    )
    say(f"light flywheels: {result.wrong} of {sum(result.compared.values())} off")
    return result
