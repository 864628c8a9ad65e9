"""The bits of results do not depend on how many threads libraries of linear algebra may use."""

import json
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from sweeps.base.one_thread import linear_algebra_on_one_thread

SHARES = [f"friction_{part}" for part in ("boundary", "mixed", "hydrodynamic", "skirt")]


def light() -> dict[str, Any]:
    """Designs that nearly stall, with fine columns: friction over the stroke, light inertias."""
    draw = np.random.default_rng(5)
    speed = draw.uniform(750.0, 1000.0, 8)
    columns = {
        "speed": speed, "inertia": draw.uniform(3.2e4, 4.0e4, 8) / speed**2,
        "load_exponent": draw.uniform(0.0, 1.0, 8), "crank_ratio": draw.uniform(0.21, 0.34, 8),
        "ring_pressure": draw.uniform(1.0, 3.0, 8),
        **{share: draw.uniform(0.0, 0.2, 8) for share in SHARES},
    }  # fmt: skip
    return {
        "engine": "si_four_87x101",
        "designs": {name: column.tolist() for name, column in columns.items()},
        "output": {"quantities": ["delta", "omega_min", "omega_max"]},
    }


def unlike() -> dict[str, Any]:
    """Modelled cycles, misfires, and offsets of the pin."""
    return {
        "engine": "marine_80x345",
        "axes": {"misfire": [0, 1], "load": [50, 100], "pin_offset": [0.0, 0.01]},
        "output": {"quantities": ["delta", "imep", "torque_order"]},
    }


def long_shaft() -> dict[str, Any]:
    """The most discs that a shaft of a scene has, with damping."""
    discs = [{"name": f"disc {n}", "inertia": 0.1 + 0.01 * n} for n in range(40)]
    discs[3] |= {"throw": 1}
    shafts = [
        {"between": [f"disc {n}", f"disc {n + 1}"], "stiffness": 1e5 + 1e3 * n} for n in range(39)
    ]
    named = {"reciprocating": "included", "flywheel": "disc 39"}
    return {
        "engine": "b112", "shaft": {**named, "discs": discs, "shafts": shafts},
        "output": {"quantities": ["natural_frequency", "mode_shape"]},
    }  # fmt: skip


PRINT = """
import hashlib, json, sys, warnings
import sweeps
from threadpoolctl import threadpool_info
warnings.simplefilter("ignore")
assert {one["num_threads"] for one in threadpool_info()} <= {int(sys.argv[1])}
for scene in json.load(sys.stdin):
    found = sweeps.run(scene)
    for name, values in found.items():
        print(name, hashlib.sha256(values.values.tobytes()).hexdigest())
"""


def printed(threads: int) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", PRINT, str(threads)], capture_output=True, text=True, check=True,
        input=json.dumps([light(), unlike(), long_shaft()]),
        env={**os.environ, "OPENBLAS_NUM_THREADS": str(threads)},
    )  # fmt: skip
    return done.stdout.splitlines()


@pytest.mark.slow
def test_one_and_several_threads_give_the_same_bits() -> None:
    one = printed(1)
    assert len(one) > 8
    assert printed(4) == one


def test_the_limit_ends_with_the_last_that_asked_for_it() -> None:
    before = [one["num_threads"] for one in threadpool_info()]
    first, second = linear_algebra_on_one_thread(), linear_algebra_on_one_thread()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert {one["num_threads"] for one in threadpool_info()} <= {1}
    second.__exit__(None, None, None)
    assert [one["num_threads"] for one in threadpool_info()] == before
