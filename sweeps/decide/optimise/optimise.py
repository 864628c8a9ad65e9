"""Search for the best designs of a scene under conditions: `sweeps.optimise`.

Where nothing else that the search is about changes with the inertia, the least inertia under a
limit of delta follows exactly: delta falls as the inertia grows, so it is the largest of those that
give this delta at each point (Kakaitsas, section 3.2.2; `engine_dyn.speed.required`). A heavier
design could then never be needed, nor better.

Where one number is searched for one quantity, designs evenly over its range are computed, then ever
finer ones beside the best: edges of conditions and jumps are found as surely as a minimum.

Otherwise generations of designs are made in the unit cube, each from the better ones of those
before. One quantity: differential evolution (R. Storn and K. Price 1997). Two: NSGA-II (K. Deb,
A. Pratap, S. Agarwal and T. Meyarivan 2002). Three and more: NSGA-III (K. Deb and H. Jain 2014).
All compare by the rules of Deb (2000): a design that fulfils the conditions is better than one that
does not, and of two that do not, the one that fails by less. The library is pymoo (J. Blank and K.
Deb 2020).
"""

from __future__ import annotations

import json
import math
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from engine_dyn.plausibility.judgement import ImplausibleWarning
from engine_dyn.quantities.graph import ALL_QUANTITIES
from engine_dyn.types import Booleans, Floats, Integers
from sweeps.base.arguments import thread_count
from sweeps.base.dimensions import DESIGN, FOUND, FULFILLING
from sweeps.base.errors import SceneError, shown
from sweeps.base.files.libraries import library
from sweeps.base.fronts import front_of
from sweeps.decide.optimise import ATTRIBUTE_OF_SEARCH, DESIGNS, EVENLY, GENERATIONS, RESTARTS
from sweeps.decide.optimise.evaluation import Designs, Judgement
from sweeps.decide.optimise.space import Space
from sweeps.decide.optimise.task import Task, plan_of_designs, read_task
from sweeps.running.archive.labels import flags
from sweeps.running.archive.warnings import ATTRIBUTE
from sweeps.running.compute.in_memory import compute
from sweeps.running.compute.progress import progress_bar
from sweeps.scene.distributions import Choice
from sweeps.scene.features import GIVEN_FEATURES
from sweeps.scene.keywords import TablesButOutput, tables_in_signature
from sweeps.scene.model import Scene
from sweeps.scene.plan.plan import Plan
from sweeps.scene.reading import given_scene
from sweeps.scene.sample import LARGEST

if TYPE_CHECKING:
    import xarray as xr


