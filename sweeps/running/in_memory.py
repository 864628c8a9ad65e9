"""Run a plan: stages in order, arrays without names in, arrays without names out."""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import numpy.typing as npt

from engine_dyn.plausibility.judgement import ImplausibleWarning
from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.quantities.graph import DIMENSIONS
from sweeps.checks import thread_count
from sweeps.errors import SceneError
from sweeps.planning.blocks import Block, along, blocks, cut, holds
from sweeps.planning.memory import check_memory
from sweeps.planning.plan import Plan, Stage, make_plan
from sweeps.running.elasticities import Results, differences
from sweeps.running.progress import progress_bar
from sweeps.running.side_by_side import computed_side_by_side
from sweeps.running.uncertainty import bands
from sweeps.scene.keywords import Tables, tables_in_signature
from sweeps.scene.known_values import Value
from sweeps.scene.model import Scene
from sweeps.scene.reading import read_scene

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["compute", "computed", "run"]


@tables_in_signature
def run(
    scene: str | Path | Mapping[str, Any] | Scene | None = None,
    *,
    progress: bool = False,
    threads: int | None = None,
    **tables: Unpack[Tables],
) -> xr.Dataset:
    """Run a scene and return its results as a labelled dataset.

    Parameters
    ----------
    scene : str, Path, dict or Scene, optional
        Path of a scene file, name of a built-in scene, dict of the same shape, or a Scene.
    progress : bool
        Show a progress bar on the terminal for runs of more than a second.
    threads : int, optional
        As many as the machine has processors, unless given.
    **tables
        Tables of a scene as keywords: `engine`, `set`, `axes`, `designs`, `output` and so on, in
        place of `scene` or replacing tables of it; see `sweeps.read_scene`.

    Returns
    -------
    xarray.Dataset
        One variable for each quantity, on the axes that it depends on, in the units of
        `engine-dyn list quantities`; `status` beside everything that can fail.

    Raises
    ------
    SceneError
        One line, for a scene that cannot be run: see `read_scene`; also one larger than memory.

    Warns
    -----
    engine_dyn.ImplausibleWarning
        One line for each measure that engines do not have, which often is in another unit. The
        lines are the attribute `warnings` of the dataset. The key `silenced_warnings` of the scene
        names those that are meant so (docs/plausibility.md).

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run(
    ...     engine="ntua",
    ...     set={"speed": 1500, "load": 90},
    ...     axes={"inertia": [2, 4]},
    ...     output={"quantities": ["delta"]},
    ... )
    >>> archive.delta.dims
    ('inertia',)
    >>> archive.delta.values.round(4)
    array([0.0814, 0.0405])
    """
    from sweeps.archive.labels import label

    threads = thread_count(threads)
    plan = make_plan(read_scene(scene, **tables))
    check_memory(plan)
    began = time.perf_counter()
    results = compute(plan, progress=progress, threads=threads)
    dataset = label(plan, results, seconds=time.perf_counter() - began)
    for line in dataset.attrs["warnings"].splitlines():
        warnings.warn(line, ImplausibleWarning, stacklevel=2)
    return dataset


def compute(
    plan: Plan, *, progress: bool = False, threads: int | None = None
) -> dict[str, npt.NDArray[Any]]:
    """Arrays of the plan's outputs, in SI units, on the dimensions of their stages.

    No other array as large as an output exists at any time: see `sweeps.planning.blocks`.
    """
    results: dict[str, npt.NDArray[Any]] = {}
    lengths = cut(plan)
    for block, found in computed(
        plan, lengths, blocks(plan, lengths), progress=progress, threads=threads
    ):
        for name, values in found.items():
            dims = plan.dims(name)
            shape = tuple(plan.sizes[d] for d in dims)
            if values.shape == shape:
                results[name] = values
                continue
            if name not in results:
                results[name] = np.empty(shape, dtype=values.dtype)
            results[name][along(dims, block)] = values
    return {name: results[name] for name in plan.outputs}


