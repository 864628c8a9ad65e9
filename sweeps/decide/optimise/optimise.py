"""Search for the best designs of a scene under conditions: `sweeps.optimise`."""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from engine_dyn.plausibility.judgement import ImplausibleWarning
from engine_dyn.types import Booleans, Integers
from sweeps.base.checks import thread_count
from sweeps.base.dimensions import DESIGN, FOUND, FULFILLING
from sweeps.base.errors import SceneError, shown
from sweeps.base.fronts import front_of
from sweeps.decide.optimise import DESIGNS, GENERATIONS, RESTARTS
from sweeps.decide.optimise.evaluation import Designs, Judgement
from sweeps.decide.optimise.generations import first_positions, search_generations
from sweeps.decide.optimise.least_inertia import KEY, LeastInertia, least_inertia_of
from sweeps.decide.optimise.task import Task, read_task
from sweeps.running.archive.labels import flags
from sweeps.running.archive.warnings import ATTRIBUTE
from sweeps.running.compute.progress import progress_bar
from sweeps.scene.keywords import TablesButOutput, tables_in_signature
from sweeps.scene.model import Scene
from sweeps.scene.reading import given_scene
from sweeps.scene.sample import LARGEST

if TYPE_CHECKING:
    import xarray as xr

ATTRIBUTE_OF_SEARCH = "optimisation"
"""Attribute of the archive of a search: its task and its settings, as JSON."""


@tables_in_signature
def optimise(
    scene: str | Path | Mapping[str, Any] | None = None,
    *,
    least: str | Sequence[str] = (),
    most: str | Sequence[str] = (),
    within: str | Sequence[str] = (),
    over: str | Sequence[str] | Mapping[str, Any] | None = None,
    not_counted: str | Sequence[str] = (),
    number: int = DESIGNS,
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
    number : int
        Designs of a generation, 8 to 1 000 000.
    generations : int
        Generations of a search, with the first, which is a scrambled Sobol' sequence.
    restarts : int
        Number of searches, each from different first designs.
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
        would not fit into memory. Where pymoo or SciPy is missing (extra `optimise`).

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
    counts = {"number": (number, 8, 1_000_000), "generations": (generations, 1, 100_000),
              "restarts": (restarts, 1, 10_000), "seed": (seed, 0, (1 << 32) - 1)}  # fmt: skip
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
    if inverse is not None and not search.designs.all.fulfilling.any():
        # The inertia that delta needs is not enough for what has no number with it.
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
        self, task: Task, inverse: LeastInertia | None, number: int, generations: int,
        restarts: int, threads: int | None,
    ) -> None:  # fmt: skip
        self.task, self.inverse = task, inverse
        self.number, self.generations, self.restarts = number, generations, restarts
        self.space = task.space.without(KEY) if inverse is not None else task.space
        completed = None if inverse is None else inverse.completed
        self.designs = Designs(task, self.space, completed, threads)
        most = number * generations * restarts
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
            return
        seeds = np.random.SeedSequence(self.task.seed).generate_state(2 * self.restarts)
        with progress_bar(
            total=self.restarts * self.generations, unit=" generations",
            disable=not progress,
        ) as bar:  # fmt: skip
            for restart in range(self.restarts):
                seen: list[Integers] = []

                def judge(
                    positions: Any, generation: int, restart: int = restart,
                    seen: list[Integers] = seen,
                ) -> Judgement:  # fmt: skip
                    places = self.designs.at(positions, restart + 1, generation)
                    seen.append(np.unique(places))
                    bar.update(1)
                    return self.designs.all[places]

                start = first_positions(len(self.space), self.number, int(seeds[2 * restart]))
                search_generations(
                    judge, start, len(self.task.wanted), len(self.task.conditions) + 1,
                    self.generations, int(seeds[2 * restart + 1]),
                )  # fmt: skip
                self.seen.append(np.unique(np.concatenate(seen)))

    def _found(self, among: Integers) -> Integers:
        """Places of the best design, or of the front, of some designs."""
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
            "number": self.number,
            "generations": self.generations,
            "restarts": of_restarts,
            "seed": self.task.seed,
            "left_out": list(self.task.left_out),
            "seconds": round(seconds, 3),
            "computing": round(self.designs.computing, 3),
        }  # fmt: skip
        archive = self.designs.archive(seconds)
        attributes = flags(
            "whether the design is a result of the search: the best one, or one on the Pareto "
            "front",
            ("computed", "found"),
        )
        fulfils = flags("whether the design meets all conditions at every point", ("no", "yes"))
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
        """Ground of certainty: "inverse", "all" designs computed, "inertia" alone, or empty."""
        if self.inverse is None:
            return "all" if self.whole else ""
        if not len(self.space):
            return "inverse"
        return "inverse of all" if self.whole else "inertia"
