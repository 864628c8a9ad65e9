"""Designs of every kind that a card solves, and their solution in another process.

NUMBA_ENABLE_CUDASIM=1 python -m tests.support.card_designs OUT.npz [DESIGNS OF A LAUNCH]
"""

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from engine_dyn.card import card_of
from engine_dyn.geometry.cylinders import even_cylinders
from engine_dyn.loads.driven_machine import DrivenMachine
from engine_dyn.loads.torque_curves import torque_over_angle
from engine_dyn.speed import dispatch
from engine_dyn.speed.mechanisms import counted
from oracle.solution import CYCLE
from tests.support.sampled_designs import sampled_designs, three_loads

WANTED = (
    "delta", "delta_midrange", "omega_max", "omega_min", "omega_mean", "load_factor", "iterations",
)  # fmt: skip
EXPONENTS = (0.0, 1.0, 2.0, 1.7, 3.0)


def designs(count: int, cylinders: Any = 1, seed: int = 1) -> dict[str, Any]:
    return sampled_designs(
        three_loads(), count, cylinders, seed=seed, largest_ratio=0.55,
        exponent=np.resize(EXPONENTS, count),
    )  # fmt: skip


def cases() -> dict[str, dict[str, Any]]:
    counts = np.resize([1, 4, 6], 24)
    unequal = even_cylinders(4, CYCLE).with_factors(mass_factor=(1.1, 1.0, 1.0, 0.95))
    misfire = even_cylinders(4, CYCLE).with_factors(pressure_factor=(1.0, 1.0, 0.0, 1.0))
    angle = np.radians(np.arange(0.0, 360.0, 2.0))
    pump = torque_over_angle(angle, 10.0 + 3.0 * np.cos(3.0 * angle), own_angle=True)
    random = np.random.default_rng(2)
    failing = designs(20, seed=7)
    failing["inertia"] = failing["inertia"] * np.where(np.arange(20) % 2, 0.008, 1.0)
    failing["mean_torque"][4] = -failing["mean_torque"][4]
    failing["scale"][5] = np.nan
    linear_square = DrivenMachine(load_law="linear_square")
    return {
        "every exponent": designs(30),
        "a mix of cylinders": designs(24, counts),
        "linear load": designs(8)
        | {"driven": linear_square, "load_linear": 2.0, "load_square": 0.0},
        "linear and square load": designs(8)
        | {"driven": linear_square, "load_linear": 2.0, "load_square": random.uniform(0, 0.05, 8)},
        "unequal cylinders": designs(10, 4) | {"cylinders_by_count": {4: unequal}},
        "misfire": designs(10, 4) | {"cylinders_by_count": {4: misfire}},
        "pin offset": designs(10) | {"offset_ratio": random.uniform(-0.2, 0.2, 10)},
        "large crank ratios": designs(6) | {"crank_ratio": np.linspace(0.7, 0.95, 6)},
        "load over angle": designs(6)
        | {"driven": DrivenMachine(over_angle=pump), "gear_ratio": 2.0, "offset": 2.0 * pump.mean},
        "one table": designs(18)
        | {"crank_ratio": 0.3, "row": 1.4, "scale": 1.0, "crankcase_pressure": 1e5,
           "mean_torque": 40.0},
        "weak load": designs(5) | {"offset": designs(5)["mean_torque"] * (1.0 - 1e-4)},
        "failing": failing,
        "error": designs(10, seed=3) | {"wanted": (*WANTED, "delta_error")},
    }  # fmt: skip


def solutions(device: str, names: Sequence[str] = ()) -> dict[str, Any]:
    """Results of each case, or of some, and how many designs the batch solver left."""
    found: dict[str, Any] = {}
    for name, inputs in cases().items():
        if names and name not in names:
            continue
        with counted() as tally:
            asked = {"wanted": WANTED, "card": card_of(device), "threads": 2, **inputs}
            results = dispatch.solve(**asked)
        found |= {f"{name}/{one}": array for one, array in results.items()}
        found[f"{name}/left"] = np.array(tally.deferred)
    return found


def launched() -> list[int]:
    """Designs of each launch from now on."""
    from engine_dyn.card.card import Card

    sizes, solve = [], Card._solve

    def noted(self: Card, slot: Any, here: slice, *given: Any) -> bool:
        sizes.append(here.stop - here.start)
        return solve(self, slot, here, *given)

    Card._solve = noted
    return sizes


if __name__ == "__main__":
    if len(sys.argv) > 2:
        from engine_dyn.card import card

        card.PIECE = int(sys.argv[2])
    sizes = launched()
    np.savez(sys.argv[1], **solutions("cuda", sys.argv[3:]), sizes=sizes)