@tables_in_signature
def optimise(
    scene: str | Path | Mapping[str, Any] | None = None,
    *,
    least: str | Sequence[str] = (),
    most: str | Sequence[str] = (),
    within: str | Sequence[str] = (),
    over: str | Sequence[str] | Mapping[str, Any] | None = None,
    not_counted: str | Sequence[str] = (),
    number: int | None = None,
    generations: int = GENERATIONS,
    restarts: int = RESTARTS,
    seed: int = 1,
    progress: bool = False,
    threads: int | None = None,
    **tables: Unpack[TablesButOutput],
) -> xr.Dataset:
    """Search for the designs with the least, or most, of some quantities, under conditions.

    Where the least inertia under a limit of delta is wanted, and nothing else that is asked for
    changes with the inertia, it follows exactly. Otherwise generations of designs are computed,
    each made from the better ones of those before: what is found is the best of all that were
    computed, and nothing says that there is no better one.

    Parameters
    ----------
    scene : str, Path or dict, optional
        Path of a scene file, name of a built-in scene, or a dict of the same shape. The conditions
        hold at every value of its axes (loads, speeds), where the worst value of what is wanted
        counts. Curves among its quantities are left out.
    least, most : str or sequence of str
        Quantities and searched parameters; with several of them the Pareto front is found. Of a
        quantity with a value for each bearing the worst bearing counts.
    within : str or sequence of str
        Conditions such as "delta <= 1/200" or "main_journal_load_max <= 30 kN". Without a unit, a
        number is in the unit of archives, here N.
    over : str, sequence of str or dict, optional
        What may vary: "inertia = 0.2 to 5" (with "log" after it uniform in the logarithm),
        "cylinders = 4, 6, 8", "arrangement = in-line 6 | V6 60 split-pin"; keys of the scene's
        [sample]; or a dict of distributions as [sample] has them. All of [sample] if not given.
        Distributions favour what is probable under them in the first generation alone.
    not_counted : str or sequence of str
        Outcomes such as "no_steady_state" (of an engine at idle): points that have one of them are
        left out.
    number : int, optional
        Designs of a generation, 8 to 1 000 000; 1024 unless given. Where one number is searched
        for one quantity, designs of the first generation; 257 unless given.
    generations : int
        Generations of a search, with the first, which is a scrambled Sobol' sequence. That of one
        number ends earlier, when neighbours of the best differ by less than 1e-7 of the number.
    restarts : int
        Number of searches, each from different first designs; 1 where these are evenly spaced.
    seed : int
        Of the random numbers: the same seed gives the same archive, bit for bit, on one machine
        and with one version of the libraries.
    progress : bool
        Show a progress bar on the terminal.
    threads : int, optional
        As many as the machine has processors, unless given.
    **tables
        Tables of a scene as keywords; see `sweeps.read_scene`.

    Returns
    -------
    Dataset
        All designs that were computed, along `design`, with the parameters that were searched, what
        the scene asks for and what the search is about; `generation` and `restart` say when each
        was computed, `found` is 1 for the best one, or for those of the front, and
        `fulfilling` is 1 where the conditions hold. The attribute
        `optimisation` tells the search as JSON. `best`, `pareto` and figures take it as any
        archive.

    Raises
    ------
    SceneError
        In one line, before anything is computed: for quantities that are not computed or are
        curves, for ranges that a key does not allow, where nothing varies, and where the designs
        would not fit into memory. Where pymoo or SciPy is needed and missing (extra `optimise`).
        After the first generation, where a torque is held that none of its designs reaches.

    Warns
    -----
    engine_dyn.ImplausibleWarning
        As `sweeps.run`.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.optimise(
    ...     engine="ntua",
    ...     least="inertia",
    ...     within="delta <= 1/50",
    ...     over="inertia = 1 to 20",
    ...     number=16,
    ...     generations=8,
    ... )
    >>> best = archive.isel(design=archive.found.values == 1)
    >>> bool((best.delta <= 1 / 50).all())
    True
    """
    if isinstance(scene, Scene):
        raise SceneError("scene: a Scene is not accepted here; must be a path, a name or a dict")
    counts = {"number": (DESIGNS if number is None else number, 8, 1_000_000),
              "generations": (generations, 1, 100_000), "restarts": (restarts, 1, 10_000),
              "seed": (seed, 0, (1 << 32) - 1)}  # fmt: skip
    for key, (value, low, high) in counts.items():
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise SceneError(
                f"optimise: {key} = {shown(value)}: must be a whole number from {low} to {high}"
            )
    threads = thread_count(threads)
    task = read_task(given_scene(scene, **tables), over, least, most, within, not_counted, seed)
    began = time.perf_counter()
    inverse = least_inertia_of(task, threads)
    search = _Search(task, inverse, number, generations, restarts, threads)
    search.run(progress)
    judged = search.designs.all
    if inverse is not None and not judged.fulfilling.any() and inverse.more_may_help(judged):
        # The least inertia may leave some points of the axes without results, so that no design
        # meets the conditions. Then the inertia is searched as any other parameter.
        inverse = None
        search = _Search(task, None, number, generations, restarts, threads)
        search.run(progress)
    archive = search.archive(time.perf_counter() - began)
    for line in archive.attrs[ATTRIBUTE].splitlines():
        warnings.warn(line, ImplausibleWarning, stacklevel=2)
    return archive


