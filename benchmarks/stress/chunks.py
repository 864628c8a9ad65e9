"""The big draw, in a process of its own that may crash or hang without taking the suite along."""

from __future__ import annotations

import json
import os
import selectors
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.stress import draw
from benchmarks.stress.checks import CHECKS, check
from engine_dyn.speed.results import SCALAR_NAMES
from engine_dyn.types import Integers

MODULE = "benchmarks.stress"
LIMIT = 900.0
"""Seconds for one chunk: a hang, or a machine far too slow."""

SHOWN = 40
"""Broken designs that are kept, of each rule and chunk."""


@dataclass
class Outcome:
    """What all chunks gave.

    Attributes
    ----------
    designs : int
        That were solved.
    seconds : float
        In the kernels.
    status : Counter
        Designs by status, and by (closure, inertia model, status) in `parts`.
    broken : Counter
        Designs that break a rule, by its name.
    examples : list of dict
        Some of them, with all inputs and results.
    lost : list of str
        Chunks that hung or crashed.
    unlike : Counter
        Designs whose bits depended on threads or neighbours, by result.
    compared : int
        Designs that were solved again for that.
    picked : list of (chunk, index within it)
        For the independent solver.
    """

    designs: int = 0
    seconds: float = 0.0
    status: Counter[int] = field(default_factory=Counter)
    parts: Counter[tuple[str, str, int]] = field(default_factory=Counter)
    broken: Counter[str] = field(default_factory=Counter)
    examples: list[dict[str, Any]] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    unlike: Counter[str] = field(default_factory=Counter)
    compared: int = 0
    picked: list[tuple[int, int]] = field(default_factory=list)

    def add(self, line: dict[str, Any]) -> None:
        """One chunk's report."""
        self.designs += line["designs"]
        self.seconds += line["seconds"]
        for closure, model, code, count in line["status"]:
            self.status[code] += count
            self.parts[closure, model, code] += count
        self.broken.update(line["broken"])
        self.examples += line["examples"]
        self.unlike.update(line["unlike"])
        self.compared += line["compared"]
        self.picked += [(line["number"], index) for index in line["picked"]]


def one(seed: int, number: int, size: int, sample: int) -> dict[str, Any]:
    """Solve and check one chunk; what it found, ready for JSON."""
    chunk = draw.chunk(seed, number, size)
    begin = time.perf_counter()
    found = chunk.solve()
    seconds = time.perf_counter() - begin
    results = {name: np.asarray(array).reshape(-1) for name, array in found.items()}
    columns = chunk.flat()
    bounds = draw.shapes().bounds(columns)
    broken = check(columns, chunk.closure, bounds, results)
    random = np.random.default_rng([seed, number, 1])
    examples = [
        {"rule": name, **example(chunk, int(index), results)}
        for name, mask in broken.items()
        for index in np.flatnonzero(mask)[:SHOWN]
    ]
    status = [
        (chunk.closure, "variable" if model else "constant", int(code), int(count))
        for model in (False, True)
        for code, count in zip(
            *np.unique(results["status"][columns["variable"] == model], return_counts=True),
            strict=True,
        )
    ]
    unlike, compared = alone(chunk, results, random)
    return {
        "number": number,
        "designs": chunk.size,
        "seconds": seconds,
        "status": status,
        "broken": {name: int(mask.sum()) for name, mask in broken.items()},
        "examples": examples,
        "unlike": unlike,
        "compared": compared,
        "picked": pick(columns, results, sample, random).tolist(),
    }


def example(chunk: draw.Chunk, index: int, results: dict[str, Any]) -> dict[str, Any]:
    """Inputs and results of one design."""
    inputs = {name: array[0].item() for name, array in chunk.flat([index]).items()}
    answer = {name: array[index].item() for name, array in results.items()}
    return {"chunk": chunk.seed[1], "index": index, "closure": chunk.closure, "inputs": inputs,
            "results": answer}  # fmt: skip


def alone(
    chunk: draw.Chunk, results: dict[str, Any], random: np.random.Generator, count: int = 300
) -> tuple[dict[str, int], int]:
    """How many of some designs have other bits in other company and by one thread; of how many."""
    picks = random.permutation(chunk.size)[:count]
    column = replace(chunk, columns=chunk.flat(picks), shape=(picks.size,))
    found = column.solve(threads=1)
    unlike = {}
    for name, array in results.items():
        one, other = found[name], array[picks]
        differs = ~((one == other) | (np.isnan(one) & np.isnan(other)))
        if differs.any():
            unlike[name] = int(differs.sum())
    return unlike, picks.size


