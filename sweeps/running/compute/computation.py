"""Run a plan: stages in order, arrays without names in, arrays without names out."""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Unpack

import numpy as np
import numpy.typing as npt

from engine_dyn.pressure.cycle_table import CycleTable
from engine_dyn.quantities.graph import DIMENSIONS
from engine_dyn.status import INVALID_INPUT
from engine_dyn.types import Integers
from sweeps.base.dimensions import PARAMETER, STATUS
from sweeps.base.errors import SceneError
from sweeps.base.one_thread import linear_algebra_on_one_thread
from sweeps.scene.keywords import Tables, tables_in_signature
from sweeps.scene.known_values import Value
from sweeps.scene.model import Scene
from sweeps.scene.plan.blocks import Block, Results, aligned, belongs, index_of, shape_in
from sweeps.scene.plan.plan import Part, Plan, Stage, make_plan
from sweeps.scene.plan.shards import by_cycles
from sweeps.scene.reading import read_scene

MOST_CHECKED = 1 << 20
"""Largest number of values of a quantity that are computed to see whether the physics refuses any
of them."""


class Computation:
    """A plan while its blocks are computed, in any order; a context that closes its progress bars.

    What no block changes is computed once. The plans of several engines, and plans with other
    values, are computations too, which go block by block with this one: no more than a block of
    any exists at a time. The numbers are the same bits however the plan is divided.

    Parameters
    ----------
    plan : Plan
        What is computed.
    lengths : mapping
        How the plan is divided into blocks: see `sweeps.scene.plan.blocks`.
    progress : bool or callable
        Show a progress bar; or what to call with the numbers of designs done, where one stage
        solves all designs of the plan.
    threads : int, optional
        As many as the machine has processors, unless given.
    device : str
        What solves the designs: see `run`.
    all_in_each : bool
        Whether every block has all outputs, also those that are the same in several blocks.
    """

    def __init__(
        self, plan: Plan, lengths: Mapping[str, int], *,
        progress: bool | Callable[[int], None] = False, threads: int | None = None,
        device: str = "cpu", all_in_each: bool = False,
    ) -> None:  # fmt: skip
        self.plan = plan
        self.threads = threads
        self.device = device
        self.all_in_each = all_in_each
        self.bars = _Bars(progress, plan)
        rest, of_periods = by_cycles(plan)
        self.of_periods = None if of_periods is None else Computation(
            of_periods, lengths, progress=progress, threads=threads, device=device,
            all_in_each=all_in_each,
        )  # fmt: skip
        self.rest = rest
        self.dims = {n: plan.dims(n) for n in rest.outputs if n not in plan.afterwards}
        self.parts = [
            Computation(
                part.plan, {d: n for d, n in lengths.items() if d in part.plan.scene.dimensions},
                progress=progress, threads=threads, device=device, all_in_each=True,
            )
            for part in plan.parts
        ]  # fmt: skip
        self.varied = [
            [Computation(p, lengths, threads=threads, device=device) for p in variation.plans]
            for variation in plan.variations
        ]
        # All other nodes are results of kernels, which their stages give, and variables of
        # variations.
        self.stages = [stage for stage in rest.stages if stage.node.make is not None]
        self.uses = Counter(need for stage in self.stages for need in stage.node.needs)
        given = [(name, value) for name, value in plan.leaves.items() if name in self.uses]
        # Columns stay in the units of files until a stage takes them.
        self.known = {name: v if v.dims else Value(v.si) for name, v in given}
        self.varying = [s for s in self.stages if not lengths.keys().isdisjoint(s.dims)]
        self.common: set[str] = set()
        if lengths or all_in_each:  # Common results are needed in all blocks
            self.known = {name: _read_only(value) for name, value in self.known.items()}
            once = [stage for stage in self.stages if stage not in self.varying]
            again = {need for stage in self.varying for need in stage.node.needs}
            for stage in once:
                kernel = stage.node.kind == "stage"
                self.common.update(rest.wanted(stage) if kernel else (stage.node.name,))
            self.common &= again.union(rest.outputs)
        family = plan.leaves["family"].data
        if isinstance(family, CycleTable):
            family.use_threads(threads)

    def __enter__(self) -> Computation:
        return self

    def __exit__(self, *_: object) -> None:
        self.bars.close()
        for one in (self.of_periods, *self.parts):
            if one is not None:
                one.__exit__()

    def results(self, block: Block) -> Results:
        """Outputs of a block that belong to it (see `blocks.belongs`), in SI units.

        They are the caller's, who may change them.
        """
        with linear_algebra_on_one_thread():
            results = self._results(block)
        self.bars.done(block)
        return results

    def _results(self, block: Block) -> Results:
        if self.plan.parts:
            return self._of_parts(block)
        values = {
            name: v._replace(data=v.data[index_of(v.dims, block)]) if v.dims and block else v
            for name, v in self.known.items()
        }
        uses = self.uses.copy()
        for stage in self.stages:
            node = stage.node
            assert node.make is not None
            arguments = _arguments(self.plan, stage, values)
            if node.on_card:
                arguments["device"] = self.device
            if node.kind == "stage":
                wanted = self.rest.wanted(stage)
                bundle = node.make(
                    **arguments, wanted=wanted, threads=self.threads, progress=self.bars.of(stage)
                )
                values |= {name: Value(bundle[name], self.plan.dims(name)) for name in wanted}
            else:
                if node.threaded:
                    arguments["threads"] = self.threads
                values[node.name] = _made(self.plan, stage, arguments)
            kept = (*self.rest.outputs, *self.common)
            for need in node.needs:
                uses[need] -= 1
                if uses[need] == 0 and need not in self.known and need not in kept:
                    values.pop(need)  # No later stage takes this value
        if self.common:  # Results that all blocks share are kept from the first one
            again = {name: _read_only(values[name]) for name in self.common}
            values, self.known = values | again, self.known | again
            self.stages, self.common = self.varying, set()
        results: Results = {}
        for name, dims in self.dims.items():
            if self.all_in_each or belongs(block, dims):
                array = _filled(values.pop(name).si, dims, shape_in(self.plan, dims, block))
                results[name] = array if array.flags.writeable else array.copy()
        if self.of_periods is not None:
            results |= self.of_periods.results(block)
        for variation, others in zip(self.plan.variations, self.varied, strict=True):
            from sweeps.running.compute.variations import bands_of, elasticities_of

            changed = [other.results(block) for other in others]
            if variation.dimension == PARAMETER:
                results |= elasticities_of(self.plan, variation, block, results, changed)
            else:
                results |= bands_of(variation, results, changed)
        return results

    def _of_parts(self, block: Block) -> Results:
        """Outputs of a block of several plans: those of each plan, at their places."""
        # Results that an engine does not have stay missing: numbers are NaN, and the outcome of a
        # design whose engine lacks a needed part is `invalid_input`. Curves of firing patterns
        # repeat until the longest pattern ends, and orders that do not belong to their period are
        # 0.
        plan, results = self.plan, Results()
        outputs = {n: d for n, d in self.dims.items() if self.all_in_each or belongs(block, d)}
        within = {d: slice(0, plan.sizes[d]) for dims in outputs.values() for d in dims} | block
        for part, computation in zip(plan.parts, self.parts, strict=True):
            inside = {d: _inside(part.places.get(d), whole) for d, whole in within.items()}
            if not all(inside[d][0].size for d in block):
                continue  # No design of this part lies in the block
            own = {d: inside[d][1] for d in block if d in part.plan.scene.dimensions}
            for name, values in computation.results(own).items():
                if name in outputs:
                    dims = outputs[name]
                    if name not in results:
                        results[name] = _missing(plan, name, block, values.dtype)
                    here = np.ix_(*(inside[d][0] for d in dims))
                    own_values = aligned(values, part.plan.dims(name), dims)
                    results[name][here] = _repeated(own_values, part, dims)
        for name in (name for name in outputs if name not in results):
            kind = np.int8 if name == STATUS else np.float64
            results[name] = _missing(plan, name, block, kind)
        return results