class _Search:
    """One search: where it looks, and what it has found."""

    def __init__(
        self, task: Task, inverse: LeastInertia | None, number: int | None, generations: int,
        restarts: int, threads: int | None,
    ) -> None:  # fmt: skip
        self.task, self.inverse = task, inverse
        self.space = task.space.without("inertia") if inverse is not None else task.space
        laws = [*self.space.parameters.values()]
        self.line = len(laws) == len(task.wanted) == 1 and not isinstance(laws[0], Choice)
        self.number = number or (EVENLY if self.line else DESIGNS)
        self.generations, self.restarts = generations, 1 if self.line else restarts
        completed = None if inverse is None else inverse.completed
        self.designs = Designs(task, self.space, completed, threads)
        most = self.number * generations * restarts
        self.whole = self.space.count is not None and self.space.count <= most
        asked = self.space.count if self.whole and self.space.count else most
        if asked > LARGEST:
            raise SceneError(
                f"optimise: number x generations x restarts = {most}: must be at most {LARGEST} "
                "designs"
            )
        self.designs.check_memory(asked)
        self.seen: list[Integers] = []

    def run(self, progress: bool) -> None:
        """Compute the designs."""
        if self.whole:
            places = [
                self.designs.at(part, 1, 1)
                for part in np.array_split(
                    self.space.all_positions(), -(-(self.space.count or 1) // self.number)
                )
            ]
            self.seen = [np.unique(np.concatenate(places))]
            self.designs.check_hold()
            return
        seeds = np.random.SeedSequence(self.task.seed).generate_state(2 * self.restarts)
        with progress_bar(
            total=None if self.line else self.restarts * self.generations, unit=" generations",
            disable=not progress,
        ) as bar:  # fmt: skip
            for restart in range(self.restarts):
                seen: list[Integers] = []

                def judge(
                    positions: Any, generation: int, restart: int = restart,
                    seen: list[Integers] = seen,
                ) -> Judgement:  # fmt: skip
                    places = self.designs.at(positions, restart + 1, generation)
                    if len(self.designs) == len(np.unique(places)):  # The first generation
                        self.designs.check_hold()
                    seen.append(np.unique(places))
                    bar.update(1)
                    return self.designs.all[places]

                if self.line:
                    search_line(judge, self.space, self.number, self.generations)
                else:
                    start = first_positions(len(self.space), self.number, int(seeds[2 * restart]))
                    search_generations(
                        judge, start, len(self.task.wanted), len(self.task.conditions) + 1,
                        self.generations, int(seeds[2 * restart + 1]),
                    )  # fmt: skip
                self.seen.append(np.unique(np.concatenate(seen)))

    def _found(self, among: Integers) -> Integers:
        """Places, among some designs, of the best one or of those on the front."""
        judged = self.designs.all
        fulfilling = among[judged.fulfilling[among]]
        values = judged.wanted[fulfilling]
        if not fulfilling.size:
            return fulfilling
        if values.shape[1] == 1:
            return fulfilling[[int(np.argmin(values[:, 0]))]]
        return np.sort(fulfilling[front_of(*values.T)])

    def archive(self, seconds: float) -> xr.Dataset:
        """All designs, and what the search was."""
        import xarray as xr

        judged, points = self.designs.all, self.designs.points
        places = self._found(np.arange(len(self.designs)))
        chosen: Booleans = np.zeros(len(self.designs), dtype=np.int8)
        chosen[places] = 1
        signs = [sign for _, sign in self.task.wanted]
        of_restarts = []
        for seen in self.seen:
            own = self._found(seen)
            best = judged.wanted[own].min(axis=0) if own.size else None
            of_restarts.append({
                "fulfilling": int(judged.fulfilling[seen].sum()),
                "found": int(own.size),
                "of_the_found": int(chosen[seen].sum()),
                "best": None if best is None else [s * float(v) for s, v in
                                                   zip(signs, best, strict=True)],
            })  # fmt: skip
        about = {
            "least": [n for n, sign in self.task.wanted if sign > 0.0],
            "most": [n for n, sign in self.task.wanted if sign < 0.0],
            "within": [str(c) for c in self.task.conditions],
            "over": self.task.space.tables,
            "at_every": list(self.task.points),
            "not_counted": list(self.task.not_counted),
            "exact": self._exact,
            "designs": len(self.designs),
            "points": points,
            "fulfilling": int(judged.fulfilling.sum()),
            "alone": [int((judged.violation[:, i] <= 0.0).sum())
                      for i in range(len(self.task.conditions))],
            "lacking": int((judged.violation[:, -1] > 0.0).sum()),
            "line": self.line and not self.whole,
            "number": self.number,
            "generations": self.generations,
            "restarts": of_restarts,
            "seed": self.task.seed,
            "needed": None if self.inverse is None else self.inverse.needed,
            "left_out": list(self.task.left_out),
            "seconds": round(seconds, 3),
            "computing": round(self.designs.computing, 3),
        }  # fmt: skip
        archive = self.designs.archive(seconds)
        attributes = flags(
            FOUND,
            "whether the design is a result of the search: the best one, or one on the Pareto "
            "front",
            ("computed", "found"),
        )
        fulfils = flags(
            FULFILLING, "whether the design meets all conditions at every point", ("no", "yes")
        )
        archive = archive.assign_coords(
            {
                FOUND: xr.Variable((DESIGN,), chosen, attributes),
                FULFILLING: xr.Variable((DESIGN,), judged.fulfilling.astype(np.int8), fulfils),
            }
        )
        archive.attrs[ATTRIBUTE_OF_SEARCH] = json.dumps(about, ensure_ascii=False)
        return archive

    @property
    def _exact(self) -> str:
        """Why the result is certain: "inverse", "all" designs computed, "inertia" alone, or ""."""
        if self.inverse is None:
            return "all" if self.whole else ""
        if not len(self.space):
            return "inverse"
        return "inverse of all" if self.whole else "inertia"


# Designs on either side of the best ones, how many of these, and the least relative difference
BESIDE, BEST, CLOSE = 15, 3, 1e-7


def search_line(
    judge: Callable[[Floats, int], Judgement], space: Space, number: int, generations: int
) -> None:
    """Search one number: evenly over its range, then ever finer beside the best designs.

    Each generation divides both neighbouring intervals of the best three designs that are better
    than their neighbours: several minima, jumps and edges of conditions. A minimum narrower than
    two of the first intervals may be missed. `judge` is that of `search_generations`.
    """
    at, scores = np.empty(0), np.empty((3, 0))
    new = np.linspace(0.0, 1.0, number)
    for generation in range(1, generations + 1):
        judged = judge(new[:, None], generation)
        fails = np.maximum(judged.violation, 0.0).sum(axis=1)
        scored = np.array([judged.wanted[:, 0], fails, ~judged.fulfilling])
        order = np.argsort(np.concatenate([at, new]), kind="stable")
        at = np.concatenate([at, new])[order]
        scores = np.concatenate([scores, scored], axis=1)[:, order]
        rank = np.empty(at.size, dtype=np.int64)
        rank[np.lexsort(scores)] = np.arange(at.size)
        around = np.pad(rank, 1, constant_values=at.size)
        better = np.flatnonzero((rank < around[:-2]) & (rank < around[2:]))
        best = better[np.argsort(rank[better])[:BEST]]
        (values,) = space.columns(at[:, None]).values()
        apart = np.abs(np.diff(values)) > CLOSE * np.maximum(*np.abs([values[1:], values[:-1]]))
        apart &= np.diff(at) > 1e-14
        sides = [i for i in sorted({*(best - 1), *best}) if 0 <= i < apart.size and apart[i]]
        if not sides:
            return
        new = np.concatenate([np.linspace(at[i], at[i + 1], BESIDE + 2)[1:-1] for i in sides])


def first_positions(parameters: int, designs: int, seed: int) -> Floats:
    """Positions of the first generation: the first points of a scrambled Sobol' sequence."""
    qmc = library("scipy.stats.qmc", "SciPy", "optimise", extra="optimise")
    sequence = qmc.Sobol(parameters, scramble=True, rng=seed)
    return np.asarray(sequence.random_base2(max(1, math.ceil(math.log2(designs))))[:designs])


def search_generations(
    judge: Callable[[Floats, int], Judgement], start: Floats, names: int, conditions: int,
    generations: int, seed: int,
) -> None:  # fmt: skip
    """Search from some first designs on, positions in the unit cube of shape (designs, parameters).

    `judge` takes such positions and the number of the generation from 1, and returns what is known
    of these designs: `names` quantities of which less is wanted, and violations of `conditions`.
    The first generation is one of the `generations`.
    """
    problem_of = _pymoo("core.problem").Problem
    static = _pymoo("problems.static").StaticProblem
    evaluator = _pymoo("core.evaluator").Evaluator
    problem = problem_of(n_var=start.shape[1], n_obj=names, n_ieq_constr=conditions, xl=0.0, xu=1.0)
    algorithm = _algorithm(start, names)
    algorithm.setup(problem, termination=("n_gen", generations), seed=seed, verbose=False)
    number = 0
    while algorithm.has_next():
        number += 1
        designs = algorithm.ask()
        judgement = judge(np.clip(designs.get("X"), 0.0, 1.0), number)
        evaluator().eval(static(problem, F=judgement.wanted, G=judgement.violation), designs)
        algorithm.tell(infills=designs)


def _pymoo(module: str) -> Any:
    return library(f"pymoo.{module}", "pymoo", "optimise", extra="optimise")


def _algorithm(start: Floats, names: int) -> Any:
    settings: dict[str, Any] = {"pop_size": len(start), "sampling": start}
    if names == 1:
        return _pymoo("algorithms.soo.nonconvex.de").DE(**settings)
    # pymoo would compare all designs with all; equal ones are computed only once anyway.
    settings["eliminate_duplicates"] = False
    if names == 2:
        return _pymoo("algorithms.moo.nsga2").NSGA2(**settings)
    directions = _pymoo("util.ref_dirs")
    spread = directions.get_reference_directions(
        "das-dennis", names, n_partitions=_partitions(names, len(start))
    )
    return _pymoo("algorithms.moo.nsga3").NSGA3(spread, **settings)


def _partitions(names: int, designs: int) -> int:
    """Parts of each edge of the simplex, so that there are at most as many directions as designs.

    Source: I. Das and J. E. Dennis (1998), whose points are C(names + parts - 1, parts).
    """
    parts = 1
    while math.comb(names + parts, parts + 1) <= designs:
        parts += 1
    return parts


@dataclass(eq=False)
class LeastInertia:
    """Designs of all other parameters, each with the least inertia that meets the wanted delta."""

    task: Task  # Search that asks for designs
    limit: float  # Largest delta that all conditions on delta allow
    threads: int | None  # Number of threads that the kernels use
    # Of the designs so far that need more inertia than its range allows, the one that needs least:
    # its inertia, the end of the range, and its point that decides, as places along the axes.
    needed: dict[str, Any] | None = None

    def completed(self, columns: Mapping[str, Any]) -> dict[str, Any]:
        """Columns of all parameters: those given, and the inertia."""
        count = len(next(iter(columns.values()))) if columns else 1
        plan = self.plan(columns, count)
        results = compute(plan, threads=self.threads)
        dims = plan.dims("inertia_required")
        inertia = results["inertia_required"]
        if DESIGN in dims:
            inertia = np.moveaxis(inertia, dims.index(DESIGN), 0)
        points = inertia.reshape(count if DESIGN in dims else 1, -1)
        # A point has no least inertia (NaN) where every inertia meets the wanted delta, or none.
        # `fmax` skips such points; a design without any other point gets the lower bound.
        largest = np.fmax.reduce(points, axis=-1, initial=-np.inf)
        low, high = self.range
        self._note(points, largest, [d for d in dims if d != DESIGN], plan.sizes)
        least = np.clip(np.broadcast_to(largest, count), low, high)
        return {
            key: np.array(least, dtype=np.float64) if key == "inertia" else columns[key]
            for key in self.task.space.parameters
        }

    @property
    def range(self) -> tuple[float, float]:
        """The least and the largest inertia that is searched."""
        law: Any = self.task.space.parameters["inertia"]
        return float(law.low), float(law.high)

    def _note(
        self, points: Floats, largest: Floats, dims: Sequence[str], sizes: Mapping[str, int]
    ) -> None:
        """Keep the design that needs least of those that need more than the range allows."""
        high = self.range[1]
        beyond = np.where(largest > high, largest, np.inf)
        least = int(np.argmin(beyond))
        known = math.inf if self.needed is None else self.needed["inertia"]
        if beyond[least] >= known:
            return
        deciding = int(np.nanargmax(points[least]))
        at = np.unravel_index(deciding, [sizes[d] for d in dims]) if dims else ()
        self.needed = {
            "inertia": float(beyond[least]), "most": high,
            "at": {d: int(i) for d, i in zip(dims, at, strict=True)},
        }  # fmt: skip

    def more_may_help(self, judged: Judgement) -> bool:
        """Whether a design may meet the conditions with more inertia: where results are missing."""
        delta = [i for i, c in enumerate(self.task.conditions) if c.name == "delta" and c.above]
        return bool(((judged.violation[:, delta] <= 0.0).all(axis=1)
                     & (judged.violation[:, -1] > 0.0)).any())  # fmt: skip

    def plan(self, columns: Mapping[str, Any], count: int) -> Plan:
        """Plan of the inertia that some designs of all other parameters need."""
        task = self.task
        # The delta at the computed inertia misses the wanted delta by at most a tenth of the
        # tolerance, so that an aim below the limit by the tolerance keeps delta within the limit.
        aim = self.limit * (1.0 - self.tolerance)
        settings = {**(task.given.raw.get("set") or {}), "wanted_delta": aim}
        return plan_of_designs(
            task.given, task.space.without("inertia"), columns, count, task.seed, task.files,
            set=settings, output={"quantities": ["inertia_required"]},
        )  # fmt: skip

    @property
    def tolerance(self) -> float:
        """Relative error of delta that the scene aims at."""
        solver = self.task.given.raw.get("solver") or {}
        return float(solver.get("tolerance", 1e-6))


def least_inertia_of(task: Task, threads: int | None) -> LeastInertia | None:
    """The exact inverse, where a task has one; None where the inertia must be searched."""
    law = task.space.parameters.get("inertia")
    limits = [c.limit for c in task.conditions if c.name == "delta" and c.above]
    if ("inertia", 1.0) not in task.wanted or law is None or isinstance(law, Choice) or not limits:
        return None
    inertia_alone = [c for c in task.conditions if c.name == "inertia"]
    if min(limits) <= 0.0 or inertia_alone or not hasattr(law, "low"):
        return None
    names = [n for n, _ in task.wanted if n != "inertia"]
    names += [c.name for c in task.conditions if not (c.name == "delta" and c.above)]
    inverse = LeastInertia(task, min(limits), threads)
    few = task.space.without("inertia").one_of_each()
    try:
        if any(_changes_with_inertia(task, name) for name in names if name in ALL_QUANTITIES):
            return None
        plan = inverse.plan(task.space.without("inertia").columns(few), len(few))
    except SceneError:  # The scene varies the inertia, or its method cannot compute one for a delta
        return None
    # The computed inertia includes the inertia of parts with keys of their own; `inertia` does not.
    parts = (one for one in GIVEN_FEATURES.values() if one.feature.adds)
    return None if any(one.part_of(plan.scene) is not None for one in parts) else inverse


def _changes_with_inertia(task: Task, name: str) -> bool:
    """Whether a quantity depends on the inertia: then the inertia is one of its dimensions."""
    space = task.space.without("inertia")
    law: Any = task.space.parameters["inertia"]
    few = space.one_of_each()
    axes = {**(task.given.raw.get("axes") or {}), "inertia": [law.low, law.high]}
    plan = plan_of_designs(
        task.given, space, space.columns(few), len(few), task.seed, task.files,
        axes=axes, output={"quantities": [name]},
    )  # fmt: skip
    return "inertia" in plan.dims(name)
