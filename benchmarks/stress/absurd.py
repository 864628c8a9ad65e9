"""Designs of absurd ranges: rules that any true answer satisfies, bits, the independent solver.

Chunks are solved in a process of their own, which may crash or hang without taking the suite along.
"""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.stress import draw
from benchmarks.stress.checks import check
from benchmarks.stress.findings import DEFECTS, Findings, Say, count
from benchmarks.stress.judging import QUANTITIES, VERDICTS, judge
from benchmarks.workers import Lost, answers
from engine_dyn.status import CONVERGED, MEANINGS
from engine_dyn.types import Booleans, Integers
from oracle import spline

PART = "Absurd designs"

LIMIT = 1800.0
"""Seconds of the processor for one chunk: a hang, or a machine far too slow."""

AGAIN = 300
"""Designs of a chunk that are solved again in other company and by one thread."""


def one(job: tuple[int, int, int, int]) -> Findings:
    """Solve and check one chunk, and solve a sample of it by the independent solver."""
    seed, number, length, sample = job
    chunk = draw.chunk(seed, number, length)
    begin = time.perf_counter()
    found = chunk.solve()
    seconds = time.perf_counter() - begin
    results = {name: np.asarray(array).reshape(-1) for name, array in found.items()}
    columns = chunk.flat()
    result, random = Findings(), np.random.default_rng([seed, number, 1])
    models = np.where(columns["variable"], "variable", "constant").tolist()
    kinds = Counter(zip(models, results["status"].tolist(), strict=True))
    result.counts.update({("status", chunk.closure, *kind): n for kind, n in kinds.items()})
    for name, mask in check(columns, chunk.closure, draw.shapes().bounds(columns), results).items():
        result.mark("broken", name, mask=mask, tell=lambda i: example(chunk, i, results))
    picks = random.permutation(chunk.size)[:AGAIN]
    alone = replace(chunk, columns=chunk.flat(picks), shape=(picks.size,)).solve(threads=1)
    result.counts[("again",)] += picks.size
    for name, mask in unlike_bits(alone, {n: a[picks] for n, a in results.items()}).items():
        result.mark("bits", name, mask=mask, tell=lambda i: example(chunk, picks[i], results))
    picked = pick(columns, results, sample, random)
    part = draw.Chunk(chunk.flat(picked), chunk.closure, (picked.size,), chunk.seed)
    result.keep(seconds=[seconds])
    result.add(agreement(part, part.solve(threads=1), part.exact(), picked.tolist()))
    return result


def example(chunk: draw.Chunk, index: int, results: dict[str, Any]) -> dict[str, Any]:
    """Inputs and results of one design."""
    inputs = {name: array[0].item() for name, array in chunk.flat([index]).items()}
    answer = {name: array[index].item() for name, array in results.items()}
    return {"chunk": chunk.seed[1], "index": int(index), "closure": chunk.closure, "inputs": inputs,
            "results": answer}  # fmt: skip


def unlike_bits(one: dict[str, Any], other: dict[str, Any]) -> dict[str, Booleans]:
    """Masks of results of `other` whose bits are others in `one`, by name."""
    return {
        name: ~((one[name] == values) | (np.isnan(one[name]) & np.isnan(values)))
        for name, values in other.items()
    }


def pick(
    columns: dict[str, Any], results: dict[str, Any], number: int, random: np.random.Generator
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
    picked = random.choice(weight.size, min(number, weight.size), False, weight / weight.sum())
    return np.asarray(np.sort(picked))


def agreement(
    part: draw.Chunk, found: dict[str, Any], exact: spline.Solutions, index: list[int]
) -> Findings:
    """Verdicts on designs that both have solved, by status."""
    kind, differs = judge(found, exact, part.columns["speed"])
    kinds = Counter(zip(kind.tolist(), found["status"].tolist(), strict=True))
    result = Findings(Counter(kinds))
    good = (found["status"] == CONVERGED) & (kind == "agrees")
    for name in QUANTITIES:
        result.note(name, float(np.max(differs[name][good], initial=0.0)))
    for i in np.flatnonzero(np.isin(kind, (*DEFECTS, "gave up", "unknown"))).tolist():
        true = {name: float(getattr(exact, name)[i]) for name in ("lowest", "doubt", *QUANTITIES)}
        result.examples.append({
            "what": str(kind[i]), **example(part, i, found), "index": index[i],
            "differs": {name: float(differs[name][i]) for name in QUANTITIES},
            "exact": {"status": MEANINGS[exact.status[i]], **true},
        })  # fmt: skip
    return result


def run(seed: int, designs: int, sample: int, say: Say, limit: float = LIMIT) -> Findings:
    """Solve and check `designs` designs, and `sample` of them by the independent solver."""
    result = Findings()
    length, chunks = draw.size_of(designs), draw.count_of(designs)
    jobs = [(seed, number, length, -(-sample // chunks)) for number in range(chunks)]
    for number, answer in enumerate(answers(one, jobs, 1, limit)):
        if isinstance(answer, Lost):
            result.counts["lost", f"seed {seed}, chunk {number}: {answer.why}"] += 1
            continue
        result.add(answer)
        say(f"chunk {number + 1} of {chunks}: {rate_of(result):,.0f} designs/s, "
            f"{result.of('broken')} broken rules")  # fmt: skip
    return result


def rate_of(found: Findings) -> float:
    """Designs a second of kernel time."""
    return found.of("status") / max(float(found.array("seconds").sum()), 1e-9)


# What is told -------------------------------------------------------------------------------------


def words(found: Findings) -> dict[str, str]:
    """Sentences with figures, by their names."""
    unlike = {key[1]: n for key, n in found.counts.items() if key[0] == "bits" and n}
    bits = ", ".join(f"`{name}` of {count(n)}" for name, n in unlike.items()) or "none"
    return {
        "absurd": f"{count(found.of('status'))} designs from absurd ranges: {found.of('lost')} "
        f"hangs or crashes, {count(found.of('broken'))} broken rules.",
        "again": f"{count(found.of('again'))} of the absurd designs solved again, among other "
        f"designs and by one thread: {bits} differs in a bit.",
        "independent": f"{count(found.total(VERDICTS))} of the absurd designs solved again by an "
        f"independent solver: {found.total(('off', 'outcome'))} disagree.",
    }