def _inside(positions: Integers | None, whole: slice) -> tuple[Integers, slice]:
    """The part's positions within a range of the whole (by default all), as a range of its own."""
    if positions is None:
        return np.arange(whole.stop - whole.start), whole
    begin, end = np.searchsorted(positions, [whole.start, whole.stop])
    return positions[begin:end] - whole.start, slice(int(begin), int(end))


def _missing(plan: Plan, name: str, block: Block, kind: npt.DTypeLike) -> npt.NDArray[Any]:
    """Array of a block without any results yet."""
    fill = INVALID_INPUT if np.issubdtype(kind, np.integer) else np.nan
    return np.full(shape_in(plan, plan.dims(name), block), fill, dtype=kind)


def _repeated(values: npt.NDArray[Any], part: Part, dims: tuple[str, ...]) -> npt.NDArray[Any]:
    """Results at all points of the whole plan, from those at a part's own points."""
    for dimension, own in part.own.items():
        if dimension in dims:
            axis = dims.index(dimension)
            values = np.take(values, own, axis=axis)
            other = np.expand_dims(own < 0, [n for n in range(len(dims)) if n != axis])
            if other.any():
                values = np.where(other & ~np.isnan(values), 0.0, values)
    return values


def check_given(plan: Plan) -> None:
    """Refuse, without any kernel, what `Computation` would refuse when it is computed.

    That is what follows from given numbers alone, without the diagram, unless there are very many
    of them.

    Raises
    ------
    SceneError
        In the words of the physics.
    """
    for part in plan.parts:
        check_given(part.plan)
    if plan.parts:
        return
    given = {name: value for name, value in plan.leaves.items() if name != "family"}
    values = {name: v if v.dims else Value(v.si) for name, v in given.items()}
    for stage in plan.stages:
        node = stage.node
        plain = (
            node.make is not None
            and node.kind in ("constant", "value", "curve")
            and not node.threaded
        )
        few = math.prod(plan.sizes[d] for d in stage.dims) <= MOST_CHECKED
        if plain and few and values.keys() >= {*node.needs}:
            values[node.name] = _made(plan, stage, _arguments(plan, stage, values))


