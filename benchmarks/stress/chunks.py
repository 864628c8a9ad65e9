"""The big draw, in a process of its own that may crash or hang without taking the suite along."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from multiprocessing import get_context
from typing import Any

import numpy as np

from benchmarks.stress import draw
from benchmarks.stress.checks import check
from engine_dyn.types import Booleans, Integers

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

    def add(self, other: Outcome) -> None:
        """Add what another chunk gave."""
        for name in (each.name for each in fields(self)):
            setattr(self, name, getattr(self, name) + getattr(other, name))


def one(seed: int, number: int, size: int, sample: int) -> Outcome:
    """Solve and check one chunk."""
    chunk = draw.chunk(seed, number, size)
    begin = time.perf_counter()
    found = chunk.solve()
    seconds = time.perf_counter() - begin
    results = {name: np.asarray(array).reshape(-1) for name, array in found.items()}
    columns = chunk.flat()
    broken = check(columns, chunk.closure, draw.shapes().bounds(columns), results)
    random = np.random.default_rng([seed, number, 1])
    models = np.where(columns["variable"], "variable", "constant").tolist()
    codes = results["status"].tolist()
    unlike, compared = alone(chunk, results, random)
    return Outcome(
        designs=chunk.size,
        seconds=seconds,
        status=Counter(codes),
        parts=Counter((chunk.closure, *kind) for kind in zip(models, codes, strict=True)),
        broken=Counter({name: int(mask.sum()) for name, mask in broken.items()}),
        examples=[
            {"rule": name, **example(chunk, int(index), results)}
            for name, mask in broken.items()
            for index in np.flatnonzero(mask)[:SHOWN]
        ],
        unlike=unlike,
        compared=compared,
        picked=[(number, index) for index in pick(columns, results, sample, random).tolist()],
    )


def example(chunk: draw.Chunk, index: int, results: dict[str, Any]) -> dict[str, Any]:
    """Inputs and results of one design."""
    inputs = {name: array[0].item() for name, array in chunk.flat([index]).items()}
    answer = {name: array[index].item() for name, array in results.items()}
    return {"chunk": chunk.seed[1], "index": index, "closure": chunk.closure, "inputs": inputs,
            "results": answer}  # fmt: skip


def alone(
    chunk: draw.Chunk, results: dict[str, Any], random: np.random.Generator, count: int = 300
) -> tuple[Counter[str], int]:
    """How many of some designs have other bits in other company and by one thread; of how many."""
    picks = random.permutation(chunk.size)[:count]
    column = replace(chunk, columns=chunk.flat(picks), shape=(picks.size,))
    found = column.solve(threads=1)
    masks = unlike_bits(found, {name: array[picks] for name, array in results.items()})
    return Counter(
        {name: int(mask.sum()) for name, mask in masks.items() if mask.any()}
    ), picks.size


def unlike_bits(one: dict[str, Any], other: dict[str, Any]) -> dict[str, Booleans]:
    """Masks of results of `other` whose bits are others in `one`, by name."""
    return {
        name: ~((one[name] == values) | (np.isnan(one[name]) & np.isnan(values)))
        for name, values in other.items()
    }


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


def work(out: Any, seed: int, numbers: range, size: int, sample: int) -> None:
    """Chunks one after the other, each sent as soon as it is done."""
    for number in numbers:
        out.send(one(seed, number, size, sample))


def run(
    seed: int, designs: int, sample: int, say: Callable[[str], None], limit: float = LIMIT
) -> Outcome:
    """Solve and check `designs` designs; a process that hangs or crashes is replaced."""
    outcome = Outcome()
    size, count = draw.size_of(designs), draw.count_of(designs)
    context = get_context("spawn")
    number, process = 0, None
    while number < count:
        if process is None:
            answers, out = context.Pipe(duplex=False)
            left = range(number, count)
            process = context.Process(
                target=work, args=(out, seed, left, size, -(-sample // count))
            )
            process.start()
            out.close()
        number += 1
        try:
            if answers.poll(limit):
                outcome.add(answers.recv())
                say(f"chunk {number} of {count}: {outcome.designs / outcome.seconds:,.0f} "
                    f"designs/s, {outcome.broken.total()} broken rules")  # fmt: skip
                continue
            why = f"no answer in {limit:g} s"
        except EOFError:
            process.join()
            why = f"ended with status {process.exitcode}"
        outcome.lost.append(f"seed {seed}, chunk {number - 1}: {why}")
        process.kill()
        process = None
    if process is not None:
        process.join()
    return outcome
