"""Follow absurd designs in time, 100,000 unless said: each must end in a true outcome.

50 of those that scipy's DOP853 can follow, too, are compared with it; see
`oracle.hostile_transients`.
"""

import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))  # Of the oracle, which is not installed

from engine_dyn import status
from engine_dyn.pressure.family import Family
from engine_dyn.transient import follow_designs
from oracle.hostile_transients import hostile_designs, hostile_engine, of_dop853, untrue
from sweeps.scene.engine.engine_files import load_engine


def main(count: int = 100_000) -> None:
    family = load_engine("ntua").family
    assert isinstance(family, Family)
    draw, ends, cycles, at_once = np.random.default_rng(63), Counter[str](), 20, 2000
    for _ in range(0, count, at_once):
        engine = hostile_engine(draw, family)
        given = hostile_designs(draw, at_once, engine.cylinders.count)
        found = follow_designs(engine, cycles, estimate=False, **given)
        ends.update(status.MEANINGS[code] for code in found.outcome)
        for name, number in untrue(found, given, cycles).items():
            print(f"{number} of {at_once}: {name}")
            ends["untrue"] += number
    print(dict(ends))
    errors: list[float] = []
    while len(errors) < min(50, count // 1000):
        errors += of_dop853(hostile_engine(draw, family), draw, 5)
        print("errors against DOP853:", ", ".join(f"{one:.0e}" for one in errors[-5:]))
    if ends["untrue"] or max(errors, default=0.0) > 1e-6:
        sys.exit("not all are true")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