def _arguments(plan: Plan, stage: Stage, values: Mapping[str, Value]) -> dict[str, Any]:
    """Arguments of a node, by name."""
    taken = _dims_taken(plan, stage)
    return {
        name: _aligned(values[name], taken, name) if values[name].dims else values[name].data
        for name in stage.node.needs
    }


def _made(plan: Plan, stage: Stage, arguments: Mapping[str, Any]) -> Value:
    """Value of a node that is no stage."""
    assert stage.node.make is not None
    try:
        data = stage.node.make(**arguments)
    except ValueError as error:  # The physics refuses the value in its own words
        raise SceneError(f"{plan.name}: {error}") from None
    return Value(np.asarray(data), stage.dims)


def _read_only(value: Value) -> Value:
    """A value that results cannot change, because later blocks need it again."""
    if not isinstance(value.data, np.ndarray):
        return value
    data = value.data.view()
    data.flags.writeable = False
    return value._replace(data=data)


def _dims_taken(plan: Plan, stage: Stage) -> tuple[str, ...]:
    """Dimensions of a node's arguments: with those that it removes, without those that it adds."""
    node = stage.node
    if node.kind == "stage":
        return stage.axes
    if not (node.adds or node.removes):
        return stage.dims
    taken = {*stage.dims, *node.removes} - {*node.adds}
    return tuple(d for d in (*plan.scene.dimensions, *DIMENSIONS) if d in taken)