def computed(
    plan: Plan,
    lengths: Mapping[str, int],
    chosen: Iterable[Block],
    *,
    progress: bool = False,
    threads: int | None = None,
    all_in_each: bool = False,
) -> Iterator[tuple[Block, dict[str, npt.NDArray[Any]]]]:
    """Compute some blocks of a plan, one after the other.

    Parameters
    ----------
    plan : Plan
        What is computed.
    lengths : mapping
        How the plan is cut: see `sweeps.planning.blocks`. What depends on none of these axes is
        computed once, whatever blocks are chosen.
    chosen : iterable of blocks
        Which of its blocks.
    progress : bool
        Show a progress bar.
    threads : int, optional
        As many as the machine has processors, unless given.
    all_in_each : bool
        Whether every block has all outputs, also those that are the same in several blocks.

    Yields
    ------
    block, results
        The block, and the outputs that it contains (see `blocks.holds`), in SI units: the same
        bits however the plan is cut.
    """
    if plan.parts:
        compute_part = partial(computed, progress=progress, threads=threads, all_in_each=True)
        yield from computed_side_by_side(plan, lengths, chosen, compute_part)
        return
    family = plan.leaves["family"].data
    if isinstance(family, CycleTable):
        family.use_threads(threads)
    of_stages = [stage for stage in plan.stages if stage.node.name not in plan.afterwards]
    once = tuple(stage for stage in of_stages if not lengths.keys() & set(stage.dims))
    each = tuple(stage for stage in of_stages if lengths.keys() & set(stage.dims))
    outputs = [name for name in plan.outputs if name not in plan.afterwards]
    dims = {name: plan.dims(name) for name in outputs}
    afterwards = []
    if plan.afterwards:
        chosen = list(chosen)
        afterwards = _afterwards(plan, lengths, chosen, threads)
    with _Bars(progress) as bars:
        values = _computed(plan, once, plan.leaves, {}, bars, threads)
        for block in chosen:
            here = _computed(plan, each, values, block, bars, threads)
            if not (each or all_in_each):
                values = {}
            results = {
                name: _filled(here.pop(name).si, dims[name], block, plan)
                for name in outputs
                if all_in_each or holds(block, dims[name])
            }
            here = {}  # only the outputs stay in memory while the caller uses them
            for more in afterwards:
                results |= next(more)(results)
            yield block, results


def _afterwards(
    plan: Plan, lengths: Mapping[str, int], chosen: list[Block], threads: int | None
) -> list[Iterator[Callable[[Results], Results]]]:
    """For each block, what follows from its results and those of plans with other values."""

    def of_plan(other: Plan) -> Iterator[tuple[Block, Results]]:
        return computed(other, lengths, chosen, threads=threads)

    found = []
    if plan.elasticities is not None:
        found.append(differences(plan, chosen, of_plan))
    if plan.uncertainty is not None:
        found.append(bands(plan, chosen, of_plan))
    return found


def _computed(
    plan: Plan,
    stages: tuple[Stage, ...],
    given: Mapping[str, Value],
    block: Mapping[str, slice],
    bars: _Bars,
    threads: int | None,
) -> dict[str, Value]:
    """Values of some stages for one block, and the given values that are still needed."""
    values = {
        name: replace(value, data=value.data[along(value.dims, block)]) if value.dims else value
        for name, value in given.items()
    }
    waiting = _uses(plan.stages)
    for stage in stages:
        node = stage.node
        if node.make is None:  # a result of a kernel, which its stage has given
            continue
        needs = {name: values[name] for name in node.needs}
        if node.kind == "stage":
            wanted = plan.wanted(stage)
            bundle = node.make(
                **{n: _aligned(v, stage.axes, n) for n, v in needs.items()},
                wanted=wanted,
                threads=threads,
                progress=bars.of(stage),
            )
            dims = {s.node.name: s.dims for s in stages}
            values |= {name: Value(bundle[name], dims[name]) for name in wanted}
        else:
            before = _dims_of_needs(plan, stage)
            arguments = {n: _aligned(v, before, n) for n, v in needs.items()}
            if node.threaded:
                arguments["threads"] = threads
            try:
                data = node.make(**arguments)
            except ValueError as error:  # what only the physics can refuse, in its own words
                raise SceneError(f"{plan.name}: {error}") from None
            values[node.name] = Value(np.asarray(data), stage.dims)
        for need in node.needs:
            waiting[need] -= 1
            # In one piece, values that have served are dropped; blocks need the common ones again.
            if waiting[need] == 0 and need not in plan.outputs and need not in given:
                values.pop(need)
    return values


