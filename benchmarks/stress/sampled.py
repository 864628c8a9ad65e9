"""Sampled studies as people run them, over wider ranges: rules, bits, and error of the solver.

`sweeps.run` solves them, so that loads, offsets, misfires and modelled cycles pass through the
graph of quantities. What the batch solver adds to the error is seen in all designs, which the
general solver solves again with twice the nodes. How far that is from the true
solution is seen in a few dozen of each kind, which an independent solver solves.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import partial
from typing import Any
from unittest import mock

import numpy as np
import xarray as xr

import sweeps
from benchmarks.stress.checks import ROUNDING, check_answers
from benchmarks.stress.chunks import unlike_bits
from benchmarks.stress.sample import BORDER, TOLERANCE
from benchmarks.studies import SCALARS, STROKE_FRICTION, Scene, angle_load, columns, scene
from benchmarks.studies import sampled as drawn
from benchmarks.study_errors import differences
from benchmarks.workers import in_processes
from engine_dyn.geometry.slider_crank import crank_radius_of_ratio
from engine_dyn.speed import dispatch
from engine_dyn.speed.mechanisms import counted
from engine_dyn.status import CONVERGED, NO_STEADY_STATE, NOT_CONVERGED, STALLED, TOLERANCE_NOT_MET
from engine_dyn.types import Booleans, Floats
from oracle.solution import IDLE

__all__ = ["DESIGNS", "KINDS", "Found", "Kind", "run"]

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
SPEEDS = tuple(name for name in SCALARS if name != "delta")

SHOWN = 5
"""Designs with a defect that are kept, of each sort and chunk."""

RPM = math.pi / 30.0

WIDE: dict[str, tuple[float, float]] = {
    "reciprocating_mass": (1.5, 11.5), "inertia": (0.5, 11.25), "crank_ratio": (0.07, 0.5),
    "speed": (500.0, 2500.0), "load": (0.0, 90.0), "cylinders": (1, 12),
}  # fmt: skip
"""Twice as wide as `benchmarks.studies.RANGES`, where the engine `ntua` has diagrams."""

STROKE = 0.18
"""Of the engine `ntua` [m]."""

MEAN_OF_PUMP = 30.0
"""Mean torque of `benchmarks.studies.pump_torque` [N m]."""


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


@dataclass(frozen=True)
class Kind:
    """One kind of sampled study.

    Attributes
    ----------
    name, words : str
        Short name, and what the table says.
    build : callable
        From a number of designs and a seed to a scene.
    designs : int
        Of `DESIGNS`.
    checkable : int
        Cylinders of the designs that the independent solver gets, at most: it follows the friction
        of every cylinder, and of twelve that would take it minutes.
    """

    name: str
    words: str
    build: Callable[..., Scene]
    designs: int
    checkable: int = 12


OF_V6 = {"inertia": (0.05, 0.825), "speed": (550.0, 8350.0), "load": (30.0, 100.0),
         "misfire": (0, 6)}  # fmt: skip

OF_CYCLE = {"combustion_start": (-45.0, -5.0), "compression_ratio": (7.5, 11.5),
            "heat": (5.0, 41.0)}  # fmt: skip

KINDS = (
    Kind("six", "six parameters", partial(drawn, ranges=WIDE), 700_000),
    Kind("offset", "six and an offset of pin or crank, load exponent 1", offset, 700_000),
    Kind("misfire", "V6: inertia, speed, load and misfire",
         partial(drawn, ranges=OF_V6, engine="v6_96x81"), 100_000),
    Kind("angle_load", "six and a load over angle",
         partial(angle_load, ranges={**WIDE, "load_table_factor": (0.0, 2.0)}), 150_000),
    Kind("stroke_friction", "six and friction over the stroke", stroke_friction, 450_000, 2),
    Kind("modelled", "combustion start, compression ratio and heat",
         partial(drawn, ranges=OF_CYCLE, engine="si_four_87x101", set={"speed": 5200}), 10_000),
)  # fmt: skip


@dataclass
class Found:
    """What one kind gave.

    Attributes
    ----------
    kind : Kind
    status, broken, unlike : Counter
        Designs by status, by the rule that they break, by the result whose bits differ.
    compared : int
        Designs that were solved again for their bits.
    verdicts : Counter
        Designs by how they agree with the general solver: "agrees", "border" (running or stalled
        by a hair), "gave up" (status 3), "off" (numbers beyond the tolerance), "outcome".
    delta, speeds : list of ndarray
        Relative differences from the general solver; of the three speeds, the largest.
    worst : dict
        By "delta" and "speeds": the largest difference, and the parameters of its design.
    covered, estimated : int
        Designs whose `delta_error` is above the true error, and those for which it was asked.
    deferred, solved : int
        Designs that were left to the general solver, and all that were solved.
    exact_delta, exact_speeds : float
        Largest relative differences from the independent solver.
    exact : int
        Designs that it solved.
    examples : list of dict
        Parameters and results of designs with a defect.
    """

    kind: Kind
    status: Counter[int] = field(default_factory=Counter)
    broken: Counter[str] = field(default_factory=Counter)
    unlike: Counter[str] = field(default_factory=Counter)
    compared: int = 0
    verdicts: Counter[str] = field(default_factory=Counter)
    delta: list[Floats] = field(default_factory=list)
    speeds: list[Floats] = field(default_factory=list)
    worst: dict[str, tuple[float, dict[str, float]]] = field(default_factory=dict)
    covered: int = 0
    estimated: int = 0
    deferred: int = 0
    solved: int = 0
    exact_delta: float = 0.0
    exact_speeds: float = 0.0
    exact: int = 0
    wrong: int = 0
    """Designs beyond the tolerance of the independent solver."""

    examples: list[dict[str, Any]] = field(default_factory=list)

    @property
    def uncovered(self) -> int:
        """Designs whose true error is above `delta_error`, beyond the share that may be."""
        allowed = math.floor((1.0 - COVERED) * self.estimated)
        return max(0, self.estimated - self.covered - allowed)

    @property
    def defects(self) -> int:
        """Designs and bits that should not be."""
        off = self.verdicts["off"] + self.verdicts["outcome"]
        return self.broken.total() + self.unlike.total() + off + self.uncovered + self.wrong

    def differences(self, name: str) -> tuple[float, float, float]:
        """Largest, 99.9 % and median difference from the general solver of "delta" or "speeds"."""
        parts = getattr(self, name)
        every = np.concatenate(parts) if parts else np.zeros(0)
        if not every.size:
            return math.nan, math.nan, math.nan
        return float(every.max()), float(np.quantile(every, 0.999)), float(np.median(every))


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
    return part_of(one, slice(None), "delta_midrange", "torque_mean")


# Checks -------------------------------------------------------------------------------------------


def target(speed: Any, exponent: float, found: dict[str, Any]) -> Booleans:
    """Designs whose mean speed does not suit the closure "power_mean", constant load exponent.

    The mean of omega^alpha, or of log omega where alpha is 0, is that of the asked speed. Between
    the mean of a function and its value at the mean lies at most half its largest second derivative
    times the variance, and this is at most (max - mean)(mean - min) (Bhatia and Davis, 2000).
    """
    high, low, mean = (found[name] / speed for name in ("omega_max", "omega_min", "omega_mean"))
    with np.errstate(invalid="ignore", divide="ignore"):
        if exponent == 0.0:
            value, bent = np.log(mean), -1.0 / np.square(low)
        else:
            value = np.power(mean, exponent) - 1.0
            factor = exponent * (exponent - 1.0)
            ends = [np.power(end, exponent - 2.0) for end in (low, high)]
            bent = factor * np.maximum(*ends)
        most = 0.5 * bent * (high - mean) * (mean - low)
        slack = ROUNDING + TOLERANCE * found["delta"]
        fits = (-value >= np.minimum(most, 0.0) - slack) & (-value <= np.maximum(most, 0.0) + slack)
    return np.isfinite(found["omega_mean"]) & ~fits


def idle(one: Scene, found: dict[str, Any]) -> Booleans:
    """Designs with status 2 though the mean torque exceeds the load's constant part, or without."""
    factor = one["designs"].get("load_table_factor", 0.0)
    constant = MEAN_OF_PUMP * factor
    surplus = found["torque_mean"] - constant
    # Rounding decides about less; the torque's range is some hundred times the mean torques.
    clear = np.abs(surplus) > 100.0 * IDLE * (np.abs(found["torque_mean"]) + constant + 100.0)
    return clear & ((found["status"] == NO_STEADY_STATE) != (surplus < 0.0))


