"""Sampled studies as people run them, over wider ranges: rules, bits, and error of the solver.

`sweeps.run` solves them, so that loads, offsets, misfires and modelled cycles pass through the
graph of quantities; docs/measurements.md says what each is compared with.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
import xarray as xr

import sweeps
from benchmarks.stress.absurd import unlike_bits
from benchmarks.stress.checks import check_answers
from benchmarks.stress.findings import Findings, Say, count, size
from benchmarks.stress.judging import BORDER, TOLERANCE, differing
from benchmarks.studies import SCALARS, STROKE_FRICTION, Scene, angle_load, columns, scene
from benchmarks.studies import sampled as drawn
from benchmarks.study_errors import differences
from engine_dyn.geometry.slider_crank import crank_radius_of_ratio
from engine_dyn.speed import dispatch
from engine_dyn.speed.mechanisms import counted
from engine_dyn.status import (
    CONVERGED,
    NOT_CONVERGED,
    STALLED,
    TOLERANCE_NOT_MET,
)

PART = "Sampled studies"

DESIGNS = 2_110_000
"""Designs of all kinds together, unless asked otherwise."""

CHUNK = 50_000
"""Designs that are solved at a time, so that memory stays small."""

AGAIN, WITH_ERROR = 500, 0.1
"""Designs of a chunk that are solved again in other company, and share of it that is solved with
`delta_error`, at least as many."""

FEWEST = 2 * AGAIN
"""Designs of a chunk at least."""

FINER = 2
"""Factor on the nodes of the general solver: its own error is then below 1e-9."""

COVERED = 0.999
"""Required: share of designs whose true error is below `delta_error`."""

RESULTS = [*SCALARS, "delta_midrange", "status"]
DIFFERENCES = ("delta", "speeds")

RPM = math.pi / 30.0

WIDE: dict[str, tuple[float, float]] = {
    "reciprocating_mass": (1.5, 11.5), "inertia": (0.5, 11.25), "crank_ratio": (0.07, 0.5),
    "speed": (500.0, 2500.0), "load": (0.0, 90.0), "cylinders": (1, 12),
}  # fmt: skip
"""Twice as wide as `benchmarks.studies.RANGES`, where the engine `ntua` has diagrams."""

STROKE = 0.18
"""Of the engine `ntua` [m]."""


def offset(size: int, seed: int) -> Scene:
    """The six, and an offset of pin or crank, of either sign, up to half the crank radius."""
    drawn = columns(size, WIDE, seed)
    random = np.random.default_rng([seed, 1])
    share = random.uniform(-0.5, 0.5, size)
    # With an offset the radius of a stroke is smaller: the largest offset has the smallest radius.
    radius = crank_radius_of_ratio(STROKE, drawn["crank_ratio"], 0.25 * STROKE)
    of_pin = random.uniform(size=size) < 0.5
    drawn["pin_offset"] = np.where(of_pin, share * radius, 0.0)
    drawn["crank_offset"] = np.where(of_pin, 0.0, share * radius)
    return scene(designs=drawn, set={"load_exponent": 1})


def stroke_friction(size: int, seed: int) -> Scene:
    """The six, and how friction is spread over the stroke."""
    drawn = columns(size, {**WIDE, **dict.fromkeys(STROKE_FRICTION, (0.0, 0.5))}, seed)
    whole = np.maximum(1.0, sum(drawn[name] for name in STROKE_FRICTION))
    for name in STROKE_FRICTION:
        drawn[name] = drawn[name] * (1.0 - 1e-12) / whole  # rounding must not exceed 1
    return scene(designs=drawn, set={"ring_pressure": 1.5})


class Kind(NamedTuple):
    """One kind of sampled study.

    `checkable` are the cylinders of the designs that the independent solver gets, at most: it
    follows the friction of every cylinder, and of twelve that would take it minutes.
    """

    name: str
    build: Callable[..., Scene]  # from a number of designs and a seed
    designs: int  # of `DESIGNS`
    checkable: int = 12


OF_V6 = {"inertia": (0.05, 0.825), "speed": (550.0, 8350.0), "load": (30.0, 100.0),
         "misfire": (0, 6)}  # fmt: skip

OF_CYCLE = {"combustion_start": (-45.0, -5.0), "compression_ratio": (7.5, 11.5),
            "heat": (5.0, 41.0)}  # fmt: skip

KINDS = (
    Kind("six parameters", partial(drawn, ranges=WIDE), 700_000),
    Kind("six and an offset of pin or crank, load exponent 1", offset, 700_000),
    Kind("V6: inertia, speed, load and misfire",
         partial(drawn, ranges=OF_V6, engine="v6_96x81"), 100_000),
    Kind("six and a load over angle",
         partial(angle_load, ranges={**WIDE, "load_table_factor": (0.0, 2.0)}), 150_000),
    Kind("six and friction over the stroke", stroke_friction, 450_000, 2),
    Kind("combustion start, compression ratio and heat",
         partial(drawn, ranges=OF_CYCLE, engine="si_four_87x101", set={"speed": 5200}), 10_000),
)  # fmt: skip


# Solving ------------------------------------------------------------------------------------------


def part_of(one: Scene, chosen: Any, *more: str) -> Scene:
    """Some designs of a scene, with more quantities."""
    quantities = [*one["output"]["quantities"], *more]
    designs = {name: column[chosen] for name, column in one["designs"].items()}
    return {**one, "designs": designs, "output": {"quantities": quantities}}


def solved(one: Scene, threads: int | None = None) -> dict[str, Any]:
    """Results of a scene as arrays."""
    found = sweeps.run(one, threads=threads)
    return {str(name): found[name].values for name in found.data_vars}


def solved_generally(one: Scene, threads: int) -> dict[str, Any]:
    """Results of a scene by the general solver with more nodes."""
    finer = partial(dispatch.solve, general=True, finer=FINER)
    with mock.patch.object(dispatch, "solve", finer):
        return solved(one, threads)


def seed_of(seed: int, kind: Kind, number: int) -> int:
    """Seed of a chunk."""
    return int(np.random.SeedSequence([seed, KINDS.index(kind), number]).generate_state(1)[0])


def chunk(kind: Kind, seed: int, number: int, size: int) -> Scene:
    """Scene of a chunk."""
    one = kind.build(size, seed=seed_of(seed, kind, number))
    return part_of(one, slice(None), "delta_midrange")


# Checks -------------------------------------------------------------------------------------------


def judged(found: dict[str, Any], other: dict[str, Any], speed: Any) -> tuple[Any, Any]:
    """Verdict of each design against the general solver, and relative differences.

    "border" is running or stalled by a hair, "gave up" status 3, "off" numbers beyond the
    tolerance.
    """
    status, true = found["status"], other["status"]
    runs, truly = (np.isfinite(each["delta"]) for each in (found, other))
    lowest = np.fmin(found["omega_min"], other["omega_min"]) / speed
    differs = differing(found, other)
    with np.errstate(invalid="ignore"):
        within = (differs["delta"] <= TOLERANCE) & (differs["speeds"] <= TOLERANCE)
        near = np.square(lowest) < BORDER
    stalls = ((status == STALLED) & truly) | (runs & (true == STALLED))
    verdict = np.select(
        [
            runs & truly & (within | (status == TOLERANCE_NOT_MET)),
            runs & truly,
            ~runs & (status == true),
            (status == NOT_CONVERGED) | (true == NOT_CONVERGED),
            stalls & near,
        ],
        ["agrees", "off", "agrees", "gave up", "border"],
        "outcome",
    )
    return verdict, differs


def add(result: Findings, kind: Kind, seed: int, number: int, size: int, threads: int) -> Any:
    """Solve and check one chunk; returns its scene and results."""
    one, name = chunk(kind, seed, number, size), kind.name
    random = np.random.default_rng([seed_of(seed, kind, number), 2])
    with counted() as tally:
        found = solved(one, threads)
    result.counts["deferred", name] += tally.deferred
    result.counts["solved", name] += tally.designs.total()
    speed, every = speed_of(one), np.arange(size)
    for code, n in Counter(found["status"].tolist()).items():
        result.counts["status", name, code] += n

    def note(what: str, more: str, mask: Any, index: Any = every, other: Any = None) -> None:
        """Count designs at `index` that have a defect, and keep some."""

        def tell(place: int) -> dict[str, Any]:
            at = int(index[place])
            told = {"chunk": number, "index": at, "inputs": inputs(one, at)}
            told["results"] = inputs({"designs": found}, at)
            return told if other is None else {**told, "other": inputs({"designs": other}, at)}

        result.mark(what, name, more, mask=mask, tell=tell)

    def note_again(other: dict[str, Any], chosen: Any, names: Iterable[str], when: str) -> None:
        """Count results whose bits are others when chosen designs are solved again."""
        for key, mask in unlike_bits(other, {n: found[n][chosen] for n in names}).items():
            note("bits", f"{key}{when}", mask, chosen)

    for rule, mask in check_answers({n: found[n] for n in RESULTS}).items():
        note("broken", rule, mask)
    reference = solved_generally(one, threads)
    verdict, differs = judged(found, reference, speed)
    for each in ("agrees", "border"):
        result.counts[each, name] += int((verdict == each).sum())
    for each in ("gave up", "off", "outcome"):
        note(each, "", verdict == each, other=reference)
    good = (found["status"] == CONVERGED) & np.isfinite(differs["delta"])
    for what in DIFFERENCES:
        result.note((name, what), float(np.max(differs[what][good], initial=0.0)))

    # Again in another order, in other company and by one thread.
    chosen = random.permutation(size)[:AGAIN]
    result.counts["again", name] += chosen.size
    note_again(solved(part_of(one, chosen), threads=1), chosen, found, "")

    # With `delta_error`: it is above the true error, and no bit differs.
    chosen = random.permutation(size)[: max(AGAIN, int(WITH_ERROR * size))]
    when = " with delta_error"
    other = solved(part_of(one, chosen, "delta_error"), threads)
    for rule, mask in check_answers({n: other[n] for n in (*RESULTS, "delta_error")}).items():
        note("broken", f"{rule}{when}", mask, chosen)
    note_again(other, chosen, [n for n in found if n != "status"], when)
    true = differs["delta"][chosen]
    with np.errstate(invalid="ignore"):
        covered, known = true <= other["delta_error"], np.isfinite(true)
    result.counts["estimated", name] += int(known.sum())
    note("above", "delta_error", known & ~covered, chosen)
    return one, found


def inputs(one: Scene, place: Any) -> dict[str, float]:
    """Values of one design."""
    return {name: np.asarray(column)[place].item() for name, column in one["designs"].items()}


def speed_of(one: Scene) -> Any:
    """Asked speed of the designs of a scene [rad/s]."""
    return RPM * one["designs"].get("speed", one.get("set", {}).get("speed"))


def compare(result: Findings, kind: Kind, one: Scene, found: dict[str, Any], most: int) -> None:
    """Solve some converged designs by the independent solver, one by one."""
    few = np.asarray(one["designs"].get("cylinders", 1)) <= kind.checkable
    dataset = xr.Dataset({name: ("design", found[name]) for name in SCALARS})
    for place in np.flatnonzero((found["status"] == CONVERGED) & few)[:most].tolist():
        against = differences(one, dataset, np.array([place]), 1)
        told: dict[str, Any] = {
            "delta": against.delta, "speeds": against.speeds, "inputs": inputs(one, place)
        }  # fmt: skip
        result.counts["independent", kind.name] += 1
        for what in DIFFERENCES:
            result.note((kind.name, "independent", what), told[what])
        wrong = not max(against.delta, against.speeds) <= TOLERANCE
        result.mark("off", kind.name, "independent", mask=[wrong], tell=lambda _, t=told: t)  # type: ignore[misc]


def uncovered(result: Findings, kind: Kind) -> int:
    """Designs whose true error is above `delta_error`, beyond the share that may be."""
    allowed = math.floor((1.0 - COVERED) * result.of("estimated", kind.name))
    return max(0, result.of("above", kind.name) - allowed)


def run(
    seed: int, designs: int, checked: int, threads: int, say: Say, kinds: Sequence[Kind] = KINDS
) -> Findings:
    """Draw, solve and check kinds of study, each with its share of so many designs.

    `checked` are the designs of each kind that the independent solver solves.
    """
    result = Findings()
    for kind in kinds:
        size = max(FEWEST, round(designs * kind.designs / DESIGNS))
        chunks = -(-size // CHUNK)
        for number in range(chunks):
            one, found = add(result, kind, seed, number, -(-size // chunks), threads)
            if number == 0:
                compare(result, kind, one, found, checked)
            say(f"sampled, {kind.name}: chunk {number + 1} of {chunks}, "
                f"{result.defects} defects so far")  # fmt: skip
        result.counts["uncovered", kind.name] = uncovered(result, kind)
    return result


# What is told -------------------------------------------------------------------------------------


def words(found: Findings) -> dict[str, str]:
    """Sentences with figures, by their names."""
    largest = max((v for k, v in found.worst.items() if k[1:] == ("delta",)), default=math.nan)
    return {
        "sampled": f"{count(found.of('status'))} designs of sampled studies by `sweeps.run`, all "
        f"solved again by the general solver: largest difference of δ {size(largest)}, "
        f"{count(found.defects)} defects.",
    }