def _dims_of_needs(plan: Plan, stage: Stage) -> tuple[str, ...]:
    """Dimensions of what a node takes: those it adds it makes itself, those it removes it needs."""
    node = stage.node
    if not node.removes:
        return tuple(d for d in stage.dims if d not in node.adds)
    found = {*stage.dims, *node.removes} - {*node.adds}
    return tuple(d for d in (*plan.scene.dimensions, *DIMENSIONS) if d in found)


def _filled(
    data: npt.NDArray[Any], dims: tuple[str, ...], block: Block, plan: Plan
) -> npt.NDArray[Any]:
    """Array of the full shape of a block; copied only where it was broadcast or is padded."""
    array = np.asarray(data)
    places = [block.get(d, slice(0, plan.sizes[d])) for d in dims]
    shape = tuple(place.stop - place.start for place in places)
    if array.shape == shape:
        return array
    short = [d in DIMENSIONS and n < m for d, n, m in zip(dims, array.shape, shape, strict=True)]
    if any(short):
        # A block may lack the engines with most cylinders, and so the last throws.
        padded = np.full(shape, np.nan)
        ends = zip(short, array.shape, strict=True)
        padded[tuple(slice(n) if cut else slice(None) for cut, n in ends)] = array
        return padded
    return np.array(np.broadcast_to(array, shape))


def _uses(stages: tuple[Stage, ...]) -> dict[str, int]:
    uses: dict[str, int] = {}
    for stage in stages:
        for need in stage.node.needs:
            uses[need] = uses.get(need, 0) + 1
    return uses


def _aligned(value: Value, dims: tuple[str, ...], name: str) -> Any:
    """Array with one axis for each of `dims`, of size 1 where the value does not depend on it.

    Constants and the angles of a kernel go through as they are.
    """
    if not value.dims or not set(value.dims) <= set(dims):
        if not set(value.dims) <= set(DIMENSIONS):
            raise AssertionError(f"{name} has {value.dims}, its stage {dims}")
        return value.si
    places = [dims.index(d) for d in value.dims]
    shape = [1] * len(dims)
    for place, size in zip(places, np.shape(value.data), strict=True):
        shape[place] = size
    return np.reshape(value.si, shape)


class _Bars:
    """Progress bars over the designs of the kernels; nothing when not asked for."""

    def __init__(self, show: bool) -> None:
        self.show = show
        self.bars: dict[str, Any] = {}

    def of(self, stage: Stage) -> Callable[[int], None] | None:
        """What to call with the number of designs done."""
        if not self.show:
            return None
        name = stage.node.name
        if name not in self.bars:
            # `delay`: runs of less than a second show nothing.
            self.bars[name] = progress_bar(
                total=stage.size, unit=" designs", unit_scale=True, delay=1.0, leave=False,
                desc=name, file=sys.stderr,
            )  # fmt: skip
        update: Callable[[int], None] = self.bars[name].update
        return update

    def __enter__(self) -> _Bars:
        return self

    def __exit__(self, *_: object) -> None:
        for bar in self.bars.values():
            bar.close()