def pick(
    columns: dict[str, Any], results: dict[str, Any], count: int, random: np.random.Generator
) -> Integers:
    """A sample in which every kind of design is about equally frequent.

    Kinds differ in status, class of the exponent, inertia model, weakness of the load and size
    of delta.
    """
    exponent, delta = columns["exponent"], results["delta"]
    load = columns["mean_torque"] - columns["offset"]
    load = load / np.maximum(np.abs(columns["mean_torque"]), 1e-300)
    with np.errstate(invalid="ignore", divide="ignore"):
        swing = np.clip(np.nan_to_num(np.log10(delta), nan=-20.0, neginf=-20.0), -12.0, 1.0) // 2
    kinds = np.stack(
        [
            results["status"],
            np.select([exponent == 0.0, exponent == 1.0, exponent == 2.0, exponent < 1.0],
                      [0, 1, 2, 3], 4),
            columns["variable"].astype(int),
            np.select([load == 0.0, load < 0.0, load < 1e-6, load < 0.1], [0, 1, 2, 3], 4),
            swing.astype(int),
        ],
        axis=1,
    )  # fmt: skip
    _, which, counts = np.unique(kinds, axis=0, return_inverse=True, return_counts=True)
    weight = 1.0 / counts[which.reshape(-1)]
    # Designs without a number by what was asked of them need no solver to be told so.
    weight[np.isin(results["status"], (2, 4))] *= 0.05
    picked = random.choice(weight.size, min(count, weight.size), False, weight / weight.sum())
    return np.asarray(np.sort(picked))


# The process --------------------------------------------------------------------------------------


def work(seed: int, numbers: range, size: int, sample: int) -> None:
    """Chunks one after the other, a line of JSON for each on standard output."""
    for number in numbers:
        print(json.dumps(one(seed, number, size, sample)), flush=True)


def run(
    seed: int, designs: int, sample: int, say: Callable[[str], None], limit: float = LIMIT
) -> Outcome:
    """Solve and check `designs` designs; a process that hangs or crashes is replaced."""
    outcome = Outcome()
    size = draw.size_of(designs)
    count = draw.count_of(designs)
    quota = -(-sample // count)
    number = 0
    while number < count:
        for line in _lines(seed, range(number, count), size, quota, limit):
            if isinstance(line, str):
                outcome.lost.append(f"seed {seed}, chunk {number}: {line}")
                number += 1
                break
            outcome.add(line)
            number += 1
            say(f"chunk {number} of {count}: {outcome.designs / max(outcome.seconds, 1e-9):,.0f}"
                f" designs/s, {sum(outcome.broken.values())} broken rules")  # fmt: skip
    return outcome


def _lines(
    seed: int, numbers: range, size: int, sample: int, limit: float
) -> Iterator[dict[str, Any] | str]:
    """Reports of the chunks, the last one a text where the process ended before its time."""
    arguments = [str(v) for v in (seed, numbers.start, numbers.stop, size, sample)]
    process = subprocess.Popen(
        [sys.executable, "-m", MODULE, "--worker", *arguments],
        stdout=subprocess.PIPE, cwd=Path(__file__).parents[2], env=os.environ,
    )  # fmt: skip
    assert process.stdout is not None
    os.set_blocking(process.stdout.fileno(), False)
    left, rest = len(numbers), b""
    try:
        with selectors.DefaultSelector() as selector:
            selector.register(process.stdout, selectors.EVENT_READ)
            until = time.monotonic() + limit
            while left:
                if not selector.select(max(until - time.monotonic(), 0.0)):
                    yield f"no answer in {limit:g} s"
                    return
                data = process.stdout.read()
                if data == b"":
                    yield f"ended with status {process.wait()}"
                    return
                *lines, rest = (rest + (data or b"")).split(b"\n")
                for line in lines:
                    left -= 1
                    until = time.monotonic() + limit
                    yield json.loads(line)
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def rules() -> dict[str, str]:
    """Names and meanings of what is checked."""
    return CHECKS


RESULTS = SCALAR_NAMES
