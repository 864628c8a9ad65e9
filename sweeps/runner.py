"""Run a plan: stages in order, arrays without names in, arrays without names out."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sweeps.errors import SceneError
from sweeps.plan import CRANK_ANGLE, Plan, Stage, Value, make_plan
from sweeps.scene import Scene, read_scene

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["compute", "run"]


def run(
    scene: str | Path | Mapping[str, Any] | Scene,
    *,
    progress: bool = False,
    threads: int | None = None,
) -> xr.Dataset:
    """Run a scene and return its results as a labelled dataset.

    Parameters
    ----------
    scene : str, Path, dict or Scene
        Path of a scene file, name of a built-in scene, dict of the same shape, or a Scene.
    progress : bool
        Show a progress bar on the terminal for runs of more than a second.
    threads : int, optional
        As many as the machine has processors, unless given.

    Returns
    -------
    xarray.Dataset
        One variable for each quantity, on the axes that it depends on, in the units of
        `engine-dyn list quantities`; `status` beside everything that can fail.

    Raises
    ------
    SceneError
        One line, for a scene that cannot be run: see `read_scene`; also one larger than memory.
    """
    from sweeps.dataset import label

    plan = make_plan(read_scene(scene))
    plan.check_memory()
    began = time.perf_counter()
    results = compute(plan, progress=progress, threads=threads)
    return label(plan, results, seconds=time.perf_counter() - began)


def compute(
    plan: Plan, *, progress: bool = False, threads: int | None = None
) -> dict[str, npt.NDArray[Any]]:
    """Arrays of the plan's outputs, in SI units, on the dimensions of their stages."""
    values: dict[str, Value] = dict(plan.leaves)
    waiting = _uses(plan)
    for stage in plan.stages:
        node = stage.node
        if node.make is None:  # a result of a kernel: already there
            continue
        needs = {name: values[name] for name in node.needs}
        if node.kind == "stage":
            with _Bar(plan, stage, progress) as tick:
                bundle = node.make(
                    **{n: _aligned(v, stage.axes, n) for n, v in needs.items()},
                    wanted=plan.wanted(stage),
                    threads=threads,
                    progress=tick,
                )
            for name in plan.wanted(stage):
                dims = next(s.dims for s in plan.stages if s.node.name == name)
                values[name] = Value(bundle[name], dims)
        else:
            # What the node adds, it makes itself: its needs do not have that dimension.
            dims = tuple(d for d in stage.dims if d not in node.adds)
            try:
                data = node.make(**{n: _aligned(v, dims, n) for n, v in needs.items()})
            except ValueError as error:  # what only the physics can refuse, in its own words
                raise SceneError(f"{plan.name}: {error}") from None
            values[node.name] = Value(np.asarray(data), stage.dims)
        for need in node.needs:
            waiting[need] -= 1
            if waiting[need] == 0 and need not in plan.outputs:
                values.pop(need)
    shapes = {s.node.name: tuple(plan.sizes[d] for d in s.dims) for s in plan.stages}
    return {name: _filled(values[name].data, shapes.get(name)) for name in plan.outputs}


def _filled(data: npt.NDArray[Any], shape: tuple[int, ...] | None) -> npt.NDArray[Any]:
    """Array of the whole shape; copied only where it was broadcast."""
    array = np.asarray(data)
    return (
        array if shape is None or array.shape == shape else np.array(np.broadcast_to(array, shape))
    )


def _uses(plan: Plan) -> dict[str, int]:
    uses: dict[str, int] = {}
    for stage in plan.stages:
        for need in stage.node.needs:
            uses[need] = uses.get(need, 0) + 1
    return uses


def _aligned(value: Value, dims: tuple[str, ...], name: str) -> Any:
    """Array with one axis for each of `dims`, of size 1 where the value does not depend on it.

    Constants and the angles of a kernel go through as they are.
    """
    if not value.dims or not set(value.dims) <= set(dims):
        if value.dims and value.dims != (CRANK_ANGLE,):
            raise AssertionError(f"{name} has {value.dims}, its stage {dims}")
        return value.data
    places = [dims.index(d) for d in value.dims]
    shape = [1] * len(dims)
    for place, size in zip(places, np.shape(value.data), strict=True):
        shape[place] = size
    return np.reshape(value.data, shape)


class _Bar:
    """Progress bar over the designs of a stage; nothing when not asked for."""

    def __init__(self, plan: Plan, stage: Stage, show: bool) -> None:
        self.bar: Any = None
        if show:
            from tqdm import tqdm

            # `delay`: runs of less than a second show nothing.
            self.bar = tqdm(
                total=stage.size, unit=" designs", unit_scale=True, delay=1.0, leave=False,
                desc=stage.node.name, file=sys.stderr,
            )  # fmt: skip

    def __enter__(self) -> Callable[[int], None] | None:
        return self.bar.update if self.bar is not None else None

    def __exit__(self, *_: object) -> None:
        if self.bar is not None:
            self.bar.close()
