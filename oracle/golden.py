"""Solutions of the held-out designs, kept beside the code that made them.

``python -m oracle.golden`` in the project's root writes ``golden.json`` anew (some minutes).
Every number is that of `solution.solve`; nothing is written unless `collocation.collocate` agrees
with it to 1e-9 in every speed and in delta.
"""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from .collocation import collocate
from .designs import HeldOut, held_out
from .solution import Solution, problem_of, solve

FILE = Path(__file__).with_name("golden.json")
AGREEMENT = 1e-9
NUMBERS = (
    "omega_mean",
    "omega_max",
    "omega_min",
    "delta",
    "k",
    "load_torque_nominal",
    "energy_swing",
    "torque_mean",
    "torque_max",
    "torque_min",
)


def read() -> dict[str, dict[str, Any]]:
    """Golden record of each held-out design by its name.

    A record holds ``status``, ``design`` (its numbers, the pressure's too) and, where they exist,
    the numbers of `solution.Solution` in SI units.
    """
    return {record["name"]: record for record in json.loads(FILE.read_text("utf-8"))["designs"]}


def numbers_of(item: HeldOut) -> dict[str, Any]:
    """All that defines a held-out design, as plain data."""
    # Held-out engines are in line, centred, and fire evenly; their friction is even.
    left = (
        "offset", "firing_angles", "pressure_factors", "mass_factors", "radius_factors", "motored",
        "friction_shares", "ring_pressure",
    )  # fmt: skip
    return {key: value for key, value in asdict(item.design).items() if key not in left}


def disagreement(item: HeldOut, solution: Solution, nodes: int) -> float:
    """Largest relative difference between both methods in a speed, delta or the energy swing."""
    other = collocate(problem_of(item.design)[0], nodes)
    pairs = (
        (other.omega_mean, solution.omega_mean),
        (other.omega_max, solution.omega_max),
        (other.omega_min, solution.omega_min),
        ((other.omega_max - other.omega_min) / other.omega_mean, solution.delta),
        (other.energy_swing, solution.energy_swing),
    )
    load = abs(other.load_torque_nominal - solution.load_torque_nominal) / solution.torque_max
    return max(load, *(abs(one / two - 1.0) for one, two in pairs))


def record_of(item: HeldOut) -> dict[str, Any]:
    """Golden record of one design; raises RuntimeError if the two methods disagree."""
    solution = solve(item.design)
    if solution.status != item.status:
        raise RuntimeError(f"{item.name}: {solution.status} instead of {item.status}")
    record: dict[str, Any] = {"name": item.name, "status": item.status, "design": numbers_of(item)}
    for name in NUMBERS:
        value = getattr(solution, name)
        if not math.isnan(value):
            record[name] = value
    if item.status == "converged":
        # Few nodes do for most; a speed that nearly vanishes somewhere has a sharp corner there.
        difference = math.inf
        for nodes in (1441, 4321):
            if difference > AGREEMENT:
                difference = disagreement(item, solution, nodes)
        if difference > AGREEMENT:
            raise RuntimeError(f"{item.name}: the methods differ by {difference:.1e}")
        record["disagreement"] = float(f"{difference:.1e}")
    return record


def main() -> None:
    """Write the file."""
    records = []
    for item in held_out():
        records.append(record_of(item))
        print(f"{item.name}: {item.status} {records[-1].get('disagreement', '')}", flush=True)
    about = "Written by python -m oracle.golden; SI units; speeds in rad/s."
    text = json.dumps({"about": about, "designs": records}, indent=1)
    FILE.write_text(text + "\n", "utf-8")


if __name__ == "__main__":
    main()