def _filled(
    data: npt.NDArray[Any], dims: tuple[str, ...], shape: tuple[int, ...]
) -> npt.NDArray[Any]:
    """Array of the full shape of a block; copied only where it was broadcast or is padded."""
    array = np.asarray(data)
    if array.shape == shape:
        return array
    short = [d in DIMENSIONS and n < m for d, n, m in zip(dims, array.shape, shape, strict=True)]
    if any(short):
        padded = np.full(shape, np.nan)  # All engines of a block may lack the last throws
        ends = zip(short, array.shape, strict=True)
        padded[tuple(slice(n) if fewer else slice(None) for fewer, n in ends)] = array
        return padded
    return np.array(np.broadcast_to(array, shape))


def _aligned(value: Value, dims: tuple[str, ...], name: str) -> Any:
    """Array with one axis for each of `dims`, of size 1 where the value does not depend on it."""
    # Dimensions that a kernel takes whole, such as the crank angle, follow the axes of designs.
    if set(value.dims) <= set(DIMENSIONS) - set(dims):
        return value.si
    whole = tuple(d for d in value.dims if d in DIMENSIONS and d not in dims)
    if not set(value.dims) <= {*dims, *whole}:
        raise AssertionError(f"{name} has {value.dims}, its stage {dims}")
    return aligned(value.si, value.dims, (*dims, *whole))


class _Bars:
    """Progress bars over the designs of the kernels; nothing unless they are asked for."""

    def __init__(self, show: bool | Callable[[int], None], plan: Plan) -> None:
        self.show, self.plan = show, plan
        self.counted = ""
        self.bars: dict[str, Any] = {}
        # Where no kernel counts designs, finished blocks are counted.
        kernels = any(s.node.kind == "stage" and s.node.make is not None for s in plan.stages)
        self.of_blocks = "" if kernels or plan.parts or show is not True else "designs"
        if self.of_blocks:
            self._open(self.of_blocks, plan.designs)

    def done(self, block: Block) -> None:
        """Count a finished block, where no kernel has counted its designs."""
        if self.of_blocks:
            designs = math.prod(shape_in(self.plan, self.plan.scene.dimensions, block))
            self.bars[self.of_blocks].update(designs)

    def of(self, stage: Stage) -> Callable[[int], None] | None:
        """Function to call with the number of designs done."""
        if not self.show:
            return None
        name = stage.node.name
        if callable(self.show):
            self.counted = self.counted or (name if stage.size == self.plan.designs else "")
            return self.show if name == self.counted else None
        if name not in self.bars:
            self._open(name, stage.size)
        update: Callable[[int], None] = self.bars[name].update
        return update

    def _open(self, name: str, total: int) -> None:
        from sweeps.running.compute.progress import progress_bar

        self.bars[name] = progress_bar(
            total=total, unit=" designs", unit_scale=True, desc=name, file=sys.stderr
        )

    def close(self) -> None:
        """Remove them from the terminal."""
        for bar in self.bars.values():
            bar.close()


@tables_in_signature
def plan(
    scene: str | Path | Mapping[str, Any] | Scene | None = None, **tables: Unpack[Tables]
) -> Plan:
    """Plan a scene: what would be computed, on which axes; no design is solved.

    Parameters
    ----------
    scene : str, Path, dict or Scene, optional
        As `sweeps.run` takes it.
    **tables
        Tables of a scene; see `sweeps.read_scene`.

    Returns
    -------
    Plan
        Its stages and the axes that each depends on; a notebook shows them as a table. What
        `engine-dyn plan` tells of time and memory is `sweeps.scene.plan.forecast.text(plan)`.

    Raises
    ------
    SceneError
        As `sweeps.run`.

    Examples
    --------
    >>> import sweeps
    >>> sweeps.plan("first").designs
    75
    """
    made = make_plan(read_scene(scene, **tables))
    if made.scene.reduce is not None:
        # Imported here, because other scenes need no labels of archives
        from sweeps.running.reduce.reduction import Reduction

        Reduction(made)  # Making it checks conditions and searches
    check_given(made)
    return made