def rules(one: Scene, found: dict[str, Any], speed: Any) -> dict[str, Booleans]:
    """Masks of designs that break a rule."""
    broken = check_answers({name: found[name] for name in RESULTS})
    exponent = float(one.get("set", {}).get("load_exponent", 2.0))
    broken["target"] = target(speed, exponent, found)
    broken["idle"] = idle(one, found)
    return broken


def differing(found: dict[str, Any], other: dict[str, Any]) -> tuple[Floats, Floats]:
    """Relative differences of delta, and of the three speeds the largest."""
    with np.errstate(invalid="ignore", divide="ignore"):
        of = {name: np.abs(found[name] / other[name] - 1.0) for name in SCALARS}
    return of["delta"], np.max([of[name] for name in SPEEDS], axis=0)


def judged(
    found: dict[str, Any], other: dict[str, Any], speed: Any, delta: Floats, speeds: Floats
) -> Any:
    """Verdict on each design, see `Found`."""
    status, true = found["status"], other["status"]
    runs, truly = (np.isfinite(each["delta"]) for each in (found, other))
    lowest = np.fmin(found["omega_min"], other["omega_min"]) / speed
    with np.errstate(invalid="ignore"):
        within = (delta <= TOLERANCE) & (speeds <= TOLERANCE)
        near = np.square(lowest) < BORDER
    stalls = ((status == STALLED) & truly) | (runs & (true == STALLED))
    return np.select(
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


def add(result: Found, seed: int, number: int, size: int, threads: int) -> tuple[Scene, Any]:
    """Solve and check one chunk; returns its scene and results."""
    one = chunk(result.kind, seed, number, size)
    random = np.random.default_rng([seed_of(seed, result.kind, number), 2])
    with counted() as tally:
        found = solved(one, threads)
    result.deferred += tally.deferred
    result.solved += tally.designs.total()
    speed, every = speed_of(one), np.arange(size)
    result.status.update(found["status"].tolist())

    def note(
        counts: Counter[str], what: str, mask: Booleans, index: Any, other: Any = None
    ) -> None:
        """Count designs at `index` that have a defect, and keep some."""
        counts[what] += int(mask.sum())
        answers = {"results": found} | ({} if other is None else {"other": other})
        for place in index[mask][:SHOWN].tolist():
            told = {name: inputs({"designs": each}, place) for name, each in answers.items()}
            result.examples.append({
                "kind": result.kind.name, "defect": what, "chunk": number, "index": place,
                "inputs": inputs(one, place), **told,
            })  # fmt: skip

    def note_again(other: dict[str, Any], chosen: Any, names: Iterable[str], when: str) -> None:
        """Count results whose bits are others when chosen designs are solved again."""
        for name, mask in unlike_bits(other, {n: found[n][chosen] for n in names}).items():
            note(result.unlike, f"bits of {name}{when}", mask, chosen)

    for name, mask in rules(one, found, speed).items():
        note(result.broken, f"rule {name}", mask, every)
    reference = solved_generally(one, threads)
    delta, speeds = differing(found, reference)
    verdict = judged(found, reference, speed, delta, speeds)
    result.verdicts.update(verdict.tolist())
    for name in ("off", "outcome", "gave up"):
        note(Counter(), name, verdict == name, every, reference)
    good = (found["status"] == CONVERGED) & np.isfinite(delta)
    for name, values in (("delta", delta), ("speeds", speeds)):
        getattr(result, name).append(values[good])
        place = int(np.argmax(np.where(good, values, -1.0)))
        if good.any() and values[place] > result.worst.get(name, (-1.0, {}))[0]:
            result.worst[name] = float(values[place]), inputs(one, place)

    # Again in another order, in other company and by one thread.
    chosen = random.permutation(size)[:AGAIN]
    result.compared += chosen.size
    note_again(solved(part_of(one, chosen), threads=1), chosen, found, "")

    # With `delta_error`: it is above the true error, and no bit differs.
    chosen, when = (
        random.permutation(size)[: max(AGAIN, int(WITH_ERROR * size))],
        " with delta_error",
    )
    other = solved(part_of(one, chosen, "delta_error"), threads)
    for name, mask in check_answers({n: other[n] for n in (*RESULTS, "delta_error")}).items():
        note(result.broken, f"rule {name}{when}", mask, chosen)
    note_again(other, chosen, [name for name in found if name != "status"], when)
    with np.errstate(invalid="ignore"):
        covered, known = delta[chosen] <= other["delta_error"], np.isfinite(delta[chosen])
    result.estimated += int(known.sum())
    result.covered += int((known & covered).sum())
    note(Counter(), "delta_error", known & ~covered, chosen)
    return one, found


def inputs(one: Scene, place: Any) -> dict[str, float]:
    """Values of one design."""
    return {name: np.asarray(column)[place].item() for name, column in one["designs"].items()}


def speed_of(one: Scene) -> Any:
    """Asked speed of the designs of a scene [rad/s]."""
    return RPM * one["designs"].get("speed", one.get("set", {}).get("speed"))


# The independent solver ---------------------------------------------------------------------------


def exactly(job: tuple[Scene, Any]) -> tuple[float, float]:
    """Differences of one design from the independent solver, of delta and of the speeds."""
    one, found = job
    against = differences(one, found, np.zeros(1, dtype=np.int64), 1)
    return against.delta, against.speeds


def jobs_of(
    one: Scene, found: dict[str, Any], count: int, checkable: int = 12
) -> list[tuple[Scene, Any]]:
    """Jobs of some converged designs of a scene, with so many cylinders at most."""
    few = np.asarray(one["designs"].get("cylinders", 1)) <= checkable
    places = np.flatnonzero((found["status"] == CONVERGED) & few)[:count]
    return [
        (
            part_of(one, slice(place, place + 1)),
            xr.Dataset({name: ("design", found[name][place : place + 1]) for name in SCALARS}),
        )
        for place in places.tolist()
    ]


def compare(
    result: Found, jobs: list[tuple[Scene, Any]], answers: list[tuple[float, float]]
) -> None:
    """Add the differences from the independent solver."""
    for (one, _), (delta, speeds) in zip(jobs, answers, strict=True):
        result.exact += 1
        result.exact_delta = max(result.exact_delta, delta)
        result.exact_speeds = max(result.exact_speeds, speeds)
        if not max(delta, speeds) <= TOLERANCE:
            result.wrong += 1
            result.examples.append(
                {"kind": result.kind.name, "defect": "independent solver", "delta": delta,
                 "speeds": speeds, "inputs": inputs(one, 0)}
            )  # fmt: skip


def run(
    seed: int, designs: int, checked: int, processes: int, say: Callable[[str], None],
    kinds: tuple[Kind, ...] = KINDS,
) -> list[Found]:  # fmt: skip
    """Draw, solve and check every kind of study.

    Parameters
    ----------
    seed : int
    designs : int
        Of all kinds together; each has its share.
    checked : int
        Designs of each kind that the independent solver solves, in processes of their own.
    processes : int
        Of these, and threads of the others.
    say : callable
        Told what goes on.
    kinds : tuple of Kind
        Which.
    """
    every, jobs = [], []
    for kind in kinds:
        result = Found(kind)
        size = max(FEWEST, round(designs * kind.designs / DESIGNS))
        count = -(-size // CHUNK)
        for number in range(count):
            one, found = add(result, seed, number, -(-size // count), processes)
            if number == 0:
                jobs.append(jobs_of(one, found, checked, kind.checkable))
            largest = result.differences("delta")[0]
            say(f"sampled, {kind.name}: chunk {number + 1} of {count}, delta within "
                f"{largest:.1e}, {result.defects} defects")  # fmt: skip
        every.append(result)
    for result, of_kind in zip(every, jobs, strict=True):
        if of_kind:
            compare(result, of_kind, list(in_processes(exactly, of_kind, processes)))
            say(f"sampled, {result.kind.name}: {result.exact} by the independent solver, "
                f"{result.wrong} disagree")  # fmt: skip
    return every
